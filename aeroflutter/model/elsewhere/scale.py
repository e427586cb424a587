"""What the numbers of a model from elsewhere are in SI units: its speeds are in m/s already."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from aeroflutter.model.section import Scale

__all__ = ["ModelScale"]


@dataclass(frozen=True)
class ModelScale(Scale):
    """Scale of a model whose speed is V in m/s.

    Parameters
    ----------
    b : float
        Semichord, m; any number where there is none.
    omega_alpha : float
        Is ``1/b``, so that speeds keep their numbers.
    seconds_of_time : bool
        Whether the model's time is in s; else in semichords travelled.
    with_semichord : bool
        Whether `b` is known, so that there are reduced frequencies.
    """

    seconds_of_time: bool = False
    with_semichord: bool = True

    @classmethod
    def of(cls, semichord: float | None, time_unit: str) -> ModelScale:
        """The scale of a model.

        Parameters
        ----------
        semichord : float, optional
            In m.
        time_unit : str
            ``"s"`` or ``"semichord"``.
        """
        b = 1.0 if semichord is None else semichord
        return cls(b, 1.0 / b, time_unit == "s", semichord is not None)

    @property
    def time_unit(self) -> str:
        """``"s"`` or ``"semichord"``."""
        return "s" if self.seconds_of_time else "semichord"

    def frequency_hz(self, k: float, speed: float) -> float:
        """Frequency in Hz of ``Im p`` per unit of the model's time at a speed; NaN if unknown."""
        if self.seconds_of_time:
            return k / (2 * math.pi)
        return self._known(super().frequency_hz(k, speed))

    def seconds(self, tau: float, speed: float) -> float:
        """Time in s of the model's time at a speed; NaN if unknown."""
        return tau if self.seconds_of_time else self._known(super().seconds(tau, speed))

    def reduced(self, k: Any, speed: Any) -> Any:
        """Reduced frequency of ``Im p`` per unit of the model's time at a speed; NaN if unknown."""
        return self._known(k * self.b / speed if self.seconds_of_time else k)

    def ratio(self, frequency: Any) -> Any:
        """Frequency over the uncoupled pitch frequency: there is none."""
        return frequency * math.nan

    @property
    def speed_name(self) -> str:
        """What an airspeed is called in tables: it is in m/s."""
        return "V"

    def _known(self, value: Any) -> Any:
        return value if self.with_semichord else value * math.nan
