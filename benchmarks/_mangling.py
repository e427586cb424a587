"""Command lines and files gone wrong, for every command and every kind of file that is read.

`prepare` lays out, once, whole files of every kind; a way of `WAYS` copies and spoils what it needs
of them into an empty folder, and gives the command line that is to cope with it.
"""

from __future__ import annotations

import contextlib
import io
import json
import shutil
from collections.abc import Callable
from copy import deepcopy
from functools import cache
from pathlib import Path
from random import Random

import numpy as np

from aeroflutter.case.schema import SPRINGS
from aeroflutter.case.source import builtin_names
from aeroflutter.case.template import template
from aeroflutter.cli import COMMANDS, main
from tests.mangled import MODAL, MUTATIONS, NASTY, NASTY_ARRAYS, STATE_SPACE, VALID, mat, npz

FLAPPED = """
[section]
omega_bar = 0.6
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
kind = "hysteresis"
delta_v_deg = 0.5
delta_h_deg = 1.0
[initial]
alpha_deg = 3.0
beta_rate_deg = 1.0
"""
MODEL = '[model]\nkind = "{kind}"\nfile = "model.{suffix}"\n{more}\n[spring]\n{spring}\n'
CASES = [*VALID, *map(template, SPRINGS), FLAPPED]

# What each command is asked beside the case: little, so that it answers soon.
LINES: dict[str, list[str]] = {
    "validate": [""],
    "rootlocus": ["", "--speed 1:3:5", "--speed-range 1,3", "--stiffness-curve 0.2:1:3",
                  "--vary section.mu=50,100"],
    "pk": ["--points 5", "--points 5 --figure fit", "--velocity 10,30"],
    "df": ["--points 5", "--amplitudes-deg 0.5,1", "--points 3 --vary section.mu=50,100"],
    "onset": ["", "--any-load", "--certificate proof.json", "--chart 0.8,0.9",
              "--vary section.mu=50,100"],
    "lco": ["--points 5 --simulations 0 --depth 0", "--speed-ratio 0.95 --simulations 1",
            "--points 4 --simulations 0 --df --simulate 0.9,0.95 --plot lco.png"],
    "tolerance": ["--speed-ratio 0.95 --amplitude-deg 1", "--speed 2 --amplitude-deg 1 --vary gap",
                  "--speed-ratio 0.9 --amplitude-deg 2 --vary friction"],
    "hb": ["--harmonics 1 --max-step 0.5", "--harmonics 3 --speed-ratio-range 0.9,1 --max-step 1"],
    "loop": ["--speed-ratio 0.95", "--speed 3 --harmonics 3"],
    "spring": ["", "--path-deg 0,3,-3,1", "--amplitudes-deg 0.5,1 --bias-deg 0.1"],
    "simulate": ["--speed-ratio 0.9 --duration 20", "--sweep 0.9,0.95 --duration 50",
                 "--speed 3 --engine houbolt --duration 20", "--speed 3 --figure psd"],
    "chaos": ["--speed-ratio 0.95 --cycles 40 --transient 5", "--speed 2,3 --cycles 40"],
    "map": ["--speed 1,2 --alpha-deg 1,2 --workers 0 --duration 20", "--speed-ratio 0.5 --workers 0"
            " --x section.mu=50,100 --alpha-deg 1,2 --duration 20 --refine --tolerance 0.5"],
    "sweep": ["--vary section.mu=normal(100,5) --sample 2 --workers 0",
              "--vary speed=uniform(1,3) --vary section.x_alpha=choice(0.1,0.25) --sample 4 "
              "--design sobol --onset none --workers 0"],
    "report": ["--speed-ratio 0.9,0.95 --alpha-deg 1,3 --periods 2 --out page.html"],
}  # fmt: skip
DRAWS = {*LINES} - {"validate", "report"}
CAREFREE = {
    "cases": "", "init": "new.toml", "import": "model.npz -o new.toml", "warmup": "",
    "reproduce": "--only 3.2 --workers 1 --folder figures",
}  # fmt: skip
SHORT = {name: lines[0] for name, lines in LINES.items()}
EXHIBITS = ("3.2", "5.1")
WORDS = [
    "--json", "--set", "-o", "--out", "-", "--", "", "run14", "../..", "/dev/null", "é", "1:2", ".",
    "\udcff", "A" * 300, "--=", "--no-json", "-h", "--version", "~", "%s", "{}", "\x1b[2J",
]  # fmt: skip
LISTS = [
    "1:2:3", "0.9", "0.9,0.95", "2:1:3", "0:0:2", "1:1:1", "-1:1:3", "1e-9:1e9:3", "1,,2", "1:2",
    "1:2:3:4", "nan:1:2", "1:2:1e3", "0x10", "1_0", "velocity=1:2:3", "a=1", " 1 , 2 ",
]  # fmt: skip
VARIED = [
    "section.mu=normal(100,5)", "section.r_alpha=lognormal(0.5,0.1,0.4,0.6)", "speed=uniform(1,3)",
    "spring.delta_h_deg=triangular(0.1,0.2,0.3)", "section.x_alpha=beta(0.1,0.3,2,3)",
    "section.zeta_alpha=choice(0,0.01,0.02)", "spring.kind=choice(1,2)", "title=choice(1,2)",
    "spring.0.gap_deg=uniform(0.1,0.2)", "section=normal(1,2)", "section.mu=50,100",
    "initial.alpha_deg=1:3:2", "aerodynamics.model=1,2", "section.mu.x=1:2:3", "model.file=1,2",
]  # fmt: skip
KEYS = ["section.mu", "section.omega_bar", "section.x_alpha", "section.r_alpha", "section.si.m",
        "spring.kind", "spring", "spring.delta_h_deg", "spring.points_deg", "spring.0.gap_deg",
        "spring.flap.gap_deg", "flap.hinge", "aerodynamics.model", "aerodynamics.a", "model.file",
        "initial.alpha_deg", "initial.state", "title", "section", "a.b", "", ".", "a" * 5000,
        ".".join("a" * 40), "section.mu.nu", "section..mu", "section.mü", "[section]"]  # fmt: skip
