"""Exact limit cycles: amplitude against airspeed, and multipliers on the unit circle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from aeroflutter.plots import style as look

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from aeroflutter.model.section import Scale
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
    scale: Scale | None = None,
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
    """
    across = look.Airspeed.of(result.flutter_speed, scale)
    with look.style():
        figure, axes = look.figure(width=6.8, height=4.4)
        draw(axes, result, across, at, overlays, label)
        if title:
            look.headline(figure, title)
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
    for one in overlays:
        if one.kind == "curve":
            _draw_curve(axes, one, across.unit)
    for family in result.families:
        _family(axes, family, across.unit)
    _mark(axes, result, across.unit)
    _draw_points(axes, overlays, across.unit)
    if at:
        _mark_at(axes, at, across.unit, label)
    _limits(axes, result, across.unit)
    axes.set_xlabel(across.label)
    axes.set_ylabel(look.AMPLITUDE)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="upper left")
    axes.set_title("stable solid, unstable dashed")


def plot_multipliers(
    result: LimitCycles,
    title: str = "",
    at: Sequence[Cycle] | None = None,
    scale: Scale | None = None,
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
    scale
        Shows airspeeds in m/s.
    """
    across = look.Airspeed.of(result.flutter_speed, scale)
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
                shown = _circle(axes, cycles, _abscissa(cycles, across.unit))
                figure.colorbar(shown, ax=axes, label=across.label, shrink=0.8)
                axes.set_title(f"family {cycles[0].family}")
            else:
                _circle(axes, cycles, [_STABILITY[cycle.stable] for cycle in cycles])
                axes.set_title("blue: of stable cycles")
        for axes in grid.flat[len(groups) :]:
            axes.remove()
        if title:
            look.headline(figure, title)
    return figure


def plot_tolerance(result: Tolerance, title: str = "", scale: Scale | None = None) -> Figure:
    """Cycles of the tolerable spring under their limit, beside how their size depends on it.

    Parameters
    ----------
    result
        The answer.
    title
        Written above.
    scale
        Shows airspeeds in m/s.
    """
    with look.style():
        figure, panels = look.figure(1, 2, width=10.0, height=4.2)
        draw_tolerance(panels[0], result, look.Airspeed.of(result.branch.flutter_speed, scale))
        _trials(panels[1], result)
        if title:
            look.headline(figure, title)
    return figure


def draw_tolerance(axes: Axes, result: Tolerance, across: look.Airspeed) -> None:
    """The cycles of the tolerable spring, with the limit and the highest speed."""
    size = result.factor if result.vary == "size" and np.isfinite(result.factor) else 1.0
    branch = _scaled(result.branch, size)
    draw(axes, branch, across)
    limit, speed = float(np.degrees(result.amplitude)), result.speed / across.unit
    if result.worst is not None:
        axes.plot(
            result.worst.speed / across.unit, size * np.degrees(result.worst.amplitude),
            "o", color=look.VERMILION, label="largest stable cycle",
        )  # fmt: skip
    axes.axhline(limit, color=look.VERMILION, linewidth=0.9, linestyle="--", label="limit")
    low, high = axes.get_xlim()
    pad = 0.02 * (high - low)
    axes.set_xlim(min(low, speed - pad), max(high, speed + pad))
    axes.set_ylim(top=max(axes.get_ylim()[1], 1.15 * limit))
    look.mark_speed(axes, speed, "highest speed", colour=look.VERMILION)
    axes.legend(loc="upper left")


def _scaled(branch: LimitCycles, factor: float) -> LimitCycles:
    """The cycles of a spring of another size: at the same speeds, larger by that factor."""
    if factor == 1.0:
        return branch

    def larger(cycle: Cycle) -> Cycle:
        return replace(cycle, amplitude=factor * cycle.amplitude)

    families = tuple(
        replace(
            family,
            cycles=tuple(map(larger, family.cycles)),
            bifurcations=tuple(replace(e, cycle=larger(e.cycle)) for e in family.bifurcations),
        )
        for family in branch.families
    )
    return replace(branch, families=families)


NAMES_OF_VARIED = {
    "gap": r"whole gap $\Delta H$ (deg)",
    "friction": r"$\Delta V$, twice the friction (deg)",
}


def _trials(axes: Axes, result: Tolerance) -> None:
    """The largest stable amplitude against what varies, with the limit and the answer."""
    limit = float(np.degrees(result.amplitude))
    axes.axhline(limit, color=look.VERMILION, linewidth=0.9, linestyle="--", label="limit")
    if result.vary == "size" or not result.trials:
        reach = 1.5 * result.factor if np.isfinite(result.factor) else 1.0
        worst = 0.0 if result.worst is None else float(np.degrees(result.worst.amplitude))
        axes.plot([0.0, reach], [0.0, reach * worst], color=look.BLUE)
        axes.set_xlabel("size over that of the case")
        if np.isfinite(result.factor):
            axes.axvline(result.factor, color=look.GREY, linestyle=":", label="answer")
    else:
        tried = np.degrees(np.array(result.trials))
        shown = tried[:, 1] <= 4.0 * limit
        axes.plot(tried[shown, 0], tried[shown, 1], ".-", color=look.BLUE)
        axes.set_xlabel(NAMES_OF_VARIED[result.vary])
        if result.spring is not None:
            name = "delta_v" if result.vary == "friction" else "delta_h"
            answer = float(np.degrees(getattr(result.spring, name)))
            axes.axvline(answer, color=look.GREY, linestyle=":", label=f"answer {answer:.4g}")
    axes.set_ylim(bottom=0.0)
    axes.set_ylabel("largest stable amplitude (deg)")
    axes.set_title("up to the highest speed")
    axes.legend(loc="upper left")


def _abscissa(cycles: Sequence[Cycle], unit: float) -> NDArray[np.float64]:
    return np.array([cycle.speed / unit for cycle in cycles])


def _family(axes: Axes, family: CycleFamily, unit: float) -> None:
    colour = look.CYCLE[(family.number - 1) % len(look.CYCLE)]
    x = _abscissa(family.cycles, unit)
    y = np.degrees([cycle.amplitude for cycle in family.cycles])
    stable = np.array([cycle.stable for cycle in family.cycles])
    for run, solid in look.segments(stable):
        axes.plot(x[run], y[run], "-" if solid else "--", color=colour)


def _mark(axes: Axes, result: LimitCycles, unit: float) -> None:
    labelled: set[str] = set()
    for event in sorted(result.bifurcations, key=_rank):
        marker, colour = _MARKS[event.kind]
        axes.plot(
            event.cycle.speed / unit,
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


def _draw_curve(axes: Axes, one: Overlay, unit: float) -> None:
    x, y = one.speed / unit, np.degrees(one.amplitude)
    stable = np.ones(x.size, dtype=bool) if one.stable is None else one.stable
    family = np.zeros(x.size, dtype=int) if one.family is None else one.family
    axes.plot([], [], "-", color=look.GREY, linewidth=1.0, label=one.label)
    for number in np.unique(family):
        mine = np.flatnonzero(family == number)
        for run, solid in look.segments(stable[mine]):
            part = mine[run]
            line = "-" if solid else "--"
            axes.plot(x[part], y[part], line, color=look.GREY, linewidth=1.0)


def _draw_points(axes: Axes, overlays: Sequence[Overlay], unit: float) -> None:
    points = [one for one in overlays if one.kind == "points"]
    for i, one in enumerate(points):
        axes.plot(
            one.speed / unit,
            np.degrees(one.amplitude),
            _POINTS[i % len(_POINTS)],
            color=look.VERMILION if i else look.GREEN,
            markerfacecolor="none",
            markersize=4,
            linestyle="none",
            label=one.label,
        )


def _mark_at(axes: Axes, cycles: Sequence[Cycle], unit: float, label: str) -> None:
    axes.axvline(_abscissa(cycles[:1], unit)[0], color=look.GREY, linewidth=0.8, linestyle=":")
    axes.plot(
        _abscissa(cycles, unit),
        np.degrees([cycle.amplitude for cycle in cycles]),
        "o",
        color=look.VERMILION,
        linestyle="none",
        label=label,
    )


def _limits(axes: Axes, result: LimitCycles, unit: float) -> None:
    """Show what lies around the lowest cycles: near flutter amplitudes grow without bound."""
    if not result.cycles:
        return
    x = _abscissa(result.cycles, unit)
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
