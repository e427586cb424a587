"""Chaos: Lyapunov exponents from the variational flow, peaks against speed, verdicts."""

from aeroflutter.motion.chaos.options import ChaosOptions
from aeroflutter.motion.chaos.scan import Band, ChaosScan, Edge, band_edge, chaos_scan
from aeroflutter.motion.chaos.verdict import ChaosResult, chaos
from aeroflutter.motion.exponents import Exponents

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
