"""Options of the search for limit cycles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from aeroflutter.errors import InputError
from aeroflutter.limits import within

if TYPE_CHECKING:
    from aeroflutter.orbits.cycles.measure import Frame

__all__ = ["CycleOptions"]


@dataclass(frozen=True, kw_only=True)
class CycleOptions:
    """Where to look for limit cycles, and how closely to follow them.

    Parameters
    ----------
    speed_ratio_range
        Lowest and highest speed over U*_L. Where there is no flutter speed, over the highest
        speed of the family's own range.
    largest
        Largest amplitude followed, in units of the spring's scale.
    points
        Cycles returned on every family found by itself, bifurcations aside.
    depth
        Rounds of branch switching at symmetry-breakings and period-doublings.
    simulations
        Motions, at each of sixty speeds, by which the exact engine looks for cycles that no other
        seed leads to; 0 leaves that out.
    step, max_step
        First and largest step along a family, in units of the cycle's own size.
    max_states
        Cycles after which following a family stops.
    longest
        Longest period followed, in units of the period of linear flutter.

    Raises
    ------
    InputError
        Naming every option that is out of range.
    """

    speed_ratio_range: tuple[float, float] = (0.05, 1.5)
    largest: float = 50.0
    points: int = 200
    depth: int = 2
    simulations: int = 60
    step: float = 0.02
    max_step: float = 0.12
    max_states: int = 1000
    longest: float = 100.0

    def __post_init__(self) -> None:
        problems = [
            f"{name}: must be at least {least}, not {getattr(self, name)!r}"
            for name, least in (("points", 2), ("depth", 0), ("simulations", 0), ("max_states", 10))
            if not getattr(self, name) >= least
        ]
        problems += [
            f"{name}: must be positive, not {getattr(self, name)!r}"
            for name in ("largest", "step", "max_step", "longest")
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) > 0)
        ]
        low, high = self.speed_ratio_range
        if not 0 < low < high < np.inf:
            problems.append(
                f"speed_ratio_range: needs 0 < low < high, not {self.speed_ratio_range!r}"
            )
        if problems:
            raise InputError(problems)
        within("numbers", self.points, "points")

    def limits(self, frame: Frame) -> tuple[float, float]:
        """Lowest and highest speed over the reference, within what the family covers."""
        low, high = (value / frame.reference for value in frame.loop.family.search_range)
        return max(low, self.speed_ratio_range[0]), min(high, self.speed_ratio_range[1])

    def longest_period(self, frame: Frame) -> float:
        """Longest period, τ."""
        return self.longest * frame.period
