"""Continuation on curves that are known in closed form."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from aeroflutter.errors import ConvergenceError, InputError
from aeroflutter.orbits.continuation import (
    ContinuationOptions,
    Walk,
    branch_direction,
    branch_test,
    correct,
    tangent_at,
    trace,
)

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Curve:
    """A problem from two functions."""

    f: Callable[[Array], list[float]]
    df: Callable[[Array], list[list[float]]]

    def residual(self, x: Array) -> Array:
        return np.array(self.f(x))

    def jacobian(self, x: Array) -> Array:
        return np.array(self.df(x))


circle = Curve(lambda x: [x[0] ** 2 + x[1] ** 2 - 1], lambda x: [[2 * x[0], 2 * x[1]]])
pitchfork = Curve(lambda x: [x[0] * (x[1] - x[0] ** 2)], lambda x: [[x[1] - 3 * x[0] ** 2, x[0]]])
exponential = Curve(
    lambda x: [x[1] - x[0] * np.exp(-x[0])], lambda x: [[(x[0] - 1) * np.exp(-x[0]), 1.0]]
)
# The folds of λ + μ x - x³ = 0 in (x, λ, μ): a curve with a cusp in the plane of λ and μ.
cusp = Curve(
    lambda x: [x[1] + x[2] * x[0] - x[0] ** 3, x[2] - 3 * x[0] ** 2],
    lambda x: [[x[2] - 3 * x[0] ** 2, 1.0, x[0]], [-6 * x[0], 0.0, 1.0]],
)


def test_circle_closes_and_its_four_folds_are_located() -> None:
    options = ContinuationOptions(max_step=0.3, folds={"x": 0, "y": 1})
    branch = trace(circle, [0.6, 0.8], options)
    assert branch.closed
    assert branch.stops[1] == "the curve closed"
    assert np.linalg.norm(branch.x[0] - branch.x[-1]) < 1e-12
    assert np.max(np.abs(np.hypot(*branch.x.T) - 1)) < 1e-14
    places = {(event.name, *np.round(event.x, 9)) for event in branch.events}
    assert places == {("x", 1, 0), ("x", -1, 0), ("y", 0, 1), ("y", 0, -1)}
    for event in branch.events:
        assert np.min(np.abs(event.x)) < 1e-12
        assert not event.jump


def test_a_fold_known_in_closed_form() -> None:
    """λ = x exp(-x) has its maximum 1/e at x = 1."""
    options = ContinuationOptions(low=[-0.5, -2.0], high=[3.0, 2.0], folds={"fold": 1})
    branch = trace(exponential, [0.2, 0.2 * np.exp(-0.2)], options)
    (fold,) = branch.events
    assert abs(fold.x[0] - 1) < 1e-12
    assert abs(fold.x[1] - np.exp(-1)) < 1e-15
    assert {branch.x[0, 0], branch.x[-1, 0]} == {-0.5, 3.0}
    assert all(stop.startswith("unknown 0 reached its limit") for stop in branch.stops)
    assert np.all(np.diff([state.arclength for state in branch.states]) > 0)


def test_cusp_is_the_fold_of_the_folds() -> None:
    options = ContinuationOptions(low=-2.0, high=2.0, folds={"cusp": 2})
    branch = trace(cusp, [0.5, -0.25, 0.75], options)
    (event,) = branch.events
    assert np.max(np.abs(event.x)) < 1e-12
    x, lam, mu = branch.x.T
    assert np.max(np.abs(lam + 2 * x**3)) < 1e-13
    assert np.max(np.abs(mu - 3 * x**2)) < 1e-13


def test_branch_point_of_the_pitchfork_and_the_switch_to_the_other_branch() -> None:
    options = ContinuationOptions(low=[-2.0, -1.0], high=[2.0, 1.0])
    trivial = trace(pitchfork, [0.0, -0.7], options, {"branch point": branch_test(pitchfork)})
    (event,) = trivial.events
    assert np.max(np.abs(event.x)) < 1e-12
    across = branch_direction(pitchfork, event.x, event.tangent)
    assert np.abs(np.abs(across) - [1, 0]).max() < 1e-10
    other = list(Walk(pitchfork, event.x + 0.05 * across, across, options))
    x, lam = np.array([state.x for state in other]).T
    assert np.max(np.abs(lam - x**2)) < 1e-12
    assert abs(lam[-1] - 1) < 1e-14


def test_a_corner_is_followed_and_located() -> None:
    """y = |x - 0.3|/2 turns by 53 degrees: the fold in y is a jump of the tangent."""
    corner = Curve(
        lambda x: [x[1] - abs(x[0] - 0.3) / 2],
        lambda x: [[-0.5 if x[0] > 0.3 else 0.5, 1.0]],
    )
    options = ContinuationOptions(low=-1.0, high=1.0, folds={"fold": 1})
    branch = trace(corner, [-0.5, 0.4], options)
    assert branch.x[-1, 0] * branch.x[0, 0] < 0
    assert sum(state.corner for state in branch.states) == 1
    (event,) = branch.events
    assert event.jump
    assert np.max(np.abs(event.x - [0.3, 0])) < 1e-12


def test_a_corner_whose_place_is_known_costs_no_small_steps() -> None:
    """The same corner with its kink named: few states, one of them exactly on it."""
    corner = Curve(
        lambda x: [x[1] - abs(x[0] - 0.3) / 2],
        lambda x: [[-0.5 if x[0] > 0.3 else 0.5, 1.0]],
    )
    options = ContinuationOptions(low=-1.0, high=1.0)
    kinks = {"corner": lambda x, tangent: float(x[0] - 0.3)}
    branch = trace(corner, [-0.5, 0.4], options, None, kinks)
    (event,) = branch.events
    assert event.name == "corner"
    assert np.max(np.abs(event.x - [0.3, 0])) < 1e-15
    assert len(branch.states) < 25
    assert sum(state.corner for state in branch.states) == 1


@pytest.mark.parametrize("slope", [0.5, 3.0, 40.0])
def test_a_known_corner_may_be_as_sharp_as_it_likes(slope: float) -> None:
    """Beyond a right angle (slope 1) the hyperplane of a step misses the other side."""
    corner = Curve(
        lambda x: [x[1] - slope * abs(x[0] - 0.3)],
        lambda x: [[-slope if x[0] > 0.3 else slope, 1.0]],
    )
    options = ContinuationOptions(low=[-1, -9], high=[1, 60], folds={"fold": 1})
    kinks = {"corner": lambda x, tangent: float(x[0] - 0.3)}
    branch = trace(corner, [-0.5, 0.8 * slope], options, None, kinks)
    assert {branch.x[0, 0], branch.x[-1, 0]} == {-1.0, 1.0}
    places = {event.name: event.x for event in branch.events}
    assert np.max(np.abs(places["corner"] - [0.3, 0])) < 1e-12
    assert np.max(np.abs(places["fold"] - [0.3, 0])) < 1e-9


def test_scaling_of_the_unknowns_changes_nothing_but_the_units() -> None:
    def run(size: float) -> Array:
        ellipse = Curve(
            lambda x: [(x[0] / size) ** 2 + x[1] ** 2 - 1],
            lambda x: [[2 * x[0] / size**2, 2 * x[1]]],
        )
        options = ContinuationOptions(scale=[size, 1.0], folds={"x": 0})
        branch = trace(ellipse, [size, 0.0], options)
        assert branch.closed
        return branch.x / [size, 1.0]

    plain, scaled = run(1.0), run(1e-6)
    assert plain.shape == scaled.shape
    assert np.max(np.abs(plain - scaled)) < 1e-12


def test_the_predictor_is_of_second_order() -> None:
    """The distance of the tangent prediction from the circle falls with the step squared."""
    x = np.array([1.0, 0.0])
    tangent = tangent_at(circle, x)
    steps = np.array([0.2, 0.1, 0.05, 0.025])
    misses = [
        np.linalg.norm(correct(circle, x + h * tangent, tangent)[0] - x - h * tangent)
        for h in steps
    ]
    order = np.polyfit(np.log(steps), np.log(misses), 1)[0]
    assert abs(order - 2) < 0.02


def test_newton_converges_quadratically_onto_the_curve() -> None:
    """Gauss-Newton from distance d leaves an error of d²/2 on the unit circle."""
    distances = np.array([1e-1, 1e-2, 1e-3])
    loose = ContinuationOptions(tolerance=0.2, max_newton=1)
    errors = [abs(np.linalg.norm(correct(circle, [1 + d, 0], None, loose)[0]) - 1)
              for d in distances]  # fmt: skip
    assert np.polyfit(np.log(distances), np.log(errors), 1)[0] == pytest.approx(2, abs=0.05)


def test_where_a_curve_ends_it_says_so() -> None:
    """√x - y is not defined left of the origin, where the curve stops."""

    def slope(x: Array) -> list[list[float]]:
        return [[0.5 / np.sqrt(x[0]) if x[0] > 0 else np.nan, -1.0]]

    half = Curve(lambda x: [np.sqrt(x[0]) - x[1] if x[0] >= 0 else np.nan], slope)
    branch = trace(half, [0.25, 0.5], ContinuationOptions(low=-1.0, high=1.0))
    ends = sorted(branch.stops)
    assert "min_step" in ends[0]
    assert "limit 1" in ends[1]
    assert np.min(branch.x[:, 1]) < 1e-3


def test_max_states_is_a_reason() -> None:
    walk = Walk(circle, [1.0, 0.0], None, ContinuationOptions(max_states=5))
    assert len(list(walk)) == 5
    assert walk.stop == "max_states = 5 reached"
    assert not walk.closed


def test_a_start_off_the_curve_is_an_error() -> None:
    nothing = Curve(lambda x: [x[0] ** 2 + x[1] ** 2 + 1], lambda x: [[2 * x[0], 2 * x[1]]])
    with pytest.raises(ConvergenceError, match="did not converge near x = ") as error:
        trace(nothing, [1.0, 1.0])
    assert error.value.reason == "Newton's method did not converge"  # for those who name the place
    copy = pickle.loads(pickle.dumps(error.value))  # workers send their errors
    assert (str(copy), copy.reason) == (str(error.value), error.value.reason)


def test_every_bad_option_is_named() -> None:
    with pytest.raises(InputError) as error:
        ContinuationOptions(step=-1.0, tolerance=0.0, scale=[1.0, -1.0], low=1.0, high=0.0)
    lines = str(error.value).splitlines()
    assert [line.split(":")[0] for line in lines] == ["step", "tolerance", "scale", "low, high"]
    with pytest.raises(InputError, match="min_step, max_step"):
        ContinuationOptions(step=1.0, max_step=0.5)


def test_a_near_miss_of_the_start_does_not_close_the_curve() -> None:
    """A helix of pitch 2π ε comes back to within it of its start, turn after turn."""
    slow = 1e-5
    helix = Curve(
        lambda x: [x[0] - np.cos(x[2] / slow), x[1] - np.sin(x[2] / slow)],
        lambda x: [[1.0, 0.0, np.sin(x[2] / slow) / slow], [0.0, 1.0, -np.cos(x[2] / slow) / slow]],
    )
    walk = Walk(helix, [1.0, 0.0, 0.0], [0.0, 1.0, slow], ContinuationOptions(max_states=300))
    x = np.array([state.x for state in walk])
    turns = x[:, 2] / (2 * np.pi * slow)
    assert not walk.closed
    assert turns[-1] > 2
    assert 1e-5 < 2 * np.pi * slow < 1e-4  # what it misses by
