"""Models from elsewhere of 60 and 100 states with two worn hinges: CPU time of four analyses.

The BAH wing (tests/data), held by soft springs in its rigid modes, and two hinges with twist in
every mode, each half of its stiffness with play. Roger's approximation of its air forces, which
touch eight of the ten modes, has 60 states with five lag roots, 100 with ten.

    python -m benchmarks bench_elsewhere
    python -m benchmarks.bench_elsewhere 100 lco     # one analysis, with a profile
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from aeroflutter import load_case
from aeroflutter.linear.rootlocus import RootLocus, root_locus
from aeroflutter.model.lure import AnyFamily
from aeroflutter.motion.response import Initial, simulate
from aeroflutter.orbits.cycles import CycleOptions, limit_cycles
from aeroflutter.orbits.describing import describing_curve
from aeroflutter.springs import Springs
from benchmarks import Measurement

FILE = Path(__file__).parents[1] / "tests" / "data" / "bah_plane_qhh.op4"
CARDS = ([0.001, 0.05, 0.1, 0.2, 0.5, 1.0, 1.2, 1.5], [2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 10.0])
EIGENVALUES = [
    1000.0, 1100.0, 237.7467, 556.3491, 2989.911, 3199.282, 8308.047, 19385.0, 67106.59, 126280.9,
]  # fmt: skip
LAGS = {60: 5, 100: 10}
PART = 0.5  # of the stiffness along a hinge that is in the hinge


def model(states: int) -> tuple[AnyFamily, Springs]:
    """The wing with its two hinges."""
    K = np.array(EIGENVALUES)
    places = np.arange(10.0)
    rows = np.array([np.exp(-np.abs(places - 3.0)), np.exp(-np.abs(places - 6.0))])
    rows[1] *= (-1.0) ** places
    stiffness = [PART / float(row @ (row / K)) / len(rows) for row in rows]
    case = load_case(
        {
            "model": {
                "kind": "modal", "file": str(FILE), "semichord": 2.0, "density": 1.225,
                "k": [k for card in CARDS for _ in range(2) for k in card],
                "mach": [mach for card in CARDS for mach in (0.0, 0.2) for _ in card],
                "at_mach": 0.2, "M": [1.0] * 10, "K": EIGENVALUES, "zeta": 0.01,
                "rows": rows.tolist(), "stiffness": stiffness, "names": ["inner", "outer"],
                "units": ["rad", "rad"], "lags": LAGS[states], "exact": [0.0, 0.1],
                "speed_range": [60.0, 700.0],
            },
            "spring": [
                {"at": "inner", "kind": "freeplay", "gap_deg": 0.5},
                {"at": "outer", "kind": "freeplay", "gap_deg": 1.0},
            ],
        }
    )  # fmt: skip
    family, springs = case.loop()
    assert len(family.state_names) == states
    return family, springs


def motion(family: AnyFamily, springs: Springs, locus: RootLocus) -> str:
    """How a motion ends a little below flutter."""
    assert locus.flutter is not None
    x = np.zeros(len(family.state_names))
    x[3], x[6] = 0.05, 0.02
    found = simulate(family.at(0.9 * locus.flutter.speed), springs, Initial(state=tuple(x)))
    return f"{found.state} of {np.degrees(found.amplitude):.3g} deg"


def branches(family: AnyFamily, springs: Springs) -> str:
    """The families of exact cycles to which describing functions lead, from end to end."""
    options = CycleOptions(speed_ratio_range=(0.5, 1.05), depth=0, simulations=0, points=30)
    found = limit_cycles(family, springs, options)
    sizes = ", ".join(str(len(one.cycles)) for one in found.families)
    return f"families of {sizes} cycles" if sizes else "no family"


def measure() -> Iterator[Measurement]:
    for states in LAGS:
        begun = time.process_time()
        family, springs = model(states)
        yield Measurement(f"{states} states: file, fit", time.process_time() - begun)
        for name, call in analyses(family, springs):
            begun = time.process_time()
            words = call()
            yield Measurement(f"{states}: {name}: {words}", time.process_time() - begun)


def analyses(family: AnyFamily, springs: Springs) -> Iterator[tuple[str, Callable[[], str]]]:
    """The four, by their commands."""
    locus: Any = None

    def roots() -> str:
        nonlocal locus
        locus = root_locus(family)
        return f"flutter at {locus.flutter.speed:.2f} m/s" if locus.flutter else "no flutter"

    def sinusoids() -> str:
        curve = describing_curve(family, springs)
        if curve.onset is None:
            return "no cycle"
        return f"{len(curve.families)} families, onset {curve.onset.speed:.2f} m/s"

    yield "rootlocus", roots
    yield "df", sinusoids
    yield "simulate", lambda: motion(family, springs, locus)
    yield "lco", lambda: branches(family, springs)


def profiled(states: int, which: str) -> None:
    """One analysis, and where its time goes."""
    import cProfile
    import pstats

    for name, call in analyses(*model(states)):
        if name not in ("rootlocus", which):
            continue
        profile = cProfile.Profile()
        print(name, profile.runcall(call))
        if name == which:
            pstats.Stats(profile).sort_stats("cumtime").print_stats(45)
            pstats.Stats(profile).sort_stats("tottime").print_stats(20)


if __name__ == "__main__":
    profiled(int(sys.argv[1]), sys.argv[2])
