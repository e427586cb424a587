"""Roots of ``pI - A(U) + N B C`` followed over speed by their eigenvectors, never by sorting.

Between two neighbouring speeds every right eigenvector must have one clear partner among the left
ones, or the interval is halved. Only where two roots coalesce do the nearest ones go on.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from aeroflutter.model.lure import AnyFamily, Complex, Real, as_family

__all__ = ["Modes", "Track", "closed_matrices", "follow", "solve_modes"]

_CLEAR = 0.9  # overlap of a mode with its successor that counts as unambiguous
_SPILL = 0.5  # overlap with all the other modes together that is too much
_REAL = 0.01  # |Im p/p| below which a root is one of the real axis
_ROUND_OFF = 4 * np.finfo(float).eps
_DEPTH = 12  # halvings of a search interval before two modes count as coalescing


@dataclass(frozen=True, eq=False)
class Modes:
    """Eigenvalues (m, n), right eigenvectors (m, n, n) and their inverses, over speeds (m,)."""

    speeds: Real
    roots: Complex
    right: Complex
    left: Complex

    def merged(self, other: Modes) -> Modes:
        """Both, by ascending speed."""
        order = np.argsort(np.concatenate([self.speeds, other.speeds]), kind="stable")
        pairs = zip(self._arrays(), other._arrays(), strict=True)
        return Modes(*(np.concatenate(pair)[order] for pair in pairs))

    def _arrays(self) -> tuple[NDArray[Any], ...]:
        return self.speeds, self.roots, self.right, self.left


@dataclass(frozen=True, eq=False)
class Track:
    """Modes followed over speed: columns of roots and of slopes d root/dU belong together.

    `noise` (m, n) is what round-off may make of each root: its condition number times that of the
    matrix.
    """

    speeds: Real
    roots: Complex
    slopes: Complex
    noise: Real


def closed_matrices(family: AnyFamily, stiffness: float, speeds: Real) -> Real:
    """``A - N B C`` at every speed, shape (…, n, n): N times the unit slope of every spring."""
    A, B, C, _ = as_family(family).stack(speeds)
    closed: Real = A - (stiffness * B) @ C
    return closed


def solve_modes(family: AnyFamily, stiffness: float, speeds: Real) -> Modes:
    """Eigenvalues and eigenvectors at speeds (m,), in no particular order."""
    roots, right = np.linalg.eig(closed_matrices(family, stiffness, speeds))
    # a defective matrix has no inverse eigenvectors; the pseudo-inverse keeps the others usable
    roots, right = roots.astype(complex), right.astype(complex)
    return Modes(speeds, roots, right, _inverse(right))


def _inverse(right: Complex) -> Complex:
    try:
        left = np.linalg.inv(right)
    except np.linalg.LinAlgError:
        left = np.full_like(right, np.nan)
    broken = ~np.isfinite(left).all(axis=(-2, -1))
    if broken.any():
        left[broken] = np.linalg.pinv(right[broken], rcond=1e-15)
    return left


def _oscillating(roots: Complex) -> NDArray[np.bool_]:
    """Roots that may cross the imaginary axis; those on the real one come in crowds, as lags do."""
    return np.asarray(np.abs(roots.imag) > _REAL * np.abs(roots))


def _partners(modes: Modes) -> tuple[NDArray[np.intp], NDArray[np.bool_], NDArray[np.bool_]]:
    """For neighbouring speeds: each mode's successor (m-1, n), and what is clear (m-1,).

    First whether all of them are, then whether those are that oscillate.
    """
    overlap = np.abs(modes.left[:-1] @ modes.right[1:])
    best = np.argmax(overlap, axis=2)
    n = best.shape[1]
    bijective = np.all(np.sort(best, axis=1) == np.arange(n), axis=1)
    chosen = np.take_along_axis(overlap, best[..., None], axis=2)[..., 0]
    own = (chosen > _CLEAR) & (overlap.sum(axis=2) - chosen < _SPILL)
    before, after = _oscillating(modes.roots[:-1]), _oscillating(modes.roots[1:])
    kept = np.take_along_axis(after, best, axis=1)  # an oscillation that goes on as one
    alike = before.sum(axis=1) == after.sum(axis=1)
    told = alike & np.all(~before | (own & kept), axis=1) & _once(best, before)
    return best, bijective & own.all(axis=1), told


def _once(best: NDArray[np.intp], rows: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Whether no two of the chosen rows have the same successor."""
    n = best.shape[1]
    own = np.where(rows, best, n + np.arange(n))
    return np.asarray(np.all(np.diff(np.sort(own, axis=1), axis=1) > 0, axis=1))


def _refined(family: AnyFamily, stiffness: float, speeds: Real) -> Modes:
    """Halve every interval across which the oscillating modes have no clear partners."""
    modes = solve_modes(family, stiffness, speeds)
    for _ in range(_DEPTH):
        unclear = ~_partners(modes)[2]
        if not unclear.any():
            break
        middle = 0.5 * (modes.speeds[:-1] + modes.speeds[1:])[unclear]
        modes = modes.merged(solve_modes(family, stiffness, middle))
    return modes


def _assigned(modes: Modes) -> NDArray[np.intp]:
    """Column of each mode at each speed (m, n)."""
    best, clear, told = _partners(modes)
    columns = np.empty(modes.roots.shape, dtype=np.intp)
    columns[0] = np.lexsort((modes.roots[0].real, modes.roots[0].imag))[::-1]
    for i, partner in enumerate(best):
        if not clear[i]:  # the nearest roots go on, except those whose eigenvectors tell
            held = _oscillating(modes.roots[i]) & told[i]
            free = np.ones(partner.size, dtype=bool)
            free[partner[held]] = False
            rest = np.flatnonzero(free)
            pairs = _nearest_pairs(modes.roots[i][~held], modes.roots[i + 1][rest])
            partner = partner.copy()
            partner[~held] = rest[pairs]
        columns[i + 1] = partner[columns[i]]
    return columns


def _nearest_pairs(first: Complex, last: Complex) -> NDArray[np.intp]:
    """Successor of each root when eigenvectors cannot tell: the closest pairs first."""
    distance = np.abs(first[:, None] - last[None, :])
    partner = np.empty(first.size, dtype=np.intp)
    for _ in range(first.size):
        i, j = np.unravel_index(np.argmin(distance), distance.shape)
        partner[i] = j
        distance[i, :], distance[:, j] = np.inf, np.inf
    return partner


def follow(family: AnyFamily, stiffness: float, speeds: Real) -> Track:
    """Modes over ascending speeds (m,), with the speeds added that it takes to tell them apart."""
    modes = _refined(family, stiffness, speeds)
    whole = as_family(family)
    C = whole.stack(modes.speeds)[2]
    dA, dB, _, _ = whole.derivative(modes.speeds)
    change = dA - (stiffness * dB) @ C
    slopes = np.einsum("mij,mjk,mki->mi", modes.left, change, modes.right, optimize=True)
    columns = _assigned(modes)
    sizes = np.linalg.norm(modes.left, axis=2) * np.linalg.norm(modes.right, axis=1)
    closed = np.linalg.norm(closed_matrices(family, stiffness, modes.speeds), axis=(1, 2))
    return Track(
        modes.speeds,
        np.take_along_axis(modes.roots, columns, axis=1),
        np.take_along_axis(slopes, columns, axis=1),
        np.take_along_axis(_ROUND_OFF * closed[:, None] * sizes, columns, axis=1),
    )
