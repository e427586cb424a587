"""Compiled paths: returns of cells that ended on cycles, which later cells of a column may join."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from aeroflutter.kernels import kernel
from aeroflutter.motion._kernel_exact import Index
from aeroflutter.motion._kernel_exact_tables import Array

MOST_PATHS = 12
MOST_RETURNS = 1024
LAGS = 4  # periods, in returns, that count as settling
CLOSE = 1e-2  # what a motion may still change by, relative, when `settle` takes over
PARALLEL = 0.1  # relative bend between segments of a slow curve
LEAST = 0.05  # length of a segment over that of the one before it
GROWTH = 1.25  # the same for any two segments of a path that goes to its cycle and nowhere else


class Paths(NamedTuple):
    """Returns of cells that ended on cycles: q paths, k returns, n states.

    Attributes
    ----------
    points, rates
        State and y' at each return, (q, k, n) and (q, k).
    smooth
        1 for the segments at which a path may be joined, see `survey`, (q, k).
    sizes
        Size of each state over that of y', (q, n).
    length, cycle
        Returns, and place of the cycle among those known, (q,).
    """

    points: Array
    rates: Array
    smooth: Index
    sizes: Array
    length: Index
    cycle: Index


@kernel
def no_paths(n: int) -> Paths:
    """Room for the paths of a column; the last is that of the cell at hand."""
    return Paths(
        np.empty((MOST_PATHS + 1, MOST_RETURNS, n)),
        np.empty((MOST_PATHS + 1, MOST_RETURNS)),
        np.zeros((MOST_PATHS + 1, MOST_RETURNS), dtype=np.int64),
        np.ones((MOST_PATHS + 1, n)),
        np.zeros(MOST_PATHS + 1, dtype=np.int64),
        np.zeros(MOST_PATHS + 1, dtype=np.int64),
    )


@kernel
def settled(points: Array, rates: Array, q: int, k: int) -> bool:
    """Whether return k of path q is so near a cycle that Newton will find it."""
    n = points.shape[2]
    for lag in range(1, LAGS + 1):
        if k < 2 * lag:
            return False
        size = abs(rates[q, k])
        new = abs(rates[q, k] - rates[q, k - lag])
        old = abs(rates[q, k - lag] - rates[q, k - 2 * lag])
        if not (new < CLOSE * size and old < 10.0 * CLOSE * size):
            continue
        left = new * new / (old - new) if new < old else np.inf
        if new < 1e-12 * size:
            left = 0.0
        if left < CLOSE * size:
            far = 0.0
            for i in range(n):
                span = abs(points[q, k, i]) + abs(points[q, k - lag, i])
                far = max(far, abs(points[q, k, i] - points[q, k - lag, i]) / (span + 1e-300))
            if far < 10.0 * CLOSE:
                return True
    return False


@kernel
def segment(rates: Array, length: int, q: int, rate: float, hint: int) -> int:
    """The segment of path q on which y' passes `rate`, from `hint` on; -1 if there is none."""
    for k in range(max(hint, 0), length - 1):
        a, b = rates[q, k], rates[q, k + 1]
        if (a <= rate < b) or (b < rate <= a):
            return k
    return -1


@kernel
def beside(
    points: Array, rates: Array, sizes: Array, q: int, k: int, point: Array, row: int, rate: float
) -> tuple[float, float]:
    """Relative distance of a return from segment k of path q, and length of the segment."""
    n = points.shape[2]
    theta = (rate - rates[q, k]) / (rates[q, k + 1] - rates[q, k])
    unit = 1.0 / (abs(rate) + 1e-300)
    far, long = 0.0, 0.0
    for i in range(n):
        step = points[q, k + 1, i] - points[q, k, i]
        away = abs(point[row, i] - points[q, k, i] - theta * step)
        scale = unit / sizes[q, i]
        far = max(far, away * scale)
        long = max(long, abs(step) * scale)
    return far, long


@kernel
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


@kernel
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


@kernel
def remember(paths: Paths, q: int, length: int, cycle: int) -> None:
    """Make the path of the cell at hand path q."""
    last = paths.length.size - 1
    paths.length[q], paths.cycle[q] = length, cycle
    for k in range(length):
        paths.rates[q, k] = paths.rates[last, k]
        for i in range(paths.points.shape[2]):
            paths.points[q, k, i] = paths.points[last, k, i]
    survey(paths, q)
