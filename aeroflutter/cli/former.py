"""Options by their names of 0.1.0: they go on working, with a warning that says those of today."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from aeroflutter.cli.streams import say

__all__ = ["former", "renamed"]

RENAMED = {
    "rootlocus": {"--speeds": "--speed"},
    "report": {"-o": "--out"},
    "import": {"-o": "--out", "--output": "--out"},
    "sweep": {"--no-onset": "--onset none"},
}
"""By command: what an option is called today, with its value where it had none."""

ONSETS = ("describing", "exact", "none")  # what `sweep --onset` takes; alone it was a flag


def former(given: Mapping[str, Any], today: str) -> None:
    """Warn of options that still work and have another name today."""
    for name, value in given.items():
        if value is not None:
            say(f"{name} is {today} now")


def renamed(words: list[str]) -> list[str]:
    """A command line in which options have their names of today."""
    names = RENAMED.get(words[0], {}) if words else {}
    found: list[str] = []
    for place, word in enumerate(words):
        name, equals, value = word.partition("=")
        if name in names:
            say(f"{name} is {names[name]} now")
            option, *rest = names[name].split()
            found += [f"{option}{equals}{value}", *rest]
        else:
            found.append(word)
        following = words[place + 1] if place + 1 < len(words) else ""
        if words[0] == "sweep" and word == "--onset" and following not in ONSETS:
            say("--onset is --onset describing now")
            found.append("describing")
    return found
