"""Eigenvalues of A - N b c for many complex N at each of a few speeds.

With A = V diag(λ) V^-1 and the residues r of G(s) = c (sI - A)^-1 b, they are the zeros of

    p(s) = prod(s - λ_j) (1 + N sum(r_j / (s - λ_j))),

which the iteration of Ehrlich and Aberth finds all at once, from those of the N before it, at a
cost of n² instead of n³. That none is lost is certified by Smith's theorem (J. ACM 17, 1970,
p. 137): all zeros lie in the discs of radius n |w_i| about the approximations z_i, where w_i is
p(z_i) over the product of z_i - z_j, and as many in each group of discs as it has discs. What
cannot be certified is left to LAPACK.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["closed_roots"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_ITERATIONS = 12
_SETTLED = 1e-6  # relative correction after which the next is round-off: convergence is cubic
_CERTAIN = 1e-9  # radius of a disc over the size of its root
_CONDITION = 1e6  # of the eigenvectors (in Frobenius' norm), up to which residues are good
_ASIDE = 1e-6  # by which the first roots are moved off the poles


def closed_roots(A: Array, b: Array, c: Array, group: NDArray[np.intp], N: Complex) -> Complex:
    """Eigenvalues of A - N b c, shape (m, n).

    Parameters
    ----------
    A, b, c
        Systems (g, n, n), (g, n) and the row (n,) they share.
    group, N
        Of every point its system and its N, shapes (m,).
    """
    roots = np.empty((N.size, c.size), dtype=complex)
    certain = np.zeros(N.size, dtype=bool)
    poles, residues, good = _modal(A, b, c)
    size = np.abs(poles)
    last = poles + _ASIDE * 1j * (size + _ASIDE * size.max(axis=1, keepdims=True))
    order = np.lexsort((N.real, group))
    first = np.searchsorted(group[order], np.arange(len(A)))
    rank = np.arange(N.size) - first[group[order]]
    for place in range(rank.max(initial=-1) + 1):  # one N of every system at a time
        points = order[rank == place]
        points = points[good[group[points]]]
        own = group[points]
        found = _iterated(poles[own], residues[own], N[points], last[own])
        sure = _certified(poles[own], residues[own], N[points], found)
        roots[points], certain[points] = found, sure
        last[own[sure]] = found[sure]
    left = np.flatnonzero(~certain)
    if left.size:
        own = group[left]
        closed = A[own] - N[left, None, None] * b[own, :, None] * c
        roots[left] = np.linalg.eigvals(closed)
    return roots


def _modal(A: Array, b: Array, c: Array) -> tuple[Complex, Complex, NDArray[np.bool_]]:
    """Poles and residues of every system (g, n), and whether the residues are good."""
    poles, vectors = np.linalg.eig(A)
    residues, good = np.zeros(poles.shape, dtype=complex), np.zeros(len(A), dtype=bool)
    for i, V in enumerate(vectors):
        try:
            inverse = np.linalg.inv(V)
        except np.linalg.LinAlgError:
            continue
        residues[i] = (c @ V) * (inverse @ b[i])
        good[i] = np.linalg.norm(V) * np.linalg.norm(inverse) < _CONDITION
    return poles.astype(complex), residues, good


def _iterated(poles: Complex, residues: Complex, N: Complex, start: Complex) -> Complex:
    """Zeros of p from a start (m, n) for each N; not finite where the iteration breaks down."""
    z, todo, own = start.copy(), np.arange(N.size), np.arange(start.shape[1])
    with np.errstate(all="ignore"):
        for _ in range(_ITERATIONS):
            at = z[todo]
            q = 1.0 / (at[:, :, None] - poles[todo, None, :])
            terms = N[todo, None, None] * residues[todo, None, :] * q
            slope = -np.einsum("mij,mij->mi", terms, q)
            apart = at[:, :, None] - at[:, None, :]
            apart[:, own, own] = np.inf
            newton = q.sum(axis=2) + slope / (1.0 + terms.sum(axis=2))
            step = 1.0 / (newton - (1.0 / apart).sum(axis=2))
            z[todo] = at - step
            todo = todo[~np.all(np.abs(step) < _SETTLED * np.abs(at), axis=1)]
            if todo.size == 0:
                break
    return z


def _certified(poles: Complex, residues: Complex, N: Complex, z: Complex) -> NDArray[np.bool_]:
    """Where the discs about all roots (m, n) are as small as round-off."""
    own = np.arange(z.shape[1])
    with np.errstate(all="ignore"):
        apart = z[:, :, None] - z[:, None, :]
        apart[:, own, own] = 1.0
        away = z[:, :, None] - poles[:, None, :]
        value = 1.0 + N[:, None] * (residues[:, None, :] / away).sum(axis=2)
        radius = z.shape[1] * np.abs((away / apart).prod(axis=2) * value)
        return np.asarray(np.all(radius < _CERTAIN * np.abs(z), axis=1))
