"""`aeroflutter hb`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from aeroflutter.cli.airspeed import AirspeedRange, several_speeds
from aeroflutter.cli.common import (
    CaseName,
    CaseOptions,
    Output,
    flutter_facts,
    lowest,
    say,
    show_facts,
    show_fields,
    show_table,
)
from aeroflutter.cli.largest import largest_of
from aeroflutter.cli.varying import Vary, lowest_rows
from aeroflutter.errors import ConvergenceError, InputError
from aeroflutter.results.unit import told
from aeroflutter.stderr import aside

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from aeroflutter.case import Case
    from aeroflutter.model.section import Scale
    from aeroflutter.orbits.harmonic import HarmonicBranch, HarmonicOptions

Branches = tuple["HarmonicBranch", ...]


def hb(
    case: CaseName,
    *,
    harmonics: Annotated[
        str, Parameter(help="Highest harmonic, or auto: until the next ones change nothing.")
    ] = "auto",
    tolerance: Annotated[
        float, Parameter(help="Harmonics that auto may leave out, over the amplitude.")
    ] = 1e-5,
    max_harmonics: Annotated[int, Parameter(help="Where auto stops.")] = 81,
    general: Annotated[
        bool, Parameter(negative=(), help="Keep mean and even harmonics of an odd spring too.")
    ] = False,
    asymmetric: Annotated[
        bool,
        Parameter(negative=(), help="Follow the branches that leave where symmetry breaks, too."),
    ] = False,
    between: AirspeedRange = AirspeedRange(),
    largest_deg: Annotated[
        float | None,
        Parameter(help="Largest amplitude followed; by default 50 times the spring's own size."),
    ] = None,
    max_step: Annotated[
        float, Parameter(help="Largest step along a branch, in ln amplitude.")
    ] = 0.05,
    vary: Vary = Vary(),
    largest: Annotated[float | None, Parameter(show=False)] = None,
    options: CaseOptions = CaseOptions(),
    output: Output = Output(),
) -> None:
    """Limit cycles by harmonic balance: amplitude against airspeed, stable or not.

    Every family of cycles that the describing function knows is followed with as many harmonics
    as it takes, through folds, with its multipliers and bifurcations. With
    --harmonics 1 the describing function itself is obtained.
    """
    from aeroflutter.orbits.harmonic import HarmonicOptions, harmonic_families

    output.check()
    loaded = options.load(case)
    several_speeds(loaded)
    scale = output.begin(loaded, "hb")

    def analyse(one: Case) -> Branches:
        settings = HarmonicOptions(
            harmonics=_harmonics(harmonics),
            tolerance=tolerance,
            max_harmonics=max_harmonics,
            symmetric=False if general else None,
            speed_ratio_range=between.ratios(one, (0.05, 3.0)),
            largest=largest_of(one, largest_deg, largest),
            max_step=max_step,
            step=min(0.02, max_step) if max_step > 0 else 0.02,
        )
        found = harmonic_families(*one.loop(), settings)
        return found + _asymmetric(one, found, settings) if asymmetric else found

    if vary.vary is not None:
        vary.deliver(loaded, "hb", analyse, output, rows=lowest_rows)
        return
    branches = analyse(loaded)
    output.result(
        loaded,
        lambda: branches,
        text=lambda: _print(loaded, branches, scale),
        figure=lambda: _figure(loaded, branches, scale),
        command="hb",
    )


def _harmonics(text: str) -> int | None:
    if text == "auto":
        return None
    try:
        return int(text)
    except ValueError:
        raise InputError(f'--harmonics: must be a whole number or auto, not "{text}"') from None


def _asymmetric(case: Case, branches: Branches, settings: HarmonicOptions) -> Branches:
    """The branches that leave where symmetry breaks; those that cannot be followed are named."""
    from aeroflutter.orbits.harmonic import asymmetric_branch

    found: list[HarmonicBranch] = []
    for branch in branches:
        for event in branch.bifurcations:
            if event.kind != "symmetry-breaking":
                continue
            try:
                found.append(asymmetric_branch(*case.loop(), branch, event, settings))
            except ConvergenceError as error:
                aside(f"aeroflutter: at {event.speed_ratio:.5g}: {error}")
    return tuple(found)


def _print(case: Case, branches: Branches, scale: Scale | None) -> None:
    from aeroflutter.results import fields_of

    say(case.title)
    if scale is not None:
        show_facts(flutter_facts(branches[0].flutter_speed, scale))
    for number, branch in enumerate(branches, 1):
        fields = fields_of(branch, case if scale else None)
        stable = fields["stable_onset"]
        kind = "half-wave symmetric" if branch.symmetric else "general"
        state = "converged" if branch.converged else "NOT converged"
        show_facts(
            {
                f"family {number}": f"{kind}, harmonics up to {branch.harmonics}, {state}",
                "onset": lowest(fields["onset"]).replace("cycles beside", "beside"),
                "stable onset": stable and lowest(stable).replace("cycles beside", "beside"),
            }
        )
        units = ("V (m/s)",) if scale else ()
        if branch.bifurcations:
            show_table(
                ("bifurcation", *units, "U*/U*_L", "U*", "amplitude (deg)"),
                [
                    (
                        e.kind,
                        *([scale.velocity(e.cycle.speed)] if scale else []),
                        *(e.speed_ratio, e.cycle.speed, told(e.amplitude)),
                    )
                    for e in branch.bifurcations
                ],
            )
        _print_points(fields["branch"])
    say("a selection of the points; --json and --out give them all")


def _print_points(points: list[dict[str, Any]], count: int = 12) -> None:
    chosen = points[:: max(1, (len(points) - 1) // (count - 1))]
    rows = [point | {"stable": _stability(point)} for point in chosen]
    si = " k" if rows and "frequency_hz" in rows[0] else ""
    show_fields(f"speed_ratio amplitude first_harmonic bias period stable{si}", rows)


def _stability(row: dict[str, Any]) -> str:
    word = "yes" if row["stable"] else "no"
    return word if row["stability_certain"] else f"{word} (not certain)"


def _figure(case: Case, branches: Branches, scale: Scale | None) -> Figure:
    from aeroflutter.plots.harmonic import plot_branches
    from aeroflutter.plots.style import literal

    return plot_branches(branches, literal(case.title), scale)
