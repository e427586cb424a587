"""Monte-Carlo and design studies: flutter speed, onset and amplitude over a sample of sections."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from aeroflutter.analysis import Result
from aeroflutter.errors import ConvergenceError, InputError
from aeroflutter.model.lure import AnyFamily
from aeroflutter.model.section import Scale
from aeroflutter.motion.response import Initial, SimulateOptions
from aeroflutter.springs import Springs, alone
from aeroflutter.studies.maps.cells import Group
from aeroflutter.studies.maps.engines import FAILED, MARCH, decide, march_identity
from aeroflutter.studies.maps.executors import Threads
from aeroflutter.studies.maps.fingerprint import code_hash
from aeroflutter.studies.maps.results import MemoryResults
from aeroflutter.studies.maps.runner import Progress, run
from aeroflutter.studies.maps.study import AnyArray, Executor, Results, Task, Variable
from aeroflutter.verdicts import STATES

__all__ = ["Model", "Specimen", "SweepOptions", "SweepResult", "SweepStudy", "gather", "sweep"]

Array = NDArray[np.float64]

BLOCKS, LARGEST_BLOCK = 64, 256  # as in `maps.grid`, for samples
QUANTILES = (0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99)
OF_CYCLES = ("amplitude_deg", "bias_deg", "period")  # results that only limit cycles have


class Specimen(NamedTuple):
    """One section of the sample: `speed` is where its motion is marched, if anywhere.

    `scale` turns its results into SI units, if anything does: each section has its own.
    """

    family: AnyFamily
    spring: Springs
    initial: Initial
    speed: float | None
    scale: Scale | None = None


class Model(Protocol):
    """What is sampled. Obligations:

    1. Instances can be pickled and depend on nothing outside themselves.
    2. ``at(values)`` depends on its argument alone, and raises `InputError` for values that no
       section can have.
    3. ``identity()`` holds, in JSON's types, whatever the numbers depend on.
    """

    def at(self, values: Mapping[str, float]) -> Specimen: ...

    def identity(self) -> dict[str, Any]: ...


class Finder(Protocol):
    """What finds the onset of limit cycles of a section. Instances can be pickled."""

    method: str

    def __call__(self, specimen: Specimen) -> Mapping[str, float]: ...


@dataclass(frozen=True, kw_only=True)
class SweepOptions:
    """What is computed for every section of a sample.

    Parameters
    ----------
    march : SimulateOptions
        Engine and limits of the end state, where the model gives a speed.
    onset : bool or callable
        The lowest limit cycle by the describing function, or by what is given, as
        `onsets.ExactOnset()`: a specimen -> results by their names.
    """

    march: SimulateOptions = MARCH
    onset: bool | Finder = True

    @property
    def method(self) -> str:
        """How the onset is found: "describing", "none", or the method of what is given."""
        if isinstance(self.onset, bool):
            return "describing" if self.onset else "none"
        return self.onset.method

    def find(self, specimen: Specimen) -> Mapping[str, float]:
        """The onset of one section, if it is looked for."""
        if isinstance(self.onset, bool):
            return _onset(specimen) if self.onset else {}
        return self.onset(specimen)

    def identity(self) -> dict[str, Any]:
        """The options in JSON's types."""
        return {**march_identity(self.march), "onset": self._found_by()}

    def _found_by(self) -> Any:
        if isinstance(self.onset, bool):
            return self.onset
        return [self.onset.method, code_hash(type(self.onset).__module__)]


RESULTS = (
    Variable("valid", "i1", FAILED),
    Variable("flutter_speed", "f8", np.nan),
    Variable("flutter_k", "f8", np.nan),
    Variable("onset_speed", "f8", np.nan),
    Variable("onset_speed_ratio", "f8", np.nan),
    Variable("onset_amplitude_deg", "f8", np.nan),
    Variable("flutter_velocity_m_s", "f8", np.nan),
    Variable("flutter_frequency_hz", "f8", np.nan),
    Variable("onset_velocity_m_s", "f8", np.nan),
    Variable("marched_at", "f8", np.nan),
    Variable("marched_at_m_s", "f8", np.nan),
    Variable("state", "i1", FAILED),
    Variable("amplitude_deg", "f8", np.nan),
    Variable("bias_deg", "f8", np.nan),
    Variable("period", "f8", np.nan),
)


