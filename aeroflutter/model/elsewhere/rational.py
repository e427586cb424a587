"""Rational approximations of aerodynamic forces that are tabulated over reduced frequency.

``Q(ik) ≈ A0 + A1 (ik) + A2 (ik)^2 + D diag(ik/(ik + b)) E``

Roger (AGARD CP-228, 1977) gives every lag root ``b_j`` a full matrix: ``D`` holds the ``A_{j+2}``
side by side and ``E`` identities. Karpel's minimum state (AIAA J. 20(2), 1982) has one column of
``D`` and one row of ``E`` a root, so that a root costs one state instead of one a mode.

Everything but the roots enters Roger's form linearly, so the roots alone are searched (variable
projection: Golub & Pereyra, SIAM J. Numer. Anal. 10(2), 1973). Equality constraints are eliminated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aeroflutter.errors import InputError
from aeroflutter.model.system import Complex, Real

__all__ = ["Fit", "FitOptions", "TabulatedForces", "fit"]

_NEGLIGIBLE = 1e-12  # of the largest force: written by a solver as zero
_SMALL = 1e-3  # of its row and column: an entry that need not be fitted relative to itself
_FAR = 8.0  # logarithm of a share of what is free between roots
_ROUNDS = 40  # of the search for lag roots, from each start
_APART = np.log(1.25)  # neighbouring roots nearer than that only cancel one another
_LARGE = 0.05  # relative error of a fit at one k that is worth a warning


@dataclass(frozen=True, eq=False)
class TabulatedForces:
    """Generalised aerodynamic forces over reduced frequency.

    Parameters
    ----------
    k : array (p,)
        Reduced frequencies ``omega b/V``, strictly increasing, not negative.
    Q : complex array (p, n, n)
        Forces ``½ rho V² Q q`` of harmonic motion of the coordinates ``q``, for the sign of
        ``exp(i omega t)``. What is smaller than 1e-12 of the largest is taken for zero.

    Raises
    ------
    InputError
        If shapes do not fit, an entry is not finite, or ``k`` does not increase.
    """

    k: Real
    Q: Complex

    def __post_init__(self) -> None:
        k, Q = np.atleast_1d(np.array(self.k, dtype=float)), np.array(self.Q, dtype=complex)
        problems = []
        if Q.ndim != 3 or Q.shape[1] != Q.shape[2] or k.shape != Q.shape[:1] or k.size < 2:
            problems.append(
                f"k, Q: need shapes (p,) and (p, n, n), p at least 2, got {k.shape} and {Q.shape}"
            )
        if not np.all(np.isfinite(k)) or np.any(k < 0) or np.any(np.diff(k) <= 0):
            problems.append("k: must be finite, not negative and strictly increasing")
        if not np.all(np.isfinite(Q)):
            problems.append("Q: every entry must be finite")
        elif not np.any(Q):
            problems.append("Q: must not be zero everywhere")
        if problems:
            raise InputError(problems)
        size = np.abs(Q).max(axis=0)
        Q[:, size < _NEGLIGIBLE * size.max()] = 0.0
        object.__setattr__(self, "k", k)
        object.__setattr__(self, "Q", Q)

    @property
    def modes(self) -> int:
        """Number of coordinates."""
        return int(self.Q.shape[1])


@dataclass(frozen=True, kw_only=True)
class FitOptions:
    """How :func:`fit` approximates.

    Parameters
    ----------
    method : str
        ``"roger"`` or ``"minimum-state"``.
    lags : int or sequence of float
        How many lag roots, optimised; or the roots themselves, kept. Four by default, eight for
        the minimum state.
    exact : sequence of float
        Reduced frequencies of the table at which the fit is exact: the real part at ``k = 0``,
        both parts elsewhere. At most one beside 0.
    apparent_mass : bool
        Whether there is a term ``A2 (ik)^2``.
    weights : sequence of float, optional
        One a ``k`` of the table, not negative; one everywhere by default.

    Raises
    ------
    InputError
        Names the option that is out of range.
    """

    method: Literal["roger", "minimum-state"] = "roger"
    lags: int | Sequence[float] | None = None
    exact: Sequence[float] = ()
    apparent_mass: bool = True
    weights: Sequence[float] | None = None

    def __post_init__(self) -> None:
        problems = []
        if self.method not in ("roger", "minimum-state"):
            problems.append(f'method: must be "roger" or "minimum-state", got {self.method!r}')
        if isinstance(self.lags, int):
            if not 0 <= self.lags <= 30:
                problems.append(f"lags: must be a number from 0 to 30, got {self.lags!r}")
        elif self.lags is not None:
            roots = np.asarray(self.lags, dtype=float)
            if not (roots.ndim == 1 and np.all(np.isfinite(roots) & (roots > 0))):
                problems.append("lags: the roots must be positive finite numbers")
            elif np.unique(roots).size < roots.size:
                problems.append("lags: no root may come twice")
        if sum(value > 0 for value in self.exact) > 1 or any(value < 0 for value in self.exact):
            problems.append("exact: give 0, one reduced frequency of the table, or both")
        if problems:
            raise InputError(problems)

    @property
    def count(self) -> int:
        """How many lag roots."""
        if self.lags is None:
            return 4 if self.method == "roger" else 8
        return self.lags if isinstance(self.lags, int) else len(self.lags)


@dataclass(frozen=True, kw_only=True, eq=False)
class Fit:
    """A rational approximation and what it approximates.

    Attributes
    ----------
    forces : TabulatedForces
    method : str
    A0, A1, A2 : array (n, n)
    D : array (n, l)
    roots : array (l,)
        Lag roots, one a lag state: Roger's come once a mode.
    E : array (l, n)
    exact : tuple of float
        Where it is exact by constraint.
    """

    forces: TabulatedForces
    method: str
    A0: Real
    A1: Real
    A2: Real
    D: Real
    roots: Real
    E: Real
    exact: tuple[float, ...] = ()

    def __call__(self, k: ArrayLike) -> Complex:
        """``Q(ik)`` (…, n, n) at reduced frequencies of any shape."""
        s = 1j * np.asarray(k, dtype=float)[..., None, None]
        lag = s[..., 0] / (s[..., 0] + self.roots)
        value: Complex = self.A0 + s * self.A1 + s**2 * self.A2 + (self.D * lag[..., None, :]) @ (
            self.E
        )
        return value

    @cached_property
    def errors(self) -> Real:
        """Relative error at every k of the table (p,), in the Frobenius norm.

        The norm of the difference over that of the table at this ``k``.
        """
        size = np.linalg.norm(self.forces.Q, axis=(1, 2))
        difference = np.linalg.norm(self(self.forces.k) - self.forces.Q, axis=(1, 2))
        return np.asarray(difference / np.where(size > 0, size, 1.0))

    @property
    def distinct_roots(self) -> Real:
        """The lag roots, each once."""
        return np.unique(self.roots)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is to be said of a fit that is not good."""
        worst = int(np.argmax(self.errors))
        if self.errors[worst] < _LARGE:
            return ()
        count = int(np.sum(self.errors >= _LARGE))
        return (
            f"the approximation is off by {self.errors[worst]:.1%} at k = "
            f"{self.forces.k[worst]:g} (more than {_LARGE:.0%} at {count} of "
            f"{self.errors.size}); give more lags, or weights",
        )


