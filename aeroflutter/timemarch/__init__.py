"""Time marching: the exact engine, Houbolt's scheme, and Taylor series for cubic springs."""

from aeroflutter.timemarch.response import Initial, Response, SimulateOptions, simulate
from aeroflutter.timemarch.spectra import (
    PoincareSection,
    Spectrum,
    poincare_section,
    power_spectrum,
)
from aeroflutter.timemarch.sweeps import Jump, Sweep, sweep, there_and_back

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
