"""`aeroflutter hb`."""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from aeroflutter.cli.common import (
    CaseName,
    CaseOptions,
    Output,
    lowest,
    numbers,
    show_facts,
    show_fields,
    show_table,
)
from aeroflutter.errors import ConvergenceError, InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from aeroflutter.case import Case
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
    speed_ratio_range: Annotated[
        str, Parameter(help="Lowest and highest speed ratio, as low,high.")
    ] = "0.05,3",
    largest: Annotated[
        float, Parameter(help="Largest amplitude, in units of the spring's own size.")
    ] = 50.0,
    max_step: Annotated[
        float, Parameter(help="Largest step along a branch, in ln amplitude.")
    ] = 0.05,
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
    settings = HarmonicOptions(
        harmonics=_harmonics(harmonics),
        tolerance=tolerance,
        max_harmonics=max_harmonics,
        symmetric=False if general else None,
        speed_ratio_range=_pair(speed_ratio_range),
        largest=largest,
        max_step=max_step,
        step=min(0.02, max_step) if max_step > 0 else 0.02,
    )
    loaded = options.load(case)
    branches = harmonic_families(loaded.family(), loaded.spring, settings)
    if asymmetric:
        branches += _asymmetric(loaded, branches, settings)
    output.result(
        loaded,
        lambda: branches,
        text=lambda: _print(loaded, branches),
        figure=lambda: _figure(loaded, branches),
    )


def _harmonics(text: str) -> int | None:
    if text == "auto":
        return None
    try:
        return int(text)
    except ValueError:
        raise InputError(f'--harmonics: must be a whole number or auto, not "{text}"') from None


def _pair(text: str) -> tuple[float, float]:
    values = numbers("--speed-ratio-range", text)
    if values.size != 2:
        raise InputError(f'--speed-ratio-range: "{text}" must be low,high')
    return float(values[0]), float(values[1])


def _asymmetric(case: Case, branches: Branches, settings: HarmonicOptions) -> Branches:
    """The branches that leave where symmetry breaks; those that cannot be followed are named."""
    from aeroflutter.orbits.harmonic import asymmetric_branch

    found: list[HarmonicBranch] = []
    for branch in branches:
        for event in branch.bifurcations:
            if event.kind != "symmetry-breaking":
                continue
            try:
                found.append(asymmetric_branch(case.family(), case.spring, branch, event, settings))
            except ConvergenceError as error:
                print(f"aeroflutter: at {event.speed_ratio:.5g}: {error}", file=sys.stderr)
    return tuple(found)


def _print(case: Case, branches: Branches) -> None:
    from aeroflutter.results import fields_of

    print(case.title)
    for number, branch in enumerate(branches, 1):
        fields = fields_of(branch)
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
        if branch.bifurcations:
            show_table(
                ("bifurcation", "U*/U*_L", "U*", "amplitude (deg)"),
                [
                    (e.kind, e.speed_ratio, e.cycle.speed, math.degrees(e.amplitude))
                    for e in branch.bifurcations
                ],
            )
        _print_points(fields["branch"])
    print("a selection of the points; --json and --out give them all")


def _print_points(points: list[dict[str, Any]], count: int = 12) -> None:
    chosen = points[:: max(1, (len(points) - 1) // (count - 1))]
    rows = [point | {"stable": _stability(point)} for point in chosen]
    show_fields("speed_ratio amplitude first_harmonic bias period stable", rows)


def _stability(row: dict[str, Any]) -> str:
    word = "yes" if row["stable"] else "no"
    return word if row["stability_certain"] else f"{word} (not certain)"


def _figure(case: Case, branches: Branches) -> Figure:
    from aeroflutter.plots.harmonic import plot_branches

    return plot_branches(branches, case.title)
