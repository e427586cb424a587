"""Time marching: the exact engine, Houbolt's scheme, and Taylor series for cubic springs."""

from aeroflutter.motion.response import Initial, Response, SimulateOptions, simulate
from aeroflutter.motion.spectra import (
    PoincareSection,
    Spectrum,
    poincare_section,
    power_spectrum,
)
from aeroflutter.motion.sweeps import Jump, Sweep, sweep, there_and_back

__all__ = [
    "Initial",
    "Jump",
    "PoincareSection",
    "Response",
    "SimulateOptions",
    "Spectrum",
    "Sweep",
    "poincare_section",
    "power_spectrum",
    "simulate",
    "sweep",
    "there_and_back",
]
