"""Eigenvalues of rank-one feedback found from poles and residues, against LAPACK's."""

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

from aeroflutter.orbits.describing import secular
from aeroflutter.orbits.describing.secular import closed_roots

N = np.array([1e-3, 0.1, 0.4, 0.4, 0.9, 3.0]) - 1j * np.array([0.0, 0.02, 0.3, 0.0, 0.1, 0.5])


def _unlike(found, A, b, c, group, values):
    """Largest relative distance between roots matched one to one with LAPACK's."""
    worst = 0.0
    for roots, i, value in zip(found, group, values, strict=True):
        exact = np.linalg.eigvals(A[i] - value * np.outer(b[i], c))
        apart = np.abs(roots[:, None] - exact)
        worst = max(worst, apart[linear_sum_assignment(apart)].max() / np.abs(exact).max())
    return worst


def _random(rng, systems, n):
    A, b = rng.normal(size=(systems, n, n)), rng.normal(size=(systems, n))
    return A, b, rng.normal(size=n)


@pytest.mark.parametrize("n", [2, 5, 16, 40])
def test_roots_are_those_of_the_closed_loop(n, monkeypatch):
    rng = np.random.default_rng(n)
    A, b, c = _random(rng, 4, n)
    group = rng.permutation(np.repeat(np.arange(4), N.size))
    values = rng.permutation(np.tile(N, 4))
    assert _unlike(closed_roots(A, b, c, group, values), A, b, c, group, values) < 1e-10
    monkeypatch.setattr(secular, "_CERTAIN", 0.0)  # nothing certain: all is left to LAPACK
    assert _unlike(closed_roots(A, b, c, group, values), A, b, c, group, values) < 1e-10


def test_little_is_left_to_lapack(monkeypatch):
    """Along a describing function most is certified, even of full random matrices."""
    A, b, c = _random(np.random.default_rng(1), 6, 20)
    values = np.linspace(0.02, 1.0, 24) * (1.0 - 0.2j)
    left, lapack = [], np.linalg.eigvals

    def counted(matrices):
        left.append(len(matrices))
        return lapack(matrices)

    monkeypatch.setattr(np.linalg, "eigvals", counted)
    closed_roots(A, b, c, np.repeat(np.arange(6), 24), np.tile(values, 6))
    assert sum(left) < 0.25 * 6 * 24


@pytest.mark.parametrize("kind", ["hidden", "defective", "integrator", "repeated"])
def test_hard_systems(kind):
    """Poles out of reach of the feedback, without eigenvectors, at zero, or equal."""
    rng = np.random.default_rng(3)
    A, b, c = _random(rng, 2, 8)
    if kind == "hidden":
        A[:, :3, 3:] = A[:, 3:, :3] = b[:, :3] = 0.0
    elif kind == "defective":
        A[:, :2, :2], A[:, :2, 2:], A[:, 2:, :2] = [[-1.0, 1.0], [0.0, -1.0]], 0.0, 0.0
    elif kind == "integrator":
        A[:, 0] = 0.0
    else:
        A = np.array([np.diag([-1.0, -1.0, 2, 3, 4, 5, 6, 7])] * 2)
    group, values = np.repeat(np.arange(2), N.size), np.tile(N, 2)
    tolerance = 1e-6 if kind == "defective" else 1e-10
    assert _unlike(closed_roots(A, b, c, group, values), A, b, c, group, values) < tolerance


def test_two_approximations_of_one_root_are_not_certified():
    """A root found twice stands for one that was lost."""
    poles, residues = np.array([[-1.0 + 0j, -2.0, -3.0]]), np.array([[0.1 + 0j, 0.2, 0.3]])
    value, step = np.array([0.5 - 0.1j]), 1e-12
    good = secular._iterated(poles, residues, value, poles + 0.01j)
    assert secular._certified(poles, residues, value, good).all()
    twice = good.copy()
    twice[0, 1] = good[0, 0] + step
    assert not secular._certified(poles, residues, value, twice).any()
