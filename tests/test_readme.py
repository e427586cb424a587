"""What the README says of cases and commands; its blocks are run in test_docs."""

import re
import tomllib
from pathlib import Path

from aeroflutter.case import load_case
from aeroflutter.cli import COMMANDS

README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    """Fenced blocks of one language."""
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)


def test_shortest_case_is_run_14() -> None:
    text = blocks("toml")[-1]
    case = load_case(tomllib.loads(text))
    assert case.spring == load_case("run14").spring
    assert case.section == load_case("run14").section


def test_commands_of_the_readme_exist() -> None:
    names = re.findall(r"`([a-z]+)`", "".join(re.findall(r"^\| `.*?\|", README, re.MULTILINE)))
    assert names
    assert set(names) <= set(COMMANDS)
