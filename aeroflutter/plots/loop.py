"""The loop at one speed: Bode, Nyquist with -1/N, and the harmonics that spoil a cycle."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from aeroflutter.plots import layout, meaning
from aeroflutter.plots import style as look
from aeroflutter.results.unit import spoken_unit, told

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from aeroflutter.guarantees.looptest import LoopCycle, LoopTest
    from aeroflutter.model.section import Scale


def plot_loop(
    test: LoopTest, title: str = "", cycle: int = -1, scale: Scale | None = None
) -> Figure:
    """Bode plot beside the Nyquist plot and the harmonics of one cycle.

    Parameters
    ----------
    cycle
        Index of the cycle whose harmonics are marked; by default the one of largest amplitude.
    scale
        Shows frequencies in Hz.
    """
    clock = look.Clock.of(test.speed, scale)
    chosen = test.cycles[cycle] if test.cycles else None
    with look.style():
        figure, axes = layout.figure(2, 2, width=9.6, height=6.9)
        _magnitude(axes[0, 0], test, chosen, clock)
        _phase(axes[1, 0], test, chosen, clock)
        draw(axes[0, 1], test)
        _harmonics(axes[1, 1], test, chosen)
        layout.finish(figure, title)
    return figure


def _at(test: LoopTest, k: float, values: np.ndarray) -> float:
    return float(np.interp(np.log(k), np.log(test.frequency), values))


def _mark(
    axes: Axes, test: LoopTest, cycle: LoopCycle | None, values: np.ndarray, clock: look.Clock
) -> None:
    """The cycle's frequency and its harmonics on a curve over frequency."""
    if cycle is None:
        return
    here = clock.hertz(cycle.k), _at(test, cycle.k, values)
    axes.plot(
        *here, "o", color=meaning.INK, markersize=5, linestyle="none", label="the cycle", zorder=3
    )
    for order, share, spoils in zip(cycle.orders, cycle.predicted, cycle.spoiling, strict=True):
        at = float(order * cycle.k)
        if at > test.frequency[-1] or share < 1e-9:
            continue
        colour = meaning.WARNING if spoils else meaning.FAINT
        y = _at(test, at, values)
        seen = clock.hertz(at)
        axes.plot(
            seen, y, "D" if spoils else ".", color=colour, markersize=5, linestyle="none",
            label="a harmonic that spoils it" if spoils else "a harmonic", zorder=3,
        )  # fmt: skip


def _magnitude(axes: Axes, test: LoopTest, cycle: LoopCycle | None, clock: look.Clock) -> None:
    decibels = 20 * np.log10(np.abs(test.G))
    axes.plot(clock.hertz(test.frequency), decibels, color=meaning.INK)
    layout.logarithmic(axes.xaxis)
    _mark(axes, test, cycle, decibels, clock)
    axes.set_ylabel(r"$|G(\mathrm{j}k)|$ (dB)")
    axes.set_xlabel(clock.frequency)
    axes.set_title("Bode")


def _phase(axes: Axes, test: LoopTest, cycle: LoopCycle | None, clock: look.Clock) -> None:
    phase = np.degrees(np.unwrap(np.angle(test.G)))
    axes.plot(clock.hertz(test.frequency), phase, color=meaning.INK)
    layout.logarithmic(axes.xaxis)
    _mark(axes, test, cycle, phase, clock)
    axes.set_xlabel(clock.frequency)
    axes.set_ylabel(r"$\arg\,G(\mathrm{j}k)$ (°)")


def draw(axes: Axes, test: LoopTest) -> None:
    """The Nyquist plot, with the locus -1/N and the cycles."""
    axes.plot(test.G.real, test.G.imag, color=meaning.INK, label=r"linear part $G(\mathrm{j}k)$")
    axes.plot(
        test.locus.real, test.locus.imag, color=meaning.DESCRIBING, linewidth=2.2,
        label=r"describing function, $-1/N(a)$",
    )  # fmt: skip
    points = [-1 / one.N if one.N else complex(np.inf) for one in test.cycles]
    for one, at in zip(test.cycles, points, strict=True):
        proved = bool(one.guarantee.guaranteed[0])
        axes.plot(
            at.real, at.imag, "o" if proved else "s", linestyle="none", zorder=3,
            color=meaning.PROVED if proved else meaning.WARNING,
            label="cycle, proved" if proved else "cycle, not proved",
        )  # fmt: skip
    reach = 1.6 * max([1.0, *(abs(at) for at in points if np.isfinite(at))])
    axes.set_xlim(-reach, 0.3 * reach)
    axes.set_ylim(-0.5 * reach, 0.5 * reach)
    axes.axhline(0, color=meaning.FAINT, linewidth=0.6)
    axes.axvline(0, color=meaning.FAINT, linewidth=0.6)
    axes.set_xlabel("real part")
    axes.set_ylabel("imaginary part")
    axes.set_title("Nyquist")
    _amplitudes(axes, test, points, reach)


def _amplitudes(axes: Axes, test: LoopTest, points: list[complex], reach: float) -> None:
    """How large the cycles are, once for all that lie on one point, each on a line of its own."""
    places: dict[complex, list[str]] = {}
    for one, at in sorted(zip(test.cycles, points, strict=True), key=lambda pair: -pair[1].imag):
        if not np.isfinite(at):
            continue
        near = next((old for old in places if abs(old - at) < 0.02 * reach), at)
        text = f"{told(one.amplitude):.3g}{spoken_unit().mark}"
        if text not in places.setdefault(near, []):
            places[near].append(text)
    for number, (at, texts) in enumerate(places.items()):
        axes.annotate(
            ", ".join(texts), (at.real, at.imag), xytext=(0.66, 0.3 - 0.09 * number),
            textcoords="axes fraction", va="top", fontsize="small",
            arrowprops={"arrowstyle": "-", "color": meaning.FAINT, "linewidth": 0.6},
        )  # fmt: skip


def _harmonics(axes: Axes, test: LoopTest, cycle: LoopCycle | None) -> None:
    if cycle is None:
        axes.text(0.5, 0.5, "no cycle at this speed", ha="center", transform=axes.transAxes)
        axes.set_axis_off()
        return
    keep = cycle.predicted > 1e-9
    colours = [meaning.WARNING if spoils else meaning.FAINT for spoils in cycle.spoiling[keep]]
    axes.bar(cycle.orders[keep], 100 * cycle.predicted[keep], color=colours, width=0.6)
    axes.axhline(
        100 * test.spoils, color=meaning.WARNING, linewidth=0.9, linestyle=":",
        label="beyond it a harmonic spoils",
    )  # fmt: skip
    layout.logarithmic(axes.yaxis)
    axes.set_axisbelow(True)
    axes.set_xticks(cycle.orders)
    axes.set_xlabel("harmonic")
    axes.set_ylabel("predicted, over the first (%)")
    axes.set_title(f"harmonics of the cycle of {told(cycle.amplitude):.4g}{spoken_unit().mark}")
