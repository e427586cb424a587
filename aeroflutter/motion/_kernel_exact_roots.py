"""Compiled root isolation on [0, 1] with polynomials in the Bernstein basis.

A polynomial lies within the hull of its Bernstein coefficients, and has at most as many roots in
(0, 1) as they have sign changes. So a step without a switch is proved to be one, a single sign
change is a single root, and everything else is halved until one of the two holds: no double
crossing is missed, however close to grazing.
"""

from __future__ import annotations

from aeroflutter.kernels import kernel
from aeroflutter.motion._kernel_exact_tables import DEGREE, WIDTH, Array

NEVER = 2.0  # a root beyond the step
DEPTH = 48  # halvings: an interval of 2^-48 is a point

# Work space is one array with a polynomial a row, so that a call passes one array: an event
# function in both bases, the stack of intervals from STACK on, and y over the step in both bases.
G, G_POWER, SLOPE, LEFT, STACK = 0, 1, 2, 3, 4
Y = STACK + DEPTH + 2
Y_POWER = Y + 1
ROWS = Y_POWER + 1


@kernel
def extent(w: Array) -> tuple[float, float]:
    """Smallest and largest coefficient of the y in `w`."""
    low0 = high0 = w[Y, 0]
    low1 = high1 = w[Y, 1]
    low2 = high2 = w[Y, 2]
    low3 = high3 = w[Y, 3]
    for k in range(4, WIDTH, 4):
        low0 = w[Y, k] if w[Y, k] < low0 else low0
        low1 = w[Y, k + 1] if w[Y, k + 1] < low1 else low1
        low2 = w[Y, k + 2] if w[Y, k + 2] < low2 else low2
        low3 = w[Y, k + 3] if w[Y, k + 3] < low3 else low3
        high0 = w[Y, k] if w[Y, k] > high0 else high0
        high1 = w[Y, k + 1] if w[Y, k + 1] > high1 else high1
        high2 = w[Y, k + 2] if w[Y, k + 2] > high2 else high2
        high3 = w[Y, k + 3] if w[Y, k + 3] > high3 else high3
    low0 = low1 if low1 < low0 else low0
    low2 = low3 if low3 < low2 else low2
    high0 = high1 if high1 > high0 else high0
    high2 = high3 if high3 > high2 else high2
    return (low2 if low2 < low0 else low0), (high2 if high2 > high0 else high0)


@kernel
def monotone(w: Array, direction: int, tolerance: float) -> bool:
    """Whether y goes in `direction` all through the step; a fall of the tolerance is none."""
    for k in range(DEGREE):  # noqa: SIM110 - a compiled loop
        if direction * (w[Y, k + 1] - w[Y, k]) < -tolerance:
            return False
    return True


@kernel
def heading(w: Array, tolerance: float) -> int:
    """Sign of the first change of y in a step that is more than round-off, or 0."""
    for k in range(DEGREE):
        rise = w[Y, k + 1] - w[Y, k]
        if abs(rise) > tolerance:
            return 1 if rise > 0.0 else -1
    return 0


@kernel
def evaluate(w: Array, row: int, s: float) -> float:
    """A polynomial of WIDTH power coefficients, as four interleaved Horner schemes."""
    s2 = s * s
    s4 = s2 * s2
    p0 = w[row, 0] + s4 * (w[row, 4] + s4 * (w[row, 8] + s4 * w[row, 12]))
    p1 = w[row, 1] + s4 * (w[row, 5] + s4 * (w[row, 9] + s4 * w[row, 13]))
    p2 = w[row, 2] + s4 * (w[row, 6] + s4 * (w[row, 10] + s4 * w[row, 14]))
    p3 = w[row, 3] + s4 * (w[row, 7] + s4 * (w[row, 11] + s4 * w[row, 15]))
    return (p0 + s * p1) + s2 * (p2 + s * p3)


@kernel
def newton(w: Array, low: float, high: float, s: float) -> float:
    """The root in (low, high) of the polynomial G, by Newton kept inside the bracket.

    Parameters
    ----------
    w
        Row G_POWER holds power coefficients: negative at `low`, positive at `high`.
    s
        First guess.

    Notes
    -----
    With steps d and D before it, Newton's next step is about d (d/D)², which is how it knows
    that it has arrived without taking that step.
    """
    for k in range(DEGREE):
        w[SLOPE, k] = (k + 1) * w[G_POWER, k + 1]
    w[SLOPE, DEGREE] = 0.0
    before = 1.0
    for _ in range(64):
        p = evaluate(w, G_POWER, s)
        d = evaluate(w, SLOPE, s)
        if p > 0.0:
            high = s
        else:
            low = s
        t = s - p / d if d > 0.0 else NEVER
        if not (low < t < high):
            t = 0.5 * (low + high)
        step = abs(t - s)
        s = t
        if step <= 4e-16 or step * step * step <= 1e-17 * before * before:
            break
        before = step
    return s


