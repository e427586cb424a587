"""Tangents of a motion on the exact engine, and how fast they grow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from aeroflutter.motion import _kernel_tangent as kernel
from aeroflutter.motion._kernel_flow import PLACE, UNKNOWN
from aeroflutter.motion.exponents import Exponents, measured
from aeroflutter.motion.march import March

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from aeroflutter.motion.flow import Flow

    Array = NDArray[np.float64]

__all__ = ["Tangents", "growth", "returns"]

BLOCKS = 16  # of a stretch over which an exponent is measured
SIZING = 64  # maxima from which the size of each state is taken


@dataclass
class Tangents:
    """A motion with its tangents, between two calls of the kernel."""

    march: March
    unit: Array

    @classmethod
    def along(
        cls, flow: Flow, x: ArrayLike, memory: ArrayLike, columns: int, sizing: int = SIZING
    ) -> Tangents:
        """Tangents in general position, once the size of each state is known from some maxima.

        Parameters
        ----------
        flow, x, memory
            The motion, (n,) and (m,) or one number.
        columns
            How many.
        sizing
            Maxima from which sizes are taken.
        """
        n = flow.n
        blank = np.zeros((n + flow.m, columns))
        tangents = cls(
            March(flow, flow.begin(x, memory), tangents=blank, reaches=True), np.ones(n + flow.m)
        )
        tangents.over(sizing)
        motion = tangents.march.motion
        tangents.unit = _unit(flow, motion.reach)
        directions = np.random.default_rng(0).standard_normal((n, columns))  # the same in every run
        motion.tangents[:n] = tangents.unit[:n, None] * directions
        return tangents

    def over(self, count: int) -> tuple[Array, Array, Array, Array]:
        """Points, times, troughs and logarithms of the growth at the next maxima."""
        flow, motion = self.march.flow, self.march.motion
        m, k = motion.tangents.shape
        points, times = np.empty((count, m)), np.empty(count)
        troughs, logs = np.empty(count), np.empty((count, k))
        clock, total = np.array([np.inf, 0.0]), np.zeros(k)
        motion.clock[0] = 0.0
        status = UNKNOWN
        while status == UNKNOWN:
            status = kernel.returns(
                flow.arrays, motion, self.unit, total, clock, points, times, troughs, logs
            )
            if status == UNKNOWN:
                flow.prepare(np.array([motion.memo[PLACE]]))
        found = int(clock[kernel.COUNT])
        return points[:found], times[:found], troughs[:found], logs[:found]


def growth(
    flow: Flow, x: ArrayLike, memory: ArrayLike, count: int, after: int = SIZING
) -> Exponents | None:
    """The largest Lyapunov exponent over so many maxima; None if the motion ends before.

    Parameters
    ----------
    flow, x, memory
        The motion, (n,) and (m,) or one number.
    count, after
        Maxima over which it is measured, and that pass before.
    """
    tangents = Tangents.along(flow, x, memory, 1, sizing=after)
    _, times, _, logs = tangents.over(count)
    if times.size < count or not np.all(np.isfinite(logs)):
        return None
    return measured(times, logs, BLOCKS)


def returns(flow: Flow, x: ArrayLike, memory: ArrayLike, count: int) -> tuple[Array, Array]:
    """Points (x, h) at the next so many maxima, fewer if the motion ends before, and their times.

    Parameters
    ----------
    flow, x, memory
        The motion, (n,) and (m,) or one number.
    """
    points, times, _, _ = Tangents.along(flow, x, memory, 1, sizing=1).over(count)
    return points, times


def _unit(flow: Flow, reach: Array) -> Array:
    """What counts as one of each (x, h): the size of each state, and that of y for its h."""
    largest = float(reach.max()) or 1.0
    sizes = np.abs(flow.C) @ reach
    memories = np.where(sizes > 0.0, sizes, largest)
    return np.concatenate((np.where(reach > 0.0, reach, largest), memories))
