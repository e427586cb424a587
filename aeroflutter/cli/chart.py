"""`aeroflutter onset --chart`: friction over gap against speed."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from aeroflutter.cli.airspeed import axis_of_speeds
from aeroflutter.cli.common import Output, flutter_facts, say, show_facts
from aeroflutter.cli.show import show_table
from aeroflutter.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from aeroflutter.case import Case
    from aeroflutter.guarantees.chart import Chart
    from aeroflutter.model.section import Scale

__all__ = ["charted"]


def charted(case: Case, text: str, output: Output) -> None:
    """Print, save and draw the friction over gap that the case needs at some speeds."""
    from aeroflutter.cli.progress import counting
    from aeroflutter.guarantees.absence import Uncovered
    from aeroflutter.guarantees.chart import friction_chart

    scale = output.begin(case, "onset")
    family, speeds = case.family(), axis_of_speeds("--chart", text, case)
    try:
        with counting("speeds") as tick:
            result = friction_chart(family, case.spring, speeds, lambda: tick(None))
    except Uncovered as why:
        raise InputError(f"--chart: {why}") from None
    output.result(
        case,
        lambda: result,
        text=lambda: _print(case, result, scale),
        figure=lambda: _figure(case, result, scale),
        command="onset",
    )


def _print(case: Case, result: Chart, scale: Scale | None) -> None:
    say(case.title)
    how = "" if result.certified else " (not certified)"
    facts: dict[str, Any] = flutter_facts(result.flutter_speed, scale)
    facts["friction over gap of the case"] = f"{result.own:.6g} (delta_v / delta_h)"
    facts["proved"] = f"with at least this friction over gap nothing oscillates at that speed{how}"
    facts["exact"] = "with more no limit cycle was found up to that speed"
    show_facts(facts)
    headings = ["U*" if result.flutter_speed is None else "U*/U*_L", "proved", "exact", "the case"]
    rows = [
        [speed / (result.flutter_speed or 1.0), proved, exact, _where(result.own, proved, exact)]
        for speed, proved, exact in zip(
            result.speeds, result.proved_ratios, result.exact_ratios, strict=True
        )
    ]
    if scale is not None:
        headings.insert(0, "V (m/s)")
        for row, speed in zip(rows, result.speeds, strict=True):
            row.insert(0, scale.velocity(speed))
    show_table(headings, rows)
    for note in result.notes:
        say(f"note: {note}")


def _where(own: float, proved: float, exact: float) -> str:
    """What the ratios mean for the case itself."""
    if own > proved or own == proved > 0.0:
        return "proved free"
    return "not known" if math.isnan(exact) or own > exact else "limit cycles"


def _figure(case: Case, result: Chart, scale: Scale | None) -> Figure:
    from aeroflutter.plots.onset import plot_chart
    from aeroflutter.plots.style import literal

    return plot_chart(result, literal(case.title), scale)
