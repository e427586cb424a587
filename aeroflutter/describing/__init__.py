"""Describing-function analysis: amplitude curves of limit cycles against airspeed."""

from aeroflutter.describing.curve import describing_at, describing_curve
from aeroflutter.describing.fixed import describing_intersections
from aeroflutter.describing.options import DescribingOptions
from aeroflutter.describing.result import CycleFamily, DescribingCurve, Onset

__all__ = [
    "CycleFamily",
    "DescribingCurve",
    "DescribingOptions",
    "Onset",
    "describing_at",
    "describing_curve",
    "describing_intersections",
]
