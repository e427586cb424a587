"""Compiled march of a motion with laws of polynomial pieces and its tangents, by Taylor series.

δ' = (A - B F'(y) C) δ is linear along the motion: its coefficients follow from one another
as those of the motion do, and its series converge as far. Laws are continuous, so a change of the
piece leaves the tangents as they are.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.kernels import kernel
from aeroflutter.kernels.arrays import Given1, Given2, Real1, Real2, Whole1
from aeroflutter.motion._kernel_taylor import (
    FULL,
    IDLE,
    MOST_TURNS,
    ORDER,
    REACHED,
    STALLED,
    evaluate,
    expand,
    first_leaving,
    nest,
    reach,
    room_of,
    turning,
)

Array = NDArray[np.float64]


@kernel(entry=True)
def march(
    A: Given2,
    B: Given2,
    C: Given2,
    d: Given1,
    beta: Given2,
    edges: Given2,
    rows: Whole1,
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
    A, B, C, d, beta, edges
        The system, and the pieces of the laws; see `_kernel_taylor`.
    rows, x, tangents
        Pieces, state and tangents at `time`, (m,), (n,) and (n, k), replaced by those reached.
    slope
        Last y' that was not zero; 0 at the start.
    turns
        Filled with the time of every turning point, 1 at maxima and -1 at minima, and the state
        there, (found, 2 + n).

    Returns
    -------
    status, time, slope, found
        How it ended and when; y' there; turning points written.
    """
    n, k = tangents.shape
    X, Y, nested = room_of(B.shape[1], n, beta.shape[1])
    D, flat = np.empty((ORDER + 1, n * k)), np.empty(n * k)
    spots, found, idle = np.empty(MOST_TURNS), 0, 0
    while time < until:
        if found + MOST_TURNS > turns.shape[0]:
            return FULL, time, slope, found
        expand(A, B, C, d, beta, rows, x, X, Y, nested)
        expand_tangents(A, B, C, beta, rows, Y, nested, tangents, D)
        step, which, way = first_leaving(Y, edges, rows, min(reach(X), reach(D), until - time))
        end = until if step == until - time else time + step
        idle = 0 if end > time else idle + 1
        if idle > IDLE or (idle > 0 and which < 0):
            return STALLED, time, slope, found
        side = np.sign(slope)
        more, slope = turning(Y[0], step, slope, spots)
        for at in spots[:more]:
            turns[found, 0], turns[found, 1] = time + at, side
            evaluate(X, at, turns[found, 2:])
            side, found = -side, found + 1
        evaluate(X, step, x)
        evaluate(D, step, flat)
        tangents[:] = flat.reshape(n, k)
        time = end
        if which >= 0:
            rows[which] += way
    return REACHED, time, slope, found


@kernel
def expand_tangents(
    A: Array,
    B: Array,
    C: Array,
    beta: Array,
    rows: NDArray[np.int64],
    Y: Array,
    nested: Array,
    tangents: Array,
    D: Array,
) -> None:
    """Taylor coefficients of the tangents, (ORDER+1, n k), from those of every y."""
    (n, k), m, powers = tangents.shape, Y.shape[0], beta.shape[1] - 1
    steep = np.empty((m, powers))  # F' = β₁ + 2 β₂ y + 3 β₃ y² + …
    flat = np.zeros((m, ORDER))
    for s in range(m):
        for j in range(powers):
            steep[s, j] = (j + 1) * beta[rows[s], j + 1]
        flat[s, 0] = steep[s, 0]
        if powers > 1:
            for i in range(ORDER):
                flat[s, i] = nest(steep, s, Y[s], i, nested[s])
    D[0] = tangents.copy().reshape(n * k)
    pitch, moments = np.empty((m, ORDER, k)), np.empty(m)
    for q in range(ORDER):
        for j in range(k):
            for s in range(m):
                y, moment = 0.0, 0.0
                for i in range(n):
                    y += C[s, i] * D[q, i * k + j]
                pitch[s, q, j] = y
                for i in range(q + 1):
                    moment += flat[s, i] * pitch[s, q - i, j]
                moments[s] = moment
            for i in range(n):
                total = 0.0
                for s in range(m):
                    total -= B[i, s] * moments[s]
                for other in range(n):
                    total += A[i, other] * D[q, other * k + j]
                D[q + 1, i * k + j] = total / (q + 1)
