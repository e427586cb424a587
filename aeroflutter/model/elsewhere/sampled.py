"""A family splined through state spaces at several speeds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from aeroflutter.errors import InputError
from aeroflutter.model.family import ROUND_OFF, Matrices
from aeroflutter.model.section import Scale
from aeroflutter.model.system import Real, System

__all__ = ["SplinedModel"]


@dataclass(frozen=True, eq=False)
class SplinedModel:
    """``A`` and ``B`` at several speeds and splined between them.

    Parameters
    ----------
    speeds : sequence of float
        Strictly increasing, at least two.
    A : array (k, n, n)
    B : array (k, n, m)
    C : array (k, m, n)
        The same at every speed; :func:`~aeroflutter.model.elsewhere.tracked.outputs_first` makes
        it so.
    names, units, state_names : tuple of str
        As of a :class:`~aeroflutter.model.system.System`.
    scale : Scale, optional

    Raises
    ------
    InputError
        If the speeds do not increase, shapes do not fit, or ``C`` changes.

    Notes
    -----
    :class:`~aeroflutter.model.family.SampledModel` is the same for systems with the same ``C`` at
    every speed, constant loads included.
    """

    speeds: Sequence[float]
    A: Real
    B: Real
    C: Real
    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    state_names: tuple[str, ...] = ()
    scale: Scale | None = None

    def __post_init__(self) -> None:
        from scipy.interpolate import make_interp_spline

        speeds = np.array(self.speeds, dtype=float)
        if speeds.ndim != 1 or speeds.size < 2 or speeds.size != len(self.A):
            raise InputError(["speeds: need one speed a system, at least two"])
        if not (np.all(np.isfinite(speeds)) and np.all(np.diff(speeds) > 0)):
            raise InputError(["speeds: must be finite and strictly increasing"])
        if np.any(np.asarray(self.C) != self.C[0]):
            raise InputError(["C: must be the same at every speed; see outputs_first"])
        system = System(
            self.A[0], self.B[0], self.C[0], None, self.names, self.units, self.state_names
        )
        for name in ("names", "units", "state_names"):
            object.__setattr__(self, name, getattr(system, name))
        degree = min(3, speeds.size - 1)
        splines = [make_interp_spline(speeds, part, k=degree) for part in (self.A, self.B)]
        object.__setattr__(self, "_splines", splines)
        object.__setattr__(self, "_slopes", [spline.derivative() for spline in splines])

    @property
    def search_range(self) -> tuple[float, float]:
        """First and last of the given speeds."""
        return float(self.speeds[0]), float(self.speeds[-1])

    def at(self, speed: float) -> System:
        """The interpolated system at one speed.

        Raises
        ------
        InputError
            If the speed lies outside the samples.
        """
        low, high = self.search_range
        within = min(max(speed, low), high)
        if not abs(speed - within) <= ROUND_OFF * abs(within):  # exp(log(5)) is more than five
            raise InputError([f"speed: must lie between {low:g} and {high:g}, got {speed!r}"])
        return System(*self.stack(within), self.names, self.units, self.state_names)

    def stack(self, speeds: ArrayLike) -> Matrices:
        """``A`` (…, n, n), ``B`` (…, n, m), ``C`` (…, m, n), ``d`` (…, n), speeds of any shape."""
        at = np.asarray(speeds, dtype=float)
        A, B = (spline(at) for spline in self._splines)  # type: ignore[attr-defined]
        C = np.asarray(self.C)[0]
        return A, B, np.broadcast_to(C, (*at.shape, *C.shape)), np.zeros(A.shape[:-1])

    def derivative(self, speeds: ArrayLike) -> Matrices:
        """Derivatives of ``stack`` with respect to the speed."""
        at = np.asarray(speeds, dtype=float)
        A, B = (slope(at) for slope in self._slopes)  # type: ignore[attr-defined]
        return A, B, np.zeros((*at.shape, *self.C.shape[1:])), np.zeros(A.shape[:-1])
