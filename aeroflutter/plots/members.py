"""A family of results over the values of one key, in one figure."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.plots import layout, meaning
from aeroflutter.plots import style as look
from aeroflutter.plots.branches import Line, draw_line, frame
from aeroflutter.results.unit import told

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from aeroflutter.studies.vary import Member, Members

    Array = NDArray[Any]

__all__ = ["plot_members"]

NAMED = 8  # members that are named in a legend; more have a scale of colours


def plot_members(found: Members, title: str = "", *, si: bool = True) -> Figure:
    """What every member gives beside what that comes to against the key.

    Parameters
    ----------
    found
        Root loci, cycles of one method, or onsets.
    title
        Written above.
    si
        Airspeeds and frequencies in m/s and Hz, where all members have a scale.
    """
    si = si and all(one.case.scale is not None for one in found.members)
    if hasattr(found.members[0].result, "free_below"):
        from aeroflutter.plots.onset import plot_onsets

        return plot_onsets(found, title, si=si)
    linear = hasattr(found.members[0].result, "roots")
    with look.style():
        figure, panels = layout.figure(
            1, 3 if linear else 2, width=10.5 if linear else 9.4, height=4.3
        )
        if linear:
            _frequency(panels[0], found, si)
            _damping(panels[1], found, si)
        else:
            draw(panels[0], found, si=si)
        _against(panels[-1], found, linear, si)
        if len(found.members) > NAMED:
            _scale(figure, found)
        layout.finish(figure, title)
    return figure


def draw(axes: Axes, found: Members, *, si: bool = True) -> None:
    """Amplitude over airspeed, damping of root loci or proofs of onset, a colour a member."""
    if hasattr(found.members[0].result, "free_below"):
        from aeroflutter.plots.onset import draw_onsets

        draw_onsets(axes, found, si=si)
        return
    if hasattr(found.members[0].result, "roots"):
        _damping(axes, found, si)
        return
    every: list[Line] = []
    for member, colour in _coloured(found):
        across = _across(found, member, si)
        _name(axes, found, member, colour)
        for speed, amplitude, stable in _lines(member):
            one = Line(speed / across.unit, told(amplitude), stable)
            draw_line(axes, one, colour)
            every.append(one)
    if every:
        layout.stability(axes)
    frame(axes, every, across, _flutter(found, si))


def _coloured(found: Members) -> list[tuple[Member, Any]]:
    """Members with their colours, dark to light as the value grows."""
    shade = _shades(found)
    return [(member, shade.to_rgba(member.value)) for member in found.members]


def _shades(found: Members) -> Any:
    """The scale of colours over the values of the key, without its lightest end."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import ListedColormap, Normalize

    values = [member.value for member in found.members]
    dark = ListedColormap(colormaps[meaning.VALUES](np.linspace(0.0, 0.88, 256)))
    return ScalarMappable(Normalize(min(values), max(values)), dark)


def _scale(figure: Figure, found: Members) -> None:
    figure.colorbar(_shades(found), ax=figure.axes, label=found.key)


def _across(found: Members, member: Member, si: bool) -> look.Airspeed:
    """Members with scales of their own are compared in m/s; without, in U*, which is one unit."""
    if si:
        return look.Airspeed.of(None, member.case.scale)
    flutter = {_flutter_of(one.result) for one in found.members}
    return look.Airspeed.of(flutter.pop() if len(flutter) == 1 else None)


def _lines(member: Member) -> list[tuple[Array, Array, Array]]:
    """Speed, amplitude and stability along every family of cycles."""
    result = member.result
    if isinstance(result, tuple):  # harmonic balance
        return [(one.speed, one.amplitude, one.stable) for one in result]
    if hasattr(result, "families") and hasattr(result, "cycles"):
        return [
            (
                np.array([cycle.speed for cycle in family.cycles]),
                np.array([cycle.amplitude for cycle in family.cycles]),
                np.array([cycle.stable for cycle in family.cycles]),
            )
            for family in result.families
        ]
    parts = [result.family == one.number for one in result.families]
    return [(result.speed[at], result.amplitude[at], result.stable[at]) for at in parts]


