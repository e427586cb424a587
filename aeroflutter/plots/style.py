"""One look for every figure: fonts, lines, labels as the field writes them; how they are saved."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.errors import InputError
from aeroflutter.plots import meaning
from aeroflutter.results.fields import FIELDS
from aeroflutter.results.fields import FREQUENCY as FREQUENCY_KIND
from aeroflutter.results.fields import SPEED as SPEED_KIND
from aeroflutter.results.fields import TIME as TIME_KIND
from aeroflutter.results.unit import spoken_unit, start_unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from aeroflutter.model.section import Scale

SPEED, SPEED_RATIO, AMPLITUDE, PITCH, MOMENT, HEAVE, TIME, FREQUENCY_RATIO = (
    FIELDS[name].axis
    for name in (
        *("speed", "speed_ratio", "amplitude", "pitch", "moment", "heave", "time"),
        "omega_ratio",
    )
)

VELOCITY, HERTZ, SECONDS = (
    kind.si.axis if kind.si else "" for kind in (SPEED_KIND, FREQUENCY_KIND, TIME_KIND)
)

_RC: dict[str, Any] = {
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.labelsize": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#444444",
    "axes.linewidth": 0.7,
    "axes.grid": True,
    "grid.color": "#DDDDDD",
    "grid.linewidth": 0.5,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "legend.fontsize": 8.0,
    "legend.frameon": False,
    "legend.handlelength": 1.8,
    "legend.columnspacing": 1.4,
    "legend.labelspacing": 0.3,
    "lines.linewidth": 1.4,
    "lines.markersize": 4.0,
    "figure.dpi": 160,
    "savefig.dpi": 200,
    "svg.hashsalt": "aeroflutter",
    "pdf.fonttype": 42,
}


_SMALL: dict[str, Any] = {  # of figures of a stated width, whose text is read at that size
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "axes.labelsize": 8.0,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "legend.fontsize": 7.0,
    "legend.title_fontsize": 7.0,
    "lines.linewidth": 1.2,
    "lines.markersize": 3.5,
}
WIDTHS = (60.0, 400.0)  # mm
WIDTH: ContextVar[float | None] = ContextVar(
    "width", default=None
)  # mm; None: as each figure likes


@contextmanager
def style() -> Iterator[None]:
    """Draw under the project's style, leaving matplotlib's settings as they were."""
    import matplotlib
    from cycler import cycler

    settings: Any = {**_RC, "axes.prop_cycle": cycler(color=meaning.SERIES)}
    if WIDTH.get() is not None:
        settings |= _SMALL
    with matplotlib.rc_context(settings):
        yield


@contextmanager
def sized(millimetres: float | None) -> Iterator[None]:
    """Make figures as wide as a column of a journal: 85 and 180 mm are the usual ones.

    Raises
    ------
    InputError
        If that is no width for a figure.
    """
    low, high = WIDTHS
    if millimetres is not None and not low <= millimetres <= high:
        raise InputError(f"width: must be {low:g} to {high:g} mm, not {millimetres:g}")
    before = WIDTH.set(millimetres)
    try:
        yield
    finally:
        WIDTH.reset(before)


def save(drawing: Figure, path: Path, dpi: int | None = None) -> None:
    """Write a figure, the same bytes every time: no clock, no random identifiers.

    By 150 dots an inch, or by 600 where its width is that of a printed column.
    """
    if dpi is None:
        dpi = 150 if WIDTH.get() is None else 600
    clock = {".svg": "Date", ".pdf": "CreationDate"}.get(path.suffix)
    with style():
        drawing.savefig(path, dpi=dpi, metadata={clock: None} if clock else None)


@dataclass(frozen=True)
class Airspeed:
    """How a figure shows airspeeds: U* of one unit of its axis, and the label of that."""

    unit: float
    label: str

    @classmethod
    def of(cls, flutter: float | None, scale: Scale | None = None) -> Airspeed:
        """In m/s if there is a scale, else over the flutter speed U*_L, else as U*."""
        if scale is not None:
            return cls(scale.speed(1.0), VELOCITY)
        return cls(1.0, SPEED) if flutter is None else cls(flutter, SPEED_RATIO)

    def said(self, speed: float) -> str:
        """An airspeed U* in words, for a legend."""
        unit = " m/s" if self.label == VELOCITY else ""
        name = "$U^*$ = " if self.label == SPEED else ""
        return f"{name}{speed / self.unit:.4g}{unit}"


@dataclass(frozen=True)
class Clock:
    """How a figure at one speed shows times, frequencies and rates.

    Attributes
    ----------
    second
        tau of one unit of time.
    time, frequency, per
        Labels of the axes of time and frequency, and what a rate is per.
    """

    second: float = 1.0
    time: str = TIME
    frequency: str = r"reduced frequency $k = \omega b/V$"
    per: str = r"unit $\tau$"

    @classmethod
    def of(cls, speed: float, scale: Scale | None) -> Clock:
        """In s and Hz if there is a scale, else in tau and k."""
        if scale is None:
            return cls()
        return cls(1.0 / scale.seconds(1.0, speed), SECONDS, HERTZ, "s")

    def hertz(self, k: Any) -> Any:
        """Reduced frequencies as the axis shows them."""
        return k if self.frequency != HERTZ else k * self.second / (2.0 * np.pi)


def literal(text: str) -> str:
    """Words of the user's own, in which a dollar is a dollar and no formula."""
    return text.replace("$", r"\$")


def segments(flags: np.ndarray) -> list[tuple[slice, bool]]:
    """Runs of equal flags as slices that overlap by one point, so that drawn lines join up."""
    if flags.size == 0:
        return []
    edges = np.nonzero(np.diff(flags.astype(int)))[0] + 1
    starts, stops = [0, *edges], [*edges, flags.size]
    return [
        (slice(start, min(stop + 1, flags.size)), bool(flags[start]))
        for start, stop in zip(starts, stops, strict=True)
    ]


def named_after(figure: Figure, coordinate: str) -> Figure:
    """The figure in the words of its coordinate, of its unit and of its speeds."""
    words = spoken_unit().words
    keeps = FIELDS["alpha"].axis if start_unit() is not spoken_unit() else ""
    for axes in figure.axes:
        for label in (axes.xaxis.label, axes.yaxis.label, axes.title):
            if (text := label.get_text()) != keeps:
                text = text.replace("pitch", coordinate)
                text = re.sub(r"(?<!_)\\alpha", r"\\xi", text) if coordinate == "heave" else text
                label.set_text(words(text))
    return figure
