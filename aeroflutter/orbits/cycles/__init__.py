"""Exact limit cycles of piecewise-linear springs, stable or not, by shooting and continuation."""

from aeroflutter import _former
from aeroflutter.orbits.cycles.at import CyclesAt, cycles_at
from aeroflutter.orbits.cycles.near import cycle_near, family_near
from aeroflutter.orbits.cycles.options import CycleOptions
from aeroflutter.orbits.cycles.result import (
    Bifurcation,
    Cycle,
    CycleFamily,
    CycleOnset,
    LimitCycles,
)
from aeroflutter.orbits.cycles.search import limit_cycles

__all__ = [
    "Bifurcation",
    "Cycle",
    "CycleFamily",
    "CycleOnset",
    "CycleOptions",
    "CyclesAt",
    "LimitCycles",
    "cycle_near",
    "cycles_at",
    "family_near",
    "limit_cycles",
]

__getattr__ = _former.attribute(
    __name__,
    dict.fromkeys(("Tolerance", "least_friction", "tolerance"), "aeroflutter.studies.tolerance"),
)
