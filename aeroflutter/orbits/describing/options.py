"""Options of the describing-function analysis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aeroflutter.errors import InputError
from aeroflutter.limits import within
from aeroflutter.model.lure import AnyFamily
from aeroflutter.springs import PiecewiseLinear, Spring
from aeroflutter.springs.hysteresis import Hysteresis

__all__ = ["DescribingOptions"]


@dataclass(frozen=True, kw_only=True)
class DescribingOptions:
    """Where to look for cycles, and how densely.

    Parameters
    ----------
    amplitude_range
        Lowest and highest amplitude, radians. By default from where the spring begins to be
        nonlinear (where it has such a point, and no offset; else a hundredth of its scale) to a
        hundred times its scale.
    speed_ratio_range
        Lowest and highest speed over the linear flutter speed; (0.05, 3) by default. Where there
        is no flutter speed the family's own range of speeds is searched.
    points
        Points returned on every family of cycles, besides its folds, corners and ends.
    stiffness
        Stiffness of the linear spring whose flutter speed is the unit of `speed_ratio`.
    scan_amplitudes, scan_speeds
        Size of the grid on which cycles are searched.
    harmonics
        Highest harmonic of the predicted distortion.
    samples
        Samples a period from which those harmonics are computed.
    """

    amplitude_range: tuple[float, float] | None = None
    speed_ratio_range: tuple[float, float] = (0.05, 3.0)
    points: int = 200
    stiffness: float = 1.0
    scan_amplitudes: int = 16
    scan_speeds: int = 120
    harmonics: int = 9
    samples: int = 256

    def __post_init__(self) -> None:
        problems = [
            f"{name}: must be at least {least}, not {getattr(self, name)!r}"
            for name, least in (
                ("points", 2),
                ("scan_amplitudes", 2),
                ("scan_speeds", 8),
                ("harmonics", 2),
                ("samples", 2 * self.harmonics + 2),
            )
            if not getattr(self, name) >= least
        ]
        for name in ("amplitude_range", "speed_ratio_range"):
            pair = getattr(self, name)
            if pair is not None and not (0 < pair[0] < pair[1] < np.inf):
                problems.append(f"{name}: needs 0 < low < high, finite, not {pair!r}")
        if not np.isfinite(self.stiffness):
            problems.append(f"stiffness: must be finite, not {self.stiffness!r}")
        if problems:
            raise InputError(problems)
        within("numbers", self.points, "points")

    def amplitudes(self, spring: Spring) -> tuple[float, float]:
        """Lowest and highest amplitude for a spring, radians."""
        if self.amplitude_range is not None:
            return self.amplitude_range
        return linear_limit(spring) or 0.01 * spring.scale, 100.0 * spring.scale

    def speeds(self, family: AnyFamily, flutter: float | None) -> tuple[float, float]:
        """Lowest and highest speed U*, within what the family covers."""
        low, high = family.search_range
        if flutter is not None:
            ratios = self.speed_ratio_range
            low, high = max(low, ratios[0] * flutter), min(high, ratios[1] * flutter)
        low = max(low, 1e-4 * high)
        if not low < high:
            raise InputError(
                f"speed_ratio_range: {self.speed_ratio_range!r} times the flutter speed "
                f"{flutter!r} has no speed in common with the family's range "
                f"{family.search_range!r}"
            )
        return low, high


def linear_limit(spring: Spring) -> float:
    """Amplitude about zero up to which an odd spring is linear; 0 where there is none."""
    if not spring.odd:
        return 0.0
    if isinstance(spring, Hysteresis):
        return spring.delta_v / 2
    if isinstance(spring, PiecewiseLinear):
        breaks = np.abs(spring.pieces().breaks)
        return float(breaks.min()) if breaks.size else 0.0
    return 0.0
