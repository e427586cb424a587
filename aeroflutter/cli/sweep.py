"""`aeroflutter sweep`."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from aeroflutter.cli.airspeed import Airspeed
from aeroflutter.cli.common import (
    CaseName,
    CaseOptions,
    Json,
    Output,
    Plot,
    PlotWidth,
    Units,
    say,
    show_facts,
    show_table,
    shown_scale,
    spoken,
)
from aeroflutter.cli.keeping import Keeping, compute
from aeroflutter.cli.numbers import numbers
from aeroflutter.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from aeroflutter.case import Case
    from aeroflutter.model.section import Scale
    from aeroflutter.studies.maps.sampling import Distribution
    from aeroflutter.studies.maps.sweep import SweepResult

SMALL = 20  # sections up to which this process is done before others have started
SPEEDS = ("speed", "speed_ratio", "velocity")
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
    airspeed: Airspeed = Airspeed(),
    onset: Annotated[
        Literal["describing", "exact", "none"],
        Parameter(
            help="Onset of limit cycles: by the describing function, which may be some per cent "
            "off, or exactly, which takes seconds a section."
        ),
    ] = "describing",
    plot: Plot = None,
    plot_width: PlotWidth = None,
    json: Json = False,
    units: Units = None,
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
    from aeroflutter.studies.sampled import CaseModel

    keeping.check()
    output = Output(json=json, out=keeping.netcdf, plot=plot, plot_width=plot_width)
    output.check()
    loaded = options.load(case)
    scale = shown_scale(units, loaded)
    distributions = parse_varied(vary)
    fixed = _fixed_speed(airspeed)
    model = CaseModel(loaded.text, loaded.source, *fixed)
    model.check(distributions)
    written = {name: str(distribution) for name, distribution in distributions.items()}
    study = SweepStudy(
        model,
        draw(distributions, sample, seed, design),
        SweepOptions(onset=_finder(onset)),
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
        text=lambda: _print(loaded, found, wall, scale),
        dataset=lambda: to_dataset(found, case=loaded).assign_attrs(about),
        figure=lambda: spoken(_figure(loaded, found, scale), loaded),
        command="sweep",
    )


def _finder(onset: str) -> Any:
    """What finds the onset of a section."""
    if onset == "exact":
        from aeroflutter.studies.maps.onsets import ExactOnset

        return ExactOnset()
    return onset == "describing"


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
        field = model.model_fields.get(name)
        if field is not None and isinstance(field.json_schema_extra, dict):  # a number, or some
            allowed = field.json_schema_extra.get("allowed")
            positive = allowed in (schema.POSITIVE, schema.NOT_NEGATIVE) or name == "r_alpha"
            return POSITIVE if positive else UNBOUNDED
    return POSITIVE if key in SPEEDS else UNBOUNDED


def _fixed_speed(airspeed: Airspeed) -> tuple[str | None, float]:
    """Name and number of the airspeed that is given; ratios are of the nominal flutter speed."""
    given = airspeed.given(excluded="--speed, --speed-ratio, --velocity: give one of them at most")
    if given is None:
        return None, 0.0
    option, text = given
    values = numbers(option, text)
    if values.size != 1 or not values[0] > 0.0:
        raise InputError(f"{option}: must be positive, one number, not {text}")
    return option.removeprefix("--").replace("-", "_"), float(values[0])


def _print(case: Case, found: SweepResult, wall: float, scale: Scale | None) -> None:
    from aeroflutter.results.studies import DISTRIBUTIONS, IN_SI, METHODS, called, distribution
    from aeroflutter.verdicts import STATES

    say(case.title)
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
    for name in (*(IN_SI if scale else ()), *DISTRIBUTIONS):
        row = distribution(found, name)
        if row["number"]:
            q = row["quantiles"]
            spread = (row["mean"], row["deviation"], q["0.05"], q["0.5"], q["0.95"])
            how = f" ({METHODS[found.onset_method]})" if name.startswith("onset") else ""
            rows.append((called(name) + how, row["number"], *spread))
    show_table(("result", "number", "mean", "deviation", "5 %", "median", "95 %"), rows)
    for failure in found.failures:
        say(f"failed: {failure['block']}: {failure['reason']}")


def _figure(case: Case, found: SweepResult, scale: Scale | None) -> Figure:
    from aeroflutter.plots.maps import plot_sweep
    from aeroflutter.plots.style import literal

    return plot_sweep(found, literal(case.title), si=scale is not None)
