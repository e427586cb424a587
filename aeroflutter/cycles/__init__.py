"""Exact limit cycles of piecewise-linear springs, stable or not, by shooting and continuation."""

from aeroflutter.cycles.at import CyclesAt, cycles_at
from aeroflutter.cycles.near import cycle_near
from aeroflutter.cycles.options import CycleOptions
from aeroflutter.cycles.result import Bifurcation, Cycle, CycleFamily, CycleOnset, LimitCycles
from aeroflutter.cycles.search import limit_cycles
from aeroflutter.cycles.tolerance import Tolerance, least_friction, tolerance

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
