"""Compiled paths of the cells of a column: their returns, and whether a cell has joined one."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeroflutter.kernels import kernel
from aeroflutter.kernels.arrays import Real1, Real2, Real3, Whole1, Whole2

Array = NDArray[np.float64]

PARALLEL = 0.1  # relative bend between segments of a slow curve
LEAST = 0.05  # length of a segment over that of the one before it
GROWTH = 1.25  # the same for any two segments of a path that goes to its cycle and nowhere else
BESIDE = 3e-2  # relative distance from a path at which it is first compared with it
CLOSER = 0.8  # factor by which it must come closer
STRAIGHT = 0.05  # part of a segment by which it may bend
FLOOR = 1e-6
CONFIRMED = 2  # further returns that agree with a path


class Paths(NamedTuple):
    """Returns of cells that ended on cycles: q paths, k returns, n states. The last is the cell's.

    Attributes
    ----------
    points, rates
        State and y' at each return, (q, k, n) and (q, k).
    times
        When the cell at hand returned, (k,).
    smooth
        1 for the segments at which a path may be joined, (q, k).
    sizes
        Size of each state over that of y', (q, n).
    length, cycle
        Returns, and place of the cycle among those known, (q,).
    hints, agreed, far
        Of the cell at hand: the segment on which it lies, how often it has agreed, and how far it
        was from the path, (q,).
    waits
        Its returns near a known cycle, and its settled ones in a row, (2,).
    spread
        Logarithm of how much the distance of its returns has grown, whenever it did; the last
        distance, (2,).
    """

    points: Real3
    rates: Real2
    times: Real1
    smooth: Whole2
    sizes: Real2
    length: Whole1
    cycle: Whole1
    hints: Whole1
    agreed: Whole1
    far: Real1
    waits: Whole1
    spread: Real1


@kernel(inner=True, bare=True)
def aligned(paths: Paths, q: int, k: int) -> bool:
    """Whether segment k of path q and the two after it follow each other smoothly."""
    points, rates, sizes = paths.points, paths.rates, paths.sizes
    for j in range(k, k + 2):
        first, second = rates[q, j + 1] - rates[q, j], rates[q, j + 2] - rates[q, j + 1]
        ratio = second / first if first != 0.0 else np.inf
        if not ratio > LEAST:
            return False
        bend, long = 0.0, 0.0
        for i in range(points.shape[2]):
            one = points[q, j + 1, i] - points[q, j, i]
            two = points[q, j + 2, i] - points[q, j + 1, i]
            bend = max(bend, abs(two - ratio * one) / sizes[q, i])
            long = max(long, max(abs(two), abs(ratio * one)) / sizes[q, i])
        if bend > PARALLEL * long:
            return False
    return True


@kernel(inner=True, bare=True)
def survey(paths: Paths, q: int) -> None:
    """Sizes of the states on path q, and the segments at which it may be joined.

    They follow each other smoothly, and from there to the cycle none is longer than those
    before it: where they grow again, the path has passed by an unstable cycle, and those that
    come along beside it may leave on its other side.
    """
    points, rates, smooth, sizes = paths.points, paths.rates, paths.smooth, paths.sizes
    length = paths.length[q]
    for i in range(points.shape[2]):
        size = 0.0
        for k in range(length):
            size = max(size, abs(points[q, k, i]) / (abs(rates[q, k]) + 1e-300))
        sizes[q, i] = max(size, 1e-300)
    shrinks, longest = True, 0.0
    for k in range(length - 1, -1, -1):
        smooth[q, k] = 0
        if k < length - 1:
            step = abs(rates[q, k + 1] - rates[q, k])
            shrinks = shrinks and longest <= GROWTH * step
            longest = max(longest, step)
        if shrinks and k < length - 3 and aligned(paths, q, k):
            smooth[q, k] = 1


@kernel(inner=True, bare=True)
def remember(paths: Paths, q: int, length: int, cycle: int) -> None:
    """Make the path of the cell at hand path q."""
    last = paths.length.size - 1
    paths.length[q], paths.cycle[q] = length, cycle
    for k in range(length):
        paths.rates[q, k] = paths.rates[last, k]
        for i in range(paths.points.shape[2]):
            paths.points[q, k, i] = paths.points[last, k, i]
    survey(paths, q)


@kernel(inner=True, bare=True)
def joined(paths: Paths, q: int, point: Array, rate: float) -> bool:
    """Whether the cell has joined path q with this return."""
    rates, points, sizes = paths.rates, paths.points, paths.sizes
    at = -1
    if paths.hints[q] >= 0 and paths.agreed[q] >= 0:
        first, last = paths.hints[q] + 1, min(paths.hints[q] + 2, paths.length[q] - 1)
    else:
        first, last = 0, paths.length[q] - 1
    for k in range(first, last):
        low, high = rates[q, k], rates[q, k + 1]
        if (low <= rate < high) or (high < rate <= low):
            at = k
            break
    far, long = np.inf, 0.0
    if at >= 0 and paths.smooth[q, at] == 1:
        theta = (rate - rates[q, at]) / (rates[q, at + 1] - rates[q, at])
        unit = 1.0 / (abs(rate) + 1e-300)
        far = 0.0
        for i in range(point.size):
            step = points[q, at + 1, i] - points[q, at, i]
            away = abs(point[i] - points[q, at, i] - theta * step)
            scale = unit / sizes[q, i]
            far = max(far, away * scale)
            long = max(long, abs(step) * scale)
    straight = max(STRAIGHT * long, FLOOR)
    if not (far < BESIDE and (paths.agreed[q] < 0 or far < max(CLOSER * paths.far[q], straight))):
        paths.hints[q], paths.agreed[q], paths.far[q] = -1, -1, np.inf
        return False
    paths.hints[q], paths.far[q] = at, far
    paths.agreed[q] += 1
    return paths.agreed[q] >= CONFIRMED and far < straight


@kernel(inner=True, bare=True)
def note_spread(paths: Paths, k: int) -> None:
    """How much the returns of the cell at hand have spread: what grows now may shrink again, but

    what round-off has put into it grows with it.
    """
    own, spread = paths.rates.shape[0] - 1, paths.spread
    far = 0.0
    for i in range(paths.points.shape[2]):
        value = paths.points[own, k, i]
        size = abs(value) if k == 0 else max(paths.sizes[own, i], abs(value))
        paths.sizes[own, i] = size
        if k > 0 and size > 0.0:
            far = max(far, abs(value - paths.points[own, k - 1, i]) / size)
    if k == 0:
        spread[0] = 0.0
    elif k > 1 and far > spread[1] > 0.0:
        spread[0] += np.log(far / spread[1])
    spread[1] = far