SURROUNDINGS = [
    ("AEROFLUTTER_LIMITS", ["cells=1", "cells", "=", "sheep=3", "bytes=10", "numbers=2,steps=1"]),
    ("COLUMNS", ["1", "0", "-5", "x", "10000", "20"]), ("TERM", ["dumb", "xterm", "nonsense", ""]),
    ("FORCE_COLOR", ["1"]), ("NO_COLOR", ["1"]), ("MPLBACKEND", ["Agg", "nonsense", "tkagg"]),
    ("NUMBA_DISABLE_JIT", ["x"]), ("NUMBA_CACHE_DIR", ["/dev/null", "/nonexistent", ""]),
    ("HOME", ["/nonexistent", ""]), ("XDG_CACHE_HOME", ["/dev/null"]), ("TMPDIR", ["/nonexistent"]),
    ("MPLCONFIGDIR", ["/dev/null"]), ("LC_ALL", ["C", "nonsense"]), ("LINES", ["x"]),
]  # fmt: skip

STEMS = [
    "a", "folder", "loop", "broken", "no/such", "file/a", "", ".", "..", "-", "a" * 255, "é\n",
    "\x1b[2J", "/dev/full", "/dev/null", "/proc/a", "~/a",
]  # fmt: skip
SUFFIXES = [".nc", ".png", ".svg", ".pdf", ".toml", ".zarr", ".json", ""]
NONSENSE = [
    None, -1, 0, 1e308, 1e-320, float("nan"), "x", [], {}, True, [[]], {"a": 1}, 10**30, "\ud800",
    float("inf"),
]  # fmt: skip

Way = Callable[[Path, Path, Random], list[str]]
WAYS: dict[str, Way] = {}


def way(make: Way) -> Way:
    WAYS[make.__name__.strip("_")] = make
    return make


