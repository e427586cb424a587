"""The least squares of rational approximations: linear coefficients, searched lag roots.

Everything but the lag roots enters linearly, so the roots alone are searched (variable projection:
Golub & Pereyra, SIAM J. Numer. Anal. 10(2), 1973). Equality constraints are eliminated.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from aeroflutter.errors import InputError
from aeroflutter.model.elsewhere.forces import TabulatedForces
from aeroflutter.model.system import Real

__all__ = ["Problem"]

_SMALL = 1e-3  # of its row and column: an entry that need not be fitted relative to itself
_EMPHASIS = 1000.0  # weight of a reduced frequency at which the fit is to be close
_STEADY = 0.05  # of the largest k: a smallest one from which the steady forces are extrapolated
_APART = float(np.log(1.25))  # neighbouring roots nearer than that only cancel one another
_FAR = 8.0  # logarithm of a share of what is free between roots
_ROUNDS = 40  # of the search for lag roots, from each start


class Problem:
    """A table as a linear least-squares problem for the coefficients of given lag roots.

    Rows are real parts, then imaginary parts, at every reduced frequency that counts; columns of
    the basis are the terms of the approximation, those of the values the entries of ``Q``.

    Parameters
    ----------
    forces : TabulatedForces
    count : int
        Lag roots.
    exact, emphasis, weights, apparent_mass
        As in :class:`~aeroflutter.model.elsewhere.rational.FitOptions`.

    Raises
    ------
    InputError
        If an exact ``k`` is not in the table, the weights do not fit, or there are more unknowns
        than the table determines.
    """

    def __init__(
        self,
        forces: TabulatedForces,
        *,
        count: int,
        exact: Sequence[float] = (),
        emphasis: Sequence[float] = (),
        weights: Sequence[float] | None = None,
        apparent_mass: bool = True,
    ) -> None:
        self.forces, self.apparent_mass = forces, apparent_mass
        places = [int(np.argmin(np.abs(forces.k - value))) for value in exact]
        own = np.ones(forces.k.size) if weights is None else np.asarray(weights, dtype=float)
        problems = _problems(forces, own, exact, places)
        if 2 * forces.k.size < (3 if apparent_mass else 2) + count:
            problems.append(
                f"lags: {count} are more than {forces.k.size} reduced frequencies determine"
            )
        if problems:
            raise InputError(problems)
        added = dict.fromkeys(map(float, emphasis), _EMPHASIS)
        if 0.0 in exact and forces.k[0] > 0:
            places[list(exact).index(0.0)] = forces.k.size + len(added)
            added[0.0] = 0.0
        self.k = np.concatenate([forces.k, [*added]])
        Q = np.concatenate([forces.Q, *(forces.at([k]) for k in added)])
        weight = np.concatenate([own, [*added.values()]])
        flat = Q.reshape(self.k.size, -1)
        self.values: Real = np.concatenate([flat.real, flat.imag])
        self.rows: Real = np.concatenate([weight, weight]) / _sizes(self.values, self.k.size)
        self.fixed = places + [
            place + self.k.size for place, value in zip(places, exact, strict=True) if value > 0
        ]
        self.scales: Real = _scales(np.abs(forces.Q).max(axis=0))

    def polynomial(self) -> Real:
        """Columns of ``1, ik`` and, where there is one, ``(ik)^2``."""
        k, zero = self.k, np.zeros(self.k.size)
        real, imaginary = [np.ones(k.size), zero, -(k**2)], [zero, k, zero]
        whole = np.concatenate([np.stack(real, 1), np.stack(imaginary, 1)])
        return whole if self.apparent_mass else whole[:, :2]

    def lag(self, roots: Real) -> Real:
        """Columns of ``ik/(ik + b)``."""
        k, b = self.k[:, None], roots[None, :]
        size = k**2 + b**2
        return np.concatenate([k**2 / size, k * b / size])

    def lagging(self, D: Real, E: Real, roots: Real) -> Real:
        """What lag states contribute to the values."""
        return np.einsum("pr,ir,rj->pij", self.lag(roots), D, E).reshape(self.values.shape)

    def solve(self, basis: Real, values: Real) -> Real:
        """Coefficients (columns of the basis, entries), constraints kept."""
        scale = np.linalg.norm(basis, axis=0)
        scaled = basis / np.where(scale > 0, scale, 1.0)
        if not self.fixed:
            found = np.linalg.lstsq(self.rows[:, None] * scaled, self.rows[:, None] * values)[0]
            return np.asarray(found / scale[:, None])
        held = scaled[self.fixed]
        particular = np.linalg.pinv(held) @ values[self.fixed]
        free = _null(held)
        rest = self.rows[:, None] * (values - scaled @ particular)
        found = particular + free @ np.linalg.lstsq(self.rows[:, None] * (scaled @ free), rest)[0]
        return np.asarray(found / scale[:, None])

    def residual(self, basis: Real, values: Real) -> Real:
        """What the best coefficients leave, weighted."""
        return np.asarray(self.rows[:, None] * (values - basis @ self.solve(basis, values)))

    def all_matrices(self, roots: Real) -> tuple[Real, Real, Real, Real]:
        """``A0``, ``A1``, ``A2`` and the matrices of the roots (l, n, n)."""
        n = self.forces.modes
        basis = np.hstack([self.polynomial(), self.lag(roots)])
        found = self.solve(basis, self.values).reshape(-1, n, n)
        if self.apparent_mass:
            return found[0], found[1], found[2], found[3:]
        return found[0], found[1], np.zeros((n, n)), found[2:]

    def polynomial_matrices(self, lagging: Real) -> tuple[Real, Real, Real]:
        """``A0``, ``A1``, ``A2`` beside given lag states."""
        n = self.forces.modes
        found = self.solve(self.polynomial(), self.values - lagging).reshape(-1, n, n)
        return found[0], found[1], found[2] if self.apparent_mass else np.zeros((n, n))

    @cached_property
    def compressed(self) -> Real:
        """Right sides of the same sum of squares as all entries, each relative to its largest.

        At most as many as there are rows: the residual is linear in them.
        """
        u, s, _ = np.linalg.svd(self.values / self.scales.ravel(), full_matrices=False)
        keep = s > 1e-13 * s[0]
        return np.asarray(u[:, keep] * s[keep])

    @property
    def reach(self) -> tuple[float, float]:
        """Logarithms between which lag roots are searched: where the table tells them apart."""
        k = self.forces.k[self.forces.k > 0]
        return float(np.log(0.5 * max(k[0], 1e-3 * k[-1]))), float(np.log(2.0 * k[-1]))

    def best_roots(self, count: int) -> Real:
        """Lag roots of the least error of Roger's form, each entry relative to its largest."""
        from scipy.optimize import least_squares

        if count == 0:
            return np.empty(0)
        polynomial, values = self.polynomial(), self.compressed
        low, high = self.reach
        apart = min(_APART, (high - low) / count)
        free = high - low - apart * (count - 1)

        def roots(x: Real) -> Real:
            """Any numbers as roots in reach and apart: pieces of what is free, in turn."""
            pieces = np.exp(x - x.max())
            before = np.cumsum(pieces)[:-1] / pieces.sum()
            return np.asarray(np.exp(low + free * before + apart * np.arange(count)))

        def left(x: Real) -> Real:
            return self.residual(np.hstack([polynomial, self.lag(roots(x))]), values).ravel()

        starts = [np.zeros(count + 1) for _ in range(3)]
        starts[1][-1] = starts[2][0] = np.log(2.0 * count)  # crowded low, crowded high
        found = [
            least_squares(left, x, bounds=(-_FAR, _FAR), max_nfev=_ROUNDS, ftol=1e-6)
            for x in starts
        ]
        return roots(min(found, key=lambda result: float(result.cost)).x)


