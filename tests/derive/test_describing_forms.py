"""Closed-form describing functions against brute force, at every amplitude, bias and scale."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
import pytest
from fourier import NAMES, Loop, Memory, Motion, harmonics, hysteresis, static
from hypothesis import assume, example, given
from hypothesis import strategies as st

from aeroflutter.generated import describing as forms

LENGTH = st.one_of(st.just(0.0), st.floats(0.01, 2.0))
OFFSET = st.floats(-1.0, 1.0)
AMPLITUDE = st.floats(0.01, 20.0)
BIAS = st.one_of(st.just(0.0), st.floats(-3.0, 3.0))


def compare(form: Any, brute: dict[str, float], amplitude: float, size: float) -> None:
    """Values to 1e-10, derivatives to 1e-7.

    Quadrature over smooth pieces is exact to round-off, which is magnified by 1/A in the gains and
    by 1/A^2 in their derivatives. Where a motion just grazes a corner the derivatives have infinite
    slopes, and round-off of the corner's place shows as its root, 1.5e-8.
    """
    reach = size + amplitude
    scales = {"F0": reach, "dF0_dA": 1.0, "dF0_dB": 1.0}
    for name in NAMES:
        by = 1.0 / amplitude if name.startswith("dn") else 1.0
        scale = scales.get(name, max(1.0, reach / amplitude) * by)
        tolerance = 1e-7 if name.startswith("d") else 1e-10
        error = abs(float(getattr(form, name)) - brute[name])
        assert error <= tolerance * scale, (name, getattr(form, name), brute[name])


@given(
    breaks=st.lists(st.floats(-2.0, 2.0), min_size=0, max_size=6, unique=True),
    data=st.data(),
    amplitude=AMPLITUDE,
    bias=BIAS,
)
def test_any_static_law(
    breaks: list[float], data: st.DataObject, amplitude: float, bias: float
) -> None:
    t = np.sort(breaks)
    assume(np.all(np.diff(t) > 1e-3))
    slope = st.floats(-1.0, 4.0)
    s = np.array(data.draw(st.lists(slope, min_size=t.size + 1, max_size=t.size + 1)))
    first = data.draw(OFFSET)
    f = first + np.concatenate(([0.0], np.cumsum(-np.diff(s) * t)))
    form = forms.piecewise_linear(amplitude, bias, t, s, f)
    motion = Motion(amplitude, bias)
    compare(form, static(motion, t, s, f), amplitude, 10.0 + abs(bias))


@given(
    m0=OFFSET,
    m_f=st.floats(-0.5, 3.0),
    alpha_f=OFFSET,
    delta=LENGTH,
    amplitude=AMPLITUDE,
    bias=BIAS,
)
def test_bilinear_law(
    m0: float, m_f: float, alpha_f: float, delta: float, amplitude: float, bias: float
) -> None:
    t = np.array([alpha_f, alpha_f + delta])
    s = np.array([1.0, m_f, 1.0])
    f = np.array([m0 - alpha_f, m0 - m_f * alpha_f, m0 - alpha_f + delta * (m_f - 1.0)])
    form = forms.bilinear(amplitude, bias, m0, m_f, alpha_f, delta)
    compare(form, static(Motion(amplitude, bias), t, s, f), amplitude, 5.0 + abs(bias))
    compare(form, _as_dict(forms.piecewise_linear(amplitude, bias, t, s, f)), amplitude, 5.0)


@given(gap=LENGTH, centre=OFFSET, amplitude=AMPLITUDE, bias=BIAS)
def test_freeplay_law(gap: float, centre: float, amplitude: float, bias: float) -> None:
    t = np.array([centre - gap / 2, centre + gap / 2])
    s, f = np.array([1.0, 0.0, 1.0]), np.array([gap / 2 - centre, 0.0, -gap / 2 - centre])
    form = forms.freeplay(amplitude, bias, gap, centre)
    compare(form, static(Motion(amplitude, bias), t, s, f), amplitude, 5.0 + abs(bias))


@given(
    beta1=st.floats(-1.0, 2.0),
    beta3=st.floats(-5.0, 80.0),
    amplitude=st.floats(0.01, 3.0),
    bias=OFFSET,
)
def test_cubic_law(beta1: float, beta3: float, amplitude: float, bias: float) -> None:
    def answer(theta: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        alpha = bias + amplitude * np.sin(theta)
        slope = beta1 + 3.0 * beta3 * alpha**2
        return beta1 * alpha + beta3 * alpha**3, slope * np.sin(theta), slope

    brute = harmonics(Motion(amplitude, bias), [], answer)
    form = forms.cubic(amplitude, bias, beta1, beta3)
    for name in NAMES:
        scale = (abs(beta1) + abs(beta3)) * (1.0 + amplitude + abs(bias)) ** 3 / amplitude**2
        assert abs(float(getattr(form, name)) - brute[name]) <= 1e-12 * (scale + 1.0), name


@given(slope=st.floats(-2.0, 3.0), centre=OFFSET, amplitude=AMPLITUDE, bias=BIAS)
def test_linear_law(slope: float, centre: float, amplitude: float, bias: float) -> None:
    form = forms.linear(amplitude, bias, slope, centre)
    assert form == (slope * (bias - centre), slope, 0.0, 0.0, slope, 0.0, 0.0, 0.0, 0.0)


@given(delta_v=LENGTH, delta_h=LENGTH, v_off=OFFSET, h_off=OFFSET, amplitude=AMPLITUDE, bias=BIAS)
@example(1.0, 0.2, 0.0, 0.0, 0.55, 0.0)  # Jenkins' loop
@example(1.0, 0.2, 0.0, 0.0, 0.55, 0.08)  # a loop that reaches one stop
@example(1.0, 0.2, 0.0, 0.0, 0.45, 0.08)  # no loop
@example(0.4, 1.0, 0.25, 0.5, 3.0, 0.1)
def test_hysteresis_loop(
    delta_v: float, delta_h: float, v_off: float, h_off: float, amplitude: float, bias: float
) -> None:
    loop, motion = Loop(delta_v, delta_h, v_off, h_off), Motion(amplitude, bias)
    # away from the amplitudes and biases where one range of the closed form meets another
    edges = [amplitude - delta_v / 2]
    edges += [bias - v_off - stop + s * e for stop in loop.stops for s in (-1, 0, 1) for e in edges]
    assume(min(abs(edge) for edge in edges) > 1e-6)
    low, high = loop.stops
    middle = float(np.clip(bias - v_off, low, high))
    start = Memory(middle, 0.0, 1.0 if low < middle < high else 0.0)
    form = forms.hysteresis(amplitude, bias, delta_v, delta_h, v_off, h_off)
    compare(form, hysteresis(motion, loop, start), amplitude, 5.0 + abs(bias))


@given(
    delta_v=LENGTH,
    delta_h=LENGTH,
    bias=BIAS,
    amplitude=AMPLITUDE,
    first=st.floats(-2.0, 2.0),
)
def test_any_start_leads_to_the_same_loop(
    delta_v: float, delta_h: float, bias: float, amplitude: float, first: float
) -> None:
    """Where the memory moves at all, the steady loop does not depend on where it started."""
    amplitude += delta_v / 2 + max(0.0, abs(bias) - delta_h / 2)  # far enough for it to move
    loop, motion = Loop(delta_v, delta_h, 0.0, 0.0), Motion(amplitude, bias)
    bottom, top = loop.extremes(motion, Memory(first, 0.0, 0.0), cycles=1)
    form = forms.hysteresis(amplitude, bias, delta_v, delta_h)
    travel = np.pi * amplitude**2 * form.n_q
    assume(travel > 1e-9)
    assert abs(delta_v * (top.value - bottom.value) - travel) <= 1e-12 * (travel + amplitude)


@given(delta_v=st.floats(0.01, 2.0), delta_h=st.floats(0.01, 2.0), factor=st.floats(1.001, 50.0))
def test_whole_loop_is_the_published_one(delta_v: float, delta_h: float, factor: float) -> None:
    """Equations 3.40-3.42, and what the loop dissipates."""
    D, gap = delta_v / 2, delta_h / 2
    A = factor * (D + gap)
    form = forms.hysteresis(A, 0.0, delta_v, delta_h)

    def f(gamma: float) -> float:
        return 2 / np.pi * (np.arcsin(gamma) + gamma * np.sqrt(1 - gamma**2))

    assert abs(form.n_p - (2 - f((D + gap) / A) + f((D - gap) / A)) / 2) < 1e-14
    assert np.isclose(np.pi * form.n_q * A**2, delta_v * delta_h, rtol=1e-13)
    assert abs(form.F0) < 1e-14 * A


@given(delta_v=st.floats(0.01, 2.0), ratio=st.floats(0.01, 0.99), delta_h=st.floats(0.5, 2.0))
def test_loop_short_of_the_stops_is_that_of_jenkins(
    delta_v: float, ratio: float, delta_h: float
) -> None:
    D = delta_v / 2
    A = D + ratio * delta_h / 2
    form = forms.hysteresis(A, 0.0, delta_v, delta_h)
    gamma = (2 * D - A) / A
    f = 2 / np.pi * (np.arcsin(gamma) + gamma * np.sqrt(1 - gamma**2))
    assert abs(form.n_p - (1 + f) / 2) < 1e-13
    assert np.isclose(form.n_q, 4 * D * (A - D) / (np.pi * A**2), rtol=1e-12)


@given(delta=st.floats(0.01, 2.0), v_off=OFFSET, h_off=OFFSET, amplitude=AMPLITUDE, bias=BIAS)
def test_limits_of_the_loop(
    delta: float, v_off: float, h_off: float, amplitude: float, bias: float
) -> None:
    thin = forms.hysteresis(amplitude, bias, 0.0, delta, v_off, h_off)
    gap = forms.freeplay(amplitude, bias - v_off, delta, h_off)
    flat = forms.hysteresis(amplitude, bias, delta, 0.0, v_off, h_off)
    for name in NAMES:
        shift = v_off if name == "F0" else 0.0
        scale = 1e-12 / min(1.0, amplitude) ** 2
        assert abs(getattr(thin, name) - getattr(gap, name) - shift) <= scale, name
        line = {"F0": bias - h_off, "n_p": 1.0, "dF0_dB": 1.0}.get(name, 0.0)
        assert abs(getattr(flat, name) - line) <= scale, name


@given(delta_v=LENGTH, delta_h=LENGTH, amplitude=AMPLITUDE, bias=BIAS, v_off=OFFSET, h_off=OFFSET)
def test_loop_is_odd_about_its_centre(
    delta_v: float, delta_h: float, amplitude: float, bias: float, v_off: float, h_off: float
) -> None:
    centre = v_off + h_off
    one = forms.hysteresis(amplitude, centre + bias, delta_v, delta_h, v_off, h_off)
    other = forms.hysteresis(amplitude, centre - bias, delta_v, delta_h, v_off, h_off)
    assert abs((one.F0 - v_off) + (other.F0 - v_off)) < 1e-13 * (1 + amplitude)
    assert abs(one.n_p - other.n_p) < 1e-12 * max(1.0, 1.0 / amplitude)
    assert abs(one.n_q - other.n_q) < 1e-12 * max(1.0, 1.0 / amplitude**2)


@given(power=st.integers(-100, 100), amplitude=AMPLITUDE, bias=BIAS)
def test_lengths_scale_exactly(power: int, amplitude: float, bias: float) -> None:
    """A power of four, and its root, change no digit: the forms hold no length of their own."""
    k = 4.0**power
    one = forms.hysteresis(amplitude, bias, 0.7, 0.3, 0.1, -0.2)
    other = forms.hysteresis(k * amplitude, k * bias, k * 0.7, k * 0.3, k * 0.1, k * -0.2)
    assert (other.n_p, other.n_q, other.F0) == (one.n_p, one.n_q, k * one.F0)
    t, s, f = np.array([-0.1, 0.4]), np.array([2.0, 0.5, 1.0]), np.array([0.15, 0.0, -0.2])
    one = forms.piecewise_linear(amplitude, bias, t, s, f)
    other = forms.piecewise_linear(k * amplitude, k * bias, k * t, s, k * f)
    assert (other.n_p, other.F0) == (one.n_p, k * one.F0)


@pytest.mark.parametrize("ratio", [1.0000001, 1.01, 10.0, 1e3, 1e6, 1e9])
def test_no_digits_are_lost_at_either_end(ratio: float) -> None:
    """Against fifty digits: N to 1e-14, and the part of N that is not 1 to 1e-9 at A = 1e6."""
    mpmath.mp.dps = 50
    D, gap = mpmath.mpf(1) / 2, mpmath.mpf(1) / 8
    A = mpmath.mpf(ratio) * (D + gap)
    bias = mpmath.mpf(0)

    def f(gamma: mpmath.mpf) -> mpmath.mpf:
        return 2 / mpmath.pi * (mpmath.asin(gamma) + gamma * mpmath.sqrt(1 - gamma**2))

    exact = (2 - f((D + gap) / A) + f((D - gap) / A)) / 2
    form = forms.hysteresis(float(A), float(bias), 1.0, 0.25)
    assert abs(form.n_p - exact) < 2e-15
    assert abs(form.n_q - 4 * D * gap / (mpmath.pi * A**2)) <= 1e-14 * form.n_q


@pytest.mark.parametrize("ratio", [1.01, 10.0, 1e3, 1e6])
def test_mean_moment_keeps_the_size_of_the_spring(ratio: float) -> None:
    """F0 of freeplay under a large motion, relative to its bias, against fifty digits."""
    mpmath.mp.dps = 50
    gap, bias = mpmath.mpf(1), mpmath.mpf(1) / 4
    A = mpmath.mpf(ratio) * (gap / 2 + bias)

    def even(d: mpmath.mpf) -> mpmath.mpf:
        return mpmath.sqrt(A**2 - d**2) + d * mpmath.asin(d / A)

    exact = bias + (even(gap / 2 - bias) - even(-gap / 2 - bias)) / mpmath.pi
    assert abs(forms.freeplay(float(A), 0.25, 1.0).F0 - exact) < 1e-15


def test_edges_are_finite() -> None:
    """No warning and no infinity at zero amplitude, at breaks, or where a range ends."""
    A = np.array([0.0, 1e-300, 1e-150, 0.5, np.nextafter(0.5, 1), 0.6, 1e150])[:, None]
    B = np.array([-0.5, -0.1, 0.0, 0.1, 0.5])
    for form in (
        forms.hysteresis(A, B, 1.0, 0.2),
        forms.hysteresis(A, B, 0.0, 0.2),
        forms.hysteresis(A, B, 1.0, 0.0),
        forms.hysteresis(A, B, 0.0, 0.0),
        forms.freeplay(A, B, 0.2),
        forms.bilinear(A, B, 0.1, 0.2, 0.1, 0.4),
        forms.piecewise_linear(A, B, [-0.1, 0.5], [1.0, 0.3, 2.0], [0.0, -0.07, -0.92]),
    ):
        for name in NAMES:
            value = getattr(form, name)
            assert value.shape == (7, 5), name
            assert np.all(np.isfinite(value)), name


def test_zero_amplitude_is_the_static_law() -> None:
    bias = np.array([-0.3, -0.1, 0.0, 0.1, 0.3])
    form = forms.freeplay(0.0, bias, 0.2)
    np.testing.assert_allclose(form.F0, [-0.2, 0.0, 0.0, 0.0, 0.2], atol=1e-16)
    np.testing.assert_array_equal(form.n_p, [1.0, 0.5, 0.0, 0.5, 1.0])
    stuck = forms.hysteresis(0.0, bias, 1.0, 0.2)
    np.testing.assert_array_equal(stuck.n_p, 1.0)
    np.testing.assert_array_equal(stuck.n_q, 0.0)


def test_arrays_broadcast() -> None:
    A, B = np.array([0.4, 0.7, 3.0])[:, None], np.array([-0.2, 0.1])
    for law in (
        lambda A, B: forms.hysteresis(A, B, 1.0, 0.2, 0.1, 0.05),
        lambda A, B: forms.freeplay(A, B, 0.4),
        lambda A, B: forms.piecewise_linear(A, B, [0.0, 0.2], [1.0, 0.0, 1.0], [0.0, 0.0, -0.2]),
        lambda A, B: forms.piecewise_linear(A, B, [], [2.0], [0.1]),
        lambda A, B: forms.cubic(A, B, 1.0, 3.0),
        lambda A, B: forms.linear(A, B),
    ):
        together = law(A, B)
        for i, j in np.ndindex(3, 2):
            alone = law(float(A[i, 0]), float(B[j]))
            for name in NAMES:
                assert getattr(together, name).shape == (3, 2)
                assert getattr(together, name)[i, j] == getattr(alone, name)


def _as_dict(form: Any) -> dict[str, float]:
    return {name: float(getattr(form, name)) for name in NAMES}
