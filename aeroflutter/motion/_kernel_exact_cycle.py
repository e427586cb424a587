"""Compiled limit cycles of the exact engine: closing a near-return, and whether it attracts.

A point z = (x, h) on the section of pitch maxima. The return map's derivative there is the
monodromy matrix with the direction of the flow projected out along the section.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from aeroflutter.kernels import kernel
from aeroflutter.kernels.arrays import Real1, Real2, Real3, Whole1
from aeroflutter.motion._kernel_dense import contraction, eliminate, multipliers
from aeroflutter.motion._kernel_exact import (
    DONE,
    FULL,
    NONE,
    Law,
    advance,
    combine,
    event,
    output,
    round_off,
    start,
    switch,
    variable,
    window,
    workspace,
)
from aeroflutter.motion._kernel_exact_march import (
    EVENT_COLUMNS,
    EVENTS,
    TURN_COLUMNS,
    TURNS,
    flow,
    march,
    rate,
)
from aeroflutter.motion._kernel_exact_roots import Y_POWER, evaluate
from aeroflutter.motion._kernel_exact_tables import Array, Tables

NEWTON_STEPS = 16
CLOSED = 1e-9  # relative residual of a cycle; Newton goes on to round-off
NOTHING, ATTRACTS, INDIFFERENT = 0, 1, 2
MOST_LOOPS = 16
RING = 2 * MOST_LOOPS + 1  # returns kept: two periods and one
NEAR = 1e-2  # relative distance within which returns are compared with the linear map
ARRIVED = 1e-9  # relative distance at which there is nothing left to compare
CIRCLE = 1e-7  # distance of multipliers from the unit circle that is not told from zero
ROWS = 64  # logs of one period, emptied as often as needed


class Cycles(NamedTuple):
    """Attracting cycles, each by its point on the section of maxima; m cycles, n states.

    Attributes
    ----------
    z, size
        (x, h) of the point, and the scale of each, (m, n+1).
    Q, P, rho
        Derivative of the return map in units of `size`, the norm in which it contracts by ρ,
        (m, n+1, n+1) twice and (m,).
    loops
        Maxima a period, (m,); 0 marks an empty place.
    free
        1 for a member of a continuum of cycles, (m,).
    period, amplitude, bias, radius
        T, half peak-to-peak and midrange of y, largest modulus of the multipliers, (m,).
    """

    z: Real2
    size: Real2
    Q: Real3
    P: Real3
    rho: Real1
    loops: Whole1
    free: Whole1
    period: Real1
    amplitude: Real1
    bias: Real1
    radius: Real1


@kernel(entry=True)
def no_cycles(m: int, n: int) -> Cycles:
    """Room for m cycles of a system with n states."""
    return Cycles(
        np.zeros((m, n + 1)),
        np.ones((m, n + 1)),
        np.zeros((m, n + 1, n + 1)),
        np.zeros((m, n + 1, n + 1)),
        np.zeros(m),
        np.zeros(m, dtype=np.int64),
        np.zeros(m, dtype=np.int64),
        np.zeros(m),
        np.zeros(m),
        np.zeros(m),
        np.zeros(m),
    )


@kernel
def keep(source: Cycles, target: Cycles, j: int) -> None:
    """Copy the first cycle of `source` to place j of `target`."""
    target.z[j] = source.z[0]
    target.size[j] = source.size[0]
    target.Q[j] = source.Q[0]
    target.P[j] = source.P[0]
    target.rho[j] = source.rho[0]
    target.loops[j] = source.loops[0]
    target.free[j] = source.free[0]
    target.period[j] = source.period[0]
    target.amplitude[j] = source.amplitude[0]
    target.bias[j] = source.bias[0]
    target.radius[j] = source.radius[0]


@kernel
def slope_gradient(tables: Tables, law: Law, mode: int, h: float, out: Array) -> None:
    """Gradient of y' over (x, h) at a point that does not slide, (n+1,)."""
    n = tables.c.size
    p, _, _, _, _ = window(law, mode, h)
    for j in range(n + 1):
        out[j] = 0.0
        for i in range(n):
            out[j] += tables.c[i] * tables.generator[p, i, j]
    if law.memory == 0:
        out[n] = 0.0


