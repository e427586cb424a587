"""Compiled march of x' = A x - B F(C x) + d for laws of polynomial pieces, by Taylor series.

The series of a product is the product of series, so coefficients of any order follow from one
another. With as many as here the step is a fixed part of the radius of convergence, and what is
left out is below round-off (Jorba & Zou 2005, "A software package for the numerical integration of
ODEs by means of high-order Taylor methods"). A step ends where an output leaves its piece or, on
the flat of a loop, turns back.

The memories are marched with the state, z = (x, h, …): h' is 0 where a loop sticks and y' on its
flats. F is continuous, so a switch leaves x' as it is.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeroflutter.kernels import kernel
from aeroflutter.kernels.arrays import Real1, Real2, Real3, Whole1
from aeroflutter.motion._kernel_roots import ABOVE, BELOW, NONE, REVERSAL
from aeroflutter.springs._kernel_columns import (
    CEILING,
    DIRECTION,
    FLOOR,
    HELD,
    HIGH,
    LAG,
    LOW,
    MOVES,
    SLIDES,
    TO_HIGH,
    TO_LOW,
    TO_TURN,
)

Array = NDArray[np.float64]

ORDER = 22
PARTS = 3  # of a step in each of which y'' changes its sign once at most
MOST_TURNS = 2 * PARTS  # in a step
IDLE = 8  # steps of no length in a row, from piece to piece, before there is none left
REACHED, FULL, OUT, STALLED = range(4)
ON_TIME = 1e-9  # of the spacing: a sample as late as this still belongs to the step
ROUND_OFF = 8.0 * 2.0**-52  # of the terms of y: by as much it may pass an edge that it only touches
EVENT_COLUMNS = 6  # time, kind, mode after it, y, F, spring: as the exact flow tells them


class Law(NamedTuple):
    """A system closed by laws of polynomial pieces.

    Attributes
    ----------
    A, B, C, d
        The system.
    dA, dB
        Derivatives of A and B with respect to a parameter, of which the last tangent is; or (0, 0).
    beta
        Coefficients of F = Σ β_j y^j - held h from the constant on, a row a mode of each spring,
        (rows, powers+1).
    table
        The same rows of the piece tables, (rows, COLUMNS), their followers counted among all.
    first
        Row of each spring's first mode, (m,).
    held
        Place in z of each spring's memory, or -1, (m,).
    """

    A: Real2
    B: Real2
    C: Real2
    d: Real1
    dA: Real2
    dB: Real2
    beta: Real2
    table: Real2
    first: Whole1
    held: Whole1


class Series(NamedTuple):
    """Taylor coefficients, all from order 0 on.

    Attributes
    ----------
    z, y, F
        Of z (ORDER+1, N), of every y (m, ORDER+1) and of every F (m, ORDER).
    nested
        Of F's nests, (m, powers, ORDER).
    """

    z: Real2
    y: Real2
    F: Real2
    nested: Real3


@kernel(entry=True)
def march(
    law: Law,
    rows: Whole1,
    z: Real1,
    time: float,
    until: float,
    slope: float,
    bound: float,
    dt: float,
    samples: Real2,
    turns: Real2,
    events: Real2,
) -> tuple[int, float, float, int, int, int]:
    """March to a time, or until |y| passes a bound, the turns are full, or no step is left.

    Parameters
    ----------
    law
        What is marched; y is its first output.
    rows, z
        Row of each spring's mode, (m,), and state with memories at `time`, (N,), replaced by those
        reached.
    slope
        Last y' that was not zero; 0 at the start.
    dt, samples
        z at all multiples of dt after `time` are written into `samples`, (k, N).
    turns
        Filled with time and y of the turning points, (k, 2).
    events
        Filled with the switches, (k, EVENT_COLUMNS).

    Returns
    -------
    status, time, slope, count, found, switched
        How it ended and when; y' there; samples, turning points and switches written.
    """
    series = room_of(law)
    Y, none = series.y, np.empty((0, 0))
    spots = np.empty(MOST_TURNS)
    count, found, switched, idle = 0, 0, 0, 0
    following = np.floor(time / dt + ON_TIME) + 1.0
    while time < until:
        if found + MOST_TURNS > turns.shape[0] or switched == events.shape[0]:
            return FULL, time, slope, count, found, switched
        expand(law, rows, z, series)
        step, which, kind = first_leaving(law, rows, z, Y, min(reach(series.z), until - time))
        end = until if step == until - time else time + step
        idle = 0 if end > time else idle + 1
        if idle > IDLE or (idle > 0 and which < 0):
            return STALLED, time, slope, count, found, switched
        while following * dt <= end + ON_TIME * dt and count < samples.shape[0]:
            evaluate(series.z, following * dt - time, samples[count])
            count, following = count + 1, following + 1.0
        more, slope = turning(Y[0], step, slope, spots)
        for at in spots[:more]:
            turns[found, 0], turns[found, 1] = time + at, value(Y[0], at)
            found += 1
        evaluate(series.z, step, z)
        time = end
        if which >= 0:
            switch(law, rows, z, which, kind, none, time, events[switched])
            switched += 1
        if not abs(value(Y[0], step)) <= bound:
            return OUT, time, slope, count, found, switched
    return REACHED, time, slope, count, found, switched


@kernel
def room_of(law: Law) -> Series:
    """Room for the series."""
    m, N, powers = law.C.shape[0], law.C.shape[1], law.beta.shape[1] - 1
    for place in law.held:
        N += place >= 0
    z, y = np.empty((ORDER + 1, N)), np.empty((m, ORDER + 1))
    return Series(z, y, np.empty((m, ORDER)), np.empty((m, powers, ORDER)))


@kernel
def expand(law: Law, rows: NDArray[np.int64], z: Array, series: Series) -> None:
    """Taylor coefficients of everything from z."""
    A, B, C, d, beta, table, held = (
        law.A, law.B, law.C, law.d, law.beta, law.table, law.held,
    )  # fmt: skip
    Z, Y, F, nested = series.z, series.y, series.F, series.nested
    m, n = C.shape
    Z[0] = z
    for s in range(m):
        Y[s, 0] = output(C, s, z)
    for k in range(ORDER):
        for s in range(m):
            F[s, k] = nest(beta, rows[s], Y[s], k, nested[s])
            if held[s] >= 0:
                F[s, k] -= table[rows[s], HELD] * Z[k, held[s]]
        for i in range(n):
            total = d[i] if k == 0 else 0.0
            for s in range(m):
                total -= B[i, s] * F[s, k]
            for j in range(n):
                total += A[i, j] * Z[k, j]
            Z[k + 1, i] = total / (k + 1)
        for s in range(m):
            Y[s, k + 1] = output(C, s, Z[k + 1])
            if held[s] >= 0:
                Z[k + 1, held[s]] = table[rows[s], SLIDES] * Y[s, k + 1]


@kernel
def output(C: Array, s: int, z: Array) -> float:
    """y of a spring at z."""
    y = 0.0
    for j in range(C.shape[1]):
        y += C[s, j] * z[j]
    return y


@kernel
def nest(beta: Array, row: int, Y: Array, k: int, nested: Array) -> float:
    """Coefficient k of β₀ + y (β₁ + y (β₂ + …)), the coefficients of a row.

    Parameters
    ----------
    nested
        The coefficients below k of each bracket, the whole first, (powers, ORDER).
    """
    powers = beta.shape[1] - 1
    for level in range(powers - 1, -1, -1):
        total = beta[row, level] if k == 0 else 0.0
        if level == powers - 1:
            total += beta[row, powers] * Y[k]
        else:
            for i in range(k + 1):
                total += nested[level + 1, i] * Y[k - i]
        nested[level, k] = total
    return float(nested[0, k])


@kernel
def reach(X: Array) -> float:
    """Step: the radius of convergence by the last two coefficients, over e² (Jorba & Zou, §3.2)."""
    size = np.max(np.abs(X[0]))
    if size == 0.0:  # a load moves what is at rest
        size = np.max(np.abs(X[1]))
    radius = np.inf
    for k in (ORDER - 1, ORDER):
        last = np.max(np.abs(X[k]))
        if last > 0.0:
            radius = min(radius, (size / last) ** (1.0 / k))
    return float(radius / np.exp(2.0))


@kernel
def first_leaving(
    law: Law, rows: NDArray[np.int64], z: Array, Y: Array, step: float
) -> tuple[float, int, int]:
    """The step to where the first output leaves its mode, its place (or -1) and what ends it."""
    spots, which, kind = np.empty(MOST_TURNS), -1, NONE
    for s in range(Y.shape[0]):
        row = law.table[rows[s]]
        low, high, direction = row[LOW], row[HIGH], row[DIRECTION]
        if row[MOVES] != 0.0:
            h = z[law.held[s]]
            low = -np.inf if h <= row[FLOOR] else low + row[MOVES] * h
            high = np.inf if h >= row[CEILING] else high + row[MOVES] * h
        if low == -np.inf and high == np.inf and direction == 0.0:
            continue
        slope = direction if direction != 0.0 else rate(Y[s], 0.0)
        more, _ = turning(Y[s], step, slope, spots)
        slack, early = 0.0, 0.0
        for j in range(law.C.shape[1]):
            slack += ROUND_OFF * abs(law.C[s, j] * z[j])
        for k in range(more + 1):
            late = spots[k] if k < more else step
            y = value(Y[s], late)
            if y > high + slack or y < low - slack:
                side = 1 if y > high else -1
                step = passing(Y[s], early, late, high if y > high else low, side)
                which, kind = s, ABOVE if side > 0 else BELOW
                break
            if direction != 0.0 and k < more:
                step, which, kind = late, s, REVERSAL
                break
            early = late
    return step, which, kind


@kernel
def switch(
    law: Law,
    rows: NDArray[np.int64],
    z: Array,
    s: int,
    kind: int,
    tangents: Array,
    time: float,
    event: Array,
) -> None:
    """The mode of a spring, its memory and that one's tangents after `kind` ended it; noted.

    The memory follows y from where a flat begins, δh = C δx from there on, forgets where it meets a
    stop, and keeps what it has where y turns.
    """
    row, held, y = law.table[rows[s]], law.held[s], output(law.C, s, z)
    if row[SLIDES] != 0.0:
        if kind == REVERSAL:
            z[held] = min(max(y - row[LAG], row[FLOOR]), row[CEILING])
        else:
            z[held] = row[FLOOR] if kind == BELOW else row[CEILING]
            if tangents.size:
                tangents[held] = 0.0
    after = row[TO_TURN] if kind == REVERSAL else (row[TO_LOW] if kind == BELOW else row[TO_HIGH])
    rows[s] = int(after)
    if held >= 0 and law.table[rows[s], SLIDES] != 0.0:
        row = law.table[rows[s]]
        z[held] = min(max(y - row[LAG], row[FLOOR]), row[CEILING])
        for j in range(tangents.shape[1]):
            tangents[held, j] = output(law.C, s, tangents[:, j])
    moment = 0.0
    for power in range(law.beta.shape[1] - 1, -1, -1):
        moment = moment * y + law.beta[rows[s], power]
    if held >= 0:
        moment -= law.table[rows[s], HELD] * z[held]
    event[0], event[1], event[2] = time, kind, rows[s] - law.first[s]
    event[3], event[4], event[5] = y, moment, s


@kernel
def passing(Y: Array, low: float, high: float, edge: float, side: int) -> float:
    """Where y passes an edge to one side between two times, by bisection."""
    while True:
        middle = 0.5 * (low + high)
        if not low < middle < high:
            return high
        if side * (value(Y, middle) - edge) > 0.0:
            high = middle
        else:
            low = middle


@kernel
def evaluate(X: Array, s: float, x: Array) -> None:
    """State at a time s after the expansion, into x."""
    for i in range(x.size):
        total = X[ORDER, i]
        for k in range(ORDER - 1, -1, -1):
            total = total * s + X[k, i]
        x[i] = total


@kernel
def value(Y: Array, s: float) -> float:
    """y at a time s."""
    total = Y[ORDER]
    for k in range(ORDER - 1, -1, -1):
        total = total * s + Y[k]
    return float(total)


@kernel
def rate(Y: Array, s: float) -> float:
    """y' at a time s."""
    total = ORDER * Y[ORDER]
    for k in range(ORDER - 1, 0, -1):
        total = total * s + k * Y[k]
    return float(total)


