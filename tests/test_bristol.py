"""The example of a measured rig: its file, and its points over the curve."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from aeroflutter.case import load_case
from aeroflutter.cli.overlays import read_points
from aeroflutter.linear.rootlocus import flutter_speed

EXAMPLES = Path(__file__).parents[1] / "examples"


def test_measured_points_in_metres_a_second() -> None:
    """Flutter of the identified model at 17.957 m/s; points where the file has them."""
    case = load_case(EXAMPLES / "bristol.toml")
    assert case.scale is not None
    flutter = flutter_speed(case.family())
    assert case.scale.velocity(flutter) == pytest.approx(17.957, abs=5e-4)
    points = read_points(EXAMPLES / "bristol-measured.csv", flutter, case.scale)
    velocities = case.scale.velocity(points.speed)
    assert velocities == pytest.approx([14.9, 15.6, 16.5, 17.3, 14.9, 15.7, 16.5, 17.2])
    assert np.degrees(points.amplitude)[:2] == pytest.approx([2.72, 3.42])