def _problems(
    forces: TabulatedForces, weights: Real, exact: Sequence[float], places: Sequence[int]
) -> list[str]:
    problems = []
    if weights.shape != forces.k.shape or not np.all(np.isfinite(weights) & (weights >= 0)):
        problems.append(f"weights: need {forces.k.size} numbers, none negative, one a k")
    elif not np.any(weights):
        problems.append("weights: must not all be zero")
    for value, place in zip(exact, places, strict=True):
        if value == 0 and forces.k[0] > _STEADY * forces.k[-1]:
            problems.append(f"exact: the table begins at k = {forces.k[0]:g}, too far from 0")
        elif value > 0 and abs(forces.k[place] - value) > 1e-9 * max(1.0, value):
            problems.append(f"exact: k = {value:g} is not in the table")
    return problems


def _sizes(values: Real, count: int) -> Real:
    """Norms of the real parts, then of the imaginary parts, at every reduced frequency."""
    parts = np.linalg.norm(values, axis=1)
    whole = np.hypot(parts[:count], parts[count:])
    whole = np.where(whole > 0, whole, whole.max())
    return np.maximum(parts, _SMALL * np.tile(whole, 2))


def _scales(size: Real) -> Real:
    """What the error of each entry is relative to (n, n): its largest value, if it is not tiny.

    An entry below a thousandth of its row and column need not be fitted as closely as they are.
    """
    row, column = size.max(axis=1, keepdims=True), size.max(axis=0, keepdims=True)
    floor = _SMALL * np.sqrt(row * column)
    return np.asarray(np.where(floor > 0, np.maximum(size, floor), size.max()))


def _null(matrix: Real) -> Real:
    """Orthonormal columns that the matrix takes to zero."""
    _, s, vh = np.linalg.svd(matrix)
    rank = int(np.sum(s > 1e-12 * s[0])) if s.size else 0
    return np.asarray(vh[rank:].T)