def prepare(folder: Path) -> None:
    """Whole files of every kind that is read, made by the program where it makes them."""
    models = Path(__file__).parents[1] / "tests" / "data"
    text = (models / "bah_plane_qhh.op4").read_text().splitlines()
    heads = [number for number, line in enumerate(text) if "QHH" in line]
    (folder / "model.op4").write_text("\n".join(text[: heads[4]]))
    shutil.copy(models / "absence_run14.json", folder / "proof.json")
    with contextlib.chdir(folder):
        for name, (command, *words) in {
            "whole.zarr": ["map", *LINES["map"][0].split()],
            "drawn.zarr": ["sweep", *LINES["sweep"][0].split()],
            "result.nc": ["rootlocus", "--speed", "1,2"],
        }.items():
            _made([command, "linear-02", *words, "--out", name, "--json"])
        words = [word for number in EXHIBITS for word in ("--only", number)]
        _made(["reproduce", *words, "--workers", "1", "--folder", "figures", "--json"])
        line = "--speed-ratio 0.9,0.95 --alpha-deg 1,3 --periods 1 --out page.html --json"
        _made(["report", "linear-02", *line.split()])


def _made(words: list[str]) -> None:
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        code = main(words)
    assert code == 0, words


@way
def _case(here: Path, whole: Path, chance: Random) -> list[str]:
    """A case file, read by any command."""
    (here / "case.toml").write_bytes(mangled(chance.choice(CASES).encode(), chance))
    return _asked(chance.choice(list(LINES)), "case.toml", chance)


@way
def _model(here: Path, whole: Path, chance: Random) -> list[str]:
    """A case with a model of another program, the case or the model spoilt, read by any command."""
    kind, suffix, data = _variables(whole, chance, spoilt=chance.random() < 0.5)
    more = "lags = 1\n" if kind == "modal" else ""
    if suffix == "op4":
        more += "k = [0.1, 0.2, 0.5, 1.0]\nsemichord = 2.0\ndensity = 1.2\n"
        more += "".join(f"{name} = {[value] * 10}\n" for name, value in (("M", 1.0), ("K", 5.0)))
    spring = template(chance.choice(list(SPRINGS))).partition("[spring]")[2].partition("[")[0]
    text = MODEL.format(kind=kind, suffix=suffix, more=more, spring=spring).encode()
    (here / f"model.{suffix}").write_bytes(mangled(data, chance, 0.4))
    (here / "case.toml").write_bytes(mangled(text, chance, 0.5))
    return _asked(chance.choice(["pk", "validate", *LINES]), "case.toml", chance)


@way
def _import(here: Path, whole: Path, chance: Random) -> list[str]:
    """Models of other programs, of every format, alone or several."""
    names = []
    for number in range(chance.choice([1, 1, 1, 2, 3])):
        _, suffix, data = _variables(whole, chance, spoilt=chance.random() < 0.6)
        if chance.random() < 0.1:
            suffix = chance.choice(["npz", "mat", "nc", "h5", "op4", "txt"])
        names.append(f"model{number}.{suffix}")
        (here / names[-1]).write_bytes(mangled(data, chance, 0.6))
    keys = ["semichord", "density", "k", "M", "K", "lags", "kind", "rows", "Q", "x"]
    sets = [
        f"{chance.choice(keys)}={chance.choice(NASTY[:20])}"
        for _ in range(chance.choice([0, 0, 1, 2]))
    ]
    return ["import", *names, "-o", "new.toml", *(w for one in sets for w in ("--set", _word(one)))]


@way
def _points(here: Path, whole: Path, chance: Random) -> list[str]:
    """A table of the user's points."""
    head = chance.choice(["speed_ratio", "speed", "velocity_m_s"])
    text = f"{head},amplitude_deg\n" + "0.5,1.0\n0.6,2.0\n" * 20
    (here / "points.csv").write_bytes(mangled(text.encode(), chance))
    line = "--points 3 --simulations 0 --depth 0 --points-csv points.csv --plot points.png"
    return ["lco", chance.choice(["linear-02", "run14", "conner"]), *line.split()]


@way
def _option(here: Path, whole: Path, chance: Random) -> list[str]:
    """Any option of any command."""
    command = chance.choice(list(COMMANDS))
    words = [command, chance.choice(builtin_names()), *SHORT[command].split()] if (
        command in LINES
    ) else [command, *CAREFREE[command].split()]  # fmt: skip
    for _ in range(chance.choice([1, 1, 2, 3])):
        value = _word(chance.choice([*NASTY, *LISTS, *VARIED, *WORDS]))
        key = chance.choice(options_of(command) or ["--json"])
        words += [key, value] if chance.random() < 0.8 else [f"{key}={value}"]
    return words


