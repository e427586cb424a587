"""Compiled end states of a whole column of a map: cells of one system with one spring, in order.

A cell is followed from return to return on the section where y leaves the spring's top switch
upwards. It is over when

- a bound of all the motion to come stays within the present mode (damped), or
- three returns go to a known cycle as its linearised return map says, or
- it has joined the path of an earlier cell that ended on an attracting cycle: three returns in a
  row lie on three segments in a row of that path, and come closer to it or stay within the
  error of a straight segment. Where the segments of a path follow each other smoothly and only
  get shorter, the path is the slow curve of the return map on its way into the cycle, all other
  directions contract onto it, and along it there is but one way to go.

A cell whose returns have nearly closed is handed back for the cycle beside them, and goes on.
Everything else (motions that never reach the section, outer modes that do not die out) is handed back
to be settled from its start, by the very steps of a motion on its own. So is a cell that is over, but
whose returns have spread so much on the way that round-off may have decided: steps here end at switches
alone, and their last bits are others.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeroflutter.kernels import kernel
from aeroflutter.kernels.arrays import Real1, Real2, Real3, Whole1, Whole2
from aeroflutter.motion._kernel_attracted import closes_in
from aeroflutter.motion._kernel_ends import (
    AMPLITUDE,
    ATTRACTOR,
    BIAS,
    LOOPS,
    PERIOD,
    RADIUS,
    REST,
    TIME,
    Cycles,
    begin,
    memory_of,
    variable,
)
from aeroflutter.motion._kernel_flow import (
    AT_WATCHED,
    LAST,
    LEFT,
    NOW,
    PAUSED,
    STOPPED,
    TABLE,
    Motion,
    System,
    enter,
    march,
)
from aeroflutter.motion._kernel_proofs import DAMPED, KNOWN, LCO, ONWARD, Proofs, resting
from aeroflutter.motion._kernel_roots import ABOVE
from aeroflutter.springs._kernel_columns import (
    DIRECTION,
    HELD,
    HIGH,
    LOW,
    MOVES,
    OFFSET,
    PIECE,
    TO_HIGH,
)
from aeroflutter.studies.maps._kernel_paths import Paths, joined, note_spread, remember

Array = NDArray[np.float64]
Index = NDArray[np.int64]

# Why a call comes back: all cells are over, one is to be settled, one has nearly closed.
OVER, OPEN, CLOSING = 0, 1, 2
# What `memo` holds: the cell at hand, its returns, how many cycles and paths are known, where the
# cell went, what proves that it rests, after how many returns it nearly closes, and whether it was
# handed back and goes on.
CELL, RETURNS, CYCLES, PATHS, GOAL, REASON, LAG, GOES_ON = 0, 1, 2, 3, 4, 5, 6, 7
MEMOS = 8
ONWARDS, HANDED_BACK, CLOSED = -1, -2, -3  # goals that are no cycle

MOST_PATHS = 12
MOST_RETURNS = 1024
MOST_STEPS = 4000
LOOK = 4  # steps between two looks at a motion that does not switch
GLANCE = 64  # the same in a mode without a rest
MOST_SWITCHES = 64  # between two returns
LAGS = 4  # periods, in returns, that count as settling
CLOSE = 1e-2  # what a motion may still change by, relative, when it is handed back
NEAR = 5e-2  # relative distance from a known cycle within which returns are compared with its map
LONG = 12  # returns from which a path is worth keeping beside its cycle
UNKNOWN_CYCLE = 4  # settled returns in a row before a cycle is sought beside the known ones
PATIENCE = 24  # returns near a known cycle that do not go to it
PARTED = 3.0  # growth of the distance of returns, in logarithms, beyond which round-off may decide


class Targets(NamedTuple):
    """Known attracting cycles on the section: q cycles, n states.

    Attributes
    ----------
    point, size
        State of the cycle where it returns, and the scale of each, (q, n).
    Q, P, rho, slow
        Derivative of the return map over a period in units of `size`, and the norm in which it
        contracts by ρ, (q, n, n) twice and (q,); rows of what decays slowest, (q, 2, n).
    reach
        Length of that up to which the return map contracts, (q,).
    lag
        Returns a period, (q,); 0 where the cycle does not come to the section.
    scratch
        (4, n).
    """

    point: Real2
    size: Real2
    Q: Real3
    P: Real3
    rho: Real1
    slow: Real3
    reach: Real1
    lag: Whole1
    scratch: Real2


@kernel(inner=True, bare=True)
def settled(points: Array, rates: Array, k: int) -> int:
    """After how many returns path k is so near a cycle that Newton will find it; 0 if it is not."""
    for lag in range(1, LAGS + 1):
        if k < 2 * lag:
            return 0
        size = abs(rates[k])
        new = abs(rates[k] - rates[k - lag])
        old = abs(rates[k - lag] - rates[k - 2 * lag])
        if not (new < CLOSE * size and old < 10.0 * CLOSE * size):
            continue
        left = new * new / (old - new) if new < old else np.inf
        if new < 1e-12 * size:
            left = 0.0
        if left < CLOSE * size:
            far = 0.0
            for i in range(points.shape[1]):
                span = abs(points[k, i]) + abs(points[k - lag, i])
                far = max(far, abs(points[k, i] - points[k - lag, i]) / (span + 1e-300))
            if far < 10.0 * CLOSE:
                return lag
    return 0


@kernel(inner=True, bare=True)
def near(targets: Targets, j: int, point: Array) -> bool:
    """Whether a return is so near target j that it is compared with its linear map."""
    if targets.lag[j] == 0:
        return False
    for i in range(point.size):
        if not abs(point[i] - targets.point[j, i]) / targets.size[j, i] < NEAR:
            return False
    return True


@kernel(inner=True, bare=True)
def caught(targets: Targets, j: int, points: Array, k: int) -> bool:
    """Whether the last three returns go to target j; see `_kernel_attracted`."""
    lag, work = targets.lag[j], targets.scratch
    if k < 2 * lag:
        return False
    for i in range(points.shape[1]):
        for turn in range(3):
            away = points[k - turn * lag, i] - targets.point[j, i]
            work[turn, i] = away / targets.size[j, i]
    return closes_in(
        targets.Q[j], targets.P[j], targets.slow[j], targets.rho[j], targets.reach[j], work
    )


@kernel(inner=True, bare=True)
def returned(paths: Paths, targets: Targets, memo: Index, waits: Index) -> int:
    """What the return at hand says: the place of the cycle to which the cell goes, or what to do."""
    k, own = memo[RETURNS], paths.rates.shape[0] - 1
    point, rate = paths.points[own, k], paths.rates[own, k]
    for q in range(memo[PATHS]):
        if joined(paths, q, point, rate):
            return paths.cycle[q]
    close_by = False
    for j in range(memo[CYCLES]):
        if near(targets, j, point):
            close_by = True
            if caught(targets, j, paths.points[own], k):
                return j
    waits[0] += 1 if close_by else 0
    memo[LAG] = settled(paths.points[own], paths.rates[own], k)
    waits[1] = waits[1] + 1 if memo[LAG] > 0 else 0
    enough = UNKNOWN_CYCLE if memo[CYCLES] else 0
    if waits[1] > enough and (waits[0] > PATIENCE or not close_by):
        return CLOSED
    return ONWARDS if k + 1 < MOST_RETURNS else HANDED_BACK


@kernel(inner=True, bare=True)
def enter_return(system: System, motion: Motion, paths: Paths, k: int) -> None:
    """Note the return at hand: the state, and y' there."""
    n = system.C.shape[1]
    now, p, own = motion.memo[NOW], motion.memo[TABLE], paths.rates.shape[0] - 1
    rate = 0.0
    for i in range(n):
        paths.points[own, k, i] = motion.xs[now, i]
        if system.C[0, i] != 0.0:
            slope = 0.0
            for j in range(n):
                slope += system.generator[p, i, j] * motion.xs[now, j]
            for j in range(motion.inputs.size):
                slope += system.generator[p, i, n + j] * motion.inputs[j]
            rate += system.C[0, i] * slope
    paths.rates[own, k], paths.times[k] = rate, motion.clock[0]
    note_spread(paths, k)