def fit(forces: TabulatedForces, options: FitOptions | None = None) -> Fit:
    """Approximate tabulated forces by a rational function with optimised lag roots.

    Parameters
    ----------
    forces : TabulatedForces
    options : FitOptions, optional

    Raises
    ------
    InputError
        If an exact ``k`` is not in the table, the weights do not fit, or there are more unknowns
        than the table determines.
    """
    options = options or FitOptions()
    problem = _Problem(forces, options)
    if options.lags is None or isinstance(options.lags, int):
        roots = problem.best_roots(options.count)
    else:
        roots = np.sort(np.asarray(options.lags, dtype=float))
    make = problem.roger if options.method == "roger" else problem.minimum_state
    return make(roots, keep=not (options.lags is None or isinstance(options.lags, int)))


class _Problem:
    """Linear least squares over real and imaginary parts, equality constraints eliminated.

    Rows of the basis are real parts, then imaginary parts, at every ``k``; columns of the right
    side are the entries of ``Q``.
    """

    def __init__(self, forces: TabulatedForces, options: FitOptions) -> None:
        self.forces, self.options = forces, options
        k = forces.k
        weights = np.ones(k.size) if options.weights is None else np.asarray(options.weights)
        problems = []
        if weights.shape != k.shape or not np.all(np.isfinite(weights) & (weights >= 0)):
            problems.append(f"weights: need {k.size} numbers, none negative, one a k")
        places = [int(np.argmin(np.abs(k - value))) for value in options.exact]
        for value, place in zip(options.exact, places, strict=True):
            if abs(k[place] - value) > 1e-9 * max(1.0, value):
                problems.append(f"exact: k = {value:g} is not in the table")
        if 2 * k.size < self.polynomials + options.count:
            problems.append(
                f"lags: {options.count} are more than {k.size} reduced frequencies determine"
            )
        if problems:
            raise InputError(problems)
        flat = forces.Q.reshape(k.size, -1)
        self.values = np.concatenate([flat.real, flat.imag])
        self.rows = np.concatenate([weights, weights]) / _sizes(forces)
        self.fixed = [i for i in places] + [
            i + k.size for i, value in zip(places, options.exact, strict=True) if value > 0
        ]
        self.scales = _scales(np.abs(forces.Q).max(axis=0)).ravel()

    @property
    def polynomials(self) -> int:
        """Number of terms without lag."""
        return 3 if self.options.apparent_mass else 2

    def polynomial(self) -> Real:
        """Columns of ``1, ik`` and, where there is one, ``(ik)^2``."""
        k, zero = self.forces.k, np.zeros(self.forces.k.size)
        real, imaginary = [np.ones(k.size), zero, -(k**2)], [zero, k, zero]
        return np.concatenate([np.stack(real, 1), np.stack(imaginary, 1)])[:, : self.polynomials]

    def lag(self, roots: Real) -> Real:
        """Columns of ``ik/(ik + b)``."""
        k, b = self.forces.k[:, None], roots[None, :]
        size = k**2 + b**2
        return np.concatenate([k**2 / size, k * b / size])

    def solve(self, basis: Real, values: Real) -> Real:
        """Coefficients (columns of the basis, entries), constraints kept."""
        scale = np.linalg.norm(basis, axis=0)
        scaled = basis / np.where(scale > 0, scale, 1.0)
        target = values
        if not self.fixed:
            found = np.linalg.lstsq(self.rows[:, None] * scaled, self.rows[:, None] * target)[0]
            return np.asarray(found / scale[:, None])
        held = scaled[self.fixed]
        particular = np.linalg.pinv(held) @ values[self.fixed]
        free = _null(held)
        rest = self.rows[:, None] * (target - scaled @ particular)
        found = particular + free @ np.linalg.lstsq(self.rows[:, None] * (scaled @ free), rest)[0]
        return np.asarray(found / scale[:, None])

    def residual(self, basis: Real, values: Real) -> Real:
        """What the best coefficients leave, weighted."""
        return np.asarray(self.rows[:, None] * (values - basis @ self.solve(basis, values)))

    @cached_property
    def compressed(self) -> Real:
        """Right sides of the same sum of squares as all entries, each relative to its largest.

        At most as many as there are rows: the residual is linear in them.
        """
        values = self.values / self.scales
        u, s, _ = np.linalg.svd(values, full_matrices=False)
        keep = s > 1e-13 * s[0]
        return np.asarray(u[:, keep] * s[keep])

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
            return np.exp(low + free * before + apart * np.arange(count))

        def left(x: Real) -> Real:
            basis = np.hstack([polynomial, self.lag(roots(x))])
            return self.residual(basis, values).ravel()

        starts = [np.zeros(count + 1) for _ in range(3)]
        starts[1][-1] = starts[2][0] = np.log(2.0 * count)  # crowded low, crowded high
        found = [
            least_squares(left, x, bounds=(-_FAR, _FAR), max_nfev=_ROUNDS, ftol=1e-6)
            for x in starts
        ]
        best = min(found, key=lambda result: result.cost)
        return roots(best.x)

    @property
    def reach(self) -> tuple[float, float]:
        """Logarithms between which lag roots are searched: where the table tells them apart."""
        k = self.forces.k[self.forces.k > 0]
        return float(np.log(0.5 * max(k[0], 1e-3 * k[-1]))), float(np.log(2.0 * k[-1]))

    def roger(self, roots: Real, *, keep: bool) -> Fit:
        """Roger's form with these roots, each once a mode."""
        n, terms = self.forces.modes, self.polynomials
        basis = np.hstack([self.polynomial(), self.lag(roots)])
        matrices = self.solve(basis, self.values).reshape(-1, n, n)
        lags = matrices[terms:]
        return Fit(
            forces=self.forces,
            method="roger",
            **self.steady(matrices),
            D=np.hstack([*lags]) if len(lags) else np.zeros((n, 0)),
            roots=np.repeat(roots, n),
            E=np.vstack([np.eye(n)] * len(roots)) if len(roots) else np.zeros((0, n)),
            exact=tuple(self.options.exact),
        )

    def steady(self, matrices: Real) -> dict[str, Real]:
        """``A0``, ``A1`` and ``A2`` among the matrices found."""
        zero = np.zeros_like(matrices[0])
        return {
            "A0": matrices[0],
            "A1": matrices[1],
            "A2": matrices[2] if self.options.apparent_mass else zero,
        }

    def minimum_state(self, roots: Real, *, keep: bool) -> Fit:
        """Karpel's form, from these roots on; `keep` leaves them as they are."""
        n = self.forces.modes
        D, E, roots = _MinimumState(self, roots, keep).solved()
        lag = np.einsum("pr,ir,rj->pij", self.lag(roots), D, E).reshape(len(self.values), -1)
        matrices = self.solve(self.polynomial(), self.values - lag).reshape(-1, n, n)
        return Fit(
            forces=self.forces,
            method="minimum-state",
            **self.steady(matrices),
            D=D,
            roots=roots,
            E=E,
            exact=tuple(self.options.exact),
        )


