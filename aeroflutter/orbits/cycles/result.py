"""Typed results of the search for limit cycles."""

from __future__ import annotations

from dataclasses import dataclass

from aeroflutter.analysis import Result
from aeroflutter.orbits.result import Bifurcation, Cycle, Onset
from aeroflutter.orbits.result import Branch as CycleFamily
from aeroflutter.orbits.result import Onset as CycleOnset

__all__ = ["Bifurcation", "Cycle", "CycleFamily", "CycleOnset", "LimitCycles"]


@dataclass(frozen=True, kw_only=True, eq=False)
class LimitCycles(Result):
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
    onset: Onset | None
    stable_onset: Onset | None
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
