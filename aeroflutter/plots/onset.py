"""The figure of `aeroflutter onset`: cycles beside the speeds that are proved free of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from aeroflutter.plots import style as look

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from aeroflutter.guarantees.absence import Absence
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
    from aeroflutter.plots.cycles import plot_cycles

    with look.style():
        if result.cycles is None:
            figure, axes = look.figure(width=6.4, height=4.2)
            axes.set_xlabel(look.Airspeed.of(result.flutter_speed, scale).label)
            axes.set_yticks([])
            if title:
                look.headline(figure, title)
        else:
            figure = plot_cycles(result.cycles, title, scale=scale)
            axes = figure.axes[0]
        shade_free(axes, result.free, result.flutter_speed, scale)
    return figure


def plot_onsets(found: Members, title: str = "", *, si: bool = True) -> Figure:
    """What is proved free, the lowest cycle and flutter against the key that varies."""
    with look.style():
        figure, axes = look.figure(width=6.8, height=4.4)
        draw_onsets(axes, found, si=si)
        if title:
            look.headline(figure, title)
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
    axes.fill_between(values, 0.0, proved, color=look.GREEN, alpha=0.15, linewidth=0)
    axes.plot(values, proved, ".-", color=look.GREEN, label="proved free below")
    axes.plot(values, lowest, ".--", color=look.BLUE, label="lowest limit cycle")
    ends = speeds(lambda one: one.flutter_speed)
    axes.plot(values, ends, ":", color=look.GREY, label="linear flutter")
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel(found.key)
    axes.set_ylabel(shown[0].label)
    axes.legend(loc="lower right")


def plot_chart(result: Chart, title: str = "", scale: Scale | None = None) -> Figure:
    """Friction over gap against speed: proved to be enough, exact, and that of the case."""
    with look.style():
        figure, axes = look.figure(width=6.8, height=4.4)
        draw_chart(axes, result, scale)
        if title:
            look.headline(figure, title)
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
    axes.set_yscale("log" if wide else "linear")
    axes.set_ylim(low, high)
    above = np.maximum(proved, low)
    how = "nothing oscillates, proved" if result.certified else "free, not certified"
    axes.fill_between(x, above, high, color=look.GREEN, alpha=0.15, linewidth=0, label=how)
    axes.plot(x, above, color=look.GREEN, label="proved to be enough")
    axes.plot(x, np.maximum(exact, low), "--", color=look.BLUE, label="limit cycles below")
    if result.own > 0.0:
        axes.axhline(result.own, color=look.GREY, linewidth=0.8, linestyle=":")
        axes.annotate(
            "the case", (x[-1], result.own), xytext=(-2, 3), textcoords="offset points",
            ha="right", fontsize=7.5, color=look.GREY,
        )  # fmt: skip
    axes.set_xlabel(shown.label)
    axes.set_ylabel(r"friction over gap $\Delta V/\Delta H$")
    axes.legend(loc="upper left")


def shade_free(
    axes: Axes, free: Absence | None, flutter: float | None, scale: Scale | None = None
) -> None:
    """Shade the airspeeds that are proved free."""
    if free is None or free.certificate is None:
        return
    unit = look.Airspeed.of(flutter, scale).unit
    end = (flutter or 1.0) / unit
    low, high = free.low / unit, free.high / unit
    left, right = axes.get_xlim()
    left = min(left, high - 0.25 * (max(right, end) - high))
    label = "proved free" if free.certified else "free, not certified"
    axes.axvspan(max(low, left), high, color=look.GREEN, alpha=0.15, linewidth=0, label=label)
    axes.set_xlim(left, max(right, high))
    axes.legend()
