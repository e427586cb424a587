"""Time from the prompt to the answer: whole processes, and the curve of run 14 once imported."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator

from aeroflutter import load_case
from aeroflutter.orbits.describing import DescribingOptions, describing_curve
from benchmarks import Measurement, wall_seconds


def _command(*words: str) -> float:
    line = [sys.executable, "-m", "aeroflutter", *words]
    return wall_seconds(lambda: subprocess.run(line, check=True, stdout=subprocess.DEVNULL))


def measure() -> Iterator[Measurement]:
    """Whole processes start from scratch every time; the curve is computed in this one."""
    yield Measurement("aeroflutter --help", _command("--help"), target=0.3)
    yield Measurement("aeroflutter validate run14", _command("validate", "run14"))
    yield Measurement(
        "aeroflutter rootlocus run14 --json", _command("rootlocus", "run14", "--json"), target=1.5
    )
    yield Measurement("aeroflutter df run14 --json", _command("df", "run14", "--json"))
    case = load_case("run14")
    family, options = case.family(), DescribingOptions(points=200)
    describing_curve(family, case.spring, options)  # imports what it needs
    yield Measurement(
        "describing_curve of run 14, 200 points",
        wall_seconds(lambda: describing_curve(family, case.spring, options)),
        target=0.3,
    )
