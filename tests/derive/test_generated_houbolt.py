"""Houbolt's scheme as generated: start-up, order of accuracy, agreement with the time marching."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm

from aeroflutter.generated import houbolt, section
from aeroflutter.motion import houbolt_scheme

PAR = {
    "mu": 40.0,
    "a_h": -0.4,
    "x_alpha": 0.25,
    "r_alpha": 0.5,
    "omega_bar": 0.8,
    "zeta_alpha": 0.01,
    "zeta_xi": 0.02,
}
LAGS = {"a": np.array([0.165, 0.335]), "b": np.array([0.0455, 0.3])}
U, SLOPE, OFFSET = 2.5, 0.7, 0.01
START = np.array([0.02, 0.1, 0.03, -0.01, 0.0, 0.0])


def matrices() -> tuple[NDArray[np.float64], ...]:
    C0, C1 = section.damping_terms(**PAR)
    M = section.mass_matrix(PAR["mu"], PAR["a_h"], PAR["x_alpha"], PAR["r_alpha"])
    K = section.stiffness_terms(PAR["omega_bar"]) / U**2
    return M, C0 + C1 / U, K, *section.circulatory(PAR["mu"], PAR["a_h"], PAR["r_alpha"])


def exact_system() -> NDArray[np.float64]:
    """x' = A x + constant as one matrix, for a spring SLOPE alpha + OFFSET."""
    A0, A1, A2, b2, c = section.state_terms(**PAR, **LAGS)
    whole = np.zeros((7, 7))
    whole[:6, :6] = A0 + A1 / U + (A2 - SLOPE * np.outer(b2, c)) / U**2
    whole[:6, 6] = -OFFSET * b2 / U**2
    return whole


def start_derivatives() -> NDArray[np.float64]:
    push = np.array([0.0, 1.0 / U**2])
    q, rate = START[:2], START[2:4]
    return houbolt.start_derivatives(
        *matrices(), LAGS["a"], LAGS["b"], push, q, rate, section.NONLINEAR, SLOPE, OFFSET
    )


def test_start_derivatives_are_those_of_the_state_equations() -> None:
    A, state = exact_system(), np.append(START, 1.0)
    expected = []
    for _ in range(5):
        expected.append(state[:2])
        state = A @ state
        state[6] = 0.0
    # the constant one acts on the first derivative only
    np.testing.assert_allclose(start_derivatives()[:2], expected[:2], atol=1e-16)
    np.testing.assert_allclose(start_derivatives(), _powers(A), atol=1e-15)


def _powers(A: NDArray[np.float64]) -> NDArray[np.float64]:
    """Derivatives A^k x of the augmented system, where the constant stays one."""
    x = np.append(START, 1.0)
    return np.array([(np.linalg.matrix_power(A, k) @ x)[:2] for k in range(5)])


@pytest.mark.parametrize("derivative", [0, 1, 2])
def test_start_values_are_of_third_order(derivative: int) -> None:
    """Three terms of a series: halving the step divides the error by eight, q'' included."""
    A, derivatives = exact_system(), start_derivatives()
    errors = []
    for dt in (0.2, 0.1, 0.05):
        x = expm(-A * dt) @ np.append(START, 1.0)
        exact = (np.linalg.matrix_power(A, derivative) @ x)[:2]
        errors.append(np.abs(houbolt.start_values(derivatives, dt)[derivative][0] - exact).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(np.abs(orders - 3) < 0.2), orders


def march(dt: float, end: float) -> NDArray[np.float64]:
    """Displacements at ``end`` with the generated matrices alone."""
    M, C, K, g, w_q, w_v = matrices()
    step = houbolt.step_matrices(M, C, K, g, w_q, w_v, LAGS["a"], LAGS["b"], dt)
    a, b = LAGS["a"], LAGS["b"]
    q, rate, acceleration = houbolt.start_values(start_derivatives(), dt)
    w_rate = houbolt.downwash_rate(w_q, w_v, rate, acceleration)
    w0 = w_q @ START[:2] + w_v @ START[2:4]
    # the integrals over the first step, exactly
    x = (expm(exact_system() * dt) @ np.append(START, 1.0))[:6]
    integrals = w_q @ x[:2] + w_v @ x[2:4] - b * x[4:] - w0 * np.exp(-b * dt)
    q, w_rate = q[::-1], w_rate[::-1]
    push = np.array([0.0, 1.0 / U**2])
    closed = step.new + SLOPE * np.outer(push, [0.0, 1.0])
    for n in range(1, round(end / dt)):
        history = step.decay * integrals + step.weights @ w_rate
        memory = a @ (history + w0 * np.exp(-b * (n + 1) * dt))
        load = step.lift * memory - np.einsum("kij,kj->i", step.old, q) - push * OFFSET
        q = np.vstack((np.linalg.solve(closed, load), q))
        newest = q[::-1]
        v, acc = houbolt.VELOCITY @ newest / dt, houbolt.ACCELERATION @ newest / dt**2
        latest = houbolt.downwash_rate(w_q, w_v, v, acc)
        integrals = history + step.newest * latest
        q, w_rate = q[:3], np.append(latest, w_rate[:2])
    return q[0]


def test_marching_is_of_second_order() -> None:
    exact = (expm(exact_system() * 20.0) @ np.append(START, 1.0))[:2]
    errors = [np.abs(march(dt, 20.0) - exact).max() for dt in (0.2, 0.1, 0.05)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(np.abs(orders - 2) < 0.1), orders


def test_weights_are_those_of_the_time_marching() -> None:
    for name in ("VELOCITY", "ACCELERATION", "DUHAMEL"):
        derived, used = getattr(houbolt, name), getattr(houbolt_scheme, name)
        np.testing.assert_allclose(derived, used, rtol=1e-15, atol=0)


def test_any_number_of_coordinates_and_terms() -> None:
    rng = np.random.default_rng(0)
    for n, terms in ((1, 0), (3, 1), (4, 5)):
        M, C, K = np.eye(n) + 0.1 * rng.random((n, n)), rng.random((n, n)), rng.random((n, n))
        g, w_q, w_v = rng.random((3, n))
        a, b = 0.1 * rng.random(terms), rng.random(terms)
        step = houbolt.step_matrices(M, C, K, g, w_q, w_v, a, b, 0.1)
        assert step.new.shape == (n, n)
        assert step.old.shape == (3, n, n)
        assert step.weights.shape == (terms, 3)
        # at rest nothing happens: a constant q is held by its springs and the steady lift alone
        total = step.new + step.old.sum(axis=0)
        np.testing.assert_allclose(total, K + np.outer(g, w_q), atol=1e-11)
        derivatives = houbolt.start_derivatives(
            M, C, K, g, w_q, w_v, a, b, np.zeros(n), np.ones(n), np.zeros(n), 0, 1.0, 0.0
        )
        assert derivatives.shape == (5, n)
