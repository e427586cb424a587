"""Generated equations of the section against the equations as they are written down."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.linalg import expm
from scipy.optimize import brentq

from aeroflutter.generated import loads, quasi_steady, section

JONES = ((0.165, 0.335), (0.0455, 0.3))

THESIS = {"mu": 100.0, "a_h": -0.5, "x_alpha": 0.25, "r_alpha": 0.5, "zeta_alpha": 0, "zeta_xi": 0}

SECTIONS = st.fixed_dictionaries(
    {
        "mu": st.floats(2.0, 300.0),
        "a_h": st.floats(-0.9, 0.5),
        "x_alpha": st.floats(-0.4, 0.4),
        "r_alpha": st.floats(0.45, 1.0),
        "omega_bar": st.floats(0.0, 2.0),
        "zeta_alpha": st.floats(0.0, 0.2),
        "zeta_xi": st.floats(0.0, 0.2),
    }
)
LAGS = st.lists(st.tuples(st.floats(0.01, 0.3), st.floats(0.01, 2.0)), max_size=4)
SPEEDS = st.floats(0.3, 20.0)
NUMBERS = st.complex_numbers(min_magnitude=0.05, max_magnitude=2.0, allow_subnormal=False)


def split(lags: list[tuple[float, float]]) -> tuple[list[float], list[float]]:
    return [a for a, _ in lags], [b for _, b in lags]


def written_impedance(
    par: dict[str, float], Phi: complex, U: float, N: complex, p: complex, steady: bool = False
) -> np.ndarray:
    """B(p) put together from C_L and C_M of unit motions, as the equations are printed."""
    mu, a_h, x, r2 = par["mu"], par["a_h"], par["x_alpha"], par["r_alpha"] ** 2
    ratio = par["omega_bar"] / U
    columns = []
    for xi, alpha in ((1.0, 0.0), (0.0, 1.0)):
        if steady:
            C_L = 2 * np.pi * alpha
            C_M = (0.5 + a_h) * C_L / 2
        else:
            W = Phi * (alpha + p * xi + (0.5 - a_h) * p * alpha)
            C_L = np.pi * (p**2 * xi - a_h * p**2 * alpha + p * alpha) + 2 * np.pi * W
            C_M = np.pi * (0.5 + a_h) * W + np.pi / 2 * (
                a_h * (p**2 * xi - a_h * p**2 * alpha) - (0.5 - a_h) * p * alpha - p**2 * alpha / 8
            )
        heave = p**2 * (xi + x * alpha) + 2 * par["zeta_xi"] * ratio * p * xi + ratio**2 * xi
        pitch = p**2 * (x / r2 * xi + alpha) + 2 * par["zeta_alpha"] / U * p * alpha
        pitch += N * alpha / U**2
        columns.append((heave + C_L / (np.pi * mu), pitch - 2 * C_M / (np.pi * mu * r2)))
    return np.array(columns).T


@given(par=SECTIONS, lags=LAGS, U=SPEEDS, N=NUMBERS, p=NUMBERS)
def test_impedance_is_the_printed_equations(
    par: dict[str, float], lags: list[tuple[float, float]], U: float, N: complex, p: complex
) -> None:
    a, b = split(lags)
    Phi = 1 - sum(ai * p / (p + bi) for ai, bi in lags)
    B = section.impedance(**par, a=a, b=b, speed=U, stiffness=N, p=p)
    written = written_impedance(par, Phi, U, N, p)
    np.testing.assert_allclose(B, written, rtol=0, atol=1e-13 * (1 + np.abs(written).max()))
    assert np.isclose(loads.lift_deficiency(p, a, b), Phi, rtol=1e-13)
    assert np.isclose(p * loads.wagner_laplace(p, a, b), Phi, rtol=1e-12)

    rows = [
        loads.lift_coefficient(p, par["a_h"], a, b),
        loads.moment_coefficient(p, par["a_h"], a, b),
    ]
    scale = np.array([1 / (np.pi * par["mu"]), -2 / (np.pi * par["mu"] * par["r_alpha"] ** 2)])
    structure = B - scale[:, None] * np.array(rows)
    bare = written_impedance({**par, "mu": np.inf}, Phi, U, N, p)
    np.testing.assert_allclose(structure, bare, rtol=0, atol=1e-13 * (1 + np.abs(written).max()))


@given(par=SECTIONS, U=SPEEDS, N=NUMBERS, p=NUMBERS)
def test_quasi_steady_impedance(par: dict[str, float], U: float, N: complex, p: complex) -> None:
    B = quasi_steady.impedance(**par, speed=U, stiffness=N, p=p)
    written = written_impedance(par, 1.0, U, N, p, steady=True)
    np.testing.assert_allclose(B, written, rtol=0, atol=1e-13 * (1 + np.abs(written).max()))
    coefficients = quasi_steady.characteristic_coefficients(**par, speed=U, stiffness=N)
    assert np.isclose(np.polyval(coefficients, p), np.linalg.det(B), rtol=1e-10, atol=1e-10)


def _closed(module: Any, par: dict[str, float], lags: Any, U: float, N: complex) -> np.ndarray:
    A0, A1, A2, b2, c = module.state_terms(**par, **lags)
    return A0 + A1 / U + A2 / U**2 - N * np.outer(b2, c) / U**2


@given(par=SECTIONS, lags=LAGS, U=SPEEDS, N=NUMBERS, p=NUMBERS)
def test_state_matrices_polynomial_and_impedance_agree(
    par: dict[str, float], lags: list[tuple[float, float]], U: float, N: complex, p: complex
) -> None:
    """det(pI - A + N b c) det M = det B prod(p + b_i), at any p and for any number of terms."""
    a, b = split(lags)
    A = _closed(section, par, {"a": a, "b": b}, U, N)
    M = section.mass_matrix(*(par[name] for name in ("mu", "a_h", "x_alpha", "r_alpha")))
    by_states = np.linalg.det(p * np.eye(len(A)) - A) * np.linalg.det(M)
    B = section.impedance(**par, a=a, b=b, speed=U, stiffness=N, p=p)
    by_laplace = np.linalg.det(B) * np.prod(p + np.array(b))
    coefficients = section.characteristic_coefficients(**par, a=a, b=b, speed=U, stiffness=N)
    by_polynomial = np.polyval(coefficients, p)
    size = np.polyval(np.abs(coefficients), abs(p)) + 1
    assert coefficients.shape == (5 + len(lags),)
    assert abs(by_polynomial - by_laplace) < 1e-12 * size * (
        1 + 1 / min(abs(p + np.array([*b, 1])))
    )
    assert abs(by_polynomial - by_states) < 1e-10 * size


@given(par=SECTIONS)
def test_mass_matrix_and_its_inverse(par: dict[str, float]) -> None:
    M = section.mass_matrix(*(par[name] for name in ("mu", "a_h", "x_alpha", "r_alpha")))
    inverse = section.mass_inverse(*(par[name] for name in ("mu", "a_h", "x_alpha", "r_alpha")))
    np.testing.assert_allclose(M @ inverse, np.eye(2), atol=1e-13 * np.linalg.cond(M))
    # symmetric once the pitch row is put back into the units of the heave row
    assert np.isclose(M[0, 1], M[1, 0] * par["r_alpha"] ** 2, atol=1e-14)


def test_lag_states_are_duhamels_integral() -> None:
    """W of a motion that starts with w(0) not zero, by quadrature of the convolution."""
    a, b = np.array(JONES[0]), np.array(JONES[1])

    def w(tau: float) -> float:
        return 0.3 + 0.7 * np.cos(0.4 * tau)

    def rate(tau: float) -> float:
        return -0.28 * np.sin(0.4 * tau)

    tau = 12.0
    duhamel = w(0) * loads.wagner(tau, a, b)
    duhamel += quad(lambda s: float(loads.wagner(tau - s, a, b)) * rate(s), 0, tau, epsabs=1e-13)[0]
    z = [quad(lambda s, bi=bi: np.exp(-bi * (tau - s)) * w(s), 0, tau, epsabs=1e-13)[0] for bi in b]
    lagged = (1 - a.sum()) * w(tau) + (a * b) @ np.array(z)
    assert abs(lagged - duhamel) < 1e-12


def test_free_response_solves_the_equations_of_motion() -> None:
    """Time domain: the states put back into equations 3.9 and 3.23-3.24 leave no residual."""
    par = {
        "mu": 20.0,
        "a_h": -0.3,
        "x_alpha": 0.2,
        "r_alpha": 0.6,
        "omega_bar": 0.7,
        "zeta_alpha": 0.03,
        "zeta_xi": 0.01,
    }
    a, b = np.array(JONES[0]), np.array(JONES[1])
    U, slope = 2.7, 0.8
    A = _closed(section, par, {"a": a, "b": b}, U, slope).real
    for tau in (0.0, 0.7, 5.0):
        x = expm(A * tau) @ np.array([0.1, -0.2, 0.05, 0.3, 0.0, 0.0])
        (xi, alpha, xi_1, alpha_1), z = x[:4], x[4:]
        xi_2, alpha_2 = (A @ x)[2:4]
        w = alpha + xi_1 + (0.5 - par["a_h"]) * alpha_1
        W = (1 - a.sum()) * w + (a * b) @ z
        C_L = np.pi * (xi_2 - par["a_h"] * alpha_2 + alpha_1) + 2 * np.pi * W
        C_M = np.pi * (0.5 + par["a_h"]) * W + np.pi / 2 * (
            par["a_h"] * (xi_2 - par["a_h"] * alpha_2) - (0.5 - par["a_h"]) * alpha_1 - alpha_2 / 8
        )
        ratio, r2 = par["omega_bar"] / U, par["r_alpha"] ** 2
        heave = xi_2 + par["x_alpha"] * alpha_2 + 2 * par["zeta_xi"] * ratio * xi_1
        heave += ratio**2 * xi + C_L / (np.pi * par["mu"])
        pitch = par["x_alpha"] / r2 * xi_2 + alpha_2 + 2 * par["zeta_alpha"] / U * alpha_1
        pitch += slope * alpha / U**2 - 2 * C_M / (np.pi * par["mu"] * r2)
        assert abs(heave) < 1e-14
        assert abs(pitch) < 1e-14


@pytest.mark.parametrize(("omega_bar", "printed"), [(0.2, 6.28509), (0.8, 4.11454)])
def test_linear_flutter_speed(omega_bar: float, printed: float) -> None:
    """The thesis's sections; the digits are those of two independent computations.

    Lee, Price & Wong 1999, Table 2, print 6.285 and 4.114.
    """
    par = {**THESIS, "omega_bar": omega_bar}

    def growth(U: float) -> float:
        roots = np.linalg.eigvals(_closed(section, par, {"a": JONES[0], "b": JONES[1]}, U, 1.0))
        return float(max(root.real for root in roots if abs(root.imag) > 1e-6))

    assert abs(brentq(growth, 3.0, 8.0, xtol=1e-10) - printed) < 6e-6


def test_polynomial_broadcasts_over_speed_and_stiffness() -> None:
    par = {**THESIS, "omega_bar": 0.8}
    U, N = np.array([2.0, 3.0, 4.0])[:, None], np.array([1.0, 0.8 + 0.1j])
    for module, lags in ((section, {"a": JONES[0], "b": JONES[1]}), (quasi_steady, {})):
        many = module.characteristic_coefficients(**par, **lags, speed=U, stiffness=N)
        B = module.impedance(**par, **lags, speed=U, stiffness=N, p=0.1 + 0.3j)
        assert B.shape == (3, 2, 2, 2)
        for i, j in np.ndindex(3, 2):
            given_ = {"speed": float(U[i, 0]), "stiffness": complex(N[j])}
            one = module.characteristic_coefficients(**par, **lags, **given_)
            np.testing.assert_array_equal(many[:, i, j], one)
            np.testing.assert_array_equal(
                B[i, j], module.impedance(**par, **lags, **given_, p=0.1 + 0.3j)
            )
    real = section.characteristic_coefficients(**par, a=[], b=[], speed=2.0, stiffness=1)
    assert real.dtype == np.float64


def test_no_terms_is_lift_without_lag() -> None:
    assert loads.wagner(np.array([0.0, 3.0]), [], []).tolist() == [1.0, 1.0]
    assert loads.wagner(0.0, *JONES) == 0.5
    assert loads.lift_deficiency(0.0, *JONES) == 1.0


@given(
    mu=st.floats(2.0, 300.0),
    x_alpha=st.floats(0.02, 0.45),
    r_alpha=st.floats(0.5, 1.0),
    omega_bar=st.floats(0.0, 2.0),
    stiffness=st.floats(0.1, 3.0),
)
def test_quasi_steady_flutter_speed(
    mu: float, x_alpha: float, r_alpha: float, omega_bar: float, stiffness: float
) -> None:
    """The formula in print, and a root of the discriminant: the larger 1/U^2 of the two."""
    U = quasi_steady.flutter_speed(mu, x_alpha, r_alpha, omega_bar, stiffness)
    root = np.sqrt(stiffness * (1 - x_alpha**2 / r_alpha**2))
    printed = mu * r_alpha**2 / (2 * x_alpha)
    printed *= stiffness + omega_bar**2 - 2 * omega_bar * root
    assert np.isclose(U**2, printed, rtol=1e-11)
    d = quasi_steady.discriminant_coefficients(mu, -0.5, x_alpha, r_alpha, omega_bar, stiffness)
    X = 1 / U**2
    assert abs(np.polyval(d, X)) < 1e-12 * np.polyval(np.abs(d), X)
    # a quadratic in 1/U^2 of positive leading coefficient, rising through its larger root
    assert np.polyval(np.polyder(d), X) >= -1e-12 * np.polyval(np.abs(np.polyder(d)), X)


def test_frequencies_meet_at_the_flutter_speed() -> None:
    par = {**THESIS, "omega_bar": 0.2}
    U = float(quasi_steady.flutter_speed(100.0, 0.25, 0.5, 0.2, 1.0))
    below = np.linalg.eigvals(_closed(quasi_steady, par, {}, 0.999 * U, 1.0))
    above = np.linalg.eigvals(_closed(quasi_steady, par, {}, 1.001 * U, 1.0))
    assert np.abs(below.real).max() < 1e-12
    assert above.real.max() > 1e-3
    assert np.isnan(quasi_steady.flutter_speed(100.0, 0.0, 0.5, 0.2, 1.0))
    assert np.isnan(quasi_steady.flutter_speed(100.0, -0.1, 0.5, 0.2, np.ones(3))).all()
