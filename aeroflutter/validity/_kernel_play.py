"""Compiled: the first harmonic of a hysteresis loop's memory under sampled periodic motions."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


@njit(cache=True, nogil=True, error_model="numpy")
def memory_first_harmonic(y: Real, friction: float, play: float) -> Complex:
    """First harmonic of the memory h under motions y (m, n), n samples a period.

    h ← clip(clip(h, y - D, y + D), -δ, δ). One period is run first: from then on h repeats.
    """
    m, n = y.shape
    turn = np.exp(-2j * np.pi * np.arange(n) / n)
    out = np.zeros(m, dtype=np.complex128)
    for i in range(m):
        h = 0.0
        for _ in range(2):
            total = 0j
            for k in range(n):
                h = min(max(h, y[i, k] - friction), y[i, k] + friction)
                h = min(max(h, -play), play)
                total += h * turn[k]
        out[i] = 2.0 * total / n
    return out
