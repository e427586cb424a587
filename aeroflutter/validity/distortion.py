"""The distortion as a measure of belief, calibrated against converged cycles.

Where no bound holds, the predicted distortion d (harmonics 2 … 9 of the motion over its amplitude)
still tells how far the describing function may be off. `benchmarks/bench_validity.py` compares it
with converged cycles of random sections and springs and fits

    |U_DF - U|/U < c d^γ     for 95 % of the cycles,

U being the speed of the cycle with the same first harmonic. A point is called doubtful where that
limit exceeds one per cent.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["DOUBTFUL", "expected_error"]

COEFFICIENT, EXPONENT = 1.0, 1.5
DOUBTFUL = 0.01


def expected_error(distortion: ArrayLike) -> NDArray[np.float64]:
    """Relative error of the speed that 95 % of cycles with this distortion stay below."""
    return np.asarray(COEFFICIENT * np.asarray(distortion, dtype=float) ** EXPONENT)
