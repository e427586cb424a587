"""One look for every figure: colour-blind-safe colours, symbols as the field writes them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.results.fields import FIELDS
from aeroflutter.results.fields import FREQUENCY as FREQUENCY_KIND
from aeroflutter.results.fields import SPEED as SPEED_KIND
from aeroflutter.results.fields import TIME as TIME_KIND

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from aeroflutter.model.section import Scale

# Okabe and Ito's palette: distinguishable with any colour vision and in grey
BLUE = "#0072B2"
ORANGE = "#E69F00"
GREEN = "#009E73"
VERMILION = "#D55E00"
PURPLE = "#CC79A7"
SKY = "#56B4E9"
BLACK = "#222222"
GREY = "#8A8A8A"
CYCLE = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, BLACK)

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

SYMBOLS = {  # what keys and plain titles call by name
    "omega_bar": r"$\bar\omega$",
    "delta_v": r"$\Delta V$",
    "delta_h": r"$\Delta H$",
    "V_off": r"$V_\mathrm{off}$",
    "H_off": r"$H_\mathrm{off}$",
    "beta3": r"$\beta_3$",
    "rad^2": r"rad$^2$",
    "lco": "limit cycle",
}

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
    "lines.linewidth": 1.4,
    "lines.markersize": 4.0,
    "figure.dpi": 160,
    "savefig.dpi": 200,
    "svg.hashsalt": "aeroflutter",
    "pdf.fonttype": 42,
}


@contextmanager
def style() -> Iterator[None]:
    """Draw under the project's style, leaving matplotlib's settings as they were."""
    import matplotlib
    from cycler import cycler

    settings: Any = {**_RC, "axes.prop_cycle": cycler(color=CYCLE)}
    with matplotlib.rc_context(settings):
        yield


def figure(
    rows: int = 1, columns: int = 1, *, width: float = 6.4, height: float = 4.0, **keywords: Any
) -> tuple[Figure, Any]:
    """A figure without a window, and its axes as ``Figure.subplots`` gives them."""
    from matplotlib.figure import Figure

    drawing = Figure(figsize=(width, height), layout="constrained")
    return drawing, drawing.subplots(rows, columns, **keywords)


def save(drawing: Figure, path: Path, dpi: int = 150) -> None:
    """Write a figure, the same bytes every time: no clock, no random identifiers."""
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


def headline(drawing: Figure, text: str) -> None:
    """The title of a whole figure, on as many lines as its width makes of it, in symbols."""
    lines = wrap(text, int(12 * drawing.get_figwidth()))
    named = rf"\b(?:{'|'.join(map(re.escape, SYMBOLS))})\b"
    title = re.sub(named, lambda found: SYMBOLS[found[0]], "\n".join(lines))
    drawing.suptitle(title, fontsize=10.5)


def mark_speed(axes: Axes, speed: float, text: str, *, colour: str = GREY) -> None:
    """A thin vertical line at a speed, labelled inside the top of the axes."""
    axes.axvline(speed, color=colour, linewidth=0.8, linestyle=":")
    axes.annotate(
        text,
        (speed, 1.0),
        xycoords=("data", "axes fraction"),
        xytext=(-3, -4),
        textcoords="offset points",
        rotation=90,
        ha="right",
        va="top",
        fontsize=7.5,
        color=colour,
    )


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
    """The figure with its axes and titles in the words of a coordinate other than pitch."""
    if coordinate != "pitch":
        for axes in figure.axes:
            for label in (axes.xaxis.label, axes.yaxis.label, axes.title):
                label.set_text(label.get_text().replace("pitch", coordinate))
    return figure
