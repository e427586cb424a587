"""What moves, by name: the coordinates of a section, and the outputs of a model from elsewhere."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from aeroflutter.model.equations import COORDINATES
from aeroflutter.model.lure import AnySystem, as_system
from aeroflutter.model.system import Real, System

__all__ = ["NamedRow", "named_rows"]


class NamedRow(NamedTuple):
    """A coordinate: what it is called, its unit, and the row (n,) that picks it from the state."""

    name: str
    unit: str
    row: Real


def named_rows(system: AnySystem) -> tuple[NamedRow, ...]:
    """Every coordinate of a system that has a name.

    Those of a section by their states, in the order of the states; then every output that is none
    of them, such as those of a model from elsewhere, once.
    """
    return _named_rows(as_system(system))


@lru_cache(maxsize=16)
def _named_rows(whole: System) -> tuple[NamedRow, ...]:
    """Made once a system: many motions of it are told by them."""
    found = [
        NamedRow(name, one.unit, np.eye(whole.order)[whole.state_names.index(one.state)])
        for name, one in COORDINATES.items()
        if one.state in whole.state_names
    ]
    for name, unit, row in zip(whole.names, whole.units, whole.C, strict=True):
        if not any(name == known.name or np.array_equal(row, known.row) for known in found):
            found.append(NamedRow(name, unit, row))
    return tuple(found)
