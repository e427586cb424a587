"""Compiled end states of the exact engine: each is decided by something that certifies it.

- damped: a bound of all the motion to come on this linear piece stays within the piece;
- divergent: an unstable coordinate of the outer piece outgrows all that the spring can oppose;
- lco: successive returns follow the linearised return map of an attracting cycle, which Newton
  has found, ever closer;
- aperiodic: bounded, and not settling, after the given number of cycles.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from aeroflutter.kernels import kernel
from aeroflutter.kernels.arrays import Real1, Real2, Whole2
from aeroflutter.motion._kernel_exact import (
    HUGE,
    NONE,
    ZENO,
    Law,
    Work,
    advance,
    combine,
    memory_at,
    output,
    start,
    step_end,
    switch,
    variable,
    window,
    workspace,
)
from aeroflutter.motion._kernel_exact_cycle import (
    ATTRACTS,
    INDIFFERENT,
    MOST_LOOPS,
    NEAR,
    NOTHING,
    RING,
    Cycles,
    attracted,
    find_cycle,
    fundamental,
    keep,
    no_cycles,
    offset,
)
from aeroflutter.motion._kernel_exact_proofs import (
    APERIODIC,
    CHATTERING,
    CONVERGED,
    DAMPED,
    DIVERGENT,
    DRIFTING,
    GREW,
    KNOWN,
    LCO,
    NEUTRAL,
    NO_CYCLE,
    ONWARD,
    OUT_OF_TIME,
    OVERFLOWED,
    UNDECIDED,
    UNSETTLED,
    Proofs,
    certain,
    rest_of,
)
from aeroflutter.motion._kernel_exact_roots import Y
from aeroflutter.motion._kernel_exact_tables import DEGREE, Array, Tables

# Columns of the numbers that `settle` reports.
TIME, AMPLITUDE, BIAS, PERIOD, REST, RADIUS, LOOPS, ATTRACTOR, MAXIMA = 0, 1, 2, 3, 4, 5, 6, 7, 8
NUMBERS = 9

LOOK = 32  # steps between two looks at a motion without extrema
PATIENCE = 20_000  # steps without an extremum
RECURS = 0.05  # relative distance of two returns at which Newton is tried first
EXACT = 1e-9  # relative distance of two returns of a motion that is a cycle
RECENT = 64  # loops from which the size of an unsettled motion is taken


class Problem(NamedTuple):
    """A system with its spring, and when to stop.

    Attributes
    ----------
    tables, law, proofs
        The system and its spring.
    cycles
        Maxima after which a motion that does not settle is aperiodic.
    patience
        How many times as many maxima a motion may take that is still settling.
    growth, scale
        A motion about an unstable outer piece has diverged at this multiple of the larger of the
        spring's scale and the initial y.
    time
        Longest time.
    """

    tables: Tables
    law: Law
    proofs: Proofs
    cycles: int
    patience: int
    growth: float
    scale: float
    time: float


class History(NamedTuple):
    """Returns of a motion to the maxima of y, the last `RING` of them.

    Attributes
    ----------
    points
        (x, h), (RING, n+1).
    times
        (RING,).
    tries
        Relative distance of two returns at which Newton is tried next, (1,).
    peaks, troughs, misses
        y of the maxima, of the lowest minimum before each, and how far each maximum was from the
        nearest before it: a ring of as many as are judged together, (cycles,).
    size
        Largest of each state over the last loop, and the scale of the memory, (n+1,).
    growing
        The same, of the loop that is not complete.
    """

    points: Array
    times: Array
    tries: Array
    peaks: Array
    troughs: Array
    misses: Array
    size: Array
    growing: Array


@kernel
def history(n: int, cycles: int) -> History:
    """Room for the history of n states."""
    return History(
        np.zeros((RING, n + 1)),
        np.zeros(RING),
        np.full(1, RECURS),
        np.zeros(cycles),
        np.zeros(cycles),
        np.zeros(cycles),
        np.zeros(n + 1),
        np.zeros(n + 1),
    )


@kernel(inline="always")
def to_turn(
    problem: Problem,
    work: Work,
    growing: Array,
    now: int,
    t: float,
    h: float,
    mode: int,
    trend: int,
) -> tuple[int, int, int, float, float, int, int]:
    """March to the next extremum of y, or to an end that is certain before.

    Parameters
    ----------
    work
        (x, u) in row `now` of `work.xs`.
    growing
        Raised to the largest size of each state on the way, (n+1,).
    trend
        Sign of y', or 0 if it is not known yet.

    Returns
    -------
    state, reason, now, t, h, mode, trend
        The state is `ONWARD` at an extremum; the trend is the one before it.
    """
    tables, law = problem.tables, problem.law
    xs, w, line, M = work.xs, work.polynomials, work.line, work.M
    n = tables.c.size
    zero_steps = 0
    p, u, low, high, direction = window(law, mode, h)
    for step in range(PATIENCE):
        xs[now, n] = u
        if step % LOOK == LOOK - 1 or trend == 0:
            state, reason = certain(tables, law, problem.proofs, xs, now, h, mode)
            if state == ONWARD and t >= problem.time:
                state, reason = UNDECIDED, OUT_OF_TIME
            if state != ONWARD:
                return state, reason, now, t, h, mode, trend
        combine(tables.lines, p, xs, now, line)
        if not abs(w[Y, DEGREE]) < HUGE:
            state = DIVERGENT if problem.proofs.unstable else UNDECIDED
            return state, OVERFLOWED, now, t, h, mode, trend
        for i in range(n):
            growing[i] = max(growing[i], abs(xs[now, i]))
        s, kind, turns, trend = step_end(
            tables.noise, law.size, xs, now, w, (low, high, direction), trend
        )
        advance(tables.flow, p, s, xs, now, line, M, n)
        now = 1 - now
        after = t + s * tables.step[p]
        zero_steps = zero_steps + 1 if after == t else 0
        t = after
        if kind != NONE:
            mode, h = switch(law, mode, h, output(tables.c, xs, now), kind)
            p, u, low, high, direction = window(law, mode, h)
        if turns:
            return ONWARD, 0, now, t, h, mode, trend
        if zero_steps > ZENO:
            return UNDECIDED, CHATTERING, now, t, h, mode, trend
    return UNDECIDED, NO_CYCLE, now, t, h, mode, trend


@kernel(inline="always")
def note(
    problem: Problem, past: History, k: int, xs: Array, now: int, h: float, t: float, trough: float
) -> float:
    """Enter maximum k; returns its height over the lowest minimum since the last."""
    c, law = problem.tables.c, problem.law
    n = c.size
    place = k % RING
    for i in range(n):
        past.points[place, i] = xs[now, i]
        past.size[i] = max(past.growing[i], abs(xs[now, i]))
        past.growing[i] = abs(xs[now, i])
    past.points[place, n] = h
    y = output(c, xs, now)
    span = y - trough if trough < y else 0.0
    past.size[n] = max(span, law.loop[3] - law.loop[2])
    past.times[place] = t
    miss = span
    for lag in range(1, min(k, MOST_LOOPS) + 1):
        miss = min(miss, abs(y - output(c, past.points, (k - lag) % RING)))
    past.peaks[k % past.peaks.size] = y
    past.troughs[k % past.peaks.size] = min(trough, y)
    past.misses[k % past.peaks.size] = miss / span if span > 0.0 else 0.0
    return span


@kernel
def search(problem: Problem, past: History, k: int, span: float, own: Cycles) -> int:
    """Try to close the motion into a cycle where it comes close to an earlier return.

    Returns
    -------
    int
        `ATTRACTS` if an attracting cycle is in `own` now, `INDIFFERENT` if the motion is itself
        a cycle that neither attracts nor repels, else `NOTHING`.
    """
    tables, law = problem.tables, problem.law
    here = past.points[k % RING]
    y = output(tables.c, past.points, k % RING)
    for lag in range(1, min(k, MOST_LOOPS) + 1):
        before = (k - lag) % RING
        if abs(y - output(tables.c, past.points, before)) > RECURS * span:
            continue
        miss = 0.0
        for i in range(here.size):
            away = abs(here[i] - past.points[before, i])
            miss = max(miss, away / past.size[i] if away > 0.0 else 0.0)
        if miss < past.tries[0]:
            past.tries[0] = 0.25 * miss
            period = past.times[k % RING] - past.times[before]
            found = find_cycle(tables, law, here, period, lag, past.size, span, own)
            if found == ATTRACTS or (found == INDIFFERENT and miss < EXACT):
                return found
    return NOTHING


@kernel
def settling(peaks: Array, misses: Array) -> bool:
    """Whether a motion of these maxima is still on its way somewhere.

    Parameters
    ----------
    peaks
        Maxima of y, oldest first, (k,).
    misses
        Relative distance of each to the nearest of the `MOST_LOOPS` before it, (k,).

    Returns
    -------
    bool
        True if the misses of the last quarter are under half those of the first, or if the
        peaks of the last quarter creep one way at some fixed lag.
    """
    quarter = peaks.size // 4
    if quarter == 0:
        return False
    last = peaks.size - quarter
    if np.max(misses[last:]) < 0.5 * np.max(misses[:quarter]):
        return True
    for lag in range(1, min(MOST_LOOPS, quarter) + 1):
        up = 0
        down = 0
        for k in range(last, peaks.size):
            up += peaks[k] > peaks[k - lag]
            down += peaks[k] < peaks[k - lag]
        if up == 0 or down == 0:
            return True
    return False


@kernel
def recent(past: History, k: int, numbers: Array) -> None:
    """Size of an unsettled motion over its last loops."""
    low, high = np.inf, -np.inf
    for j in range(max(0, k - min(RECENT, past.peaks.size) + 1), k + 1):
        low = min(low, past.troughs[j % past.peaks.size])
        high = max(high, past.peaks[j % past.peaks.size])
    numbers[AMPLITUDE], numbers[BIAS] = 0.5 * (high - low), 0.5 * (high + low)


@kernel
def report(numbers: Array, cycles: Cycles, j: int, attractor: int) -> None:
    """Numbers of cycle j."""
    numbers[AMPLITUDE] = cycles.amplitude[j]
    numbers[BIAS] = cycles.bias[j]
    numbers[PERIOD] = cycles.period[j]
    numbers[RADIUS] = cycles.radius[j]
    numbers[LOOPS] = cycles.loops[j]
    numbers[ATTRACTOR] = attractor


@kernel
def judge(
    problem: Problem, past: History, k: int, span: float, known: Cycles, count: int, own: Cycles,
    numbers: Array,
) -> tuple[int, int]:  # fmt: skip
    """End state that maximum k and those before it prove, or `ONWARD`."""
    tables, law = problem.tables, problem.law
    for j in range(count):
        if attracted(known, j, past.points, k):
            report(numbers, known, j, j)
            return LCO, KNOWN
    if own.loops[0] > 0 and attracted(own, 0, past.points, k):
        if own.free[0]:  # it lies beside the motion: take the member of the continuum here
            lag, period = own.loops[0], own.period[0]
            find_cycle(tables, law, past.points[k % RING], period, lag, past.size, span, own)
        report(numbers, own, 0, -1)
        return LCO, CONVERGED
    at_hand = own.loops[0] > 0 and offset(own, 0, past.points[k % RING]) < NEAR
    if not at_hand and search(problem, past, k, span, own) == INDIFFERENT:
        return UNDECIDED, NEUTRAL
    if (k + 1) % problem.cycles == 0:
        if not settling(past.peaks, past.misses):
            return APERIODIC, UNSETTLED
        if k + 1 >= problem.cycles * problem.patience:
            return UNDECIDED, DRIFTING
    return ONWARD, 0


@kernel
def settle(
    problem: Problem, known: Cycles, count: int, own: Cycles, x: Array, h: float, numbers: Array
) -> tuple[int, int, float, int]:
    """March until the end state is certain.

    Parameters
    ----------
    known, count
        Attracting cycles already known; the first `count` count.
    own
        Room for one cycle: the one that this motion finds.
    x, h
        Where the motion starts, (n,); x is left where the march stopped.
    numbers
        Filled with what was found, (NUMBERS,); the time is that of the decision.

    Returns
    -------
    state, reason, h, mode
    """
    tables, law, proofs = problem.tables, problem.law, problem.proofs
    n = x.size
    work = workspace(n)
    xs, c = work.xs, tables.c
    past = history(n, problem.cycles)
    numbers[:] = np.nan
    own.loops[0] = 0
    now, t, trend, k = variable(0), 0.0, variable(0), -1
    xs[0, :n] = x
    y = output(c, xs, 0)
    bound = problem.growth * max(problem.scale, abs(y))
    mode, h = start(law, h, y)
    trough = np.inf
    state, reason = ONWARD, 0
    while state == ONWARD:
        state, reason, now, t, h, mode, trend = to_turn(
            problem, work, past.growing, now, t, h, mode, trend
        )
        if state != ONWARD:
            break
        state, reason = certain(tables, law, proofs, xs, now, h, mode)
        y = output(c, xs, now)
        if state == ONWARD and proofs.unstable and not abs(y) < bound:
            state, reason = DIVERGENT, GREW
        elif state == ONWARD and t >= problem.time:
            state, reason = UNDECIDED, OUT_OF_TIME
        elif state == ONWARD and trend < 0:
            trough = min(trough, y)
        elif state == ONWARD:
            k += 1
            span = note(problem, past, k, xs, now, h, t, trough)
            trough = np.inf
            if span > 0.0:
                state, reason = judge(problem, past, k, span, known, count, own, numbers)
        trend = -trend
    x[:] = xs[now, :n]
    numbers[TIME] = t
    numbers[MAXIMA] = k + 1
    if state == DAMPED:
        numbers[REST] = rest_of(law, proofs, c, xs, now, h, mode)
        numbers[AMPLITUDE], numbers[BIAS] = 0.0, numbers[REST]
    elif state != LCO and k >= 0:
        recent(past, k, numbers)
    return state, reason, memory_at(law, mode, h, output(c, xs, now)), mode


@kernel(entry=True)
def settle_one(
    problem: Problem, x: Real1, h: float, numbers: Real1, nodes: Real1, weights: Real1
) -> tuple[int, int, float, float, Cycles]:
    """`settle` for a motion that knows of no cycles.

    Returns
    -------
    state, reason, h, first_harmonic, own
        The cycle found and the amplitude of its fundamental (NaN without one), by Gauss's rule.
    """
    tables, law = problem.tables, problem.law
    n = tables.c.size
    own = no_cycles(1, n)
    state, reason, h, _ = settle(problem, no_cycles(0, n), variable(0), own, x, h, numbers)
    first = np.nan
    if state == LCO:
        first = fundamental(tables, law, own.z[0], own.period[0], nodes, weights)
    return state, reason, h, first, own


@kernel(entry=True)
def settle_all(
    problem: Problem, known: Cycles, count: int, share: bool, states: Real2, memories: Real1,
    codes: Whole2, numbers: Real2,
) -> int:  # fmt: skip
    """End states of many motions of one system.

    Parameters
    ----------
    known, count
        Attracting cycles already known, and room for more.
    share
        Whether a cycle that one motion finds is known to those after it.
    states, memories
        Where the motions start, (m, n) and (m,); left as where each march stopped.
    codes
        Filled with state and reason, (m, 2).
    numbers
        Filled with what was found, (m, NUMBERS).

    Returns
    -------
    int
        How many cycles are known now.
    """
    own = no_cycles(1, problem.tables.c.size)
    for i in range(memories.size):
        state, reason, h, _ = settle(problem, known, count, own, states[i], memories[i], numbers[i])
        codes[i, 0], codes[i, 1] = state, reason
        memories[i] = h
        new = state == LCO and reason == CONVERGED and own.free[0] == 0
        if share and new and count < known.loops.size:
            keep(own, known, count)
            numbers[i, ATTRACTOR] = count
            count += 1
    return count
