"""The loop at one speed: Bode, Nyquist with -1/N, and the harmonics that spoil a cycle."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from aeroflutter.plots import style as look

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
        figure, axes = look.figure(2, 2, width=9.6, height=6.6)
        _magnitude(axes[0, 0], test, chosen, clock)
        _phase(axes[1, 0], test, chosen, clock)
        draw(axes[0, 1], test)
        _harmonics(axes[1, 1], test, chosen)
        if title:
            look.headline(figure, title)
    return figure


def _at(test: LoopTest, k: float, values: np.ndarray) -> float:
    return float(np.interp(np.log(k), np.log(test.frequency), values))


def _mark(
    axes: Axes, test: LoopTest, cycle: LoopCycle | None, values: np.ndarray, clock: look.Clock
) -> None:
    """The cycle's frequency and its harmonics on a curve over frequency."""
    if cycle is None:
        return
    axes.plot(clock.hertz(cycle.k), _at(test, cycle.k, values), "o", color=look.BLACK, markersize=5)
    for order, share, spoils in zip(cycle.orders, cycle.predicted, cycle.spoiling, strict=True):
        at = float(order * cycle.k)
        if at > test.frequency[-1] or share < 1e-9:
            continue
        colour = look.VERMILION if spoils else look.GREY
        y = _at(test, at, values)
        seen = clock.hertz(at)
        axes.plot(seen, y, "D" if spoils else ".", color=colour, markersize=5)
        axes.annotate(
            str(order), (seen, y), xytext=(4, 4), textcoords="offset points", fontsize=7.5,
            color=colour,
        )  # fmt: skip


def _magnitude(axes: Axes, test: LoopTest, cycle: LoopCycle | None, clock: look.Clock) -> None:
    decibels = 20 * np.log10(np.abs(test.G))
    axes.semilogx(clock.hertz(test.frequency), decibels, color=look.BLUE)
    _mark(axes, test, cycle, decibels, clock)
    axes.set_ylabel(r"$|G(\mathrm{j}k)|$ (dB)")
    axes.set_title("Bode: cycle (black), its harmonics, spoiling ones red")
    axes.tick_params(labelbottom=False)


def _phase(axes: Axes, test: LoopTest, cycle: LoopCycle | None, clock: look.Clock) -> None:
    phase = np.degrees(np.unwrap(np.angle(test.G)))
    axes.semilogx(clock.hertz(test.frequency), phase, color=look.BLUE)
    _mark(axes, test, cycle, phase, clock)
    axes.set_xlabel(clock.frequency)
    axes.set_ylabel(r"$\arg\,G(\mathrm{j}k)$ (deg)")


def draw(axes: Axes, test: LoopTest) -> None:
    """The Nyquist plot, with the locus -1/N and the cycles."""
    axes.plot(test.G.real, test.G.imag, color=look.BLUE, label=r"$G(\mathrm{j}k)$")
    axes.plot(test.locus.real, test.locus.imag, color=look.ORANGE, label=r"$-1/N(a)$")
    points = [-1 / one.N if one.N else complex(np.inf) for one in test.cycles]
    for number, (one, at) in enumerate(zip(test.cycles, points, strict=True)):
        proved = bool(one.guarantee.guaranteed[0])
        marker, colour = ("o", look.GREEN) if proved else ("s", look.VERMILION)
        axes.plot(at.real, at.imag, marker, color=colour, zorder=3)
        axes.annotate(
            f"{np.degrees(one.amplitude):.3g}°", (at.real, at.imag),
            xytext=(14, 10) if number % 2 else (-14, 14), ha="left" if number % 2 else "right",
            textcoords="offset points", fontsize=8,
            arrowprops={"arrowstyle": "-", "color": look.GREY, "linewidth": 0.6},
        )  # fmt: skip
    reach = 1.6 * max([1.0, *(abs(at) for at in points if np.isfinite(at))])
    axes.set_xlim(-reach, 0.3 * reach)
    axes.set_ylim(-0.5 * reach, 0.5 * reach)
    axes.axhline(0, color=look.BLACK, linewidth=0.6)
    axes.axvline(0, color=look.BLACK, linewidth=0.6)
    axes.set_xlabel("real part")
    axes.set_ylabel("imaginary part")
    axes.set_title("Nyquist: cycle proved (green dot) or not (red square)")
    axes.legend(loc="upper left")


def _harmonics(axes: Axes, test: LoopTest, cycle: LoopCycle | None) -> None:
    if cycle is None:
        axes.text(0.5, 0.5, "no cycle at this speed", ha="center", transform=axes.transAxes)
        axes.set_axis_off()
        return
    keep = cycle.predicted > 1e-9
    colours = [look.VERMILION if spoils else look.BLUE for spoils in cycle.spoiling[keep]]
    axes.bar(cycle.orders[keep], 100 * cycle.predicted[keep], color=colours, width=0.6)
    axes.axhline(100 * test.spoils, color=look.VERMILION, linewidth=0.9, linestyle=":")
    axes.set_yscale("log")
    axes.set_axisbelow(True)
    axes.set_xticks(cycle.orders)
    axes.set_xlabel("harmonic")
    axes.set_ylabel("predicted, over the first (%)")
    axes.set_title(f"harmonics of the cycle of {np.degrees(cycle.amplitude):.4g}°")
