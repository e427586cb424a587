"""A family of results over the values of one key, in one figure."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.plots import style as look
from aeroflutter.results import fields_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from aeroflutter.studies.vary import Member, Members

    Array = NDArray[Any]

__all__ = ["plot_members"]

NAMED = 8  # members that are named in a legend
ONSETS = (("onset", look.BLACK, "lowest cycle"), ("stable_onset", look.BLUE, "lowest stable cycle"))


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
        figure, panels = look.figure(1, 3 if linear else 2, width=10.5 if linear else 9.4)
        if linear:
            _frequency(panels[0], found, si)
            _damping(panels[1], found, si)
        else:
            draw(panels[0], found, si=si)
        _against(panels[-1], found, linear, si)
        if title:
            look.headline(figure, title)
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
    for member, colour in _coloured(found):
        across = _across(found, member, si)
        axes.plot([], [], color=colour, label=f"{member.value:g}")
        for speed, amplitude, stable in _lines(member):
            for run, solid in look.segments(stable):
                axes.plot(
                    (speed / across.unit)[run], np.degrees(amplitude)[run],
                    "-" if solid else "--", color=colour,
                )  # fmt: skip
    axes.set_xlabel(across.label)
    axes.set_ylabel(look.AMPLITUDE)
    axes.set_title("stable solid, unstable dashed")
    _limits(axes, found, si)
    _legend(axes, found)


def _coloured(found: Members) -> list[tuple[Member, Any]]:
    """Members with their colours, dark to light as the value grows."""
    from matplotlib import colormaps

    values = [member.value for member in found.members]
    order = np.argsort(np.argsort(values)) / max(len(values) - 1, 1)
    return [
        (member, colormaps["viridis"](0.88 * place))
        for member, place in zip(found.members, order, strict=True)
    ]


def _across(found: Members, member: Member, si: bool) -> look.Airspeed:
    """Members with scales of their own are compared in m/s; without, in U*, which is one unit."""
    if si:
        return look.Airspeed.of(None, member.case.scale)
    flutter = {fields_of(one.result).get("flutter_speed") for one in found.members}
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


def _limits(axes: Axes, found: Members, si: bool) -> None:
    """Around the lowest cycles: near flutter amplitudes grow without bound."""
    onsets = []
    for member in found.members:
        onset = fields_of(member.result)["onset"]
        if onset:
            onsets.append((onset["speed"] / _across(found, member, si).unit, onset))
    if not onsets:
        return
    low = min(speed for speed, _ in onsets)
    flutters = [
        fields_of(one.result).get("flutter_speed") or np.nan for one in found.members
    ]  # fmt: skip
    units = [_across(found, member, si).unit for member in found.members]
    ends = np.array(flutters) / units
    high = float(np.nanmax(ends)) if np.isfinite(ends).any() else axes.get_xlim()[1]
    axes.set_xlim(low - 0.06 * (high - low), high + 0.04 * (high - low))
    top = max(float(onset["amplitude_deg"]) for _, onset in onsets)
    axes.set_ylim(0.0, min(12.0 * top, axes.get_ylim()[1]))


def _frequency(axes: Axes, found: Members, si: bool) -> None:
    for member, colour in _coloured(found):
        roots, speeds = member.result.roots, member.result.speeds
        scale = member.case.scale
        across = look.Airspeed.of(None, scale if si else None)
        up = np.where(roots.imag > 0, roots.imag, np.nan)
        shown = scale.frequency_hz(up, speeds[:, None]) if si else up * speeds[:, None]
        axes.plot(speeds / across.unit, shown, color=colour)
    axes.set_xlabel(across.label)
    axes.set_ylabel(look.HERTZ if si else look.FREQUENCY_RATIO)
    axes.set_ylim(bottom=0)
    axes.set_title("frequency")


def _damping(axes: Axes, found: Members, si: bool) -> None:
    for member, colour in _coloured(found):
        roots = member.result.roots
        across = look.Airspeed.of(None, member.case.scale if si else None)
        ratio = np.where(roots.imag > 0, -roots.real / np.maximum(np.abs(roots), 1e-300), np.nan)
        lines = axes.plot(member.result.speeds / across.unit, ratio, color=colour)
        lines[0].set_label(f"{member.value:g}")
    axes.axhline(0.0, color=look.BLACK, linewidth=0.7)
    axes.set_xlabel(across.label)
    axes.set_ylabel("damping ratio")
    axes.set_title("damping")
    _legend(axes, found)


def _legend(axes: Axes, found: Members) -> None:
    if len(found.members) <= NAMED:
        axes.legend(title=found.key.rpartition(".")[2], loc="upper left")


def _against(axes: Axes, found: Members, linear: bool, si: bool) -> None:
    """Airspeeds that matter against the key."""
    kinds = (
        (("flutter", look.BLACK, "flutter"), ("divergence", look.PURPLE, "divergence"))
        if linear
        else ONSETS
    )
    value = [member.value for member in found.members]
    units = [_across(found, member, si).unit for member in found.members]
    for name, colour, label in kinds:
        records = [fields_of(member.result).get(name) for member in found.members]
        speed = [
            np.nan if record is None else record["speed"] / unit
            for record, unit in zip(records, units, strict=True)
        ]
        if np.isfinite(speed).any():
            axes.plot(value, speed, "o-", color=colour, label=label)
    axes.set_xlabel(found.key)
    axes.set_ylabel(_across(found, found.members[0], si).label)
    axes.set_ylim(bottom=0)
    if axes.get_legend_handles_labels()[0]:
        axes.legend()
