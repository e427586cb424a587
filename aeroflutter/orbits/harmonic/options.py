"""Options of the harmonic balance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aeroflutter.errors import InputError
from aeroflutter.limits import within

__all__ = ["HarmonicOptions"]


@dataclass(frozen=True, kw_only=True)
class HarmonicOptions:
    """How many harmonics, where, and how densely.

    Parameters
    ----------
    harmonics
        Highest harmonic; None raises it until the next ones change nothing above `tolerance`.
    tolerance
        Estimated sum of the harmonics left out over the amplitude, for `harmonics = None`.
    max_harmonics
        Where raising stops; the branch then says that it has not converged.
    symmetric
        Whether only odd harmonics take part; None takes them where the spring is odd and the
        describing function has no bias.
    speed_ratio_range
        Lowest and highest speed over the linear flutter speed (over the highest speed of the
        family's range, where there is none).
    largest
        Largest first harmonic followed, in units of the spring's scale.
    step, max_step
        First and largest step along a branch, in units of ln amplitude.
    max_states
        Cycles after which a branch ends.
    stability
        Whether multipliers are computed and bifurcations located.
    """

    harmonics: int | None = None
    tolerance: float = 1e-5
    max_harmonics: int = 81
    symmetric: bool | None = None
    speed_ratio_range: tuple[float, float] = (0.05, 3.0)
    largest: float = 50.0
    step: float = 0.02
    max_step: float = 0.05
    max_states: int = 1500
    stability: bool = True

    def __post_init__(self) -> None:
        problems = [
            f"{name}: must be at least {least}, not {getattr(self, name)!r}"
            for name, least in (("max_harmonics", 1), ("max_states", 2))
            if not getattr(self, name) >= least
        ]
        if self.harmonics is not None and not self.harmonics >= 1:
            problems.append(f"harmonics: must be at least 1, not {self.harmonics!r}")
        for name in ("tolerance", "largest", "step", "max_step"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                problems.append(f"{name}: must be positive and finite, not {value!r}")
        low, high = self.speed_ratio_range
        if not 0 < low < high < np.inf:
            problems.append(f"speed_ratio_range: needs 0 < low < high, finite, not {(low, high)!r}")
        if problems:
            raise InputError(problems)
        within("harmonics", self.harmonics or 0, "harmonics")
        within("harmonics", self.max_harmonics, "max_harmonics")