@kernel
def start_rate(tables: Tables, law: Law, z: Array, f: Array) -> tuple[int, float]:
    """Mode and memory with which a motion from z begins; f is filled with z' there."""
    n = tables.c.size
    y = 0.0
    for i in range(n):
        y += tables.c[i] * z[i]
    mode, held = start(law, z[n], y)
    rate(tables, law, z[:n], held, mode, f[:n])
    f[n] = 0.0
    return mode, held


@kernel
def close(
    tables: Tables, law: Law, z: Array, period: float, size: Array, jacobian: Array, f: Array
) -> tuple[bool, float]:
    """Newton from a near-return to the cycle: z(T) = z with y' = 0 at z.

    Parameters
    ----------
    z
        (x, h), (n+1,); left as the point of the cycle.
    period
        First guess of T.
    size
        Scale of each entry of z, (n+1,).
    jacobian
        Filled with the monodromy matrix in its first n+1 columns, (n+1, n+2).
    f
        Filled with z' at z, (n+1,).

    Returns
    -------
    closed, period
    """
    n = tables.c.size
    m = n + 2
    J = np.empty((m, m))
    r = np.empty(m)
    step = np.empty(m)
    none = np.empty((0, EVENT_COLUMNS))
    x = np.empty(n)
    kept = z.copy()
    first = period
    kept_period = period
    best = np.inf
    derivative = np.empty_like(jacobian)
    for _ in range(NEWTON_STEPS):
        x[:] = z[:n]
        status, h, _, _ = flow(tables, law, x, z[n], variable(-1), period, derivative, none)
        if status != DONE:
            break
        mode, held = start_rate(tables, law, z, f)
        slope_gradient(tables, law, mode, held, J[m - 1, : n + 1])
        slope, unit = 0.0, 0.0
        for j in range(n + 1):
            J[m - 1, j] *= size[j]
            unit = max(unit, abs(J[m - 1, j]))
        for i in range(n):
            slope += tables.c[i] * f[i]
        r[m - 1] = -slope / unit
        J[m - 1, : n + 1] /= unit
        J[m - 1, n + 1] = 0.0
        worst = abs(r[m - 1])
        for i in range(n + 1):
            ahead = x[i] if i < n else (h if law.memory else z[n])
            r[i] = (z[i] - ahead) / size[i]
            worst = max(worst, abs(r[i]))
            for j in range(n + 1):
                J[i, j] = (derivative[i, j] - (1.0 if i == j else 0.0)) * size[j] / size[i]
            J[i, n + 1] = f[i] * period / size[i]
        if not worst < 0.5 * best:
            break
        best = worst
        kept[:] = z
        kept_period = period
        jacobian[:] = derivative
        eliminate(J, r, step)
        longest = 0.0
        for j in range(n + 1):
            longest = max(longest, abs(step[j]))
        if not (longest < 0.5 and abs(step[n + 1]) < 0.3):
            break
        for j in range(n + 1):
            z[j] += size[j] * step[j]
        period *= 1.0 + step[n + 1]
        if not 0.5 * first < period < 2.0 * first:
            break
    z[:] = kept
    if not best < CLOSED:
        return False, first
    start_rate(tables, law, z, f)
    return True, kept_period


@kernel
def returns(tables: Tables, law: Law, z: Array, time: float, size: Array) -> bool:
    """Whether z comes back to itself after `time`."""
    n = tables.c.size
    x = z[:n].copy()
    jacobian = np.empty((n + 1, n + 2))
    status, h, _, _ = flow(
        tables, law, x, z[n], variable(-1), time, jacobian, np.empty((0, EVENT_COLUMNS))
    )
    if status != DONE or (law.memory and abs(h - z[n]) > 1e-7 * size[n]):
        return False
    for i in range(n):  # noqa: SIM110 - a compiled loop
        if abs(x[i] - z[i]) > 1e-7 * size[i]:
            return False
    return True


