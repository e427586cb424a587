"""Compiled cycles on the section of a column, and whether the returns of a cell go to one."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from aeroflutter.kernels import kernel
from aeroflutter.motion._kernel_dense import contraction
from aeroflutter.motion._kernel_exact import HIGH, RISING, STICK, Index, Law, variable
from aeroflutter.motion._kernel_exact_cycle import Cycles
from aeroflutter.motion._kernel_exact_march import (
    EVENT_COLUMNS,
    EVENTS,
    TURN_COLUMNS,
    flow,
    march,
    rate,
)
from aeroflutter.motion._kernel_exact_tables import Array, Tables
from aeroflutter.studies.maps._kernel_paths import MOST_PATHS

MOST_SWITCHES = 64  # between two returns


class Targets(NamedTuple):
    """Known attracting cycles on the section: q cycles, n states.

    Attributes
    ----------
    point, size
        State of the cycle where it returns, and the scale of each, (q, n).
    Q, P, rho
        Derivative of the return map over a period in units of `size`, and the norm in which it
        contracts by ρ, (q, n, n) twice and (q,).
    lag
        Returns a period, (q,); 0 where the cycle does not come to the section.
    """

    point: Array
    size: Array
    Q: Array
    P: Array
    rho: Array
    lag: Index


@kernel
def no_targets(n: int) -> Targets:
    """Room for the cycles of a column."""
    return Targets(
        np.zeros((MOST_PATHS, n)),
        np.ones((MOST_PATHS, n)),
        np.zeros((MOST_PATHS, n, n)),
        np.zeros((MOST_PATHS, n, n)),
        np.ones(MOST_PATHS),
        np.zeros(MOST_PATHS, dtype=np.int64),
    )


@kernel
def aim(tables: Tables, law: Law, known: Cycles, j: int, targets: Targets) -> None:
    """Enter known cycle j among the targets, if it returns to the section."""
    n = tables.c.size
    events = np.empty((MOST_SWITCHES, EVENT_COLUMNS))
    memo = np.zeros(5, dtype=np.int64)
    nothing, empty, pairs = np.empty(0), np.empty((0, n)), np.empty((0, 2))
    x, h, period = known.z[j, :n].copy(), known.z[j, n], known.period[j]
    turns = np.empty((0, TURN_COLUMNS))
    march(tables, law, x, h, variable(-1), 0.0, period, nothing, empty, pairs, events, turns, memo)
    first, lag = -1, 0
    after = STICK if law.memory else law.offsets.size - 1
    for k in range(min(memo[EVENTS], MOST_SWITCHES - 1)):
        left_flat = law.memory == 0 or (k > 0 and events[k - 1, 2] == RISING)
        if events[k, 1] == HIGH and events[k, 2] == after and left_flat:
            lag += 1
            first = k if first < 0 else first
    if first < 0 or memo[EVENTS] >= MOST_SWITCHES:
        return
    memo[:] = 0
    x[:] = known.z[j, :n]
    until = events[first, 0]
    march(tables, law, x, h, variable(-1), 0.0, until, nothing, empty, pairs, events, turns, memo)
    held = law.loop[3] if law.memory else 0.0
    f, jacobian = np.empty(n), np.empty((n + 1, n + 2))
    rate(tables, law, x, held, after, f)
    targets.point[j] = x
    targets.size[j] = known.size[j, :n]
    flow(tables, law, x, held, after, period, jacobian, np.empty((0, EVENT_COLUMNS)))
    across = np.dot(tables.c, f)
    Q, size = targets.Q[j], targets.size[j]
    for i in range(n):
        for k in range(n):
            along = 0.0
            for m in range(n):
                along += tables.c[m] * jacobian[m, k]
            Q[i, k] = (jacobian[i, k] - f[i] * along / across) * size[k] / size[i]
    targets.rho[j] = contraction(Q, known.radius[j], targets.P[j])
    targets.lag[j] = lag


@kernel
def caught(
    at: Array, size: Array, Q: Array, P: Array, rho: Array, j: int, points: Array, row: int,
    k: int, lag: int, work: Array,
) -> bool:  # fmt: skip
    """Whether the last three returns go to target j as its linear map says.

    Each of two returns must come closer, in the norm in which the map contracts by ρ, and must
    land within (1 - ρ)/2 of the distance before of where the linear map puts it: what the
    linear map leaves out shrinks faster than the distance, so all later returns do the same.
    """
    n = at.shape[1]
    for i in range(n):
        for m in range(3):
            work[m, i] = (points[row, k - m * lag, i] - at[j, i]) / size[j, i]
    reach = np.empty(3)
    miss = np.empty(2)
    for m in range(2):
        for i in range(n):
            image = 0.0
            for o in range(n):
                image += Q[j, i, o] * work[m + 1, o]
            work[3 + m, i] = work[m, i] - image
    for m in range(5):
        total = 0.0
        for i in range(n):
            for o in range(n):
                total += work[m, i] * P[j, i, o] * work[m, o]
        if m < 3:
            reach[m] = np.sqrt(max(total, 0.0))
        else:
            miss[m - 3] = np.sqrt(max(total, 0.0))
    slack = 0.5 * (1.0 - rho[j])
    return (
        reach[0] < reach[1] < reach[2]
        and miss[0] <= slack * reach[1]
        and miss[1] <= slack * reach[2]
    )
