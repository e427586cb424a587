"""Exact limit cycles: identities, other methods, published numbers."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from aeroflutter.case import load_case
from aeroflutter.cycles import (
    CycleOptions,
    LimitCycles,
    limit_cycles,
)

CHUNG = 6.2851  # U*_L as Chung, He & Lee 2009 round it; their speeds are multiples of it


@cache
def branch(run: str, **keywords: object) -> LimitCycles:
    """The branch of a built-in case, computed once."""
    case = load_case(run)
    return limit_cycles(case.family(), case.spring, CycleOptions(**keywords))  # type: ignore[arg-type]


def speeds(result: LimitCycles, kind: str, family: int = 1) -> list[float]:
    """U* of the bifurcations of one kind on one family, ascending."""
    return sorted(
        event.cycle.speed
        for event in result.bifurcations
        if event.kind == kind and event.cycle.family == family
    )


def test_chung_he_and_lee_2009_fold_then_symmetry_breaking() -> None:
    """Eight digits are printed: the fold of the symmetric cycle, its symmetry broken just above."""
    result = branch("run103")
    fold = min(speeds(result, "fold"))
    broken = min(speeds(result, "symmetry-breaking"))
    assert abs(fold / CHUNG - 0.67892265) < 0.5e-8
    assert abs(broken / CHUNG - 0.67892272) < 0.5e-8
    assert fold < broken


@pytest.mark.parametrize("run", ["run14", "run103"])
def test_every_cycle_closes_and_has_the_trivial_multiplier(run: str) -> None:
    cycles = branch(run).cycles
    assert len(cycles) > 200
    assert max(cycle.closure for cycle in cycles) < 1e-10
    for cycle in cycles:
        ones = np.sort(np.abs(cycle.multipliers - 1.0))[: 2 if cycle.continuum else 1]
        assert np.all(ones < 1e-8)
