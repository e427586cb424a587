"""The largest amplitude that cycles are followed to, in degrees; once in sizes of the spring."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from aeroflutter.cli.former import former
from aeroflutter.errors import InputError
from aeroflutter.results.unit import native

if TYPE_CHECKING:
    from aeroflutter.case import Case

__all__ = ["largest_of"]

LARGEST = 50.0


def largest_of(case: Case, degrees: float | None, sizes: float | None) -> float:
    """The largest amplitude over the size of the spring of a case.

    Raises
    ------
    InputError
        If it is not positive.
    """
    former({"--largest": sizes}, "--largest-deg, in degrees,")
    if degrees is None:
        return LARGEST if sizes is None else sizes
    if not (math.isfinite(degrees) and degrees > 0.0):
        raise InputError(f"--largest-deg: must be a positive number of degrees, not {degrees}")
    return native(degrees) / case.spring.scale
