"""What every colour and mark means: one for one thing, in all figures and in the report.

Colours are Okabe and Ito's and some of Tol's: what stands in one figure is told apart with any
colour vision and, but for families of one method, in grey.
"""

from __future__ import annotations

from typing import Any

import numpy as np

INK = "#222222"  # axes, marks of bifurcations, the linear system
FAINT = "#767676"  # what a figure refers to: linear flutter, divergence, zero

EXACT = "#0072B2"  # exact: limit cycles, their onset, motions
DESCRIBING = "#E69F00"  # the describing function
HARMONIC = "#74C2EE"  # harmonic balance
PROVED = "#009E73"  # what is proved
WARNING = "#D55E00"  # a limit and what is beyond it, what is in doubt, what spoils an answer

STATES = {  # how motions end; exact limit cycles are `EXACT` here as everywhere
    "damped": "#DCE6EE",
    "lco": EXACT,
    "aperiodic": "#CC79A7",
    "divergent": "#8C510A",
    "undecided": "#B5B5B5",
    "neutral": "#F0E442",
    "failed": "#111111",
}
STATE_NAMES = {"lco": "limit cycle", "failed": "not computed"}
VERDICTS = {  # of motions that are looked at for chaos, which is one way of being aperiodic
    "periodic": EXACT,
    "quasi-periodic": "#882255",
    "chaotic": STATES["aperiodic"],
    **{name: STATES[name] for name in ("damped", "divergent", "undecided")},
}

SERIES = ("#332288", "#44AA99", "#CC6677", "#999933", "#117733", "#AA4499", "#BBA33C")
"""Things of one kind that only their label tells apart: modes, exponents, entries of a matrix."""

VALUES = "viridis"  # amounts: amplitude, airspeed, the value of a key; dark is little

SHADING = 0.16  # opacity of regions

BIFURCATIONS: dict[str, dict[str, Any]] = {
    "fold": {"marker": "o"},
    "corner": {"marker": "v"},
    "symmetry-breaking": {"marker": "s"},
    "period-doubling": {"marker": "D"},
    "neimark-sacker": {"marker": "*", "markersize": 8.0},
    "grazing": {"marker": "|", "markersize": 8.0, "markeredgewidth": 1.1, "zorder": 2.5},
}
"""Kind: its mark, always `INK`; all but grazing with a white edge."""

LOWEST = {"onset": ("o--", "lowest cycle"), "stable_onset": ("s-", "lowest stable cycle")}


def bifurcation(kind: str) -> dict[str, Any]:
    """How a kind of bifurcation is drawn."""
    edge = {} if kind == "grazing" else {"markeredgecolor": "white", "markeredgewidth": 0.6}
    common = {"color": INK, "linestyle": "none", "markersize": 5.0, "zorder": 3.0}
    return {**common, **edge, **BIFURCATIONS[kind], "label": kind}


def shades(colour: str, count: int) -> list[Any]:
    """Families of one method: its colour, the first dark and the last light."""
    from matplotlib.colors import to_rgb

    if count <= 1:
        return [to_rgb(colour)] * count
    base = np.array(to_rgb(colour))
    dark, light = 0.45 * base, base + 0.55 * (1.0 - base)
    places = np.linspace(0.0, 1.0, count)[:, None]
    mixed = np.where(
        places < 0.5,
        dark + 2.0 * places * (base - dark),
        base + (2.0 * places - 1.0) * (light - base),
    )
    return [tuple(one) for one in mixed]
