"""Chaos: Lyapunov exponents from the variational flow, peaks against speed, verdicts."""

from aeroflutter.chaos.exponents import Exponents
from aeroflutter.chaos.options import ChaosOptions
from aeroflutter.chaos.scan import Band, ChaosScan, Edge, band_edge, chaos_scan
from aeroflutter.chaos.verdict import ChaosResult, chaos

__all__ = [
    "Band",
    "ChaosOptions",
    "ChaosResult",
    "ChaosScan",
    "Edge",
    "Exponents",
    "band_edge",
    "chaos",
    "chaos_scan",
]
