"""How far each coordinate and each spring moves, in the units of files."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from aeroflutter.results.fields import NUMBER, TEXT, Field
from aeroflutter.results.schema import Entry, Many, Read, Value, layout

if TYPE_CHECKING:
    from aeroflutter.motion.swings import Swing

__all__ = ["SWINGS", "swing_lists"]


class Shown(NamedTuple):
    """A swing in degrees, where it is one of an angle."""

    name: str
    amplitude: float
    bias: float
    unit: str


def shown(swings: Iterable[Swing]) -> list[Shown]:
    """Swings in the units of files."""
    return [
        Shown(one.name, float(np.degrees(one.amplitude)), float(np.degrees(one.bias)), "deg")
        if one.unit == "rad"
        else Shown(one.name, one.amplitude, one.bias, one.unit)
        for one in swings
    ]


def swing_lists(
    coordinates: Read | None = None, springs: Read | None = None
) -> tuple[Entry, Entry]:
    """`coordinates` and `springs` of a result, read by functions or from attributes of that name.

    Parameters
    ----------
    coordinates, springs
        Functions of the object that give tuples of `Swing`.
    """
    read = (
        ("coordinates", coordinates, "name", "coordinate"),
        ("springs", springs, "at", "spring"),
    )
    first, second = (
        Many(name, _reader(name, of), layout=layout(*_entries(key)), dim=dim, prefix=f"{dim}_")
        for name, of, key, dim in read
    )
    return first, second


def _reader(name: str, of: Read | None) -> Read:
    return lambda one: shown(of(one) if of else getattr(one, name))


def _entries(called: str) -> list[Entry]:
    meanings = {
        "amplitude": Field("half peak to peak, in the unit of the coordinate", NUMBER),
        "bias": Field("midrange, in the unit of the coordinate", NUMBER),
        "unit": Field("unit of the coordinate", TEXT),
    }
    named = Value(called, "name", meaning=Field("name of the coordinate", TEXT))
    return [named, *(Value(name, meaning=field) for name, field in meanings.items())]


SWINGS = swing_lists()
