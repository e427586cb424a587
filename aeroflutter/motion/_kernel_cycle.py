"""Compiled search for cycles: Newton's method from a near return.

A point z = (x, h) on the section of maxima of the first output.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeroflutter.kernels import kernel
from aeroflutter.kernels.arrays import Real1, Real2, Whole1
from aeroflutter.motion._kernel_carry import follow_y
from aeroflutter.motion._kernel_dense import eliminate
from aeroflutter.motion._kernel_ends import begin, memory_of, variable
from aeroflutter.motion._kernel_flow import (
    DONE,
    JUMPED,
    LEAPT,
    NOW,
    NOWHERE,
    UNKNOWN,
    Motion,
    System,
    enter,
    march,
)
from aeroflutter.motion._kernel_jump import before, jump, rate
from aeroflutter.springs._kernel_columns import CEILING, FLOOR, HELD, SLIDES

Array = NDArray[np.float64]

NOTHING, ATTRACTS, INDIFFERENT, UNPREPARED = 0, 1, 2, 3
NEWTON_STEPS = 16
CLOSED = 1e-9  # relative residual of a cycle; Newton goes on to round-off
FOREVER = 2**62


class Room(NamedTuple):
    """What Newton's method works with; k entries of z = (x, h).

    Attributes
    ----------
    monodromy
        d z(T)/d z at the cycle, (k, k).
    f
        z' at the cycle, as the monodromy has it, (k,).
    normal
        Gradient of y' over z where the cycle begins, (k,).
    J, r, step, order
        A Newton step: its matrix, right side and solution, and places of its columns, (k+1, ...).
    end, kept, kept_f, start_f
        The end of a period; the best z and its z' so far; z' at the start, (k,).
    """

    monodromy: Real2
    f: Real1
    normal: Real1
    J: Real2
    r: Real1
    step: Real1
    order: Whole1
    end: Real1
    kept: Real1
    kept_f: Real1
    start_f: Real1


@kernel(inner=True, bare=True)
def passage(system: System, motion: Motion, z: Array, time: float, end: Array) -> int:
    """The motion from z over a time, with tangents: `end` (n+m,), and d end/d z in `motion`.

    The first row of `rates` is left as x' there, before a jump whose tangents are still to come.
    """
    m, n = system.C.shape
    begin(system, motion, z[:n], z[n:])
    tangents = motion.tangents
    tangents[:] = 0.0
    for i in range(n):
        tangents[i, i] = 1.0
    for i in range(m):
        row = system.laws[i, motion.modes[i]]
        if row[HELD] == 0.0:
            continue
        if motion.h[i] == z[n + i]:
            tangents[n + i, n + i] = 1.0
        elif row[FLOOR] < motion.h[i] < row[CEILING]:
            for j in range(n):
                tangents[n + i, j] = system.C[i, j]
    none = motion.none
    stop, most = variable(NOWHERE), variable(FOREVER)
    status = LEAPT
    while status == LEAPT:
        status = march(system, motion, time, most, stop, none, none, none)
        if status == LEAPT:
            jump(system, motion)
    now = motion.memo[NOW]
    for j in range(n):
        end[j] = motion.xs[now, j]
    for i in range(m):
        end[n + i] = memory_of(system, motion, i)
        if system.laws[i, motion.modes[i], SLIDES] != 0.0:
            follow_y(system.C, i, tangents)
    if status == DONE and motion.memo[JUMPED] > 0:
        before(system, motion)
    elif status == DONE:
        p, first = enter(system, motion), variable(0)
        if p < 0:
            return UNKNOWN
        rate(system, motion, p, motion.inputs, first)
    return status


@kernel(inner=True, bare=True)
def start_rate(system: System, motion: Motion, z: Array, f: Array, gradient: Array) -> float:
    """y' where a motion from z begins; z' and the gradient of y' over z there, (n+m,) each."""
    m, n = system.C.shape
    begin(system, motion, z[:n], z[n:])
    p = enter(system, motion)
    slope = 0.0
    f[:] = 0.0
    gradient[:] = 0.0
    for i in range(n):
        for j in range(n):
            f[i] += system.generator[p, i, j] * z[j]
            gradient[j] += system.C[0, i] * system.generator[p, i, j]
        for j in range(motion.inputs.size):
            f[i] += system.generator[p, i, n + j] * motion.inputs[j]
        for j in range(m):
            held = system.laws[j, motion.modes[j], HELD]
            gradient[n + j] += system.C[0, i] * system.generator[p, i, n + j] * held
        slope += system.C[0, i] * f[i]
    return slope


@kernel(entry=True, patience=4.0, bare=True)
def close(
    system: System, probe: Motion, room: Room, z: Real1, period: float, size: Real1
) -> tuple[int, float]:
    """Newton from a near return to the cycle: z(T) = z with y' = 0 at z.

    Parameters
    ----------
    probe
        A motion with tangents in as many columns as z has entries.
    room
        Left with what was found of the cycle.
    z
        (x, h), (n+m,); left as the point of the cycle.
    period
        First guess of T.
    size
        Scale of each entry of z, (n+m,).

    Returns
    -------
    status, period
        `ATTRACTS` if it closes, `UNPREPARED` before a mode without a table, or `NOTHING`.
    """
    m = z.size
    J, r, step, end, f, gradient = (
        room.J, room.r, room.step, room.end, room.f, room.normal,
    )  # fmt: skip
    first, kept_period, best = period, period, np.inf
    for i in range(m):
        room.kept[i], room.kept_f[i] = z[i], 0.0
    for _ in range(NEWTON_STEPS):
        status = passage(system, probe, z, period, end)
        if status != DONE:
            if status == UNKNOWN:
                return UNPREPARED, period
            break
        for i in range(m):
            for j in range(m):
                J[i, j] = (probe.tangents[i, j] - (1.0 if i == j else 0.0)) * size[j] / size[i]
        slope = start_rate(system, probe, z, room.start_f, gradient)
        unit, worst = 0.0, 0.0
        for j in range(m):
            unit = max(unit, abs(gradient[j] * size[j]))
            f[j] = 0.0  # the memories rest
        for j in range(system.C.shape[1]):
            f[j] = probe.rates[0, j]
        for j in range(m):
            J[m, j] = gradient[j] * size[j] / unit
            J[j, m] = f[j] * period / size[j]
            r[j] = (z[j] - end[j]) / size[j]
            worst = max(worst, abs(r[j]))
        J[m, m], r[m] = 0.0, -slope / unit
        worst = max(worst, abs(r[m]))
        if not worst < 0.5 * best:
            break
        best = worst
        kept_period = period
        for i in range(m):
            room.kept[i], room.kept_f[i] = z[i], f[i]
            for j in range(m):
                room.monodromy[i, j] = probe.tangents[i, j]
        eliminate(J, r, step, room.order)
        longest = 0.0
        for j in range(m):
            longest = max(longest, abs(step[j]))
        if not (longest < 0.5 and abs(step[m]) < 0.3):
            break
        for j in range(m):
            z[j] += size[j] * step[j]
        period *= 1.0 + step[m]
        if not 0.5 * first < period < 2.0 * first:
            break
    for i in range(m):
        z[i], f[i] = room.kept[i], room.kept_f[i]
    if not best < CLOSED:
        return NOTHING, first
    start_rate(system, probe, z, room.start_f, gradient)
    return ATTRACTS, kept_period
