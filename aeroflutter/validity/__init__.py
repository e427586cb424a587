"""When a describing function can be believed: proofs where they exist, calibration elsewhere."""

from aeroflutter.validity.distortion import DOUBTFUL, expected_error
from aeroflutter.validity.fields import guarantee_fields
from aeroflutter.validity.verdict import Guarantees, guarantees, guarantees_at

__all__ = [
    "DOUBTFUL",
    "Guarantees",
    "expected_error",
    "guarantee_fields",
    "guarantees",
    "guarantees_at",
]
