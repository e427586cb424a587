"""Limit cycles of run 14 exactly, beside what the thesis's method in Fortran takes for them.

The branch is one warm call: search, 200 cycles with multipliers, the fold located, simulations for
isolated families included. The Fortran baseline marches the stable part of the same curve, at as
many speeds, for the 50 000 steps of the thesis.
"""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from aeroflutter import Hysteresis, SectionFamily, TypicalSection
from aeroflutter.orbits.cycles import LimitCycles, limit_cycles
from aeroflutter.orbits.cycles.measure import cycle_at
from aeroflutter.orbits.cycles.search import Search, describing_points
from aeroflutter.orbits.cycles.seeds import converged, sinusoid
from benchmarks import Measurement, cpu_seconds, fortran_baseline

OMEGA_BAR, DELTA_V, DELTA_H = 0.8, 1.0, 0.2
FAMILY = SectionFamily(TypicalSection(omega_bar=OMEGA_BAR))
SPRING = Hysteresis(np.radians(DELTA_V), np.radians(DELTA_H))
DT, STEPS, PITCH = 0.1, 50_000, 6.0


def measure() -> Iterator[Measurement]:
    """CPU seconds of the branch and of one cycle, and of the Fortran's stable part."""
    branch = limit_cycles(FAMILY, SPRING)  # compiles
    yield Measurement("cycles on the branch", len(branch.cycles), "", None)
    taken = cpu_seconds(lambda: limit_cycles(FAMILY, SPRING))
    yield Measurement("the whole branch", taken, "s", 1.0)
    yield Measurement("one cycle from a DF seed", 1e3 * cpu_seconds(_one(), 21), "ms", 5.0)
    seconds, count = _fortran(branch)
    if count:
        yield Measurement(f"Fortran, {count} speeds of the stable part", seconds)
        yield Measurement("the whole branch, of that", taken / seconds, "")


def _one() -> Callable[[], None]:
    """Newton's method from a sinusoid to a cycle with its multipliers, tables built anew."""
    search = Search(FAMILY, SPRING)
    points = describing_points(search.frame, search.options)
    amplitude, bias, speed, k = points[len(points) // 2]

    def run() -> None:
        search.frame.loop.at.cache_clear()
        z = sinusoid(search.frame.loop, amplitude, bias, speed, k)
        shooting, q = converged(search.frame, z, 2 * np.pi / k, speed, True)
        cycle_at(search.frame, shooting, q)

    run()
    return run


def _fortran(branch: LimitCycles) -> tuple[float, int]:
    """CPU seconds and number of speeds; zeros without a compiler."""
    assert branch.flutter_speed is not None
    assert branch.stable_onset is not None
    stable = [cycle for cycle in branch.cycles if cycle.stable]
    low = branch.stable_onset.cycle.speed_ratio
    high = max(cycle.speed_ratio for cycle in stable)
    grid = (len(stable), 1, low, high, PITCH, PITCH, DT, STEPS)
    words = [OMEGA_BAR, branch.flutter_speed, DELTA_V, DELTA_H, *grid]
    with tempfile.TemporaryDirectory() as folder:
        program = fortran_baseline(Path(folder))
        if program is None:
            print("  gfortran is not installed: no baseline to compare with")
            return 0.0, 0
        found = subprocess.run(
            [program, *map(str, words)], check=True, capture_output=True, text=True
        ).stdout.split()
    return float(found[found.index("seconds") + 1]), len(stable)
