"""The pieces of the search for multipliers: its linear programs and its responses."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog

from aeroflutter.guarantees.absence.program import minimum
from aeroflutter.guarantees.absence.search import _response
from aeroflutter.model.lure import LureSystem


@pytest.mark.parametrize("free", [0, 1, 2])
def test_the_dual_gives_the_minimum_the_unknowns_and_the_prices(free: int) -> None:
    """Against the program as it stands: the minimum, where it is, and how it moves."""
    rng = np.random.default_rng(free)
    table, inside = rng.normal(size=(30, 8)), rng.uniform(0.5, 1.0, 8)
    inside[:free] -= 5.0
    bound = table @ inside + rng.uniform(0.1, 1.0, 30)
    cost = -table.T @ rng.uniform(0.0, 1.0, 30)  # bounded below on what the bounds leave
    found = minimum(cost, table, bound, free)
    assert found is not None
    signs = [(None, None)] * free + [(0.0, None)] * (8 - free)
    plain = linprog(cost, table, bound, bounds=signs)
    assert cost @ found.x == pytest.approx(plain.fun, rel=1e-9)
    assert found.x == pytest.approx(plain.x, rel=1e-7, abs=1e-9)  # of a vertex of its own
    assert np.all(found.x[:free] < 0.0)
    assert found.slack == pytest.approx(bound - table @ found.x, abs=1e-12)
    assert found.slack.min() > -1e-7
    assert found.worth == pytest.approx(-plain.ineqlin.marginals, rel=1e-7, abs=1e-9)


def test_a_program_without_an_answer_is_none() -> None:
    assert minimum(np.array([-1.0]), np.array([[-1.0]]), np.array([0.0])) is None


def test_responses_of_a_system_whose_poles_coincide() -> None:
    """Partial fractions have no answer there: 1/(s + 1)² is known."""
    defective = LureSystem([[-1.0, 1.0], [0.0, -1.0]], [0.0, 1.0], [1.0, 0.0])
    parted = LureSystem([[-1.0, 1.0], [0.0, -2.0]], [0.0, 1.0], [1.0, 0.0])
    omega = np.geomspace(1e-3, 1e3, 50)
    s = 1j * omega
    assert _response(defective, 0.0, omega) == pytest.approx((s + 1.0) ** -2, rel=1e-12)
    assert _response(parted, 0.0, omega) == pytest.approx(1.0 / ((s + 1.0) * (s + 2.0)), rel=1e-12)
    closed = 1.0 / ((s + 1.0) ** 2 + 3.0)  # with a slope of three
    assert _response(defective, 3.0, omega) == pytest.approx(closed, rel=1e-12)
