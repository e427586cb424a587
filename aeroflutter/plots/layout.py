"""Panels, titles, legends and scales of figures, at any width: nothing is written over another.

A legend stands below the panels, where no curve runs, and names what any of them shows. Figures of
a stated width (`style.sized`) put their panels below one another where they would be too narrow.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.plots import meaning
from aeroflutter.plots import style as look

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

__all__ = [
    "figure",
    "finish",
    "logarithmic",
    "mark_speed",
    "name",
    "panels_across",
    "stability",
    "whole_numbers",
]

SYMBOLS = {  # what keys and plain titles call by name
    "omega_bar": r"$\bar\omega$",
    "delta_v": r"$\Delta V$",
    "delta_h": r"$\Delta H$",
    "V_off": r"$V_\mathrm{off}$",
    "H_off": r"$H_\mathrm{off}$",
    "beta3": r"$\beta_3$",
    "rad^2": r"rad$^2$",
    "lco": "limit cycle",
}
INCH = 25.4  # mm
NARROWEST = 50.0  # mm, of a panel beside others
TICK = 0.75  # inch that a label of a tick takes


def panels_across(columns: int) -> int:
    """How many of so many panels stand side by side at the width that is asked for."""
    width = look.WIDTH.get()
    return columns if width is None or width / columns >= NARROWEST else 1


def figure(
    rows: int = 1, columns: int = 1, *, width: float = 6.4, height: float = 4.0, **keywords: Any
) -> tuple[Figure, Any]:
    """A figure without a window, and its axes as ``Figure.subplots`` gives them.

    Parameters
    ----------
    rows, columns
        Of panels.
    width, height : float
        Inches; at a width that `style.sized` states, only the panels' shape counts.
    """
    from matplotlib.figure import Figure

    asked = look.WIDTH.get()
    shape = rows, columns
    if asked is not None:
        panel = height / rows / (width / columns)
        across = panels_across(columns)
        down = rows * columns // across
        width, rows, columns = asked / INCH, down, across
        height = min(down * max(panel, 0.6) * width / across + 0.8, 9.5)
        if shape != (rows, columns):
            keywords = {key: on for key, on in keywords.items() if key not in _RATIOS}
    drawing = Figure(figsize=(width, height), layout="constrained")
    squeeze = keywords.pop("squeeze", True)
    grid = drawing.subplots(rows, columns, squeeze=False, **keywords)
    for axes in grid.flat:
        _sparse(axes, width / columns, height / rows)
    grid = grid.reshape(shape)
    if not squeeze:
        return drawing, grid
    return drawing, grid.item() if grid.size == 1 else grid.squeeze()


_RATIOS = ("width_ratios", "height_ratios")


def _sparse(axes: Axes, width: float, height: float) -> None:
    """No more ticks than there is room for."""
    from matplotlib.ticker import MaxNLocator

    for axis, room, each in ((axes.xaxis, width - 0.7, TICK), (axes.yaxis, height - 0.6, 0.4)):
        count = int(np.clip(room / each, 3, 7))
        axis.set_major_locator(MaxNLocator(count, steps=[1, 2, 2.5, 5, 10]))


def finish(drawing: Figure, title: str = "", *, key: str = "") -> Figure:
    """Write the title above and one legend below, of all that the panels name.

    Parameters
    ----------
    drawing : Figure
    title : str
    key : str
        Heading of the legend.
    """
    lines = headline(drawing, title) if title else 0
    named: dict[str, Any] = {}
    for axes in drawing.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            named.setdefault(label, handle)
    rows = 0
    if named:
        columns = _columns(list(named), drawing.get_figwidth())
        rows = -(-len(named) // columns)
        drawing.legend(
            list(named.values()), list(named), loc="outside lower center", ncols=columns,
            title=key or None,
        )  # fmt: skip
    drawing.set_figheight(drawing.get_figheight() + 0.15 * max(0, lines - 1 + rows - 2))
    if look.WIDTH.get() is not None:
        _fit(drawing)
    return drawing


def _fit(drawing: Figure) -> None:
    """Break the labels of axes that are longer than these."""
    drawing.draw_without_rendering()
    for axes in drawing.axes:
        box = axes.get_window_extent().transformed(drawing.dpi_scale_trans.inverted())
        for axis, room in ((axes.xaxis, box.width), (axes.yaxis, box.height)):
            text = axis.get_label_text()
            if text and 72.0 * 1.1 * room < _length(text, float(axis.label.get_fontsize())):
                axis.set_label_text(_broken(text))


def _broken(text: str) -> str:
    """A label on two lines, of lengths as equal as can be, its formulas whole."""
    places = [i for i, letter in enumerate(text) if letter == " " and text[:i].count("$") % 2 == 0]
    if not places:
        return text
    middle = min(places, key=lambda i: abs(i - len(text) / 2))
    return f"{text[:middle]}\n{text[middle + 1 :]}"


def _length(text: str, size: float) -> float:
    """Of a line of text, in points."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    font = FontProperties(size=size)
    found = text_to_path.get_text_width_height_descent(text, font, text.count("$") > 1)
    return float(found[0])


