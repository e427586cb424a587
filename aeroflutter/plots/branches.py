"""Branches of limit cycles over airspeed, by whichever method: lines, what is marked, the frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.plots import layout, meaning
from aeroflutter.plots import style as look

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

__all__ = ["Line", "draw_lines", "frame", "mark_bifurcations", "method_lines"]

NAMED = 6  # families with a name each in the legend
DEEPEST = 300.0  # of the largest amplitude in view to the smallest, on a logarithmic axis
SMOOTH = 400  # points of a line that is rounded between those computed


@dataclass(frozen=True)
class Line:
    """One family.

    Attributes
    ----------
    x, y
        Airspeed as the axis shows it, amplitude in degrees, (m,).
    stable
        (m,).
    name
        In the legend.
    """

    x: Array
    y: Array
    stable: NDArray[np.bool_]
    name: str = ""

    def rounded(self) -> Line:
        """The same line through the same points without corners, and without overshoot."""
        steps = np.hypot(_over(np.diff(self.x)), _over(np.diff(np.log(np.maximum(self.y, 1e-300)))))
        keep = np.append(True, steps > 0.0)
        x, y, stable = self.x[keep], self.y[keep], self.stable[keep]
        if not 2 < x.size < SMOOTH:
            return self
        from scipy.interpolate import PchipInterpolator

        along = np.append(0.0, np.cumsum(steps[steps > 0.0]))
        fine = np.unique(np.append(np.linspace(0.0, along[-1], SMOOTH), along))
        place = np.clip(np.searchsorted(along, fine, side="right") - 1, 0, x.size - 1)
        return Line(
            PchipInterpolator(along, x)(fine), PchipInterpolator(along, y)(fine),
            stable[place], self.name,
        )  # fmt: skip


def _over(steps: Array) -> Array:
    return steps / (float(np.abs(steps).sum()) or 1.0)


def method_lines(axes: Axes, lines: Sequence[Line], method: str, colour: str, **line: Any) -> None:
    """The families of one method in shades of its colour, named as far as names tell them apart.

    Parameters
    ----------
    method
        What the legend calls them.
    colour
        Of the method, from `meaning`.
    """
    tones = meaning.shades(colour, len(lines))
    if 1 < len(lines) <= NAMED:
        for one, tone in zip(lines, tones, strict=True):
            layout.name(axes, f"{method}, {one.name}" if one.name else method, color=tone, **line)
    elif lines:
        many = "" if len(lines) == 1 else f", {len(lines)} families"
        layout.name(axes, method + many, color=colour, **line)
    for one, tone in zip(lines, tones, strict=True):
        draw_line(axes, one, tone, **line)


def draw_line(axes: Axes, one: Line, colour: Any, **line: Any) -> None:
    """A family, solid where it is stable and dashed where it is not."""
    for run, stable in look.segments(one.stable):
        axes.plot(one.x[run], one.y[run], "-" if stable else "--", color=colour, **line)


def draw_lines(axes: Axes, lines: Sequence[Line], colours: Sequence[Any]) -> None:
    """Lines in colours of their own."""
    for one, colour in zip(lines, colours, strict=True):
        draw_line(axes, one, colour)


def mark_bifurcations(axes: Axes, events: Sequence[tuple[str, float, float]]) -> None:
    """Kind, place and amplitude of bifurcations; a legend names each kind once."""
    for kind in meaning.BIFURCATIONS:
        places = [(x, y) for one, x, y in events if one == kind]
        if places:
            axes.plot(*np.transpose(places), **meaning.bifurcation(kind))


def frame(
    axes: Axes,
    lines: Sequence[Line],
    across: look.Airspeed,
    flutter: float | None,
    marks: Sequence[tuple[float, float]] = (),
) -> None:
    """Limits, scales, labels and the linear flutter speed.

    Near flutter amplitudes grow without bound, so the view ends where they do; where most of the
    curves would lie in its lowest quarter, amplitudes are on a logarithmic scale.

    Parameters
    ----------
    flutter
        U*.
    marks
        Points that are in view in any case.
    """
    axes.set_xlabel(across.label)
    axes.set_ylabel(look.AMPLITUDE)
    at = None if flutter is None else flutter / across.unit
    layout.mark_speed(axes, at, "linear flutter")
    if not any(one.x.size for one in lines):
        return
    low, high = _reach(lines, at, marks)
    top = _top(lines, at, (low, high), marks)
    pad = 0.04 * (high - low) if high - low > 1e-3 * high else 0.05 * high
    view = low - pad, high + pad
    axes.set_xlim(*view)
    curves = [(one.x, one.y) for one in lines]
    if layout.crowded(curves, top, view):
        least = min(
            float(one.y[(one.x >= view[0]) & (one.x <= view[1]) & (one.y > 0.0)].min(initial=top))
            for one in lines
        )
        layout.logarithmic(axes.yaxis)
        axes.set_ylim(0.75 * max(least, top / DEEPEST), 1.6 * top)
    else:
        axes.set_ylim(0.0, 1.08 * top)


def _reach(
    lines: Sequence[Line], flutter: float | None, marks: Sequence[tuple[float, float]]
) -> tuple[float, float]:
    """Airspeeds in view: from the lowest cycle to a little beyond flutter, and all marks."""
    x = np.concatenate([one.x for one in lines])
    low, high = float(x.min()), float(x.max())
    if flutter is not None and low < 0.98 * flutter:
        high = max(flutter, min(high, flutter + 0.3 * (flutter - low)))
    elif flutter is not None:
        high = min(high, 1.3 * low)
    places = [place for place, _ in marks]
    return min([low, *places]), max([high, *places])


def _top(
    lines: Sequence[Line],
    flutter: float | None,
    view: tuple[float, float],
    marks: Sequence[tuple[float, float]],
) -> float:
    """Amplitudes in view: those until shortly before they grow without bound."""
    low, high = view
    end = high if flutter is None or flutter < low else min(flutter, high)
    until = low + 0.95 * (end - low)
    y = [float(one.y[(one.x >= low) & (one.x <= until)].max(initial=0.0)) for one in lines]
    shown = max([*y, *(amplitude for _, amplitude in marks)])
    return shown or float(max(one.y.max(initial=0.0) for one in lines)) or 1.0
