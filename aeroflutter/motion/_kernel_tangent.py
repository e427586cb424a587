"""Compiled variational flow: tangents carried from maximum to maximum of the first output."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.kernels import kernel
from aeroflutter.kernels.arrays import Real1, Real2
from aeroflutter.motion._kernel_carry import follow_y
from aeroflutter.motion._kernel_ends import memory_of, variable
from aeroflutter.motion._kernel_flow import (
    AT_TURN,
    LEAPT,
    NOW,
    STOPPED,
    TREND,
    Motion,
    System,
    march,
    output,
)
from aeroflutter.motion._kernel_jump import jump
from aeroflutter.springs._kernel_columns import SLIDES

Array = NDArray[np.float64]

PATIENCE = 20_000  # steps without an extremum
TROUGH, COUNT = 0, 1  # what `clock` carries on


@kernel(inner=True, bare=True)
def orthonormalise(tangents: Array, unit: Array, logs: Array) -> None:
    """Gram-Schmidt, done twice, in units of `unit`; adds the logarithms of the norms to `logs`.

    A tangent that has vanished stays zero and its logarithm is -inf.
    """
    m, columns = tangents.shape
    for k in range(columns):
        before = 0.0
        for i in range(m):
            before += (tangents[i, k] / unit[i]) ** 2
        for _ in range(2):
            for j in range(k):
                along = 0.0
                for i in range(m):
                    along += tangents[i, j] * tangents[i, k] / unit[i] ** 2
                for i in range(m):
                    tangents[i, k] -= along * tangents[i, j]
        total = 0.0
        for i in range(m):
            total += (tangents[i, k] / unit[i]) ** 2
        if total <= 1e-28 * before:
            for i in range(m):
                tangents[i, k] = 0.0
            logs[k] = -np.inf
            continue
        norm = np.sqrt(total)
        logs[k] += np.log(norm)
        for i in range(m):
            tangents[i, k] /= norm


@kernel(entry=True, patience=1.0, bare=True)
def returns(
    system: System,
    motion: Motion,
    unit: Real1,
    total: Real1,
    clock: Real1,
    points: Real2,
    times: Real1,
    troughs: Real1,
    logs: Real2,
) -> int:
    """March over the maxima of the first output, the tangents made orthonormal again at each.

    Parameters
    ----------
    motion
        With tangents; left where it stopped.
    unit
        What counts as one of each entry of (x, h), (n+m,).
    total
        Growth of the tangents so far, logarithms, (k,).
    clock
        Lowest y since the last maximum, and the number of maxima so far, (2,).
    points, times, troughs
        Filled with (x, h) at the maxima, their times, and the lowest minimum of y since the
        maximum before, (c, n+m), (c,), (c,).
    logs
        Filled with `total` there, (c, k).

    Returns
    -------
    int
        How the march stopped, see `_kernel_flow`; `STOPPED` once all maxima are reached.
    """
    m, n = system.C.shape
    none = motion.none
    status = variable(STOPPED)
    while clock[COUNT] < points.shape[0]:
        stop, most = variable(AT_TURN), variable(PATIENCE)
        status = march(system, motion, np.inf, most, stop, none, none, none)
        if status == LEAPT:
            jump(system, motion)
            continue
        if status != STOPPED:
            break
        now = motion.memo[NOW]
        first = 0
        y = output(system.C, first, motion.xs, now)
        if motion.memo[TREND] > 0:
            clock[TROUGH] = min(clock[TROUGH], y)
            continue
        row = int(clock[COUNT])
        for i in range(m):
            points[row, n + i] = memory_of(system, motion, i)
            if system.laws[i, motion.modes[i], SLIDES] != 0.0:
                follow_y(system.C, i, motion.tangents)
        orthonormalise(motion.tangents, unit, total)
        for j in range(n):
            points[row, j] = motion.xs[now, j]
        for k in range(total.size):
            logs[row, k] = total[k]
        times[row], troughs[row] = motion.clock[0], clock[TROUGH]
        clock[TROUGH] = np.inf
        clock[COUNT] += 1.0
    return status
