"""Branches of cycles by harmonic balance."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from aeroflutter.plots import style as look

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from aeroflutter.model.section import Scale
    from aeroflutter.orbits.harmonic import HarmonicBranch

_MARKS = {
    "fold": ("o", look.BLACK),
    "corner": ("v", look.BLACK),
    "symmetry-breaking": ("s", look.PURPLE),
    "period-doubling": ("D", look.ORANGE),
    "neimark-sacker": ("*", look.GREEN),
    "grazing": ("x", look.GREY),
}


def plot_branches(
    branches: Sequence[HarmonicBranch], title: str = "", scale: Scale | None = None
) -> Figure:
    """Amplitude and largest multiplier against speed, in m/s if there is a scale."""
    across = look.Airspeed.of(branches[0].flutter_speed, scale)
    with look.style():
        figure, (curve, floquet) = look.figure(1, 2, width=9.4, height=4.0)
        draw(curve, branches, across)
        _multipliers(floquet, branches, across)
        if title:
            look.headline(figure, title)
    return figure


def plot_waveform(branch: HarmonicBranch, index: int, title: str = "") -> Figure:
    """Pitch over one period and its harmonics, of one cycle of a branch."""
    from aeroflutter.orbits.harmonic.moment import waveform

    Y = branch.cycles[index].Y
    with look.style():
        figure, (wave, bars) = look.figure(1, 2, width=8.6, height=3.4)
        turn = np.arange(1025) / 1024
        y = waveform(Y, 1024)
        first = Y[0].real + abs(Y[1]) * np.sin(2 * np.pi * turn)
        wave.plot(turn, np.degrees(np.append(y, y[0])), color=look.BLUE)
        wave.plot(turn, np.degrees(first), "--", color=look.GREY, label="first harmonic")
        wave.set_xlabel("time over the period")
        wave.set_ylabel(look.PITCH)
        wave.legend(loc="upper right")
        orders = np.flatnonzero(np.abs(Y) > 1e-16 * np.abs(Y).max())
        bars.semilogy(orders, np.abs(Y[orders]) / abs(Y[1]), "o", color=look.BLUE)
        bars.set_xlabel("harmonic")
        bars.set_ylabel("amplitude over the first")
        if title:
            look.headline(figure, title)
    return figure


def draw(axes: Axes, branches: Sequence[HarmonicBranch], across: look.Airspeed) -> None:
    """Amplitude over airspeed, bifurcations marked."""
    for number, branch in enumerate(branches):
        colour = look.CYCLE[number % len(look.CYCLE)]
        x, y = branch.speed / across.unit, np.degrees(branch.amplitude)
        for run, stable in look.segments(branch.stable):
            axes.plot(x[run], y[run], "-" if stable else "--", color=colour)
    _mark(axes, branches, across)
    _limits(axes, branches, across)
    axes.set_xlabel(across.label)
    axes.set_ylabel(look.AMPLITUDE)
    known = any(np.isfinite(branch.multiplier_error).any() for branch in branches)
    axes.set_title("stable solid, unstable dashed" if known else "stability not computed")


def _mark(axes: Axes, branches: Sequence[HarmonicBranch], across: look.Airspeed) -> None:
    labelled: set[str] = set()
    for branch in branches:
        for event in branch.bifurcations:
            marker, colour = _MARKS[event.kind]
            axes.plot(
                event.cycle.speed / across.unit,
                np.degrees(event.amplitude),
                marker,
                color=colour,
                markersize=5,
                linestyle="none",
                label=None if event.kind in labelled else event.kind,
            )
            labelled.add(event.kind)
    if labelled:
        axes.legend(loc="upper left")


def _limits(axes: Axes, branches: Sequence[HarmonicBranch], across: look.Airspeed) -> None:
    """Show what lies around the lowest cycles: far out amplitudes run along an asymptote."""
    x = np.concatenate([branch.speed / across.unit for branch in branches])
    y = np.degrees(np.concatenate([branch.amplitude for branch in branches]))
    low, high = float(x.min()), float(x.max())
    pad = 0.04 * max(high - low, 1e-3 * high)
    axes.set_xlim(low - pad, high + pad)
    onset = np.degrees(min(branches, key=lambda b: b.onset.cycle.speed).onset.amplitude)
    flat = y[x <= high - 0.03 * (high - low)]
    top = float(flat.max(initial=0.0))
    if onset > 0.02 * top:  # else the family starts at rest, and all of it is of interest
        top = min(top, 12 * onset)
    axes.set_ylim(0, 1.08 * max(top, 1.5 * onset))


def _multipliers(axes: Axes, branches: Sequence[HarmonicBranch], across: look.Airspeed) -> None:
    doubted = False
    for number, branch in enumerate(branches):
        sizes = np.abs(branch.multipliers[:, 1:])
        if not np.isfinite(sizes).any():
            continue
        x, largest = branch.speed / across.unit, sizes.max(axis=1)
        axes.plot(x, largest, color=look.CYCLE[number % len(look.CYCLE)])
        doubtful = ~branch.certain
        if doubtful.any():
            label = None if doubted else "not certain"
            axes.plot(x[doubtful], largest[doubtful], ".", color=look.VERMILION, label=label)
            doubted = True
        axes.set_yscale("log")
    axes.axhline(1.0, color=look.BLACK, linewidth=0.7)
    axes.set_xlabel(across.label)
    axes.set_ylabel("largest multiplier but the trivial one")
    axes.set_title("Floquet multipliers")
    if doubted:
        axes.legend(loc="best")
