"""Compiled end states of a whole column of a map: cells of one system, decided in their order.

A cell is followed from return to return on the section where y leaves the spring's top switch
upwards. It is over when

- a bound of all the motion to come stays within the present piece (damped), or
- it has joined the path of an earlier cell that ended on an attracting cycle: three returns in a
  row lie on three segments in a row of that path, and come closer to it or stay within the
  error of a straight segment. Where the segments of a path follow each other smoothly and only
  get shorter, the path is the slow curve of the return map on its way into the cycle, all other
  directions contract onto it, and along it there is but one way to go.

Everything else (the first cells of a column, motions that never reach the section, chaotic ones,
unstable outer pieces) goes to `timemarch._kernel_exact_ends.settle` from where it stands.
"""

from __future__ import annotations

import numpy as np

from aeroflutter.kernels import kernel
from aeroflutter.kernels.arrays import Real1, Real2, Whole2
from aeroflutter.motion._kernel_exact import (
    HIGH,
    HUGE,
    LOW,
    NONE,
    RISING,
    STICK,
    Index,
    advance,
    clear,
    clip,
    combine,
    event,
    round_off,
    variable,
    workspace,
)
from aeroflutter.motion._kernel_exact_cycle import keep, no_cycles
from aeroflutter.motion._kernel_exact_ends import (
    AMPLITUDE,
    ATTRACTOR,
    BIAS,
    REST,
    TIME,
    Problem,
    report,
    settle,
)
from aeroflutter.motion._kernel_exact_proofs import (
    CONVERGED,
    DAMPED,
    KNOWN,
    LCO,
    MARGIN,
    TRAPPED,
)
from aeroflutter.motion._kernel_exact_roots import Y
from aeroflutter.motion._kernel_exact_tables import DEGREE, Array
from aeroflutter.studies.maps._kernel_paths import (
    MOST_PATHS,
    MOST_RETURNS,
    beside,
    no_paths,
    remember,
    segment,
    settled,
)
from aeroflutter.studies.maps._kernel_targets import MOST_SWITCHES, aim, caught, no_targets

OVER, JOINED, CAUGHT, OPEN = 0, 1, 2, 3  # what following a cell came to

MOST_STEPS = 4000
BESIDE = 3e-2  # relative distance from a path at which it is first compared with it
CLOSER = 0.8  # factor by which it must come closer
STRAIGHT = 0.05  # part of a segment by which it may bend
FLOOR = 1e-6
CONFIRMED = 2  # further returns that agree with a path
NEAR = 5e-2  # relative distance from a known cycle within which returns are compared with its map
LONG = 12  # returns from which a path is worth keeping beside its cycle
UNKNOWN = 4  # settled returns in a row before a cycle is sought beside the known ones
PATIENCE = 24  # returns near a known cycle that do not go to it


