"""Typed results of the harmonic balance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aeroflutter.orbits.harmonic.balance import Cycle

__all__ = ["Bifurcation", "HarmonicBranch", "HarmonicOnset"]

Real = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, kw_only=True, eq=False)
class Bifurcation:
    """A located event on a branch.

    Attributes
    ----------
    kind
        "fold", "corner" (the slider turns back exactly at a stop: the equations have a kink),
        "symmetry-breaking", "period-doubling", "neimark-sacker", or "grazing" where the
        multipliers jump across the unit circle.
    cycle
        The cycle there.
    speed_ratio, amplitude, bias
        Its U*/U*_L (NaN without a flutter speed), half peak to peak and midrange (radians).
    index
        Position in the branch's arrays before which it lies.
    """

    kind: str
    cycle: Cycle
    speed_ratio: float
    amplitude: float
    bias: float
    index: int


@dataclass(frozen=True, kw_only=True, eq=False)
class HarmonicOnset:
    """The cycle of lowest speed.

    Attributes
    ----------
    kind
        "fold", "corner" or "edge" (the branch ends there, or the stable part of it).
    cycle, speed_ratio, amplitude
        The cycle, its U*/U*_L, and half its peak to peak (radians).
    stable
        Whether there are stable cycles beside it; None where stability was not computed.
    """

    kind: str
    cycle: Cycle
    speed_ratio: float
    amplitude: float
    stable: bool | None


@dataclass(frozen=True, kw_only=True, eq=False)
class HarmonicBranch:
    """A family of cycles by harmonic balance, in the order in which it was followed.

    Attributes
    ----------
    cycles
        The cycles, m of them, with all their harmonics.
    speed, speed_ratio, omega, period
        U*, U*/U*_L (NaN without a flutter speed), reduced frequency and period in τ, (m,).
    amplitude, bias, first_harmonic
        Half peak to peak, midrange and amplitude of the first harmonic, radians, (m,).
    truncation
        Estimate of the harmonics left out over the amplitude, (m,).
    margin
        Distance in pitch from a change of the sequence of the spring's switches, over the
        amplitude, (m,); near zero the multipliers are about to jump. Infinite for smooth springs.
    multipliers
        Floquet multipliers of the period, (m, n), the trivial one first; NaN if not computed.
    multiplier_error
        How far they may be off, (m,): see `Multipliers`.
    stable
        Whether all but the trivial one lie inside the unit circle, (m,).
    certain
        Whether the largest of those is farther from the unit circle than `multiplier_error`, and
        no switch is about to appear or vanish, (m,).
    symmetric
        Whether the cycles are half-wave symmetric.
    harmonics
        Highest harmonic.
    converged
        Whether every truncation is below the tolerance.
    bifurcations
        Located events, in order.
    onset, stable_onset
        Cycle of lowest speed, and of lowest speed among the stable ones (None if there is none).
    flutter_speed
        U*_L, or None.
    stops, closed
        Why the branch ends at either side; whether it is a closed loop.
    family
        Number of the describing function's family it started from; 0 for another start.
    """

    cycles: tuple[Cycle, ...]
    speed: Real
    speed_ratio: Real
    omega: Real
    period: Real
    amplitude: Real
    bias: Real
    first_harmonic: Real
    truncation: Real
    margin: Real
    multipliers: NDArray[np.complex128]
    multiplier_error: Real
    stable: Flags
    certain: Flags
    symmetric: bool
    harmonics: int
    converged: bool
    bifurcations: tuple[Bifurcation, ...]
    onset: HarmonicOnset
    stable_onset: HarmonicOnset | None
    flutter_speed: float | None
    stops: tuple[str, str]
    closed: bool
    family: int = 0
