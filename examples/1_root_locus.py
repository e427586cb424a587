"""
Linear flutter
==============

Roots of the section against airspeed; the one that crosses the imaginary axis flutters.
"""

from aeroflutter import SectionFamily, TypicalSection
from aeroflutter.linear.rootlocus import root_locus
from aeroflutter.plots.rootlocus import plot_root_locus

found = root_locus(SectionFamily(TypicalSection(omega_bar=0.8)))
print(f"flutter at U* = {found.flutter.speed:.6f}, k = {found.flutter.k:.6f}")
figure = plot_root_locus(found, "flutter of the thesis's section")
