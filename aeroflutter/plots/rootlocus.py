"""Root locus, frequency and damping against speed, flutter speed against pitch stiffness."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.plots import layout, meaning
from aeroflutter.plots import style as look

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from aeroflutter.linear.rootlocus import RootLocus
    from aeroflutter.model.lure import Real
    from aeroflutter.model.section import Scale


NAMED = 8  # modes and crossings with a name each in the legend


def plot_root_locus(result: RootLocus, title: str = "", scale: Scale | None = None) -> Figure:
    """The roots in the complex plane (thesis figure 4.10) beside frequency and damping.

    Speeds and frequencies are in m/s and Hz where there is a scale.
    """
    with look.style():
        figure, axes = layout.figure(1, 3, width=10.5, height=4.0)
        modes = _oscillatory(result)
        draw(axes[0], result, modes, scale)
        _frequency(axes[1], result, modes, scale)
        _damping(axes[2], result, modes, scale)
        layout.finish(figure, title)
    return figure


def plot_stiffness(
    stiffness: Real, speed: Real, title: str = "", scale: Scale | None = None
) -> Figure:
    """Flutter speed against pitch stiffness (thesis figure 4.11)."""
    across = look.Airspeed.of(None, scale)
    with look.style():
        figure, axes = layout.figure(width=5.2, height=3.8)
        axes.plot(stiffness, speed / across.unit, color=meaning.INK)
        axes.set_xlabel("pitch stiffness $N$ (of the linear spring)")
        axes.set_ylabel(r"flutter speed $U^*$" if scale is None else "flutter speed $V$ (m/s)")
        axes.set_ylim(bottom=0)
        layout.finish(figure, title)
    return figure


def _oscillatory(result: RootLocus) -> list[int]:
    """Columns that are an oscillation somewhere and carry its upper half, slowest first."""
    imag = result.roots.imag
    columns = [j for j in range(imag.shape[1]) if np.max(imag[:, j]) > 1e-9]
    return sorted(columns, key=lambda j: float(np.median(imag[:, j] * result.speeds)))


def _colours(modes: list[int]) -> list[str]:
    """One a mode; with more modes than colours they come round again."""
    return [meaning.SERIES[n % len(meaning.SERIES)] for n in range(len(modes))]


def _masked(values: np.ndarray, keep: np.ndarray) -> np.ndarray:
    return np.where(keep, values, np.nan)


def draw(
    axes: Axes, result: RootLocus, modes: list[int] | None = None, scale: Scale | None = None
) -> None:
    """The roots in the complex plane."""
    modes = _oscillatory(result) if modes is None else modes
    for colour, j in zip(_colours(modes), modes, strict=True):
        upper = result.roots[:, j].imag > 0
        re, im = (
            _masked(part, upper) for part in (result.roots[:, j].real, result.roots[:, j].imag)
        )
        axes.plot(re, im, color=colour)
        axes.plot(re, -im, color=colour, alpha=0.35)
    real = [j for j in range(result.roots.shape[1]) if j not in modes]
    for j in real:
        on_axis = np.abs(result.roots[:, j].imag) < 1e-12
        axes.plot(
            _masked(result.roots[:, j].real, on_axis),
            np.zeros(result.speeds.size),
            color=meaning.FAINT,
            linewidth=2.0,
            alpha=0.6,
            label="real roots",
        )
    axes.axvline(0.0, color=meaning.FAINT, linewidth=0.9)
    across = look.Airspeed.of(None, scale)
    for crossing in result.crossings[:NAMED]:
        axes.plot(
            0.0, crossing.k, "x", color=meaning.INK, markersize=6, linestyle="none",
            label=f"crossing at {across.said(crossing.speed)}", zorder=3,
        )  # fmt: skip
    _limit_locus(axes, result, modes)
    axes.set_xlabel(r"Re $\bar p$, root $p$ over $V/b$")
    axes.set_ylabel(r"Im $\bar p$")
    axes.set_title("root locus")
    axes.locator_params(axis="x", nbins=5)


def _limit_locus(axes: Axes, result: RootLocus, modes: list[int]) -> None:
    """Show the part of the locus around the crossing: at low speed every root tends to infinity."""
    if result.flutter is None or not modes:
        return
    top = 3.0 * result.flutter.k
    shown = result.roots[:, modes]
    inside = (shown.imag > 0) & (shown.imag < top)
    if inside.any():
        low, high = shown.real[inside].min(), shown.real[inside].max()
        pad = 0.12 * max(high - low, 1e-6)
        axes.set_xlim(low - pad, high + 2.5 * pad)
    axes.set_ylim(-top, top)


def _frequency(axes: Axes, result: RootLocus, modes: list[int], scale: Scale | None) -> None:
    across = look.Airspeed.of(None, scale)
    for number, (colour, j) in enumerate(zip(_colours(modes), modes, strict=True), start=1):
        imag = _masked(result.roots[:, j].imag, result.roots[:, j].imag > 0)
        shown: Any = imag * result.speeds
        if scale is not None:
            shown = scale.frequency_hz(imag, result.speeds)  # type: ignore[arg-type]
        axes.plot(
            result.speeds / across.unit,
            shown,
            color=colour,
            label=f"mode {number}" if len(modes) <= NAMED else None,
        )
    _mark(axes, result, across)
    axes.set_xlabel(across.label)
    axes.set_ylabel(look.FREQUENCY_RATIO if scale is None else look.HERTZ)
    axes.set_ylim(bottom=0)
    axes.set_title("frequency")


def _damping(axes: Axes, result: RootLocus, modes: list[int], scale: Scale | None) -> None:
    across = look.Airspeed.of(None, scale)
    for colour, j in zip(_colours(modes), modes, strict=True):
        root = result.roots[:, j]
        ratio = _masked(-root.real / np.maximum(np.abs(root), 1e-300), root.imag > 0)
        axes.plot(result.speeds / across.unit, ratio, color=colour)
    axes.axhline(0.0, color=meaning.FAINT, linewidth=0.9)
    _mark(axes, result, across)
    axes.set_xlabel(across.label)
    axes.set_ylabel(r"damping ratio $-$Re $\bar p\,/\,|\bar p|$")
    axes.set_title("damping")


def _mark(axes: Axes, result: RootLocus, across: look.Airspeed) -> None:
    if result.flutter is not None:
        at = result.flutter.speed
        layout.mark_speed(axes, at / across.unit, f"flutter, {across.said(at)}", linestyle="-")
    if result.divergence is not None and result.divergence <= result.speeds.max():
        at = result.divergence
        layout.mark_speed(
            axes, at / across.unit, f"divergence, {across.said(at)}", linestyle=(0, (5, 2))
        )
