"""Amplitude against airspeed by describing function."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from aeroflutter.plots import style as look

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from aeroflutter.guarantees import Guarantees
    from aeroflutter.model.section import Scale
    from aeroflutter.orbits.describing import DescribingCurve


LEAST = 1e-8  # distortion that is drawn; below it a motion is sinusoidal


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
        figure, (curve, distortion) = look.figure(1, 2, width=9.2, height=3.9)
        if found is not None:
            _bands(curve, result, found, across)
        draw(curve, result, across)
        _distortion(distortion, result)
        if found is not None:
            _errors(distortion, result, found)
        if title:
            look.headline(figure, title)
    return figure


def draw(axes: Axes, result: DescribingCurve, across: look.Airspeed) -> None:
    """Amplitude over airspeed."""
    x = result.speed / across.unit
    for one in result.families:
        colour = look.CYCLE[(one.number - 1) % len(look.CYCLE)]
        mine = np.flatnonzero(result.family == one.number)
        for run, stable in look.segments(result.stable[mine]):
            points = mine[run]
            line = "-" if stable else "--"
            axes.plot(x[points], np.degrees(result.amplitude[points]), line, color=colour)
    if result.onset is not None:
        axes.plot(
            result.onset.speed / across.unit,
            np.degrees(result.onset.amplitude),
            "o",
            color=look.BLACK,
            markersize=4,
        )
    _limits(axes, result, across)
    axes.set_xlabel(across.label)
    axes.set_ylabel(look.AMPLITUDE)
    onset = "" if result.onset is None else f"; onset {result.onset.speed / across.unit:.5g} (dot)"
    axes.set_title("stable solid, unstable dashed" + onset)


def _limits(axes: Axes, result: DescribingCurve, across: look.Airspeed) -> None:
    """Show the curve around its onset: far out every branch runs along its asymptote."""
    if result.onset is None or not result.speed.size:
        return
    x = result.speed / across.unit
    flutter = (result.flutter_speed or 0.0) / across.unit
    first = result.onset.speed / across.unit
    last = flutter if first < 0.97 * flutter else 1.3 * first
    axes.set_xlim(first - 0.08 * (last - first), last + 0.05 * (last - first))
    shown = result.amplitude[(x >= first) & (x <= first + 0.97 * (last - first))]
    top = (
        12 * result.onset.amplitude
        if shown.size == 0
        else min(shown.max(), 12 * result.onset.amplitude)
    )
    axes.set_ylim(0, 1.05 * np.degrees(top))
    if result.flutter_speed:
        look.mark_speed(axes, flutter, "linear flutter")


def _distortion(axes: Axes, result: DescribingCurve) -> None:
    for one in result.families:
        colour = look.CYCLE[(one.number - 1) % len(look.CYCLE)]
        mine = result.family == one.number
        name = f"family {one.number}" + (" (mirror)" if one.mirror_of else "")
        if len(result.families) == 1:
            name = "distortion"
        axes.plot(
            np.degrees(result.amplitude[mine]),
            100 * np.where(result.distortion[mine] > LEAST, result.distortion[mine], np.nan),
            color=colour,
            label=name,
        )
    if result.amplitude.size:
        axes.set_xscale("log")
        if (result.distortion > LEAST).any():
            axes.set_yscale("log")
        if len(result.families) > 1:
            axes.legend()
    axes.set_xlabel(look.AMPLITUDE)
    axes.set_ylabel("harmonics 2–9 over the first (%)")
    axes.set_title("predicted distortion")


def _bands(axes: Axes, result: DescribingCurve, found: Guarantees, across: look.Airspeed) -> None:
    """Bands of speed at each amplitude, and a mark where there is none and reason to doubt."""
    x = result.speed / across.unit
    amplitude, bands = np.degrees(result.amplitude), found.speed / across.unit
    for one in result.families:
        mine = result.family == one.number
        axes.fill_betweenx(
            amplitude[mine], bands[mine, 0], bands[mine, 1], where=found.guaranteed[mine],
            color=look.GREEN, alpha=0.3, linewidth=0,
        )  # fmt: skip
    axes.plot(x[found.doubtful], amplitude[found.doubtful], "x", color=look.VERMILION, alpha=0.5)


def _errors(axes: Axes, result: DescribingCurve, found: Guarantees) -> None:
    """How far the speed may be off: by proof where there is one, else as calibrated."""
    order = np.argsort(result.amplitude, kind="stable")
    amplitude, proved = np.degrees(result.amplitude[order]), found.guaranteed[order]
    width = np.max(np.abs(found.speed - result.speed[:, None]), axis=1) / result.speed
    likely = np.where(proved, np.nan, 100 * found.expected_error[order])
    for seen, error, mark, name in (
        (proved, 100 * width[order], {"marker": ".", "color": look.GREEN}, "proved"),
        (
            likely > 1e-6,
            likely,
            {"marker": "x", "color": look.VERMILION, "alpha": 0.7},
            "without proof, 95 % below",
        ),
    ):
        if seen.any():
            label = f"error of speed, {name}"
            axes.plot(amplitude[seen], error[seen], linestyle="none", label=label, **mark)
    axes.set_ylabel("per cent")
    axes.set_title("predicted distortion (line) and error of speed")
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=7.5)
