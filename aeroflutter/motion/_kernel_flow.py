"""Compiled flow: a piecewise-linear system with any number of springs, from event to event.

x' = A x - B F(C x) + d. In a mode, one piece a spring, F_i = k_i y_i - u_i is a straight line, the
flow is a table of `step_tables`, and the mode ends where an output leaves the window of its
spring's piece or, on the flat of a loop, turns back. The laws are the tables of
`springs.piece_table`.

There is one march. It carries tangents where there are any, keeps what it is asked to keep, and
can be stopped at every extremum of the first output. All that it stands on is in `Motion`, so it
goes on from wherever it was stopped.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeroflutter.kernels import kernel
from aeroflutter.kernels.arrays import Real1, Real2, Real3, Whole1
from aeroflutter.motion._kernel_carry import apply, carry, catch_up, flow_matrix, follow_y
from aeroflutter.motion._kernel_roots import (
    ABOVE,
    BELOW,
    DEGREE,
    NEVER,
    NONE,
    REVERSAL,
    SPACE,
    WIDTH,
    Y,
    event,
    extent,
    first_turn,
    heading,
    monotone,
)
from aeroflutter.springs._kernel_columns import (
    BRANCH,
    CEILING,
    DIRECTION,
    FLOOR,
    HELD,
    HIGH,
    HOLDS,
    JUMPS,
    LAG,
    LOW,
    MOVES,
    OFFSET,
    PIECE,
    SLIDES,
    SLOPE,
    TO_HIGH,
    TO_LOW,
    TO_TURN,
)

Array = NDArray[np.float64]
Index = NDArray[np.int64]

# How a march stops: at its end, with a log full, beyond all numbers, at a standstill, where it was
# told to, after as many steps as it was given, before a mode without a table.
DONE, FULL, OVERFLOW, STUCK, STOPPED, PAUSED, UNKNOWN = 0, 1, 2, 3, 4, 5, 6
LEAPT = 7  # where F jumped, before the tangents have: see `_kernel_jump`
NOWHERE, AT_TURN, AT_SWITCH, AT_WATCHED = 0, 1, 2, 3  # where it can be told to stop
# What `memo` counts and carries on.
NOW, TREND, TABLE, STEPS, EVENTS, TURNS, STILL, LAST, SPRING, PLACE = 0, 1, 2, 3, 4, 5, 6, 7, 8, 9
JUMPED, BEFORE = 10, 11  # place plus one of the law that jumped here; the table before it did
LEFT = 12  # the mode that the last switch ended
MEMOS = 13
EVENT_COLUMNS = 6  # time, kind, mode after it, y, F, spring
TURN_COLUMNS = 3  # time, y, +1 at a maximum and -1 at a minimum
EPSILON = 2.0**-52
HUGE = 1e250  # beyond it a motion overflows within a step
ZENO = 200  # steps without progress in time
TIE = 1e-9  # part of a step within which an extremum is where a switch is


class System(NamedTuple):
    """A system with its springs as numbers. n states, m springs, q inputs, k modes with tables.

    Attributes
    ----------
    C
        Outputs, (m, n).
    laws
        Rows of the piece tables, (m, modes, COLUMNS), those with fewer modes filled up.
    sizes
        Largest number of each law, for round-off, (m,).
    strides, lookup
        Place of a mode among all: the sum of strides[i] times the place of spring i's slope,
        (m,), and the table there, or -1.
    step, lines, flow, generator, d_flow
        See `StepTables`.
    noise
        Bound of the round-off in each output a unit of each entry of (x, u), (m, n+q).
    d_C
        Derivative of C with respect to a parameter, (m, n).
    """

    C: Real2
    laws: Real3
    sizes: Real1
    strides: Whole1
    lookup: Whole1
    step: Real1
    lines: Real3
    flow: Real3
    generator: Real3
    d_flow: Real3
    noise: Real2
    d_C: Real2


class Motion(NamedTuple):
    """Where a motion stands, and its work space.

    Attributes
    ----------
    xs
        (x, u) now and next, padded with zeros to the rows of `lines`, (2, rows).
    w, line
        See `_kernel_roots`; the rows of y and all after them as one, (2 m SPACE + columns,).
    M, dM
        M(s) and its derivative, (n (n+q),); an empty one if there is no parameter.
    h, modes
        Memory and mode of each spring, (m,).
    window
        Lower and upper edge of each output, and the direction in which it must go, (m, 3).
    inputs
        u, (q,); the last is 1 where the system has a load.
    clock
        Time, (1,).
    memo
        Counts and flags, (MEMOS,).
    reach
        Raised to the largest size of each state on the way, (n,), or (0,) if nobody asks.
    tangents
        Columns (δx, δh), (n+m, any number).
    scratch
        As many, (n, any number).
    since
        (x, u) up to which the tangents have been carried, and room for the next, (2, rows).
    was
        Inputs before a jump of F, (q,).
    rates
        x' before and after it, (2, n).
    watched
        1 for the modes of the first spring in which a march stops that is told to, (k,) or (0,).
    none
        A log that keeps nothing, (0, 0).
    """

    xs: Real2
    w: Real2
    line: Real1
    M: Real1
    dM: Real1
    h: Real1
    modes: Whole1
    window: Real2
    inputs: Real1
    clock: Real1
    memo: Whole1
    reach: Real1
    tangents: Real2
    scratch: Real2
    since: Real2
    was: Real1
    rates: Real2
    watched: Whole1
    none: Real2


@kernel(inner=True, bare=True, inline="always")
def combine(lines: Array, p: int, xs: Array, now: int, line: Array) -> None:
    """The line of a step from (x, u) on table p: the outputs in both bases, the state at its end.

    Inlined: handing its arrays over would cost as much as its work.
    """
    a, b, c, d = xs[now, 0], xs[now, 1], xs[now, 2], xs[now, 3]
    for k in range(lines.shape[2]):
        line[k] = (lines[p, 0, k] * a + lines[p, 1, k] * b) + (
            lines[p, 2, k] * c + lines[p, 3, k] * d
        )
    for j in range(4, lines.shape[1], 4):  # four at a time, in loops that the compiler vectorises
        a, b, c, d = xs[now, j], xs[now, j + 1], xs[now, j + 2], xs[now, j + 3]
        for k in range(lines.shape[2]):
            line[k] += (lines[p, j, k] * a + lines[p, j + 1, k] * b) + (
                lines[p, j + 2, k] * c + lines[p, j + 3, k] * d
            )


@kernel(inner=True, bare=True)
def round_off(noise: Array, i: int, xs: Array, now: int, size: float) -> float:
    """Bound of the round-off in output i within a step: of the state alone, whatever the mode.

    Where one mode says that it has ended, the next must not say that it has yet to begin.
    """
    n = noise.shape[1] - 1
    total = size + noise[i, n] * size
    for j in range(n):
        total += noise[i, j] * abs(xs[now, j])
    return 8.0 * EPSILON * total


@kernel(inner=True, bare=True)
def output(C: Array, i: int, xs: Array, row: int) -> float:
    """y_i = C_i x of a row of states."""
    y = 0.0
    for j in range(C.shape[1]):
        y += C[i, j] * xs[row, j]
    return y


@kernel(inner=True, bare=True)
def switch(system: System, motion: Motion, spring: int, kind: int, y: float) -> None:
    """Mode, memory and its tangent after `kind` ended the mode of a spring at y.

    The memory jumps: it forgets where it meets a stop, and takes up y at a reversal, where
    δh = C δx because y' = 0. Where F does, the tangents wait for the mode after it.
    """
    row = system.laws[spring, motion.modes[spring]]
    if row[JUMPS] != 0.0 and motion.memo[JUMPED] == 0:
        motion.memo[JUMPED], motion.memo[BEFORE] = spring + 1, motion.memo[TABLE]
        for j in range(motion.inputs.size):
            motion.was[j] = motion.inputs[j]
    motion.memo[TABLE] = -1
    motion.memo[LAST], motion.memo[SPRING] = kind, spring
    motion.memo[LEFT] = motion.modes[spring]
    if kind == REVERSAL:
        motion.modes[spring] = int(row[TO_TURN])
        if row[SLIDES] != 0.0:
            motion.h[spring] = min(max(y - row[LAG], row[FLOOR]), row[CEILING])
            follow_y(system.C, spring, motion.tangents)
        return
    motion.modes[spring] = int(row[TO_LOW] if kind == BELOW else row[TO_HIGH])
    branch = system.laws[spring, motion.modes[spring], BRANCH]
    if branch != 0.0:
        motion.h[spring] = branch
    if row[SLIDES] != 0.0:
        motion.h[spring] = row[FLOOR] if kind == BELOW else row[CEILING]
        n = system.C.shape[1]
        for k in range(motion.tangents.shape[1]):
            motion.tangents[n + spring, k] = 0.0


@kernel(inner=True, bare=True)
def enter(system: System, motion: Motion) -> int:
    """Inputs and windows of the modes; the table of the mode of all, or -1."""
    place = 0
    for i in range(system.C.shape[0]):
        row = system.laws[i, motion.modes[i]]
        h = motion.h[i]
        motion.inputs[i] = row[HELD] * h - row[OFFSET]
        motion.window[i, 0] = row[LOW]
        motion.window[i, 1] = row[HIGH]
        motion.window[i, 2] = row[DIRECTION]
        if row[MOVES] != 0.0:
            motion.window[i, 0] = -np.inf if h <= row[FLOOR] else row[LOW] + row[MOVES] * h
            motion.window[i, 1] = np.inf if h >= row[CEILING] else row[HIGH] + row[MOVES] * h
        place += int(row[PIECE]) * system.strides[i]
    motion.memo[PLACE] = place
    return system.lookup[place]


@kernel(entry=True, bare=True, apart=True)
def march(
    system: System,
    motion: Motion,
    end: float,
    most: int,
    stop: int,
    steps: Real2,
    events: Real2,
    turns: Real2,
) -> int:
    """March to `end`, or to what stops it before.

    Parameters
    ----------
    end
        Time.
    most
        Steps after which the march pauses.
    stop
        Where to stop: nowhere, at an extremum of the first output, after a switch, or after one
        into a mode that is watched. A step ends at each extremum where they are wanted, here or
        in `turns`.
    steps
        Filled with the steps, (.., 2 + n + q + 2 m): time, table, (x, u), modes, h. None are kept
        if it is empty, likewise of the others.
    events
        Filled with the switches, (.., EVENT_COLUMNS).
    turns
        Filled with the extrema of the first output, (.., TURN_COLUMNS).

    Returns
    -------
    int
        How it stopped. `FULL`: empty the logs and call again. `UNKNOWN`: give the mode at
        memo[PLACE] its table and call again. `LEAPT`: let the tangents jump and call again.
    """
    C, memo, xs, w, line, window = (
        system.C, motion.memo, motion.xs, motion.w, motion.line, motion.window,
    )  # fmt: skip
    m, n = C.shape
    width = n + motion.inputs.size
    seeks_turns = stop == AT_TURN or turns.shape[0] > 0
    now, trend, t = memo[NOW], memo[TREND], motion.clock[0]
    status, taken, behind = DONE, 0, 0
    lone = system.flow.shape[1] == WIDTH + 1  # there are no tables of several steps
    while t < end:
        if (
            (steps.shape[0] > 0 and memo[STEPS] >= steps.shape[0])
            or (events.shape[0] > 0 and memo[EVENTS] >= events.shape[0])
            or (turns.shape[0] > 0 and memo[TURNS] >= turns.shape[0])
        ):
            status = FULL
            break
        if taken >= most:
            status = PAUSED
            break
        taken += 1
        if memo[TABLE] < 0:
            memo[TABLE] = enter(system, motion)
            if memo[TABLE] < 0:
                status = UNKNOWN
                break
        p = memo[TABLE]
        for i in range(motion.inputs.size):
            xs[now, n + i] = motion.inputs[i]
        for i in range(motion.reach.size):
            motion.reach[i] = max(motion.reach[i], abs(xs[now, i]))
        combine(system.lines, p, xs, now, line)
        s, kind, spring, turn, safe = 1.0, NONE, 0, NEVER, True
        for i in range(m):
            if i > 0:
                for k in range(2 * SPACE):
                    line[k] = line[2 * i * SPACE + k]
            if not abs(w[Y, DEGREE]) < HUGE:
                safe = False
            low, high, direction = window[i, 0], window[i, 1], int(window[i, 2])
            least, largest = extent(w)
            clear = (
                least >= low and largest <= high and (direction == 0 or monotone(w, direction, 0.0))
            )
            seeks = seeks_turns and i == 0 and not (trend != 0 and monotone(w, trend, 0.0))
            if clear and not seeks:
                continue
            tolerance = round_off(system.noise, i, xs, now, system.sizes[i])
            if not clear:
                at, what = event(w, low, high, direction, tolerance)
                if system.laws[i, motion.modes[i], HOLDS] != 0.0:  # F may be unable to hold at all
                    if w[Y, 0] > high + 4.0 * tolerance:
                        at, what = 0.0, ABOVE
                    elif w[Y, 0] < low - 4.0 * tolerance:
                        at, what = 0.0, BELOW
                if what != NONE and (kind == NONE or at < s):
                    s, kind, spring = at, what, i
            if seeks_turns and i == 0:
                if trend == 0:
                    trend = heading(w, 2.0 * tolerance)
                if trend != 0:
                    turn = first_turn(w, trend, 2.0 * tolerance)
        if not safe:
            status = OVERFLOW
            break
        if memo[JUMPED] > 0 and s > 0.0:
            if motion.tangents.shape[1] > 0:
                status = LEAPT
                break
            memo[JUMPED] = 0
        turns_here = turn <= s + TIE
        if turn < s:
            s, kind = turn, NONE
        after = t + s * system.step[p]
        if after > end:
            s, kind, after, turns_here = (end - t) / system.step[p], NONE, end, False
            s = min(s, 1.0)
        if steps.shape[0] > 0:
            row = memo[STEPS]
            steps[row, 0], steps[row, 1] = t, p
            for j in range(width):
                steps[row, 2 + j] = xs[now, j]
            for i in range(m):
                steps[row, 2 + width + i] = motion.modes[i]
                steps[row, 2 + width + m + i] = motion.h[i]
            memo[STEPS] += 1
        carried = motion.tangents.shape[1] > 0
        if carried and s == 1.0:
            if behind == 0:
                for j in range(width):
                    motion.since[0, j] = xs[now, j]
            behind += 1
        if s < 1.0 or kind != NONE or lone:
            catch_up(system, motion, p, behind)
            behind = 0
        if s < 1.0:
            flow_matrix(system.flow, p, s, motion.M)
            apply(motion.M, xs, now, n)
            if carried:
                if motion.dM.size:
                    flow_matrix(system.d_flow, p, s, motion.dM)
                carry(system, motion, xs, now)
        else:
            for i in range(n):
                xs[1 - now, i] = line[2 * m * SPACE + i]
        now = 1 - now
        memo[STILL] = memo[STILL] + 1 if after == t or s < EPSILON else 0
        t = after
        memo[LAST] = NONE
        if turns_here:
            if turns.shape[0] > 0:
                row = memo[TURNS]
                turns[row, 0], turns[row, 1], turns[row, 2] = t, output(C, 0, xs, now), trend
                memo[TURNS] += 1
            trend = -trend
        if kind != NONE:
            y = output(C, spring, xs, now)
            law = system.laws[spring, motion.modes[spring]]
            force = law[SLOPE] * y + law[OFFSET] - law[HELD] * motion.h[spring]
            switch(system, motion, spring, kind, y)
            if events.shape[0] > 0:
                row = memo[EVENTS]
                events[row, 0], events[row, 1] = t, kind
                events[row, 2], events[row, 3] = motion.modes[spring], y
                events[row, 4], events[row, 5] = force, spring
                memo[EVENTS] += 1
        if memo[STILL] > ZENO:
            status = STUCK
            break
        if (turns_here and stop == AT_TURN) or (kind != NONE and stop == AT_SWITCH):
            status = STOPPED
            break
        if kind != NONE and stop == AT_WATCHED and motion.watched[motion.modes[0]] != 0:
            status = STOPPED
            break
    catch_up(system, motion, memo[TABLE], behind)
    memo[NOW], memo[TREND] = now, trend
    motion.clock[0] = t
    return status
