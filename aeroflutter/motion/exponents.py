"""Lyapunov exponents of a measured growth of tangents, with a stated error."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

__all__ = ["Exponents", "measured", "of_eigenvalues"]

RUNNING = 200  # points of the curve of finite-time exponents
CONFIDENCE = 0.95


@dataclass(frozen=True, kw_only=True)
class Exponents:
    """Lyapunov exponents, largest first, per unit τ.

    Attributes
    ----------
    values
        Growth over the whole stretch divided by its length, (k,).
    statistical
        Half-width of the 95 % confidence interval of the mean over the blocks, Student's t, (k,).
    drift
        Difference between the exponents of the second and the first half, (k,).
    resolution
        ln m/T after m renormalisations in the time T: neighbours that part no faster than in
        proportion to time, as on a torus with shear, look that unstable.
    blocks
        Exponents of each block, (blocks, k).
    time, running
        Finite-time exponents up to some times, (r,) and (r, k).
    """

    values: Array
    statistical: Array
    drift: Array
    resolution: float
    blocks: Array = field(repr=False)
    time: Array = field(repr=False)
    running: Array = field(repr=False)

    @property
    def error(self) -> Array:
        """The stated error: the largest of the three, (k,)."""
        largest = np.maximum(self.statistical, np.abs(self.drift))
        return np.maximum(largest, self.resolution)

    @property
    def dimension(self) -> float:
        """Kaplan and Yorke's dimension, exponents within their error taken as zero.

        NaN where more exponents would be needed.
        """
        values = np.where(np.abs(self.values) <= self.error, 0.0, self.values)
        sums = np.cumsum(values)
        below = np.flatnonzero(sums < 0.0)
        if below.size == 0:
            return float("nan")
        j = int(below[0])
        return j + float(sums[j - 1] / abs(values[j])) if j else 0.0


def measured(time: Array, logs: Array, blocks: int) -> Exponents:
    """Exponents of a growth.

    Parameters
    ----------
    time
        When the tangents were made orthonormal again, from the start of the stretch, (m,).
    logs
        Logarithms of their growth until then, (m, k).
    blocks
        Number of blocks of m // blocks renormalisations; what is left over at the end is not used.

    Notes
    -----
    With m < 2 blocks there is nothing to average and all numbers are NaN.
    """
    from scipy.special import stdtrit

    size = time.size // blocks
    k = logs.shape[1]
    if size < 2:
        nothing = np.full(k, np.nan)
        none = np.empty((0, k))
        return Exponents(
            values=nothing, statistical=nothing, drift=nothing, resolution=float("nan"),
            blocks=none, time=np.empty(0), running=none,
        )  # fmt: skip
    last = size * np.arange(1, blocks + 1) - 1
    with np.errstate(invalid="ignore"):
        begin, gains = np.insert(time[last], 0, 0.0), np.vstack((np.zeros(k), logs[last]))
        means = np.diff(gains, axis=0) / np.diff(begin)[:, None]
        spread = np.std(means, axis=0, ddof=1) / np.sqrt(blocks)
        half = blocks // 2
        first = gains[half] / begin[half]
        second = (gains[-1] - gains[half]) / (begin[-1] - begin[half])
        some = np.unique(np.linspace(0, last[-1], RUNNING).astype(int))
        return Exponents(
            values=gains[-1] / begin[-1],
            statistical=spread * stdtrit(blocks - 1, 0.5 + CONFIDENCE / 2),
            drift=second - first,
            resolution=float(np.log(last[-1] + 1) / begin[-1]),
            blocks=means,
            time=time[some],
            running=logs[some] / time[some, None],
        )


def of_eigenvalues(matrix: Array, count: int) -> Exponents:
    """Exponents of a motion that ends on one linear branch x' = A x: real parts, no error."""
    values = np.sort(np.linalg.eigvals(matrix).real)[::-1][:count]
    zero = np.zeros(values.size)
    none = np.empty((0, values.size))
    return Exponents(
        values=values, statistical=zero, drift=zero, resolution=0.0,
        blocks=none, time=np.empty(0), running=none,
    )  # fmt: skip
