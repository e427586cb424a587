"""Compiled: a spring's straight segments along a trigonometric polynomial, and their integrals.

The motion is y(θ) = Re Σ Y_k e^(jkθ), k = 0 … H. Its extrema are found from a sampled derivative,
every other switching instant on a leg between two extrema, where y is monotone: no crossing of a
threshold can be missed. A segment is a stretch of θ on which F = slope·y + offset; `held` is
where the memory inside the offset was made (the extremum on a flat), NaN if it does not vary.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.kernels import kernel
from aeroflutter.kernels.arrays import Complex1, Real1

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

_TURNS = 60  # bisections, if Newton's method never helps
_SMALL = 1e-11  # Newton step after which a root is exact


@kernel(entry=True)
def value(Y: Complex1, theta: float) -> tuple[float, float, float]:
    """y, y' and y'' at θ, by Horner's rule for a polynomial and its two derivatives."""
    z = complex(np.cos(theta), np.sin(theta))
    p = d = e = 0j
    for k in range(Y.size - 1, -1, -1):
        p = p * z + Y[k]
        d = d * z + k * Y[k]
        e = e * z + k * k * Y[k]
    return p.real, -d.imag, -e.real


@kernel
def _level(Y: Complex, low: float, high: float, level: float, order: int, rising: bool) -> float:
    """Where the derivative of this order (0 or 1) rises or falls to `level` between two angles."""
    x = 0.5 * (low + high)
    for _ in range(_TURNS):
        y = value(Y, x)
        if (y[order] > level) == rising:
            high = x
        else:
            low = x
        step = (y[order] - level) / y[order + 1]
        if abs(step) <= _SMALL:  # its square is below round-off
            return x - step
        x -= step
        if not low < x < high:
            x = 0.5 * (low + high)
            if high - low <= _SMALL:
                break
    return x


@kernel(entry=True)
def extrema(Y: Complex1, samples: int) -> Real:
    """Ascending angles in [0, 2π] at which y' changes sign."""
    H = Y.size - 1
    rate = np.empty(samples + 1)
    root = np.exp(2j * np.pi / samples)
    z = 1.0 + 0j
    for i in range(samples):
        d = 0j
        for k in range(H, 0, -1):
            d = (d + k * Y[k]) * z
        rate[i] = -d.imag
        z *= root
    rate[samples] = rate[0]
    found = np.empty(samples)
    count = 0
    for i in range(samples):
        if (rate[i] > 0) != (rate[i + 1] > 0):
            step = 2 * np.pi / samples
            found[count] = _level(Y, i * step, (i + 1) * step, 0.0, 1, rate[i + 1] > 0)
            count += 1
    return found[:count]


@kernel(entry=True)
def static_segments(
    Y: Complex1, turns: Real1, breaks: Real1, slopes: Real1, offsets: Real1
) -> Real:
    """Segments of a static law: rows (start, end, slope, offset, held, margin, extremum).

    `margin` is the distance of the extremum at the segment's end from the nearest break, infinite
    where the segment does not end at one; `extremum` is y there, else NaN.
    """
    out = np.empty((turns.size * (breaks.size + 2), 7))
    count = 0
    for m in range(turns.size):
        start = turns[m]
        end = turns[m + 1] if m + 1 < turns.size else turns[0] + 2 * np.pi
        y0, y1 = value(Y, start)[0], value(Y, end)[0]
        rising = y1 > y0
        piece = np.searchsorted(breaks, y0) if rising else np.searchsorted(breaks, y0, "right")
        while True:
            edge = piece if rising else piece - 1
            leaves = 0 <= edge < breaks.size and (
                breaks[edge] < y1 if rising else breaks[edge] > y1
            )
            stop = _level(Y, start, end, breaks[edge], 0, rising) if leaves else end
            out[count] = start, stop, slopes[piece], offsets[piece], np.nan, np.inf, np.nan
            if not leaves:
                if breaks.size:
                    out[count, 5] = np.min(np.abs(breaks - y1))
                out[count, 6] = y1
                count += 1
                break
            count += 1
            start = stop
            piece = piece + 1 if rising else piece - 1
    return out[:count]


@kernel(entry=True)
def loop_segments(Y: Complex1, turns: Real1, v1: float, v2: float, low: float, high: float) -> Real:
    """Segments of the hysteresis loop on its periodic memory; rows as for a static law.

    One period is run first: the memory's map over a period is a composition of clips, hence a
    clip, hence repeats itself from the second period on.
    """
    out = np.empty((turns.size * 3, 7))
    h, held = 0.5 * (low + high), np.nan
    count = 0
    for _ in range(2):
        count = 0
        held -= 2 * np.pi
        for m in range(turns.size):
            shift = 2 * np.pi if m + 1 == turns.size else 0.0
            start, end = turns[m], turns[(m + 1) % turns.size] + shift
            y0, y1 = value(Y, start)[0], value(Y, end)[0]
            rising = y1 > y0
            flat, stop = (v1, high) if rising else (v2, low)
            # the slider moves while y is past its own level, up to the stop
            slides = (y1 - flat - h > 0) == rising and h != stop and y1 != flat + h
            reaches = slides and ((y1 - flat - stop > 0) == rising)
            margin = min(abs(y1 - flat - h), abs(y1 - flat - stop))
            first = start
            if slides:
                begins = (y0 - flat - h > 0) != rising and y0 != flat + h
                first = _level(Y, start, end, flat + h, 0, rising) if begins else start
            out[count] = start, first if slides else end, 1.0, -h, held, np.inf, np.nan
            count += 1
            if slides:
                last = _level(Y, first, end, flat + stop, 0, rising) if reaches else end
                out[count] = first, last, 0.0, flat, np.nan, np.inf, np.nan
                count += 1
                if reaches:
                    h, held = stop, np.nan
                    out[count] = last, end, 1.0, -h, np.nan, np.inf, np.nan
                    count += 1
                else:
                    h, held = y1 - flat, end
            out[count - 1, 5], out[count - 1, 6] = margin, y1
    return out[:count]


@kernel(entry=True)
def series(start: Real1, end: Real1, weight: Real1, count: int) -> Complex:
    """Fourier coefficients 0 … count-1 of Σ weight over [start, end]: (1/2π) ∫ w e^(-jnθ) dθ."""
    out = np.zeros(count, dtype=np.complex128)
    for i in range(start.size):
        if weight[i] == 0.0:
            continue
        w = weight[i] / (2 * np.pi)
        out[0] += w * (end[i] - start[i])
        za = complex(np.cos(start[i]), -np.sin(start[i]))
        zb = complex(np.cos(end[i]), -np.sin(end[i]))
        ea = eb = 1.0 + 0j
        for n in range(1, count):
            ea *= za
            eb *= zb
            out[n] += w * 1j * (eb - ea) / n
    return out
