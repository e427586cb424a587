"""Figures of results by what they are: the whole, or its main panel in axes that are given."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from aeroflutter.errors import InputError
from aeroflutter.plots import (
    chaos,
    cycles,
    describing,
    harmonic,
    loop,
    maps,
    members,
    onset,
    pk,
    rootlocus,
    timemarch,
    tolerance,
)
from aeroflutter.plots import style as look
from aeroflutter.results.unit import told_of

if TYPE_CHECKING:
    from aeroflutter.model.section import Scale

__all__ = ["draw"]

Panel = Callable[[Any, Any, "Scale | None"], None]
Whole = Callable[[Any, str, "Scale | None"], Any]


def draw(
    result: Any,
    ax: Any = None,
    *,
    units: str | None = None,
    title: str | None = None,
    width: float | None = None,
) -> Any:
    """Draw a result.

    Parameters
    ----------
    result
        Of an analysis.
    ax : matplotlib Axes, optional
        Draw the main panel there.
    units : str, optional
        "nondimensional", or "si", which is the default where the result's case has SI data.
    title : str, optional
        Written above; by default the title of the case.
    width : float, optional
        Of the figure in mm, such as 85 or 180 for the columns of a journal: text is then of the
        size in which it is read, and panels stand below one another where there is no room.

    Returns
    -------
    Figure or Axes
        The figure that was made, or `ax`.

    Raises
    ------
    InputError
        If there is no figure of such a result, or nothing to draw.
    """
    case = result.context.get("case")
    scale = None if case is None or units == "nondimensional" else case.scale
    if units == "si" and scale is None:
        raise InputError("units: the result belongs to no case with SI data")
    name = type(result[0]).__name__ if isinstance(result, tuple) else type(result).__name__
    if name not in DRAWN:
        raise InputError(f"plot: there is no figure of a {name}")
    panel, whole = DRAWN[name]
    with told_of(case):
        return _drawn(result, ax, panel, whole, scale, title, width)


def _drawn(
    result: Any,
    ax: Any,
    panel: Panel,
    whole: Whole,
    scale: Scale | None,
    title: str | None,
    width: float | None,
) -> Any:
    """The result in axes that are given, or in a figure of its own."""
    case = result.context.get("case")
    if ax is not None:
        with look.style():
            panel(ax, result, scale)
            if ax.get_legend_handles_labels()[0]:
                ax.legend(loc="best")
            if title:
                ax.set_title(title)
        return ax
    words = title if title is not None else look.literal(case.title) if case else ""
    with look.sized(width):
        figure = whole(result, words, scale)
    return figure if case is None else look.named_after(figure, case.model().names[0])


def _of_cycles(axes: Any, result: Any, scale: Scale | None) -> None:
    cycles.draw(axes, result, _across(result, scale))


def _of_cycles_at(axes: Any, result: Any, scale: Scale | None) -> None:
    cycles.draw(axes, result.branch, _across(result.branch, scale), result.cycles)


def _across(result: Any, scale: Scale | None) -> look.Airspeed:
    return look.Airspeed.of(result.flutter_speed, scale)


def _branches(result: Any) -> Any:
    return result if isinstance(result, tuple) else (result,)


def _clock(result: Any, scale: Scale | None) -> look.Clock:
    speed = result.context.get("speed")
    return look.Clock() if speed is None else look.Clock.of(speed, scale)


def _chaos(result: Any, title: str, scale: Scale | None) -> Any:
    case, speed = result.context.get("case"), result.context.get("speed")
    if case is None or speed is None:
        raise InputError("plot: the motion belongs to no case; give ax for its section alone")
    if result.section.pitch.size == 0:
        raise InputError(f"plot: the motion is {result.verdict}, there is no attractor to draw")
    response = result.trace(case.family().at(speed), case.spring)
    return chaos.plot_chaos(result, response, title, _clock(result, scale))


def _sweep(result: Any, title: str, scale: Scale | None) -> Any:
    return maps.plot_sweep(result, title, si=scale is not None)


def _onset(axes: Any, result: Any, scale: Scale | None) -> None:
    if result.cycles is not None:
        cycles.draw(axes, result.cycles, _across(result, scale))
    cycles.shade_free(axes, result.free, result.flutter_speed, scale)


def _tolerance(axes: Any, result: Any, scale: Scale | None) -> None:
    tolerance.draw_tolerance(axes, result, _across(result.branch, scale))


def _passes(axes: Any, result: Any, scale: Scale | None) -> None:
    across = look.Airspeed.of(None, scale)
    one = result if isinstance(result, tuple) else (result,)
    timemarch.draw_sweeps(axes, one, across.unit, across.label)


def _passes_whole(result: Any, title: str, scale: Scale | None) -> Any:
    across = look.Airspeed.of(None, scale)
    one = result if isinstance(result, tuple) else (result,)
    return timemarch.plot_sweeps(one, across.unit, title, label=across.label)


DRAWN: dict[str, tuple[Panel, Whole]] = {
    "RootLocus": (
        lambda axes, one, scale: rootlocus.draw(axes, one, scale=scale),
        rootlocus.plot_root_locus,
    ),
    "DescribingCurve": (
        lambda axes, one, scale: describing.draw(axes, one, _across(one, scale)),
        lambda one, title, scale: describing.plot_describing(one, title, None, scale),
    ),
    "HarmonicBranch": (
        lambda axes, one, scale: harmonic.draw(
            axes, _branches(one), _across(_branches(one)[0], scale)
        ),
        lambda one, title, scale: harmonic.plot_branches(_branches(one), title, scale),
    ),
    "LimitCycles": (
        _of_cycles,
        lambda one, title, scale: cycles.plot_cycles(one, title, scale=scale),
    ),
    "CyclesAt": (
        _of_cycles_at,
        lambda one, title, scale: cycles.plot_cycles(one.branch, title, one.cycles, scale=scale),
    ),
    "LoopTest": (
        lambda axes, one, scale: loop.draw(axes, one),
        lambda one, title, scale: loop.plot_loop(one, title, scale=scale),
    ),
    "Onset": (_onset, onset.plot_onset),
    "Tolerance": (_tolerance, tolerance.plot_tolerance),
    "Chart": (onset.draw_chart, onset.plot_chart),
    "PKResult": (
        lambda axes, one, scale: pk.draw(axes, one),
        lambda one, title, scale: pk.plot_pk(one, title),
    ),
    "Response": (
        lambda axes, one, scale: timemarch.draw(axes, one, _clock(one, scale)),
        lambda one, title, scale: timemarch.plot_overview(one, title, _clock(one, scale)),
    ),
    "Sweep": (_passes, _passes_whole),
    "ChaosResult": (lambda axes, one, scale: chaos.draw(axes, one), _chaos),
    "ChaosScan": (
        lambda axes, one, scale: chaos.draw_scan(axes, one),
        lambda one, title, scale: chaos.plot_chaos_scan(one, title=title),
    ),
    "FlutterMap": (
        lambda axes, one, scale: maps.draw_labelled(axes, one),
        lambda one, title, scale: maps.plot_map(one, title),
    ),
    "SweepResult": (
        lambda axes, one, scale: maps.draw_sweep(axes, one, si=scale is not None),
        _sweep,
    ),
    "Members": (
        lambda axes, one, scale: members.draw(axes, one, si=scale is not None),
        lambda one, title, scale: members.plot_members(one, title, si=scale is not None),
    ),
}
"""Of every result, what draws its main panel and what its whole figure."""
