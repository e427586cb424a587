"""Amplitude against airspeed by describing function."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from aeroflutter.plots import layout, meaning
from aeroflutter.plots import style as look
from aeroflutter.plots.branches import NAMED, Line, frame, method_lines
from aeroflutter.results.unit import told

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from aeroflutter.guarantees import Guarantees
    from aeroflutter.model.section import Scale
    from aeroflutter.orbits.describing import DescribingCurve


LEAST = 1e-8  # distortion that is drawn; below it a motion is sinusoidal
METHOD = "describing function"
MOST_MARKS = 60  # of points in doubt


def plot_describing(
    result: DescribingCurve,
    title: str = "",
    found: Guarantees | None = None,
    scale: Scale | None = None,
) -> Figure:
    """Amplitude over speed ratio beside the predicted distortion, family by family.

    Parameters
    ----------
    found
        Guarantees of the points: bands that are proved to hold a cycle beside the curve, points
        that are doubtful without one, and how far the speed may be off.
    scale
        Shows airspeeds in m/s.
    """
    across = look.Airspeed.of(result.flutter_speed, scale)
    with look.style():
        figure, (curve, distortion) = layout.figure(1, 2, width=9.2, height=4.3)
        draw(curve, result, across)
        if found is not None and result.amplitude.size:
            _bands(curve, result, found, across)
        _distortion(distortion, result)
        if found is not None:
            _errors(distortion, result, found)
        layout.finish(figure, title)
    return figure


def draw(axes: Axes, result: DescribingCurve, across: look.Airspeed) -> None:
    """Amplitude over airspeed."""
    lines = []
    for one in result.families:
        mine = result.family == one.number
        lines.append(
            Line(
                result.speed[mine] / across.unit,
                told(result.amplitude[mine]),
                result.stable[mine],
                f"family {one.number}" + (" (mirror)" if one.mirror_of else ""),
            )
        )
    method_lines(axes, lines, METHOD, meaning.DESCRIBING)
    if lines:
        layout.stability(axes)
    marks = []
    if result.onset is not None:
        at = float(result.onset.speed / across.unit), float(told(result.onset.amplitude))
        label = f"onset {at[0]:.5g}"
        axes.plot(*at, "o", color=meaning.INK, linestyle="none", label=label, zorder=3)
        marks.append(at)
    frame(axes, lines, across, result.flutter_speed, marks)


def _distortion(axes: Axes, result: DescribingCurve) -> None:
    many = len(result.families) > NAMED
    tones = meaning.shades(meaning.DESCRIBING, len(result.families))
    for one, tone in zip(result.families, tones, strict=True):
        mine = result.family == one.number
        axes.plot(
            told(result.amplitude[mine]),
            100 * np.where(result.distortion[mine] > LEAST, result.distortion[mine], np.nan),
            color=tone,
            linewidth=0.8 if many else None,
        )
    axes.set_xlabel(look.AMPLITUDE)
    axes.set_ylabel("harmonics 2–9 over the first (%)")
    axes.set_title("predicted distortion")
    if (result.distortion > LEAST).any():
        layout.logarithmic(axes.xaxis)
        layout.logarithmic(axes.yaxis)
    else:
        _say(axes, "the motion is sinusoidal" if result.amplitude.size else "no limit cycle")


def _say(axes: Axes, words: str) -> None:
    """In place of a figure."""
    axes.text(0.5, 0.5, words, ha="center", va="center", transform=axes.transAxes)
    axes.set_axis_off()


def _bands(axes: Axes, result: DescribingCurve, found: Guarantees, across: look.Airspeed) -> None:
    """Bands of speed at each amplitude, and a mark where there is none and reason to doubt."""
    x = result.speed / across.unit
    amplitude, bands = told(result.amplitude), found.speed / across.unit
    label: str | None = "proved to hold a cycle"
    for one in result.families:
        mine = result.family == one.number
        if not found.guaranteed[mine].any():
            continue
        axes.fill_betweenx(
            amplitude[mine], bands[mine, 0], bands[mine, 1], where=found.guaranteed[mine],
            color=meaning.PROVED, alpha=0.45, linewidth=0, label=label, zorder=1.8,
        )  # fmt: skip
        label = None
    doubtful = np.flatnonzero(found.doubtful)
    doubtful = doubtful[:: max(1, doubtful.size // MOST_MARKS)]
    if doubtful.size:
        axes.plot(
            x[doubtful], amplitude[doubtful], "x", color=meaning.WARNING, alpha=0.6, markersize=3,
            linestyle="none", label="doubtful, not proved", zorder=2.5,
        )  # fmt: skip


def _errors(axes: Axes, result: DescribingCurve, found: Guarantees) -> None:
    """How far the speed may be off: by proof where there is one, else as calibrated."""
    if not (result.distortion > LEAST).any():
        return
    order = np.argsort(result.amplitude, kind="stable")
    amplitude, proved = told(result.amplitude[order]), found.guaranteed[order]
    width = np.max(np.abs(found.speed - result.speed[:, None]), axis=1) / result.speed
    likely = np.where(proved, np.nan, 100 * found.expected_error[order])
    for seen, error, mark, label in (
        (
            proved,
            100 * width[order],
            {"marker": ".", "color": meaning.PROVED},
            "error of speed, proved",
        ),
        (
            likely > 1e-6,
            likely,
            {"marker": "x", "color": meaning.WARNING, "alpha": 0.6, "markersize": 3},
            "error of speed without proof, 95 % below",
        ),
    ):
        if seen.any():
            axes.plot(amplitude[seen], error[seen], linestyle="none", label=label, **mark)
    axes.set_ylabel("per cent")
    axes.set_title("predicted distortion (lines) and error of speed")