@kernel
def follow(
    lines: Array, flows: Array, steps: Array, noise: Array,
    generator: Array, c: Array, memory: int, edges: Array, table: Index, offsets: Array,
    loop: Array, law_size: float, decays: Index, rows: Array, heads: Index, centre: Array,
    rests: Array, free: Array, xs: Array, w: Array, line: Array, M: Array, h: float, points: Array,
    rates: Array, smooth: Index, sizes: Array, length: Index, count: int, at_cycle: Array,
    cycle_size: Array, cycle_Q: Array, cycle_P: Array, rho: Array, lags: Index, cycles: int,
    hints: Index, far: Array, agreed: Index, scratch: Array, time: float,
) -> tuple[int, int, int, float, float, float, int]:  # fmt: skip
    """Follow one cell until it is over, has joined a path, or is for `settle` to decide.

    Parameters
    ----------
    lines … table, offsets, loop
        The tables and the law of the system, see `timemarch`.
    decays … free
        Proofs that a motion stays on its piece.
    xs
        (x, u) in row 0; work space in row 1.
    h
        Memory of the spring.
    points … length
        Paths; `count` of them are known, the cell at hand fills the last.
    at_cycle … lags
        Targets; `cycles` of them are known.
    hints, far, agreed, scratch
        Work space.
    time
        Longest time.

    Returns
    -------
    end, q, now, h, t, rest, k
        What came of it, the path joined or the cycle, the row of `xs` that holds the state, its memory, the
        time, the y of rest, and the number of returns.
    """
    n = c.size
    own = points.shape[0] - 1
    v1, v2, h_low, h_high = loop[0], loop[1], loop[2], loop[3]
    now, t, k = 0, 0.0, 0
    y = 0.0
    for i in range(n):
        y += c[i] * xs[0, i]
    mode = 0
    if memory:
        h = clip(clip(h, y - v1, y - v2), h_low, h_high)
    else:
        while mode + 1 < offsets.size and y >= edges[mode + 1]:
            mode += 1
    top = offsets.size - 2  # the piece below the last edge
    for q in range(count):
        hints[q], agreed[q], far[q] = -1, -1, np.inf
    switches, waits, still = 0, 0, 0
    kind = LOW  # so that the first mode is looked at
    p, piece, u, low, high, direction = 0, 0, 0.0, 0.0, 0.0, 0
    for _ in range(MOST_STEPS * MOST_RETURNS):
        if kind != NONE:
            if memory == 0:
                p, piece, u, low, high, direction = (
                    table[mode], mode, -offsets[mode], edges[mode], edges[mode + 1], 0,
                )  # fmt: skip
            elif mode == STICK:
                p, u, direction = table[0], h, 0
                low = -np.inf if h <= h_low else h + v2
                high = np.inf if h >= h_high else h + v1
            elif mode == RISING:
                p, u, low, high, direction = table[1], -v1, -np.inf, h_high + v1, 1
            else:
                p, u, low, high, direction = table[1], -v2, h_low + v2, np.inf, -1
        xs[now, n] = u
        if direction == 0 and decays[piece]:
            rest = rests[piece, 0] + rests[piece, 1] * h
            y = 0.0
            for j in range(n):
                rest += free[piece, j] * xs[now, j]
                y += c[j] * xs[now, j]
            room = min(high - rest, rest - low)
            if abs(y - rest) < room:
                bound, group = 0.0, 0.0
                for i in range(n):
                    value = 0.0
                    for j in range(n):
                        away = xs[now, j] - centre[piece, 0, j] - centre[piece, 1, j] * h
                        value += rows[piece, i, j] * away
                    if heads[piece, i]:
                        bound += np.sqrt(group)
                        group = 0.0
                    group += value * value
                bound += np.sqrt(group)
                if bound * MARGIN < room:
                    return OVER, -1, now, h, t, rest, k
        combine(lines, p, xs, now, line)
        if not abs(w[Y, DEGREE]) < HUGE:
            break
        s, kind = 1.0, NONE
        if not clear(w, low, high, direction):
            s, kind = event(w, low, high, direction, round_off(noise, xs, now, law_size))
            s = min(s, 1.0)
        advance(flows, p, s, xs, now, line, M, n)
        now = 1 - now
        t += s * steps[p]
        if t > time:
            break
        if kind == NONE:
            switches += 1
            if switches > MOST_STEPS:
                break
            continue
        returned = kind == HIGH and ((memory == 1 and mode == RISING) or mode == top)
        if memory == 0:
            mode = mode - 1 if kind == LOW else mode + 1
            piece = mode
        elif mode == STICK:
            mode = 2 if kind == LOW else RISING
            returned = False
        else:
            if kind == HIGH:
                h = h_high
            elif kind == LOW:
                h = h_low
            else:
                y = 0.0
                for i in range(n):
                    y += c[i] * xs[now, i]
                h = clip(y - (v1 if mode == RISING else v2), h_low, h_high)
            mode = STICK
        switches += 1
        if not returned:
            if switches > MOST_SWITCHES:
                break
            continue
        switches = 0
        speed = 0.0
        for i in range(n):
            if c[i] != 0.0:
                slope = generator[p, i, n] * u
                for j in range(n):
                    slope += generator[p, i, j] * xs[now, j]
                speed += c[i] * slope
        for i in range(n):
            points[own, k, i] = xs[now, i]
        rates[own, k] = speed
        for q in range(count):
            if hints[q] >= 0 and agreed[q] >= 0:
                at = hints[q] + 1
                inside = at + 1 < length[q] and (
                    (rates[q, at] <= speed < rates[q, at + 1])
                    or (rates[q, at + 1] < speed <= rates[q, at])
                )
                at = at if inside else -1
            else:
                at = segment(rates, length[q], q, speed, 0)
            if at < 0 or smooth[q, at] == 0:
                hints[q], agreed[q], far[q] = -1, -1, np.inf
                continue
            away, long = beside(points, rates, sizes, q, at, xs, now, speed)
            near = away < BESIDE and (
                agreed[q] < 0 or away < max(CLOSER * far[q], max(STRAIGHT * long, FLOOR))
            )
            if not near:
                hints[q], agreed[q], far[q] = -1, -1, np.inf
                continue
            hints[q], far[q] = at, away
            agreed[q] += 1
            if agreed[q] >= CONFIRMED and away < max(STRAIGHT * long, FLOOR):
                return JOINED, q, now, h, t, 0.0, k
        close_by = False
        for j in range(cycles):
            worst = 0.0
            for i in range(n):
                worst = max(worst, abs(xs[now, i] - at_cycle[j, i]) / cycle_size[j, i])
            if worst < NEAR and lags[j] > 0:
                close_by = True
                if k >= 2 * lags[j] and caught(
                    at_cycle, cycle_size, cycle_Q, cycle_P, rho, j, points, own, k, lags[j],
                    scratch,
                ):  # fmt: skip
                    return CAUGHT, j, now, h, t, 0.0, k + 1
        waits += close_by
        still = still + 1 if settled(points, rates, own, k) else 0
        if still > (UNKNOWN if cycles else 0) and (waits > PATIENCE or not close_by):
            return OPEN, -1, now, h, t, 0.0, k + 1
        k += 1
        if k == MOST_RETURNS:
            break
    return OPEN, -1, now, h, t, 0.0, k


