"""The exact onset of limit cycles, for sweeps over sections."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from aeroflutter.errors import ConvergenceError, InputError
from aeroflutter.orbits.cycles import CycleOptions, limit_cycles
from aeroflutter.studies.maps.sweep import Specimen

__all__ = ["ExactOnset"]


@dataclass(frozen=True)
class ExactOnset:
    """The lowest exact cycle of a section; families that branch off later are not looked for.

    Parameters
    ----------
    options : CycleOptions
        Of the search.
    """

    options: CycleOptions = CycleOptions(depth=0, points=2)  # noqa: RUF009 - frozen
    method: str = "exact"

    def __call__(self, specimen: Specimen) -> Mapping[str, float]:
        """Speed, ratio and amplitude of the onset; nothing where there is none."""
        try:
            onset = limit_cycles(specimen.family, specimen.spring, self.options).onset
        except (InputError, ConvergenceError):
            return {}
        if onset is None:
            return {}
        return {
            "onset_speed": onset.cycle.speed,
            "onset_speed_ratio": onset.cycle.speed_ratio,
            "onset_amplitude_deg": float(np.degrees(onset.cycle.amplitude)),
        }
