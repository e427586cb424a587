"""Families whose matrices are polynomials of the speed, or of its inverse."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from aeroflutter.errors import InputError
from aeroflutter.model.family import Matrices
from aeroflutter.model.section import Scale
from aeroflutter.model.system import Real, System

__all__ = ["PolynomialModel", "Variable"]

Variable = Literal["V", "1/V"]


@dataclass(frozen=True, eq=False, kw_only=True)
class PolynomialModel:
    """``A(V) = Σ A_i v^i`` and likewise ``B``, with ``v = V`` or ``v = 1/V``.

    Parameters
    ----------
    A : array (p+1, n, n)
    B : array (q+1, n, m)
    C : array (m, n)
        The same at every speed; also (r+1, m, n), all but the first zero.
    variable : str
        ``"V"`` or ``"1/V"``.
    search_range : tuple of float
        Speeds (low, high) of analyses that search.
    names, units, state_names : tuple of str
        As of a :class:`~aeroflutter.model.system.System`.
    scale : Scale, optional

    Raises
    ------
    InputError
        If shapes do not fit, an entry is not finite, or the range is none.
    """

    A: Real
    B: Real
    C: Real
    variable: Variable = "1/V"
    search_range: tuple[float, float]
    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    state_names: tuple[str, ...] = ()
    scale: Scale | None = None

    def __post_init__(self) -> None:
        for name in ("A", "B", "C"):
            value = np.array(getattr(self, name), dtype=float)
            if name == "C" and value.ndim == 2:
                value = value[None]
            object.__setattr__(self, name, value)
        low, high = self.search_range
        problems = []
        if self.variable not in get_args(Variable):
            problems.append(f'variable: must be "V" or "1/V", got {self.variable!r}')
        if not (np.isfinite([low, high]).all() and 0 <= low < high):
            problems.append(f"search_range: needs 0 <= low < high, got {low!r} and {high!r}")
        elif self.variable == "1/V" and low == 0:
            problems.append("search_range: must begin above 0 for a polynomial of 1/V")
        if any(value.ndim != 3 or not len(value) for value in (self.A, self.B, self.C)):
            shapes = ", ".join(str(value.shape) for value in (self.A, self.B, self.C))
            problems.append(f"A, B, C: need one matrix a power of the speed, got shapes {shapes}")
        elif np.any(self.C[1:]):
            problems.append(
                "C: must not depend on the speed; give the matrices at several speeds instead"
            )
        if problems:
            raise InputError(problems)
        system = System(*self.stack(low), self.names, self.units, self.state_names)
        for name in ("names", "units", "state_names"):
            object.__setattr__(self, name, getattr(system, name))

    def at(self, speed: float) -> System:
        """The system at one speed.

        Raises
        ------
        InputError
            If the speed is not finite, or not positive.
        """
        if not (np.isfinite(speed) and speed >= 0 and (speed > 0 or self.variable == "V")):
            raise InputError([f"speed: must be a positive finite number, got {speed!r}"])
        return System(*self.stack(speed), self.names, self.units, self.state_names)

    def stack(self, speeds: ArrayLike) -> Matrices:
        """``A`` (…, n, n), ``B`` (…, n, m), ``C`` (…, m, n), ``d`` (…, n), speeds of any shape."""
        V = np.asarray(speeds, dtype=float)
        v = V if self.variable == "V" else 1.0 / V
        A, B, C = (_horner(terms, v) for terms in (self.A, self.B, self.C))
        return A, B, C, np.zeros(A.shape[:-1])

    def derivative(self, speeds: ArrayLike) -> Matrices:
        """Derivatives of ``stack`` with respect to the speed."""
        V = np.asarray(speeds, dtype=float)
        v = V if self.variable == "V" else 1.0 / V
        slope = np.ones_like(V) if self.variable == "V" else -(v**2)
        A, B, C = (
            _horner(np.arange(len(t))[:, None, None] * t, v, start=1) * slope[..., None, None]
            for t in (self.A, self.B, self.C)
        )
        return A, B, C, np.zeros(A.shape[:-1])


def _horner(terms: Real, v: Real, start: int = 0) -> Real:
    """``Σ terms[i] v^(i - start)`` from ``start`` on, v of any shape."""
    total = np.zeros((*v.shape, *terms.shape[1:]))
    for term in terms[start:][::-1]:
        total = total * v[..., None, None] + term
    return total
