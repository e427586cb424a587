"""What is proved free of oscillation: cost of the search and of its checker, how near it comes.

The bound over the lowest exact cycle is given for runs whose cycle docs/errata.md names.
"""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np

from aeroflutter import load_case
from aeroflutter.guarantees.absence import absence
from aeroflutter.guarantees.absence.checker import check
from aeroflutter.guarantees.chart import friction_chart
from aeroflutter.linear.rootlocus import flutter_speed

LOWEST = {
    "run6": 0.81506,
    "run10": 0.84892,
    "run14": 0.92151,
    "run15": 0.95304,
    "run16": 0.80818,
    "run100": 0.13099,
    "run101": 0.22835,
    "run102": 0.31854,
    "run103": 0.58063,
    "run111": 0.92359,
}


def measure() -> Iterator[tuple[str, float, str, float | None]]:
    yield from bounds()
    case = load_case("run14")
    family = case.family()
    speeds = np.linspace(0.8, 0.98, 50) * (flutter_speed(family) or 1.0)
    start = time.process_time()
    chart = friction_chart(family, case.spring, speeds)
    spent = time.process_time() - start
    above = chart.proved_ratios / chart.exact_ratios - 1.0
    yield "run14: chart of 50 speeds", spent, "s of CPU", 60.0
    yield "run14: median of proved over exact, less one", float(np.nanmedian(above)), "", None


def bounds() -> Iterator[tuple[str, float, str, float | None]]:
    """What is proved of the thesis's runs."""
    for run, lowest in LOWEST.items():
        case = load_case(run)
        family = case.family()
        start = time.process_time()
        free = absence(family, case.spring)
        found = time.process_time()
        assert free.certificate is not None
        check(free.certificate)
        ratio = free.high / (flutter_speed(family) or 1.0)
        aim = 60.0 if run == "run14" else None
        yield f"{run}: proved free up to", ratio, "U*/U*_L", None
        yield f"{run}: that over the lowest cycle", ratio / lowest, "", None
        yield f"{run}: search and proof", found - start, "s of CPU", aim
        yield f"{run}: checker alone", time.process_time() - found, "s of CPU", None
