"""The first answer of the program: what is proved free of oscillation, and the lowest cycle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from aeroflutter.analysis import Result, analysis
from aeroflutter.errors import InputError
from aeroflutter.guarantees.absence import Absence, Uncovered, absence
from aeroflutter.guarantees.absence.several import Several, several_highest
from aeroflutter.linear.rootlocus import RootLocus, root_locus
from aeroflutter.model.family import FixedModel
from aeroflutter.model.lure import AnyFamily, FixedFamily, as_family, as_lure
from aeroflutter.orbits.cycles import CycleOnset, CycleOptions, LimitCycles, limit_cycles
from aeroflutter.springs import Linear, Spring, Springs, each, simplify

__all__ = ["Onset", "onset"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Onset(Result):
    """Where oscillation begins, from both sides.

    Attributes
    ----------
    linear
        Flutter and divergence with the spring at unit slope.
    free
        What is proved free; None where the proof does not cover the case.
    free_at
        Of several springs: a speed that is proved free, by itself, and the proof; None where none
        was found.
    cycles
        Exact limit cycles; None where none were looked for.
    any_load
        Whether the answer is for every steady load: then no cycles were looked for.
    notes
        What a reader should know.
    """

    linear: RootLocus
    free: Absence | None
    free_at: tuple[float, Several] | None = None
    cycles: LimitCycles | None
    any_load: bool
    notes: tuple[str, ...]

    @property
    def lowest(self) -> CycleOnset | None:
        """The cycle at the lowest speed; None where none was found or looked for."""
        return None if self.cycles is None else self.cycles.onset

    @property
    def lowest_stable(self) -> CycleOnset | None:
        """The stable cycle at the lowest speed."""
        return None if self.cycles is None else self.cycles.stable_onset

    @property
    def flutter_speed(self) -> float | None:
        """U*_L, None without flutter."""
        return None if self.linear.flutter is None else self.linear.flutter.speed

    @property
    def free_below(self) -> float | None:
        """The highest speed that is proved free; None where nothing is."""
        proved = self.free is not None and self.free.certificate is not None
        return self.free.high if self.free is not None and proved else None

    @property
    def gap(self) -> float | None:
        """How far the lowest cycle is above what is proved free, relative to its speed."""
        if self.free_below is None or self.lowest is None:
            return None
        return 1.0 - self.free_below / self.lowest.cycle.speed


@analysis()
def onset(
    family: AnyFamily,
    spring: Springs,
    options: CycleOptions | None = None,
    *,
    any_load: bool = False,
) -> Onset:
    """Flutter, divergence, what is proved free of oscillation, and the lowest exact cycles.

    Parameters
    ----------
    family
        A section at every speed.
    spring
        Its spring, or a sequence of them. Of several one speed is proved free and no range.
    options
        Of the search for cycles.
    any_load
        Leave out the cycles, which move with the load; what is proved free does not.

    Raises
    ------
    InputError
        If the family does not depend on speed.

    Examples
    --------
    >>> from aeroflutter import Freeplay, SectionFamily, TypicalSection
    >>> found = onset(SectionFamily(TypicalSection(omega_bar=0.2)), Freeplay(1.0))
    >>> found.free_below < found.lowest.cycle.speed
    True
    """
    if isinstance(family, FixedFamily | FixedModel):
        raise InputError("family: does not depend on speed; an onset is a speed")
    notes: list[str] = []
    free, springs = None, each(spring)
    try:
        if len(springs) == 1:
            free = absence(as_lure(family), springs[0])
            notes += free.notes
            if free.certificate is None:
                notes.append("nothing is proved free: no multiplier was found, even at low speed")
    except Uncovered as why:
        notes.append(f"nothing is proved free: {why}")
    found = None
    if not any_load and not all(isinstance(simplify(one), Linear) for one in springs):
        found = limit_cycles(family, spring, options)
        notes += found.notes
    linear = root_locus(family)
    alone = None
    if len(springs) > 1:
        lowest = None if found is None or found.onset is None else found.onset.cycle.speed
        alone = _alone(family, springs, linear, lowest, notes)
    return Onset(
        linear=linear,
        free=free,
        free_at=alone,
        cycles=found,
        any_load=any_load,
        notes=tuple(notes),
    )


def _alone(
    family: AnyFamily,
    springs: Sequence[Spring],
    linear: RootLocus,
    lowest: float | None,
    notes: list[str],
) -> tuple[float, Several] | None:
    """The highest speed found that is proved free, by itself."""
    ends = [lowest, linear.divergence, linear.flutter and linear.flutter.speed]
    top = min([one for one in ends if one], default=as_family(family).search_range[1])
    try:
        alone = several_highest(family, springs, top)
    except Uncovered as why:
        notes.append(f"nothing is proved free: {why}")
        return None
    if alone is None:
        notes.append("nothing is proved free: no multiplier for all springs was found")
    else:
        notes.append("with several springs what is proved free is one speed, not those below it")
        if not alone[1].certified:
            notes.append(
                "not certified: there is a checker of two springs, which takes python-flint "
                "(pip install aeroflutter[certify])"
            )
    return alone
