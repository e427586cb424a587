"""Figures of the pages, made when the pages are: what their own commands draw.

A page that shows ``figures/PAGE/NAME.svg`` has a ``console`` block with ``--plot NAME.ANYTHING``.
That command is run on the case files of the page, in a folder of its own, and its figure put there.
``index.md`` has no blocks; its commands stand here.
"""

from __future__ import annotations

import contextlib
import io
import re
import shlex
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

HERE = Path(__file__).parent
BLOCK = re.compile(r"^```(toml|console)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
FRONT = (
    ("begins", "lco run14 --proved --simulations 0 --depth 0"),
    ("ends", "map run102 --speed-ratio 0.5:1.01:52"),
    ("allowed", "tolerance run14 --speed-ratio 0.96 --amplitude-deg 1"),
)


def setup(app: Any) -> dict[str, Any]:
    """Draw before the pages are read."""
    app.connect("builder-inited", lambda app: every())
    return {"parallel_read_safe": True}


def every() -> None:
    """Draw what pages show and is not there, or is older than its page."""
    for name, command in FRONT:
        target = HERE / "figures" / "index" / f"{name}.svg"
        if not target.exists():
            _draw([*shlex.split(command)], target)
    for page in sorted(HERE.rglob("*.md")):
        text = page.read_text(encoding="utf-8")
        shown = set(re.findall(rf"figures/{page.stem}/(\w+)\.svg", text))
        wanted = {name: HERE / "figures" / page.stem / f"{name}.svg" for name in shown}
        if page.stem != "index" and any(_old(target, page) for target in wanted.values()):
            _page(text, wanted)


def _old(target: Path, page: Path) -> bool:
    return not target.exists() or target.stat().st_mtime < page.stat().st_mtime


def _page(text: str, wanted: dict[str, Path]) -> None:
    """Write the case files of a page, and run those of its commands that draw."""
    with TemporaryDirectory() as folder, contextlib.chdir(folder):
        for language, block in BLOCK.findall(text):
            named = re.match(r"# (\S+\.toml)\n", block)
            if language == "toml" and named:
                Path(named[1]).write_text(block)
            for line in re.findall(r"^\$ aeroflutter (.*)$", block, re.M):
                words = shlex.split(line)
                if "--plot" in words:
                    place = words.index("--plot")
                    name = Path(words[place + 1]).stem
                    if name in wanted:
                        _draw(_alone(words[:place] + words[place + 2 :]), wanted.pop(name))
    if wanted:
        raise ValueError(f"no command draws {', '.join(wanted)}")


def _alone(words: list[str]) -> list[str]:
    """The command without the file that it saves."""
    if "--out" in words:
        place = words.index("--out")
        return words[:place] + words[place + 2 :]
    return words


def _draw(words: list[str], target: Path) -> None:
    from aeroflutter.cli import main

    target.parent.mkdir(parents=True, exist_ok=True)
    with contextlib.redirect_stdout(io.StringIO()):
        code = main([*words, "--plot", str(target)])
    if code:
        raise RuntimeError(f"aeroflutter {' '.join(words)}: exit {code}")


if __name__ == "__main__":
    every()