@kernel
def split(w: Array, row: int, m: int, at: float, left: int) -> None:
    """De Casteljau at a place in [0, 1]: `row` keeps what is after it, row `left` the rest."""
    for level in range(m):
        w[left, level] = w[row, 0]
        for k in range(m - 1 - level):
            w[row, k] += at * (w[row, k + 1] - w[row, k])


@kernel
def _crossing(w: Array, row: int, m: int, tolerance: float) -> tuple[int, bool, bool]:
    """First coefficient above the tolerance (m if none), and what the others say.

    Returns
    -------
    first
    at_once
        The polynomial starts at zero or above, within round-off, and rises at once.
    single
        It starts at or below zero and no coefficient after `first` is negative: it crosses once.
    """
    first = 0
    at_once = True
    while first < m and w[row, first] <= tolerance:
        if w[row, first] < -tolerance:
            at_once = False
        first += 1
    single = w[row, 0] <= 0.0
    for k in range(first + 1, m):
        if w[row, k] < 0.0:
            single = False
    return first, at_once, single


@kernel
def _guess(w: Array, row: int, m: int, first: int) -> float:
    """Where the polynomial crosses zero, from coefficient first - 1 to `first`, in [0, 1].

    Where the control polygon does, corrected by its curvature: a smooth f through the m
    coefficients, taken at equal spaces, makes the polynomial f + s (1 - s) f''/2(m - 1) + ….
    """
    if first == 0:
        return 0.5
    degree = m - 1
    before = min(w[row, first - 1], 0.0)
    rise = w[row, first] - before
    part = -before / rise
    s = (first - 1 + part) / degree
    if first < 2 or first == degree:
        return s
    bend = 0.5 * (w[row, first + 1] - w[row, first] - w[row, first - 1] + w[row, first - 2])
    better = s - 0.5 * (s * (1.0 - s) - part * (1.0 - part) / degree) * bend / rise
    return better if 0.0 < better < 1.0 else s


@kernel
def first_positive(w: Array, m: int, tolerance: float, low: float, high: float) -> float:
    """First point of [low, high] at which the polynomial G becomes positive, or `NEVER`.

    Parameters
    ----------
    w
        Row G holds its m Bernstein coefficients on [low, high], row G_POWER its power
        coefficients on [0, 1].
    tolerance
        Excursions not above it are round-off and ignored.

    Notes
    -----
    Where the signs do not settle it, the interval is halved, leftmost half first.
    """
    first, at_once, single = _crossing(w, G, m, tolerance)
    if first == m:
        return NEVER
    if at_once:
        return low
    if single:
        return newton(w, low, high, low + (high - low) * _guess(w, G, m, first))
    for k in range(m):
        w[STACK, k] = w[G, k]
    w[STACK, m] = low
    w[STACK, m + 1] = high
    top = STACK
    while top >= STACK:
        low, high = w[top, m], w[top, m + 1]
        first, at_once, single = _crossing(w, top, m, tolerance)
        if first == m:
            top -= 1
        elif at_once or top >= STACK + DEPTH:
            return low
        elif single:
            return newton(w, low, high, low + (high - low) * _guess(w, top, m, first))
        else:
            split(w, top, m, 0.5, top + 1)
            middle = 0.5 * (low + high)
            w[top, m] = middle
            w[top + 1, m] = low
            w[top + 1, m + 1] = middle
            top += 1
    return NEVER


@kernel
def first_beyond(w: Array, sign: int, edge: float, tolerance: float) -> float:
    """First place in [0, 1] at which y passes `edge` upwards (sign 1) or downwards (-1)."""
    for k in range(w.shape[1]):  # not known to the compiler, which then vectorises
        w[G, k] = sign * (w[Y, k] - edge)
        w[G_POWER, k] = sign * w[Y_POWER, k]
    w[G_POWER, 0] -= sign * edge
    return first_positive(w, WIDTH, tolerance, 0.0, 1.0)


@kernel
def first_turn(w: Array, direction: int, begin: float, tolerance: float) -> float:
    """First place in [begin, 1] at which y starts to go against `direction`, or `NEVER`."""
    for k in range(DEGREE):
        w[G, k] = -direction * (w[Y, k + 1] - w[Y, k])
        w[G_POWER, k] = -direction * (k + 1) * w[Y_POWER, k + 1] / DEGREE
    w[G_POWER, DEGREE] = 0.0
    if begin > 0.0:
        split(w, G, DEGREE, begin, LEFT)
    return first_positive(w, DEGREE, tolerance, begin, 1.0)
