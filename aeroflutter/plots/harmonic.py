"""Branches of cycles by harmonic balance."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from aeroflutter.plots import layout, meaning
from aeroflutter.plots import style as look
from aeroflutter.plots.branches import Line, frame, mark_bifurcations, method_lines
from aeroflutter.results.unit import told

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from aeroflutter.model.section import Scale
    from aeroflutter.orbits.harmonic import HarmonicBranch


def plot_branches(
    branches: Sequence[HarmonicBranch], title: str = "", scale: Scale | None = None
) -> Figure:
    """Amplitude and largest multiplier against speed, in m/s if there is a scale."""
    across = look.Airspeed.of(branches[0].flutter_speed, scale)
    with look.style():
        figure, (curve, floquet) = layout.figure(1, 2, width=9.4, height=4.4)
        draw(curve, branches, across)
        _multipliers(floquet, branches, across)
        layout.finish(figure, title)
    return figure


def plot_waveform(branch: HarmonicBranch, index: int, title: str = "") -> Figure:
    """Pitch over one period and its harmonics, of one cycle of a branch."""
    from aeroflutter.orbits.harmonic.moment import waveform

    Y = branch.cycles[index].Y
    with look.style():
        figure, (wave, bars) = layout.figure(1, 2, width=8.6, height=3.6)
        turn = np.arange(1025) / 1024
        y = waveform(Y, 1024)
        first = Y[0].real + abs(Y[1]) * np.sin(2 * np.pi * turn)
        wave.plot(turn, told(np.append(y, y[0])), color=meaning.HARMONIC, label="harmonic balance")
        wave.plot(turn, told(first), "--", color=meaning.INK, label="first harmonic")
        wave.set_xlabel("time over the period")
        wave.set_ylabel(look.PITCH)
        orders = np.flatnonzero(np.abs(Y) > 1e-16 * np.abs(Y).max())
        bars.semilogy(orders, np.abs(Y[orders]) / abs(Y[1]), "o", color=meaning.HARMONIC)
        bars.set_xlabel("harmonic")
        bars.set_ylabel("amplitude over the first")
        layout.finish(figure, title)
    return figure


def draw(axes: Axes, branches: Sequence[HarmonicBranch], across: look.Airspeed) -> None:
    """Amplitude over airspeed, bifurcations marked; rounded between the cycles computed."""
    lines = [
        Line(one.speed / across.unit, told(one.amplitude), one.stable, f"family {one.family}")
        for one in branches
    ]
    method_lines(axes, [one.rounded() for one in lines], "harmonic balance", meaning.HARMONIC)
    tones = meaning.shades(meaning.HARMONIC, len(lines))
    for one, tone in zip(lines, tones, strict=True):
        axes.plot(one.x, one.y, ".", color=tone, markersize=3.5)
    layout.name(axes, "cycles computed", color=meaning.HARMONIC, marker=".", linestyle="none")
    known = any(np.isfinite(branch.multiplier_error).any() for branch in branches)
    layout.stability(axes, known=known)
    events = [
        (event.kind, event.cycle.speed / across.unit, float(told(event.amplitude)))
        for branch in branches
        for event in branch.bifurcations
    ]
    mark_bifurcations(axes, events)
    frame(axes, lines, across, branches[0].flutter_speed, [(x, y) for _, x, y in events])


def _multipliers(axes: Axes, branches: Sequence[HarmonicBranch], across: look.Airspeed) -> None:
    axes.set_title("Floquet multipliers")
    axes.set_xlabel(across.label)
    axes.set_ylabel("size of the largest but the trivial one")
    for branch, tone in zip(branches, meaning.shades(meaning.HARMONIC, len(branches)), strict=True):
        sizes = np.abs(branch.multipliers[:, 1:])
        if not np.isfinite(sizes).any():
            continue
        x, largest = branch.speed / across.unit, sizes.max(axis=1)
        smooth = Line(x, largest, branch.stable).rounded()
        axes.plot(smooth.x, smooth.y, color=tone)
        axes.plot(x, largest, ".", color=tone, markersize=3.5)
        doubtful = ~branch.certain
        if doubtful.any():
            axes.plot(
                x[doubtful], largest[doubtful], "x", color=meaning.WARNING, linestyle="none",
                label="multipliers not certain",
            )  # fmt: skip
    if axes.lines:
        layout.logarithmic(axes.yaxis)
        axes.axhline(1.0, color=meaning.FAINT, linewidth=0.9)
    else:
        axes.text(0.5, 0.5, "not computed", ha="center", transform=axes.transAxes)
        axes.set_axis_off()
