"""Compiled march of a motion with a polynomial spring and its tangents, by Taylor series.

δ' = (A - b F'(y) c) δ is linear along the motion: its coefficients follow from one another
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
    nest,
    reach,
    turning,
)

Array = NDArray[np.float64]


@kernel(entry=True)
def march(
    A: Given2,
    b: Given1,
    c: Given1,
    beta: Given1,
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
        The system, and the coefficients β₁, β₂, … of the spring.
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
    X, Y, nested = np.empty((ORDER + 1, n)), np.empty(ORDER + 1), np.empty((beta.size, ORDER))
    D, flat = np.empty((ORDER + 1, n * k)), np.empty(n * k)
    spots, found = np.empty(MOST_TURNS), 0
    while time < until:
        if found + MOST_TURNS > turns.shape[0]:
            return FULL, time, slope, found
        expand(A, b, c, beta, x, X, Y, nested)
        expand_tangents(A, b, c, beta, Y, nested, tangents, D)
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
    beta: Array,
    Y: Array,
    nested: Array,
    tangents: Array,
    D: Array,
) -> None:
    """Taylor coefficients of the tangents, (ORDER+1, n k), from those of y."""
    n, k = tangents.shape
    steep, flat = np.empty(beta.size), np.empty(ORDER)  # F' = β₁ + 2 β₂ y + 3 β₃ y² + …
    for i in range(1, beta.size):
        steep[i - 1] = (i + 1) * beta[i]
    for m in range(ORDER):
        flat[m] = beta[0] if m == 0 else 0.0
        if beta.size > 1:
            flat[m] = nest(steep[: beta.size - 1], beta[0], Y, m, nested)
    D[0] = tangents.copy().reshape(n * k)
    pitch = np.zeros((ORDER, k))
    for m in range(ORDER):
        for j in range(k):
            for i in range(n):
                pitch[m, j] += c[i] * D[m, i * k + j]
            moment = 0.0
            for i in range(m + 1):
                moment += flat[i] * pitch[m - i, j]
            for i in range(n):
                total = -b[i] * moment
                for other in range(n):
                    total += A[i, other] * D[m, other * k + j]
                D[m + 1, i * k + j] = total / (m + 1)
