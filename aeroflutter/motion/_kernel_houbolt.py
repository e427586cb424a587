"""Compiled loops of Houbolt's scheme: arrays and numbers in, arrays and numbers out."""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeroflutter.kernels import kernel
from aeroflutter.kernels.arrays import Real1, Real2

PIECES, HYSTERESIS, POLYNOMIAL = 0, 1, 2

Array = NDArray[np.float64]
Row = tuple[float, ...]


class Recurrence(NamedTuple):
    """One step as a linear recurrence with the spring's moment as its only input.

    Matrices are flattened row by row into tuples: their lengths are then known to the compiler,
    which unrolls the loops over d degrees of freedom and n lag terms (d >= 1, n >= 1). The lengths
    below are those of the section with two lag terms, the common one.

    Attributes
    ----------
    q_q, q_l, q_j
        New displacements from the last three ones (d x 3d), oldest first, the last three rates of
        downwash λ (d x 3), and the Duhamel integrals (d x n).
    q_f
        New displacements from the new moment (d).
    l_new, l_old
        New λ from the new (d) and the last three (3d) displacements.
    j_j, j_l
        New Duhamel integrals from themselves (n) and from four λ, oldest first (n x 4).
    c
        Nonlinear coordinate y from the displacements (d).
    y_f
        Minus the answer of y to a new moment of one.
    frozen
        Whether the moment is taken at the old pitch.
    """

    q_q: Annotated[Row, 12]
    q_l: Annotated[Row, 6]
    q_j: Annotated[Row, 4]
    q_f: Annotated[Row, 2]
    l_new: Annotated[Row, 2]
    l_old: Annotated[Row, 6]
    j_j: Annotated[Row, 2]
    j_l: Annotated[Row, 8]
    c: Annotated[Row, 2]
    y_f: float
    frozen: bool


@kernel(entry=True)
def tangent(kind: int, law: Real2, memory: float, y: float) -> tuple[float, float]:
    """Slope and offset of the moment at y: F = slope y + offset near it.

    `law` is (3, m) for PIECES (breaks padded with infinity, slopes, offsets), (1, 4) for
    HYSTERESIS (v1, v2, lower and upper stop) and (1, m) for POLYNOMIAL (beta1, beta2, ...).
    """
    if kind == HYSTERESIS:
        play = min(max(memory, y - law[0, 0]), y - law[0, 1])
        stopped = min(max(play, law[0, 2]), law[0, 3])
        if play == memory or stopped != play:
            return 1.0, -stopped
        return 0.0, law[0, 0] if play > memory else law[0, 1]
    if kind == POLYNOMIAL:
        slope, offset = 0.0, 0.0
        for power in range(law.shape[1], 0, -1):
            slope = slope * y + power * law[0, power - 1]
            offset = (offset + (1.0 - power) * law[0, power - 1]) * y
        return slope, offset
    i = 0
    while y > law[0, i]:
        i += 1
    return law[1, i], law[2, i]


@kernel(entry=True)
def advance(kind: int, law: Real2, memory: float, y: float) -> float:
    """Memory after y has moved monotonically to its new value."""
    if kind != HYSTERESIS:
        return memory
    play = min(max(memory, y - law[0, 0]), y - law[0, 1])
    return min(max(play, law[0, 2]), law[0, 3])


@kernel
def moment_at(kind: int, law: Array, memory: float, y: float) -> float:
    """Moment of the spring at y, whatever its branch."""
    if kind == HYSTERESIS:
        return y - advance(kind, law, memory, y)
    slope, offset = tangent(kind, law, memory, y)
    return slope * y + offset


@kernel
def free_displacement(step: Recurrence, i: int, k: int, Q: Array, L: Array, J: Array) -> float:
    """New displacement i from the rows k to k + 2, but for the spring; the newest come last."""
    d = len(step.c)
    n = len(step.j_j)
    q = 0.0
    for j in range(3 * d):
        q += step.q_q[3 * d * i + j] * Q[d * k + j]
    for j in range(3):
        q += step.q_l[3 * i + j] * L[k + j]
    for j in range(n):
        q += step.q_j[n * i + j] * J[n * (k + 2) + j]
    return q


@kernel(entry=True, others=True)
def march(
    steps: int,
    last: int,
    step: Recurrence,
    kind: int,
    law: Real2,
    Q: Real1,
    L: Real1,
    J: Real1,
    Y: Real1,
    H: Real1,
) -> int:
    """Take `steps` steps along buffers, on from the history in the rows `last` to `last` + 2.

    Parameters
    ----------
    steps
        Number of steps N.
    last
        Number of steps that the buffers hold: the last three rows move to the front.
    step
        The recurrence.
    kind, law
        The spring, see `tangent`.
    Q, L, J
        Displacements (d (N + 3)), λ (N + 3) and Duhamel integrals (n (N + 3)), flat, row by row.
    Y, H
        Nonlinear coordinate and memory of the spring, (N + 3) each.

    Returns
    -------
    int
        Row of the last step whose branch of the spring differs from that of the step before;
        0 if none does.
    """
    d = len(step.c)
    n = len(step.j_j)
    for i in range(3):
        L[i], Y[i], H[i] = L[last + i], Y[last + i], H[last + i]
    for i in range(3 * d):
        Q[i] = Q[d * last + i]
    for i in range(3 * n):
        J[i] = J[n * last + i]
    last_switch = 0
    slope, offset = tangent(kind, law, H[1], 2.0 * Y[1] - Y[0])
    for k in range(steps):
        old_slope, old_offset = slope, offset
        slope, offset = tangent(kind, law, H[k + 2], 2.0 * Y[k + 2] - Y[k + 1])
        if slope != old_slope or offset != old_offset:
            last_switch = k + 3
        yielding = 1.0 / (1.0 + step.y_f * slope)
        y = 0.0
        for i in range(d):
            q = free_displacement(step, i, k, Q, L, J)
            Q[d * (k + 3) + i] = q
            y += step.c[i] * q
        if step.frozen:
            moment = moment_at(kind, law, H[k + 2], Y[k + 2])
            y -= step.y_f * moment
        else:
            y = (y - step.y_f * offset) * yielding
            moment = slope * y + offset
        lam = 0.0
        for j in range(3 * d):
            lam += step.l_old[j] * Q[d * k + j]
        for i in range(d):
            q = Q[d * (k + 3) + i] + step.q_f[i] * moment
            Q[d * (k + 3) + i] = q
            lam += step.l_new[i] * q
        L[k + 3] = lam
        for i in range(n):
            duhamel = step.j_j[i] * J[n * (k + 2) + i]
            for j in range(4):
                duhamel += step.j_l[4 * i + j] * L[k + j]
            J[n * (k + 3) + i] = duhamel
        Y[k + 3] = y
        H[k + 3] = advance(kind, law, H[k + 2], y)
    return last_switch
