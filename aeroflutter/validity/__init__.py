"""When a describing function can be believed: proofs where they exist, calibration elsewhere."""

from aeroflutter.validity.distortion import doubtful, expected_error
from aeroflutter.validity.fields import guarantee_fields
from aeroflutter.validity.section import cut
from aeroflutter.validity.verdict import Guarantees, guarantees, guarantees_at

__all__ = [
    "Guarantees",
    "cut",
    "doubtful",
    "expected_error",
    "guarantee_fields",
    "guarantees",
    "guarantees_at",
]
