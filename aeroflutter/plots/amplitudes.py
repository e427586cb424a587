"""Amplitude of limit cycles against airspeed by every method: the thesis's 'c' figures."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from aeroflutter.plots import layout, meaning
from aeroflutter.plots import style as look
from aeroflutter.plots.branches import Line, draw_line, frame
from aeroflutter.results.unit import told

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from aeroflutter.orbits.cycles import CycleFamily, LimitCycles
    from aeroflutter.orbits.describing import DescribingCurve

    Array = np.ndarray


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
    across = look.Airspeed.of(cycles.flutter_speed)
    with look.style():
        figure, axes = layout.figure(width=6.4, height=4.4)
        estimate = [
            _line(curve.speed[mine], curve.amplitude[mine], curve.stable[mine], across)
            for one in curve.families
            for mine in [curve.family == one.number]
        ]
        exact = [_line(*_columns(family), across) for family in cycles.families]
        _draw(axes, estimate, "describing function", meaning.DESCRIBING, linewidth=2.8)
        _draw(axes, exact, "exact", meaning.EXACT, linewidth=1.2)
        layout.stability(axes)
        _simulated(axes, simulated)
        frame(axes, [*estimate, *exact], across, cycles.flutter_speed)
        layout.finish(figure, title)
    return figure


def _columns(family: CycleFamily) -> tuple[Array, Array, Array]:
    speed, amplitude, stable = np.transpose(
        [(one.speed, one.amplitude, one.stable) for one in family.cycles]
    )
    return speed, amplitude, stable


def _line(speed: Array, amplitude: Array, stable: Array, across: look.Airspeed) -> Line:
    return Line(speed / across.unit, told(amplitude), stable.astype(bool))


def _draw(axes: Axes, lines: list[Line], label: str, colour: str, **line: float) -> None:
    layout.name(axes, label, color=colour, **line)
    for one in lines:
        draw_line(axes, one, colour, **line)


def _simulated(axes: Axes, simulated: tuple[Array, Array]) -> None:
    """Small rings over the curves; the many starts that end on one cycle make one ring."""
    points = np.unique(np.round(np.column_stack(simulated), 6), axis=0)
    if points.size:
        axes.plot(
            points[:, 0], points[:, 1], "o", label="simulated", zorder=3, color=meaning.INK,
            markersize=3.5, markerfacecolor="white", markeredgewidth=0.8,
        )  # fmt: skip
