"""The spring's path under a prescribed motion and its describing function."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np

from aeroflutter.plots import layout, meaning
from aeroflutter.plots import style as look
from aeroflutter.results.unit import told

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from aeroflutter.springs import Describing


def plot_spring(
    pitch: np.ndarray,
    moment: np.ndarray,
    amplitude: np.ndarray,
    describing: Describing,
    title: str = "",
) -> Figure:
    """Moment against pitch (thesis figures 3.2, 3.4, 4.8, 4.9) and N(A) (figure 4.12)."""
    with look.style():
        figure, (path, gain) = layout.figure(1, 2, width=8.6, height=4.0)
        _path(path, pitch, moment)
        path.set_title("path")
        _gains(gain, amplitude, describing)
        gain.set_title("describing function")
        layout.finish(figure, title)
    return figure


def plot_path(pitch: np.ndarray, moment: np.ndarray, title: str = "") -> Figure:
    """Moment against pitch alone, arrows along the way."""
    with look.style():
        figure, axes = layout.figure(width=4.8, height=4.0)
        _path(axes, pitch, moment)
        layout.finish(figure, title)
    return figure


def plot_gains(amplitude: np.ndarray, describing: Describing, title: str = "") -> Figure:
    """Describing function against amplitude alone."""
    with look.style():
        figure, axes = layout.figure(width=5.2, height=4.0)
        _gains(axes, amplitude, describing)
        layout.finish(figure, title)
    return figure


def _path(axes: Axes, pitch: np.ndarray, moment: np.ndarray) -> None:
    x, y = told(pitch), told(moment)
    axes.plot(x, y, color=meaning.INK)
    turns = 1 + np.flatnonzero(np.diff(np.sign(np.diff(x))))
    for start, end in itertools.pairwise([0, *turns, x.size - 1]):
        middle = (start + end) // 2
        axes.annotate(
            "",
            (x[middle + 1], y[middle + 1]),
            (x[middle], y[middle]),
            arrowprops={"arrowstyle": "-|>", "color": meaning.INK},
        )
    axes.set_xlabel(look.PITCH)
    axes.set_ylabel(look.MOMENT)


def _gains(axes: Axes, amplitude: np.ndarray, describing: Describing) -> None:
    axes.plot(told(amplitude), describing.n_p, color=meaning.DESCRIBING, label="$n_p$, stiffness")
    axes.plot(
        told(amplitude), describing.n_q, "--", color=meaning.DESCRIBING,
        label="$n_q$, damping",
    )  # fmt: skip
    layout.logarithmic(axes.xaxis)
    axes.set_xlabel(look.AMPLITUDE)
    axes.set_ylabel("describing function $n_p$, $n_q$")
