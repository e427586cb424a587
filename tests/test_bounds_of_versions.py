"""The lowest versions that are allowed are those that `make lowest` tests, and those in use fit."""

from __future__ import annotations

import re
import tomllib
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.version import Version

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
UNTESTED = ("lint", "docs", "reference")  # extras that the tests do without
DIRECT = [
    Requirement(text)
    for texts in (
        PROJECT["dependencies"],
        *(
            texts
            for name, texts in PROJECT["optional-dependencies"].items()
            if name not in UNTESTED
        ),
    )
    for text in texts
]


def pins(name: str) -> dict[str, Version]:
    text = (ROOT / "requirements" / f"{name}.txt").read_text()
    found = re.findall(r"^([a-z0-9-]+)==(\S+)", text, re.MULTILINE)
    return {package: Version(version) for package, version in found}


@pytest.mark.parametrize("requirement", DIRECT, ids=lambda one: one.name)
def test_lowest_is_the_lowest(requirement: Requirement) -> None:
    [bound] = requirement.specifier
    assert bound.operator == ">="
    wanted, tested = Version(bound.version), pins("lowest")[requirement.name]
    assert tested >= wanted
    # the first release of what is named, or of its series, as 77.0.1 for 77
    assert tested.release[: len(wanted.release)] == wanted.release


@pytest.mark.parametrize("requirement", DIRECT, ids=lambda one: one.name)
def test_what_is_locked_and_installed_is_allowed(requirement: Requirement) -> None:
    assert requirement.specifier.contains(pins("dev")[requirement.name])
    assert requirement.specifier.contains(metadata.version(requirement.name))


def test_every_python_that_is_named_can_be_had() -> None:
    named = [one.rpartition(" ")[2] for one in PROJECT["classifiers"] if "Python :: 3." in one]
    assert min(named, key=Version) == PROJECT["requires-python"].removeprefix(">=")
    makefile = (ROOT / "Makefile").read_text()
    assert f"python-{max(named, key=Version)}:" in makefile
