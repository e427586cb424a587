"""Exact limit cycles: amplitude against airspeed, and multipliers on the unit circle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from aeroflutter.plots import style as look

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from aeroflutter.orbits.cycles import Bifurcation, Cycle, CycleFamily, LimitCycles
    from aeroflutter.studies.tolerance import Tolerance

__all__ = ["Overlay", "plot_cycles", "plot_multipliers", "plot_tolerance"]

_MARKS = {
    "fold": ("o", look.BLACK),
    "corner": ("v", look.BLACK),
    "symmetry-breaking": ("s", look.PURPLE),
    "period-doubling": ("D", look.ORANGE),
    "neimark-sacker": ("*", look.GREEN),
    "grazing": ("|", look.GREY),
}
_PANELS = 6
_REACH = 1.7  # larger multipliers are not drawn
_STABILITY = {True: look.BLUE, False: look.VERMILION}
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
    """
    with look.style():
        figure, axes = look.figure(width=6.8, height=4.4)
        for one in overlays:
            if one.kind == "curve":
                _draw_curve(axes, one, result.flutter_speed)
        for family in result.families:
            _family(axes, family, result.flutter_speed)
        _mark(axes, result)
        _draw_points(axes, overlays, result.flutter_speed)
        if at:
            _mark_at(axes, at, result.flutter_speed, label)
        _limits(axes, result)
        axes.set_xlabel(look.SPEED if result.flutter_speed is None else look.SPEED_RATIO)
        axes.set_ylabel(look.AMPLITUDE)
        if axes.get_legend_handles_labels()[0]:
            axes.legend(loc="upper left")
        axes.set_title("stable solid, unstable dashed")
        if title:
            look.headline(figure, title)
    return figure


