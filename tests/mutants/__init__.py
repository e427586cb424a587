"""Deliberate mistakes that the tests must notice: the list, and how each is applied."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class Mutant:
    """One mistake: in `file` each text of `old` becomes its `new`, and one of `tests` must fail.

    There are several of them where either of two guards alone is enough. `compiled` says that
    kernels run compiled; they run as plain Python otherwise, which is faster where a test is small.
    """

    name: str
    file: str
    old: tuple[str, ...]
    new: tuple[str, ...]
    tests: tuple[str, ...]
    compiled: bool = False

    def applied(self, text: str) -> str:
        """The file's text with the mistake in it."""
        for old, new in zip(self.old, self.new, strict=True):
            if (count := text.count(old)) != 1:
                raise ValueError(f"{self.name}: {old!r} occurs {count} times in {self.file}")
            text = text.replace(old, new)
        return text


def mutants() -> list[Mutant]:
    """The committed list."""
    entries = tomllib.loads((Path(__file__).parent / "mutants.toml").read_text())["mutant"]
    several = ("old", "new", "tests")
    return [Mutant(**entry | {key: _tuple(entry[key]) for key in several}) for entry in entries]


def _tuple(value: str | list[str]) -> tuple[str, ...]:
    return (value,) if isinstance(value, str) else tuple(value)
