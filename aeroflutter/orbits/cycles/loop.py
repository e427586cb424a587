"""A family closed by a spring, as shooting sees it: the exact flow, speed by speed.

A point z holds the state and, for a spring with memory, the memory: z = (x,) or (x, h).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from aeroflutter.errors import ConvergenceError
from aeroflutter.model.lure import LureFamily, integrates
from aeroflutter.motion import flow as exact
from aeroflutter.motion.flow import Passage, Trace
from aeroflutter.springs import Hysteresis, PiecewiseLinear

__all__ = ["Flow", "Loop", "Passage", "Trace"]

Array = NDArray[np.float64]


class Flow:
    """The exact flow at one speed, with its derivative with respect to the speed.

    Parameters
    ----------
    family, spring
        What is closed by what.
    speed
        U*.
    """

    def __init__(
        self, family: LureFamily, spring: PiecewiseLinear | Hysteresis, speed: float
    ) -> None:
        self.A, self.b = family.stack(speed)
        self.dA, self.db = family.derivative(speed)
        if not np.all(np.isfinite(self.A)):
            raise ConvergenceError("the system is not finite at this speed")
        system = exact.Matrices(self.A, self.b[:, None], family.c[None], np.zeros(self.b.size))
        self.exact = exact.Flow(system, [spring], derivative=(self.dA, self.db[:, None]))
        self.passage, self.trace = self.exact.passage, self.exact.trace

    def rate(self, z: Array) -> Array:
        """z' at a point where the memory is at rest, (m,)."""
        rate = np.zeros(z.size)
        rate[: self.exact.n] = self.exact.rate(self._point(z))
        return rate

    def moment(self, z: Array) -> tuple[float, float]:
        """F at a point and its slope in y."""
        point, piece = self._point(z), self.exact.pieces[0]
        y = float(self.exact.C[0] @ point.x)
        slope, offset, _, _ = piece.branch(y, float(point.memory[0]))
        return slope * y + offset, slope

    def _point(self, z: Array) -> exact.Point:
        return self.exact.begin(
            z[: self.exact.n], z[self.exact.n :] if z.size > self.exact.n else 0.0
        )


class Loop:
    """A family of linear systems closed by a piecewise-linear spring.

    Attributes
    ----------
    family, spring
        What is closed by what.
    n, m
        Number of states; number of entries of z.
    memory
        Whether the spring has one.
    integrates
        Whether y can rest anywhere without a moment: 1/G(0) = 0 at every speed.
    """

    def __init__(self, family: LureFamily, spring: PiecewiseLinear | Hysteresis) -> None:
        self.family, self.spring = family, spring
        self.n = int(family.c.size)
        self.memory = spring.piece_table().memory
        self.m = self.n + self.memory
        self.integrates = integrates(family)
        self.at = lru_cache(maxsize=16)(self._at)

    def _at(self, speed: float) -> Flow:
        return Flow(self.family, self.spring, speed)
