"""Amplitude of limit cycles against airspeed by every method: the thesis's 'c' figures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.plots import style as look

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from aeroflutter.orbits.cycles import LimitCycles
    from aeroflutter.orbits.describing import DescribingCurve

    Array = np.ndarray

_RING: dict[str, Any] = {
    "color": look.BLACK,
    "markersize": 3.5,
    "markerfacecolor": "white",
    "markeredgewidth": 0.8,
}


def plot_amplitudes(
    curve: DescribingCurve, cycles: LimitCycles, simulated: tuple[Array, Array], title: str = ""
) -> Figure:
    """Describing function, exact cycles and simulated ones; stable solid, unstable dashed.

    Parameters
    ----------
    curve
        The describing function's curve.
    cycles
        The exact one.
    simulated
        Speed ratios and amplitudes (deg) of cycles that time marching ended on.
    title
        Written above.
    """
    with look.style():
        figure, axes = look.figure(width=6.4, height=4.2)
        for one in curve.families:
            mine = curve.family == one.number
            _line(
                axes,
                (curve.speed_ratio[mine], np.degrees(curve.amplitude[mine]), curve.stable[mine]),
                look.ORANGE,
                width=2.8,
            )
        for family in cycles.families:
            points = [(c.speed_ratio, np.degrees(c.amplitude), c.stable) for c in family.cycles]
            ratio, amplitude, stable = (np.array(column) for column in zip(*points, strict=True))
            _line(axes, (ratio, amplitude, stable), look.BLUE)
        _name(axes)
        _simulated(axes, simulated)
        _finish(axes, curve, cycles)
        if title:
            look.headline(figure, title)
    return figure


def _line(axes: Axes, points: tuple[Array, Array, Array], colour: str, width: float = 1.2) -> None:
    ratio, amplitude, stable = points
    for part, solid in look.segments(stable):
        axes.plot(
            ratio[part], amplitude[part], "-" if solid else "--", color=colour, linewidth=width
        )


def _simulated(axes: Axes, simulated: tuple[Array, Array]) -> None:
    """Small rings over the curves; the many starts that end on one cycle make one ring."""
    points = np.unique(np.round(np.column_stack(simulated), 6), axis=0)
    if points.size:
        axes.plot(points[:, 0], points[:, 1], "o", label="simulated", zorder=3, **_RING)


def _name(axes: Axes) -> None:
    """What the colours of the curves are, before the rings in the legend."""
    axes.plot([], [], color=look.ORANGE, linewidth=2.8, label="describing function")
    axes.plot([], [], color=look.BLUE, label="exact")


def _finish(axes: Axes, curve: DescribingCurve, cycles: LimitCycles) -> None:
    """Limits that show both onsets."""
    axes.legend(loc="upper left", title="stable solid, unstable dashed")
    onset = cycles.onset
    first = 0.5 if onset is None else onset.cycle.speed_ratio
    if curve.onset is not None:
        first = min(first, curve.onset.speed_ratio)
    size = 1.0 if onset is None else np.degrees(onset.cycle.amplitude)
    last = 1.0 + 0.05 * (1.0 - min(first, 0.95))
    axes.set_xlim(first - 0.15 * (last - first), last)
    axes.set_ylim(0.0, 12.0 * size)
    look.mark_speed(axes, 1.0, "linear flutter")
    axes.set_xlabel(look.SPEED_RATIO)
    axes.set_ylabel(look.AMPLITUDE)
