"""Cycles of loops without damping, where flutter is the coalescence of two frequencies.

Without damping every root below flutter lies on the imaginary axis, so every amplitude cycles at
every speed: the balance of the first harmonic alone says nothing. The curve of the thesis's
quasi-steady section is the border of instability, where the root is double. With
D(x) = det(sI - A + N b c), a polynomial in x = s² = -k²,

    D(x; U, N) = 0,    dD/dx = 0.

The determinant is used instead of 1/G because a zero of G lies on the curve where its speed is
lowest.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.linear.rootlocus import coalescences
from aeroflutter.model.lure import LureFamily, inverse_transfer
from aeroflutter.orbits.describing.balance import AMPLITUDE, BIAS, FREQUENCY, SPEED, Balance

__all__ = ["Coalescence", "reversible"]

Array = NDArray[np.float64]

_REAL = 1e-10
_STEP = 1e-5
_GRID = 481  # speeds between which a coalescence is looked for


def reversible(family: LureFamily, speeds: Array) -> bool:
    """Whether 1/G is real on the imaginary axis: a linear system without damping."""
    few = speeds[:: max(1, speeds.size // 5)]
    A, b = family.stack(few)
    size = np.max(np.abs(np.linalg.eigvals(A)))
    s = 1j * size * np.array([0.0373, 0.217, 0.551])
    Z = inverse_transfer(A[:, None], b[:, None], family.c, np.broadcast_to(s, (few.size, 3)))
    return bool(np.all(np.abs(Z.imag) <= _REAL * np.abs(Z)))


class Coalescence(Balance):
    """The balance with the condition of a double root in place of the quadrature part."""

    multiplicity = 2

    def evaluate(self, y: Array) -> tuple[Array, Array]:
        """Residual (m, 3) and Jacobian (m, 3, 4) at unknowns y (m, 4)."""
        residual, jacobian = super().evaluate(y)
        A, B, U, k = self.unpack(y)
        d = self.spring.describing(A, B)
        value = self._determinant(U, k, d.n_p)
        # D is monic: divided by powers of k, it and its derivative are of order one.
        degree = self.family.c.size // 2
        unit = np.column_stack((k ** (2 * degree), k ** (2 * degree - 2)))
        residual[:, :2] = value / unit
        by_N = self._determinant(U, k, d.n_p + 1.0) - value  # D is linear in N
        jacobian[:, :2, AMPLITUDE] = by_N / unit * (A * d.dn_p_dA)[:, None]
        jacobian[:, :2, BIAS] = by_N / unit * (self.spring.scale * d.dn_p_dB)[:, None]
        # These derivatives enter Newton's method only: differences are good enough.
        for index, (dU, dk) in {SPEED: (_STEP, 0.0), FREQUENCY: (0.0, _STEP)}.items():
            ahead, behind = (
                self._determinant(U * np.exp(sign * dU), k * np.exp(sign * dk), d.n_p)
                for sign in (1.0, -1.0)
            )
            jacobian[:, :2, index] = (ahead - behind) / unit / (2 * _STEP)
        return residual, jacobian

    def _determinant(self, U: Array, k: Array, N: Array) -> Array:
        """D and dD/dx at x = -k², shape (m, 2)."""
        A, b = self.family.stack(U)
        roots = np.linalg.eigvals(A - N[:, None, None] * b[:, :, None] * self.family.c)
        x = -(k**2)
        polynomial = np.zeros((len(roots), roots.shape[1] + 1), dtype=complex)
        polynomial[:, 0] = 1.0
        for root in roots.T:
            polynomial[:, 1:] -= root[:, None] * polynomial[:, :-1]
        value, by_x = np.zeros(x.shape), np.zeros(x.shape)
        for column in polynomial.real[:, ::2].T:  # Horner's scheme with its derivative
            by_x = by_x * x + value
            value = value * x + column
        return np.column_stack((value, by_x))

    def guesses(self, amplitudes: Array, biases: Array, speeds: Array) -> Array:
        """Guesses (m, 4) for the cycles of given amplitudes and biases (m,)."""
        pairs = np.column_stack((amplitudes, np.round(biases / self.spring.scale, 2)))
        found, grid = [np.empty((0, 4))], np.geomspace(speeds[0], speeds[-1], _GRID)
        for A, b in np.unique(pairs, axis=0):
            B = b * self.spring.scale
            N = float(self.spring.describing(A, B).n_p)
            for crossing in coalescences(self.family, N, grid):
                cycle = (A, B, crossing.speed, crossing.k)
                found.append(self.pack(*(np.array([value]) for value in cycle)))
        return np.concatenate(found)