@dataclass(frozen=True, eq=False)
class SweepStudy:
    """A sweep as a study, see `study.Study`.

    Parameters
    ----------
    model : Model
    samples : mapping
        Values by the name of the quantity, (N,) each.
    options : SweepOptions
    about : mapping
        What else belongs to the identity of the sweep: seed and distributions, say.
    """

    model: Model
    samples: Mapping[str, Array]
    options: SweepOptions = field(default_factory=SweepOptions)
    about: Mapping[str, Any] = field(default_factory=dict)
    kind: str = "sweep"

    @property
    def number(self) -> int:
        """Size of the sample."""
        return min(len(values) for values in self.samples.values())

    @property
    def dimensions(self) -> dict[str, AnyArray]:
        """The sections, numbered from 1."""
        return {"sample": np.arange(1, self.number + 1)}

    @property
    def block_shape(self) -> tuple[int]:
        """Sections a block."""
        return (min(max(self.number // BLOCKS, 1), LARGEST_BLOCK),)

    @property
    def phases(self) -> tuple[str, ...]:
        """All at once."""
        return ("sections",)

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Results a section."""
        return tuple(Variable(v.name, v.dtype, v.fill, "sections") for v in RESULTS)

    def identity(self) -> dict[str, Any]:
        """Whatever the results depend on, in JSON's types."""
        from aeroflutter import __version__

        digests = {
            name: hashlib.sha256(np.ascontiguousarray(values).tobytes()).hexdigest()[:16]
            for name, values in self.samples.items()
        }
        return {
            "kind": self.kind,
            **self.about,
            "number": self.number,
            "samples": digests,
            "model": self.model.identity(),
            "options": self.options.identity(),
            "aeroflutter": __version__,
            "code_sha256": code_hash(__name__, type(self.model).__module__),
        }

    def tasks(self, phase: str, results: Results) -> list[Task]:
        """One task a block."""
        (size,) = self.block_shape
        starts = range(0, self.number, size)
        return [
            Task(phase, k, (slice(start, min(start + size, self.number)),))
            for k, start in enumerate(starts)
        ]

    def compute(self, task: Task) -> dict[str, AnyArray]:
        """Results of one block."""
        found = self.failed(task)
        (part,) = task.region
        for place, i in enumerate(range(part.start, part.stop)):
            values = {name: float(column[i]) for name, column in self.samples.items()}
            for name, value in self._one(values).items():
                found[name][place] = value
        return found

    def failed(self, task: Task) -> dict[str, AnyArray]:
        """What stands for sections that could not be computed."""
        (part,) = task.region
        return {v.name: np.full(part.stop - part.start, v.fill, dtype=v.dtype) for v in RESULTS}

    def describe(self, task: Task) -> str:
        """The block by its number and its sections."""
        (part,) = task.region
        return f"block {task.number}: samples {part.start + 1} to {part.stop}"

    def warm_up(self) -> None:
        """Compute one section, which loads or compiles the engine."""
        self._one({name: float(column[0]) for name, column in self.samples.items()})

    def _one(self, values: Mapping[str, float]) -> dict[str, float]:
        """Everything about one section; `valid` is 0 for values that no section can have."""
        from aeroflutter.linear.rootlocus import flutter_point

        try:
            specimen = self.model.at(values)
        except InputError:
            return {"valid": 0}
        found: dict[str, float] = {"valid": 1}
        flutter = flutter_point(specimen.family)
        if flutter is not None:
            found |= {"flutter_speed": flutter.speed, "flutter_k": flutter.k}
        found |= self.options.find(specimen)
        if specimen.speed is not None:
            found |= self._end(specimen, specimen.speed)
        return found | _in_si(found, specimen.scale)

    def _end(self, specimen: Specimen, speed: float) -> dict[str, float]:
        system = specimen.family.at(speed)
        state, memory = specimen.initial.start(system, specimen.spring)
        index = np.zeros(1, dtype=np.int64)
        group = Group(index, system, alone(specimen.spring), state[None, :], np.array([memory]))
        ends = decide(group, self.options.march)
        return {
            "marched_at": speed,
            "state": int(ends.state[0]),
            "amplitude_deg": float(np.degrees(ends.amplitude[0])),
            "bias_deg": float(np.degrees(ends.bias[0])),
            "period": float(ends.period[0]),
        }


def _in_si(found: Mapping[str, float], scale: Scale | None) -> dict[str, float]:
    """Speeds and frequencies of one section in m/s and Hz, by its own scale."""
    if scale is None:
        return {}
    si = {name: found[of] for name, of in IN_METRES.items() if of in found}
    si = {name: scale.velocity(speed) for name, speed in si.items()}
    if "flutter_k" in found:
        hertz = scale.frequency_hz(found["flutter_k"], found["flutter_speed"])
        si["flutter_frequency_hz"] = hertz
    return si


IN_METRES = {
    "flutter_velocity_m_s": "flutter_speed",
    "onset_velocity_m_s": "onset_speed",
    "marched_at_m_s": "marched_at",
}


def _onset(specimen: Specimen) -> dict[str, float]:
    """The lowest cycle by describing functions, if there is one and it could be followed."""
    from aeroflutter.orbits.describing import describing_curve

    try:
        onset = describing_curve(specimen.family, specimen.spring).onset
    except (InputError, ConvergenceError):
        return {}
    if onset is None:
        return {}
    return {
        "onset_speed": onset.speed,
        "onset_speed_ratio": onset.speed_ratio,
        "onset_amplitude_deg": float(np.degrees(onset.amplitude)),
    }


@dataclass(frozen=True, kw_only=True, eq=False)
class SweepResult(Result):
    """A finished sweep; arrays are (N,), angles in degrees.

    Attributes
    ----------
    samples
        The values of the quantities that varied.
    values
        Results by the names of `RESULTS`; NaN where there is none.
    cpu_seconds
        CPU time of all blocks.
    failures
        Blocks that could not be computed, and why.
    onset_method
        How onsets were found: "describing", "exact" or "none".
    """

    samples: Mapping[str, Array]
    values: Mapping[str, AnyArray]
    cpu_seconds: float = 0.0
    failures: Sequence[Mapping[str, str]] = ()
    onset_method: str = "describing"

    @property
    def number(self) -> int:
        """Size of the sample."""
        return int(self.values["valid"].size)

    def count(self, state: str) -> int:
        """Number of sections whose motion ends so."""
        marched = np.isfinite(self.values["marched_at"])
        alike = self.values["state"] == STATES.index(state)
        return int(np.count_nonzero(alike & marched))

    def of(self, name: str) -> Array:
        """One result of the sections that have it; amplitudes are those of limit cycles."""
        values = np.asarray(self.values[name], dtype=float)
        if name in OF_CYCLES:
            values = values[self.values["state"] == STATES.index("lco")]
        return values[np.isfinite(values)]

    def distribution(self, name: str) -> dict[str, Any]:
        """Number, mean, standard deviation and quantiles of one result over the sample."""
        values = self.of(name)
        if values.size == 0:
            return {"number": 0}
        quantiles = np.quantile(values, QUANTILES)
        return {
            "number": int(values.size),
            "mean": float(values.mean()),
            "deviation": float(values.std(ddof=1)) if values.size > 1 else 0.0,
            "min": float(values.min()),
            "max": float(values.max()),
            "quantiles": {f"{q:g}": float(v) for q, v in zip(QUANTILES, quantiles, strict=True)},
        }


def gather(study: SweepStudy, results: Results) -> SweepResult:
    """The sweep from its results."""
    return SweepResult(
        samples=study.samples,
        values={v.name: results.read(v.name) for v in RESULTS},
        cpu_seconds=results.cpu_seconds,
        failures=results.failures,
        onset_method=study.options.method,
    )


def sweep(
    model: Model,
    samples: Mapping[str, Array],
    options: SweepOptions | None = None,
    *,
    executor: Executor | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> SweepResult:
    """Flutter speed, onset and end state for every section of a sample, in memory.

    Parameters
    ----------
    model : Model
        What is sampled.
    samples : mapping
        Values by the name of the quantity, (N,) each; `sampling.sample` draws them.
    options : SweepOptions, optional
    executor : Executor, optional
        Who computes; one thread of this process by default.
    progress : callable, optional
        Called after every block.
    """
    study = SweepStudy(model, samples, options or SweepOptions())
    results = MemoryResults(study)
    study.warm_up()
    run(study, results, executor or Threads(), progress)
    return gather(study, results)
