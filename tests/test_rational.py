"""Rational approximations: exact where they can be, constrained where asked, honest of errors."""

import numpy as np
import pytest

from aeroflutter.errors import InputError
from aeroflutter.model.elsewhere.forces import TabulatedForces
from aeroflutter.model.elsewhere.rational import FitOptions, fit

K = np.array([0.0, 0.05, 0.1, 0.2, 0.35, 0.5, 0.8, 1.2, 2.0, 3.0])


def made(roots, rank=None, seed=0, n=3):
    """A table that is a rational function, of full matrices or of minimum-state form."""
    rng = np.random.default_rng(seed)
    A0, A1, A2 = rng.normal(size=(3, n, n))
    s = 1j * K[:, None, None]
    Q = A0 + s * A1 + s**2 * A2
    for root in roots:
        matrix = rng.normal(size=(n, n))
        if rank:
            matrix = np.outer(rng.normal(size=n), rng.normal(size=n))
        Q = Q + matrix * s / (s + root)
    return TabulatedForces(K, Q)


def test_a_rational_table_is_given_back_with_its_roots():
    forces = made([0.1, 0.7])
    found = fit(forces, FitOptions(lags=2))
    np.testing.assert_allclose(found.distinct_roots, [0.1, 0.7], rtol=1e-3)
    assert found.errors.max() < 1e-4
    exactly = fit(forces, FitOptions(lags=(0.1, 0.7)))
    assert exactly.errors.max() < 1e-11
    assert exactly.warnings == ()


def test_a_minimum_state_table_is_given_back():
    forces = made([0.1, 0.4, 1.1], rank=1)
    found = fit(forces, FitOptions(method="minimum-state", lags=(0.1, 0.4, 1.1)))
    assert len(found.roots) == 3
    assert found.errors.max() < 1e-5
    # Roger's form has as many roots a coordinate
    assert len(fit(forces, FitOptions(lags=(0.1, 0.4, 1.1))).roots) == 9


def irregular():
    """A table that no few roots give: Theodorsen's function in two entries, and a ripple."""
    from scipy.special import kv

    with np.errstate(invalid="ignore"):
        C = kv(1, 1j * K) / (kv(0, 1j * K) + kv(1, 1j * K))
    C[K == 0] = 1.0
    ripple = 1 + 0.05 * np.sin(6 * K)
    Q = np.empty((K.size, 2, 2), dtype=complex)
    Q[:, 0, 0], Q[:, 0, 1] = C * ripple, 2 * C - 0.3 * K**2
    Q[:, 1, 0], Q[:, 1, 1] = 1j * K * C, 0.2 * C.real + 1j * K * 0.4
    return TabulatedForces(K, Q)


@pytest.mark.parametrize("method", ["roger", "minimum-state"])
def test_constraints_hold_to_round_off(method):
    forces = irregular()
    free = fit(forces, FitOptions(method=method, lags=2))
    held = fit(forces, FitOptions(method=method, lags=2, exact=(0.0, 0.2)))
    assert free.errors[[0, 3]].min() > 1e-5
    assert held.errors[[0, 3]].max() < 1e-10
    assert held.exact == (0.0, 0.2)


def test_the_error_falls_with_the_number_of_roots_and_with_weight():
    forces = irregular()
    errors = [np.linalg.norm(fit(forces, FitOptions(lags=n)).errors) for n in (0, 1, 2, 4)]
    assert errors[0] > errors[1] > errors[2] > errors[3]
    weighted = fit(forces, FitOptions(lags=1, weights=[1, 1, 1, 50, 1, 1, 1, 1, 1, 1]))
    plain = fit(forces, FitOptions(lags=1))
    assert weighted.errors[3] < 0.3 * plain.errors[3]
    near = fit(forces, FitOptions(lags=2, emphasis=(0.27,)))
    target = forces.at(0.27)
    assert np.abs(near(0.27) - target).max() < 2e-3 * np.abs(target).max()
    assert "give more lags" in fit(forces, FitOptions(lags=0)).warnings[0]


