"""Compiled events of a step: root isolation on [0, 1] with polynomials in the Bernstein basis.

A polynomial lies within the hull of its Bernstein coefficients, and has at most as many roots in
(0, 1) as they have sign changes. So a step without a switch is proved to be one, a single sign
change is a single root, and everything else is halved until one of the two holds: no double
crossing is missed, however close to grazing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.kernels import kernel

Array = NDArray[np.float64]

DEGREE = 15  # of the polynomials
WIDTH = DEGREE + 1
SPACE = WIDTH + 2  # columns that hold a polynomial and, where it is on a stack, its interval
NONE, BELOW, ABOVE, REVERSAL = 0, 1, 2, 3  # what ends a mode: an edge of its window, y turning
NEVER = 2.0  # a root beyond the step
DEPTH = 48  # halvings: an interval of 2^-48 is a point
NEWTON = 64  # steps at the most

# Work space is one array with a polynomial a row, so that a call passes one array: an event
# function in the power basis, its derivative, the stack of intervals
# with the event function in the Bernstein basis, and y over the step in both bases.
POWER, SLOPE, STACK = 0, 1, 2
Y = STACK + DEPTH + 2
Y_POWER = Y + 1
ROWS = Y_POWER + 1


@kernel(inner=True, bare=True)
def extent(w: Array) -> tuple[float, float]:
    """Smallest and largest coefficient of the y in `w`."""
    low0 = high0 = w[Y, 0]
    low1 = high1 = w[Y, 1]
    low2 = high2 = w[Y, 2]
    low3 = high3 = w[Y, 3]
    for k in range(4, WIDTH, 4):
        low0 = min(low0, w[Y, k])
        low1 = min(low1, w[Y, k + 1])
        low2 = min(low2, w[Y, k + 2])
        low3 = min(low3, w[Y, k + 3])
        high0 = max(high0, w[Y, k])
        high1 = max(high1, w[Y, k + 1])
        high2 = max(high2, w[Y, k + 2])
        high3 = max(high3, w[Y, k + 3])
    return min(min(low0, low1), min(low2, low3)), max(max(high0, high1), max(high2, high3))


@kernel(inner=True, bare=True)
def monotone(w: Array, direction: int, tolerance: float) -> bool:
    """Whether y goes in `direction` all through the step; a fall of the tolerance is none."""
    for k in range(DEGREE):  # noqa: SIM110 - a compiled loop
        if direction * (w[Y, k + 1] - w[Y, k]) < -tolerance:
            return False
    return True


@kernel(inner=True, bare=True)
def heading(w: Array, tolerance: float) -> int:
    """Sign of the first change of y in a step that is more than round-off, or 0."""
    for k in range(DEGREE):
        rise = w[Y, k + 1] - w[Y, k]
        if abs(rise) > tolerance:
            return 1 if rise > 0.0 else -1
    return 0


@kernel(inner=True, bare=True)
def evaluate(w: Array, row: int, s: float) -> float:
    """A polynomial of WIDTH power coefficients, as four interleaved Horner schemes."""
    s2 = s * s
    s4 = s2 * s2
    p0, p1, p2, p3 = w[row, 12], w[row, 13], w[row, 14], w[row, 15]
    for k in range(8, -1, -4):
        p0 = p0 * s4 + w[row, k]
        p1 = p1 * s4 + w[row, k + 1]
        p2 = p2 * s4 + w[row, k + 2]
        p3 = p3 * s4 + w[row, k + 3]
    return (p0 + s * p1) + s2 * (p2 + s * p3)


@kernel(inner=True, bare=True)
def newton(w: Array, low: float, high: float, s: float) -> float:
    """The root in (low, high) of the polynomial in row POWER, negative at `low`, from a guess.

    Newton's method kept inside the bracket. With steps d and D before it, its next step is about
    d (d/D)², which is how it knows that it has arrived without taking that step; a guess and a
    bisection are no such steps.
    """
    for k in range(DEGREE):
        w[SLOPE, k] = (k + 1) * w[POWER, k + 1]
    w[SLOPE, DEGREE] = 0.0
    before = 0.0
    for _ in range(NEWTON):
        row = POWER
        p = evaluate(w, row, s)
        row = SLOPE
        d = evaluate(w, row, s)
        if p > 0.0:
            high = s
        else:
            low = s
        t = s - p / d if d > 0.0 else NEVER
        inside = low < t < high
        if not inside:
            t = 0.5 * (low + high)
        step = abs(t - s)
        s = t
        if step <= 4e-16 or step * step * step <= 1e-17 * before * before:
            break
        before = step if inside else 0.0
    return s


@kernel(inner=True, bare=True)
def first_positive(w: Array, m: int, tolerance: float, low: float, high: float) -> float:
    """First point of [low, high] at which a polynomial becomes positive, or `NEVER`.

    Parameters
    ----------
    w
        Row STACK holds its m Bernstein coefficients on [low, high], row POWER its power
        coefficients on [0, 1].
    tolerance
        Excursions not above it are round-off and ignored.

    Notes
    -----
    Where the signs do not settle it, the interval is halved, leftmost half first. The guess of a
    single root is where the control polygon crosses zero, corrected by its curvature: a smooth f
    through the m coefficients, taken at equal spaces, makes the polynomial
    f + s (1 - s) f''/2(m - 1) + ….
    """
    degree = m - 1
    w[STACK, m], w[STACK, m + 1] = low, high
    top = STACK
    while top >= STACK:
        low, high = w[top, m], w[top, m + 1]
        first = 0  # coefficient above the tolerance
        at_once = True  # from zero or above, within round-off, it rises at once
        while first < m and w[top, first] <= tolerance:
            if w[top, first] < -tolerance:
                at_once = False
            first += 1
        if first == m:
            top -= 1
            continue
        if at_once or top >= STACK + DEPTH:
            return low
        single = w[top, 0] <= 0.0  # no coefficient after `first` is negative: it crosses once
        for k in range(first + 1, m):
            if w[top, k] < 0.0:
                single = False
        if single:
            s = 0.5
            if first > 0:
                before = min(w[top, first - 1], 0.0)
                rise = w[top, first] - before
                part = -before / rise
                s = (first - 1 + part) / degree
                if 2 <= first < degree:
                    bend = w[top, first + 1] - w[top, first] - w[top, first - 1] + w[top, first - 2]
                    shift = s * (1.0 - s) - part * (1.0 - part) / degree
                    better = s - 0.25 * shift * bend / rise
                    if 0.0 < better < 1.0:
                        s = better
            return newton(w, low, high, low + (high - low) * s)
        for level in range(m):  # de Casteljau at one half
            w[top + 1, level] = w[top, 0]
            for k in range(m - 1 - level):
                w[top, k] += 0.5 * (w[top, k + 1] - w[top, k])
        middle = 0.5 * (low + high)
        w[top, m] = middle
        w[top + 1, m], w[top + 1, m + 1] = low, middle
        top += 1
    return NEVER


@kernel(inner=True, bare=True)
def first_beyond(w: Array, sign: int, edge: float, tolerance: float) -> float:
    """First place in [0, 1] at which y passes `edge` upwards (sign 1) or downwards (-1)."""
    for k in range(w.shape[1]):  # not known to the compiler, which then vectorises
        w[STACK, k] = sign * (w[Y, k] - edge)
        w[POWER, k] = sign * w[Y_POWER, k]
    w[POWER, 0] -= sign * edge
    m = WIDTH
    return first_positive(w, m, tolerance, 0.0, 1.0)


@kernel(inner=True, bare=True)
def first_turn(w: Array, direction: int, tolerance: float) -> float:
    """First place in [0, 1] at which y starts to go against `direction`, or `NEVER`."""
    for k in range(DEGREE):
        w[STACK, k] = -direction * (w[Y, k + 1] - w[Y, k])
        w[POWER, k] = -direction * (k + 1) * w[Y_POWER, k + 1] / DEGREE
    w[POWER, DEGREE] = 0.0
    m = DEGREE
    return first_positive(w, m, tolerance, 0.0, 1.0)


@kernel(inner=True, bare=True)
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
    sign = 1
    excess = max(4.0 * tolerance, 2.0 * (w[Y, 0] - high))
    if most > high + excess:
        at = first_beyond(w, sign, high, excess)
        kind = ABOVE
    sign = -1
    excess = max(4.0 * tolerance, 2.0 * (low - w[Y, 0]))
    if least < low - excess:
        place = first_beyond(w, sign, low, excess)
        if place < at:
            at, kind = place, BELOW
    if direction != 0 and not monotone(w, direction, 2.0 * tolerance):
        place = first_turn(w, direction, 2.0 * tolerance)
        if place < at:
            at, kind = place, REVERSAL
    return at, (kind if at <= 1.0 else NONE)
