"""Compiled search for attracting cycles: closing a near return, and whether the cycle attracts.

A point z = (x, h) on the section of maxima of the first output. The return map's derivative there
is the monodromy matrix with the direction of the flow projected out along the section.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.kernels import kernel
from aeroflutter.kernels.arrays import Real1
from aeroflutter.motion._kernel_dense import contraction, eliminate, slowest
from aeroflutter.motion._kernel_ends import MOST_LOOPS, Cycles, begin, memory_of, variable
from aeroflutter.motion._kernel_flow import (
    DONE,
    EVENT_COLUMNS,
    EVENTS,
    FULL,
    JUMPED,
    LEAPT,
    NOW,
    NOWHERE,
    TURN_COLUMNS,
    TURNS,
    UNKNOWN,
    Motion,
    System,
    enter,
    follow_y,
    march,
    output,
)
from aeroflutter.motion._kernel_jump import before, jump, rate
from aeroflutter.springs._kernel_columns import CEILING, FLOOR, HELD, SLIDES

Array = NDArray[np.float64]

NOTHING, ATTRACTS, INDIFFERENT, UNPREPARED = 0, 1, 2, 3
NEWTON_STEPS = 16
CLOSED = 1e-9  # relative residual of a cycle; Newton goes on to round-off
RETURNS = 1e-7  # the same where a part of a period is tried
CIRCLE = 1e-7  # distance of multipliers from the unit circle that is not told from zero
CONTINUUM = 1e-5  # distance of a multiplier from one in a continuum of cycles
ROWS = 64  # logs of one period, emptied as often as needed
FOREVER = 2**62


@kernel(inner=True)
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


@kernel(inner=True)
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


@kernel(inner=True)
def close(
    system: System, probe: Motion, z: Array, period: float, size: Array, monodromy: Array, f: Array
) -> tuple[int, float]:
    """Newton from a near return to the cycle: z(T) = z with y' = 0 at z.

    Parameters
    ----------
    z
        (x, h), (n+m,); left as the point of the cycle.
    period
        First guess of T.
    size
        Scale of each entry of z, (n+m,).
    monodromy
        Filled with d z(T)/d z, (n+m, n+m).
    f
        Filled with z' at z, as the monodromy has it, (n+m,).

    Returns
    -------
    status, period
        `ATTRACTS` if it closes.
    """
    m = z.size
    J, r, step = np.empty((m + 1, m + 1)), np.empty(m + 1), np.empty(m + 1)
    end, gradient = np.empty(m), np.empty(m)
    kept, kept_f = z.copy(), np.zeros(m)
    first, kept_period, best = period, period, np.inf
    for _ in range(NEWTON_STEPS):
        status = passage(system, probe, z, period, end)
        if status != DONE:
            if status == UNKNOWN:
                return UNPREPARED, period
            break
        for i in range(m):
            for j in range(m):
                J[i, j] = (probe.tangents[i, j] - (1.0 if i == j else 0.0)) * size[j] / size[i]
        slope = start_rate(system, probe, z, f, gradient)
        unit, worst = 0.0, 0.0
        for j in range(m):
            unit = max(unit, abs(gradient[j] * size[j]))
        f[:] = 0.0  # the memories rest
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
        kept[:] = z
        kept_f[:] = f
        kept_period = period
        monodromy[:] = probe.tangents
        eliminate(J, r, step)
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
    z[:] = kept
    f[:] = kept_f
    return (ATTRACTS, kept_period) if best < CLOSED else (NOTHING, first)


@kernel(inner=True)
def comes_back(system: System, probe: Motion, z: Array, time: float, size: Array) -> bool:
    """Whether z comes back to itself after a time."""
    end = np.empty(z.size)
    if passage(system, probe, z, time, end) != DONE:
        return False
    for i in range(z.size):  # noqa: SIM110 - a compiled loop
        if abs(end[i] - z[i]) > RETURNS * size[i]:
            return False
    return True


@kernel(inner=True)
def extremes(
    system: System, motion: Motion, z: Array, period: float
) -> tuple[float, float, int, bool]:
    """Smallest and largest y over one period from a maximum, the number of maxima, and whether

    there is a slider and none ever meets a stop.
    """
    m, n = system.C.shape
    begin(system, motion, z[:n], z[n:])
    first = 0
    least = most = output(system.C, first, motion.xs, first)
    maxima, inside = 1, False
    for i in range(m):
        inside = inside or system.laws[i, 0, HELD] != 0.0
    for i in range(m):
        if system.laws[i, 0, HELD] != 0.0:
            inside = inside and system.laws[i, 0, FLOOR] < z[n + i] < system.laws[i, 0, CEILING]
    none = motion.none
    events, turns = np.empty((ROWS, EVENT_COLUMNS)), np.empty((ROWS, TURN_COLUMNS))
    stop, longest = variable(NOWHERE), variable(FOREVER)
    memo = motion.memo
    status = FULL
    while status == FULL:
        status = march(system, motion, period, longest, stop, none, events, turns)
        for k in range(memo[TURNS]):
            least, most = min(least, turns[k, 1]), max(most, turns[k, 1])
            between = 1e-9 * period < turns[k, 0] < (1.0 - 1e-9) * period
            maxima += 1 if turns[k, 2] > 0.0 and between else 0
        for k in range(memo[EVENTS]):
            law = system.laws[int(events[k, 5]), 0]
            held = events[k, 3] - events[k, 4]
            inside = inside and (law[HELD] == 0.0 or law[FLOOR] < held < law[CEILING])
        memo[TURNS], memo[EVENTS] = 0, 0
    return least, most, maxima, inside


@kernel(inner=True)
def section_map(normal: Array, monodromy: Array, f: Array, size: Array, Q: Array) -> None:
    """Derivative of the return map on a section of this normal, in units of `size`."""
    m = f.size
    across = 0.0
    for i in range(m):
        across += normal[i] * f[i]
    for j in range(m):
        along = 0.0
        for i in range(m):
            along += normal[i] * monodromy[i, j]
        for i in range(m):
            Q[i, j] = (monodromy[i, j] - f[i] * along / across) * size[j] / size[i]


@kernel(entry=True, patience=15.0)
def find_cycle(
    system: System,
    probe: Motion,
    plain: Motion,
    point: Real1,
    period: float,
    lag: int,
    size: Real1,
    span: float,
    cycles: Cycles,
    place: int,
) -> int:
    """Close a near return into a cycle; enter it at a place of `cycles` if it attracts.

    Parameters
    ----------
    probe, plain
        Motions with tangents in as many columns as z has entries, and without.
    point
        (x, h) of the return, at a maximum of y, (n+m,).
    period, lag
        Time and number of maxima since the earlier return that it resembles.
    size
        Scale of each entry of `point`, (n+m,).
    span
        Height of the last loop.

    Returns
    -------
    int
        `ATTRACTS`, `INDIFFERENT` (a multiplier on the unit circle; its measures alone are entered),
        `NOTHING`, or `UNPREPARED`: give the mode of `probe` its table and call again.
    """
    z = point.copy()
    m = z.size
    unit = np.maximum(size, 1e-14 * np.max(size))
    monodromy, f, normal = np.empty((m, m)), np.empty(m), np.empty(m)
    scratch = np.empty(m)
    status, period = close(system, probe, z, period, unit, monodromy, f)
    if status != ATTRACTS:
        return status
    for part in range(1, lag):
        if lag % part == 0 and comes_back(system, probe, z, period * part / lag, unit):
            status, period = close(system, probe, z, period * part / lag, unit, monodromy, f)
            if status != ATTRACTS:
                return status
            break
    least, most, loops, inside = extremes(system, plain, z, period)
    if not (most - least > 1e-6 * span and loops <= MOST_LOOPS):
        return NOTHING
    # Of the return map: the direction of the motion is not in it, and where a jump of F is at the
    # section itself, it does not matter on which side of the section it counts.
    start_rate(system, probe, z, scratch, normal)
    section_map(normal, monodromy, f, unit, cycles.Q[place])
    if not np.all(np.isfinite(cycles.Q[place])):
        return NOTHING
    values = np.linalg.eigvals(cycles.Q[place].astype(np.complex128))
    free = 0
    if inside:
        k = np.argmin(np.abs(values - 1.0))
        if abs(values[k] - 1.0) < CONTINUUM:
            values[k] = 0.0
            free = 1
    leading = values[np.argmax(np.abs(values))]
    radius = abs(leading)
    if not radius < 1.0 + CIRCLE:
        return NOTHING
    cycles.z[place] = z
    cycles.size[place] = unit
    cycles.loops[place], cycles.free[place], cycles.period[place] = loops, free, period
    cycles.amplitude[place], cycles.bias[place] = 0.5 * (most - least), 0.5 * (most + least)
    cycles.radius[place] = radius
    if not radius < 1.0 - CIRCLE:
        return INDIFFERENT
    if free:
        cycles.rho[place] = 1.0
        return ATTRACTS
    cycles.rho[place] = contraction(cycles.Q[place], radius, cycles.P[place])
    slowest(cycles.Q[place], cycles.P[place], leading, cycles.slow[place])
    return ATTRACTS