@way
def _dotted(here: Path, whole: Path, chance: Random) -> list[str]:
    """Changes of the case."""
    words = []
    for _ in range(chance.choice([1, 1, 2, 4])):
        key, value = chance.choice(KEYS), chance.choice(NASTY)
        if chance.random() < 0.2:
            key = mangled(key.encode(), chance).decode("latin-1").replace("\n", " ")
        words += ["--set", _word(f"{key}={value}" if chance.random() < 0.95 else key + value)]
    if chance.random() < 0.2:
        (here / "case.toml").write_text(chance.choice(CASES))
        return _asked(chance.choice(list(LINES)), "case.toml", chance) + words
    return _asked(chance.choice(list(LINES)), chance.choice(builtin_names()), chance) + words


@way
def _varied(here: Path, whole: Path, chance: Random) -> list[str]:
    """What varies: distributions of a sweep, values of a family, axes of a map."""
    families = [name for name in LINES if "--vary" in options_of(name)]
    command = chance.choice(["sweep", "sweep", "map", *families])
    words = [command, chance.choice(builtin_names())]
    if command == "sweep":
        words += ["--sample", chance.choice(["1", "3", "0", "-1"]), "--workers", "0"]
        words += ["--onset", "none"]
    elif command == "map":
        words += ["--duration", "9", "--workers", "0"]
    else:
        words += [w for w in SHORT[command].split() if "vary" not in w]
    for _ in range(chance.choice([1, 2, 3])):
        text = chance.choice(VARIED)
        if command == "map" and chance.random() < 0.7:
            text = f"{text.partition('=')[0]}={chance.choice(LISTS)}"
        if chance.random() < 0.6:
            text = mangled(text.encode(), chance).decode("latin-1").replace("\n", " ")
        option = chance.choice(["--x", "--y", "--speed-ratio"]) if command == "map" else "--vary"
        words += [option, _word(text)]
    return words


@way
def _words(here: Path, whole: Path, chance: Random) -> list[str]:
    """Command lines of which words are lost, doubled, exchanged or cut."""
    command = chance.choice(list(LINES))
    words = [command, "run14", *SHORT[command].split(), "--json"]
    for _ in range(chance.choice([1, 2, 3])):
        i, j = chance.randrange(len(words) + 1), chance.randrange(len(words) or 1)
        change = chance.randrange(4)
        if change == 0:
            words[i : i + 1] = []
        elif change == 1:
            words[i:i] = [chance.choice([*WORDS, *COMMANDS, *LISTS])]
        elif change == 2 and words:
            words[i:i] = [words[j]]
        elif words:
            words[j] = words[j][: chance.randrange(len(words[j]) + 1)]
    return [word.replace("\0", "") for word in words]


@way
def _store(here: Path, whole: Path, chance: Random) -> list[str]:
    """The store of a map or a sweep, resumed or replaced."""
    name, command = chance.choice([("whole.zarr", "map"), ("drawn.zarr", "sweep")])
    store = here / "a.zarr"
    shutil.copytree(whole / name, store)
    files = [file for file in sorted(store.rglob("*")) if file.is_file()]
    for file in chance.sample(files, chance.randint(1, 3)):
        change = chance.random()
        if change < 0.2:
            file.unlink()
        elif change < 0.3 and file.name == "zarr.json":
            file.write_text(json.dumps(_other(json.loads(file.read_text()), chance)))
        elif change < 0.35:
            file.unlink()
            file.mkdir()
        elif change < 0.4:
            (file.parent / chance.choice(["mine.txt", "9", "zarr.json.bak"])).write_text("mine")
        else:
            file.write_bytes(mangled(file.read_bytes(), chance))
    out = chance.choice(["a.zarr", "a.zarr", "a.nc"])
    how = chance.choice(["--resume", "--resume", "--overwrite", "--json"])
    return [command, "linear-02", *LINES[command][0].split(), "--out", out, how, "--json"]


