"""Floquet multipliers and the test functions of the bifurcations, from one monodromy matrix.

The map whose fixed point the cycle is (period map, or half-period map followed by the mirror) has
the direction of motion as an eigenvector of eigenvalue one. It is split off by an orthogonal
transformation, so that the others are as accurate next to a bifurcation as far from it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aeroflutter.errors import ConvergenceError
from aeroflutter.orbits.cycles.shooting import Shooting, Shot

__all__ = ["Spectra", "Spectrum", "critical_vector", "spectrum"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_TRIVIAL = 1e-6  # from one: the trivial multiplier of what is a cycle


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Eigenvalues of the map of a cycle.

    Attributes
    ----------
    trivial
        The one along the motion, one up to round-off.
    drift
        The one along a continuum of bias; None elsewhere.
    others
        The rest, largest first; the memory's own zero is left out.
    symmetric
        Whether the map is that of half a period, with the mirror.
    """

    trivial: float
    drift: complex | None
    others: Complex
    symmetric: bool

    @property
    def multipliers(self) -> Complex:
        """Floquet multipliers of the whole period, (n,): the trivial one first."""
        drift = [] if self.drift is None else [self.drift]
        values = np.concatenate(([self.trivial], drift, self.others)).astype(complex)
        return values**2 if self.symmetric else values

    @property
    def stable(self) -> bool:
        """Whether all the others lie inside the unit circle."""
        return bool(np.all(np.abs(self.others) < 1.0))

    @property
    def flip(self) -> float:
        """Zero where an eigenvalue passes -1: a doubled period, or the symmetry breaks."""
        return float(np.prod(1.0 + self.others).real)

    @property
    def torus(self) -> float:
        """Zero where a pair has the product 1: Neimark-Sacker, or a neutral saddle."""
        i, j = np.triu_indices(self.others.size, 1)
        return float(np.prod(1.0 - self.others[i] * self.others[j]).real)

    @property
    def closest_pair_is_complex(self) -> bool:
        """Whether the pair whose product is nearest to 1 is complex."""
        i, j = np.triu_indices(self.others.size, 1)
        best = np.argmin(np.abs(1.0 - self.others[i] * self.others[j]))
        return bool(abs(self.others[i[best]].imag) > 1e-7)


class Spectra:
    """Eigenvalues along a walk; those of the last point are kept.

    Parameters
    ----------
    shooting
        The equations.
    sizes
        Size of each entry of z, (m,), which balances the matrix.
    """

    def __init__(self, shooting: Shooting, sizes: Array) -> None:
        self.shooting, self.sizes = shooting, sizes
        self._key = b""
        self._last: Spectrum

    def __call__(self, q: Array) -> Spectrum:
        """Eigenvalues of the map of the cycle at q.

        Raises
        ------
        ConvergenceError
            If none is one: q is at rest, or not on the curve.
        """
        key = q.tobytes()
        if key != self._key:
            shooting = self.shooting
            found = spectrum(shooting.shot(q), self.sizes, shooting.symmetric, shooting.loop.memory)
            if not abs(found.trivial - 1.0) < _TRIVIAL:
                raise ConvergenceError("no multiplier is one: this is no cycle")
            self._last, self._key = found, key
        return self._last


def spectrum(shot: Shot, sizes: Array, symmetric: bool, memory: bool) -> Spectrum:
    """Eigenvalues of the map of a cycle.

    Parameters
    ----------
    shot
        The shooting equations at the cycle.
    sizes
        Size of each entry of z, (m,), which balances the matrix.
    symmetric, memory
        Whether the map is that of half a period; whether the last entry of z is a memory.
    """
    matrix = shot.monodromy * sizes / sizes[:, None]
    along = shot.rate / sizes
    basis = np.linalg.qr(np.column_stack((along, np.eye(along.size))))[0]
    turned = basis.T @ matrix @ basis
    values = np.linalg.eigvals(turned[1:, 1:]).astype(complex)
    values = values[np.argsort(-np.abs(values), kind="stable")]
    if memory:  # sliding erases it
        values = values[:-1]
    drift = None
    if shot.free:
        index = int(np.argmin(np.abs(values - (-1.0 if symmetric else 1.0))))
        drift, values = complex(values[index]), np.delete(values, index)
    return Spectrum(float(turned[0, 0]), drift, values, symmetric)


def critical_vector(shot: Shot, sizes: Array) -> Array:
    """Eigenvector (m,) of the map for the eigenvalue nearest to -1, of unit size, real."""
    matrix = shot.monodromy * sizes / sizes[:, None]
    values, vectors = np.linalg.eig(matrix)
    vector = vectors[:, int(np.argmin(np.abs(values + 1.0)))].real
    return np.asarray(sizes * vector / np.linalg.norm(vector))