@kernel(inner=True, bare=True)
def has_rest(system: System, motion: Motion, proofs: Proofs, mode: int) -> bool:
    """Whether `resting` may find that a motion comes to rest in a mode."""
    row = system.laws[0, mode]
    p = system.lookup[int(row[PIECE]) * system.strides[0]]
    if p < 0 or proofs.forms.shape[0] > 0:
        return True
    if proofs.decays[p] == 0 or row[DIRECTION] != 0.0:
        return False
    if row[HELD] != 0.0 or row[MOVES] != 0.0:
        return True
    for j in range(system.C.shape[1]):
        if proofs.free[p, 0, j] != 0.0:
            return True
    rest = -row[OFFSET] * proofs.rest[p, 0, 0]
    for j in range(1, motion.inputs.size):
        rest += motion.inputs[j] * proofs.rest[p, 0, j]
    return min(row[HIGH] - rest, rest - row[LOW]) > 0.0


@kernel(inner=True, bare=True)
def watch(system: System, motion: Motion, proofs: Proofs, gate: int) -> None:
    """Watch the modes in which a motion may come to rest, and the one behind the gate."""
    for mode in range(motion.watched.size):
        motion.watched[mode] = int(has_rest(system, motion, proofs, mode))
    if gate >= 0:  # a straight spring has none
        motion.watched[int(system.laws[0, gate, TO_HIGH])] = 1


