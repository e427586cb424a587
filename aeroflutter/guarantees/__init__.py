"""When a describing function can be believed: proofs where they exist, calibration elsewhere."""

from aeroflutter.guarantees.distortion import doubtful, expected_error
from aeroflutter.guarantees.fields import guarantee_fields
from aeroflutter.guarantees.section import cut
from aeroflutter.guarantees.verdict import Guarantees, guarantees, guarantees_at

__all__ = [
    "Guarantees",
    "cut",
    "doubtful",
    "expected_error",
    "guarantee_fields",
    "guarantees",
    "guarantees_at",
]
