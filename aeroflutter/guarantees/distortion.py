"""The distortion as a measure of belief, calibrated against converged cycles.

Where no bound holds, the predicted distortion d (harmonics 2 … 9 of the motion over its amplitude)
still tells how far the describing function may be off. `benchmarks/bench_validity.py` compares it
with converged cycles of random sections and springs at which no bound holds, and finds

- c and γ of |U_DF - U|/U < c d^γ for 95 % of them, U being the speed of the cycle with the same
  first harmonic;
- the distortion from which a describing function is called doubtful, such that as many of those
  that are off by more than one per cent are missed as others are doubted without need.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["doubtful", "expected_error"]

COEFFICIENT, EXPONENT = 0.83, 0.86
THRESHOLD = 0.077


def expected_error(distortion: ArrayLike) -> NDArray[np.float64]:
    """Relative error of the speed that 95 % of cycles with this distortion stay below."""
    return np.asarray(COEFFICIENT * np.asarray(distortion, dtype=float) ** EXPONENT)


def doubtful(distortion: ArrayLike) -> NDArray[np.bool_]:
    """Whether the speed is likely to be off by more than one per cent."""
    return np.asarray(np.asarray(distortion, dtype=float) > THRESHOLD)
