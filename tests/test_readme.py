"""What the README shows is what happens."""

import re
import tomllib
from pathlib import Path

import pytest

from aeroflutter.case import load_case
from aeroflutter.cli import COMMANDS, main

README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    """Fenced blocks of one language."""
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)


def test_python_example_prints_what_is_shown(capsys: pytest.CaptureFixture[str]) -> None:
    [code], [shown] = blocks("python"), blocks("text")
    exec(compile(code, "README.md", "exec"), {})
    assert capsys.readouterr().out == shown


def test_shortest_case_loads() -> None:
    [text] = blocks("toml")
    case = load_case(tomllib.loads(text))
    assert case.spring == load_case("run14").spring
    assert case.section == load_case("run14").section


def test_output_of_df_is_the_one_shown(capsys: pytest.CaptureFixture[str]) -> None:
    [shown] = [block for block in blocks("console") if "aeroflutter df" in block]
    assert main(["df", "run14"]) == 0
    printed = [line.rstrip() for line in capsys.readouterr().out.splitlines()]
    assert printed[: shown.count("\n") - 2] == shown.splitlines()[1:-1]


def test_commands_of_the_readme_exist() -> None:
    names = re.findall(r"`([a-z]+)`", "".join(re.findall(r"^\| `.*?\|", README, re.MULTILINE)))
    assert names
    assert set(names) <= set(COMMANDS)
