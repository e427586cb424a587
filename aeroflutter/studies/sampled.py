"""Cases as the contents of sweeps: a case of which some keys, or the airspeed, are sampled."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from aeroflutter.case import Case, load_case
from aeroflutter.case.source import parse_case
from aeroflutter.errors import InputError
from aeroflutter.motion.response import Initial
from aeroflutter.studies.cases import SPEEDS, changed_case, in_si
from aeroflutter.studies.maps.sampling import Distribution
from aeroflutter.studies.maps.sweep import Specimen


@dataclass(frozen=True)
class CaseModel:
    """A case of which some keys are sampled; see `maps.sweep.Model`.

    Parameters
    ----------
    text, source
        The case as TOML, and where it came from.
    kind, value
        Where its motion is marched: "speed", "speed_ratio" (of the nominal case), "velocity" or
        None.
    """

    text: str
    source: str
    kind: str | None = None
    value: float = 0.0

    def check(self, distributions: Mapping[str, Distribution]) -> None:
        """Refuse keys that a case has not, and speeds that do not exist.

        Raises
        ------
        InputError
            If the case is not valid with a key at its median, all keys at once.
        """
        problems: list[str] = []
        for name, distribution in distributions.items():
            if name not in SPEEDS:
                problems += self._problems(name, distribution)
        if problems:
            raise InputError(problems)
        if self.kind == "velocity" or "velocity" in distributions:
            in_si(self._case({}))
        if self.kind == "speed_ratio" or "speed_ratio" in distributions:
            self._nominal_flutter()

    def _problems(self, name: str, distribution: Distribution) -> list[str]:
        try:
            self._case({name: float(distribution.quantile(np.array([0.5]))[0])})
        except InputError as error:
            return [f"--vary: {problem}" for problem in error.problems]
        return []

    def at(self, values: Mapping[str, float]) -> Specimen:
        """The section with these values."""
        case = self._case({name: v for name, v in values.items() if name not in SPEEDS})
        initial = Initial(**case.initial._asdict())
        speed = self._speed(case, values)
        return Specimen(*case.loop(), initial, speed, case.scale)

    def identity(self) -> dict[str, Any]:
        """The case and where it is marched."""
        return {"case": parse_case(self.text, self.source), "at": self.kind, "value": self.value}

    def _case(self, overrides: Mapping[str, float]) -> Case:
        return load_case(parse_case(self.text, self.source), overrides)

    def _speed(self, case: Case, values: Mapping[str, float]) -> float | None:
        kind, value = self.kind, self.value
        for name in SPEEDS:
            if name in values:
                kind, value = name, values[name]
        if kind == "speed_ratio":
            return value * self._nominal_flutter()
        if kind == "velocity":
            return in_si(case).speed(value)
        return value if kind == "speed" else None

    def _nominal_flutter(self) -> float:
        _, _, flutter = changed_case(self.text, self.source, ())
        return flutter()
