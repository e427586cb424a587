"""Floquet multipliers from the monodromy matrix of the shooting equations.

The map whose fixed point the cycle is (period map, or half-period map followed by the mirror) has
the direction of motion as an eigenvector of eigenvalue one. It is split off by an orthogonal
transformation, so that the others are as accurate next to a bifurcation as far from it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.errors import ConvergenceError
from aeroflutter.orbits.cycles.shooting import Shooting, Shot
from aeroflutter.orbits.spectrum import Spectrum

__all__ = ["Spectra", "critical_vector", "spectrum"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_TRIVIAL = 1e-6  # from one: the trivial multiplier of what is a cycle


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
            memories = shooting.loop.held.size
            found = spectrum(shooting.shot(q), self.sizes, shooting.symmetric, memories)
            if not abs(found.trivial - 1.0) < _TRIVIAL:
                raise ConvergenceError("no multiplier is one: this is no cycle")
            self._last, self._key = found, key
        return self._last


def spectrum(shot: Shot, sizes: Array, symmetric: bool, memories: int) -> Spectrum:
    """Eigenvalues of the map of a cycle.

    Parameters
    ----------
    shot
        The shooting equations at the cycle.
    sizes
        Size of each entry of z, (m,), which balances the matrix.
    symmetric, memories
        Whether the map is that of half a period; how many of the last entries of z are memories.
    """
    matrix = shot.monodromy * sizes / sizes[:, None]
    along = shot.rate / sizes
    if shot.stuck.size:  # what stays as it is has a multiplier of one, and is no motion
        moves = np.delete(np.arange(along.size), shot.stuck)
        matrix, along = matrix[np.ix_(moves, moves)], along[moves]
    basis = np.linalg.qr(np.column_stack((along, np.eye(along.size))))[0]
    turned = basis.T @ matrix @ basis
    values = np.linalg.eigvals(turned[1:, 1:]).astype(complex)
    values = values[np.argsort(-np.abs(values), kind="stable")]
    values = values[: values.size - (memories - shot.stuck.size)]  # sliding erases the others
    if shot.stuck.size:
        fixed = -1.0 + 0j if symmetric else 1.0 + 0j
        for _ in range(shot.free):
            values = np.delete(values, int(np.argmin(np.abs(values - fixed))))
        return Spectrum(turned[0, 0], fixed, values, symmetric)
    for _ in range(shot.free - 1):
        unit = -1.0 if symmetric else 1.0
        values = np.delete(values, int(np.argmin(np.abs(values - unit))))
    return Spectrum.of(turned[0, 0], values, symmetric=symmetric, free=shot.free > 0)


def critical_vector(shot: Shot, sizes: Array) -> Array:
    """Eigenvector (m,) of the map for the eigenvalue nearest to -1, of unit size, real."""
    matrix = shot.monodromy * sizes / sizes[:, None]
    values, vectors = np.linalg.eig(matrix)
    vector = vectors[:, int(np.argmin(np.abs(values + 1.0)))].real
    return np.asarray(sizes * vector / np.linalg.norm(vector))
