"""A family closed by its springs, as shooting sees it: the exact flow, speed by speed.

A point z holds the state and the memory of every spring that has one: z = (x, h, …).
"""

from __future__ import annotations

from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from aeroflutter.errors import ConvergenceError
from aeroflutter.model.family import Family
from aeroflutter.model.lure import AnyFamily, as_family, integrators
from aeroflutter.motion import flow as exact
from aeroflutter.motion.atlas import Atlas
from aeroflutter.motion.flow import Passage, Trace
from aeroflutter.orbits.cycles.smooth import SmoothFlow
from aeroflutter.springs import Hysteresis, Spring, Springs, each

__all__ = ["Flow", "Loop", "Passage", "Trace"]

Array = NDArray[np.float64]


class Flow:
    """The exact flow at one speed, with its derivative with respect to the speed.

    Parameters
    ----------
    family, springs
        What is closed by what.
    speed
        U*.
    atlas
        Where the tables of the family are found.
    """

    def __init__(
        self, family: Family, springs: tuple[Spring, ...], speed: float, atlas: Atlas
    ) -> None:
        system, (self.dA, self.dB) = _at(family, speed)
        self.A, self.B, self.C, self.d = system
        if not np.all(np.isfinite(self.A)):
            raise ConvergenceError("the system is not finite at this speed")
        tables = partial(atlas.tables, speed)
        self.exact = exact.Flow(system, springs, derivative=(self.dA, self.dB), tables=tables)
        if self.exact.m > len(springs):  # with the rates on which friction jumps
            self.B, self.C = self.exact.B, self.exact.C
            self.dB = self.dB[:, self.exact.channels.springs]
        self.passage, self.trace = self.exact.passage, self.exact.trace

    def rate(self, z: Array) -> Array:
        """z' at a point where the memories are at rest, (m,)."""
        rate = np.zeros(z.size)
        rate[: self.exact.n] = self.exact.rate(self._point(z))
        return rate

    def moments(self, z: Array) -> tuple[Array, Array]:
        """F of every spring at a point, and its slope in y."""
        point = self._point(z)
        y = self.exact.C @ point.x
        branches = np.array(
            [
                piece.branch(float(at), float(memory))[:2]
                for piece, at, memory in zip(self.exact.pieces, y, point.memory, strict=True)
            ]
        )
        return branches[:, 0] * y + branches[:, 1], branches[:, 0]

    def _point(self, z: Array) -> exact.Point:
        memory = np.zeros(self.exact.m)
        memory[self.exact.held] = z[self.exact.n :]
        return self.exact.begin(z[: self.exact.n], memory)


class Loop:
    """A family of linear systems closed by springs.

    Attributes
    ----------
    family, springs
        What is closed by what.
    C
        Rows (s, n) of the springs' coordinates.
    scales
        Size of each spring, (s,).
    n, m
        Number of states; number of entries of z.
    held
        Places of the springs that have a memory, in the order of z.
    falls
        Of each spring, whether it may switch where its y turns: friction and play.
    smooth
        Whether one has no straight pieces: motions are Taylor series.
    integrates
        Which y can rest anywhere without a moment of any spring, (s,): for a lone one, where
        1/G(0) = 0 at every speed.
    """

    def __init__(self, family: AnyFamily, spring: Springs) -> None:
        self.family, self.springs = as_family(family), each(spring)
        self.C = np.array(self.family.stack(self.family.search_range[1])[2])
        self.scales = np.array([one.scale for one in self.springs])
        self.n = int(self.C.shape[1])
        tables = [one.piece_table() for one in self.springs]
        self.smooth = any(table is None for table in tables)
        self.held = np.flatnonzero([table is not None and table.memory for table in tables])
        self.falls = [
            one.rate_table() is not None or (i in self.held and not isinstance(one, Hysteresis))
            for i, one in enumerate(self.springs)
        ]
        self.m = self.n + self.held.size
        self.integrates = integrators(self.family)
        self.at = lru_cache(maxsize=16)(self._at)
        self._atlas = Atlas(self._generators, self.C)

    @property
    def spring(self) -> Spring:
        """The first of them."""
        return self.springs[0]

    @property
    def memory(self) -> bool:
        """Whether any has a memory."""
        return self.held.size > 0

    def _at(self, speed: float) -> Flow | SmoothFlow:
        if self.smooth:
            return SmoothFlow(self.family, self.springs, speed)
        return Flow(self.family, self.springs, speed, self._atlas)

    def _generators(self, speed: float) -> tuple[Array, Array]:
        system, derivative = _at(self.family, speed)
        flow = exact.Flow.bare(system, self.springs, derivative)
        return flow.generators(np.arange(flow.arrays.lookup.size))


def _at(family: Family, speed: float) -> tuple[exact.Matrices, tuple[Array, Array]]:
    """A family's matrices at a speed, and the derivatives of A and B with respect to it."""
    system = exact.Matrices(*map(np.ascontiguousarray, family.stack(speed)))
    return system, family.derivative(speed)[:2]
