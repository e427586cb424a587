"""
Chaos between limit cycles
==========================

Freeplay of half a degree at the frequency ratio 0.2: one chaotic motion from six sides, then peaks
of pitch and Lyapunov exponents against airspeed. The band of chaos is that of Price, Alighanbari &
Lee (1995).
"""

import numpy as np

from aeroflutter import load_case
from aeroflutter.linear.rootlocus import flutter_speed
from aeroflutter.motion.chaos import ChaosOptions, chaos, chaos_scan
from aeroflutter.motion.response import Initial
from aeroflutter.plots.chaos import plot_chaos, plot_chaos_scan

case = load_case("freeplay-02")
family, start = case.family(), Initial(alpha=case.initial.alpha)
reference = flutter_speed(family)

# %%
# One motion, with its three largest exponents.

system = family.at(0.3 * reference)
found = chaos(system, case.spring, start)
print(f"{found.name}: {found.reason}")
portrait = plot_chaos(found, found.trace(system, case.spring), "freeplay at 0.3")

# %%
# Against airspeed. Each motion starts from 7 degrees.

scan = chaos_scan(
    lambda ratio: family.at(ratio * reference),
    np.linspace(0.12, 0.40, 141),
    case.spring,
    start,
    ChaosOptions(cycles=2000),
)
diagram = plot_chaos_scan(scan, title="freeplay of 0.5 deg, frequency ratio 0.2")