@way
def _result(here: Path, whole: Path, chance: Random) -> list[str]:
    """An earlier result or page in the place of the next one."""
    if chance.random() < 0.1:
        (here / "page.html").write_bytes(mangled((whole / "page.html").read_bytes()[:3000], chance))
        words = _asked("report", "linear-02", chance)
    else:
        (here / "result.nc").write_bytes(mangled((whole / "result.nc").read_bytes(), chance))
        words = ["rootlocus", "linear-02", "--speed", "1,2", "--out", "result.nc", "--json"]
    return words + chance.choice([[], [], ["--overwrite"]])


@way
def _proof(here: Path, whole: Path, chance: Random) -> list[str]:
    """A certificate, for the checker."""
    data = (whole / "proof.json").read_bytes()
    if chance.random() < 0.5:
        text = json.dumps(_other(json.loads(data), chance, chance.randint(1, 3)))
        (here / "proof.json").write_text(text)
    else:
        (here / "proof.json").write_bytes(mangled(data, chance))
    return ["CHECK", "proof.json"]


@way
def _figures(here: Path, whole: Path, chance: Random) -> list[str]:
    """A folder of reproduced figures, and numbers of figures."""
    words = [chance.choice([*EXHIBITS, *EXHIBITS, *WORDS, *NASTY[:20], "5.7a", "table", "5"])]
    if chance.random() < 0.7:
        shutil.copytree(whole / "figures", here / "figures")
        words = [chance.choice(EXHIBITS)]
        for file in chance.sample(sorted((here / "figures").iterdir()), 2):
            change = chance.random()
            if change < 0.2:
                file.unlink()
            elif change < 0.3:
                file.unlink()
                file.mkdir()
            elif file.suffix == ".json" and change < 0.6:
                file.write_text(json.dumps(_other(json.loads(file.read_text()), chance)))
            else:
                file.write_bytes(mangled(file.read_bytes()[:5000], chance))
    line = ["reproduce", "--workers", "1", "--folder", "figures", "--json"]
    return [*line, *(w for word in words for w in ("--only", _word(word)))]


@way
def _target(here: Path, whole: Path, chance: Random) -> list[str]:
    """Names of files to write."""
    command = chance.choice(["rootlocus", "df", "spring", "map", "init", "import", "onset"])
    (here / "folder.nc").mkdir()
    (here / "file").write_text("mine")
    (here / "loop.png").symlink_to("loop.png")
    (here / "broken.nc").symlink_to("nowhere/x.nc")
    (here / "model.npz").write_bytes(npz(STATE_SPACE))
    name = _word(chance.choice(STEMS) + chance.choice(SUFFIXES))
    if command == "init":
        return ["init", name, *chance.choice([[], ["--overwrite"]])]
    if command == "import":
        return ["import", "model.npz", "-o", name, *chance.choice([[], ["--overwrite"]])]
    option = chance.choice(["--out", "--plot"])
    if command == "onset":
        option = "--certificate"
    words = [command, "linear-02", *SHORT[command].split(), option, name]
    return words + chance.choice([[], ["--overwrite"] if command != "onset" else []])


@way
def _surroundings(here: Path, whole: Path, chance: Random) -> list[str]:
    """Variables of the environment, as words NAME=VALUE in front of the command."""
    words = []
    for name, values in chance.sample(SURROUNDINGS, 2):
        words.append(f"{name}={chance.choice(values)}")
    command = chance.choice(["validate", "rootlocus", "df", "spring", "simulate", "map"])
    return words + _asked(command, chance.choice(["run14", "conner"]), chance)


def _asked(command: str, case: str, chance: Random) -> list[str]:
    """A command line on a case, its answer in one of the forms that there are."""
    words = [command, case, *chance.choice(LINES[command]).split()]
    form = chance.choice(["text", "json", "json", "out", "plot"])
    if form == "json":
        words.append("--json")
    elif form == "out" and command in DRAWS:
        words += ["--out", "out.nc"]
    elif form == "plot" and command in DRAWS and "--plot" not in words:
        words += ["--plot", chance.choice(["plot.png", "plot.svg"])]
    return words


