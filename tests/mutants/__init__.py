"""Deliberate mistakes that the tests must notice: the list, and how each is applied."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class Mutant:
    """One mistake: `old` becomes `new` in `file`, and one of `tests` must fail.

    `compiled` says that kernels run compiled; they run as plain Python otherwise, which is faster
    where a test is small.
    """

    name: str
    file: str
    old: str
    new: str
    tests: tuple[str, ...]
    compiled: bool = False

    def applied(self, text: str) -> str:
        """The file's text with the mistake in it."""
        count = text.count(self.old)
        if count != 1:
            raise ValueError(f"{self.name}: its text occurs {count} times in {self.file}")
        return text.replace(self.old, self.new)


def mutants() -> list[Mutant]:
    """The committed list."""
    entries = tomllib.loads((Path(__file__).parent / "mutants.toml").read_text())["mutant"]
    return [Mutant(**entry | {"tests": tuple(entry["tests"])}) for entry in entries]
