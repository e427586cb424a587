"""Compiled march of a motion with laws of polynomial pieces and its tangents, by Taylor series.

δ' = (A - B F'(y) C) δ is linear along the motion: its coefficients follow from one another
as those of the motion do, and its series converge as far. Laws are continuous, so a change of the
piece leaves the tangents of the state as they are; those of a memory are told in `switch`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.kernels import kernel
from aeroflutter.kernels.arrays import Real1, Real2, Whole1
from aeroflutter.motion._kernel_taylor import (
    FULL,
    IDLE,
    MOST_TURNS,
    ORDER,
    REACHED,
    STALLED,
    Law,
    Series,
    evaluate,
    expand,
    first_leaving,
    nest,
    reach,
    room_of,
    switch,
    turning,
)
from aeroflutter.springs._kernel_columns import HELD, SLIDES

Array = NDArray[np.float64]


@kernel(entry=True)
def march(
    law: Law,
    rows: Whole1,
    z: Real1,
    tangents: Real2,
    time: float,
    until: float,
    slope: float,
    turns: Real2,
    events: Real2,
) -> tuple[int, float, float, int, int]:
    """March to a time, or until the turns or the switches are full, or no step is left.

    Parameters
    ----------
    law
        What is marched; see `_kernel_taylor`.
    rows, z, tangents
        Modes, state with memories and tangents at `time`, (m,), (N,) and (N, k), replaced by those
        reached.
    slope
        Last y' that was not zero; 0 at the start.
    turns
        Filled with the time of every turning point, 1 at maxima and -1 at minima, and z there,
        (found, 2 + N).
    events
        Filled with the switches, (switched, EVENT_COLUMNS).

    Returns
    -------
    status, time, slope, found, switched
        How it ended and when; y' there; turning points and switches written.
    """
    N, k = tangents.shape
    series = room_of(law)
    D, flat = np.empty((ORDER + 1, N * k)), np.empty(N * k)
    spots, found, switched, idle = np.empty(MOST_TURNS), 0, 0, 0
    while time < until:
        if found + MOST_TURNS > turns.shape[0] or switched == events.shape[0]:
            return FULL, time, slope, found, switched
        expand(law, rows, z, series)
        expand_tangents(law, rows, series, tangents, D)
        room = min(reach(series.z), reach(D), until - time)
        step, which, kind = first_leaving(law, rows, z, series.y, room)
        end = until if step == until - time else time + step
        idle = 0 if end > time else idle + 1
        if idle > IDLE or (idle > 0 and which < 0):
            return STALLED, time, slope, found, switched
        side = np.sign(slope)
        more, slope = turning(series.y[0], step, slope, spots)
        for at in spots[:more]:
            turns[found, 0], turns[found, 1] = time + at, side
            evaluate(series.z, at, turns[found, 2:])
            side, found = -side, found + 1
        evaluate(series.z, step, z)
        evaluate(D, step, flat)
        tangents[:] = flat.reshape(N, k)
        time = end
        if which >= 0:
            switch(law, rows, z, which, kind, tangents, time, events[switched])
            switched += 1
    return REACHED, time, slope, found, switched


@kernel
def expand_tangents(
    law: Law, rows: NDArray[np.int64], series: Series, tangents: Array, D: Array
) -> None:
    """Taylor coefficients of the tangents, (ORDER+1, N k), from those of the motion."""
    A, B, C, beta, table, held = law.A, law.B, law.C, law.beta, law.table, law.held
    N, k = tangents.shape
    m, n, powers = C.shape[0], C.shape[1], beta.shape[1] - 1
    steep = np.empty((m, powers))  # F' = β₁ + 2 β₂ y + 3 β₃ y² + …
    flat = np.zeros((m, ORDER))
    for s in range(m):
        for j in range(powers):
            steep[s, j] = (j + 1) * beta[rows[s], j + 1]
        flat[s, 0] = steep[s, 0]
        if powers > 1:
            for i in range(ORDER):
                flat[s, i] = nest(steep, s, series.y[s], i, series.nested[s])
    D[0] = tangents.copy().reshape(N * k)
    outputs, moments = np.empty((m, ORDER, k)), np.empty(m)
    told = k - 1 if law.dA.size > 0 else -1
    for q in range(ORDER):
        for j in range(k):
            for s in range(m):
                y, moment = 0.0, 0.0
                for i in range(n):
                    y += C[s, i] * D[q, i * k + j]
                outputs[s, q, j] = y
                for i in range(q + 1):
                    moment += flat[s, i] * outputs[s, q - i, j]
                if held[s] >= 0:
                    moment -= table[rows[s], HELD] * D[q, held[s] * k + j]
                moments[s] = moment
            for i in range(n):
                total = 0.0
                for s in range(m):
                    total -= B[i, s] * moments[s]
                for other in range(n):
                    total += A[i, other] * D[q, other * k + j]
                if j == told:
                    total += change(law, series, i, q)
                D[q + 1, i * k + j] = total / (q + 1)
            for s in range(m):
                if held[s] >= 0:
                    y = 0.0
                    for i in range(n):
                        y += C[s, i] * D[q + 1, i * k + j]
                    D[q + 1, held[s] * k + j] = table[rows[s], SLIDES] * y


@kernel
def change(law: Law, series: Series, i: int, q: int) -> float:
    """Coefficient q of the derivative of x'_i with respect to the parameter, at a state that stays."""
    total = 0.0
    for j in range(law.dA.shape[1]):
        total += law.dA[i, j] * series.z[q, j]
    for s in range(law.dB.shape[1]):
        total -= law.dB[i, s] * series.F[s, q]
    return total
