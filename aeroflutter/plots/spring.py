"""The spring's path under a prescribed motion and its describing function."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from aeroflutter.plots import style as look

if TYPE_CHECKING:
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
        figure, (path, gain) = look.figure(1, 2, width=8.6, height=3.8)
        path.plot(np.degrees(pitch), np.degrees(moment), color=look.BLUE)
        path.set_xlabel(look.PITCH)
        path.set_ylabel(look.MOMENT)
        path.set_title("path")
        gain.plot(np.degrees(amplitude), describing.n_p, color=look.BLUE, label="$n_p$")
        gain.plot(np.degrees(amplitude), describing.n_q, color=look.VERMILION, label="$n_q$")
        gain.set_xscale("log")
        gain.set_xlabel(look.AMPLITUDE)
        gain.set_ylabel("describing function")
        gain.set_title("describing function")
        gain.legend()
        if title:
            look.headline(figure, title)
    return figure
