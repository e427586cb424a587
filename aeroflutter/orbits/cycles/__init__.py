"""Exact limit cycles of piecewise-linear springs, stable or not, by shooting and continuation."""

from aeroflutter.orbits.cycles.at import CyclesAt, cycles_at
from aeroflutter.orbits.cycles.near import cycle_near
from aeroflutter.orbits.cycles.options import CycleOptions
from aeroflutter.orbits.cycles.result import (
    Bifurcation,
    Cycle,
    CycleFamily,
    CycleOnset,
    LimitCycles,
)
from aeroflutter.orbits.cycles.search import limit_cycles
from aeroflutter.orbits.cycles.tolerance import Tolerance, least_friction, tolerance

__all__ = [
    "Bifurcation",
    "Cycle",
    "CycleFamily",
    "CycleOnset",
    "CycleOptions",
    "CyclesAt",
    "LimitCycles",
    "Tolerance",
    "cycle_near",
    "cycles_at",
    "least_friction",
    "limit_cycles",
    "tolerance",
]
