"""What is proved free of oscillation, beside what a command has found."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from aeroflutter.results.unit import spoken_unit, told

if TYPE_CHECKING:
    from aeroflutter.case import Case
    from aeroflutter.guarantees.absence import Absence
    from aeroflutter.springs import Hysteresis

__all__ = ["Harmless", "free_range", "harmless"]

_REACH = 15.0  # frequency up to which a proof is looked for: little, so that it is soon found


def free_range(case: Case, *, terms: bool) -> Absence | None:
    """What is proved free, without terms in a moment or with them in longer; None where nothing."""
    from aeroflutter.guarantees.absence import Uncovered, absence

    if isinstance(case.loop()[1], tuple):
        return None  # of several springs no interval is proved
    try:
        free = absence(case.family(), case.spring, terms=terms)
    except Uncovered:
        return None
    return None if free.certificate is None else free


@dataclass(frozen=True)
class Harmless:
    """A loop with which nothing oscillates at a speed.

    Attributes
    ----------
    ratio
        Friction over gap from which on that is proved.
    loop
        The loop of that ratio with the gap, or the friction, of the one that was given; None where
        neither is held.
    certified
        Whether the checker has accepted the proof.
    """

    ratio: float
    loop: Hysteresis | None
    certified: bool

    def facts(self) -> dict[str, Any]:
        """For JSON and as attributes of files."""
        loop = self.loop
        suffix = spoken_unit().suffix
        return {
            "proved_friction_over_gap": self.ratio,
            f"proved_friction{suffix}": None if loop is None else told(loop.delta_v / 2.0),
            f"proved_gap{suffix}": None if loop is None else told(loop.delta_h),
            "proved_certified": self.certified,
        }


def harmless(case: Case, speed: float, vary: str) -> Harmless | None:
    """What size of the case's loop is proved harmless at a speed; None where none is.

    Parameters
    ----------
    case
        The case.
    speed
        U*.
    vary
        "friction" holds the gap, "gap" the friction; anything else neither.
    """
    from aeroflutter.guarantees.absence import Uncovered
    from aeroflutter.guarantees.absence.friction import Friction
    from aeroflutter.springs import Hysteresis

    spring = case.spring
    if not isinstance(spring, Hysteresis) or not spring.delta_h > 0.0:
        return None
    try:
        enough = Friction(case.family(), _REACH).at(speed)
    except Uncovered:
        return None
    if not math.isfinite(enough.ratio):
        return None
    loop = None
    if vary == "friction":
        loop = replace(spring, delta_v=enough.ratio * spring.delta_h)
    elif vary == "gap" and enough.ratio > 0.0:
        loop = replace(spring, delta_h=spring.delta_v / enough.ratio)
    return Harmless(enough.ratio, loop, enough.certified)
