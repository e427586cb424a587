"""`aeroflutter pk`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from aeroflutter.cli.airspeed import pair
from aeroflutter.cli.common import (
    CaseName,
    CaseOptions,
    Output,
    numbers,
    say,
    show_facts,
    show_table,
)
from aeroflutter.cli.former import former
from aeroflutter.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from aeroflutter.case import Case
    from aeroflutter.linear.pk import PKResult
    from aeroflutter.linear.rootlocus import Crossing
    from aeroflutter.model.elsewhere.modal import ModalModel


def pk(
    case: CaseName,
    *,
    velocity: Annotated[
        str | None,
        Parameter(help="Airspeeds V in m/s, A:B:N or low,high; the model's own by default."),
    ] = None,
    points: Annotated[int, Parameter(help="Airspeeds of the diagrams.")] = 201,
    figure: Annotated[
        Literal["vg", "fit"],
        Parameter(help="What --plot draws: V-g and V-f, or the error of the approximation."),
    ] = "vg",
    low: Annotated[float | None, Parameter(show=False)] = None,
    high: Annotated[float | None, Parameter(show=False)] = None,
    options: CaseOptions = CaseOptions(),
    output: Output = Output(),
) -> None:
    """Flutter of a modal model by the p-k method, beside that of its rational approximation.

    The p-k method takes the tabulated air forces as they are, so it tells what the approximation
    on which all other commands stand is worth: crossings of both, and its error at every k.
    """
    from aeroflutter.linear.pk import PKOptions, pk_method
    from aeroflutter.linear.rootlocus import RootLocusOptions, root_locus
    from aeroflutter.results import fields_of, to_dataset

    output.check()
    loaded = options.load(case, angle=False)
    modal = None if loaded.imported is None else loaded.imported.modal
    if modal is None:
        raise InputError(f'{loaded.source}: model.kind: p-k needs air forces over k, "modal"')
    output.begin(loaded, "pk")
    former({"--low": low, "--high": high}, "--velocity LOW,HIGH")
    ends = modal.search_range
    if velocity is not None:
        asked = numbers("--velocity", velocity)
        points = points if asked.size == 2 else asked.size
        ends = pair("--velocity", f"{asked[0]},{asked[-1]}")
    settings = PKOptions(
        low=ends[0] if low is None else low, high=ends[1] if high is None else high, points=points
    )
    result = pk_method(modal.whole(), settings)
    others = root_locus(loaded.loop()[0], RootLocusOptions(low=settings.low, high=settings.high))
    output.deliver(
        {
            "title": loaded.title,
            **fields_of(result, loaded),
            "approximation": _approximation(modal, others.crossings),
        },
        text=lambda: _print(loaded, modal, result, others.crossings),
        dataset=lambda: to_dataset(result, case=loaded),
        figure=lambda: _figure(loaded, modal, result, others.crossings, figure),
        command="pk",
    )


def _approximation(modal: ModalModel, crossings: tuple[Crossing, ...]) -> dict[str, Any]:
    fit = modal.fit
    return {
        "method": fit.method,
        "lag_roots": fit.distinct_roots,
        "exact": list(fit.exact),
        "errors": [{"k": k, "error": e} for k, e in zip(fit.forces.k, fit.errors, strict=True)],
        "crossings": [
            {"speed": one.speed, "k": one.k, "growing": one.growing} for one in crossings
        ],
        "warnings": list(fit.warnings),
    }


def _hertz(crossing: Crossing, semichord: float) -> float:
    return crossing.k * crossing.speed / (2 * math.pi * semichord)


def _print(case: Case, modal: ModalModel, result: PKResult, others: tuple[Crossing, ...]) -> None:
    say(case.title)
    b, flutter = result.semichord, result.flutter
    low, high = result.speeds[0], result.speeds[-1]
    facts: dict[str, Any] = {}
    if flutter is None:
        facts["flutter"] = f"none between {low:.6g} and {high:.6g} m/s"
    else:
        facts["flutter speed"] = f"{flutter.speed:.6g} m/s"
        facts["frequency"] = f"{_hertz(flutter, b):.6g} Hz"
        facts["reduced frequency k"] = flutter.k
    facts["divergence speed"] = (
        f"none up to {high:.6g} m/s"
        if result.divergence is None
        else f"{result.divergence:.6g} m/s"
    )
    facts["error of Q"] = f"{modal.fit.errors.max():.2%} at worst"
    show_facts(facts)
    for line in modal.fit.warnings:
        say(f"warning: {line}")
    rows = [
        (
            one.speed,
            _hertz(one, b),
            one.k,
            "growing" if one.growing else "damped",
            _near(one, others),
        )
        for one in result.crossings
    ]
    if rows:
        show_table(("crossing (m/s)", "Hz", "k", "becomes", "approximation (m/s)"), rows)
    if len(others) != len(rows):
        listed = ", ".join(f"{one.speed:.5g}" for one in others) or "none"
        say(f"note: the approximation crosses at {listed} m/s")


def _near(crossing: Crossing, others: tuple[Crossing, ...]) -> str:
    """The crossing of the approximation that belongs to one of the table, and how far it is."""
    alike = [one for one in others if one.growing == crossing.growing]
    if not alike:
        return "-"
    best = min(
        alike,
        key=lambda one: abs(one.speed / crossing.speed - 1) + abs(one.k / crossing.k - 1),
    )
    return f"{best.speed:.5g} ({best.speed / crossing.speed - 1:+.2%})"


def _figure(
    case: Case, modal: ModalModel, result: PKResult, others: tuple[Crossing, ...], which: str
) -> Figure:
    from aeroflutter.plots.pk import plot_fit, plot_pk

    if which == "fit":
        return plot_fit(modal.fit, case.title)
    return plot_pk(result, case.title, others)