@kernel
def extremes(
    tables: Tables, law: Law, z: Array, period: float, memory: Array
) -> tuple[float, float, int]:
    """Smallest and largest y over one period from a maximum, and the number of maxima.

    `memory` (2,) is filled with the smallest and largest memory at the switches.
    """
    n = tables.c.size
    x = z[:n].copy()
    h, mode, t = z[n], variable(-1), 0.0
    y = 0.0
    for i in range(n):
        y += tables.c[i] * z[i]
    least, most, maxima = y, y, 0
    memory[:] = h
    memo = np.zeros(5, dtype=np.int64)
    turns = np.empty((ROWS, TURN_COLUMNS))
    events = np.empty((ROWS, EVENT_COLUMNS))
    status = FULL
    while status == FULL:
        status, t, h, mode = march(
            tables, law, x, h, mode, t, period, np.empty(0), np.empty((0, n)), np.empty((0, 2)),
            events, turns, memo,
        )  # fmt: skip
        for k in range(memo[TURNS]):
            least, most = min(least, turns[k, 1]), max(most, turns[k, 1])
            maxima += turns[k, 2] > 0.0 and 1e-9 * period < turns[k, 0] < (1 - 1e-9) * period
        for k in range(memo[EVENTS]):
            held = events[k, 3] - events[k, 4]
            memory[0], memory[1] = min(memory[0], held), max(memory[1], held)
        memo[TURNS] = 0
        memo[EVENTS] = 0
    return least, most, maxima + 1


@kernel
def fundamental(
    tables: Tables, law: Law, z: Array, period: float, nodes: Array, weights: Array
) -> float:
    """Amplitude of the fundamental of y over the cycle through z.

    y is analytic within a step, so Gauss's rule on each step is exact to round-off.

    Parameters
    ----------
    nodes, weights
        Gauss's rule on [0, 1], (k,) each.
    """
    n = tables.c.size
    work = workspace(n)
    xs, w, line, M = work.xs, work.polynomials, work.line, work.M
    xs[0, :n] = z[:n]
    mode, h = start(law, z[n], output(tables.c, xs, 0))
    now, t, turn = 0, 0.0, 2.0 * np.pi / period
    real, imaginary = 0.0, 0.0
    while t < period:
        p, u, low, high, direction = window(law, mode, h)
        xs[now, n] = u
        combine(tables.lines, p, xs, now, line)
        tolerance = round_off(tables.noise, xs, now, law.size)
        s, kind = event(w, low, high, direction, tolerance)
        rest = (period - t) / tables.step[p]
        if rest < s:
            s, kind = rest, NONE
        s = min(s, 1.0)
        length = s * tables.step[p]
        for k in range(nodes.size):
            y = weights[k] * length * evaluate(w, Y_POWER, s * nodes[k])
            angle = turn * (t + nodes[k] * length)
            real += y * np.cos(angle)
            imaginary += y * np.sin(angle)
        advance(tables.flow, p, s, xs, now, line, M, n)
        now = 1 - now
        t = t + length if kind != NONE or s == 1.0 else period
        if kind != NONE:
            mode, h = switch(law, mode, h, output(tables.c, xs, now), kind)
    return 2.0 * np.hypot(real, imaginary) / period


@kernel
def section_map(
    tables: Tables, law: Law, z: Array, jacobian: Array, f: Array, size: Array, Q: Array
) -> None:
    """Derivative of the return map on the section y' = 0, in units of `size`, (n+1, n+1)."""
    n = tables.c.size
    normal = np.empty(n + 1)
    mode, h = start_rate(tables, law, z, f)
    slope_gradient(tables, law, mode, h, normal)
    across = 0.0
    for i in range(n + 1):
        across += normal[i] * f[i]
    for j in range(n + 1):
        along = 0.0
        for i in range(n + 1):
            along += normal[i] * jacobian[i, j]
        for i in range(n + 1):
            Q[i, j] = (jacobian[i, j] - f[i] * along / across) * size[j] / size[i]