@kernel(entry=True)
def decide_column(
    problem: Problem, states: Real2, memories: Real1, codes: Whole2, numbers: Real2
) -> tuple[int, int]:
    """End states of the cells of one system.

    Parameters
    ----------
    problem
        The system, its spring and the limits.
    states, memories
        Where the cells start, (m, n) and (m,).
    codes
        Filled with state and reason, (m, 2).
    numbers
        Filled with what was found, (m, `NUMBERS`).

    Returns
    -------
    joined, paths
        Number of cells that joined a path, and of paths.
    """
    tables, law, proofs = problem.tables, problem.law, problem.proofs
    n = tables.c.size
    known, own_cycle = no_cycles(MOST_PATHS, n), no_cycles(1, n)
    paths, targets = no_paths(n), no_targets(n)
    scratch = np.empty((5, n))
    work = workspace(n)
    xs, w, line, M = work.xs, work.polynomials, work.line, work.M
    hints = np.empty(MOST_PATHS, dtype=np.int64)
    agreed = np.empty(MOST_PATHS, dtype=np.int64)
    far = np.empty(MOST_PATHS)
    x = np.empty(n)
    cycles, count, joined = variable(0), variable(0), 0
    for cell in range(memories.size):
        h, t, k = memories[cell], 0.0, 0
        x[:] = states[cell]
        if proofs.unstable == 0:
            xs[0, :n] = x
            end, q, now, h, t, rest, k = follow(
                tables.lines, tables.flow, tables.step,
                tables.noise, tables.generator, tables.c, law.memory, law.edges, law.table,
                law.offsets, law.loop, law.size, proofs.decays, proofs.rows, proofs.heads,
                proofs.centre, proofs.rest, proofs.free, xs, w, line, M, h, paths.points, paths.rates,
                paths.smooth, paths.sizes, paths.length, count, targets.point,
                targets.size, targets.Q, targets.P, targets.rho, targets.lag, cycles, hints, far,
                agreed, scratch, problem.time,
            )  # fmt: skip
            if end == OVER:
                numbers[cell] = np.nan
                numbers[cell, TIME], numbers[cell, AMPLITUDE] = t, 0.0
                numbers[cell, BIAS] = numbers[cell, REST] = rest
                codes[cell, 0], codes[cell, 1] = DAMPED, TRAPPED
                continue
            if end != OPEN:
                j = paths.cycle[q] if end == JOINED else q
                numbers[cell] = np.nan
                numbers[cell, TIME] = t
                report(numbers[cell], known, j, j)
                codes[cell, 0], codes[cell, 1] = LCO, KNOWN
                joined += 1
                if end == CAUGHT and k >= LONG and count < MOST_PATHS:
                    remember(paths, count, k, j)
                    count += 1
                continue
            x[:] = xs[now, :n]
        state, reason, _, _ = settle(problem, known, cycles, own_cycle, x, h, numbers[cell])
        numbers[cell, TIME] += t
        codes[cell, 0], codes[cell, 1] = state, reason
        if state != LCO:
            continue
        if reason == CONVERGED:
            if own_cycle.free[0] or cycles == known.loops.size:
                continue
            keep(own_cycle, known, cycles)
            numbers[cell, ATTRACTOR] = cycles
            aim(tables, law, known, cycles, targets)
            cycles += 1
        if count < MOST_PATHS and k >= LONG:
            remember(paths, count, k, int(numbers[cell, ATTRACTOR]))
            count += 1
    return joined, count
