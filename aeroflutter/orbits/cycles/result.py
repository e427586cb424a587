"""Typed results of the search for limit cycles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Bifurcation", "Cycle", "CycleFamily", "CycleOnset", "LimitCycles"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, kw_only=True, eq=False)
class Cycle:
    """One limit cycle, stable or not.

    Attributes
    ----------
    speed, speed_ratio
        U* and U*/U*_L (NaN without a flutter speed).
    amplitude, bias, first_harmonic
        Half the peak-to-peak and midrange of y over a period, amplitude of its fundamental; rad.
    period
        Period of the whole motion, τ.
    multipliers
        Floquet multipliers of the whole period, (n,); the first is the trivial one.
    stable
        Whether all but the trivial one (and the one along a continuum of bias) are inside the
        unit circle.
    symmetric
        Whether the second half of the period mirrors the first.
    continuum
        Whether it is one of a continuum that differs in bias only; another multiplier is then one.
    state, memory
        A point on the cycle, (n,), and the spring's memory there.
    closure
        Largest difference between that point and where the exact flow brings it after one period,
        in units of each state's own size.
    switches
        Number of switches of the spring a period.
    family
        Number of its family.
    """

    speed: float
    speed_ratio: float
    amplitude: float
    bias: float
    first_harmonic: float
    period: float
    multipliers: Complex
    stable: bool
    symmetric: bool
    continuum: bool
    state: Array
    memory: float
    closure: float
    switches: int
    family: int = 0

    @property
    def k(self) -> float:
        """Reduced frequency."""
        return 2 * np.pi / self.period


@dataclass(frozen=True, kw_only=True, eq=False)
class Bifurcation:
    """A located event on a family.

    Attributes
    ----------
    kind
        "fold", "corner" (a fold where the curve has a kink), "symmetry-breaking",
        "period-doubling", "neimark-sacker" or "grazing" (the sequence of switches changes).
    cycle
        The cycle there.
    stable_beside
        Whether the cycles just before and after it along the family are stable.
    """

    kind: str
    cycle: Cycle
    stable_beside: tuple[bool, bool]


@dataclass(frozen=True, kw_only=True, eq=False)
class CycleOnset:
    """The lowest cycle, or lowest stable cycle.

    Attributes
    ----------
    cycle
        The cycle.
    kind
        Kind of the bifurcation there, or "edge" where the family ends.
    stable
        Whether there are stable cycles beside it.
    """

    cycle: Cycle
    kind: str
    stable: bool


@dataclass(frozen=True, kw_only=True, eq=False)
class CycleFamily:
    """One branch of cycles, in the order in which it was followed.

    Attributes
    ----------
    number
        From 1.
    origin
        Where its first cycle came from.
    symmetric
        Whether its cycles are.
    parent
        Number of the family that it bifurcates from; None if it was found by itself.
    cycles
        Its cycles, bifurcations included.
    bifurcations
        What was located on it, in order.
    stopped
        Why it ends, at its first and at its last cycle.
    closed
        Whether it is a closed loop.
    onset, stable_onset
        Its lowest cycle, and its lowest stable one (None if there is none).
    """

    number: int
    origin: str
    symmetric: bool
    parent: int | None
    cycles: tuple[Cycle, ...]
    bifurcations: tuple[Bifurcation, ...]
    stopped: tuple[str, str]
    closed: bool
    onset: CycleOnset
    stable_onset: CycleOnset | None


@dataclass(frozen=True, kw_only=True, eq=False)
class LimitCycles:
    """Amplitude against speed, exactly.

    Attributes
    ----------
    families
        Every family of cycles found.
    flutter_speed
        U*_L, or None if there is none in the family's range.
    onset, stable_onset
        The lowest cycle of all, and the lowest stable one; None where there is none.
    speed_range
        Speeds U* over which cycles were followed.
    odd
        Whether the loop is odd, about its centre: the mirror image of every cycle is one, too.
    notes
        What a reader should know: seeds that led nowhere, why there are no cycles.
    """

    families: tuple[CycleFamily, ...]
    flutter_speed: float | None
    onset: CycleOnset | None
    stable_onset: CycleOnset | None
    speed_range: tuple[float, float]
    odd: bool
    notes: tuple[str, ...] = ()

    @property
    def cycles(self) -> tuple[Cycle, ...]:
        """The cycles of all families, family by family."""
        return tuple(cycle for family in self.families for cycle in family.cycles)

    @property
    def bifurcations(self) -> tuple[Bifurcation, ...]:
        """The bifurcations of all families, family by family."""
        return tuple(event for family in self.families for event in family.bifurcations)
