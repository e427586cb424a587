"""The bracketed root-finder against closed forms and SciPy's."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from aeroflutter.bracket import bracketed_root


@given(root=st.floats(-50, 50), power=st.sampled_from([1, 3, 5]), width=st.floats(0.1, 100))
def test_odd_powers(root, power, width):
    """x^5 is flat at its root: only bisection gets there."""
    found = bracketed_root(lambda x: (x - root) ** power, root - width, root + 0.7 * width)
    assert found == pytest.approx(root, rel=1e-15, abs=1e-50)


@given(offset=st.floats(0.05, 0.95))
def test_agrees_with_brentq(offset):
    def function(x):
        return math.tanh(20 * (x - offset)) + 0.1 * (x - offset)

    assert bracketed_root(function, 0.0, 1.0) == pytest.approx(
        brentq(function, 0.0, 1.0, xtol=1e-15), abs=1e-14
    )


def test_few_evaluations_on_a_smooth_function():
    calls = []

    def function(x):
        calls.append(x)
        return math.cos(x) - x

    assert bracketed_root(function, 0.0, 1.0) == pytest.approx(0.7390851332151607, abs=2e-16)
    assert len(calls) < 15


def test_an_end_may_be_the_root():
    assert bracketed_root(lambda x: x, 0.0, 1.0) == 0.0
    assert bracketed_root(lambda x: x - 1, 0.0, 1.0) == 1.0


def test_equal_signs_are_refused():
    with pytest.raises(ValueError, match="signs"):
        bracketed_root(lambda x: x * x + 1, -1.0, 1.0)