class _MinimumState:
    """``D``, ``E`` and the roots of least error, all at once, from alternating least squares."""

    def __init__(self, problem: _Problem, roots: Real, keep: bool) -> None:
        self.problem, self.roots, self.keep = problem, roots, keep
        self.n = problem.forces.modes
        polynomial = problem.polynomial()
        identity = np.eye(len(problem.values))
        # what the polynomial cannot take, as a matrix: it is linear in the values
        self.left = problem.residual(polynomial, identity)
        self.target = (self.left @ problem.values).reshape(-1, self.n, self.n)
        self.weight = (1.0 / problem.scales).reshape(self.n, self.n)
        u, s, _ = np.linalg.svd(self.left)
        self.reduced = (u[:, s > 1e-10 * s[0]]).T

    def solved(self) -> tuple[Real, Real, Real]:
        """The matrices and the roots."""
        from scipy.optimize import least_squares

        count = len(self.roots)
        if count == 0:
            return np.zeros((self.n, 0)), np.zeros((0, self.n)), self.roots
        D, E = self._alternated(self.roots)
        start = np.concatenate([D.ravel(), E.ravel(), *([] if self.keep else [np.log(self.roots)])])
        best = least_squares(self._error, start, jac=self._slopes, method="trf", max_nfev=200)
        D, E, roots = self._split(best.x)
        order = np.argsort(roots)
        return D[:, order], E[order], roots[order]

    def _split(self, x: Real) -> tuple[Real, Real, Real]:
        size = self.n * len(self.roots)
        roots = self.roots if self.keep else np.exp(x[2 * size :])
        return x[:size].reshape(self.n, -1), x[size : 2 * size].reshape(-1, self.n), roots

    def _error(self, x: Real) -> Real:
        D, E, roots = self._split(x)
        phi = self.reduced @ self.left @ self.problem.lag(roots)
        target = np.tensordot(self.reduced, self.target, 1)
        return np.asarray(
            (self.weight * (np.einsum("pr,ir,rj->pij", phi, D, E) - target)).ravel()
        )

    def _slopes(self, x: Real) -> Real:
        D, E, roots = self._split(x)
        phi = self.reduced @ self.left @ self.problem.lag(roots)
        p, n, count = len(phi), self.n, len(roots)
        unit = np.eye(n)
        parts = [
            np.einsum("pr,rj,ia,ij->pijar", phi, E, unit, self.weight).reshape(p, n, n, -1),
            np.einsum("pr,ir,ja,ij->pijra", phi, D, unit, self.weight).reshape(p, n, n, -1),
        ]
        if not self.keep:
            step = 1e-6
            rise = self.problem.lag(roots * np.exp(step)) - self.problem.lag(roots * np.exp(-step))
            change = self.reduced @ self.left @ rise / (2 * step)
            parts.append(np.einsum("pr,ir,rj,ij->pijr", change, D, E, self.weight))
        assert count
        return np.concatenate(parts, axis=-1).reshape(p * n * n, -1)

    def _alternated(self, roots: Real, rounds: int = 30) -> tuple[Real, Real]:
        """Start of the search: E by the singular vectors of Roger's matrices, then in turns."""
        phi = self.left @ self.problem.lag(roots)
        lags = np.linalg.lstsq(phi, self.target.reshape(len(phi), -1))[0]
        E = np.array([np.linalg.svd(m.reshape(self.n, self.n))[2][0] for m in lags])
        D = np.zeros((self.n, len(roots)))
        for _ in range(rounds):
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


