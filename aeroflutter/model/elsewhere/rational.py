"""Rational approximations of aerodynamic forces that are tabulated over reduced frequency.

``Q(ik) ≈ A0 + A1 (ik) + A2 (ik)^2 + D diag(ik/(ik + b)) E``

Roger (AGARD CP-228, 1977) gives every lag root ``b_j`` a full matrix: ``D`` holds the ``A_{j+2}``
side by side and ``E`` identities. Karpel's minimum state (AIAA J. 20(2), 1982) has one column of
``D`` and one row of ``E`` a root, so that a root costs one state instead of one a mode.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from aeroflutter.errors import InputError
from aeroflutter.model.elsewhere.forces import TabulatedForces
from aeroflutter.model.elsewhere.least_squares import Problem
from aeroflutter.model.elsewhere.minimum_state import minimum_state
from aeroflutter.model.system import Complex, Real

__all__ = ["Fit", "FitOptions", "fit"]

MOST_LAGS = 30
LEAST = 1e-9  # size of a lag root, and over it the largest
_LARGE = 0.05  # relative error of a fit at one k that is worth a warning


@dataclass(frozen=True, kw_only=True)
class FitOptions:
    """How :func:`fit` approximates.

    Parameters
    ----------
    method : str
        ``"roger"`` or ``"minimum-state"``.
    lags : int or sequence of float, optional
        How many lag roots, optimised; or the roots themselves, kept. Six by default, ten for
        the minimum state.
    exact : sequence of float
        Reduced frequencies of the table at which the fit is exact: the real part at ``k = 0``
        (extrapolated where the table begins near it), both parts elsewhere. At most one beside 0.
    emphasis : sequence of float
        Reduced frequencies at which it is to be close, such as those of flutter by the p-k
        method. Forces between those of the table are splined.
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
    emphasis: Sequence[float] = ()
    apparent_mass: bool = True
    weights: Sequence[float] | None = None

    def __post_init__(self) -> None:
        problems = []
        if self.method not in ("roger", "minimum-state"):
            problems.append(f'method: must be "roger" or "minimum-state", got {self.method!r}')
        if isinstance(self.lags, int):
            if not 0 <= self.lags <= MOST_LAGS:
                problems.append(f"lags: must be 0 to {MOST_LAGS} of them, got {self.lags!r}")
        elif self.lags is not None:
            roots = np.asarray(self.lags, dtype=float)
            if not (roots.ndim == 1 and np.all((roots >= LEAST) & (roots <= 1.0 / LEAST))):
                problems.append(
                    f"lags: the roots must be positive numbers, {LEAST:g} to {1.0 / LEAST:g}"
                )
            elif np.unique(roots).size < roots.size:
                problems.append("lags: no root may come twice")
        if sum(k > 0 for k in self.exact) > 1 or not all(k >= 0 for k in self.exact):
            problems.append("exact: give 0, one reduced frequency of the table, or both")
        if not all(np.isfinite(k) and k >= 0 for k in self.emphasis):
            problems.append("emphasis: reduced frequencies must be finite and not negative")
        if problems:
            raise InputError(problems)

    @property
    def count(self) -> int:
        """How many lag roots."""
        if self.lags is None:
            return 6 if self.method == "roger" else 10
        return self.lags if isinstance(self.lags, int) else len(self.lags)

    @property
    def roots(self) -> Real | None:
        """The lag roots, where they are given."""
        if self.lags is None or isinstance(self.lags, int):
            return None
        return np.sort(np.asarray(self.lags, dtype=float))


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
        Lag roots, one a lag state: Roger's come once a mode that has air forces.
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
        lagging = (self.D * lag[..., None, :]) @ self.E
        value: Complex = self.A0 + s * self.A1 + s**2 * self.A2 + lagging
        return value

    @cached_property
    def errors(self) -> Real:
        """Relative error at every k of the table (p,), in the Frobenius norm.

        The norm of the difference over that of the table at this ``k``.
        """
        size = np.linalg.norm(self.forces.Q, axis=(1, 2))
        difference = np.linalg.norm(self(self.forces.k) - self.forces.Q, axis=(1, 2))
        return np.asarray(difference / np.where(size > 0, size, size.max()))

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
            f"{self.forces.k[worst]:g} and by more than {_LARGE:.0%} at {count} of "
            f"{self.errors.size} reduced frequencies; give more lags, weights or an emphasis",
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

    Notes
    -----
    The sum of squares has the real and the imaginary part of every ``k`` relative to their size,
    since the imaginary part is small at low ``k`` and is all the damping there is. Nothing is known
    of the fit beyond the table, where it may even excite modes.
    """
    options = options or FitOptions()
    problem = Problem(
        forces,
        count=options.count,
        exact=options.exact,
        emphasis=options.emphasis,
        weights=options.weights,
        apparent_mass=options.apparent_mass,
    )
    given = options.roots
    roots = problem.best_roots(options.count) if given is None else given
    if options.method == "roger":
        matrices, D, roots, E = _roger(problem, roots)
    else:
        D, E, roots = minimum_state(problem, roots, keep=given is not None)
        matrices = problem.polynomial_matrices(problem.lagging(D, E, roots))
    A0, A1, A2 = matrices
    return Fit(
        forces=forces,
        method=options.method,
        A0=A0,
        A1=A1,
        A2=A2,
        D=D,
        roots=roots,
        E=E,
        exact=tuple(options.exact),
    )


def _roger(problem: Problem, roots: Real) -> tuple[Sequence[Real], Real, Real, Real]:
    """Matrices of the polynomial, ``D``, roots and ``E``; no states of modes without forces."""
    *steady, lags = problem.all_matrices(roots)
    n = len(steady[0])
    D = np.hstack([np.zeros((n, 0)), *lags])
    E = np.vstack([np.zeros((0, n)), *(np.eye(n) for _ in lags)])
    felt = np.any(D, axis=0)
    return steady, D[:, felt], np.repeat(roots, n)[felt], E[felt]
