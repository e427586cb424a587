"""The figure of `aeroflutter onset`: cycles beside the speeds that are proved free of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from aeroflutter.plots import style as look

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from aeroflutter.guarantees.onset import Onset
    from aeroflutter.model.section import Scale

__all__ = ["plot_onset", "shade_free"]


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
        shade_free(axes, result, scale)
    return figure


def shade_free(axes: Axes, result: Onset, scale: Scale | None = None) -> None:
    """Shade what is proved free, and mark where that ends."""
    if result.free is None or result.free_below is None:
        return
    unit = look.Airspeed.of(result.flutter_speed, scale).unit
    end = (result.flutter_speed or 1.0) / unit
    low, high = result.free.low / unit, result.free_below / unit
    left, right = axes.get_xlim()
    left = min(left, high - 0.25 * (max(right, end) - high))
    label = "proved free" if result.free.certified else "free, not certified"
    axes.axvspan(max(low, left), high, color=look.GREEN, alpha=0.15, linewidth=0, label=label)
    axes.set_xlim(left, max(right, high))
    axes.legend()
