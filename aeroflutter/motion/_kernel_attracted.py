"""Compiled rule by which a motion goes to an attracting cycle: one for single motions and for maps.

The return map takes the distance d from the cycle to Q d + N(d). In the norm P in which Q contracts by
ρ a motion comes closer for good while |N(d)| <= (1 - ρ)/2 |d|. N falls faster than d, but from
direction to direction at its own rate, and what decides on which side of an unstable cycle nearby a
motion passes is the coordinate s that decays slowest: what the others, still large, push it by must be
little against s itself. So N, all of it, is measured against s, at two returns in a row. What s does
alone is not left to chance: it must lie within the reach up to which the return map of the cycle was
tried and seen to contract (`reach`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.kernels import kernel

Array = NDArray[np.float64]

ARRIVED = 1e-9  # relative distance at which there is nothing left to compare


@kernel(inner=True, bare=True)
def norm(P: Array, d: Array) -> float:
    """Length of d in the norm of P."""
    total = 0.0
    for i in range(d.size):
        row = 0.0
        for j in range(d.size):
            row += P[i, j] * d[j]
        total += d[i] * row
    return np.sqrt(max(total, 0.0))


@kernel(inner=True, bare=True)
def length(slow: Array, d: Array) -> float:
    """Length of the slowest coordinate of d."""
    real, imaginary = 0.0, 0.0
    for i in range(d.size):
        real += slow[0, i] * d[i]
        imaginary += slow[1, i] * d[i]
    return np.sqrt(real * real + imaginary * imaginary)


@kernel(inner=True, bare=True)
def closes_in(Q: Array, P: Array, slow: Array, rho: float, reach: float, d: Array) -> bool:
    """Whether the last three returns go to a cycle.

    Parameters
    ----------
    Q, P, rho
        Derivative of the return map, and the norm in which it contracts by ρ.
    slow
        Rows whose products with d are the slowest coordinate, in lengths of that norm, (2, n).
    reach
        Length of the slowest coordinate up to which the map contracts.
    d
        Distances from the cycle, the last first, (4, n); the fourth row is room.
    """
    n = slow.shape[1]
    nearest = 0.0
    for i in range(n):
        nearest = max(nearest, abs(d[0, i]))
    if nearest < ARRIVED:
        return True
    slack, before = 0.5 * (1.0 - rho), norm(P, d[2])
    for turn in range(1, -1, -1):
        for i in range(n):
            d[3, i] = d[turn, i]
            for j in range(n):
                d[3, i] -= Q[i, j] * d[turn + 1, j]
        far, s = norm(P, d[turn]), length(slow, d[turn + 1])
        if not (far < before and norm(P, d[3]) <= slack * s):
            return False
        before = far
    return length(slow, d[0]) <= reach
