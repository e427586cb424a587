"""Every figure of every command: what drawing takes beyond computing, and all on one sheet.

``python -m benchmarks.bench_figures FOLDER [PART [WIDTH]]`` draws those whose name holds PART into
a folder, WIDTH mm wide, and a contact sheet of them.
"""

from __future__ import annotations

import contextlib
import io
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

AIM = 1.0  # second beyond the computation

TAILPLANE = """\
title = "tailplane in SI units"

[section]
zeta_alpha = 0.015
zeta_xi = 0.015

[section.si]
m = 35.0
b = 0.45
rho = 1.225
axis_percent_chord = 38.0
cg_percent_chord = 43.0
r = 0.23
frequency_h_hz = 9.0
frequency_alpha_hz = 21.0

[spring]
kind = "hysteresis"
friction_deg = 0.03
gap_deg = 0.15

[initial]
alpha_deg = 1.0
"""
TWO_HINGES = """\
title = "two worn hinges"

[section]
omega_bar = 0.6
zeta_xi = 0.01
zeta_alpha = 0.01

[flap]
hinge = 0.5
x_beta = 0.0125
r_beta = 0.08
omega_beta = 4.0

[[spring]]
at = "pitch"
kind = "freeplay"
gap_deg = 0.5

[[spring]]
at = "flap"
kind = "freeplay"
gap_deg = 1.0

[initial]
alpha_deg = 3.0
"""
WING = Path(__file__).parents[1] / "tests" / "data" / "bah_plane_qhh.op4"
CARDS = ([0.001, 0.05, 0.1, 0.2, 0.5, 1.0, 1.2, 1.5], [2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 10.0])
K = [k for card in CARDS for _ in range(2) for k in card]
MACH = [mach for card in CARDS for mach in (0.0, 0.2) for _ in card]
IMPORTED = f"""\
title = "BAH wing with a worn hinge"

[model]
kind = "modal"
file = "{WING}"
semichord = 2.0
density = 1.225
k = {K}
mach = {MACH}
at_mach = 0.2
M = {[1.0] * 10}
K = [0.0, 0.0, 237.7467, 556.3491, 2989.911, 3199.282, 8308.047, 19385.00, 67106.59, 126280.9]
lags = 8
exact = [0.0]
speed_range = [100.0, 700.0]
rows = [[0, 0, 0, 1, 0, 0, 0, 0, 0, 0]]
stiffness = [556.3491]
names = ["hinge"]
units = ["rad"]

[[spring]]
at = "hinge"
kind = "freeplay"
gap_deg = 1.0
"""

QUICK = "--simulations 0 --depth 0"
COMMANDS = {
    "rootlocus": "rootlocus run14",
    "rootlocus-si": "rootlocus naca496",
    "rootlocus-flap": "rootlocus conner",
    "rootlocus-wing": "rootlocus wing.toml",
    "rootlocus-vary": "rootlocus run14 --vary section.x_alpha=0.15:0.35:5",
    "rootlocus-stiffness": "rootlocus run14 --stiffness-curve 0.2:1.5:40",
    "df": "df run14",
    "df-run102": "df run102",
    "df-preload": "df preload-02",
    "df-cubic": "df cubic-02",
    "df-linear": "df linear-08",
    "df-vary": "df run14 --vary spring.delta_h_deg=0.1:0.9:5 --points 60",
    "lco": f"lco run14 {QUICK}",
    "lco-run102": "lco run102",
    "lco-flap": "lco conner --simulations 10",
    "lco-at": f"lco run14 {QUICK} --speed-ratio 0.95",
    "lco-si": f"lco tail.toml {QUICK}",
    "lco-overlays": f"lco run14 {QUICK} --df --simulate 0.92:0.98:7",
    "lco-multipliers": "lco run102 --figure multipliers",
    "lco-multipliers-at": f"lco run14 {QUICK} --speed-ratio 0.95 --figure multipliers",
    "lco-vary": f"lco tail.toml {QUICK} --points 60 --vary spring.gap_deg=0.05,0.15,0.3,0.5",
    "hb": "hb run14",
    "hb-freeplay": "hb freeplay-02 --harmonics 9",
    "loop": "loop run14 --speed-ratio 0.95",
    "loop-run102": "loop run102 --speed-ratio 0.9",
    "onset": "onset run14",
    "onset-chart": "onset run14 --chart 0.5:0.98:9",
    "onset-vary": "onset run14 --vary section.x_alpha=0.2,0.25,0.3",
    "tolerance": "tolerance run14 --speed-ratio 0.96 --amplitude-deg 1",
    "tolerance-gap": "tolerance tail.toml --velocity 177 --amplitude-deg 0.5 --vary gap",
    "spring": "spring run14",
    "spring-preload": "spring preload-02",
    "simulate": "simulate run14 --speed-ratio 0.95",
    "simulate-run102": "simulate run102 --speed-ratio 0.8",
    "simulate-damped": "simulate run14 --speed-ratio 0.85",
    "simulate-si": "simulate tail.toml --velocity 157.3",
    "simulate-traces": "simulate run14 --speed-ratio 0.95 --figure traces",
    "simulate-psd": "simulate run14 --speed-ratio 0.95 --figure psd",
    "simulate-sweep": "simulate run102 --sweep 0.55:0.98:30",
    "simulate-two": "simulate two.toml --speed-ratio 0.7",
    "chaos": "chaos freeplay-02 --speed-ratio 0.3 --cycles 500",
    "chaos-scan": "chaos freeplay-02 --speed-ratio 0.2:0.36:24 --cycles 200",
    "map": "map run14",
    "map-run102": "map run102 --speed-ratio 0.5:0.99:50",
    "map-si": "map tail.toml --velocity 90:190:41",
    "map-key": "map run14 --x spring.delta_h_deg=0.1:1:20 --speed-ratio 0.95",
    "sweep": "sweep tail.toml --vary section.si.m=normal(35,2) --sample 40",
    "sweep-few": "sweep run14 --vary section.mu=normal(100,5) --sample 5",
    "pk": "pk wing.toml",
    "pk-fit": "pk wing.toml --figure fit",
    "reproduce-a": "reproduce --only 5.12a",
    "reproduce-c": "reproduce --only 5.12c",
    "reproduce-loop": "reproduce --only 5.12b",
}  # fmt: skip


