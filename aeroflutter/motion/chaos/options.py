"""How long to follow a motion, and how finely to judge it."""

from __future__ import annotations

from dataclasses import dataclass

from aeroflutter.errors import InputError
from aeroflutter.limits import within

__all__ = ["ChaosOptions"]


@dataclass(frozen=True, kw_only=True)
class ChaosOptions:
    """Lengths in oscillations, that is maxima of y.

    Parameters
    ----------
    cycles
        Maxima over which exponents are measured; None takes 20 000, and 1000 where DOP853 has to
        march.
    transient
        Maxima left out before, so that motion and tangents settle.
    exponents
        How many Lyapunov exponents, largest first; no more than the system has states.
    blocks
        Stretches whose means give the statistical error.

    Raises
    ------
    InputError
        Naming every option that is out of range.
    """

    cycles: int | None = None
    transient: int = 500
    exponents: int = 3
    blocks: int = 20

    def __post_init__(self) -> None:
        problems = []
        if self.blocks < 4:
            problems.append(f"blocks: {self.blocks!r} is less than 4; give a whole number above")
        elif self.cycles is not None and self.cycles < 2 * self.blocks:
            problems.append(
                f"cycles: {self.cycles!r} is less than two a block; give at least {2 * self.blocks}"
            )
        if self.transient < 0:
            problems.append(f"transient: {self.transient!r} is negative; give zero or more")
        if self.exponents < 1:
            problems.append(f"exponents: {self.exponents!r} is less than one; give one or more")
        if problems:
            raise InputError(problems)
        within("cycles", (self.cycles or 0) + self.transient, "cycles")
