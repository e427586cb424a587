"""Floquet multipliers in the complex plane: all of them in the figure, on one scale of colours."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.plots import layout, meaning
from aeroflutter.plots import style as look

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from aeroflutter.model.section import Scale
    from aeroflutter.orbits.cycles import Cycle, LimitCycles

__all__ = ["plot_multipliers"]

_PANELS = 6
_STABILITY = {True: (meaning.EXACT, "of stable cycles"), False: (meaning.WARNING, "of unstable")}


def plot_multipliers(
    result: LimitCycles,
    title: str = "",
    at: Sequence[Cycle] | None = None,
    scale: Scale | None = None,
) -> Figure:
    """Floquet multipliers in the complex plane, one panel a family; those that are one left out.

    Beyond the unit circle distances from the origin are logarithmic, a ring a decade.

    Parameters
    ----------
    result
        The families.
    title
        Written above.
    at
        Draw only these cycles, in one panel.
    scale
        Shows airspeeds in m/s.
    """
    across = look.Airspeed.of(result.flutter_speed, scale)
    groups = [one.cycles for one in result.families[:_PANELS]] if at is None else [tuple(at)]
    columns = min(3, max(1, len(groups)))
    rows = max(1, -(-len(groups) // columns))
    with look.style():
        figure, grid = layout.figure(
            rows, columns, width=3.0 * columns + 0.9, height=3.1 * rows + 0.5, squeeze=False
        )
        shown = grid.flat[: len(groups)]
        for axes in grid.flat[len(groups) :]:
            axes.remove()
        if at is None and groups:
            _by_speed(figure, shown, groups, across)
        elif groups:
            _by_stability(shown[0], groups[0])
        layout.finish(figure, title)
    return figure


def _by_speed(
    figure: Figure,
    panels: NDArray[np.object_],
    groups: Sequence[Sequence[Cycle]],
    across: look.Airspeed,
) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    speeds = [cycle.speed / across.unit for cycles in groups for cycle in cycles]
    scale = ScalarMappable(Normalize(min(speeds), max(speeds)), meaning.VALUES)
    for axes, cycles in zip(panels, groups, strict=True):
        _plane(axes, _reach(cycles))
        z = [_folded(_others(cycle)) for cycle in cycles]
        colours = [scale.to_rgba(np.array(cycle.speed / across.unit)) for cycle in cycles]
        c = [one for one, part in zip(colours, z, strict=True) for _ in range(part.size)]
        every = np.concatenate(z)
        axes.scatter(every.real, every.imag, s=7, c=c, zorder=3)
        axes.set_title(f"family {cycles[0].family}")
    figure.colorbar(scale, ax=list(panels), label=across.label, shrink=0.9)


def _by_stability(axes: Axes, cycles: Sequence[Cycle]) -> None:
    _plane(axes, _reach(cycles))
    for stable, (colour, label) in _STABILITY.items():
        z = [_folded(_others(cycle)) for cycle in cycles if cycle.stable == stable]
        if z:
            every = np.concatenate(z)
            mark = "o" if stable else "s"
            axes.plot(every.real, every.imag, mark, color=colour, label=label, zorder=3)


def _others(cycle: Cycle) -> NDArray[np.complex128]:
    """The multipliers but those that are one by nature."""
    return cycle.multipliers[2 if cycle.continuum else 1 :]


def _folded(z: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Where multipliers are drawn: as they are inside the unit circle, by decades outside."""
    size = np.abs(z)
    return z * np.where(size > 1.0, (1.0 + np.log10(np.maximum(size, 1.0))) / size.clip(1.0), 1.0)


def _reach(cycles: Sequence[Cycle]) -> float:
    return max([1.0, *(float(np.abs(_folded(_others(one))).max(initial=1.0)) for one in cycles)])


def _plane(axes: Axes, reach: float) -> None:
    """The unit circle, and a ring a decade outside, named."""
    turn = np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 361))
    axes.plot(turn.real, turn.imag, color=meaning.INK, linewidth=0.9)
    for decade in range(1, int(np.ceil(reach))):
        ring: Any = (1.0 + decade) * turn
        axes.plot(ring.real, ring.imag, color="#CCCCCC", linewidth=0.6, zorder=1)
    end = 1.12 * max(1.0, reach)
    places = np.arange(1.0, np.floor(end) + 0.5)
    if places.size > 2:
        places = places[[0, -1]]
    ticks = [-places[::-1], [0.0], places]
    names = ["0" if at == 0 else f"{np.sign(at) * 10 ** (abs(at) - 1):g}" for at in np.r_[*ticks]]
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_ticks(np.r_[*ticks], names)
    axes.set_xlim(-end, end)
    axes.set_ylim(-end, end)
    axes.grid(False)
    axes.set_aspect("equal")
    axes.set_xlabel("real part")
    axes.set_ylabel("imaginary part")
