"""Karpel's minimum-state form: ``D``, ``E`` and the lag roots of least error, all at once."""

from __future__ import annotations

import numpy as np

from aeroflutter.model.elsewhere.least_squares import Problem
from aeroflutter.model.system import Real

__all__ = ["minimum_state"]

_TURNS = 30  # of alternating least squares before all unknowns move together
_ROUNDS = 60


def minimum_state(problem: Problem, roots: Real, *, keep: bool) -> tuple[Real, Real, Real]:
    """``D`` (n, l), ``E`` (l, n) and roots (l,), ascending.

    Parameters
    ----------
    problem : Problem
    roots : array (l,)
        Where the search begins.
    keep : bool
        Whether the roots stay as they are.
    """
    n, count = problem.forces.modes, len(roots)
    if count == 0:
        return np.zeros((n, 0)), np.zeros((0, n)), roots
    D, E, found = _Search(problem, roots, keep).solved()
    touched = np.any(problem.forces.Q, axis=(0, 2)), np.any(problem.forces.Q, axis=(0, 1))
    order = np.argsort(found)
    return D[:, order] * touched[0][:, None], E[order] * touched[1], found[order]


class _Search:
    """Least squares over all unknowns, from alternating least squares.

    What the polynomial can take is projected out, constraints included: it is linear in the values.
    """

    def __init__(self, problem: Problem, roots: Real, keep: bool) -> None:
        self.problem, self.roots, self.keep = problem, roots, keep
        self.n = problem.forces.modes
        left = problem.residual(problem.polynomial(), np.eye(len(problem.values)))
        _u, s, vh = np.linalg.svd(left)
        kept = s > 1e-10 * s[0]
        self.left = s[kept, None] * vh[kept]  # of the same norm as `left` gives, and fewer rows
        self.target = (self.left @ problem.values).reshape(-1, self.n, self.n)
        self.weight = 1.0 / problem.scales

    def solved(self) -> tuple[Real, Real, Real]:
        """The matrices and the roots."""
        from scipy.optimize import least_squares

        D, E = self._alternated(self.roots)
        logs = np.empty(0) if self.keep else np.log(self.roots)
        low, high = self.problem.reach
        far = np.full(D.size + E.size, np.inf)
        best = least_squares(
            self._error,
            np.concatenate([D.ravel(), E.ravel(), np.clip(logs, low + 1e-6, high - 1e-6)]),
            jac=self._slopes,
            bounds=(
                np.concatenate([-far, np.full(logs.size, low)]),
                np.concatenate([far, np.full(logs.size, high)]),
            ),
            max_nfev=_ROUNDS,
            ftol=1e-5,
        )
        return self._split(best.x)

    def _split(self, x: Real) -> tuple[Real, Real, Real]:
        size = self.n * len(self.roots)
        roots = self.roots if self.keep else np.exp(x[2 * size :])
        return x[:size].reshape(self.n, -1), x[size : 2 * size].reshape(-1, self.n), roots

    def _error(self, x: Real) -> Real:
        D, E, roots = self._split(x)
        phi = self.left @ self.problem.lag(roots)
        difference = np.einsum("pr,ir,rj->pij", phi, D, E) - self.target
        return np.asarray((self.weight * difference).ravel())

    def _slopes(self, x: Real) -> Real:
        D, E, roots = self._split(x)
        phi = self.left @ self.problem.lag(roots)
        p, n, unit = len(phi), self.n, np.eye(self.n)
        parts = [
            np.einsum("pr,rj,ia,ij->pijar", phi, E, unit, self.weight).reshape(p, n, n, -1),
            np.einsum("pr,ir,ja,ij->pijra", phi, D, unit, self.weight).reshape(p, n, n, -1),
        ]
        if not self.keep:
            step = 1e-6
            rise = self.problem.lag(roots * np.exp(step)) - self.problem.lag(roots * np.exp(-step))
            change = self.left @ rise / (2 * step)
            parts.append(np.einsum("pr,ir,rj,ij->pijr", change, D, E, self.weight))
        return np.concatenate(parts, axis=-1).reshape(p * n * n, -1)

    def _alternated(self, roots: Real) -> tuple[Real, Real]:
        """``E`` by the leading singular vectors of Roger's matrices first, then each in turn."""
        phi = self.left @ self.problem.lag(roots)
        lags = np.linalg.lstsq(phi, self.target.reshape(len(phi), -1))[0]
        E = np.array([np.linalg.svd(matrix.reshape(self.n, self.n))[2][0] for matrix in lags])
        D = np.zeros((self.n, len(roots)))
        for _ in range(_TURNS):
            for i in range(self.n):
                columns = self.weight[i, :, None] * np.einsum("pr,rj->pjr", phi, E)
                D[i] = _least(columns, self.weight[i] * self.target[:, i, :])
            for j in range(self.n):
                columns = self.weight[:, j, None] * np.einsum("pr,ir->pir", phi, D)
                E[:, j] = _least(columns, self.weight[:, j] * self.target[:, :, j])
            size = np.linalg.norm(E, axis=1)
            E /= np.where(size > 0, size, 1.0)[:, None]
            D *= size
        return D, E


def _least(columns: Real, values: Real) -> Real:
    flat = columns.reshape(-1, columns.shape[-1])
    return np.asarray(np.linalg.lstsq(flat, values.ravel())[0])
