"""Compiled march of x' = A x - B F(C x) + d for laws of polynomial pieces, by Taylor series.

The series of a product is the product of series, so coefficients of any order follow from one
another. With as many as here the step is a fixed part of the radius of convergence, and what is
left out is below round-off (Jorba & Zou 2005, "A software package for the numerical integration of
ODEs by means of high-order Taylor methods"). A step ends where an output leaves its piece.

The pieces of all springs are the rows of two tables: `beta`, coefficients of F = Σ β_j y^j from the
constant on, (rows, powers+1), and `edges`, lower and upper end of y, (rows, 2). Those of one spring
follow each other, so the neighbour of a row is the next piece.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.kernels import kernel
from aeroflutter.kernels.arrays import Given1, Given2, Real1, Real2, Whole1

Array = NDArray[np.float64]

ORDER = 22
PARTS = 3  # of a step in each of which y'' changes its sign once at most
MOST_TURNS = 2 * PARTS  # in a step
IDLE = 8  # steps of no length in a row, from piece to piece, before there is none left
REACHED, FULL, OUT, STALLED = range(4)
ON_TIME = 1e-9  # of the spacing: a sample as late as this still belongs to the step


@kernel(entry=True)
def march(
    A: Given2,
    B: Given2,
    C: Given2,
    d: Given1,
    beta: Given2,
    edges: Given2,
    rows: Whole1,
    x: Real1,
    time: float,
    until: float,
    slope: float,
    bound: float,
    dt: float,
    samples: Real2,
    turns: Real2,
) -> tuple[int, float, float, int, int]:
    """March to a time, or until |y| passes a bound, the turns are full, or no step is left.

    Parameters
    ----------
    A, B, C, d
        The system; y is its first output.
    beta, edges
        The pieces of the laws.
    rows, x
        Row of each spring's piece, (m,), and state at `time`, (n,), replaced by those reached.
    slope
        Last y' that was not zero; 0 at the start.
    dt, samples
        States at all multiples of dt after `time` are written into `samples`, (k, n).
    turns
        Filled with time and y of the turning points, (k, 2).

    Returns
    -------
    status, time, slope, count, found
        How it ended and when; y' there; samples and turning points written.
    """
    X, Y, nested = room_of(B.shape[1], x.size, beta.shape[1])
    spots = np.empty(MOST_TURNS)
    count, found, idle = 0, 0, 0
    following = np.floor(time / dt + ON_TIME) + 1.0
    while time < until:
        if found + MOST_TURNS > turns.shape[0]:
            return FULL, time, slope, count, found
        expand(A, B, C, d, beta, rows, x, X, Y, nested)
        step, which, way = first_leaving(Y, edges, rows, min(reach(X), until - time))
        end = until if step == until - time else time + step
        idle = 0 if end > time else idle + 1
        if idle > IDLE or (idle > 0 and which < 0):
            return STALLED, time, slope, count, found
        while following * dt <= end + ON_TIME * dt and count < samples.shape[0]:
            evaluate(X, following * dt - time, samples[count])
            count, following = count + 1, following + 1.0
        more, slope = turning(Y[0], step, slope, spots)
        for at in spots[:more]:
            turns[found, 0], turns[found, 1] = time + at, value(Y[0], at)
            found += 1
        evaluate(X, step, x)
        time = end
        if which >= 0:
            rows[which] += way
        if not abs(value(Y[0], step)) <= bound:
            return OUT, time, slope, count, found
    return REACHED, time, slope, count, found


@kernel
def room_of(m: int, n: int, powers: int) -> tuple[Array, Array, Array]:
    """Room for the series of x, of every y and of every nest."""
    X, Y = np.empty((ORDER + 1, n)), np.empty((m, ORDER + 1))
    return X, Y, np.empty((m, powers - 1, ORDER))


@kernel
def expand(
    A: Array,
    B: Array,
    C: Array,
    d: Array,
    beta: Array,
    rows: NDArray[np.int64],
    x: Array,
    X: Array,
    Y: Array,
    nested: Array,
) -> None:
    """Taylor coefficients of x (ORDER+1, n), of y (m, ORDER+1) and of F's nests."""
    n, m = B.shape
    moments = np.empty(m)
    X[0] = x
    for k in range(ORDER):
        for s in range(m):
            y = 0.0
            for j in range(n):
                y += C[s, j] * X[k, j]
            Y[s, k] = y
            moments[s] = nest(beta, rows[s], Y[s], k, nested[s])
        for i in range(n):
            total = d[i] if k == 0 else 0.0
            for s in range(m):
                total -= B[i, s] * moments[s]
            for j in range(n):
                total += A[i, j] * X[k, j]
            X[k + 1, i] = total / (k + 1)
    for s in range(m):
        Y[s, ORDER] = np.sum(C[s] * X[ORDER])


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
    Y: Array, edges: Array, rows: NDArray[np.int64], step: float
) -> tuple[float, int, int]:
    """The step to where the first output leaves its piece, its place (or -1) and to which side."""
    spots, which, way = np.empty(MOST_TURNS), -1, 0
    for s in range(Y.shape[0]):
        low, high = edges[rows[s], 0], edges[rows[s], 1]
        if low == -np.inf and high == np.inf:
            continue
        more, _ = turning(Y[s], step, rate(Y[s], 0.0), spots)
        early = 0.0
        for k in range(more + 1):
            late = spots[k] if k < more else step
            y = value(Y[s], late)
            if y > high or y < low:
                side = 1 if y > high else -1
                step = passing(Y[s], early, late, high if y > high else low, side)
                which, way = s, side
                break
            early = late
    return step, which, way


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
