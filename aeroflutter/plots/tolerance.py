"""What is tolerable: cycles of the answer under their limit, and how their size depends on it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from aeroflutter.plots import layout, meaning
from aeroflutter.plots import style as look
from aeroflutter.plots.cycles import draw
from aeroflutter.results.unit import told

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from aeroflutter.model.section import Scale
    from aeroflutter.orbits.cycles import Cycle, LimitCycles
    from aeroflutter.studies.tolerance import Tolerance

__all__ = ["draw_tolerance", "plot_tolerance"]


def plot_tolerance(result: Tolerance, title: str = "", scale: Scale | None = None) -> Figure:
    """Cycles of the tolerable spring under their limit, beside how their size depends on it.

    Parameters
    ----------
    result
        The answer.
    title
        Written above.
    scale
        Shows airspeeds in m/s.
    """
    across = look.Airspeed.of(result.branch.flutter_speed, scale)
    with look.style():
        figure, panels = layout.figure(1, 2, width=10.0, height=4.4)
        draw_tolerance(panels[0], result, across)
        if not result.trials:
            _allowed(panels[1], result, across)
        else:
            _trials(panels[1], result)
        layout.finish(figure, title)
    return figure


def draw_tolerance(axes: Axes, result: Tolerance, across: look.Airspeed) -> None:
    """The cycles of the tolerable spring, with the limit and the highest speed."""
    scaled = result.vary == "size" and result.which is None and np.isfinite(result.factor)
    size = result.factor if scaled else 1.0
    draw(axes, _scaled(result.branch, size), across)
    limit, speed = float(told(result.amplitude)), result.speed / across.unit
    if result.worst is not None:
        axes.plot(
            result.worst.speed / across.unit, size * told(result.worst.amplitude), "o",
            color=meaning.WARNING, linestyle="none", label="largest stable cycle", zorder=4,
        )  # fmt: skip
    low, high = axes.get_xlim()
    pad = 0.02 * (high - low)
    axes.set_xlim(min(low, speed - pad), max(high, speed + pad))
    axes.set_ylim(top=max(axes.get_ylim()[1], 1.6 * limit))
    axes.fill_between(
        [axes.get_xlim()[0], speed], limit, axes.get_ylim()[1], color=meaning.WARNING,
        alpha=meaning.SHADING, linewidth=0, label="not allowed to stable cycles",
    )  # fmt: skip
    _limit(axes, limit)
    layout.mark_speed(axes, speed, "highest speed", color=meaning.WARNING)


def _limit(axes: Axes, limit: float) -> None:
    axes.axhline(limit, color=meaning.WARNING, linewidth=0.9, label="limit of amplitude")


def _scaled(branch: LimitCycles, factor: float) -> LimitCycles:
    """The cycles of a spring of another size: at the same speeds, larger by that factor."""
    if factor == 1.0:
        return branch

    def larger(cycle: Cycle) -> Cycle:
        return replace(cycle, amplitude=factor * cycle.amplitude)

    families = tuple(
        replace(
            family,
            cycles=tuple(map(larger, family.cycles)),
            bifurcations=tuple(replace(e, cycle=larger(e.cycle)) for e in family.bifurcations),
        )
        for family in branch.families
    )
    return replace(branch, families=families)


DEGREES = 180.0 / np.pi
NAMES_OF_VARIED = {
    "size": "size over that of the case",
    "gap": r"whole gap $\Delta H$ (deg)",
    "friction": r"$\Delta V$, twice the friction (deg)",
}


def _allowed(axes: Axes, result: Tolerance, across: look.Airspeed) -> None:
    """The size that is allowed against the highest speed: a larger one has too large cycles."""
    stable = sorted((one.speed, one.amplitude) for one in result.branch.cycles if one.stable)
    speed, amplitude = np.array(stable).reshape(-1, 2).T
    allowed = result.amplitude / np.maximum.accumulate(amplitude)
    shown = speed <= 1.02 * result.speed
    if shown.any():
        x, y = speed[shown] / across.unit, allowed[shown]
        axes.plot(x, y, color=meaning.EXACT, label="allowed size")
        top = 1.5 * float(y.max())
        if top > 15.0 * y.min():
            layout.logarithmic(axes.yaxis)
            axes.set_ylim(0.7 * y.min(), top)
        else:
            axes.set_ylim(0.0, top)
        axes.fill_between(
            x, y, top, color=meaning.WARNING, alpha=meaning.SHADING, linewidth=0,
            label="not allowed to stable cycles",
        )  # fmt: skip
    if np.isfinite(result.factor):
        axes.plot(result.speed / across.unit, result.factor, "D", color=meaning.INK, label="answer")
    axes.set_xlabel(f"highest {across.label}")
    axes.set_ylabel("size over that of the case")


def _trials(axes: Axes, result: Tolerance) -> None:
    """The largest stable amplitude against what varies, with the limit and the answer."""
    limit = float(told(result.amplitude))
    tried = np.array(result.trials) * [1.0 if result.vary == "size" else DEGREES, DEGREES]
    shown = tried[:, 1] <= 4.0 * limit
    axes.plot(
        tried[shown, 0], tried[shown, 1], "o-", color=meaning.EXACT,
        label="largest stable cycle of a trial",
    )  # fmt: skip
    axes.set_xlabel(NAMES_OF_VARIED[result.vary])
    axes.set_ylim(0.0, 1.15 * max(limit, float(tried[shown, 1].max(initial=0.0))))
    if result.spring is not None:
        answer = result.varied * (1.0 if result.vary == "size" else DEGREES)
        axes.plot(answer, limit, "D", color=meaning.INK, linestyle="none", label="answer")
        refused = (
            (axes.get_xlim()[0], answer) if result.vary == "friction"
            else (answer, axes.get_xlim()[1])
        )  # fmt: skip
        axes.axvspan(*refused, color=meaning.WARNING, alpha=meaning.SHADING, linewidth=0)
        axes.set_title(f"answer {answer:.4g}")
    _limit(axes, limit)
    axes.set_ylabel("largest stable amplitude (deg)")
