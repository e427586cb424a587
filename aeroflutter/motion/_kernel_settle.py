"""Compiled look-out on a time march: turning points of pitch, and whether they repeat."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.kernels import kernel
from aeroflutter.kernels.arrays import Real1

Array = NDArray[np.float64]

PHASES = 512  # of a cycle at which it is interpolated
FADING = 0.75  # of a difference between loops: what noise does not explain


@kernel(entry=True)
def survey(
    y: Real1, start: float, dt: float, floor: float, bound: float, times: Real1, values: Real1
) -> tuple[int, int, float, float]:
    """Turning points and extremes of uniform samples, up to the first sample beyond a bound.

    Each turning point is that of the parabola through three samples.

    Parameters
    ----------
    y
        Samples (m,), the first two of which belong to the window before.
    start, dt
        Time of the first sample and spacing.
    floor
        Steps smaller than this are round-off, not motion.
    bound
        Largest |y| allowed.
    times, values
        Filled with the turning points, which lie between the first sample and the last, (m,) each.

    Returns
    -------
    count, turns, low, high
        Samples after the first two up to one beyond the bound, that one included; turning points;
        smallest and largest of the samples within the bound.
    """
    turns, low, high = 0, np.inf, -np.inf
    before = y[1] - y[0]
    for i in range(2, y.size):
        after = y[i] - y[i - 1]
        if before * after <= 0.0 and before != 0.0 and abs(after - before) > floor:
            bend = after - before
            slope = 0.5 * (after + before)
            times[turns] = start + dt * (i - 1 - slope / bend)
            values[turns] = y[i - 1] - 0.5 * slope * (slope / bend)
            turns += 1
        if not abs(y[i]) <= bound:
            return i - 1, turns, low, high
        low = y[i] if y[i] < low else low
        high = y[i] if y[i] > high else high
        before = after
    return y.size - 2, turns, low, high


@kernel(entry=True)
def fundamental(y: Real1, period: float) -> float:
    """Amplitude of the fundamental of the last period of uniform samples.

    Parameters
    ----------
    y
        Samples (m,), interpolated by cubics.
    period
        In samples.

    Returns
    -------
    float
        NaN if the samples do not cover a period.
    """
    last = y.size - 3
    if not last - period >= 1.0:
        return np.nan
    total = 0.0j
    for k in range(PHASES):
        at = last - period * k / PHASES
        i = int(at)
        f = at - i
        value = (
            -f * (f - 1.0) * (f - 2.0) / 6.0 * y[i - 1]
            + (f + 1.0) * (f - 1.0) * (f - 2.0) / 2.0 * y[i]
            - (f + 1.0) * f * (f - 2.0) / 2.0 * y[i + 1]
            + (f + 1.0) * f * (f - 1.0) / 6.0 * y[i + 2]
        )
        angle = 2.0 * np.pi * k / PHASES
        total += value * complex(np.cos(angle), np.sin(angle))
    return 2.0 * abs(total) / PHASES


@kernel
def mismatch(times: Real1, values: Real1, loops: int, span: int) -> tuple[float, float]:
    """How far the last `span` turning points are from those `loops` oscillations before.

    Returns
    -------
    value, time
        Largest difference in value, and largest deviation of the time between the two from its
        mean, as a fraction of it.
    """
    n, lag = times.size, 2 * loops
    worst, mean = 0.0, 0.0
    for k in range(n - span, n):
        worst = max(worst, abs(values[k] - values[k - lag]))
        mean += (times[k] - times[k - lag]) / span
    spread = 0.0
    for k in range(n - span, n):
        spread = max(spread, abs(times[k] - times[k - lag] - mean))
    return worst, spread / mean


@kernel
def block_sizes(values: Array, unit: float, loops: int, periods: int) -> tuple[Array, float]:
    """Mean peak-to-peak a period over the last three blocks of `periods`, the newest last.

    Sizes are in multiples of `unit`, so that squares of a huge motion do not overflow.

    Returns
    -------
    sizes, scatter
        Means (3,), and standard deviation of a period's size about the newest mean.
    """
    lag = 2 * loops
    sizes = np.zeros(3)
    scatter = 0.0
    for block in range(3):
        squares = 0.0
        for period in range(periods):
            end = values.size - lag * ((2 - block) * periods + period)
            size = (np.max(values[end - lag : end]) - np.min(values[end - lag : end])) / unit
            sizes[block] += size / periods
            squares += size * size / periods
        scatter = np.sqrt(max(squares - sizes[block] * sizes[block], 0.0))
    return sizes, scatter


@kernel
def approaches_fewer(times: Array, values: Array, loops: int, span: int, ago: int) -> bool:
    """Whether a motion of `loops` oscillations is on its way to one of a divisor of them.

    Near a cycle with a negative multiplier the motion alternates about it, and comes back after
    two loops long before it does after one; but what sets the loops apart dies out. `ago` is the
    number of turning points between the two looks at it.
    """
    n = times.size
    for fewer in range(1, loops):
        if loops % fewer:
            continue
        if n < ago + span + 2 * fewer:
            return True
        new, _ = mismatch(times, values, fewer, span)
        old, _ = mismatch(times[: n - ago], values[: n - ago], fewer, span)
        if new < FADING * old:
            return True
    return False


@kernel(entry=True)
def repeats(
    times: Real1, values: Real1, most: int, recurrence: float, drift: float
) -> tuple[int, float]:
    """Smallest number of loops after which the motion repeats, and what it may still change by.

    Parameters
    ----------
    times, values
        Turning points, alternately maxima and minima, the newest last.
    most
        Largest number of loops tried.
    recurrence
        Largest mismatch between periods, as a fraction of the amplitude.
    drift
        Largest change of amplitude still to come, as a fraction of it. It is extrapolated
        geometrically from three blocks of periods, so a motion that only lingers (near a fold,
        say) is not taken for settled.

    Returns
    -------
    loops, remaining
        0 loops if the motion does not repeat (yet); `remaining` is the extrapolated change.
    """
    n = values.size
    for loops in range(1, most + 1):
        span = max(16, 4 * loops)
        periods = max(3, 8 // loops)
        if n < max(span + 2 * loops, 6 * loops * periods):
            return 0, np.inf
        tail = values[n - span :]
        amplitude = 0.5 * (np.max(tail) - np.min(tail))
        error, spread = mismatch(times, values, loops, span)
        if not (error <= recurrence * amplitude < np.inf and spread <= recurrence):
            continue
        if approaches_fewer(times, values, loops, span, 4 * loops * periods):
            return 0, np.inf
        sizes, scatter = block_sizes(values, amplitude, loops, periods)
        new = abs(sizes[2] - sizes[1])
        old = abs(sizes[1] - sizes[0])
        noise = 3.0 * scatter / np.sqrt(periods) + 1e-12
        remaining = new
        if new > noise:
            remaining = new * new / (old - new) if new < old else np.inf
        return (loops if remaining <= 2.0 * drift else 0), 0.5 * remaining * amplitude
    return 0, np.inf