def _variables(whole: Path, chance: Random, *, spoilt: bool) -> tuple[str, str, bytes]:
    """A model as kind, suffix and bytes; some of its variables may be nonsense."""
    # Those that are read in C are read in a process of their own, which takes its time.
    suffix = chance.choices(["npz", "op4", "mat", "nc", "h5"], [4, 2, 1, 1, 1])[0]
    if suffix == "op4":
        return "modal", suffix, (whole / "model.op4").read_bytes()
    kind = chance.choice(["state-space", "modal"])
    given = dict(STATE_SPACE if kind == "state-space" else MODAL)
    for _ in range(chance.randint(1, 2) if spoilt else 0):
        name = chance.choice([*given, "D", "dt", "units", "rows", "stiffness"])
        if chance.random() < 0.4:
            given.pop(name, None)
        else:
            given[name] = chance.choice(NASTY_ARRAYS)
    write = {"npz": npz, "mat": mat, "nc": netcdf, "h5": netcdf}[suffix]
    return kind, suffix, write(given)


def netcdf(given: dict[str, object]) -> bytes:
    """Arrays as NetCDF 4, which is HDF5."""
    import netCDF4

    file = netCDF4.Dataset("made", "w", memory=1024)
    for name, value in given.items():
        array = np.asarray(value)
        if array.dtype.kind in "US":
            file.setncattr(name, str(value))
        for ending, part in _parts(array):
            axes = [f"{name}{ending}{i}" for i in range(part.ndim)]
            for axis, size in zip(axes, part.shape, strict=True):
                file.createDimension(axis, size)
            file.createVariable(name + ending, part.dtype, axes)[...] = part
    return bytes(file.close())


def _parts(array: np.ndarray) -> list[tuple[str, np.ndarray]]:
    """Real arrays that stand for an array in NetCDF, with the endings of their names."""
    if array.dtype.kind == "c":
        return [("_re", array.real), ("_im", array.imag)]
    return [("", array)] if array.dtype.kind in "fiu" else []


def _other(value: object, chance: Random, changes: int = 1) -> object:
    """JSON with entries replaced, lost or added somewhere inside."""
    for _ in range(changes):
        places: list[tuple[dict | list, object]] = []
        _collect(value, places)
        if not places:
            return value
        holder, key = chance.choice(places)
        if chance.random() < 0.3:
            del holder[key]
        else:
            holder[key] = deepcopy(chance.choice(NONSENSE))
    return value


def _collect(value: object, places: list[tuple[dict | list, object]]) -> None:
    if isinstance(value, dict | list):
        for key in list(value) if isinstance(value, dict) else range(len(value)):
            places.append((value, key))
            _collect(value[key], places)


def _word(text: str) -> str:
    """Something that can be a word of a command line."""
    return text.replace("\0", "")


@cache
def options_of(command: str) -> list[str]:
    """Names of the options of a command, by its help."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        main([command, "--help"])
    words = {word.strip(",") for word in out.getvalue().split() if word.startswith("--")}
    return sorted(word for word in words if word.strip("-") and word not in ("--help", "--version"))


def mangled(data: bytes, chance: Random, share: float = 1.0) -> bytes:
    """Lines dropped, doubled, cut, spoilt; bytes flipped; or anything at all.

    `share` is how often anything is done.
    """
    if chance.random() >= share:
        return data
    if chance.random() < 0.05:
        return chance.randbytes(chance.randrange(200))
    lines = data.decode("latin-1").split("\n")
    binary = any(byte > 127 for byte in data[:200])
    for _ in range(0 if binary else chance.randint(0, 4)):
        change = chance.choice(MUTATIONS)
        lines = change(lines, chance.randrange(len(lines)), chance.randrange(0x2FFF)) or [""]
    text = "\n".join(lines)
    spoilt = bytearray(text.encode("latin-1") if binary else text.encode("utf-8", "surrogatepass"))
    for _ in range(chance.choice([1, 1, 3, 9] if binary else [0, 0, 1, 3]) if spoilt else 0):
        spoilt[chance.randrange(len(spoilt))] = chance.randrange(256)
    if binary and chance.random() < 0.2:
        del spoilt[chance.randrange(len(spoilt)) :]
    return bytes(spoilt)


assert {*LINES, *CAREFREE} == {*COMMANDS}, "a command is missing here"