@kernel
def bend(Y: Array, s: float) -> float:
    """y'' at a time s."""
    total = ORDER * (ORDER - 1) * Y[ORDER]
    for k in range(ORDER - 1, 1, -1):
        total = total * s + k * (k - 1) * Y[k]
    return float(total)


@kernel
def turning(Y: Array, step: float, slope: float, spots: Array) -> tuple[int, float]:
    """Times of the turning points in a step, and y' at its end.

    Every part is cut where y'' changes sign, so that y' is monotone and no pair is missed.

    Parameters
    ----------
    slope
        Last y' that was not zero; 0 at the start.
    spots
        Filled with the times, (MOST_TURNS,).
    """
    found = 0
    for part in range(PARTS):
        low, high = step * part / PARTS, step * (part + 1) / PARTS
        before, after = bend(Y, low), bend(Y, high)
        middle = root(Y, low, high, after, True) if before * after < 0.0 else high
        for late in (middle, high):
            rise = rate(Y, late)
            if slope * rise < 0.0:
                spots[found] = root(Y, low, late, rise, False)
                found += 1
            if rise != 0.0:
                slope = rise
            low = late
    return found, slope


@kernel
def root(Y: Array, low: float, high: float, above: float, second: bool) -> float:
    """Where y', or y'', changes sign between two times, by bisection; `above` is it at the later."""
    while True:
        middle = 0.5 * (low + high)
        if not low < middle < high:
            return middle
        here = bend(Y, middle) if second else rate(Y, middle)
        if here * above > 0.0:
            high = middle
        else:
            low = middle