def plot_multipliers(
    result: LimitCycles, title: str = "", at: Sequence[Cycle] | None = None
) -> Figure:
    """Floquet multipliers in the complex plane, one panel a family; those that are one left out.

    Parameters
    ----------
    result
        The families.
    title
        Written above.
    at
        Draw only these cycles, in one panel.
    """
    families = result.families[:_PANELS]
    groups = [one.cycles for one in families] if at is None else [tuple(at)]
    columns = min(3, max(1, len(groups)))
    rows = max(1, -(-len(groups) // columns))
    with look.style():
        figure, grid = look.figure(
            rows, columns, width=3.4 * columns + 0.8, height=3.4 * rows + 0.3, squeeze=False
        )
        for axes, cycles in zip(grid.flat, groups, strict=False):
            if at is None:
                shown = _circle(axes, cycles, _abscissa(cycles, result.flutter_speed))
                label = look.SPEED if result.flutter_speed is None else look.SPEED_RATIO
                figure.colorbar(shown, ax=axes, label=label, shrink=0.8)
                axes.set_title(f"family {cycles[0].family}")
            else:
                _circle(axes, cycles, [_STABILITY[cycle.stable] for cycle in cycles])
                axes.set_title("blue: of stable cycles")
        for axes in grid.flat[len(groups) :]:
            axes.remove()
        if title:
            look.headline(figure, title)
    return figure


def plot_tolerance(result: Tolerance, title: str = "") -> Figure:
    """The branch, with the speed asked for and the largest stable cycle up to it."""
    at = [] if result.worst is None else [result.worst]
    figure = plot_cycles(result.branch, title, at, label="largest stable cycle")
    axes, speed = figure.axes[0], result.speed_ratio
    low, high = axes.get_xlim()
    pad = 0.02 * (high - low)
    axes.set_xlim(min(low, speed - pad), max(high, speed + pad))
    with look.style():
        look.mark_speed(axes, speed, "highest speed", colour=look.VERMILION)
    return figure


def _abscissa(cycles: Sequence[Cycle], flutter: float | None) -> NDArray[np.float64]:
    return np.array([cycle.speed / (flutter or 1.0) for cycle in cycles])


def _family(axes: Axes, family: CycleFamily, flutter: float | None) -> None:
    colour = look.CYCLE[(family.number - 1) % len(look.CYCLE)]
    x = _abscissa(family.cycles, flutter)
    y = np.degrees([cycle.amplitude for cycle in family.cycles])
    stable = np.array([cycle.stable for cycle in family.cycles])
    for run, solid in look.segments(stable):
        axes.plot(x[run], y[run], "-" if solid else "--", color=colour)


def _mark(axes: Axes, result: LimitCycles) -> None:
    labelled: set[str] = set()
    for event in sorted(result.bifurcations, key=_rank):
        marker, colour = _MARKS[event.kind]
        axes.plot(
            event.cycle.speed / (result.flutter_speed or 1.0),
            np.degrees(event.cycle.amplitude),
            marker,
            color=colour,
            markersize=7 if marker == "*" else 4.5,
            linestyle="none",
            zorder=3,
            label=None if event.kind in labelled else event.kind,
        )
        labelled.add(event.kind)


def _rank(event: Bifurcation) -> int:
    return list(_MARKS).index(event.kind)


def _draw_curve(axes: Axes, one: Overlay, flutter: float | None) -> None:
    x, y = one.speed / (flutter or 1.0), np.degrees(one.amplitude)
    stable = np.ones(x.size, dtype=bool) if one.stable is None else one.stable
    family = np.zeros(x.size, dtype=int) if one.family is None else one.family
    axes.plot([], [], "-", color=look.GREY, linewidth=1.0, label=one.label)
    for number in np.unique(family):
        mine = np.flatnonzero(family == number)
        for run, solid in look.segments(stable[mine]):
            part = mine[run]
            line = "-" if solid else "--"
            axes.plot(x[part], y[part], line, color=look.GREY, linewidth=1.0)


def _draw_points(axes: Axes, overlays: Sequence[Overlay], flutter: float | None) -> None:
    points = [one for one in overlays if one.kind == "points"]
    for i, one in enumerate(points):
        axes.plot(
            one.speed / (flutter or 1.0),
            np.degrees(one.amplitude),
            _POINTS[i % len(_POINTS)],
            color=look.VERMILION if i else look.GREEN,
            markerfacecolor="none",
            markersize=4,
            linestyle="none",
            label=one.label,
        )


def _mark_at(axes: Axes, cycles: Sequence[Cycle], flutter: float | None, label: str) -> None:
    axes.axvline(_abscissa(cycles[:1], flutter)[0], color=look.GREY, linewidth=0.8, linestyle=":")
    axes.plot(
        _abscissa(cycles, flutter),
        np.degrees([cycle.amplitude for cycle in cycles]),
        "o",
        color=look.VERMILION,
        linestyle="none",
        label=label,
    )


def _limits(axes: Axes, result: LimitCycles) -> None:
    """Show what lies around the lowest cycles: near flutter amplitudes grow without bound."""
    if not result.cycles:
        return
    x = _abscissa(result.cycles, result.flutter_speed)
    y = np.degrees([cycle.amplitude for cycle in result.cycles])
    low, high = float(x.min()), float(x.max())
    pad = 0.04 * max(high - low, 1e-3 * high)
    axes.set_xlim(low - pad, high + pad)
    top = float(y[x <= high - 0.05 * (high - low)].max(initial=0.0)) or float(y.max())
    events = np.degrees([event.cycle.amplitude for event in result.bifurcations])
    if events.size:
        top = min(top, 6 * float(events.max()))
    lines = [line for line in axes.get_lines() if line.get_linestyle() == "None"]
    marks = [float(v) for line in lines for v in np.atleast_1d(line.get_ydata())]
    axes.set_ylim(0, 1.08 * max([top, *(m for m in marks if m < 3 * top)]))


def _circle(axes: Axes, cycles: Sequence[Cycle], colours: NDArray[Any] | Sequence[str]) -> Any:
    """The unit circle and the multipliers of some cycles, one colour a cycle."""
    turn = np.linspace(0, 2 * np.pi, 361)
    axes.plot(np.cos(turn), np.sin(turn), color=look.BLACK, linewidth=0.8)
    values = [cycle.multipliers[2 if cycle.continuum else 1 :] for cycle in cycles]
    z = np.concatenate(values) if values else np.empty(0, dtype=complex)
    c = np.repeat(colours, [part.size for part in values])
    shown = axes.scatter(z.real, z.imag, s=6, c=c, cmap="viridis", zorder=2)
    inside = z[np.abs(z) < _REACH]
    reach = 1.08 * max(1.1, float(np.abs(inside).max(initial=1.0)))
    axes.set_xlim(-reach, reach)
    axes.set_ylim(-reach, reach)
    axes.set_aspect("equal")
    axes.set_xlabel("real part")
    axes.set_ylabel("imaginary part")
    if inside.size < z.size:
        text = f"{z.size - inside.size} beyond the figure, up to {np.abs(z).max():.3g}"
        axes.annotate(text, (0.02, 0.02), xycoords="axes fraction", fontsize=7, color=look.GREY)
    return shown
