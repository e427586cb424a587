"""Stability along a branch of the harmonic balance."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.model.lure import integrators
from aeroflutter.orbits.continuation import Event
from aeroflutter.orbits.harmonic.balance import Balance
from aeroflutter.orbits.harmonic.monodromy import Multipliers, multipliers
from aeroflutter.orbits.spectrum import Spectrum, bifurcation
from aeroflutter.springs import Hysteresis

__all__ = ["Stability"]

Real = NDArray[np.float64]

_BELIEVABLE = 0.05  # error of the multipliers above which an event is not reported


class Stability:
    """Multipliers of the states of a branch, each computed once.

    Parameters
    ----------
    balance
        The equations of the branch.
    """

    def __init__(self, balance: Balance) -> None:
        self.balance = balance
        self._known: dict[bytes, Multipliers] = {}
        self._integrates = integrators(balance.family)

    def at(self, x: Real) -> Multipliers:
        """Multipliers of the cycle of unknowns x."""
        key = x.tobytes()
        if key not in self._known:
            cycle, answers = self.balance.unpack(x), self.balance.answers(x)
            self._known[key] = multipliers(
                self.balance.family, cycle, answers, self.balance.symmetric
            )
        return self._known[key]

    def continuum(self, x: Real) -> bool:
        """Whether the cycle is one of many that differ in their mean only.

        A loop that never meets its stops remembers nothing of its place between them; if the
        linear system holds any mean without moment either, a multiplier is one.
        """
        alone = len(self.balance.springs) == 1
        for i, spring in enumerate(self.balance.springs):
            if not (self._integrates[i] and isinstance(spring, Hysteresis)):
                continue
            low, high = self.balance.answers(x)[i].extremes
            slides = alone or high - low > spring.delta_v
            if slides and high < spring.v1 + spring.h_high and low > spring.v2 + spring.h_low:
                return True
        return False

    def spectrum(self, x: Real) -> Spectrum:
        """The same, told apart by what they mean."""
        trivial, *others = self.at(x).basic
        return Spectrum.of(
            trivial, np.array(others), symmetric=self.balance.symmetric, free=self.continuum(x)
        )

    def kind(self, event: Event) -> str:
        """What bifurcation an event of the tests is; empty if it is none."""
        if self.at(event.x).error > _BELIEVABLE:
            return ""
        return "grazing" if event.jump else bifurcation(event.name, self.spectrum(event.x))