@contextlib.contextmanager
def watched() -> Iterator[list[float]]:
    """Seconds of every figure that is drawn and saved, results being there already."""
    from aeroflutter.plots import layout, style

    found: list[float] = []
    make, save = layout.figure, style.save

    def started(*words: object, **more: object) -> object:
        found.append(-time.process_time())
        return make(*words, **more)  # type: ignore[arg-type]

    def ended(*words: object, **more: object) -> None:
        begin = time.process_time()
        save(*words, **more)  # type: ignore[arg-type]
        now = time.process_time()
        found[:] = [now + found[-1] if found and found[-1] < 0 else now - begin]

    with patch.object(layout, "figure", started), patch.object(style, "save", ended):
        yield found


def draw(name: str, folder: Path, width: float | None = None) -> float:
    """Draw one figure; the seconds it took beyond the computation."""
    from aeroflutter.cli import main
    from aeroflutter.plots.style import sized

    words = COMMANDS[name].split()
    if words[0] == "reproduce":
        words += ["--folder", str(folder / name), "--format", "png", "--workers", "1", "--again"]
    else:
        words += ["--plot", str(folder / f"{name}.png")]
    said = io.StringIO()
    with (
        contextlib.chdir(folder),
        sized(width),
        watched() as took,
        contextlib.redirect_stdout(said),
    ):
        code = main(words)
    if code:
        print(f"{name}: exit {code}", file=sys.stderr)
    return took[0] if took else float("nan")


def cases(folder: Path) -> None:
    """Write the case files that the commands name."""
    for name, text in (("tail", TAILPLANE), ("two", TWO_HINGES), ("wing", IMPORTED)):
        (folder / f"{name}.toml").write_text(text)


def measure() -> Iterator[tuple[str, float, str, float | None]]:
    """Seconds that drawing and saving each figure takes."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        cases(folder)
        for one in COMMANDS:
            yield one, draw(one, folder), "s", AIM


def sheet(folder: Path, part: str = "", columns: int = 4) -> Path:
    """All figures of a folder on one, named."""
    from matplotlib.figure import Figure
    from matplotlib.image import imread

    files = [
        (name, path)
        for name in COMMANDS
        if part in name
        for path in (folder / f"{name}.png", *(folder / name).glob("*.png"))
        if path.exists()
    ]
    columns = min(columns, len(files))
    rows = -(-len(files) // columns)
    drawing = Figure(figsize=(5.2 * columns, 3.0 * rows), layout="constrained")
    grid = drawing.subplots(rows, columns, squeeze=False)
    for axes in grid.flat:
        axes.set_axis_off()
    for axes, (name, path) in zip(grid.flat, files, strict=False):
        axes.imshow(imread(path))
        axes.set_title(name, fontsize=8, loc="left")
    target = folder / f"sheet{part and '-' + part}.png"
    drawing.savefig(target, dpi=150)
    return target


def main(words: list[str]) -> int:
    """Draw into a folder, then the sheet of it."""
    folder, part = Path(words[0]).resolve(), words[1] if len(words) > 1 else ""
    width = float(words[2]) if len(words) > 2 else None
    folder.mkdir(parents=True, exist_ok=True)
    cases(folder)
    for name in COMMANDS:
        if part in name:
            begin = time.process_time()
            beyond = draw(name, folder, width)
            spent = time.process_time() - begin
            print(f"{name:<20} {beyond:7.2f} s of {spent:7.2f} s", flush=True)
    print(sheet(folder, part))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