def _columns(labels: Sequence[str], inches: float) -> int:
    """How many columns of these labels are as wide as a figure."""
    from matplotlib import rcParams

    size = rcParams["legend.fontsize"]
    widths = [_length(label, size) for label in labels]
    spare = size * (rcParams["legend.handlelength"] + rcParams["legend.handletextpad"])
    column = max(widths) + spare + size * rcParams["legend.columnspacing"]
    return int(np.clip(72.0 * (inches - 0.2) // column, 1, len(labels)))


def headline(drawing: Figure, text: str) -> int:
    """The title of a whole figure, in symbols, on as many lines as its width makes of it."""
    small = look.WIDTH.get() is not None
    lines = wrap(text, int((14.5 if small else 12.0) * drawing.get_figwidth()))
    named = rf"\b(?:{'|'.join(map(re.escape, SYMBOLS))})\b"
    title = re.sub(named, lambda found: SYMBOLS[found[0]], "\n".join(lines))
    drawing.suptitle(title, fontsize=8.5 if small else 10.5)
    return len(lines)


def name(axes: Axes, label: str, **line: Any) -> None:
    """A line of the legend for what is drawn piece by piece."""
    axes.plot([], [], label=label, **line)


def stability(axes: Axes, *, known: bool = True) -> None:
    """The legend's lines of what is stable."""
    if not known:
        name(axes, "stability not computed", color=meaning.INK)
        return
    name(axes, "stable", color=meaning.INK)
    name(axes, "unstable", color=meaning.INK, linestyle="--")


def mark_speed(axes: Axes, speed: float | None, label: str, **line: Any) -> None:
    """A thin line at a speed, named in the legend; none where there is no such speed."""
    if speed is not None and np.isfinite(speed):
        usual: dict[str, Any] = {"color": meaning.FAINT, "linewidth": 0.9, "linestyle": ":"}
        axes.axvline(speed, label=label, zorder=1.5, **(usual | line))


def crowded(
    lines: Iterable[tuple[NDArray[np.float64], NDArray[np.float64]]],
    top: float,
    view: tuple[float, float],
) -> bool:
    """Whether most of some curves, by their way across the view, is in the lowest quarter of it."""
    low = whole = 0.0
    least = top
    for x, y in lines:
        inside = (x[:-1] >= view[0]) & (x[:-1] <= view[1]) & (y[:-1] <= top) & (y[:-1] > 0.0)
        way = np.abs(np.diff(x))[inside]
        low += float(way[y[:-1][inside] < 0.25 * top].sum())
        whole += float(way.sum())
        least = min(least, float(y[:-1][inside].min(initial=top)))
    return whole > 0.0 and low > 0.7 * whole and 1e-4 * top < least < 0.2 * top


def logarithmic(axis: Axis) -> None:
    """Make an axis logarithmic, with labels between its decades where it spans few."""
    axes = axis.axes
    (axes.set_xscale if axis is axes.xaxis else axes.set_yscale)("log")
    axis.set_major_formatter(_Decades(axis, major=True))
    axis.set_minor_formatter(_Decades(axis, major=False))


def _decades() -> type:
    from matplotlib.ticker import LogFormatterSciNotation

    class Decades(LogFormatterSciNotation):  # type: ignore[misc, unused-ignore]
        """Plain numbers where they are short, powers of ten elsewhere; between decades 2 and 5."""

        def __init__(self, axis: Axis, major: bool) -> None:
            super().__init__()
            self.of, self.major = axis, major

        def __call__(self, value: float, pos: int | None = None) -> str:
            low, high = sorted(self.of.get_view_interval())
            plain = low > 0.9e-3 and high < 2e4
            if self.major:
                return f"{value:g}" if plain else str(super().__call__(value, pos))
            span = high / low
            digits = "" if span > 60.0 or not plain else "25" if span > 8.0 else "23456"
            return f"{value:.3g}" if f"{value:.0e}"[0] in digits else ""

    return Decades


def _Decades(axis: Axis, *, major: bool) -> Any:
    return _decades()(axis, major)


def whole_numbers(axis: Axis) -> None:
    """Ticks at whole numbers alone: what is counted has no halves."""
    from matplotlib.ticker import MaxNLocator

    axis.set_major_locator(MaxNLocator(5, integer=True))
