"""What README and documentation show is what happens: every block in them is run.

- ``toml`` blocks whose first line is ``# NAME`` are files of that page; others must load as cases.
- ``console`` blocks are commands after ``$`` and what they print; ``...`` stands for anything.
- ``python`` blocks of a page run one after the other; a ``text`` block is what the last printed.

``sh`` blocks need services or installations that a test does not have, and are not run.
"""

import re
import shlex
import tomllib
from pathlib import Path

import pytest

from aeroflutter.case import load_case
from aeroflutter.cli import main

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
BLOCK = re.compile(r"^```(toml|console|python|text|sh)\n(.*?)^```$", re.DOTALL | re.MULTILINE)


def blocks(page: Path) -> list[tuple[str, str]]:
    """(language, text) of the fenced blocks of a page, in order."""
    return BLOCK.findall(page.read_text(encoding="utf-8"))


WITH_BLOCKS = [page for page in PAGES if blocks(page) and "_build" not in page.parts]


@pytest.mark.parametrize(
    "page", WITH_BLOCKS, ids=lambda page: str(page.relative_to(ROOT)).replace("/", "-")
)
def test_every_block_does_what_it_shows(
    page: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for language, text in blocks(page):
        if language == "toml":
            _toml(text)
        elif language == "console":
            _console(text, capsys)
        elif language == "python":
            capsys.readouterr()
            exec(compile(text, str(page), "exec"), names)
        elif language == "text":
            assert capsys.readouterr().out == text


def _toml(text: str) -> None:
    name = re.match(r"# (\S+\.toml)\n", text)
    if name:
        Path(name[1]).write_text(text)
    else:
        load_case(tomllib.loads(text))


def _console(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    for command, shown in re.findall(r"^\$ aeroflutter (.*)\n((?:(?!\$ ).*\n)*)", text, re.M):
        capsys.readouterr()
        words = shlex.split(command)
        redirected = words.index(">") if ">" in words else len(words)
        code = main(words[:redirected])
        out, err = capsys.readouterr()
        complaint = shown.startswith("aeroflutter: ")
        assert code == (2 if complaint else 0), err
        printed = [line.rstrip() for line in (err if complaint else out).splitlines()]
        assert _matches(shown.splitlines(), printed), "\n".join(["", command, *printed])


def _matches(shown: list[str], printed: list[str]) -> bool:
    """Whether the shown lines are the printed ones; ``...`` is any number of lines."""
    pattern = "".join(
        r"(?:.*\n)*" if line == "..." else re.escape(line.rstrip()) + "\n" for line in shown
    )
    return re.fullmatch(pattern, "".join(f"{line}\n" for line in printed)) is not None


def test_the_checker_sees_a_difference() -> None:
    assert _matches(["a", "...", "c"], ["a", "b", "b", "c"])
    assert not _matches(["a", "..."], ["b"])
    assert not _matches(["a"], ["a", "b"])
