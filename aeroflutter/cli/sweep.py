"""`aeroflutter sweep`."""

from __future__ import annotations

import functools
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from aeroflutter.cli.common import CaseName, CaseOptions, Json, Output, show_facts, show_table
from aeroflutter.cli.keeping import Keeping, compute
from aeroflutter.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from aeroflutter.case import Case
    from aeroflutter.studies.maps.sampling import Distribution
    from aeroflutter.studies.maps.sweep import Specimen, SweepResult

SMALL = 20  # sections up to which this process is done before others have started
SPEEDS = ("speed", "speed_ratio")
UNBOUNDED, POSITIVE = (-float("inf"), float("inf")), (0.0, float("inf"))


def sweep(
    case: CaseName,
    *,
    vary: Annotated[
        list[str],
        Parameter(
            negative=(),
            help="A key of the case (or speed, speed_ratio) and its distribution, as in "
            "section.mu=normal(100,5); may be repeated. Distributions: normal(mean,deviation), "
            "lognormal(median,log_deviation), both also with bounds low,high; uniform(low,high), "
            "triangular(low,mode,high), beta(low,high,a,b), choice(a,b,...).",
        ),
    ],
    sample: Annotated[int, Parameter(help="Number of sections.")] = 200,
    seed: Annotated[int, Parameter(help="The same seed gives the same sample.")] = 0,
    design: Annotated[
        Literal["random", "latin-hypercube", "sobol"],
        Parameter(help="Independent draws, or a design that fills the space more evenly."),
    ] = "random",
    speed_ratio: Annotated[
        float | None,
        Parameter(help="Amplitude at this multiple of the nominal case's linear flutter speed."),
    ] = None,
    speed: Annotated[float | None, Parameter(help="Amplitude at this airspeed U*.")] = None,
    velocity: Annotated[
        float | None, Parameter(help="Amplitude at this airspeed in m/s (sections in SI units).")
    ] = None,
    onset: Annotated[bool, Parameter(help="Onset of limit cycles by describing functions.")] = True,
    plot: Annotated[
        Path | None, Parameter(help="Draw into this file (.png, .svg or .pdf).")
    ] = None,
    json: Json = False,
    options: CaseOptions = CaseOptions(),
    keeping: Keeping = Keeping(),
) -> None:
    """Monte-Carlo: distributions of flutter speed, onset of limit cycles and their amplitude.

    Distributions are cut off where no section can be: a mass ratio is positive, say. Samples
    that no section can have all the same (|x_alpha| above r_alpha) are counted as invalid.
    """
    from aeroflutter.results import fields_of, to_dataset
    from aeroflutter.studies.maps.sampling import sample as draw
    from aeroflutter.studies.maps.sweep import SweepOptions, SweepStudy, gather

    keeping.check()
    output = Output(json=json, out=keeping.netcdf, plot=plot)
    output.check()
    loaded = options.load(case)
    distributions = parse_varied(vary)
    fixed = _fixed_speed(speed=speed, speed_ratio=speed_ratio, velocity=velocity)
    model = CaseModel(loaded.text, loaded.source, *fixed)
    model.check(distributions)
    written = {name: str(distribution) for name, distribution in distributions.items()}
    study = SweepStudy(
        model,
        draw(distributions, sample, seed, design),
        SweepOptions(onset=onset),
        {"seed": seed, "design": design, "vary": written},
    )
    executor = keeping.executor(alone=sample <= SMALL)
    begin = time.monotonic()
    with keeping.opened(study, loaded) as results:
        compute(study, results, executor, "sections")
        found = gather(study, results)
    wall = time.monotonic() - begin
    about = {**study.about, "vary": "; ".join(f"{key}={text}" for key, text in written.items())}
    output.deliver(
        {
            "title": loaded.title,
            **study.about,
            **fields_of(found, loaded),
            "wall_seconds": wall,
            "store": keeping.store and str(keeping.store),
        },
        text=lambda: _print(loaded, found, wall),
        dataset=lambda: to_dataset(found, case=loaded).assign_attrs(about),
        figure=lambda: _figure(loaded, found),
    )


def parse_varied(texts: list[str]) -> dict[str, Distribution]:
    """Distributions by key, cut off at what the key may be.

    Raises
    ------
    InputError
        If one cannot be read or puts nothing within the bounds of its key; all of them at once.
    """
    found: dict[str, Distribution] = {}
    problems: list[str] = []
    for text in texts:
        try:
            key, distribution = _varied(text)
            if key in found:
                raise InputError(f"{key}: varies twice")
            found[key] = distribution
        except InputError as error:
            problems += [f"--vary: {problem}" for problem in error.problems]
    if problems:
        raise InputError(problems)
    return found


