"""The loop as shooting sees it: the exact flow with its Jacobian, compiled speed by speed.

A point z holds the state and, for a spring with memory, the memory: z = (x,) or (x, h).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeroflutter.errors import ConvergenceError
from aeroflutter.model.lure import LureFamily, integrates
from aeroflutter.motion import _kernel_exact as modes
from aeroflutter.motion import _kernel_exact_march as kernel
from aeroflutter.motion._kernel_exact_tables import build, conversions
from aeroflutter.motion.prepared import law_of
from aeroflutter.springs import Hysteresis, PiecewiseLinear

__all__ = ["Flow", "Loop", "Passage", "Trace"]

Array = NDArray[np.float64]

_EVENTS = 400  # switches that a passage may have


class Passage(NamedTuple):
    """A stretch of motion with its linearisation, m = number of entries of z.

    Attributes
    ----------
    end
        Final point, (m,).
    jacobian
        d end / d (start, U), (m, m+1).
    rate
        z' at the end, (m,).
    switches
        What happened on the way: (kind, mode after it) of every switch.
    """

    end: Array
    jacobian: Array
    rate: Array
    switches: tuple[tuple[int, int], ...]


class Trace(NamedTuple):
    """A stretch of motion with uniform samples.

    Attributes
    ----------
    end
        Final point, (m,).
    states, memory
        Samples at i·duration/k, shapes (k, n) and (k,).
    turns
        Extrema of y on the way: time, y, +1 at a maximum and -1 at a minimum, (j, 3).
    events
        Switches: time, kind, mode after it, y, F, (i, 5).
    """

    end: Array
    states: Array
    memory: Array
    turns: Array
    events: Array


@dataclass(frozen=True, eq=False)
class Flow:
    """The exact flow at one speed."""

    tables: Any
    law: Any
    A: Array
    b: Array
    dA: Array
    db: Array

    def passage(self, z: Array, duration: float) -> Passage:
        """The motion from z over a duration, linearised.

        Raises
        ------
        ConvergenceError
            If the motion overflows or has more switches than a cycle can be expected to have.
        """
        n = self.b.size
        m = z.size
        x, jacobian = z[:n].copy(), np.empty((n + 1, n + 2))
        events = np.empty((_EVENTS, kernel.EVENT_COLUMNS))
        memory = float(z[n]) if m > n else 0.0
        status, h, mode, count = kernel.flow(
            self.tables, self.law, x, memory, -1, duration, jacobian, events
        )
        if status != modes.DONE or count > _EVENTS:
            raise ConvergenceError("the motion does not stay bounded and regular over a period")
        rate = np.zeros(m)
        kernel.rate(self.tables, self.law, x, h, mode, rate[:n])
        if m == n:
            kept = np.delete(jacobian[:n], n, axis=1)
            return Passage(x, kept, rate, _switches(events[:count]))
        if mode != modes.STICK:
            rate[n] = self.tables.c @ rate[:n]
        return Passage(np.append(x, h), jacobian, rate, _switches(events[:count]))

    def trace(self, z: Array, duration: float, samples: int) -> Trace:
        """The motion from z over a duration, sampled uniformly, with its extrema and switches."""
        n = self.b.size
        x, memory = z[:n].copy(), float(z[n]) if z.size > n else 0.0
        times: Array = np.arange(samples, dtype=np.float64) * (duration / samples)
        states, springs = np.empty((samples, n)), np.empty((samples, 2))
        events = np.empty((_EVENTS, kernel.EVENT_COLUMNS))
        turns = np.empty((_EVENTS, kernel.TURN_COLUMNS))
        memo = np.zeros(5, dtype=np.int64)
        status, _, h, _ = kernel.march(
            self.tables, self.law, x, memory, -1, 0.0, duration,
            times, states, springs, events, turns, memo,
        )  # fmt: skip
        if status != modes.DONE:
            raise ConvergenceError("the motion does not stay bounded and regular over a period")
        end = np.append(x, h) if z.size > n else x
        return Trace(
            end,
            states,
            springs[:, 0],
            turns[: memo[kernel.TURNS]],
            events[: memo[kernel.EVENTS]],
        )

    def rate(self, z: Array) -> Array:
        """z' at a point where the memory is at rest, (m,)."""
        n = self.b.size
        rate = np.zeros(z.size)
        memory = float(z[n]) if z.size > n else 0.0
        mode, memory = modes.start(self.law, memory, float(self.tables.c @ z[:n]))
        kernel.rate(self.tables, self.law, z[:n].copy(), memory, mode, rate[:n])
        return rate

    def moment(self, z: Array) -> tuple[float, float]:
        """F at a point and its slope in y."""
        n = self.b.size
        y = float(self.tables.c @ z[:n])
        if z.size > n:
            return y - float(z[n]), 1.0
        mode, _ = modes.start(self.law, 0.0, y)
        return float(self.law.slopes[mode] * y + self.law.offsets[mode]), float(
            self.law.slopes[mode]
        )


def _switches(events: Array) -> tuple[tuple[int, int], ...]:
    return tuple((int(kind), int(mode)) for kind, mode in events[:, 1:3])


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
        self.memory = isinstance(spring, Hysteresis)
        self.m = self.n + self.memory
        self.integrates = integrates(family)
        self.law, self._slopes = law_of(spring)
        self.at = lru_cache(maxsize=16)(self._compiled)

    def _compiled(self, speed: float) -> Flow:
        A, b = self.family.stack(speed)
        dA, db = self.family.derivative(speed)
        A, b, dA, db = (np.ascontiguousarray(part) for part in (A, b, dA, db))
        c = np.ascontiguousarray(self.family.c)
        tables = build(A, b, c, self._slopes, np.inf, dA, db, *conversions())
        return Flow(tables, self.law, A, b, dA, db)
