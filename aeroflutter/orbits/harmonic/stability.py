"""Stability along a branch, and the test functions that locate its bifurcations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.model.lure import inverse_transfer
from aeroflutter.orbits.continuation import Event, Test
from aeroflutter.orbits.harmonic.balance import Balance
from aeroflutter.orbits.harmonic.hill import Multipliers, multipliers
from aeroflutter.springs import Hysteresis

__all__ = ["Stability"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

_FREE = 1e-12  # 1/G(0) below this: any mean is held without a moment
_BELIEVABLE = 0.05  # error of the multipliers above which an event is not reported

FLIP, TORUS = "flip", "torus"


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
        A, b = balance.family.stack(np.geomspace(*balance.family.search_range, 3))
        load = inverse_transfer(A, b, balance.family.c, np.zeros(3))
        self._free_mean = bool(np.all(np.abs(load) < _FREE))

    def at(self, x: Real) -> Multipliers:
        """Multipliers of the cycle of unknowns x."""
        key = x.tobytes()
        if key not in self._known:
            cycle, answer = self.balance.unpack(x), self.balance.answer(x)
            self._known[key] = multipliers(
                self.balance.family, cycle, answer, self.balance.symmetric
            )
        return self._known[key]

    def continuum(self, x: Real) -> bool:
        """Whether the cycle is one of many that differ in their mean only.

        A loop that never meets its stops remembers nothing of its place between them; if the
        linear system holds any mean without moment either, a multiplier is one.
        """
        spring = self.balance.spring
        if not (self._free_mean and isinstance(spring, Hysteresis)):
            return False
        low, high = self.balance.answer(x).extremes
        return high < spring.v1 + spring.h_high and low > spring.v2 + spring.h_low

    def proper(self, x: Real) -> Complex:
        """Multipliers (`Multipliers.basic`) that say something: neither trivial nor neutral."""
        others = self.at(x).basic[1:]
        if not self.continuum(x):
            return others
        sign = -1.0 if self.balance.symmetric else 1.0
        return np.delete(others, np.argmin(np.abs(others - sign)))

    def stable(self, x: Real) -> bool:
        """Whether all of those lie inside the unit circle."""
        return bool(np.all(np.abs(self.proper(x)) < 1))

    def distance(self, x: Real) -> float:
        """Distance of the nearest of those from the unit circle."""
        return float(np.min(np.abs(np.abs(self.proper(x)) - 1), initial=np.inf))

    def tests(self) -> dict[str, Test]:
        """Functions that vanish at bifurcations.

        For symmetric cycles the multipliers ν are those of the half-period map: ν = -1 breaks the
        symmetry. For others ν = -1 doubles the period.
        """

        def flip(x: Real, _: Real) -> float:
            return _compressed(float(np.prod(1 + self.proper(x)).real))

        def torus(x: Real, _: Real) -> float:
            nu = self.proper(x)
            i, j = np.triu_indices(nu.size, 1)
            return _compressed(float(np.prod(1 - nu[i] * nu[j]).real))

        return {FLIP: flip, TORUS: torus}

    def kind(self, event: Event) -> str | None:
        """What bifurcation an event of the tests is; None if it is none."""
        found = self.at(event.x)
        if found.error > _BELIEVABLE:
            return None
        if event.jump:
            return "grazing"
        nu = self.proper(event.x)
        if event.name == FLIP:
            return "symmetry-breaking" if self.balance.symmetric else "period-doubling"
        # two real multipliers whose product is one are no bifurcation
        complex_pair = nu[np.abs(nu.imag) > 1e-6 * np.maximum(1.0, np.abs(nu))]
        on_circle = complex_pair.size and np.min(np.abs(np.abs(complex_pair) - 1)) < 1e-4
        return "neimark-sacker" if on_circle else None


def _compressed(value: float) -> float:
    """The value without its decades, which a bracketing search would lose digits to."""
    return float(np.arcsinh(value))