def _sizes(forces: TabulatedForces) -> Real:
    """Norms of the real parts, then of the imaginary parts, at every ``k``.

    Forces grow as ``k²`` while flutter happens at low ``k``, where the imaginary part is small and
    is all the damping there is: each part counts by its relative error.
    """
    whole = np.linalg.norm(forces.Q, axis=(1, 2))
    whole = np.where(whole > 0, whole, whole.max())
    parts = [np.linalg.norm(part, axis=(1, 2)) for part in (forces.Q.real, forces.Q.imag)]
    return np.concatenate([np.maximum(part, _SMALL * whole) for part in parts])


def _scales(size: Real) -> Real:
    """What the error of each entry is relative to: its largest value, if it is not tiny.

    An entry below a thousandth of its row and column need not be fitted as closely as they are.
    """
    row, column = size.max(axis=1, keepdims=True), size.max(axis=0, keepdims=True)
    floor = _SMALL * np.sqrt(row * column)
    return np.asarray(np.where(floor > 0, np.maximum(size, floor), size.max()))


def _least(columns: Real, values: Real) -> Real:
    return np.asarray(
        np.linalg.lstsq(columns.reshape(-1, columns.shape[-1]), values.ravel())[0]
    )


def _null(matrix: Real) -> NDArray[Any]:
    """Orthonormal columns that the matrix takes to zero."""
    _, s, vh = np.linalg.svd(matrix)
    rank = int(np.sum(s > 1e-12 * s[0])) if s.size else 0
    return np.asarray(vh[rank:].T)
