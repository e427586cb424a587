"""Chaos drawn: one motion from six sides, and peaks with exponents against a parameter."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.plots import layout, meaning
from aeroflutter.plots import style as look
from aeroflutter.plots.timemarch import FIGURES, PITCH_RATE, TAU
from aeroflutter.results.unit import told

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from aeroflutter.motion.chaos import ChaosResult, ChaosScan
    from aeroflutter.motion.response import Response

__all__ = ["plot_chaos", "plot_chaos_scan"]

EXPONENT = r"Lyapunov exponent (per {})"
NAMES = (r"$\lambda_1$", r"$\lambda_2$", r"$\lambda_3$")


def plot_chaos(
    result: ChaosResult, response: Response, title: str = "", clock: look.Clock = TAU
) -> Figure:
    """One motion: trace, phase plane, spectrum; Poincaré section, return map, exponents.

    Parameters
    ----------
    result
        The verdict, with the section and the exponents.
    response
        The steady motion with its trace recorded, as `result.trace` gives it.
    title
        Written above.
    clock
        In what units times, frequencies and exponents are.
    """
    with look.style():
        figure, axes = layout.figure(2, 3, width=10.0, height=6.4)
        _trace(axes[0, 0], response, result.return_time, clock)
        _phase_plane(axes[0, 1], response, result.return_time, clock)
        FIGURES["psd"][0](np.array([axes[0, 2]]), response, clock)
        draw(axes[1, 0], result)
        _return_map(axes[1, 1], result)
        _convergence(axes[1, 2], result, clock)
        layout.finish(figure, title)
    return figure


def plot_chaos_scan(
    scan: ChaosScan,
    label: str = look.SPEED_RATIO,
    title: str = "",
    unit: float = 1.0,
    rates: NDArray[np.float64] | None = None,
) -> Figure:
    """Peaks of pitch above, the largest exponents below, against the parameter.

    Parameters
    ----------
    scan
        Verdicts over the parameter.
    label
        Of the parameter's axis.
    title
        Written above.
    unit
        Of the parameter's axis.
    rates
        Exponents per second over those per unit tau, (m,); shows them per second.
    """
    with look.style():
        figure, axes = layout.figure(
            2, 1, width=7.2, height=6.0, sharex=True, height_ratios=(1.6, 1.0)
        )
        draw_scan(axes[0], scan, unit)
        _exponents(axes[1], scan, unit, rates)
        axes[1].set_xlabel(label)
        layout.finish(figure, title)
    return figure


def _trace(axes: Axes, response: Response, between: float, clock: look.Clock) -> None:
    """Pitch over the last oscillations."""
    keep = response.time >= response.time[-1] - 30.0 * between
    time = (response.time[keep] - response.time[keep][0]) / clock.second
    axes.plot(time, told(response.pitch[keep]), color=meaning.EXACT, linewidth=0.9)
    axes.set_xlim(time[0], time[-1])
    axes.set_xlabel(clock.time)
    axes.set_ylabel(look.PITCH)
    axes.set_title("steady motion")


def _phase_plane(axes: Axes, response: Response, between: float, clock: look.Clock) -> None:
    """Pitch rate against pitch over the last oscillations."""
    rate = np.gradient(response.pitch, (response.time[1] - response.time[0]) / clock.second)
    keep = response.time >= response.time[-1] - 60.0 * between
    axes.plot(told(response.pitch[keep]), told(rate[keep]), color=meaning.EXACT, linewidth=0.5)
    axes.set_xlabel(look.PITCH)
    axes.set_ylabel(PITCH_RATE.format(clock.per))
    axes.set_title("phase plane")


def draw(axes: Axes, result: ChaosResult) -> None:
    """Heave and pitch at the maxima of pitch."""
    pitch = told(result.section.pitch)
    names = result.section.state_names
    column = names.index("xi") if "xi" in names else 0
    _dots(axes, pitch, result.section.states[:, column], result)
    axes.set_xlabel(r"pitch $\alpha$ at its maxima (deg)")
    axes.set_ylabel(look.HEAVE if "xi" in names else names[column])
    axes.set_title("Poincaré section")


def _return_map(axes: Axes, result: ChaosResult) -> None:
    """Each maximum of pitch against the one before."""
    pitch = told(result.section.pitch)
    _dots(axes, pitch[:-1], pitch[1:], result)
    axes.set_xlabel(r"maximum $\alpha_j$ (deg)")
    axes.set_ylabel(r"next maximum $\alpha_{j+1}$ (deg)")
    axes.set_title("return map")


def _dots(axes: Axes, x: Any, y: Any, result: ChaosResult) -> None:
    """Many small dots, or a few large ones; with room around a single one."""
    small = result.loops == 0
    axes.plot(
        x, y, "." if small else "o", color=meaning.VERDICTS[result.verdict],
        markersize=0.8 if small else 4.0, rasterized=small,
    )  # fmt: skip
    if x.size:
        for values, limit in ((x, axes.set_xlim), (y, axes.set_ylim)):
            low, high = float(values.min()), float(values.max())
            room = max(0.08 * (high - low), 0.02 * max(abs(low), abs(high), 1e-12))
            limit(low - room, high + room)


def _convergence(axes: Axes, result: ChaosResult, clock: look.Clock) -> None:
    """Finite-time exponents against the time they took."""
    from matplotlib.ticker import MaxNLocator

    found, rate, time = result.exponents, clock.second, result.exponents.time / clock.second
    shown = min(len(NAMES), found.values.size)
    for i, colour in zip(range(shown), meaning.SERIES, strict=False):
        axes.plot(time, rate * found.running[:, i], color=colour, linewidth=1.0, label=NAMES[i])
        low, high = found.values[i] - found.error[i], found.values[i] + found.error[i]
        axes.axhspan(rate * low, rate * high, color=colour, alpha=0.25, linewidth=0)
    axes.axhline(0.0, color=meaning.FAINT, linewidth=0.9)
    span = rate * found.values[:shown]
    room = 0.4 * max(float(np.ptp(span)), 1e-12)
    axes.set_ylim(float(span.min()) - room, float(span.max()) + room)
    axes.set_xlim(0.0, time[-1])
    axes.xaxis.set_major_locator(MaxNLocator(3))
    axes.set_xlabel(clock.time)
    axes.set_ylabel(EXPONENT.format(clock.per))
    axes.set_title("finite-time exponents")


def draw_scan(axes: Axes, scan: ChaosScan, unit: float = 1.0) -> None:
    """Maxima of pitch, coloured by the verdict."""
    for value, result in zip(scan.values, scan.results, strict=True):
        peaks = told(result.peaks())
        if result.verdict == "damped":
            peaks = told(np.array([result.bias]))
        few = result.loops > 0 or result.verdict == "damped"
        axes.plot(
            np.full(peaks.size, value / unit), peaks, ".", color=meaning.VERDICTS[result.verdict],
            markersize=3.0 if few else 1.2, rasterized=not few,
        )  # fmt: skip
    for verdict, colour in meaning.VERDICTS.items():
        if verdict in scan.verdicts:
            layout.name(axes, verdict, color=colour, marker="o", linestyle="none")
    axes.set_ylabel("peaks of pitch (deg)")


def _exponents(
    axes: Axes, scan: ChaosScan, unit: float, rates: NDArray[np.float64] | None = None
) -> None:
    """The two largest exponents with their errors."""
    each = 1.0 if rates is None else rates[:, None]
    values, errors = each * scan.exponents, each * scan.errors
    for i, colour in zip(range(min(2, values.shape[1])), meaning.SERIES, strict=False):
        axes.errorbar(
            scan.values / unit, values[:, i], errors[:, i], color=colour, linewidth=0.8,
            marker=".", markersize=3.0, elinewidth=0.8, label=NAMES[i],
        )  # fmt: skip
    axes.axhline(0.0, color=meaning.FAINT, linewidth=0.9)
    axes.set_ylabel(EXPONENT.format(TAU.per if rates is None else "s"))
