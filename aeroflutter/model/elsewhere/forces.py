"""Aerodynamic forces tabulated over reduced frequency, and what is between and beyond."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from aeroflutter.errors import InputError
from aeroflutter.model.system import Complex, Real

__all__ = ["TabulatedForces"]

_NEGLIGIBLE = 1e-12  # of the largest force: written by a solver as zero


@dataclass(frozen=True, eq=False)
class TabulatedForces:
    """Generalised aerodynamic forces over reduced frequency.

    Parameters
    ----------
    k : array (p,)
        Reduced frequencies ``omega b/V``, strictly increasing, not negative.
    Q : complex array (p, n, n)
        Forces ``½ rho V² Q q`` of harmonic motion of the coordinates ``q``, for the sign of
        ``exp(i omega t)``. What is smaller than 1e-12 of the largest is taken for zero.

    Raises
    ------
    InputError
        If shapes do not fit, an entry is not finite, or ``k`` does not increase.
    """

    k: Real
    Q: Complex

    def __post_init__(self) -> None:
        k, Q = np.atleast_1d(np.array(self.k, dtype=float)), np.array(self.Q, dtype=complex)
        problems = []
        if Q.ndim != 3 or Q.shape[1] != Q.shape[2] or k.shape != Q.shape[:1] or k.size < 2:
            problems.append(
                f"k, Q: need shapes (p,) and (p, n, n), p at least 2, got {k.shape} and {Q.shape}"
            )
        if not np.all(np.isfinite(k)) or np.any(k < 0) or np.any(np.diff(k) <= 0):
            problems.append("k: must be finite, not negative and strictly increasing")
        if not np.all(np.isfinite(Q)):
            problems.append("Q: every entry must be finite")
        elif not np.any(Q):
            problems.append("Q: must not be zero everywhere")
        if problems:
            raise InputError(problems)
        size = np.abs(Q).max(axis=0)
        Q[:, size < _NEGLIGIBLE * size.max()] = 0.0
        object.__setattr__(self, "k", k)
        object.__setattr__(self, "Q", Q)

    @property
    def modes(self) -> int:
        """Number of coordinates."""
        return int(self.Q.shape[1])

    @cached_property
    def _splines(self) -> tuple[Any, Any]:
        from scipy.interpolate import make_interp_spline

        mirrored = slice(None, 0 if self.k[0] == 0 else None, -1)
        both = np.concatenate([-self.k[mirrored], self.k])
        values = np.concatenate([self.Q[mirrored].conj(), self.Q])
        values[both == 0] = values[both == 0].real
        degree = min(3, both.size - 1)
        spline = make_interp_spline(both, values, k=degree - (degree + 1) % 2)
        return spline, spline.derivative()

    def at(self, k: ArrayLike) -> Complex:
        """``Q`` (…, n, n) at any reduced frequencies.

        Notes
        -----
        Between those of the table real parts are splined as even and imaginary parts as odd
        functions. Above it the real part grows as ``k²``, a mass of air, and the imaginary part
        as ``k``, a damping.
        """
        chosen = np.asarray(k, dtype=float)
        value = self._splines[0](np.minimum(chosen, self.k[-1]))
        over = np.maximum(chosen / self.k[-1], 1.0)[..., None, None]
        beyond: Complex = value.real * over**2 + 1j * value.imag * over
        return beyond

    def slope(self, k: float) -> Complex:
        """``dQ/dk`` (n, n) at one reduced frequency."""
        top = float(self.k[-1])
        if k <= top:
            inside: Complex = self._splines[1](k)
            return inside
        last = self._splines[0](top)
        beyond: Complex = 2.0 * last.real * k / top**2 + 1j * last.imag / top
        return beyond
