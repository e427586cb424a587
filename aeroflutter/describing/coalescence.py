"""Cycles of loops without damping, where flutter is the coalescence of two frequencies.

Without damping 1/G(jk) is real, every root below flutter lies on the imaginary axis and so every
amplitude cycles at every speed: the balance of the first harmonic alone says nothing. The curve
of the thesis's quasi-steady section is the border of instability, where the root is double:

    1/G(jk; U) + n_p(A, B) = 0,    d(1/G)/dk = 0.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.describing.balance import FREQUENCY, SPEED, Balance, Loop
from aeroflutter.lure import LureFamily, inverse_transfer
from aeroflutter.rootlocus import RootLocusOptions, root_locus
from aeroflutter.springs import Describing

__all__ = ["Coalescence", "reversible"]

Array = NDArray[np.float64]

_REAL = 1e-10
_STEP = 1e-5


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

    def _assemble(
        self, A: Array, B: Array, U: Array, k: Array, loop: Loop, d: Describing
    ) -> tuple[Array, Array]:
        residual, jacobian = super()._assemble(A, B, U, k, loop, d)
        residual[:, 1] = -loop.Z_s.imag / k  # twice the derivative by k²: not zero at k = 0
        jacobian[:, 1] = 0.0
        # The second derivatives enter Newton's method only: differences are good enough.
        for index, (dU, dk) in {SPEED: (_STEP, 0.0), FREQUENCY: (0.0, _STEP)}.items():
            ahead, behind = (
                self.loop(U * np.exp(sign * dU), k * np.exp(sign * dk)).Z_s.imag
                / (k * np.exp(sign * dk))
                for sign in (1.0, -1.0)
            )
            jacobian[:, 1, index] = -(ahead - behind) / (2 * _STEP)
        return residual, jacobian

    def guesses(self, amplitudes: Array, biases: Array, speeds: Array) -> Array:
        """Guesses (m, 4) for the cycles of given amplitudes and biases (m,)."""
        pairs = np.column_stack((amplitudes, np.round(biases / self.spring.scale, 2)))
        found = [np.empty((0, 4))]
        for A, b in np.unique(pairs, axis=0):
            N = float(self.spring.describing(A, b * self.spring.scale).n_p)
            options = RootLocusOptions(stiffness=N, low=speeds[0], high=speeds[-1])
            for crossing in root_locus(self.family, options).crossings:
                if crossing.coalescence:
                    y = self.pack(A, b * self.spring.scale, crossing.speed, crossing.k)
                    found.append(y[None, :])
        return np.concatenate(found)
