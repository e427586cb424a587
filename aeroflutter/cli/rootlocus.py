"""`aeroflutter rootlocus`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from aeroflutter.cli.common import CaseName, CaseOptions, Output, numbers, show_facts, show_table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from aeroflutter.case import Case
    from aeroflutter.linear.rootlocus import RootLocus
    from aeroflutter.model.lure import Real


def rootlocus(
    case: CaseName,
    *,
    speeds: Annotated[
        str | None, Parameter(help="Speeds U* at which roots are listed, as A:B:N or a,b,c.")
    ] = None,
    stiffness: Annotated[
        float, Parameter(help="Pitch stiffness that stands for the spring.")
    ] = 1.0,
    stiffness_curve: Annotated[
        str | None,
        Parameter(help="Flutter speed against these pitch stiffnesses, as A:B:N or a,b,c."),
    ] = None,
    low: Annotated[float | None, Parameter(help="Lowest speed U* searched.")] = None,
    high: Annotated[float | None, Parameter(help="Highest speed U* searched.")] = None,
    options: CaseOptions = CaseOptions(),
    output: Output = Output(),
) -> None:
    """Linear flutter and divergence: the roots of the section followed over airspeed.

    The spring is replaced by a linear one. By default speeds from 0.02 to 20 times
    r_alpha sqrt(mu) are searched; every crossing of the imaginary axis is listed.
    """
    from aeroflutter.linear.rootlocus import RootLocusOptions, flutter_against_stiffness, root_locus
    from aeroflutter.results import fields_of, to_dataset

    output.check()
    loaded = options.load(case, angle=False)
    settings = RootLocusOptions(stiffness=stiffness, low=low, high=high)
    shown = None if speeds is None else numbers("--speeds", speeds)
    result = root_locus(loaded.loop()[0], settings, speeds=shown)
    curve = None
    if stiffness_curve is not None:
        values = numbers("--stiffness-curve", stiffness_curve)
        curve = (values, *flutter_against_stiffness(loaded.loop()[0], values, settings))
    output.deliver(
        {
            "title": loaded.title,
            **fields_of(result, loaded),
            "wind_off": _wind_off(loaded),
            **_stiffness(curve),
        },
        text=lambda: _print(loaded, result, curve),
        dataset=lambda: to_dataset(result, case=loaded),
        figure=lambda: _figure(loaded, result, curve),
    )


def _wind_off(case: Case) -> list[dict[str, Any]]:
    """Coupled modes without air, all springs nominal, and the coordinate that leads each."""
    from aeroflutter.model.equations import wind_off

    if case.imported is not None:
        modal = case.imported.modal
        found_in = () if modal is None else tuple(modal.whole().wind_off)
        return [{"frequency_hz": float(w) / (2 * math.pi), "leads": None} for w in found_in]
    modes, scale = wind_off(case.section), case.scale
    found: list[dict[str, Any]] = []
    for ratio, leads in zip(map(float, modes.frequencies), modes.leads, strict=True):
        mode: dict[str, Any] = {"omega_ratio": ratio, "leads": leads}
        if scale is not None:
            mode["frequency_hz"] = ratio * scale.omega_alpha / (2 * math.pi)
        found.append(mode)
    return found


def _stiffness(curve: Curve | None) -> dict[str, Any]:
    """Flutter speed against stiffness, if it is asked for."""
    if curve is None:
        return {}
    return {"stiffness_curve": dict(zip(("stiffness", "speed", "k"), curve, strict=True))}


Curve = tuple["Real", "Real", "Real"]


def _print(case: Case, result: RootLocus, curve: Curve | None) -> None:
    print(case.title)
    low, high = result.searched
    flutter = result.flutter
    facts: dict[str, Any] = {}
    if flutter is None:
        facts["flutter"] = f"none between U* = {low:.4g} and {high:.4g}"
    else:
        facts["flutter speed U*"] = f"{flutter.speed:.6f}{_si(case, flutter.speed)}"
        facts["reduced frequency k"] = flutter.k
        facts["omega/omega_alpha"] = flutter.omega_ratio
    facts["divergence speed U*"] = (
        f"none up to U* = {high:.4g}"
        if result.divergence is None
        else f"{result.divergence:.6f}{_si(case, result.divergence)}"
    )
    if result.unstable_at_low:
        facts["note"] = f"an oscillation grows already at the lowest speed searched, {low:.4g}"
    show_facts(facts)
    if len(result.crossings) > 1:
        show_table(
            ("crossing at U*", "k", "omega/omega_alpha", "becomes"),
            [
                (c.speed, c.k, c.omega_ratio, "growing" if c.growing else "damped")
                for c in result.crossings
            ],
        )
    if curve is not None:
        show_table(
            ("stiffness N", "flutter U*", "k"),
            [tuple(map(float, row)) for row in zip(*curve, strict=True)],
        )


def _si(case: Case, speed: float) -> str:
    scale = case.scale
    return "" if scale is None else f"  ({scale.velocity(speed):.5g} m/s)"


def _figure(case: Case, result: RootLocus, curve: Curve | None) -> Figure:
    from aeroflutter.plots.rootlocus import plot_root_locus, plot_stiffness

    if curve is not None:
        return plot_stiffness(curve[0], curve[1], case.title)
    return plot_root_locus(result, case.title)
