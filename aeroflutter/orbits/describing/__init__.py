"""Describing-function analysis: amplitude curves of limit cycles against airspeed."""

from aeroflutter.orbits.describing.curve import describing_at, describing_curve
from aeroflutter.orbits.describing.fixed import describing_intersections
from aeroflutter.orbits.describing.options import DescribingOptions
from aeroflutter.orbits.describing.result import CycleFamily, DescribingCurve, Onset

__all__ = [
    "CycleFamily",
    "DescribingCurve",
    "DescribingOptions",
    "Onset",
    "describing_at",
    "describing_curve",
    "describing_intersections",
]
