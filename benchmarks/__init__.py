"""Speed, measured: `python -m benchmarks [NAME ...]`, or `make bench` for all of them.

A benchmark is a module of this package with a function `measure()` that yields Measurements. They
are no tests: they print what they find beside what is aimed at, on the machine they run on.
"""

from __future__ import annotations

import shutil
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import NamedTuple


class Measurement(NamedTuple):
    """One number, with the largest value that is aimed at."""

    what: str
    value: float
    unit: str = "s"
    target: float | None = None


BASELINE = Path(__file__).parent / "houbolt_map.f90"
FLAGS = ["-O3", "-march=native", "-ffast-math"]


def fortran_baseline(folder: Path) -> Path | None:
    """The thesis's method, compiled into a folder; None without a Fortran compiler."""
    compiler = shutil.which("gfortran")
    if compiler is None:
        return None
    program = folder / "houbolt_map"
    subprocess.run([compiler, *FLAGS, "-o", program, BASELINE], check=True, cwd=folder)
    return program


def wall_seconds(call: Callable[[], object], repeats: int = 5) -> float:
    """Median elapsed time of a call."""
    return median(_timed(call, time.perf_counter) for _ in range(repeats))


def cpu_seconds(call: Callable[[], object], repeats: int = 5) -> float:
    """Median CPU time of a call, over all threads of this process."""
    return median(_timed(call, time.process_time) for _ in range(repeats))


def _timed(call: Callable[[], object], clock: Callable[[], float]) -> float:
    start = clock()
    call()
    return clock() - start
