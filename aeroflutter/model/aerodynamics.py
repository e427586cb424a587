"""Unsteady and quasi-steady aerodynamics of the section, as data."""

from __future__ import annotations

import math
from dataclasses import dataclass

from aeroflutter.errors import InputError

JONES_A = (0.165, 0.335)
JONES_B = (0.0455, 0.3)


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

    @property
    def lags(self) -> int:
        """Number of lag states."""
        return len(self.a)


@dataclass(frozen=True)
class QuasiSteady:
    """Lift proportional to pitch alone: ``C_L = 2 pi alpha`` (thesis section 3.1.1)."""


Aerodynamics = Wagner | QuasiSteady
