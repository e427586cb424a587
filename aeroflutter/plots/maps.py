"""Flutter maps like the thesis's figures 5.5a to 5.31a, and distributions of sweeps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.plots import layout, meaning
from aeroflutter.plots import style as look
from aeroflutter.results.fields import FIELDS
from aeroflutter.results.studies import spoken
from aeroflutter.results.unit import spoken_unit
from aeroflutter.studies.maps.engines import FAILED
from aeroflutter.verdicts import STATES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from aeroflutter.studies.maps.flutter_map import FlutterMap
    from aeroflutter.studies.maps.sweep import SweepResult

    Array = NDArray[np.float64]

LABELS = {
    "speed": look.SPEED,
    "speed_ratio": look.SPEED_RATIO,
    "velocity": look.VELOCITY,
    "initial.alpha_deg": FIELDS["alpha"].axis,
}
AIRSPEEDS = ("speed", "speed_ratio")
MARKS = {
    "linear flutter": (meaning.INK, "-"),
    "DF onset": (meaning.DESCRIBING, (0, (5, 2))),
    "exact onset": (meaning.EXACT, (0, (1, 1.5))),
}
NO_CYCLE = "#F2F2F2"
DECADE = 10.0  # amplitudes further apart are coloured by their logarithm


def plot_map(
    found: FlutterMap,
    title: str = "",
    marks: Mapping[str, float] | None = None,
    velocity: float | None = None,
) -> Figure:
    """The regions of a map, and the amplitude of the limit cycles in them.

    Parameters
    ----------
    found : FlutterMap
    title : str
    marks : mapping
        Speeds to mark, in units of the x axis, by what they are.
    velocity : float, optional
        m/s of one unit of the axis of speeds; it is then drawn in m/s.
    """
    found, labels = _in_metres(found, velocity)
    marks = {name: speed * (velocity or 1.0) for name, speed in (marks or {}).items()}
    with look.style():
        figure, axes = layout.figure(1, 2, width=10.5, height=4.6)
        draw(axes[0], found)
        _amplitudes(figure, axes[1], found)
        for panel in axes:
            _limits(panel, found)
            panel.set_xlabel(labels[0])
            panel.set_ylabel(labels[1])
            panel.grid(False)
        _mark(axes, marks)
        layout.finish(figure, title)
    return figure


def _in_metres(found: FlutterMap, velocity: float | None) -> tuple[FlutterMap, list[str]]:
    """The map with its speeds in m/s where that is asked for, and the labels of its axes."""
    axes = {"x": found.grid.x, "y": found.grid.y}
    labels = [LABELS.get(axis.key, axis.key) for axis in axes.values()]
    boundaries = {}
    for place, (name, axis) in enumerate(axes.items()):
        if axis.key in AIRSPEEDS and velocity is not None:
            axes[name] = replace(axis, values=velocity * axis.values)
            labels[place] = look.VELOCITY
            edge = getattr(found, f"boundary_{name}")
            if edge is not None:
                boundaries[f"boundary_{name}"] = velocity * edge
    grid = replace(found.grid, **axes)
    return replace(found, grid=grid, **boundaries), labels


def draw(axes: Axes, found: FlutterMap) -> None:
    """The regions of a map."""
    from matplotlib.colors import ListedColormap

    names = [*STATES, "failed"]
    codes = np.where(found.state == FAILED, len(STATES), found.state)
    axes.pcolormesh(
        edges(found.grid.x.values),
        edges(found.grid.y.values),
        codes.T,
        cmap=ListedColormap([meaning.STATES[name] for name in names]),
        vmin=-0.5,
        vmax=len(names) - 0.5,
        rasterized=True,
    )
    for k, name in enumerate(names):
        if np.any(codes == k):
            label = meaning.STATE_NAMES.get(name, name)
            layout.name(
                axes, label, marker="s", markersize=8, linestyle="none",
                color=meaning.STATES[name], markeredgecolor=meaning.FAINT,
            )  # fmt: skip
    _boundaries(axes, found)


def draw_labelled(axes: Axes, found: FlutterMap) -> None:
    """The regions of a map with the names of its axes."""
    draw(axes, found)
    axes.set_xlabel(LABELS.get(found.grid.x.key, found.grid.x.key))
    axes.set_ylabel(LABELS.get(found.grid.y.key, found.grid.y.key))


def _boundaries(axes: Axes, found: FlutterMap) -> None:
    """Refined boundaries, if there are any."""
    points = []
    if found.boundary_x is not None:
        i, j = np.nonzero(np.isfinite(found.boundary_x))
        points.append((found.boundary_x[i, j], found.grid.y.values[j]))
    if found.boundary_y is not None:
        i, j = np.nonzero(np.isfinite(found.boundary_y))
        points.append((found.grid.x.values[i], found.boundary_y[i, j]))
    for across, up in points:
        axes.plot(
            across, up, ".", color=meaning.INK, markersize=1.5, rasterized=True,
            label="refined boundary",
        )  # fmt: skip


def _amplitudes(figure: Figure, axes: Axes, found: FlutterMap) -> None:
    from matplotlib.colors import LogNorm, Normalize

    cycling = found.state == STATES.index("lco")
    amplitude = np.ma.masked_where(~cycling, spoken("amplitude_deg", found.amplitude_deg))
    drawn = axes.pcolormesh(
        edges(found.grid.x.values),
        edges(found.grid.y.values),
        amplitude.T,
        cmap=meaning.VALUES,
        rasterized=True,
    )
    axes.set_facecolor(NO_CYCLE)
    axes.set_title("amplitude of limit cycles; none where it is blank", fontsize="medium")
    if not cycling.any():
        axes.text(0.5, 0.5, "no limit cycle", transform=axes.transAxes, ha="center", va="center")
        return
    sizes = spoken("amplitude_deg", found.amplitude_deg)[cycling]
    least, most = float(sizes.min()), float(sizes.max())
    wide = most > DECADE * least > 0.0
    drawn.set_norm(LogNorm(least, most) if wide else Normalize(0.0, most))
    bar = figure.colorbar(drawn, ax=axes, label=spoken_unit().words(SWEEP_PANELS["amplitude_deg"]))
    if wide:
        layout.logarithmic(bar.ax.yaxis)


def edges(centres: Array) -> Array:
    """Edges of cells about their centres, (m+1,)."""
    if centres.size == 1:
        half = 0.05 * abs(centres[0]) or 0.5
        return np.array([centres[0] - half, centres[0] + half])
    middle = 0.5 * (centres[1:] + centres[:-1])
    first = centres[0] - (middle[0] - centres[0])
    return np.concatenate(([first], middle, [2.0 * centres[-1] - middle[-1]]))


def _limits(axes: Axes, found: FlutterMap) -> None:
    x, y = edges(found.grid.x.values), edges(found.grid.y.values)
    axes.set_xlim(x.min(), x.max())
    axes.set_ylim(y.min(), y.max())


def _mark(axes: NDArray[np.object_], marks: Mapping[str, float]) -> None:
    """Lines at speeds within the map, named with their values; they are seen on any colour."""
    from matplotlib.patheffects import withStroke

    low, high = axes[0].get_xlim()
    for name, speed in marks.items():
        if not low <= speed <= high:
            continue
        colour, dashes = MARKS.get(name, (meaning.INK, ":"))
        line: dict[str, Any] = {"color": colour, "linestyle": dashes, "linewidth": 1.5}
        for panel in axes:
            drawn = panel.axvline(speed, label=f"{name} {speed:.5g}", **line)
            drawn.set_path_effects([withStroke(linewidth=3.2, foreground="white")])


def _colour(name: str, found: SweepResult) -> str:
    """Of what a distribution is of: the linear system, or the method of the onset."""
    if not name.startswith("onset"):
        return meaning.INK
    return meaning.EXACT if found.onset_method == "exact" else meaning.DESCRIBING


ONSET = {"describing": "describing function", "exact": "exact"}
SWEEP_PANELS = {
    "flutter_speed": r"linear flutter speed $U^*_L$",
    "onset_speed": "onset of limit cycles $U^*$ ({})",
    "amplitude_deg": "pitch amplitude of the limit cycle (deg)",
}


IN_METRES = {
    "flutter_velocity_m_s": "linear flutter speed $V$ (m/s)",
    "onset_velocity_m_s": "onset of limit cycles $V$ (m/s), {}",
    "amplitude_deg": SWEEP_PANELS["amplitude_deg"],
}


def plot_sweep(found: SweepResult, title: str = "", *, si: bool = True) -> Figure:
    """Histograms of what a sweep found, with the median and the 5 to 95 % range.

    Speeds are in m/s where the sections have scales, unless `si` is false.
    """
    panels_of = IN_METRES if si and found.of("flutter_velocity_m_s").size else SWEEP_PANELS
    shown = [name for name in panels_of if found.of(name).size]
    panels = max(len(shown), 1)
    with look.style():
        figure, axes = layout.figure(1, panels, width=3.8 * panels + 0.4, height=3.7, squeeze=False)
        for panel, name in zip(axes[0], shown, strict=False):
            _histogram(panel, spoken(name, found.of(name)), _colour(name, found))
            panel.set_xlabel(panels_of[name].format(ONSET.get(found.onset_method, "")))
            panel.set_ylabel("sections")
        layout.finish(figure, title)
    return figure


def draw_sweep(axes: Axes, found: SweepResult, *, si: bool = True) -> None:
    """The distribution of the flutter speed."""
    name = "flutter_velocity_m_s" if si and found.of("flutter_velocity_m_s").size else ""
    _histogram(axes, found.of(name or "flutter_speed"), meaning.INK)
    axes.set_xlabel(IN_METRES[name] if name else SWEEP_PANELS["flutter_speed"])
    axes.set_ylabel("sections")


def _histogram(axes: Axes, values: Array, colour: str) -> None:
    low, middle, high = np.quantile(values, (0.05, 0.5, 0.95))
    spread = float(np.ptp(values))
    bars: dict[str, Any] = {"color": colour, "alpha": 0.45, "edgecolor": "white", "linewidth": 0.4}
    if spread <= 1e-9 * abs(middle):
        half = 0.1 * abs(middle) or 1.0
        axes.hist(values, bins=9, range=(middle - half, middle + half), **bars)
    else:
        axes.hist(values, bins=int(np.clip(np.sqrt(values.size), 5, 60)), **bars)
    axes.axvspan(
        low, high, color=meaning.FAINT, alpha=meaning.SHADING, linewidth=0, label="5 to 95 %"
    )
    axes.axvline(middle, color=meaning.INK, linewidth=1.2, label="median")
    layout.whole_numbers(axes.yaxis)
    axes.set_title(f"median {middle:.4g}; {low:.4g} to {high:.4g}", fontsize="medium")
