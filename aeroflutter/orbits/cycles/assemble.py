"""From strands to a family: enough cycles, in order, what happens on them, where it begins."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aeroflutter.orbits.cycles.follow import Place, Strand, between
from aeroflutter.orbits.result import (
    Branch,
    Cycle,
    bifurcations,
    onset,
    stable_onset,
)

__all__ = ["Family", "assemble"]

Array = NDArray[np.float64]

_CLOSURE, _TRIVIAL = 1e-10, 1e-8  # closure and trivial multiplier of a cycle that is returned
_TOGETHER = 1e-8  # U/U_ref within which neighbouring changes of sequence are one
_CROWDED = 0.05  # of the wanted spacing: closer cycles are left out


@dataclass(frozen=True, eq=False)
class Family:
    """A family as it was found, and as it is reported.

    Attributes
    ----------
    strands
        The strands that make it up.
    places
        Its places in order.
    facts
        What is reported.
    """

    strands: tuple[Strand, ...]
    places: tuple[Place, ...]
    facts: Branch

    def steps(self) -> Iterator[tuple[Place, Place]]:
        """Neighbours of one leg as they were walked."""
        for strand in self.strands:
            for one, other in zip(strand.places[:-1], strand.places[1:], strict=True):
                if one.leg is other.leg:
                    yield one, other

    @property
    def left_out(self) -> tuple[Cycle, ...]:
        """Cycles too unstable to be returned."""
        return tuple(place.cycle for place in self.places if not _closes(place.cycle))

    def marked(self, *kinds: str) -> list[Place]:
        """Places where one of these happens."""
        return [place for place in self.places if place.kind in kinds]


def assemble(
    number: int,
    origin: str,
    parent: int | None,
    ahead: Strand,
    behind: Strand | None,
    points: int,
) -> Family:
    """One family from its two strands.

    Parameters
    ----------
    number, origin, parent
        What it is called and where it comes from.
    ahead, behind
        The strands on both sides of its first cycle; no `behind` where it starts there.
    points
        Cycles wanted; more are computed, or crowded ones left out.
    """
    if behind is not None and behind.end.cycle.amplitude > ahead.end.cycle.amplitude:
        ahead, behind = behind, ahead  # a family runs from its small cycles to its large ones
    strands = [ahead] if behind is None else [ahead, behind]
    sides = [_resolved(strand.places) for strand in strands]
    total = float(sum(_spacing(side).sum() for side in sides))
    sides = [_filled(side, points, total) for side in sides]
    places, start = sides[0], origin
    if behind is not None:
        shift, start = sides[1][-1].at, behind.stop
        places = [replace(place, at=shift - place.at) for place in sides[1][:0:-1]]
        places += [replace(place, at=shift + place.at) for place in sides[0]]
    places = [replace(p, cycle=replace(p.cycle, family=number)) for p in places]
    cycles = [place.cycle for place in places]
    facts = Branch(
        number=number,
        origin=origin,
        symmetric=ahead.middle.leg.shooting.symmetric,
        parent=parent,
        cycles=tuple(cycle for cycle in cycles if _closes(cycle)),
        bifurcations=bifurcations(places, [_closes(cycle) for cycle in cycles]),
        ends=(start, ahead.stop),
        closed=ahead.closed,
        onset=onset(places),
        stable_onset=stable_onset(places),
    )
    return Family(tuple(strands), tuple(places), facts)


def _resolved(places: list[Place]) -> list[Place]:
    """Places with a plain cycle between any two at which something happens."""
    result: list[Place] = []
    for place in places:
        if any(_one_event(known, place) for known in result[-2:]):
            continue
        if place.kind and result and result[-1].kind:
            middle = between(result[-1], place)
            if middle is not None:
                result.append(middle)
        result.append(place)
    return result


def _closes(cycle: Cycle) -> bool:
    """Whether a cycle is good to all digits; a very unstable one magnifies round-off."""
    return cycle.closure < _CLOSURE and abs(cycle.multipliers[0] - 1.0) < _TRIVIAL


def _one_event(one: Place, other: Place) -> bool:
    """Whether two changes of sequence are one, located twice."""
    gap = abs(one.cycle.speed - other.cycle.speed) / one.leg.shooting.reference
    return one.kind == other.kind == "grazing" and gap < _TOGETHER


def _spacing(places: list[Place]) -> Array:
    """Distances between neighbours as a figure shows them, (m-1,)."""
    speed = [place.cycle.speed / place.leg.shooting.reference for place in places]
    amplitude = 0.2 * np.log([place.cycle.amplitude for place in places])
    return np.asarray(np.hypot(np.diff(speed), np.diff(amplitude)))


def _filled(places: list[Place], points: int, total: float) -> list[Place]:
    """The strand with cycles no further apart than wanted, and without crowded or repeated ones."""
    wanted = total / max(points - 1, 1)
    kept = [places[0]]
    for before, place, gap in zip(places[:-1], places[1:], _spacing(places), strict=True):
        count = max(1, round(gap / wanted)) if wanted > 0 else 1
        steps = [between(before, place, step / count) for step in range(1, count)]
        kept += [middle for middle in steps if middle is not None]
        if not place.seam and (place is places[-1] or not _crowded(kept[-1], place, wanted)):
            kept.append(place)
    return kept


def _crowded(last: Place, place: Place, wanted: float) -> bool:
    """Whether a plain cycle may be left out: it adds nothing to its neighbour before it."""
    if place.kind or last.kind or last.cycle.stable != place.cycle.stable:
        return False
    return bool(_spacing([last, place])[0] < _CROWDED * wanted)
