"""Cases as the contents of sweeps: a case of which some keys, or the airspeed, are sampled."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from aeroflutter.case import Case, load_case
from aeroflutter.case.source import parse_case
from aeroflutter.errors import InputError
from aeroflutter.motion.response import Initial
from aeroflutter.studies.cases import SPEEDS, case_identity, changed_case, in_si
from aeroflutter.studies.maps import Executor, Progress
from aeroflutter.studies.maps.sampling import Distribution, parse_distribution
from aeroflutter.studies.maps.sampling import sample as draw
from aeroflutter.studies.maps.sweep import Model, Specimen, SweepOptions, SweepResult
from aeroflutter.studies.maps.sweep import sweep as sweep_model


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
        return {**case_identity(self.text, self.source), "at": self.kind, "value": self.value}

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


def sweep(
    case: Case | Model,
    vary: Mapping[str, str | Distribution | ArrayLike],
    number: int = 200,
    *,
    seed: int = 0,
    design: str = "random",
    speed_ratio: float | None = None,
    speed: float | None = None,
    velocity: float | None = None,
    options: SweepOptions | None = None,
    executor: Executor | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> SweepResult:
    """Flutter speed, onset and end state for every section of a sample of a case.

    Parameters
    ----------
    case : Case or Model
        A case; or a model of any kind.
    vary : mapping
        By key of the case its distribution, as in ``{"section.mu": "normal(100,5)"}``, or its
        values, (N,), all keys alike.
    number, seed, design
        Of the sample, where distributions are given; as for `maps.sampling.sample`.
    speed_ratio, speed, velocity : float, optional
        Where motions are marched; ratios are of the nominal case's flutter speed.
    options : SweepOptions, optional
        What is computed; ``onset=ExactOnset()`` finds onsets exactly.
    executor, progress
        As for `maps.sweep.sweep`.

    Raises
    ------
    InputError
        If a key is none of the case, a distribution cannot be read, or speeds are given twice.
    """
    drawn = {
        key: parse_distribution(one) if isinstance(one, str) else one for key, one in vary.items()
    }
    distributions = {key: one for key, one in drawn.items() if isinstance(one, Distribution)}
    samples = {
        key: np.asarray(one, dtype=float)
        for key, one in drawn.items()
        if not isinstance(one, Distribution)
    }
    if distributions:
        samples |= draw(distributions, number, seed, design)
    if not isinstance(case, Case):
        return sweep_model(case, samples, options, executor=executor, progress=progress)
    speeds = {"speed_ratio": speed_ratio, "speed": speed, "velocity": velocity}
    given = [(name, float(value)) for name, value in speeds.items() if value is not None]
    if len(given) > 1:
        raise InputError("speed: give one of speed_ratio, speed and velocity at most")
    model = CaseModel(case.text, case.source, *(given[0] if given else (None, 0.0)))
    model.check(distributions)
    found = sweep_model(model, samples, options, executor=executor, progress=progress)
    return found.about(case=case)
