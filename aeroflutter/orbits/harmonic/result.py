"""Typed results of the harmonic balance."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from aeroflutter.analysis import Result
from aeroflutter.orbits.result import Bifurcation, Branch
from aeroflutter.orbits.result import Onset as HarmonicOnset

__all__ = ["Bifurcation", "HarmonicBranch", "HarmonicOnset"]

Real = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, kw_only=True, eq=False)
class HarmonicBranch(Branch, Result):
    """A family of cycles by harmonic balance, m of them, in the order in which it was followed.

    Its number is that of the describing function's family it started from; 0 for another start.

    Attributes
    ----------
    truncation
        Estimate of the harmonics left out over the amplitude, (m,).
    margin
        Distance in pitch from a change of the sequence of the spring's switches, over the
        amplitude, (m,); near zero the multipliers are about to jump. Infinite for smooth springs.
    multiplier_error
        How far they may be off, (m,): see `Multipliers`.
    certain
        Whether the largest of those is farther from the unit circle than `multiplier_error`, and
        no switch is about to appear or vanish, (m,).
    harmonics
        Highest harmonic.
    converged
        Whether every truncation is below the tolerance.
    flutter_speed
        U*_L, or None.
    """

    truncation: Real
    margin: Real
    multiplier_error: Real
    certain: Flags
    harmonics: int
    converged: bool
    flutter_speed: float | None

    @property
    def family(self) -> int:
        """Number of the family."""
        return self.number

    @cached_property
    def speed(self) -> Real:
        """U*, (m,)."""
        return self._all("speed")

    @cached_property
    def speed_ratio(self) -> Real:
        """U*/U*_L (NaN without a flutter speed), (m,)."""
        return self._all("speed_ratio")

    @cached_property
    def omega(self) -> Real:
        """Reduced frequency, (m,)."""
        return self._all("omega")

    @cached_property
    def period(self) -> Real:
        """Period in τ, (m,)."""
        return self._all("period")

    @cached_property
    def amplitude(self) -> Real:
        """Half peak to peak, radians, (m,)."""
        return self._all("amplitude")

    @cached_property
    def bias(self) -> Real:
        """Midrange, radians, (m,)."""
        return self._all("bias")

    @cached_property
    def first_harmonic(self) -> Real:
        """Amplitude of the first harmonic, radians, (m,)."""
        return self._all("first_harmonic")

    @cached_property
    def multipliers(self) -> NDArray[np.complex128]:
        """Floquet multipliers of the period, (m, n), the trivial one first; NaN if unknown."""
        return self._all("multipliers")

    @cached_property
    def stable(self) -> Flags:
        """Whether all but the trivial one lie inside the unit circle, (m,)."""
        return self._all("stable")

    def _all(self, name: str) -> NDArray[Any]:
        return np.array([getattr(cycle, name) for cycle in self.cycles])
