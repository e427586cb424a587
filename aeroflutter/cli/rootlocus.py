"""`aeroflutter rootlocus`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from aeroflutter.cli.airspeed import Airspeeds, pair, scale_of
from aeroflutter.cli.common import (
    CaseName,
    CaseOptions,
    Output,
    numbers,
    say,
    show_facts,
    show_table,
    shown,
)
from aeroflutter.cli.former import former
from aeroflutter.cli.varying import Vary
from aeroflutter.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from aeroflutter.case import Case
    from aeroflutter.linear.rootlocus import Crossing, RootLocus
    from aeroflutter.model.lure import Real
    from aeroflutter.model.section import Scale
    from aeroflutter.studies.vary import Member


def rootlocus(
    case: CaseName,
    *,
    airspeeds: Airspeeds = Airspeeds(),
    stiffness: Annotated[
        float, Parameter(help="Pitch stiffness that stands for the spring.")
    ] = 1.0,
    stiffness_curve: Annotated[
        str | None,
        Parameter(help="Flutter speed against these pitch stiffnesses, as A:B:N or a,b,c."),
    ] = None,
    speed_range: Annotated[
        str | None, Parameter(help="Lowest and highest airspeed U* searched, as low,high.")
    ] = None,
    velocity_range: Annotated[
        str | None,
        Parameter(help="Lowest and highest airspeed in m/s, low,high, where the case has SI data."),
    ] = None,
    vary: Vary = Vary(),
    low: Annotated[float | None, Parameter(show=False)] = None,
    high: Annotated[float | None, Parameter(show=False)] = None,
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
    scale = output.begin(loaded, "rootlocus")
    former({"--low": low, "--high": high}, "--speed-range low,high")
    between = _between(loaded, speed_range, velocity_range)
    settings = RootLocusOptions(stiffness=stiffness, low=between[0] or low, high=between[1] or high)

    def analyse(one: Case) -> RootLocus:
        return root_locus(one.loop()[0], settings, speeds=airspeeds.speeds(one))

    if vary.vary is not None:
        if stiffness_curve is not None:
            raise InputError("--stiffness-curve: excludes --vary; give one of the two")
        vary.deliver(
            loaded, "rootlocus", analyse, output, rows=_row,
            facts=lambda one: {"wind_off": _wind_off(one)},
        )  # fmt: skip
        return
    result = analyse(loaded)
    curve = None
    if stiffness_curve is not None:
        values = numbers("--stiffness-curve", stiffness_curve)
        curve = (values, *flutter_against_stiffness(loaded.loop()[0], values, settings))
    output.deliver(
        {
            "title": loaded.title,
            **fields_of(result, loaded),
            "wind_off": _wind_off(loaded),
            **_stiffness(curve, loaded),
        },
        text=lambda: _print(loaded, result, curve, scale),
        dataset=lambda: to_dataset(result, case=loaded),
        figure=lambda: _figure(loaded, result, curve, scale),
        command="rootlocus",
    )


def _between(
    case: Case, speeds: str | None, velocities: str | None
) -> tuple[float | None, float | None]:
    """Lowest and highest U* searched, None where that is left open."""
    if speeds is not None and velocities is not None:
        raise InputError("--speed-range, --velocity-range: give one of the two, not both")
    if velocities is not None:
        scale = scale_of(case, "--velocity-range")
        low, high = pair("--velocity-range", velocities)
        return scale.speed(low), scale.speed(high)
    return (None, None) if speeds is None else pair("--speed-range", speeds)


def _row(member: Member, scale: Scale | None) -> dict[str, Any]:
    """What a member comes to."""
    flutter, divergence = member.result.flutter, member.result.divergence
    if scale is None:
        return {
            "flutter U*": flutter and flutter.speed,
            "k": flutter and flutter.k,
            "divergence U*": divergence,
        }
    own = member.case.scale
    return {
        "flutter (m/s)": flutter and own.velocity(flutter.speed),
        "f (Hz)": flutter and own.frequency_hz(flutter.k, flutter.speed),
        "flutter U*": flutter and flutter.speed,
        "k": flutter and flutter.k,
        "divergence (m/s)": divergence and own.velocity(divergence),
    }


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


def _stiffness(curve: Curve | None, case: Case) -> dict[str, Any]:
    """Flutter speed against stiffness, if it is asked for."""
    if curve is None:
        return {}
    found = dict(zip(("stiffness", "speed", "k"), curve, strict=True))
    if (scale := case.scale) is not None:
        found["velocity_m_s"] = scale.velocity(1.0) * curve[1]
        found["frequency_hz"] = scale.frequency_hz(1.0, 1.0) * curve[2] * curve[1]
    return {"stiffness_curve": found}


Curve = tuple["Real", "Real", "Real"]


def _print(case: Case, result: RootLocus, curve: Curve | None, scale: Scale | None) -> None:
    say(case.title)
    low, high = result.searched
    flutter = result.flutter
    name = "U*" if case.scale is None else case.scale.speed_name
    facts: dict[str, Any] = {}
    if flutter is None:
        facts["flutter"] = f"none between {name} = {low:.4g} and {high:.4g}"
    else:
        hertz = (
            "" if scale is None else f"  ({scale.frequency_hz(flutter.k, flutter.speed):.5g} Hz)"
        )
        facts[f"flutter speed {name}"] = f"{flutter.speed:.6f}{_si(scale, flutter.speed)}"
        facts["reduced frequency k"] = f"{shown(_reduced(case, flutter))}{hertz}"
        if case.imported is None:
            facts["omega/omega_alpha"] = flutter.omega_ratio
    facts[f"divergence speed {name}"] = (
        f"none up to {name} = {high:.4g}"
        if result.divergence is None
        else f"{result.divergence:.6f}{_si(scale, result.divergence)}"
    )
    if result.unstable_at_low:
        facts["note"] = f"an oscillation grows already at the lowest speed searched, {low:.4g}"
    show_facts(facts)
    if len(result.crossings) > 1:
        _show_crossings(case, result, scale)
    if curve is not None:
        _show_stiffness(curve, scale)


def _show_crossings(case: Case, result: RootLocus, scale: Scale | None) -> None:
    imported, rows = case.imported is not None, []
    for one in result.crossings:
        si = [scale.velocity(one.speed), scale.frequency_hz(one.k, one.speed)] if scale else []
        own = [] if imported else [one.omega_ratio]
        becomes = "growing" if one.growing else "damped"
        rows.append((one.speed, *si, _reduced(case, one), *own, becomes))
    units = ("V (m/s)", "f (Hz)") if scale else ()
    name = "crossing" if imported else "crossing at U*"
    own_names = () if imported else ("omega/omega_alpha",)
    show_table((name, *units, "k", *own_names, "becomes"), rows)


def _reduced(case: Case, one: Crossing) -> float:
    """Reduced frequency of a crossing; NaN where no semichord is known."""
    return one.k if case.scale is None else float(case.scale.reduced(one.k, one.speed))


def _show_stiffness(curve: Curve, scale: Scale | None) -> None:
    rows = []
    for stiffness, speed, k in zip(*(map(float, one) for one in curve), strict=True):
        si = [scale.velocity(speed), scale.frequency_hz(k, speed)] if scale else []
        rows.append((stiffness, speed, *si, k))
    units = ("V (m/s)", "f (Hz)") if scale else ()
    show_table(("stiffness N", "flutter U*", *units, "k"), rows)


def _si(scale: Scale | None, speed: float) -> str:
    return "" if scale is None else f"  ({scale.velocity(speed):.5g} m/s)"


def _figure(case: Case, result: RootLocus, curve: Curve | None, scale: Scale | None) -> Figure:
    from aeroflutter.plots.rootlocus import plot_root_locus, plot_stiffness
    from aeroflutter.plots.style import literal

    if curve is not None:
        return plot_stiffness(curve[0], curve[1], literal(case.title), scale)
    return plot_root_locus(result, literal(case.title), scale)
