"""Limits that are met are said, and nothing computed before them is lost."""

from __future__ import annotations

import numpy as np
import pytest

from aeroflutter.case import load_case
from aeroflutter.errors import InputError
from aeroflutter.linear.rootlocus import flutter_speed
from aeroflutter.model.lure import SampledFamily
from aeroflutter.orbits.harmonic import HarmonicOptions, harmonic_balance


def test_a_branch_that_leaves_the_samples_keeps_what_it_has() -> None:
    case = load_case("run14")
    family, flutter = case.family(), flutter_speed(case.family())
    speeds = np.linspace(0.85, 0.95, 6) * flutter
    sampled = SampledFamily(speeds, [family.at(speed) for speed in speeds])
    options = HarmonicOptions(harmonics=3, speed_ratio_range=(0.5, 2.0))
    branch = harmonic_balance(sampled, case.spring, options)
    reached = [cycle.speed for cycle in branch.cycles]
    # the start, corrected at its own amplitude, may come to lie a hair beyond
    assert reached[0] == pytest.approx(speeds[-1], rel=1e-5)
    assert reached[-1] == pytest.approx(speeds[-1], rel=1e-5)
    assert len(reached) > 10
    assert min(reached) < 0.93 * flutter


@pytest.mark.parametrize("name", ["harmonics", "max_harmonics"])
def test_more_harmonics_than_any_memory_holds_are_refused(name: str) -> None:
    with pytest.raises(InputError, match=rf"^{name}: 1e\+09 harmonics are more than"):
        HarmonicOptions(**{name: 1_000_000_000})
