"""When a describing function can be believed: proofs where they exist, calibration elsewhere."""

import warnings
from importlib import import_module
from typing import Any

from aeroflutter.guarantees.distortion import doubtful, expected_error
from aeroflutter.guarantees.section import cut
from aeroflutter.guarantees.verdict import Guarantees, guarantees, guarantees_at

__all__ = [
    "Guarantees",
    "cut",
    "doubtful",
    "expected_error",
    "guarantees",
    "guarantees_at",
]


def __getattr__(name: str) -> Any:
    """A name of 0.1.0: plain values are made of results, not here."""
    if name != "guarantee_fields":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    warnings.warn(f"{name} is in aeroflutter.results.cycles now", DeprecationWarning, stacklevel=2)
    return getattr(import_module("aeroflutter.results.cycles"), name)
