"""Compiled march of a motion with a cubic spring and its tangents, by Taylor series.

δ' = (A - b (β₁ + 3 β₃ y²) c) δ is linear along the motion: its coefficients follow from one another
as those of the motion do, and its series converge as far.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.kernels import kernel
from aeroflutter.kernels.arrays import Given1, Given2, Real1, Real2
from aeroflutter.motion._kernel_taylor import (
    FULL,
    MOST_TURNS,
    ORDER,
    REACHED,
    STALLED,
    evaluate,
    expand,
    reach,
    turning,
)

Array = NDArray[np.float64]


@kernel(entry=True)
def march(
    A: Given2,
    b: Given1,
    c: Given1,
    beta: tuple[float, float],
    x: Real1,
    tangents: Real2,
    time: float,
    until: float,
    slope: float,
    turns: Real2,
) -> tuple[int, float, float, int]:
    """March to a time, or until the turns are full, or no step is left.

    Parameters
    ----------
    A, b, c, beta
        The system and the two coefficients of the spring.
    x, tangents
        State and tangents at `time`, (n,) and (n, k), replaced by those reached.
    slope
        Last y' that was not zero; 0 at the start.
    turns
        Filled with the time of every turning point, 1 at maxima and -1 at minima, and the state
        there, (m, 2 + n).

    Returns
    -------
    status, time, slope, found
        How it ended and when; y' there; turning points written.
    """
    n, k = tangents.shape
    X, Y, square = np.empty((ORDER + 1, n)), np.empty(ORDER + 1), np.empty(ORDER)
    D, flat = np.empty((ORDER + 1, n * k)), np.empty(n * k)
    spots, found = np.empty(MOST_TURNS), 0
    while time < until:
        if found + MOST_TURNS > turns.shape[0]:
            return FULL, time, slope, found
        expand(A, b, c, beta, x, X, Y, square)
        expand_tangents(A, b, c, beta, square, tangents, D)
        step = min(reach(X), reach(D), until - time)
        end = until if step == until - time else time + step
        if not end > time:
            return STALLED, time, slope, found
        side = np.sign(slope)
        more, slope = turning(Y, step, slope, spots)
        for at in spots[:more]:
            turns[found, 0], turns[found, 1] = time + at, side
            evaluate(X, at, turns[found, 2:])
            side, found = -side, found + 1
        evaluate(X, step, x)
        evaluate(D, step, flat)
        tangents[:] = flat.reshape(n, k)
        time = end
    return REACHED, time, slope, found


@kernel
def expand_tangents(
    A: Array,
    b: Array,
    c: Array,
    beta: tuple[float, float],
    square: Array,
    tangents: Array,
    D: Array,
) -> None:
    """Taylor coefficients of the tangents, (ORDER+1, n k), from those of y²."""
    n, k = tangents.shape
    D[0] = tangents.copy().reshape(n * k)
    pitch = np.zeros((ORDER, k))
    for m in range(ORDER):
        for j in range(k):
            for i in range(n):
                pitch[m, j] += c[i] * D[m, i * k + j]
            moment = beta[0] * pitch[m, j]
            for i in range(m + 1):
                moment += 3.0 * beta[1] * square[i] * pitch[m - i, j]
            for i in range(n):
                total = -b[i] * moment
                for other in range(n):
                    total += A[i, other] * D[m, other * k + j]
                D[m + 1, i * k + j] = total / (m + 1)
