"""Compiled march of x' = A x - b F(c x) for a polynomial F = Σ βᵢ yⁱ, by Taylor series.

The series of a product is the product of series, so coefficients of any order follow from one
another. With as many as here the step is a fixed part of the radius of convergence, and what is
left out is below round-off (Jorba & Zou 2005, "A software package for the numerical integration of
ODEs by means of high-order Taylor methods").
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.kernels import kernel
from aeroflutter.kernels.arrays import Given1, Given2, Real1, Real2

Array = NDArray[np.float64]

ORDER = 22
PARTS = 3  # of a step in each of which y'' changes its sign once at most
MOST_TURNS = 2 * PARTS  # in a step
REACHED, FULL, OUT, STALLED = range(4)
ON_TIME = 1e-9  # of the spacing: a sample as late as this still belongs to the step


@kernel(entry=True)
def march(
    A: Given2,
    b: Given1,
    c: Given1,
    beta: Given1,
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
    A, b, c, beta
        The system, and the coefficients β₁, β₂, … of the spring.
    x
        State at `time`, (n,), replaced by the one reached.
    slope
        Last y' that was not zero; 0 at the start.
    dt, samples
        States at all multiples of dt after `time` are written into `samples`, (m, n).
    turns
        Filled with time and y of the turning points, (k, 2).

    Returns
    -------
    status, time, slope, count, found
        How it ended and when; y' there; samples and turning points written.
    """
    X, Y = np.empty((ORDER + 1, x.size)), np.empty(ORDER + 1)
    nested = np.empty((beta.size, ORDER))
    spots = np.empty(MOST_TURNS)
    count, found = 0, 0
    following = np.floor(time / dt + ON_TIME) + 1.0
    while time < until:
        if found + MOST_TURNS > turns.shape[0]:
            return FULL, time, slope, count, found
        expand(A, b, c, beta, x, X, Y, nested)
        step = min(reach(X), until - time)
        end = until if step == until - time else time + step
        if not end > time:
            return STALLED, time, slope, count, found
        while following * dt <= end + ON_TIME * dt and count < samples.shape[0]:
            evaluate(X, following * dt - time, samples[count])
            count, following = count + 1, following + 1.0
        more, slope = turning(Y, step, slope, spots)
        for at in spots[:more]:
            turns[found, 0], turns[found, 1] = time + at, value(Y, at)
            found += 1
        evaluate(X, step, x)
        time = end
        if not abs(value(Y, step)) <= bound:
            return OUT, time, slope, count, found
    return REACHED, time, slope, count, found


@kernel
def expand(
    A: Array,
    b: Array,
    c: Array,
    beta: Array,
    x: Array,
    X: Array,
    Y: Array,
    nested: Array,
) -> None:
    """Taylor coefficients of x (ORDER+1, n), of y (ORDER+1,) and of F's nest (powers, ORDER)."""
    X[0] = x
    for k in range(ORDER):
        Y[k] = np.sum(c * X[k])
        moment = nest(beta, 0.0, Y, k, nested)
        for i in range(x.size):
            total = -b[i] * moment
            for j in range(x.size):
                total += A[i, j] * X[k, j]
            X[k + 1, i] = total / (k + 1)
    Y[ORDER] = np.sum(c * X[ORDER])


@kernel
def nest(beta: Array, first: float, Y: Array, k: int, nested: Array) -> float:
    """Coefficient k of first + β₁ y + β₂ y² + … = first + y (β₁ + y (β₂ + …)).

    Parameters
    ----------
    beta, nested
        (powers,), and the coefficients below k of each bracket, the whole first, (powers, ORDER).
    """
    for level in range(beta.size - 1, -1, -1):
        total = 0.0
        if k == 0:
            total = beta[level - 1] if level > 0 else first
        if level == beta.size - 1:
            total += beta[level] * Y[k]
        else:
            for i in range(k + 1):
                total += nested[level + 1, i] * Y[k - i]
        nested[level, k] = total
    return float(nested[0, k])


@kernel
def reach(X: Array) -> float:
    """Step: the radius of convergence by the last two coefficients, over e² (Jorba & Zou, §3.2)."""
    size = np.max(np.abs(X[0]))
    radius = np.inf
    for k in (ORDER - 1, ORDER):
        last = np.max(np.abs(X[k]))
        if last > 0.0:
            radius = min(radius, (size / last) ** (1.0 / k))
    return float(radius / np.exp(2.0))


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
