"""Compiled exact engine: from switch to switch of a piecewise-linear Lur'e system.

x' = A x - b F(y), y = c x. Within a mode F = k y - u is a straight line, the flow is a table of
`_kernel_exact_tables`, and the mode ends where y leaves its window or, on the flat of a loop,
where y turns back. Modes of a static spring are its pieces; a loop has three.

What every step calls is inlined: handing its arrays over would cost as much as its work.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeroflutter.kernels import kernel
from aeroflutter.kernels.arrays import Real1, Whole1
from aeroflutter.motion._kernel_exact_roots import (
    NEVER,
    ROWS,
    Y,
    extent,
    first_beyond,
    first_turn,
    heading,
    monotone,
)
from aeroflutter.motion._kernel_exact_tables import SPACE, Array, padded

Index = NDArray[np.int64]

STICK, RISING, FALLING = 0, 1, 2  # modes of a loop; those of a static spring are its pieces
NONE, LOW, HIGH, REVERSAL = 0, 1, 2, 3  # what ends a mode: an edge of its window, or y turning
DONE, FULL, OVERFLOW, STUCK = 0, 1, 2, 3  # how a march ends
EPSILON = 2.0**-52
HUGE = 1e250  # beyond it a motion overflows within a step
ZENO = 200  # switches without progress in time


class Law(NamedTuple):
    """A piecewise-linear spring as numbers.

    Attributes
    ----------
    memory
        1 for the loop, 0 for a static spring.
    edges
        Breaks of a static spring between -inf and inf, (pieces + 1,).
    table
        Row of `Tables` a piece, (pieces,); of the loop: (stick, flat).
    slopes, offsets
        F = slope y + offset on each piece, (pieces,).
    loop
        V1, V2, h_low, h_high.
    size
        Largest number of the spring, for round-off.
    """

    memory: int
    edges: Real1
    table: Whole1
    slopes: Real1
    offsets: Real1
    loop: Real1
    size: float


class Work(NamedTuple):
    """Work space of one march.

    Attributes
    ----------
    xs
        (x, u) now and next, (2, n+1), padded with zeros to the rows of `Tables.lines`.
    polynomials
        See `_kernel_exact_roots`, (ROWS, SPACE), and more rows for the rest of the line.
    line
        The rows of y and all after them as one, which `combine` fills.
    M
        M(s), (1, n (n+1)).
    """

    xs: Array
    polynomials: Array
    line: Array
    M: Array


@kernel
def workspace(n: int) -> Work:
    """Work space for n states."""
    polynomials = np.zeros((ROWS + 1 + n // SPACE, SPACE))
    line = polynomials[Y:].reshape(-1)[: 2 * SPACE + padded(n)]
    return Work(np.zeros((2, padded(n + 1))), polynomials, line, np.empty((1, n * (n + 1))))


@kernel
def variable(value: int) -> int:
    """A literal as a variable: calls with literals are compiled apart, for minutes."""
    return int(np.int64(value))


@kernel
def output(c: Array, xs: Array, row: int) -> float:
    """Y = c x of a row of states."""
    y = 0.0
    for i in range(c.size):
        y += c[i] * xs[row, i]
    return y


@kernel
def clip(value: float, low: float, high: float) -> float:
    """`value` between `low` and `high`."""
    return low if value < low else (high if value > high else value)


@kernel(entry=True)
def start(law: Law, h: float, y: float) -> tuple[int, float]:
    """Mode and memory with which a motion from y begins."""
    if law.memory:
        h = clip(clip(h, y - law.loop[0], y - law.loop[1]), law.loop[2], law.loop[3])
        return STICK, h
    mode = 0
    while mode + 1 < law.offsets.size and y >= law.edges[mode + 1]:
        mode += 1
    return mode, 0.0


@kernel
def window(law: Law, mode: int, h: float) -> tuple[int, float, float, float, int]:
    """Table, input u, lower and upper edge of y, and the direction in which y must go (or 0)."""
    if law.memory == 0:
        return law.table[mode], -law.offsets[mode], law.edges[mode], law.edges[mode + 1], 0
    v1, v2, h_low, h_high = law.loop[0], law.loop[1], law.loop[2], law.loop[3]
    if mode == STICK:
        low = -np.inf if h <= h_low else h + v2
        high = np.inf if h >= h_high else h + v1
        return law.table[0], h, low, high, 0
    if mode == RISING:
        return law.table[1], -v1, -np.inf, h_high + v1, 1
    return law.table[1], -v2, h_low + v2, np.inf, -1


@kernel
def memory_at(law: Law, mode: int, h: float, y: float) -> float:
    """Memory at y within a mode: fixed while it sticks, sliding with y on a flat."""
    if law.memory == 0:
        return 0.0
    if mode == RISING:
        return clip(y - law.loop[0], law.loop[2], law.loop[3])
    if mode == FALLING:
        return clip(y - law.loop[1], law.loop[2], law.loop[3])
    return h


@kernel
def switch(law: Law, mode: int, h: float, y: float, kind: int) -> tuple[int, float]:
    """Mode and memory after `kind` ended a mode at y. An edge comes before a reversal there."""
    if law.memory == 0:
        return (mode - 1 if kind == LOW else mode + 1), 0.0
    if mode == STICK:
        return (FALLING if kind == LOW else RISING), h
    if kind == HIGH:
        return STICK, law.loop[3]
    if kind == LOW:
        return STICK, law.loop[2]
    return STICK, memory_at(law, mode, h, y)


@kernel
def moment(law: Law, mode: int, h: float, y: float) -> float:
    """Restoring moment F at y within a mode."""
    if law.memory:
        return y - memory_at(law, mode, h, y)
    return law.slopes[mode] * y + law.offsets[mode]


@kernel(inline="always")
def combine(lines: Array, p: int, xs: Array, now: int, line: Array) -> None:
    """The line of a step from (x, u) on table p: y in both bases, and the state at the end."""
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


@kernel(inline="always")
def round_off(noise: Array, xs: Array, now: int, size: float) -> float:
    """Bound of the round-off in y within a step: of the state alone, whatever the mode.

    Where one mode says that it has ended, the next must not say that it has yet to begin.
    """
    n = noise.size - 1
    total = size + noise[n] * size
    for j in range(n):
        total += noise[j] * abs(xs[now, j])
    return 8.0 * EPSILON * total


@kernel
def event(w: Array, low: float, high: float, direction: int, tolerance: float) -> tuple[float, int]:
    """First event of a step: its place in [0, 1] (or `NEVER`) and kind.

    Parameters
    ----------
    w
        y over the step in rows Y and Y_POWER.
    low, high, direction
        The window of the mode.

    Notes
    -----
    A mode begins within its window. What y exceeds an edge by at the start is round-off of the
    step before, on another piece, and no event unless y goes on outwards. A rise that takes y
    over an edge must be more than what is taken for no rise beyond it.
    """
    least, most = extent(w)
    at, kind = NEVER, NONE
    excess = max(4.0 * tolerance, 2.0 * (w[Y, 0] - high))
    if most > high + excess:
        at = first_beyond(w, 1, high, excess)
        kind = HIGH
    excess = max(4.0 * tolerance, 2.0 * (low - w[Y, 0]))
    if least < low - excess:
        place = first_beyond(w, -1, low, excess)
        if place < at:
            at, kind = place, LOW
    if direction != 0 and not monotone(w, direction, 2.0 * tolerance):
        place = first_turn(w, direction, 0.0, 2.0 * tolerance)
        if place < at:
            at, kind = place, REVERSAL
    return at, (kind if at <= 1.0 else NONE)


@kernel
def step_end(
    noise: Array,
    size: float,
    xs: Array,
    now: int,
    w: Array,
    bounds: tuple[float, float, int],
    trend: int,
) -> tuple[float, int, bool, int]:
    """Where a step ends at the latest, if it is to end at every event and every extremum of y.

    Parameters
    ----------
    noise, size
        Of the tables and the spring, for round-off.
    w
        y over the step.
    bounds
        The window of the mode: low, high, direction.
    trend
        Sign of y', or 0 if it is not known yet.

    Returns
    -------
    s, kind, turns, trend
        Place in [0, 1], event there, whether y turns there, sign of y' on the way.
    """
    low, high, direction = bounds
    if trend != 0 and clear(w, low, high, direction) and monotone(w, trend, 0.0):
        return 1.0, NONE, False, trend
    tolerance = round_off(noise, xs, now, size)
    s, kind = event(w, low, high, direction, tolerance)
    if trend == 0:
        trend = heading(w, 2.0 * tolerance)
    at = first_turn(w, trend, 0.0, 2.0 * tolerance) if trend != 0 else NEVER
    turns = at <= min(s, 1.0)
    if at < s:
        s, kind = at, NONE
    return min(s, 1.0), kind, turns, trend


@kernel(inline="always")
def clear(w: Array, low: float, high: float, direction: int) -> bool:
    """Whether the hull of y alone proves that a step has no event."""
    least, most = extent(w)
    return least >= low and most <= high and (direction == 0 or monotone(w, direction, 0.0))


@kernel
def flow_matrix(table: Array, p: int, s: float, M: Array) -> None:
    """M(s), (1, size), from its power coefficients (m, w, size)."""
    s2 = s * s
    s3 = s2 * s
    s4 = s2 * s2
    for k in range(M.shape[1]):
        M[0, k] = (table[p, 12, k] + s * table[p, 13, k]) + (
            s2 * table[p, 14, k] + s3 * table[p, 15, k]
        )
    for j in range(8, -1, -4):
        for k in range(M.shape[1]):
            M[0, k] = M[0, k] * s4 + (
                (table[p, j, k] + s * table[p, j + 1, k])
                + (s2 * table[p, j + 2, k] + s3 * table[p, j + 3, k])
            )


@kernel
def apply(M: Array, xs: Array, now: int, n: int) -> None:
    """The other row of `xs` ← M (x, u), for M (1, n (n+1)) flattened by rows."""
    m = n + 1
    i = 0
    while i + 2 < n:  # three rows at a time hide the latency of the sums
        r0, r1, r2 = i * m, (i + 1) * m, (i + 2) * m
        s0 = s1 = s2 = 0.0
        for j in range(m):
            v = xs[now, j]
            s0 += M[0, r0 + j] * v
            s1 += M[0, r1 + j] * v
            s2 += M[0, r2 + j] * v
        xs[1 - now, i] = s0
        xs[1 - now, i + 1] = s1
        xs[1 - now, i + 2] = s2
        i += 3
    while i < n:
        s0 = 0.0
        for j in range(m):
            s0 += M[0, i * m + j] * xs[now, j]
        xs[1 - now, i] = s0
        i += 1


@kernel(inline="always")
def advance(
    flow: Array, p: int, s: float, xs: Array, now: int, line: Array, M: Array, n: int
) -> None:
    """The other row of `xs` ← the n states at place s of a step whose line is known.

    Parameters
    ----------
    flow
        Of the tables. Unless s is 1, M is filled with M(s).
    """
    if s == 1.0:
        for i in range(n):
            xs[1 - now, i] = line[2 * SPACE + i]
    else:
        flow_matrix(flow, p, s, M)
        apply(M, xs, now, n)
