"""How much may be asked for: one table, checked before anything is computed or allocated.

A slip of the finger asks for 1e14 cells as easily as for 1e4. Whoever means it raises the limit in
the environment: `AEROFLUTTER_LIMITS="cells=1e10,workers=5000"`.
"""

from __future__ import annotations

import os

from aeroflutter.errors import InputError

__all__ = ["LIMITS", "VARIABLE", "limit", "within"]

VARIABLE = "AEROFLUTTER_LIMITS"

LIMITS: dict[str, int] = {
    "bytes": 1 << 28,  # of a file that is read
    "cells": 100_000_000,  # of a map: five gigabytes of results
    "cycles": 100_000_000,  # of a motion whose exponents are measured
    "harmonics": 4_096,  # the matrix of twice as many is half a gigabyte
    "members": 1_000,  # of a family of cases
    "numbers": 10_000_000,  # of a list A:B:N
    "samples": 10_000_000,  # of a sweep
    "steps": 1_000_000_000,  # of a time march
    "workers": 1_024,
}
"""The most that may be asked for of each."""


def limit(name: str) -> int:
    """The most that may be asked for of something, by the table or by the environment.

    Raises
    ------
    InputError
        If the environment does not say it as `name=number,...`.
    """
    raised = dict(LIMITS)
    for part in filter(str.strip, os.environ.get(VARIABLE, "").split(",")):
        key, _, text = (word.strip() for word in part.partition("="))
        try:
            number = int(float(text))
        except (ValueError, OverflowError):
            number = 0
        if key not in LIMITS or number < 1:
            raise InputError(
                f"{VARIABLE}: must be as in cells=1e9,workers=2000, not {part.strip()!r}; "
                f"the limits are {', '.join(LIMITS)}"
            )
        raised[key] = number
    return raised[name]


def within(name: str, number: float, label: str) -> None:
    """Refuse more than the limit.

    Parameters
    ----------
    name
        Of the limit.
    number
        How many are asked for.
    label
        What asks for them, as the line of the refusal begins: an option, a key, a file.

    Raises
    ------
    InputError
        If the number is larger than the limit.
    """
    most = limit(name)
    if number > most:
        raise InputError(
            f"{label}: {number:.6g} {name} are more than {most:.6g}; "
            f"set {VARIABLE}={name}={number:.6g} if you mean it"
        )