def _varied(text: str) -> tuple[str, Distribution]:
    from aeroflutter.studies.maps.sampling import parse_distribution

    key, equals, written = text.partition("=")
    key = key.strip()
    if not (equals and key):
        raise InputError(f'"{text}" must be KEY=DISTRIBUTION, as in section.mu=normal(100,5)')
    return key, parse_distribution(written).within(*bounds(key))


def bounds(key: str) -> tuple[float, float]:
    """Between what numbers a key may lie, by the schema of case files."""
    from aeroflutter.case import schema

    table, _, name = key.rpartition(".")
    for model in schema.TABLES.get(table, ()):
        if name in model.model_fields:
            allowed = schema.metadata(model, name).get("allowed")
            positive = allowed in (schema.POSITIVE, schema.NOT_NEGATIVE) or name == "r_alpha"
            return POSITIVE if positive else UNBOUNDED
    return POSITIVE if key in SPEEDS else UNBOUNDED


def _fixed_speed(**given: float | None) -> tuple[str | None, float]:
    chosen = [(name, value) for name, value in given.items() if value is not None]
    if len(chosen) > 1:
        raise InputError("--speed, --speed-ratio, --velocity: give one of them at most")
    if not chosen:
        return None, 0.0
    name, value = chosen[0]
    if not 0.0 < value < float("inf"):
        raise InputError(f"--{name.replace('_', '-')}: must be positive, not {value!r}")
    return name, value


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
        if self.kind == "velocity" and self._case({}).section.scale is None:
            raise InputError("--velocity: needs a section in SI units; give --speed")
        if self.kind == "speed_ratio" or "speed_ratio" in distributions:
            nominal_flutter(self.text, self.source)

    def _problems(self, name: str, distribution: Distribution) -> list[str]:
        import numpy as np

        try:
            self._case({name: float(distribution.quantile(np.array([0.5]))[0])})
        except InputError as error:
            return [f"--vary: {problem}" for problem in error.problems]
        return []

    def at(self, values: Mapping[str, float]) -> Specimen:
        """The section with these values."""
        from aeroflutter.motion.response import Initial
        from aeroflutter.studies.maps.sweep import Specimen

        case = self._case({name: v for name, v in values.items() if name not in SPEEDS})
        initial = Initial(**case.initial._asdict())
        return Specimen(case.family(), case.spring, initial, self._speed(case, values))

    def identity(self) -> dict[str, Any]:
        """The case and where it is marched."""
        from aeroflutter.case.source import parse_case

        return {"case": parse_case(self.text, self.source), "at": self.kind, "value": self.value}

    def _case(self, overrides: Mapping[str, float]) -> Case:
        from aeroflutter.case import load_case
        from aeroflutter.case.source import parse_case

        return load_case(parse_case(self.text, self.source), overrides)

    def _speed(self, case: Case, values: Mapping[str, float]) -> float | None:
        kind, value = self.kind, self.value
        for name in SPEEDS:
            if name in values:
                kind, value = name, values[name]
        if kind == "speed_ratio":
            return value * nominal_flutter(self.text, self.source)
        if kind == "velocity":
            assert case.section.scale is not None
            return value / case.section.scale.velocity(1.0)
        return value if kind == "speed" else None


@functools.lru_cache(maxsize=8)
def nominal_flutter(text: str, source: str) -> float:
    """Linear flutter speed of the case as it stands."""
    from aeroflutter.case import load_case
    from aeroflutter.case.source import parse_case
    from aeroflutter.linear.rootlocus import flutter_speed

    speed = flutter_speed(load_case(parse_case(text, source)).family())
    if speed is None:
        raise InputError(f"{source}: has no linear flutter speed; give --speed, not a ratio")
    return speed


def _print(case: Case, found: SweepResult, wall: float) -> None:
    from aeroflutter.motion.response import STATES
    from aeroflutter.results.studies import DISTRIBUTIONS

    print(case.title)
    valid = found.values["valid"]
    facts: dict[str, Any] = {"samples": found.number}
    facts |= {
        name: int(odd.sum())
        for name, odd in (("invalid", valid == 0), ("failed", valid < 0))
        if odd.any()
    }
    counts = {state: found.count(state) for state in STATES}
    if any(counts.values()):
        facts["motion"] = ", ".join(f"{n} {state}" for state, n in counts.items() if n)
    facts["wall time"] = f"{wall:.3g} s"
    show_facts(facts)
    rows = []
    for name in DISTRIBUTIONS:
        row = found.distribution(name)
        if row["number"]:
            q = row["quantiles"]
            spread = (row["mean"], row["deviation"], q["0.05"], q["0.5"], q["0.95"])
            rows.append((name, row["number"], *spread))
    show_table(("result", "number", "mean", "deviation", "5 %", "median", "95 %"), rows)
    for failure in found.failures:
        print(f"failed: {failure['block']}: {failure['reason']}")


def _figure(case: Case, found: SweepResult) -> Figure:
    from aeroflutter.plots.maps import plot_sweep

    return plot_sweep(found, case.title)
