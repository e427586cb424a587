"""Folds, corners and ends of a family, and the lowest (stable) cycle on it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.orbits.describing.balance import SPEED
from aeroflutter.orbits.describing.families import Family
from aeroflutter.orbits.describing.stability import stability
from aeroflutter.orbits.result import CORNER, Branch, Cycle, Spot, onset, stable_onset
from aeroflutter.orbits.spectrum import FOLD

__all__ = ["family_facts"]

Array = NDArray[np.float64]

_BESIDE = 1e-3  # arclength at which "beside" is
_END = 1e-7  # arclength within which an extremum is an end of the family
_VERTICAL = 1e-9  # speed component of a tangent that is round-off: the family is linear there
_BISECTIONS = 32


def family_facts(
    family: Family, number: int, flutter: float | None, count: int
) -> tuple[Branch, Array]:
    """What is known of a traced family, and `count` cycles along it (besides the marked ones)."""
    at, y = family.stations(count)
    cycles = _cycles(family, number, flutter, y)
    extrema = _extrema(family, at)
    s, x, kinds = _marked(family, at, y, [cycle.stable for cycle in cycles], extrema)
    marked = _cycles(family, number, flutter, x)
    places = [Spot(cycle, kind) for cycle, kind in zip(marked, kinds, strict=True)]
    return Branch(
        number=number,
        cycles=cycles,
        bifurcations=tuple(onset(places, [int(i)]) for i in np.searchsorted(s, list(extrema))),
        ends=family.ends(),
        closed=family.branch.closed,
        onset=onset(places),
        stable_onset=stable_onset(places),
        symmetric=not family.balance.biased,
        origin="describing function",
    ), y


def _cycles(family: Family, number: int, flutter: float | None, y: Array) -> tuple[Cycle, ...]:
    """Cycles of unknowns y (m, 4)."""
    balance = family.balance
    A, B, U, k = balance.unpack(y)
    stable = stability(balance, y, balance.spring.describing(A, B)).stable
    return tuple(
        Cycle(
            np.array([bias, -1j * amplitude]),
            omega,
            speed,
            speed_ratio=speed / (flutter or np.nan),
            amplitude=amplitude,
            bias=bias,
            stable=flag,
            symmetric=not balance.biased,
            family=number,
            method="describing",
        )
        for amplitude, bias, speed, omega, flag in zip(
            *(value.tolist() for value in (A, B, U, k, stable)), strict=True
        )
    )


def _extrema(family: Family, at: Array) -> dict[float, str]:
    """Arclengths of the extrema of the speed inside the curve; those at a kink of N are corners."""
    nodes, _, tangent = family.nodes()
    found = {}
    for event in family.branch.events:
        if event.name == "fold" and at[0] + _END < event.arclength < at[-1] - _END:
            i = int(np.searchsorted(nodes, event.arclength))
            turning = np.abs(tangent[[i - 1, min(i + 1, len(nodes) - 1)], SPEED]).max()
            if turning > _VERTICAL:
                found[event.arclength] = CORNER if event.jump else FOLD
    return dict(sorted(found.items()))


def _marked(
    family: Family, at: Array, y: Array, stable: list[bool], extrema: dict[float, str]
) -> tuple[Array, Array, list[str]]:
    """Places from which the onsets can be told: arclengths, unknowns, and what happens there.

    They are the stations, the extrema with a cycle close by on either side, and where the lowest
    stable cycles end.
    """
    ends = float(at[0]), float(at[-1])
    near = np.array([s + side for s in (*ends, *extrema) for side in (-_BESIDE, _BESIDE)])
    near = near[(near > ends[0]) & (near < ends[1])]
    more = [*near, *_boundaries(family, at, y, stable, list(extrema))]
    found, converged = family.points(np.array(more)) if more else (y[:0], np.empty(0, dtype=bool))
    s = np.concatenate((at, np.array(more)[converged]))
    order = np.argsort(s, kind="stable")
    s = s[order]
    return s, np.concatenate((y, found[converged]))[order], [extrema.get(one, "") for one in s]


def _boundaries(
    family: Family, at: Array, y: Array, stable: list[bool], extrema: list[float]
) -> list[float]:
    """Arclengths at which the lowest stable cycles cease to be stable where nothing marks it."""
    chosen = np.flatnonzero(stable)
    if chosen.size == 0:
        return []
    i = int(chosen[np.argmin(y[chosen, SPEED])])
    found = []
    for j in (i - 1, i + 1):
        if not 0 <= j < len(y) or stable[j]:
            continue
        low, high = sorted((float(at[i]), float(at[j])))
        if not any(low - _END <= s <= high + _END for s in extrema):
            found.append(_boundary(family, float(at[i]), float(at[j])))
    return found


def _boundary(family: Family, inside: float, outside: float) -> float:
    """Where stability is lost between a stable and an unstable place, on the stable side."""
    balance = family.balance
    for _ in range(_BISECTIONS):
        middle = 0.5 * (inside + outside)
        y, _ = family.points(np.array([middle]))
        A, B, _, _ = balance.unpack(y)
        if stability(balance, y, balance.spring.describing(A, B)).stable[0]:
            inside = middle
        else:
            outside = middle
    return inside