def test_the_search_finds_no_worse_roots_than_a_grid():
    """Variable projection against every pair of roots of a grid; the sum is that of `fit`."""
    forces = irregular()

    def size(options):
        found = fit(forces, options)
        parts = [(np.real, 0), (np.imag, 0)]
        total = 0.0
        scale = np.abs(forces.Q).max(axis=0)
        for part, _ in parts:
            norm = np.linalg.norm(part(forces.Q), axis=(1, 2))
            whole = np.linalg.norm(forces.Q, axis=(1, 2))
            weight = 1 / np.maximum(norm, 1e-3 * whole)
            error = part(found(K) - forces.Q) / scale
            total += np.sum((weight[:, None, None] * error) ** 2)
        return total

    grid = np.geomspace(0.02, 5.0, 14)
    best = min(size(FitOptions(lags=(a, b))) for a in grid for b in grid if b > 1.3 * a)
    assert size(FitOptions(lags=2)) < 1.05 * best


def test_forces_of_round_off_are_none_and_get_no_states():
    forces = made([0.3])
    Q = forces.Q.copy()
    Q[:, 1, :] *= 1e-16
    Q[:, :, 1] *= 1e-16
    cleaned = TabulatedForces(K, Q)
    assert not cleaned.Q[:, 1].any()
    found = fit(cleaned, FitOptions(lags=2))
    assert len(found.roots) == 4
    assert not found(K)[:, 1].any()
    small = fit(cleaned, FitOptions(method="minimum-state", lags=3))
    assert not small(K)[:, :, 1].any()


def test_between_and_beyond_the_table():
    forces = made([0.3])
    np.testing.assert_allclose(forces.at(K), forces.Q, atol=1e-12)
    step = 1e-6
    for k in (0.15, 0.9, 4.0):
        slope = (forces.at(k + step) - forces.at(k - step)) / (2 * step)
        np.testing.assert_allclose(forces.slope(k), slope, rtol=1e-6, atol=1e-6)
    assert np.abs(forces.at(0.0).imag).max() < 1e-15
    far = forces.at(6.0)
    np.testing.assert_allclose(far.real, 4 * forces.Q[-1].real)
    np.testing.assert_allclose(far.imag, 2 * forces.Q[-1].imag)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"lags": (0.1, 0.1)}, "no root may come twice"),
        ({"lags": (0.1, -1.0)}, "must be positive"),
        ({"lags": 31}, "must be 0 to 30"),
        ({"method": "pade"}, '"roger" or "minimum-state"'),
        ({"exact": (0.1, 0.2)}, "give 0, one reduced frequency"),
        ({"emphasis": (-0.1,)}, "not negative"),
    ],
)
def test_options_say_what_is_wrong(options, words):
    with pytest.raises(InputError, match=words):
        FitOptions(**options)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"exact": (0.15,)}, "k = 0.15 is not in the table"),
        ({"weights": [1.0]}, "need 10 numbers"),
        ({"weights": [0.0] * 10}, "must not all be zero"),
        ({"lags": 20}, "more than 10 reduced frequencies determine"),
    ],
)
def test_fits_that_cannot_be(options, words):
    with pytest.raises(InputError, match=words):
        fit(irregular(), FitOptions(**options))


@pytest.mark.parametrize(
    ("k", "Q", "words"),
    [
        ([0.1, 0.1], np.ones((2, 1, 1)), "strictly increasing"),
        ([0.1, 0.2], np.full((2, 1, 1), np.nan), "must be finite"),
        ([0.1, 0.2], np.ones((2, 2, 1)), r"need shapes \(p,\)"),
        ([0.1, 0.2], np.zeros((2, 1, 1)), "must not be zero"),
    ],
)
def test_tables_that_cannot_be(k, Q, words):
    with pytest.raises(InputError, match=words):
        TabulatedForces(k, Q)
