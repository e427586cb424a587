"""Polynomials, named tables and laws that jump: what they are, and that every engine takes them."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.integrate
from hypothesis import given
from hypothesis import strategies as st

from aeroflutter import (
    Cubic,
    DeadZone,
    Freeplay,
    Friction,
    InputError,
    LureSystem,
    Play,
    Polynomial,
    Relay,
    Saturation,
    SectionFamily,
    TypicalSection,
    respond,
    simplify,
)
from aeroflutter.guarantees.absence.law import Uncovered, law_of
from aeroflutter.linear.rootlocus import flutter_speed
from aeroflutter.motion.chaos import ChaosOptions, chaos
from aeroflutter.motion.response import Initial, SimulateOptions, simulate
from aeroflutter.orbits.harmonic import HarmonicOptions, sinusoid, solve_cycle

DEGREE = np.pi / 180
FAMILY = SectionFamily(TypicalSection(omega_bar=0.2))
FLUTTER = flutter_speed(FAMILY)


def dop853(system, spring, x, time):
    """x(time) of a smooth law by SciPy."""
    found = scipy.integrate.solve_ivp(
        lambda _, x: system.A @ x - system.b * float(spring.moment(system.c @ x)),
        (0.0, time), x, method="DOP853", rtol=1e-12, atol=1e-14,
    )  # fmt: skip
    return found.y[:, -1]


# --- polynomials


@given(
    beta=st.lists(st.floats(-3.0, 3.0), min_size=1, max_size=6),
    factor=st.floats(0.1, 10.0),
    alpha=st.floats(-2.0, 2.0),
)
def test_a_polynomial_is_the_sum_of_its_powers(beta, factor, alpha):
    law = Polynomial(tuple(beta))
    powers = sum(b * alpha**i for i, b in enumerate(beta, start=1))
    assert float(law.moment(alpha)) == pytest.approx(powers, rel=1e-12, abs=1e-12)
    scaled = float(law.scaled(factor).moment(factor * alpha))
    assert scaled == pytest.approx(factor * powers, rel=1e-9, abs=1e-9)
    assert law.odd == (not any(beta[1::2]))


@given(beta=st.lists(st.floats(-3.0, 3.0), min_size=1, max_size=5))
def test_slopes_stay_within_their_range(beta):
    low, high = Polynomial(tuple(beta)).slope_range()
    alpha = np.linspace(-3.0, 3.0, 301)
    slope = sum(i * b * alpha ** (i - 1) for i, b in enumerate(beta, start=1))
    room = 1e-6 * (1.0 + np.max(np.abs(slope)))
    assert np.all(slope >= low - room)
    assert np.all(slope <= high + room)


def test_polynomials_become_what_they_are():
    assert simplify(Polynomial((0.7, 0.0))).kind == "linear"
    assert simplify(Polynomial((0.7, 0.0, 2.0))) == Cubic(0.7, 2.0)
    assert simplify(Polynomial((0.7, 0.1, 2.0))).kind == "polynomial"
    for beta in ((), (1.0, np.nan), "12", [1.0] * 17, 3.0):
        with pytest.raises(InputError, match="beta"):
            Polynomial(beta)


@pytest.mark.parametrize("beta", [(0.9, -1.5, 4.0), (1.0, 0.0, 2.0, 0.0, 300.0), (1.2,)])
def test_the_motion_of_a_polynomial_spring_is_that_of_dop853(beta):
    system, spring = FAMILY.at(1.05 * FLUTTER), Polynomial(beta)
    x = Initial(alpha=0.1, xi=0.02).vector(system)
    run = simulate(system, spring, Initial(state=x), SimulateOptions(duration=200.0, decide=False))
    np.testing.assert_allclose(run.final_state, dop853(system, spring, x, 200.0), rtol=0, atol=1e-9)


def test_a_polynomial_of_even_order_has_a_biased_cycle_of_harmonic_balance_too():
    spring, speed = Polynomial((1.0, 0.6, 3.0)), 1.1 * FLUTTER
    run = simulate(FAMILY.at(speed), spring, Initial(alpha=0.1), SimulateOptions(record=False))
    assert (run.engine, run.state) == ("smooth", "lco")
    assert abs(run.bias) > 1e-3
    guess = sinusoid(run.first_harmonic, run.bias, 2 * np.pi / run.period, speed)
    options = HarmonicOptions(tolerance=1e-12)
    cycle = solve_cycle(FAMILY, spring, guess, options=options, symmetric=False)
    assert run.period == pytest.approx(cycle.period, rel=1e-9)
    assert run.first_harmonic == pytest.approx(cycle.first_harmonic, rel=1e-9)


def test_houbolt_tends_to_the_motion_of_a_polynomial_spring():
    system, spring = FAMILY.at(1.1 * FLUTTER), Polynomial((1.0, 0.6, 3.0))
    x = Initial(alpha=0.1).vector(system)
    exact = dop853(system, spring, x, 40.0)[1]
    errors = []
    for dt in (0.1, 0.05, 0.025):
        options = SimulateOptions(engine="houbolt", dt=dt, duration=40.0, decide=False)
        run = simulate(system, spring, Initial(alpha=0.1), options)
        errors.append(abs(run.pitch[round(40.0 / dt)] - exact))
    assert np.polyfit(np.log([0.1, 0.05, 0.025]), np.log(errors), 1)[0] == pytest.approx(2, abs=0.3)


def test_exponents_of_a_cycle_of_a_polynomial_spring_are_its_multipliers():
    system, spring = FAMILY.at(1.1 * FLUTTER), Polynomial((1.0, 0.6, 3.0))
    found = chaos(system, spring, Initial(alpha=0.1), ChaosOptions(cycles=200, transient=20))
    run = simulate(system, spring, Initial(alpha=0.1), SimulateOptions(record=False))
    expected = np.log(run.extras["multiplier"]) / run.period
    assert found.exponents.values[0] == pytest.approx(0.0, abs=1e-5)
    assert found.exponents.values[1] == pytest.approx(expected, rel=1e-2)


# --- tables with names


def test_named_tables():
    alpha = np.linspace(-3.0, 3.0, 61)
    np.testing.assert_allclose(
        Saturation(1.5, 2.0).moment(alpha), 2.0 * np.clip(alpha, -1.5, 1.5), atol=1e-15
    )
    zone = alpha - np.clip(alpha, -0.5, 0.5)
    np.testing.assert_allclose(DeadZone(1.0, 0.7).moment(alpha), 0.7 * zone, atol=1e-15)
    np.testing.assert_allclose(DeadZone(1.0).moment(alpha), Freeplay(1.0).moment(alpha))
    saturation = Saturation(0.8, 1.3)
    assert saturation.scaled(2.0).moment(1.7) == pytest.approx(2.0 * saturation.moment(0.85))
    assert saturation.odd
    for law in (Saturation, DeadZone):
        with pytest.raises(InputError, match="must be positive"):
            law(-1.0)


def test_describing_function_of_saturation_is_the_textbooks():
    # Slope up to the limit; above it (2/pi) (asin g + g sqrt(1 - g²)), g = limit/A.
    A = np.array([0.5, 1.0, 2.0, 10.0])
    g = np.minimum(1.0 / A, 1.0)
    expected = 2 / np.pi * (np.arcsin(g) + g * np.sqrt(1 - g * g))
    np.testing.assert_allclose(Saturation().describing(A).n_p, expected, rtol=1e-14)
    np.testing.assert_allclose(DeadZone(2.0).describing(A).n_p, 1 - expected, atol=1e-14)


# --- laws that jump or follow, under a prescribed motion


def test_a_relay_jumps_at_its_edges():
    moment, side = respond(Relay(2.0, 1.0), np.array([0.0, 0.4, 0.6, 0.0, -0.4, -0.6, 0.4]))
    np.testing.assert_array_equal(moment, [2, 2, 2, 2, 2, -2, -2])
    np.testing.assert_array_equal(side, [1, 1, 1, 1, 1, -1, -1])
    assert Relay(2.0).moment(-0.1) == -2.0


def test_play_follows_at_a_distance():
    moment, _ = respond(Play(1.0), np.array([0.0, 0.4, 2.0, 1.2, 0.0, 0.8]), 0.0)
    np.testing.assert_allclose(moment, [0.0, 0.0, 1.5, 1.5, 0.5, 0.5])


def test_friction_takes_four_times_friction_and_amplitude_a_cycle():
    theta = 2 * np.pi * np.arange(4001) / 2000
    law, A = Friction(0.3, 0.8), 1.7
    moment, _ = respond(law, A * np.sin(theta))
    work = np.sum(0.5 * (moment[2001:] + moment[2000:-1]) * np.diff(A * np.sin(theta[2000:])))
    assert work == pytest.approx(4 * 0.3 * A, rel=1e-3)
    rising, falling = respond(law, np.array([0.0, 1.0, 0.5, 0.5]))[0][1:3]
    assert (rising, falling) == pytest.approx((0.8 + 0.3, 0.4 - 0.3))


@pytest.mark.parametrize("law", [Relay(), Play(), Friction(0.1)])
def test_no_absence_of_oscillation_is_claimed_for_laws_that_it_does_not_cover(law):
    with pytest.raises(Uncovered):
        law_of(law)


def test_laws_that_jump_are_not_for_houbolt():
    system = LureSystem(np.array([[0.0, 1.0], [-1.0, -0.1]]), np.array([0.0, 1.0]), np.eye(2)[0])
    for law in (Relay(), Play(), Friction(0.1)):
        with pytest.raises(InputError, match="exact"):
            simulate(system, law, Initial(state=[1.0, 0.0]), SimulateOptions(engine="houbolt"))
