"""1/G at the odd harmonics, for many speeds and frequencies, and beyond the last one by a bound."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aeroflutter.model.lure import LureFamily

__all__ = ["LoopSamples", "highest_harmonic", "sample_loop"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

_LEAST, _MOST = 63, 1023
_BEYOND = 3.0  # the tail bound is used from this many times the norm of A on


@dataclass(frozen=True, eq=False)
class LoopSamples:
    """The loop at m pairs of speed and frequency.

    Attributes
    ----------
    Z
        1/G(jkω) for k = 1, 3, … K, shape (m, n).
    tail
        Bound on |G(jkω)| for k = K + 2, shape (m,); beyond, it falls with the power `decay` of k.
    decay
        2 where c b = 0, else 1.
    """

    Z: Complex
    tail: Real
    decay: int

    @property
    def ks(self) -> NDArray[np.intp]:
        """The odd harmonics 1, 3, … K."""
        return 2 * np.arange(self.Z.shape[1]) + 1


def highest_harmonic(family: LureFamily, speed: Real, omega: Real) -> int:
    """K: odd, and high enough for the tail bound at these speeds and frequencies."""
    A, _ = family.stack(speed)
    size = float(np.max(np.linalg.norm(A, 2, axis=(-2, -1)) / omega))
    return int(min(_MOST, max(_LEAST, np.ceil(_BEYOND * size)))) | 1


def sample_loop(family: LureFamily, speed: Real, omega: Real, highest: int) -> LoopSamples:
    """1/G at the odd harmonics up to `highest` of m pairs of speed and frequency.

    By partial fractions of H = G/(1 + G), since G itself may have a double pole at zero:
    1/G = 1/H - 1.
    """
    A, b = family.stack(speed)
    c = family.c
    poles, right = np.linalg.eig(A - b[:, :, None] * c)
    residues = (c @ right) * np.linalg.solve(right, b[:, :, None].astype(complex))[..., 0]
    s = 1j * omega[:, None] * (2 * np.arange((highest + 1) // 2) + 1)
    H = np.sum(residues[:, None, :] / (s[:, :, None] - poles[:, None, :]), axis=-1)
    return LoopSamples(1 / H - 1, _tail(A, b, c, omega * (highest + 2)), _decay(b, c))


def _decay(b: Real, c: Real) -> int:
    return 2 if np.all(np.abs(b @ c) <= 1e-13 * np.linalg.norm(b, axis=-1)) else 1


def _tail(A: Real, b: Real, c: Real, nu: Real) -> Real:
    """Bound on |G(jν)|: G = cb/s + cAb/s² + cA²(sI - A)⁻¹b/s², the resolvent by ‖A‖; inf below."""
    size = np.linalg.norm(A, 2, axis=(-2, -1))
    cA = c @ A
    first = np.abs(b @ c) if _decay(b, c) == 1 else np.zeros(nu.shape)
    second = np.abs(np.sum(cA * b, axis=-1))
    third = np.linalg.norm((cA[:, None, :] @ A)[:, 0], axis=-1) * np.linalg.norm(b, axis=-1)
    with np.errstate(divide="ignore"):
        bound = first / nu + (second + third / np.maximum(nu - size, 0)) / nu**2
    return np.where(nu > size, bound, np.inf)