def _frequency(axes: Axes, found: Members, si: bool) -> None:
    for member, colour in _coloured(found):
        roots, speeds = member.result.roots, member.result.speeds
        scale = member.case.scale
        across = look.Airspeed.of(None, scale if si else None)
        up = np.where(roots.imag > 0, roots.imag, np.nan)
        shown = scale.frequency_hz(up, speeds[:, None]) if si else up * speeds[:, None]
        axes.plot(speeds / across.unit, shown, color=colour)
        _name(axes, found, member, colour)
    axes.set_xlabel(across.label)
    axes.set_ylabel(look.HERTZ if si else look.FREQUENCY_RATIO)
    axes.set_ylim(bottom=0)
    axes.set_title("frequency")


def _damping(axes: Axes, found: Members, si: bool) -> None:
    for member, colour in _coloured(found):
        roots = member.result.roots
        across = look.Airspeed.of(None, member.case.scale if si else None)
        ratio = np.where(roots.imag > 0, -roots.real / np.maximum(np.abs(roots), 1e-300), np.nan)
        axes.plot(member.result.speeds / across.unit, ratio, color=colour)
        _name(axes, found, member, colour)
    axes.axhline(0.0, color=meaning.FAINT, linewidth=0.9)
    axes.set_xlabel(across.label)
    axes.set_ylabel("damping ratio")
    axes.set_title("damping")


def _name(axes: Axes, found: Members, member: Member, colour: Any) -> None:
    """The legend's line of a member, where there are few."""
    if len(found.members) <= NAMED:
        key = found.key.rpartition(".")[2]
        layout.name(axes, f"{key} = {member.value:g}", color=colour)


def _flutter(found: Members, si: bool) -> float | None:
    """The flutter speed of all members, U*, where it is one place on their axis."""
    speeds = {_flutter_of(one.result) for one in found.members}
    across = {_across(found, one, si) for one in found.members}
    return speeds.pop() if len(speeds) == len(across) == 1 else None


def _flutter_of(result: Any) -> float | None:
    first = result[0] if isinstance(result, tuple) else result
    if hasattr(first, "roots"):
        return None if first.flutter is None else float(first.flutter.speed)
    found: float | None = first.flutter_speed
    return found


def _speed_of(result: Any, name: str) -> float:
    """The lowest speed U* of this name that a result has, or NaN."""
    parts = result if isinstance(result, tuple) else (result,)
    found = [one for one in (getattr(part, name) for part in parts) if one is not None]
    speeds = [one if isinstance(one, float) else getattr(one, "cycle", one).speed for one in found]
    return min(speeds, default=np.nan)


def _against(axes: Axes, found: Members, linear: bool, si: bool) -> None:
    """Airspeeds that matter against the key."""
    kinds = (
        {"flutter": ("o-", "flutter"), "divergence": ("s--", "divergence")}
        if linear
        else meaning.LOWEST
    )
    value = [member.value for member in found.members]
    units = [_across(found, member, si).unit for member in found.members]
    low, high = np.inf, -np.inf
    for name, (mark, label) in kinds.items():
        speed = [
            _speed_of(member.result, name) / unit
            for member, unit in zip(found.members, units, strict=True)
        ]
        if np.isfinite(speed).any():
            axes.plot(value, speed, mark, color=meaning.INK, markerfacecolor="white", label=label)
            low, high = min(low, np.nanmin(speed)), max(high, np.nanmax(speed))
    axes.set_xlabel(found.key)
    axes.set_ylabel(_across(found, found.members[0], si).label)
    if low <= high:
        room = 0.4 * max(high - low, 0.05 * high)
        axes.set_ylim(max(0.0, low - room), high + 0.5 * room)
