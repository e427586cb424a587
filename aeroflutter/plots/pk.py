"""V-g and V-f diagrams of the p-k method, and the error of a rational approximation."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from aeroflutter.plots import layout, meaning
from aeroflutter.plots import style as look

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from aeroflutter.linear.pk import PKResult
    from aeroflutter.linear.rootlocus import Crossing
    from aeroflutter.model.elsewhere.rational import Fit

_MOST_ENTRIES = 4


def plot_pk(result: PKResult, title: str = "", others: tuple[Crossing, ...] = ()) -> Figure:
    """Damping g and frequency against airspeed, a line a mode.

    Parameters
    ----------
    result : PKResult
    title : str
    others : tuple of Crossing
        Of the approximation, marked beside those of the table.
    """
    with look.style():
        figure, axes = layout.figure(1, 2, width=9.0, height=4.2)
        draw(axes[0], result)
        _lines(axes[1], result, result.frequency_hz)
        axes[1].set_ylabel("frequency (Hz)")
        axes[1].set_ylim(bottom=0.0)
        axes[1].set_xlabel("airspeed $V$ (m/s)")
        _mark(axes[1], result.crossings, _hertz(result.crossings, result.semichord), "x")
        _mark(axes[0], others, [0.0] * len(others), "o")
        _mark(axes[1], others, _hertz(others, result.semichord), "o")
        layout.finish(figure, title)
    return figure


def draw(axes: Axes, result: PKResult) -> None:
    """Damping against airspeed, the V-g diagram."""
    _lines(axes, result, result.damping)
    for j in range(result.roots.shape[1]):
        colour, dashes = _look(j)
        layout.name(axes, f"mode {j + 1}", color=colour, linestyle=dashes)
    _mark(axes, result.crossings, [0.0] * len(result.crossings), "x")
    low = float(np.nanmin(result.damping, initial=-0.1))
    axes.axhline(0.0, color=meaning.FAINT, linewidth=0.9)
    axes.set_ylim(max(low, -0.5), max(0.1, min(0.3, float(np.nanmax(result.damping)))))
    axes.set_xlabel("airspeed $V$ (m/s)")
    axes.set_ylabel(r"damping $g = 2\,\mathrm{Re}\,\lambda/|\mathrm{Im}\,\lambda|$")
    if result.outside.any():
        layout.name(axes, "beyond the table", color=meaning.INK, alpha=0.3)


def _look(j: int) -> tuple[str, str]:
    """Colour and dashes of a mode."""
    return meaning.SERIES[j % len(meaning.SERIES)], "-" if j < len(meaning.SERIES) else "--"


def _lines(axes: Axes, result: PKResult, values: np.ndarray) -> None:
    """A line a mode, faint where its reduced frequency lies beyond the table."""
    for j in range(result.roots.shape[1]):
        colour, dashes = _look(j)
        inside = np.where(result.outside[:, j], np.nan, values[:, j])
        axes.plot(result.speeds, values[:, j], color=colour, alpha=0.3, linestyle=dashes)
        axes.plot(result.speeds, inside, color=colour, linestyle=dashes)


def _mark(axes: Axes, crossings: tuple[Crossing, ...], values: list[float], mark: str) -> None:
    """Crossings at some values, a cross for the table and a ring for the approximation."""
    if crossings:
        ring = mark == "o"
        axes.plot(
            [one.speed for one in crossings], values, mark, color=meaning.INK, linestyle="none",
            markersize=8 if ring else 6, markerfacecolor="none" if ring else meaning.INK,
            label=f"crossing of the {'approximation' if ring else 'table (p-k)'}", zorder=3,
        )  # fmt: skip


def _hertz(crossings: tuple[Crossing, ...], semichord: float) -> list[float]:
    return [one.k * one.speed / (2 * np.pi * semichord) for one in crossings]


def plot_fit(fit: Fit, title: str = "") -> Figure:
    """The error at every reduced frequency, and the largest entries of Q with what fits them."""
    with look.style():
        figure, axes = layout.figure(1, 3, width=11.0, height=4.0)
        k = fit.forces.k
        axes[0].plot(k, np.maximum(fit.errors, 1e-16), "o-", color=meaning.INK, markersize=4)
        layout.logarithmic(axes[0].yaxis)
        for root in fit.distinct_roots:
            layout.mark_speed(axes[0], root, "lag roots", linewidth=0.7)
        axes[0].set_xlim(left=0.0, right=1.05 * k[-1])
        axes[0].set_ylabel("relative error of $Q$")
        sizes = np.abs(fit.forces.Q).max(axis=0)
        order = np.argsort(sizes, axis=None)[::-1][:_MOST_ENTRIES]
        dense = np.linspace(0.0, float(k[-1]), 300)
        curve = fit(dense)
        for colour, place in zip(meaning.SERIES, order, strict=False):
            i, j = np.unravel_index(place, sizes.shape)
            label = f"$Q_{{{i + 1},{j + 1}}}$"
            for one, part in ((axes[1], np.real), (axes[2], np.imag)):
                one.plot(k, part(fit.forces.Q[:, i, j]), "o", color=colour, markersize=3.5)
                one.plot(dense, part(curve[:, i, j]), color=colour, label=label)
        axes[1].set_ylabel("real part")
        axes[2].set_ylabel("imaginary part")
        layout.name(axes[1], "table", color=meaning.INK, marker="o", linestyle="none")
        layout.name(axes[1], "approximation", color=meaning.INK)
        for one in axes:
            one.set_xlabel("reduced frequency $k$")
        layout.finish(figure, title)
    return figure
