"""Describing functions of polynomials, relays, play and friction against the laws themselves."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.integrate import quad

from aeroflutter.generated import describing, switched

NAMES = ("F0", "n_p", "n_q")
AMPLITUDE = st.floats(0.05, 5.0)
BIAS = st.one_of(st.just(0.0), st.floats(-2.0, 2.0))


def brute(law, amplitude, bias, angles):
    """Fourier integrals of a law of theta that is smooth between some angles."""
    cuts = np.unique(np.concatenate(([-np.pi / 2, np.pi / 2, 3 * np.pi / 2], angles)))
    cuts = cuts[(cuts >= -np.pi / 2) & (cuts <= 3 * np.pi / 2)]

    def cycle(weight):
        parts = itertools.pairwise(cuts)
        return sum(quad(lambda t: law(t) * weight(t), a, b, limit=200)[0] for a, b in parts)

    mean = cycle(lambda t: 1.0) / (2 * np.pi)
    return mean, cycle(np.sin) / (np.pi * amplitude), cycle(np.cos) / (np.pi * amplitude)


def check_derivatives(form, amplitude, bias):
    """Six derivatives by central differences of the three values."""
    values = [float(v) for v in form(amplitude, bias)]
    step = 1e-6
    for place, (da, db) in ((3, (step, 0.0)), (4, (0.0, step))):
        up, down = form(amplitude + da, bias + db), form(amplitude - da, bias - db)
        for i in range(3):
            slope = (float(up[i]) - float(down[i])) / (2 * step)
            claimed = values[place + 2 * i]
            assert claimed == pytest.approx(slope, rel=1e-4, abs=1e-5), (NAMES[i], place)


@given(beta=st.lists(st.floats(-2.0, 2.0), min_size=1, max_size=7), amplitude=AMPLITUDE, bias=BIAS)
def test_polynomial(beta, amplitude, bias):
    theta = 2 * np.pi * np.arange(64) / 64  # more than twice the degree: the sums are exact
    alpha = bias + amplitude * np.sin(theta)
    F = sum(b * alpha**i for i, b in enumerate(beta, start=1))
    found = switched.polynomial(amplitude, bias, beta)
    size = 1e-12 * sum(abs(b) * (amplitude + abs(bias)) ** i for i, b in enumerate(beta, start=1))
    assert float(found[0]) == pytest.approx(F.mean(), abs=size)
    assert float(found[1]) == pytest.approx(
        2 * np.mean(F * np.sin(theta)) / amplitude, abs=size / amplitude
    )
    slope = sum(i * b * alpha ** (i - 1) for i, b in enumerate(beta, start=1))
    assert float(found[3]) == pytest.approx(
        np.mean(slope * np.sin(theta)), abs=1e3 * size / amplitude
    )
    assert float(found[4]) == pytest.approx(np.mean(slope), abs=1e3 * size / amplitude)
    by_A = 2 * np.mean(slope * np.sin(theta) ** 2) / amplitude - float(found[1]) / amplitude
    assert float(found[5]) == pytest.approx(by_A, abs=1e3 * size / amplitude**2)
    by_B = 2 * np.mean(slope * np.sin(theta)) / amplitude
    assert float(found[6]) == pytest.approx(by_B, abs=1e3 * size / amplitude**2)


@given(
    moment=st.floats(0.1, 3.0), width=st.one_of(st.just(0.0), st.floats(0.01, 1.0)),
    amplitude=AMPLITUDE, bias=BIAS,
)  # fmt: skip
def test_relay(moment, width, amplitude, bias):
    assume(abs(amplitude - abs(bias) - width / 2) > 1e-3)

    def form(A, B):
        return switched.relay(A, B, moment, width)

    up, down = (width / 2 - bias) / amplitude, (-width / 2 - bias) / amplitude
    if up < 1 and down > -1:
        rise, fall = np.arcsin(up), np.pi - np.arcsin(down)
        exact = brute(
            lambda t: moment if rise < t < fall else -moment, amplitude, bias, [rise, fall]
        )
        check_derivatives(form, amplitude, bias)
    else:  # it stays on the one side that it is carried to, or nobody knows on which
        side = (up < 1) - (down > -1)
        exact = (side * moment, 0.0, 0.0)
    for value, expected in zip(form(amplitude, bias), exact, strict=False):
        assert float(value) == pytest.approx(expected, abs=1e-8)


@given(delta_v=st.floats(0.05, 3.0), amplitude=AMPLITUDE, bias=BIAS)
def test_play(delta_v, amplitude, bias):
    slack = delta_v / 2
    assume(abs(amplitude - slack) > 1e-3)

    def form(A, B):
        return switched.play(A, B, delta_v)

    output, rows = bias, []
    theta = np.linspace(-np.pi / 2, 3.5 * np.pi, 8001)
    for t in theta:  # the law itself, sample by sample: error of the second order in the step
        alpha = bias + amplitude * np.sin(t)
        output = min(max(output, alpha - slack), alpha + slack)
        rows.append(output)
    last = np.array(rows[4000:])
    angles = theta[4000:]
    mean = np.trapezoid(last, angles) / (2 * np.pi)
    gains = [np.trapezoid(last * f(angles), angles) / (np.pi * amplitude) for f in (np.sin, np.cos)]
    found = [float(v) for v in form(amplitude, bias)]
    assert found[:3] == pytest.approx([mean, *gains], abs=1e-5)
    check_derivatives(form, amplitude, bias)


@given(friction=st.floats(0.01, 3.0), beta1=st.floats(-1.0, 2.0), amplitude=AMPLITUDE, bias=BIAS)
def test_friction(friction, beta1, amplitude, bias):
    def form(A, B):
        return switched.friction(A, B, friction, beta1)

    exact = brute(
        lambda t: beta1 * (bias + amplitude * np.sin(t)) + friction * np.sign(np.cos(t)),
        amplitude, bias, [],
    )  # fmt: skip
    for value, expected in zip(form(amplitude, bias), exact, strict=False):
        assert float(value) == pytest.approx(expected, rel=1e-8, abs=1e-8)
    assert np.pi * amplitude**2 * float(form(amplitude, bias)[2]) == pytest.approx(
        4 * friction * amplitude
    )
    check_derivatives(form, amplitude, bias)


def test_a_cubic_is_a_polynomial():
    A, B = np.linspace(0.1, 2.0, 7), np.linspace(-1.0, 1.0, 7)
    cubic, same = describing.cubic(A, B, 0.9, 3.0), switched.polynomial(A, B, [0.9, 0.0, 3.0])
    for one, other in zip(cubic, same, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-13, atol=1e-13)


def test_forms_broadcast_and_hold_at_zero_amplitude():
    A, B = np.array([[0.0], [0.5], [2.0]]), np.array([-0.3, 0.0, 0.3])
    for form in (
        lambda: switched.relay(A, B, 1.0, 0.2),
        lambda: switched.play(A, B, 1.0),
        lambda: switched.friction(A, B, 1.0),
        lambda: switched.polynomial(A, B, [1.0, 2.0, 3.0]),
    ):
        for part in form():
            assert part.shape == (3, 3)
            assert np.all(np.isfinite(part))
