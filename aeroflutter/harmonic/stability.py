"""Stability along a branch, and the test functions that locate its bifurcations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.continuation import Event, Test
from aeroflutter.harmonic.balance import Balance
from aeroflutter.harmonic.hill import Multipliers, multipliers

__all__ = ["Stability"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

_NEUTRAL = 1e-6  # this close to one, or within its error, it belongs to a continuum of cycles
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

    def at(self, x: Real) -> Multipliers:
        """Multipliers of the cycle of unknowns x."""
        key = x.tobytes()
        if key not in self._known:
            cycle, answer = self.balance.unpack(x), self.balance.answer(x)
            self._known[key] = multipliers(
                self.balance.family, cycle, answer, self.balance.symmetric
            )
        return self._known[key]

    def tests(self) -> dict[str, Test]:
        """Functions that vanish at bifurcations.

        For symmetric cycles the multipliers ν are those of the half-period map: ν = -1 breaks the
        symmetry. For others ν = -1 doubles the period.
        """

        def flip(x: Real, _: Real) -> float:
            return _compressed(np.prod(1 + self.at(x).basic[1:]).real)

        def torus(x: Real, _: Real) -> float:
            nu = self.at(x).basic[1:]
            i, j = np.triu_indices(nu.size, 1)
            return _compressed(np.prod(1 - nu[i] * nu[j]).real)

        return {FLIP: flip, TORUS: torus}

    def kind(self, event: Event) -> str | None:
        """What bifurcation an event of the tests is; None if it is none."""
        found = self.at(event.x)
        if found.error > _BELIEVABLE:
            return None
        if event.jump:
            return "grazing"
        nu = found.basic[1:]
        if event.name == FLIP:
            return "symmetry-breaking" if self.balance.symmetric else "period-doubling"
        # two real multipliers whose product is one are no bifurcation
        complex_pair = nu[np.abs(nu.imag) > 1e-6 * np.maximum(1.0, np.abs(nu))]
        on_circle = complex_pair.size and np.min(np.abs(np.abs(complex_pair) - 1)) < 1e-4
        return "neimark-sacker" if on_circle else None


def stable(found: Multipliers) -> bool:
    """Whether every multiplier but the trivial and neutral ones lies inside the unit circle."""
    return bool(np.all(np.abs(_proper(found)) < 1))


def distance(found: Multipliers) -> float:
    """Distance of the nearest multiplier, trivial and neutral ones left out, from the circle."""
    return float(np.min(np.abs(np.abs(_proper(found)) - 1), initial=np.inf))


def _proper(found: Multipliers) -> Complex:
    """Multipliers that say something of stability."""
    others = found.all[1:]
    return others[np.abs(others - 1) > max(_NEUTRAL, found.error)]


def _compressed(value: float) -> float:
    """The value without its decades, which a bracketing search would lose digits to."""
    return float(np.arcsinh(value))
