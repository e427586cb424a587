"""Exact limit cycles: amplitude against airspeed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from aeroflutter.plots import layout, meaning
from aeroflutter.plots import style as look
from aeroflutter.plots.branches import (
    Line,
    draw_line,
    frame,
    mark_bifurcations,
    method_lines,
)
from aeroflutter.plots.multipliers import plot_multipliers
from aeroflutter.results.unit import told

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from aeroflutter.guarantees.absence import Absence
    from aeroflutter.model.section import Scale
    from aeroflutter.orbits.cycles import Cycle, LimitCycles

__all__ = ["Overlay", "draw", "plot_cycles", "plot_multipliers", "shade_free"]

_POINTS = ("o", "x", "^", "+", "D")


@dataclass(frozen=True)
class Overlay:
    """Amplitudes from elsewhere to draw over a branch.

    Attributes
    ----------
    label
        What they are.
    kind
        Whether to draw a curve or points.
    speed, amplitude
        U* and amplitude, rad, (m,).
    stable, family
        Of a curve: stability and number of the family of each point, (m,).
    """

    label: str
    kind: Literal["curve", "points"]
    speed: NDArray[np.float64]
    amplitude: NDArray[np.float64]
    stable: NDArray[np.bool_] | None = None
    family: NDArray[np.int64] | None = None


def plot_cycles(
    result: LimitCycles,
    title: str = "",
    at: Sequence[Cycle] | None = None,
    overlays: Sequence[Overlay] = (),
    label: str = "cycles listed",
    scale: Scale | None = None,
    free: Absence | None = None,
) -> Figure:
    """Amplitude against speed: stable solid, unstable dashed, bifurcations marked.

    Parameters
    ----------
    result
        The families.
    title
        Written above.
    at
        Cycles at one speed to mark.
    overlays
        Amplitudes from elsewhere.
    label
        What the marked cycles are called.
    scale
        Shows airspeeds in m/s.
    free
        What is proved free of oscillation, which is shaded.
    """
    across = look.Airspeed.of(result.flutter_speed, scale)
    with look.style():
        figure, axes = layout.figure(width=6.8, height=4.4)
        draw(axes, result, across, at, overlays, label)
        shade_free(axes, free, result.flutter_speed, scale)
        layout.finish(figure, title)
    return figure


def draw(
    axes: Axes,
    result: LimitCycles,
    across: look.Airspeed,
    at: Sequence[Cycle] | None = None,
    overlays: Sequence[Overlay] = (),
    label: str = "cycles listed",
) -> None:
    """The same into axes."""
    others = [_curve(axes, one, across.unit) for one in overlays if one.kind == "curve"]
    lines = [
        Line(
            _abscissa(family.cycles, across.unit),
            told(np.array([cycle.amplitude for cycle in family.cycles])),
            np.array([cycle.stable for cycle in family.cycles]),
            f"family {family.number}",
        )
        for family in result.families
    ]
    method_lines(axes, lines, "exact cycles", meaning.EXACT)
    if lines:
        layout.stability(axes)
    events = [
        (event.kind, event.cycle.speed / across.unit, float(told(event.cycle.amplitude)))
        for event in result.bifurcations
    ]
    mark_bifurcations(axes, events)
    marks = [(x, y) for _, x, y in events] + _points(axes, overlays, across.unit)
    if at:
        marks += _listed(axes, at, across.unit, label)
    frame(axes, [*lines, *others], across, result.flutter_speed, marks)


def shade_free(
    axes: Axes, free: Absence | None, flutter: float | None, scale: Scale | None = None
) -> None:
    """Shade the airspeeds that are proved free of oscillation."""
    if free is None or free.certificate is None:
        return
    unit = look.Airspeed.of(flutter, scale).unit
    end = (flutter or 1.0) / unit
    low, high = free.low / unit, free.high / unit
    left, right = axes.get_xlim()
    left = min(left, high - 0.25 * (max(right, end) - high))
    label = "proved free" if free.certified else "free, not certified"
    axes.axvspan(
        max(low, left), high, color=meaning.PROVED, alpha=meaning.SHADING, linewidth=0, label=label
    )
    axes.set_xlim(left, max(right, high))


def _abscissa(cycles: Sequence[Cycle], unit: float) -> NDArray[np.float64]:
    return np.array([cycle.speed / unit for cycle in cycles])


def _curve(axes: Axes, one: Overlay, unit: float) -> Line:
    """Draw a curve from elsewhere; all of it as one line, for the limits."""
    x, y = one.speed / unit, told(one.amplitude)
    stable = np.ones(x.size, dtype=bool) if one.stable is None else one.stable
    family = np.zeros(x.size, dtype=int) if one.family is None else one.family
    look_of = {"color": meaning.DESCRIBING, "linewidth": 2.6}
    layout.name(axes, one.label, **look_of)
    for number in np.unique(family):
        mine = family == number
        draw_line(axes, Line(x[mine], y[mine], stable[mine]), meaning.DESCRIBING, linewidth=2.6)
    return Line(x, y, stable)


def _points(axes: Axes, overlays: Sequence[Overlay], unit: float) -> list[tuple[float, float]]:
    """Draw points from elsewhere; those of sizes that the curves have are to be in view."""
    places: list[tuple[float, float]] = []
    points = [one for one in overlays if one.kind == "points"]
    for i, one in enumerate(points):
        x, y = one.speed / unit, told(one.amplitude)
        axes.plot(
            x, y, _POINTS[i % len(_POINTS)], color=meaning.INK, markerfacecolor="none",
            markersize=5, linestyle="none", label=one.label, zorder=3.5,
        )  # fmt: skip
        places += list(zip(x.tolist(), y.tolist(), strict=True))
    usual = 3.0 * float(np.median([y for _, y in places])) if places else 0.0
    return [(x, y) for x, y in places if y < usual]


def _listed(
    axes: Axes, cycles: Sequence[Cycle], unit: float, label: str
) -> list[tuple[float, float]]:
    """Mark the cycles at one speed."""
    x = _abscissa(cycles, unit)
    y = told(np.array([cycle.amplitude for cycle in cycles]))
    axes.axvline(x[0], color=meaning.INK, linewidth=0.7)
    axes.plot(
        x, y, "o", markersize=7, color=meaning.INK, markerfacecolor="none", linestyle="none",
        label=label, zorder=3.5,
    )  # fmt: skip
    return list(zip(x.tolist(), y.tolist(), strict=True))


def __getattr__(name: str) -> Any:
    """Names that lived here: `plot_tolerance`, `draw_tolerance`."""
    if name in ("plot_tolerance", "draw_tolerance"):
        from aeroflutter.plots import tolerance

        return getattr(tolerance, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
