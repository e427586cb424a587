"""V-g and V-f diagrams of the p-k method, and the error of a rational approximation."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

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
        figure, axes = look.figure(1, 2, width=9.0, height=3.8)
        for j in range(result.roots.shape[1]):
            colour = look.CYCLE[j % len(look.CYCLE)]
            dashes = "-" if j < len(look.CYCLE) else "--"
            for one, values in zip(axes, (result.damping, result.frequency_hz), strict=True):
                inside = np.where(result.outside[:, j], np.nan, values[:, j])
                one.plot(result.speeds, values[:, j], color=colour, alpha=0.3, linestyle=dashes)
                one.plot(result.speeds, inside, color=colour, linestyle=dashes)
        _mark(axes, result.crossings, result.semichord, "x", look.BLACK, "table (p-k)")
        _mark(axes, others, result.semichord, "o", look.GREY, "approximation")
        low = float(np.nanmin(result.damping, initial=-0.1))
        axes[0].axhline(0.0, color=look.BLACK, linewidth=0.7)
        axes[0].set_ylim(max(low, -0.5), max(0.1, min(0.3, float(np.nanmax(result.damping)))))
        axes[0].set_ylabel(r"damping $g = 2\,\mathrm{Re}\,\lambda/|\mathrm{Im}\,\lambda|$")
        axes[1].set_ylabel("frequency (Hz)")
        axes[1].set_ylim(bottom=0.0)
        for one in axes:
            one.set_xlabel("airspeed $V$ (m/s)")
        if result.crossings or others:
            axes[0].legend(loc="lower left")
        if title:
            look.headline(figure, title)
    return figure


def _mark(
    axes: list[Axes],
    crossings: tuple[Crossing, ...],
    semichord: float,
    marker: str,
    colour: str,
    label: str,
) -> None:
    if not crossings:
        return
    speeds = [one.speed for one in crossings]
    hertz = [one.k * one.speed / (2 * np.pi * semichord) for one in crossings]
    ring = marker == "o"
    for one, values in zip(axes, ([0.0] * len(speeds), hertz), strict=True):
        one.plot(
            speeds,
            values,
            marker,
            color=colour,
            markersize=8 if ring else 6,
            markerfacecolor="none" if ring else colour,
            label=label,
        )


def plot_fit(fit: Fit, title: str = "") -> Figure:
    """The error at every reduced frequency, and the largest entries of Q with what fits them."""
    with look.style():
        figure, axes = look.figure(1, 3, width=11.0, height=3.8)
        k = fit.forces.k
        axes[0].semilogy(k, np.maximum(fit.errors, 1e-16), "o-", color=look.BLUE, markersize=4)
        for root in fit.distinct_roots:
            axes[0].axvline(root, color=look.GREY, linewidth=0.5, linestyle=":")
        axes[0].set_xlim(left=0.0, right=1.05 * k[-1])
        axes[0].set_ylabel("relative error of $Q$")
        sizes = np.abs(fit.forces.Q).max(axis=0)
        order = np.argsort(sizes, axis=None)[::-1][:_MOST_ENTRIES]
        dense = np.linspace(0.0, float(k[-1]), 300)
        curve = fit(dense)
        for colour, place in zip(look.CYCLE, order, strict=False):
            i, j = np.unravel_index(place, sizes.shape)
            label = f"$Q_{{{i + 1},{j + 1}}}$"
            for one, part in ((axes[1], np.real), (axes[2], np.imag)):
                one.plot(k, part(fit.forces.Q[:, i, j]), "o", color=colour, markersize=3.5)
                one.plot(dense, part(curve[:, i, j]), color=colour, label=label)
        axes[1].set_ylabel("real part (line: approximation)")
        axes[2].set_ylabel("imaginary part")
        axes[1].legend(loc="best")
        for one in axes:
            one.set_xlabel("reduced frequency $k$ (dotted: lag roots)" if one is axes[0] else "$k$")
        if title:
            look.headline(figure, title)
    return figure
