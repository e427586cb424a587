"""`aeroflutter hb`."""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from aeroflutter.cli.common import CaseName, CaseOptions, Output, numbers, show_facts, show_table
from aeroflutter.errors import ConvergenceError, InputError

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from aeroflutter.case import Case
    from aeroflutter.orbits.harmonic import (
        Bifurcation,
        HarmonicBranch,
        HarmonicOnset,
        HarmonicOptions,
    )

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
    as it takes, through folds; Hill's method gives its multipliers and bifurcations. With
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
    output.deliver(
        _payload(loaded, branches),
        text=lambda: _print(loaded, branches),
        dataset=lambda: _dataset(loaded, branches),
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


def _payload(case: Case, branches: Branches) -> dict[str, Any]:
    first = min(branches, key=lambda branch: branch.onset.cycle.speed)
    stable = [branch.stable_onset for branch in branches if branch.stable_onset]
    numbered = list(enumerate(branches, 1))
    return {
        "title": case.title,
        "flutter_speed": branches[0].flutter_speed,
        "branch": [_point(case, b, n, i) for n, b in numbered for i in range(b.speed.size)],
        "bifurcations": [_event(event, n) for n, b in numbered for event in b.bifurcations],
        "onset": _onset(first.onset),
        "stable_onset": _onset(min(stable, key=lambda onset: onset.cycle.speed, default=None)),
        "families": [_family(branch, number) for number, branch in numbered],
    }


def _family(branch: HarmonicBranch, number: int) -> dict[str, Any]:
    return {
        "family": number,
        "symmetric": branch.symmetric,
        "harmonics": branch.harmonics,
        "converged": branch.converged,
        "closed": branch.closed,
        "ends": branch.stops,
        "onset": _onset(branch.onset),
        "stable_onset": _onset(branch.stable_onset),
    }


def _point(case: Case, branch: HarmonicBranch, number: int, i: int) -> dict[str, Any]:
    point = {
        "family": number,
        "amplitude_deg": math.degrees(branch.amplitude[i]),
        "bias_deg": math.degrees(branch.bias[i]),
        "first_harmonic_deg": math.degrees(branch.first_harmonic[i]),
        "speed": float(branch.speed[i]),
        "speed_ratio": float(branch.speed_ratio[i]),
        "k": float(branch.omega[i]),
        "period": float(branch.period[i]),
        "stable": bool(branch.stable[i]),
        "stability_certain": bool(branch.certain[i]),
        "multipliers": branch.multipliers[i],
        "multiplier_error": float(branch.multiplier_error[i]),
        "symmetric": branch.symmetric,
        "harmonics": branch.harmonics,
        "truncation": float(branch.truncation[i]),
    }
    scale = case.section.scale
    if scale is not None:
        point["velocity_m_s"] = scale.velocity(branch.speed[i])
        point["frequency_hz"] = scale.frequency_hz(branch.omega[i], branch.speed[i])
    return point


def _event(event: Bifurcation, number: int) -> dict[str, Any]:
    return {
        "kind": event.kind,
        "speed": event.cycle.speed,
        "speed_ratio": event.speed_ratio,
        "amplitude_deg": math.degrees(event.amplitude),
        "bias_deg": math.degrees(event.bias),
        "family": number,
    }


def _onset(onset: HarmonicOnset | None) -> dict[str, Any] | None:
    if onset is None:
        return None
    return {
        "speed": onset.cycle.speed,
        "speed_ratio": onset.speed_ratio,
        "amplitude_deg": math.degrees(onset.amplitude),
        "kind": onset.kind,
        "stable": onset.stable,
    }


def _print(case: Case, branches: Branches) -> None:
    print(case.title)
    for number, branch in enumerate(branches, 1):
        kind = "half-wave symmetric" if branch.symmetric else "general"
        state = "converged" if branch.converged else "NOT converged"
        show_facts(
            {
                f"family {number}": f"{kind}, harmonics up to {branch.harmonics}, {state}",
                "onset": _sentence(branch.onset),
                "stable onset": branch.stable_onset and _sentence(branch.stable_onset),
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
        _print_points(case, branch, number)
    print("a selection of the points; --json and --out give them all")


def _print_points(case: Case, branch: HarmonicBranch, number: int, count: int = 12) -> None:
    step = max(1, (branch.speed.size - 1) // (count - 1))
    rows = [_point(case, branch, number, i) for i in range(0, branch.speed.size, step)]
    columns = ("speed_ratio", "amplitude_deg", "first_harmonic_deg", "bias_deg", "period")
    show_table(
        ("U*/U*_L", "amplitude (deg)", "first harmonic", "bias (deg)", "period", "stable"),
        [(*(row[name] for name in columns), _stability(row)) for row in rows],
    )


def _stability(row: dict[str, Any]) -> str:
    word = "yes" if row["stable"] else "no"
    return word if row["stability_certain"] else f"{word} (not certain)"


def _sentence(onset: HarmonicOnset) -> str:
    beside = "stable" if onset.stable else "unstable"
    where = f"U*/U*_L = {onset.speed_ratio:.6f}"
    if not math.isfinite(onset.speed_ratio):
        where = f"U* = {onset.cycle.speed:.6f}"
    return f"{where} at {math.degrees(onset.amplitude):.4g} deg ({onset.kind}, {beside} beside it)"


def _dataset(case: Case, branches: Branches) -> xr.Dataset:
    from aeroflutter.results.harmonic import branches_to_dataset

    return branches_to_dataset(branches, case=case)


def _figure(case: Case, branches: Branches) -> Figure:
    from aeroflutter.plots.harmonic import plot_branches

    return plot_branches(branches, case.title)
