"""Compiled end states of the exact engine: each is decided by something that certifies it.

- damped: a bound of all the motion to come on this linear mode stays within the mode;
- divergent: an unstable coordinate of the outer mode outgrows all that the springs can oppose;
- neutral: a bound of all the motion to come stays within the mode, in which some of it never
  dies out and none grows;
- lco: successive returns follow the linearised return map of an attracting cycle, which Newton
  has found, ever closer (`_kernel_attracted`).

Many motions are settled in one call. What is rare is left to the caller: the call comes back where
a motion has nearly closed (for Newton's method), after a number of maxima (aperiodic, or still
settling), where one does not oscillate, and before a mode without a table. It goes on from there.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeroflutter.kernels import kernel
from aeroflutter.kernels.arrays import Real1, Real2, Real3, Whole1, Whole2
from aeroflutter.motion._kernel_attracted import ARRIVED, closes_in
from aeroflutter.motion._kernel_flow import (
    AT_TURN,
    NOW,
    OVERFLOW,
    STOPPED,
    STUCK,
    TABLE,
    TREND,
    UNKNOWN,
    Motion,
    System,
    march,
    output,
)
from aeroflutter.motion._kernel_proofs import (
    APERIODIC,
    CONVERGED,
    DAMPED,
    DIVERGENT,
    GREW,
    KNOWN,
    LCO,
    NEITHER,
    ONWARD,
    OUT_OF_TIME,
    OVERFLOWED,
    SWINGING,
    UNDECIDED,
    Proofs,
    certain,
    swing,
)
from aeroflutter.springs._kernel_columns import (
    BRANCH,
    CEILING,
    FLOOR,
    HELD,
    HIGH,
    LAG,
    LOW,
    SLIDES,
)

Array = NDArray[np.float64]
Index = NDArray[np.int64]

# Why a call comes back: all is settled; a motion has nearly closed; it goes to a member of a
# continuum of cycles; it has made as many maxima as are judged together; it has gone to a cycle
# of its own finding; a mode has no table; it has long had no extremum; it has been nothing to
# the spring for some loops; it switches without progress in time.
OVER, CLOSING, BESIDE, COUNTED, FOUND, UNPREPARED, CREEPING, FADING = 0, 1, 2, 3, 4, 5, 6, 7
STALLED = 8
# What `memo` holds: the motion at hand, what to do with it next, its maxima, the lag of a near
# return, how many cycles are known, whether it has found one itself (which is behind those), the
# end state that the caller has decided.
CELL, PHASE, MAXIMUM, BEHIND, COUNT, OWN, STATE, REASON = 0, 1, 2, 3, 4, 5, 6, 7
MEMOS = 8
FRESH, MARCHING, SEARCHING, COUNTING, ENDING = 0, 1, 2, 3, 4
# What `clock` holds: the lowest y since the last maximum, the height of the last loop, the
# relative distance of two returns at which Newton is tried next, the y beyond which it diverges,
# the height of the largest loop, the y of rest that the caller has found, loops in a row that were
# nothing to the spring.
TROUGH, SPAN, TRIES, BOUND, LARGEST, GIVEN, QUIET = 0, 1, 2, 3, 4, 5, 6
CLOCKS = 7
# Limits: longest time, growth, scale, maxima that are judged together, height of a loop that is
# nothing to the spring.
TIME_LIMIT, GROWTH, SCALE, CYCLES, NOTHING = 0, 1, 2, 3, 4
# Columns of the numbers of a motion.
TIME, AMPLITUDE, BIAS, PERIOD, REST, RADIUS, LOOPS, ATTRACTOR, MAXIMA = 0, 1, 2, 3, 4, 5, 6, 7, 8
RATE, EXPONENT = 9, 10  # change of the height of a loop over a hundred, relative; of neighbours
NUMBERS = 11

LOOK = 32  # steps between two looks at a motion without extrema
PATIENCE = 20_000  # steps without an extremum
RECURS = 0.05  # relative distance of two returns at which Newton is tried first
RECENT = 64  # loops from which the size of an aperiodic motion is taken
PART = 10  # the size of an undecided one is that of its last tenth
FALLEN = 1e-6  # of the largest loop: what is nothing to the spring must have come down to it
FADES = 5  # such loops in a row: a lone one may be an extremum that round-off has doubled
MOST_LOOPS = 16
RING = 2 * MOST_LOOPS + 1  # returns kept: two periods and one
NEAR = 1e-2  # relative distance within which returns are compared with the linear map


class Cycles(NamedTuple):
    """Attracting cycles, each by its point z = (x, h) on the section of maxima of y; c cycles.

    Attributes
    ----------
    z, size
        The point, and the scale of each entry, (c, n+m).
    Q, P, rho, slow
        Derivative of the return map in units of `size`, the norm in which it contracts by ρ,
        (c, n+m, n+m) twice and (c,); rows of what decays slowest, (c, 2, n+m).
    reach
        Length of that up to which the return map contracts, (c,); see `reach`.
    loops
        Maxima a period, (c,); 0 marks an empty place.
    free
        1 for a member of a continuum of cycles, (c,).
    period, amplitude, bias, radius
        T, half peak-to-peak and midrange of y, largest modulus of the multipliers, (c,).
    """

    z: Real2
    size: Real2
    Q: Real3
    P: Real3
    rho: Real1
    slow: Real3
    reach: Real1
    loops: Whole1
    free: Whole1
    period: Real1
    amplitude: Real1
    bias: Real1
    radius: Real1


class History(NamedTuple):
    """Returns of the motion at hand to the maxima of y, the last `RING` of them.

    Attributes
    ----------
    points, times, tops
        (x, h), (RING, n+m), when, and the first output, (RING,).
    peaks, troughs, misses
        y of the maxima, of the lowest minimum before each, and how far each maximum was from the
        nearest before it: a ring of as many as are judged together, (cycles,).
    size
        Largest of each state over the last loop, and the scale of each memory, (n+m,).
    widths
        Range of each memory, (m,); 0 without one.
    clock, memo
        (CLOCKS,) and (MEMOS,).
    scratch
        (4, n+m).
    """

    points: Real2
    times: Real1
    tops: Real1
    peaks: Real1
    troughs: Real1
    misses: Real1
    size: Real1
    widths: Real1
    clock: Real1
    memo: Whole1
    scratch: Real2


@kernel(inner=True, bare=True)
def variable(value: int) -> int:
    """A literal as a variable: calls with literals are compiled apart."""
    return int(np.int64(value))


@kernel(inner=True, bare=True)
def memory_of(system: System, motion: Motion, i: int) -> float:
    """Memory of spring i now: h where it sticks, y - lag between the stops on a flat."""
    row = system.laws[i, motion.modes[i]]
    if row[SLIDES] == 0.0:
        return motion.h[i]
    y = output(system.C, i, motion.xs, motion.memo[NOW])
    return min(max(y - row[LAG], row[FLOOR]), row[CEILING])


@kernel(inner=True, bare=True)
def offset(z: Array, size: Array, point: Array) -> float:
    """Largest relative difference of a return from the point of a cycle."""
    worst = 0.0
    for i in range(point.size):
        worst = max(worst, abs(point[i] - z[i]) / size[i])
    return worst


@kernel(inner=True, bare=True)
def attracted(cycles: Cycles, j: int, points: Array, k: int, scratch: Array) -> bool:
    """Whether the last three returns of a motion go to cycle j; see `_kernel_attracted`.

    In a continuum of cycles the returns are compared with each other.

    Parameters
    ----------
    points
        Ring of the returns (x, h), (RING, n+m); the last is k.
    """
    lag = cycles.loops[j]
    if lag == 0 or k < 2 * lag:
        return False
    z, size = cycles.z[j], cycles.size[j]
    m = z.size
    if not offset(z, size, points[k % RING]) < NEAR:
        return False
    for turn in range(3):
        row = (k - turn * lag) % RING
        for i in range(m):
            scratch[turn, i] = (points[row, i] - z[i]) / size[i]
    if cycles.free[j]:
        late, early = 0.0, 0.0
        for i in range(m):
            late = max(late, abs(scratch[0, i] - scratch[1, i]))
            early = max(early, abs(scratch[1, i] - scratch[2, i]))
        return late < 0.1 * ARRIVED or (late < 0.5 * early and late < ARRIVED)
    return closes_in(
        cycles.Q[j], cycles.P[j], cycles.slow[j], cycles.rho[j], cycles.reach[j], scratch
    )


@kernel(inner=True, bare=True)
def begin(system: System, motion: Motion, x: Array, memories: Array) -> None:
    """Take up the motion from a state, its memories made to fit."""
    m, n = system.C.shape
    motion.memo[:] = 0
    motion.memo[TABLE] = -1
    motion.clock[0] = 0.0
    motion.reach[:] = 0.0
    for j in range(n):
        motion.xs[0, j] = x[j]
    for i in range(m):
        first = 0
        y = output(system.C, i, motion.xs, first)
        law = system.laws[i]
        motion.modes[i], motion.h[i] = 0, 0.0
        if law[0, HELD] != 0.0:
            held = min(max(memories[i], y - law[0, HIGH]), y - law[0, LOW])
            motion.h[i] = min(max(held, law[0, FLOOR]), law[0, CEILING])
        else:
            while y >= law[motion.modes[i], HIGH]:
                motion.modes[i] += 1
            if law[0, BRANCH] != 0.0:  # y may not tell the side of a relay
                if memories[i] > 0.0 and y > law[1, LOW]:
                    motion.modes[i] = 1
                motion.h[i] = law[motion.modes[i], BRANCH]


@kernel(inner=True, bare=True)
def note(system: System, motion: Motion, past: History) -> float:
    """Enter a maximum; returns its height over the lowest minimum since the last."""
    m, n = system.C.shape
    k, now = past.memo[MAXIMUM], motion.memo[NOW]
    place = k % RING
    y = output(system.C, 0, motion.xs, now)
    trough = past.clock[TROUGH]
    span = y - trough if trough < y else 0.0
    for j in range(n):
        past.points[place, j] = motion.xs[now, j]
        past.size[j] = max(motion.reach[j], abs(motion.xs[now, j]))
        motion.reach[j] = abs(motion.xs[now, j])
    for i in range(m):
        past.points[place, n + i] = memory_of(system, motion, i)
        past.size[n + i] = max(span, past.widths[i])
    past.times[place], past.tops[place] = motion.clock[0], y
    miss = span
    for lag in range(1, min(k, MOST_LOOPS) + 1):
        miss = min(miss, abs(y - past.tops[(k - lag) % RING]))
    place = k % past.peaks.size
    past.peaks[place], past.troughs[place] = y, min(trough, y)
    past.misses[place] = miss / span if span > 0.0 else 0.0
    past.clock[TROUGH] = np.inf
    return span


@kernel(inner=True, bare=True)
def near_return(past: History, begin_lag: int) -> int:
    """The first lag, from one on, at which the motion comes closer to a return than before, or 0."""
    k = past.memo[MAXIMUM]
    here, top = past.points[k % RING], past.tops[k % RING]
    for lag in range(begin_lag, min(k, MOST_LOOPS) + 1):
        if abs(top - past.tops[(k - lag) % RING]) > RECURS * past.clock[SPAN]:
            continue
        before = past.points[(k - lag) % RING]
        miss = 0.0
        for i in range(here.size):
            away = abs(here[i] - before[i])
            if away > 0.0:
                miss = max(miss, away / past.size[i])
        if miss < past.clock[TRIES]:
            past.clock[TRIES] = 0.25 * miss
            return lag
    return 0


@kernel(inner=True, bare=True)
def finish(
    system: System, motion: Motion, proofs: Proofs, past: History, state: int, reason: int,
    rest: float, states: Array, memories: Array, codes: Index, numbers: Array,
) -> None:  # fmt: skip
    """Enter the end state of the motion at hand, and go to the next."""
    cell, k = past.memo[CELL], past.memo[MAXIMUM]
    codes[cell, 0], codes[cell, 1] = state, reason
    row = numbers[cell]
    row[TIME], row[MAXIMA] = motion.clock[0], k + 1
    if state == DAMPED:
        row[REST], row[AMPLITUDE], row[BIAS] = rest, 0.0, rest
    elif state == NEITHER and reason == SWINGING:
        row[AMPLITUDE], row[BIAS] = swing(system, motion, proofs, motion.memo[TABLE]), rest
    elif state != LCO and np.isnan(row[PERIOD]) and k >= 0:
        low, high = np.inf, -np.inf
        size = past.peaks.size
        last = RECENT if state == APERIODIC else max((k + 1) // PART, 1)
        for j in range(max(0, k - min(last, size) + 1), k + 1):
            low = min(low, past.troughs[j % size])
            high = max(high, past.peaks[j % size])
        row[AMPLITUDE], row[BIAS] = 0.5 * (high - low), 0.5 * (high + low)
    now = motion.memo[NOW]
    for j in range(states.shape[1]):
        states[cell, j] = motion.xs[now, j]
    for i in range(memories.shape[1]):
        memories[cell, i] = memory_of(system, motion, i)
    past.memo[CELL] += 1
    past.memo[PHASE] = FRESH


@kernel(entry=True, patience=5.0, bare=True)
def settle(
    system: System,
    motion: Motion,
    proofs: Proofs,
    cycles: Cycles,
    past: History,
    limits: Real1,
    states: Real2,
    memories: Real2,
    codes: Whole2,
    numbers: Real2,
) -> int:
    """March motions until their end states are certain, one after another.

    Parameters
    ----------
    cycles
        Attracting cycles: the first memo[COUNT] are known to all, the next is that of the motion at
        hand if memo[OWN].
    limits
        See above.
    states, memories
        Where the motions start, (c, n) and (c, m); left as where each march stopped.
    codes
        Filled with state and reason, (c, 2).
    numbers
        Filled with what was found, (c, NUMBERS); the time is that of the decision.

    Returns
    -------
    int
        Why it comes back: `OVER` if all motions are settled.
    """
    none, memo, clock = motion.none, past.memo, past.clock
    steps = 0
    while memo[CELL] < states.shape[0]:
        if memo[PHASE] == FRESH:
            begin(system, motion, states[memo[CELL]], memories[memo[CELL]])
            memo[MAXIMUM], memo[OWN] = -1, 0
            clock[TROUGH], clock[TRIES], clock[LARGEST] = np.inf, RECURS, 0.0
            clock[QUIET] = 0.0
            y = output(system.C, 0, motion.xs, 0)
            clock[BOUND] = limits[GROWTH] * max(limits[SCALE], abs(y))
            numbers[memo[CELL]] = np.nan
            memo[PHASE] = MARCHING
            steps = 0
        state, reason, rest = ONWARD, 0, np.nan
        if memo[PHASE] == ENDING:
            state, reason, rest = memo[STATE], memo[REASON], clock[GIVEN]
        if memo[PHASE] == MARCHING:
            trend = motion.memo[TREND]
            most = 0 if trend == 0 and steps % 2 == 0 else LOOK
            stop = variable(AT_TURN)
            status = march(system, motion, np.inf, most, stop, none, none, none)
            if status == UNKNOWN:
                return UNPREPARED
            steps += 1
            if status == OVERFLOW:
                state, reason = DIVERGENT, OVERFLOWED
            elif status == STUCK:
                return STALLED
            else:
                state, reason, rest = certain(system, motion, proofs)
                if state == ONWARD and reason == UNKNOWN:
                    return UNPREPARED
            turned = status == STOPPED
            top = turned and motion.memo[TREND] < 0
            if turned:
                steps = 0
            if state == ONWARD:
                y = output(system.C, 0, motion.xs, motion.memo[NOW])
                if turned and proofs.unstable and not abs(y) < clock[BOUND]:
                    state, reason = DIVERGENT, GREW
                elif motion.clock[0] >= limits[TIME_LIMIT]:
                    state, reason = UNDECIDED, OUT_OF_TIME
                elif steps * LOOK > PATIENCE:
                    return CREEPING
                elif turned and not top:
                    clock[TROUGH] = min(clock[TROUGH], y)
                elif top:
                    memo[MAXIMUM] += 1
                    clock[SPAN] = note(system, motion, past)
                    clock[LARGEST] = max(clock[LARGEST], clock[SPAN])
                    quiet = clock[SPAN] < min(limits[NOTHING], FALLEN * clock[LARGEST])
                    clock[QUIET] = clock[QUIET] + 1.0 if quiet else 0.0
                    if clock[QUIET] >= FADES:
                        memo[PHASE], clock[GIVEN] = COUNTING, y - 0.5 * clock[SPAN]
                        return FADING
                    if clock[SPAN] > 0.0:
                        memo[PHASE], memo[BEHIND] = SEARCHING, 0
                        k = memo[MAXIMUM]
                        for j in range(memo[COUNT] + memo[OWN]):
                            known = j < memo[COUNT]
                            if attracted(cycles, j, past.points, k, past.scratch):
                                if cycles.free[j]:
                                    return BESIDE
                                row = numbers[memo[CELL]]
                                row[AMPLITUDE], row[BIAS] = cycles.amplitude[j], cycles.bias[j]
                                row[PERIOD], row[RADIUS] = cycles.period[j], cycles.radius[j]
                                row[LOOPS] = cycles.loops[j]
                                row[ATTRACTOR] = j if known else -1
                                state, reason = LCO, KNOWN if known else CONVERGED
                                break
        if state == ONWARD and memo[PHASE] == SEARCHING:
            k, own = memo[MAXIMUM], memo[COUNT]
            memo[PHASE] = COUNTING
            at_hand = memo[OWN] and (
                offset(cycles.z[own], cycles.size[own], past.points[k % RING]) < NEAR
            )
            if not at_hand:
                memo[BEHIND] = near_return(past, memo[BEHIND] + 1)
                if memo[BEHIND] > 0:
                    memo[PHASE] = SEARCHING
                    return CLOSING
        if state == ONWARD and memo[PHASE] == COUNTING:
            memo[PHASE] = MARCHING
            if (memo[MAXIMUM] + 1) % int(limits[CYCLES]) == 0:
                return COUNTED
        if state != ONWARD:
            finish(
                system, motion, proofs, past, state, reason, rest, states, memories, codes, numbers
            )
            if state == LCO and reason == CONVERGED:
                return FOUND
    return OVER
