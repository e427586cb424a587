"""Unsteady and quasi-steady aerodynamics of the section, as data."""

from __future__ import annotations

import math
from dataclasses import dataclass

from aeroflutter.errors import InputError
from aeroflutter.generated.indicial import SETS

JONES_A, JONES_B = SETS["jones"]


@dataclass(frozen=True)
class Wagner:
    """Indicial lift ``phi(tau) = 1 - sum_i a_i exp(-b_i tau)`` with any number of terms.

    Parameters
    ----------
    a, b : tuple of float
        Coefficients and decay rates per unit of nondimensional time. The default is Jones'
        two-term fit of Wagner's function (thesis eq. 3.20). No terms at all means circulatory
        lift without lag.

    Raises
    ------
    InputError
        If the lengths differ, a rate is not positive, a number is not finite, or
        ``phi(0) = 1 - sum(a)`` is not positive.
    """

    a: tuple[float, ...] = JONES_A
    b: tuple[float, ...] = JONES_B

    def __post_init__(self) -> None:
        object.__setattr__(self, "a", tuple(float(value) for value in self.a))
        object.__setattr__(self, "b", tuple(float(value) for value in self.b))
        problems = []
        if len(self.a) != len(self.b):
            problems.append(
                f"a and b: need as many coefficients as rates, got {len(self.a)} and {len(self.b)}"
            )
        if not all(math.isfinite(value) for value in self.a + self.b):
            problems.append("a and b: every number must be finite")
        elif any(value <= 0 for value in self.b):
            problems.append("b: every decay rate must be positive, or the lift never settles")
        elif sum(self.a) >= 1:
            problems.append("a: the sum must be below 1, since phi(0) = 1 - sum(a) is positive")
        if problems:
            raise InputError(problems)

    @classmethod
    def named(cls, name: str) -> Wagner:
        """A named set of terms.

        Parameters
        ----------
        name : str
            ``"jones"``, ``"four-term"``, ``"six-term"`` or ``"ten-term"``: within 0.015, 0.00125,
            0.00021 and 0.000012 of Theodorsen's function at every reduced frequency.

        Raises
        ------
        InputError
            If there is no such set.
        """
        if name not in SETS:
            known = ", ".join(f'"{key}"' for key in SETS)
            raise InputError([f'indicial: must be one of {known}, not "{name}"'])
        return cls(*SETS[name])

    @property
    def lags(self) -> int:
        """Number of lag states."""
        return len(self.a)


@dataclass(frozen=True)
class QuasiSteady:
    """Lift proportional to pitch alone: ``C_L = 2 pi alpha`` (thesis section 3.1.1)."""


Aerodynamics = Wagner | QuasiSteady