@kernel
def find_cycle(
    tables: Tables,
    law: Law,
    point: Array,
    period: float,
    lag: int,
    size: Array,
    span: float,
    own: Cycles,
) -> int:
    """Close a near-return into a cycle; put it in `own` if it attracts.

    Parameters
    ----------
    point
        (x, h) of the return, at a maximum of y, (n+1,).
    period, lag
        Time and number of maxima since the earlier return that it resembles.
    size
        Scale of each entry of `point`, (n+1,).
    span
        Height of the last loop.

    Returns
    -------
    int
        `ATTRACTS`, `INDIFFERENT` (a multiplier on the unit circle) or `NOTHING`.
    """
    n = tables.c.size
    z = point.copy()
    unit = np.maximum(size, 1e-14 * np.max(size))
    jacobian = np.empty((n + 1, n + 2))
    f = np.empty(n + 1)
    closed, period = close(tables, law, z, period, unit, jacobian, f)
    if not closed:
        return NOTHING
    for part in range(1, lag):
        if lag % part == 0 and returns(tables, law, z, period * part / lag, unit):
            closed, period = close(tables, law, z, period * part / lag, unit, jacobian, f)
            break
    memory = np.empty(2)
    least, most, loops = extremes(tables, law, z, period, memory)
    if not (closed and most - least > 1e-6 * span and loops <= MOST_LOOPS):
        return NOTHING
    values = multipliers(jacobian, law.memory)
    inside = memory[0] > law.loop[2] and memory[1] < law.loop[3]
    free = 0
    if law.memory and inside:
        k = np.argmin(np.abs(values - 1.0))
        if abs(values[k] - 1.0) < 1e-5:
            values[k] = 0.0
            free = 1
    radius = np.max(np.abs(values))
    if not radius < 1.0 - CIRCLE:
        return INDIFFERENT if radius < 1.0 + CIRCLE else NOTHING
    own.z[0] = z
    own.size[0] = unit
    own.loops[0], own.free[0], own.period[0] = loops, free, period
    own.amplitude[0], own.bias[0], own.radius[0] = (
        0.5 * (most - least),
        0.5 * (most + least),
        radius,
    )
    section_map(tables, law, z, jacobian, f, unit, own.Q[0])
    own.rho[0] = 1.0 if free else contraction(own.Q[0], radius, own.P[0])
    return ATTRACTS


@kernel
def _apart(cycles: Cycles, j: int, points: Array, k: int, before: int) -> tuple[float, float]:
    """Distance of return k from cycle j, and from where the linear map puts return `before`."""
    z, size, P, Q = cycles.z[j], cycles.size[j], cycles.P[j], cycles.Q[j]
    m = z.size
    away = np.empty(m)
    miss = np.empty(m)
    for i in range(m):
        away[i] = (points[k % RING, i] - z[i]) / size[i]
        miss[i] = away[i]
        for n in range(m):
            miss[i] -= Q[i, n] * (points[before % RING, n] - z[n]) / size[n]
    far, off = 0.0, 0.0
    for i in range(m):
        for n in range(m):
            far += away[i] * P[i, n] * away[n]
            off += miss[i] * P[i, n] * miss[n]
    return np.sqrt(max(far, 0.0)), np.sqrt(max(off, 0.0))


@kernel
def offset(cycles: Cycles, j: int, point: Array) -> float:
    """Largest relative difference of a return from the point of cycle j."""
    worst = 0.0
    for i in range(point.size):
        worst = max(worst, abs(point[i] - cycles.z[j, i]) / cycles.size[j, i])
    return worst


@kernel
def attracted(cycles: Cycles, j: int, points: Array, k: int) -> bool:
    """Whether the last three returns of a motion go to cycle j as its linear map says.

    Each of two returns must come closer, in the norm in which the map contracts by ρ, and must
    land within (1 - ρ)/2 of the distance before of where the linear map puts it: what the
    linear map leaves out shrinks faster than the distance, so all later returns do the same. In
    a continuum of cycles the returns are compared with each other.

    Parameters
    ----------
    points
        Ring of the returns (x, h), (RING, n+1); the last is k.
    """
    lag = cycles.loops[j]
    if k < 2 * lag:
        return False
    near = offset(cycles, j, points[k % RING])
    if not near < NEAR:
        return False
    if cycles.free[j]:
        late, early = 0.0, 0.0
        for i in range(points.shape[1]):
            size = cycles.size[j, i]
            step = points[k % RING, i] - points[(k - lag) % RING, i]
            late = max(late, abs(step) / size)
            step = points[(k - lag) % RING, i] - points[(k - 2 * lag) % RING, i]
            early = max(early, abs(step) / size)
        return late < 0.1 * ARRIVED or (late < 0.5 * early and late < ARRIVED)
    if near < ARRIVED:
        return offset(cycles, j, points[(k - lag) % RING]) < NEAR
    slack = 0.5 * (1.0 - cycles.rho[j])
    late, late_miss = _apart(cycles, j, points, k, k - lag)
    early, early_miss = _apart(cycles, j, points, k - lag, k - 2 * lag)
    if not (late < early and late_miss <= slack * early):
        return False
    first, _ = _apart(cycles, j, points, k - 2 * lag, k - 2 * lag)
    return early < first and early_miss <= slack * first
