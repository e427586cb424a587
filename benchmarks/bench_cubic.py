"""Cubic springs: Taylor series beside SciPy's DOP853, on the same motions in one run.

DOP853 marches a spring that has the same moment and is not known to be cubic.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from aeroflutter import Cubic, SectionFamily, TypicalSection
from aeroflutter.linear.rootlocus import flutter_speed
from aeroflutter.motion.chaos import ChaosOptions, chaos
from aeroflutter.motion.response import Initial, SimulateOptions, simulate
from aeroflutter.springs import Spring
from benchmarks import Measurement, cpu_seconds

RATIOS = np.linspace(0.9, 1.5, 13)
FAMILY = SectionFamily(TypicalSection(omega_bar=0.2))
START = Initial(alpha=np.radians(5.0))


class Law(Cubic):
    """The moment of a cubic spring under another name."""


CUBIC, LAW, WELLS = Cubic(1.0, 3.0), Law(1.0, 3.0), Cubic(-0.03, 50.0)


def measure() -> Iterator[Measurement]:
    """CPU time of an end state by either, and of the exponents of a chaotic motion."""
    reference = flutter_speed(FAMILY)
    assert reference is not None
    systems = [FAMILY.at(ratio * reference) for ratio in RATIOS]

    def decide(spring: Spring) -> None:
        for system in systems:
            simulate(system, spring, START, SimulateOptions(record=False, duration=5000.0))

    decide(CUBIC)
    series, other = cpu_seconds(lambda: decide(CUBIC)), cpu_seconds(lambda: decide(LAW), 1)
    yield Measurement("end state by Taylor series", 1e3 * series / len(systems), "ms")
    yield Measurement("the same by DOP853", 1e3 * other / len(systems), "ms")
    yield Measurement("Taylor series, of DOP853", series / other, "")
    system, options = FAMILY.at(0.55 * reference), ChaosOptions(cycles=4000)
    chaos(system, WELLS, START, options)
    found = cpu_seconds(lambda: chaos(system, WELLS, START, options), 1)
    yield Measurement("exponents over 4000 maxima", found, "s")