@kernel(inner=True, bare=True)
def goal(
    system: System, motion: Motion, proofs: Proofs, paths: Paths, targets: Targets, gate: int,
    longest: float, memo: Index,
) -> tuple[int, float]:  # fmt: skip
    """Follow the cell at hand: the place of the cycle to which it goes, `ONWARDS` if it comes to

    rest, and why it is handed back else; the y of rest.
    """
    none, waits = motion.none, paths.waits
    if memo[GOES_ON] == 0:
        waits[:] = 0
        paths.spread[:] = 0.0
        memo[RETURNS] = 0
        for q in range(memo[PATHS]):
            paths.hints[q], paths.agreed[q], paths.far[q] = -1, -1, np.inf
    memo[GOES_ON] = 0
    steps, switches, here = 0, 0, HANDED_BACK
    while proofs.unstable == 0 and proofs.idle == 0 and motion.clock[0] <= longest:
        motion.memo[TABLE] = enter(system, motion)
        if motion.memo[TABLE] < 0:
            break
        state, reason, rest = resting(system, motion, proofs, motion.memo[TABLE])
        if state == DAMPED:
            memo[REASON] = reason
            return ONWARDS, rest
        if state != ONWARD:
            break
        stop = variable(AT_WATCHED)
        most = LOOK if motion.watched[motion.modes[0]] != 0 else GLANCE
        status = march(system, motion, np.inf, most, stop, none, none, none)
        if status == PAUSED:
            steps += most
            if steps > MOST_STEPS:
                break
            continue
        if status != STOPPED:
            break
        steps, switches = 0, switches + 1
        if motion.memo[LEFT] != gate or motion.memo[LAST] != ABOVE:
            if switches > MOST_SWITCHES:
                break
            continue
        switches = 0
        motion.memo[TABLE] = enter(system, motion)
        if motion.memo[TABLE] < 0:
            break
        enter_return(system, motion, paths, memo[RETURNS])
        here = returned(paths, targets, memo, waits)
        memo[RETURNS] += 1
        if here != ONWARDS:
            break
    return here if here != ONWARDS else HANDED_BACK, np.nan


@kernel(entry=True, patience=2.0, bare=True, whole=True)
def follow(
    system: System,
    motion: Motion,
    proofs: Proofs,
    cycles: Cycles,
    paths: Paths,
    targets: Targets,
    gate: int,
    longest: float,
    states: Real2,
    memories: Real2,
    codes: Whole2,
    numbers: Real2,
    memo: Whole1,
) -> int:
    """Follow cells until they are over, or one is to be settled.

    Parameters
    ----------
    cycles, paths, targets
        What is known so far.
    gate
        The mode that ends at the top switch.
    longest
        Time after which a cell is handed back.
    states, memories
        Where the cells start, (c, n) and (c, 1); of one that has nearly closed, where it stands.
    codes, numbers
        See `_kernel_ends.settle`.
    memo
        See above.

    Returns
    -------
    int
        Why it comes back.
    """
    watch(system, motion, proofs, gate)
    while True:
        if memo[GOAL] >= 0 and memo[RETURNS] >= LONG and memo[PATHS] < MOST_PATHS:
            remember(paths, memo[PATHS], memo[RETURNS], memo[GOAL])
            memo[PATHS] += 1
        if memo[CELL] == states.shape[0]:
            return OVER
        cell = memo[CELL]
        if memo[GOES_ON] == 0:
            begin(system, motion, states[cell], memories[cell])
        memo[GOAL], rest = goal(system, motion, proofs, paths, targets, gate, longest, memo)
        row = numbers[cell]
        row[:] = np.nan
        row[TIME] = motion.clock[0]
        if memo[GOAL] == CLOSED:
            for j in range(states.shape[1]):
                states[cell, j] = motion.xs[motion.memo[NOW], j]
            memories[cell, 0] = memory_of(system, motion, 0)
            return CLOSING
        if memo[GOAL] == HANDED_BACK or paths.spread[0] > PARTED:
            return OPEN
        memo[CELL] += 1
        if memo[GOAL] == ONWARDS:
            row[AMPLITUDE], row[BIAS], row[REST] = 0.0, rest, rest
            codes[cell, 0], codes[cell, 1] = DAMPED, memo[REASON]
            continue
        j = memo[GOAL]
        row[AMPLITUDE], row[BIAS], row[PERIOD] = (
            cycles.amplitude[j],
            cycles.bias[j],
            cycles.period[j],
        )
        row[RADIUS], row[LOOPS], row[ATTRACTOR] = cycles.radius[j], cycles.loops[j], j
        codes[cell, 0], codes[cell, 1] = LCO, KNOWN
