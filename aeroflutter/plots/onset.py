"""The figure of `aeroflutter onset`: cycles beside the speeds that are proved free of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from aeroflutter.plots import layout, meaning
from aeroflutter.plots import style as look
from aeroflutter.plots.cycles import plot_cycles, shade_free

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from aeroflutter.guarantees.chart import Chart
    from aeroflutter.guarantees.onset import Onset
    from aeroflutter.model.section import Scale
    from aeroflutter.studies.vary import Members

__all__ = [
    "draw_chart",
    "draw_onsets",
    "plot_chart",
    "plot_onset",
    "plot_onsets",
    "shade_free",
]


def plot_onset(result: Onset, title: str = "", scale: Scale | None = None) -> Figure:
    """Amplitude against speed, in m/s if there is a scale, what is proved free shaded."""
    with look.style():
        if result.cycles is None:
            across = look.Airspeed.of(result.flutter_speed, scale)
            figure, axes = layout.figure(width=6.4, height=2.6)
            axes.set_xlabel(across.label)
            axes.set_yticks([])
            if result.flutter_speed is not None:
                layout.mark_speed(axes, result.flutter_speed / across.unit, "linear flutter")
            shade_free(axes, result.free, result.flutter_speed, scale)
            return layout.finish(figure, title)
    return plot_cycles(result.cycles, title, scale=scale, free=result.free)


def plot_onsets(found: Members, title: str = "", *, si: bool = True) -> Figure:
    """What is proved free, the lowest cycle and flutter against the key that varies."""
    with look.style():
        figure, axes = layout.figure(width=6.8, height=4.4)
        draw_onsets(axes, found, si=si)
        layout.finish(figure, title)
    return figure


def draw_onsets(axes: Axes, found: Members, *, si: bool = True) -> None:
    """The same in given axes."""
    scales = [member.case.scale for member in found.members]
    si = si and all(scale is not None for scale in scales)
    flutters = [member.result.flutter_speed for member in found.members]
    ratio = not si and None not in flutters
    shown = [
        look.Airspeed.of(flutter if ratio else None, scale if si else None)
        for flutter, scale in zip(flutters, scales, strict=True)
    ]
    values = np.array([member.value for member in found.members])

    def speeds(of: Callable[[Onset], float | None]) -> NDArray[np.float64]:
        every = [of(member.result) for member in found.members]
        return np.array(
            [np.nan if u is None else u / one.unit for u, one in zip(every, shown, strict=True)]
        )

    proved = speeds(lambda one: one.free_below)
    lowest = speeds(lambda one: None if one.lowest is None else one.lowest.cycle.speed)
    axes.fill_between(
        values, 0.0, proved, color=meaning.PROVED, alpha=meaning.SHADING, linewidth=0,
        label="proved free",
    )  # fmt: skip
    axes.plot(values, proved, ".-", color=meaning.PROVED, label="proved free below")
    axes.plot(values, lowest, "o--", color=meaning.EXACT, label="lowest limit cycle")
    ends = speeds(lambda one: one.flutter_speed)
    axes.plot(values, ends, ":", color=meaning.FAINT, label="linear flutter")
    every = np.concatenate((proved, lowest, ends))
    every = every[np.isfinite(every)]
    if every.size:
        room = 0.3 * max(float(np.ptp(every)), 0.05 * float(every.max()))
        axes.set_ylim(max(0.0, float(every.min()) - room), float(every.max()) + 0.5 * room)
    axes.set_xlabel(found.key)
    axes.set_ylabel(shown[0].label)


def plot_chart(result: Chart, title: str = "", scale: Scale | None = None) -> Figure:
    """Friction over gap against speed: proved to be enough, exact, and that of the case."""
    with look.style():
        figure, axes = layout.figure(width=6.8, height=4.4)
        draw_chart(axes, result, scale)
        layout.finish(figure, title)
    return figure


def draw_chart(axes: Axes, result: Chart, scale: Scale | None = None) -> None:
    """The same in given axes; logarithmic where it spans much, as it does towards flutter."""
    shown = look.Airspeed.of(result.flutter_speed, scale)
    x = result.speeds / shown.unit
    proved, exact = (
        np.where(np.isfinite(one), one, np.nan)
        for one in (result.proved_ratios, result.exact_ratios)
    )
    values = np.r_[proved, exact, result.own]
    values = values[np.isfinite(values) & (values > 0.0)]
    low, high = (0.7 * values.min(), 1.4 * values.max()) if values.size else (0.1, 1.0)
    wide = high > 30.0 * low
    low = low if wide else 0.0
    if wide:
        layout.logarithmic(axes.yaxis)
    axes.set_ylim(low, high)
    above = np.maximum(proved, low)
    how = "nothing oscillates, proved" if result.certified else "free, not certified"
    axes.fill_between(
        x, above, high, color=meaning.PROVED, alpha=meaning.SHADING, linewidth=0, label=how
    )
    axes.plot(x, above, color=meaning.PROVED, linewidth=2.4, label="proved to be enough")
    axes.plot(x, np.maximum(exact, low), "--", color=meaning.EXACT, label="limit cycles below")
    if result.own > 0.0:
        axes.axhline(result.own, color=meaning.INK, linewidth=0.9, label="the case's own")
    axes.set_xlabel(shown.label)
    axes.set_ylabel(r"friction over gap $\Delta V/\Delta H$")
