"""Folds, corners and ends of a family, and the lowest (stable) cycle on it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.orbits.describing.balance import AMPLITUDE, SPEED
from aeroflutter.orbits.describing.families import Family
from aeroflutter.orbits.describing.result import CycleFamily, Onset
from aeroflutter.orbits.describing.stability import stability

__all__ = ["family_facts"]

Array = NDArray[np.float64]

_BESIDE = 1e-3  # arclength at which "beside" is
_END = 1e-7  # arclength within which an extremum is an end of the family
_VERTICAL = 1e-9  # speed component of a tangent that is round-off: the family is linear there
_BISECTIONS = 32


def family_facts(
    family: Family, number: int, flutter: float | None, count: int
) -> tuple[CycleFamily, Array]:
    """What is known of a traced family, and `count` cycles along it (besides the marked ones)."""
    facts = _Facts(family, number, flutter, count)
    known = CycleFamily(
        number=number,
        biased=family.balance.biased,
        mirror_of=None,
        ends=family.ends(),
        closed=family.branch.closed,
        onset=facts.onset(),
        stable_onset=facts.stable_onset(),
        folds=facts.folds(),
    )
    return known, facts.y


class _Facts:
    def __init__(self, family: Family, number: int, flutter: float | None, count: int) -> None:
        self.family, self.number, self.flutter = family, number, flutter
        self.at, self.y = family.stations(count)
        self.ends = float(self.at[0]), float(self.at[-1])
        self.extrema = self._extrema()

    def onset(self) -> Onset:
        """The lowest speed of all."""
        ends = [(self.ends[0], self.y[0], "edge"), (self.ends[1], self.y[-1], "edge")]
        place = min(self.extrema + ends, key=lambda place: float(place[1][SPEED]))
        return self._onset(*place)

    def folds(self) -> tuple[Onset, ...]:
        """Every local extremum of the speed inside the family."""
        return tuple(self._onset(*place) for place in self.extrema)

    def _extrema(self) -> list[tuple[float, Array, str]]:
        """Extrema of the speed along the curve; those at a kink of N are corners."""
        first, last = self.ends
        at, _, tangent = self.family.nodes()
        found = []
        for event in self.family.branch.events:
            if event.name == "fold" and first + _END < event.arclength < last - _END:
                i = int(np.searchsorted(at, event.arclength))
                turning = np.abs(tangent[[i - 1, min(i + 1, len(at) - 1)], SPEED]).max()
                if turning > _VERTICAL:
                    kind = "corner" if event.jump else "fold"
                    found.append((event.arclength, event.x, kind))
        return found

    def stable_onset(self) -> Onset | None:
        """The lowest stable cycle, located by bisection where nothing else marks it."""
        arclength, y = self.at, self.y
        stable = self._stable(y)
        chosen = np.flatnonzero(stable)
        if chosen.size == 0:
            return None
        i = int(chosen[np.argmin(y[chosen, SPEED])])
        places = [(float(arclength[i]), y[i], "edge")]
        places += [
            self._boundary(float(arclength[i]), float(arclength[j]))
            for j in (i - 1, i + 1)
            if 0 <= j < len(y) and not stable[j]
        ]
        place = min(places, key=lambda place: float(place[1][SPEED]))
        return self._onset(*self._marked(place))

    def _boundary(self, inside: float, outside: float) -> tuple[float, Array, str]:
        """Where stability is lost between a stable and an unstable place."""
        low, high = sorted((inside, outside))
        for s, y, kind in self.extrema:
            if low - _END <= s <= high + _END:
                return s, y, kind
        for _ in range(_BISECTIONS):
            middle = 0.5 * (inside + outside)
            y, _ = self.family.points(np.array([middle]))
            inside, outside = (middle, outside) if self._stable(y)[0] else (inside, middle)
        y, _ = self.family.points(np.array([inside]))
        return inside, y[0], "edge"

    def _marked(self, place: tuple[float, Array, str]) -> tuple[float, Array, str]:
        """The extremum that a place coincides with, if it does."""
        for extremum in self.extrema:
            if abs(extremum[0] - place[0]) < _END:
                return extremum
        return place

    def _stable(self, y: Array) -> NDArray[np.bool_]:
        A, B, _, _ = self.family.balance.unpack(y)
        d = self.family.balance.spring.describing(A, B)
        return stability(self.family.balance, y, d).stable

    def _onset(self, arclength: float, y: Array, kind: str) -> Onset:
        sides = np.array([arclength - _BESIDE, arclength + _BESIDE])
        inside = (sides > self.ends[0]) & (sides < self.ends[1])
        beside = np.zeros(2, dtype=bool)
        if inside.any():
            near, _ = self.family.points(sides[inside])
            larger = near[:, AMPLITUDE] > y[AMPLITUDE]
            beside[larger.astype(int)] = self._stable(near)
        A, B, U, k = (float(value) for value in self.family.balance.unpack(y))
        return Onset(
            speed=U,
            speed_ratio=U / self.flutter if self.flutter else float("nan"),
            amplitude=A,
            bias=B,
            k=k,
            kind=kind,
            stable=bool(beside.any()),
            beside=(bool(beside[0]), bool(beside[1])),
            family=self.number,
        )
