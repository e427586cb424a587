"""The equations of the describing function, for many cycles at once.

A cycle α = B + A sin kτ of the loop x' = A(U) x - b(U) F(c x) satisfies

    1/G(jk; U) + n_p(A, B) + j n_q(A, B) = 0        first harmonic
    B/G(0; U) + F₀(A, B) = 0                        mean

written with 1/G, which exists at the poles of G (for a_h = -1/2, 1/G(0) = 0). The unknowns are
y = (ln A, B/scale, ln U, ln k): amplitudes and frequencies range over decades.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeroflutter.model.lure import LureFamily, inverse_transfer_gradient
from aeroflutter.springs import Describing, Spring

__all__ = ["AMPLITUDE", "BIAS", "FREQUENCY", "LEAST", "SPEED", "Balance", "Loop"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
AMPLITUDE, BIAS, SPEED, FREQUENCY = range(4)

_FLAT = 1e-12  # a mean balance whose whole row is below this holds on an interval of bias
LEAST = 1e-6  # bias in scales to which cycles are followed, above the round-off of dividing by it
_REACH = 0.7  # longest Newton update in any unknown
_ITERATIONS = 15
_CONVERGED = 1e-10  # size of the last Newton update, whose error is about its square
LIMIT = 60.0  # of the unknowns, beyond which nothing is evaluated


class Loop(NamedTuple):
    """The linear side of the balance: 1/G(jk) and 1/G(0), with derivatives."""

    Z: Complex
    Z_s: Complex
    Z_U: Complex
    Z0: Array
    Z0_U: Array


@dataclass(frozen=True, eq=False)
class Balance:
    """Three equations in four unknowns.

    Parameters
    ----------
    family, spring
        The loop and what closes it.
    biased
        Whether the bias is free. Where it is not, the mean balance gives way to B = 0, which
        solves it for an odd spring.
    """

    family: LureFamily
    spring: Spring
    biased: bool
    multiplicity: ClassVar[int] = 1
    """Multiplicity of the root j k of A - N b c."""

    def unpack(self, y: Array) -> tuple[Array, Array, Array, Array]:
        """A, B, U, k of unknowns y (..., 4)."""
        y = np.asarray(y)
        return (
            np.exp(y[..., AMPLITUDE]),
            self.spring.scale * y[..., BIAS],
            np.exp(y[..., SPEED]),
            np.exp(y[..., FREQUENCY]),
        )

    def pack(self, A: Array, B: Array, U: Array, k: Array) -> Array:
        """Unknowns y (..., 4) of A, B, U, k."""
        with np.errstate(divide="ignore", invalid="ignore"):
            parts = np.log(A), np.divide(B, self.spring.scale), np.log(U), np.log(k)
        return np.stack(np.broadcast_arrays(*parts), axis=-1)

    @property
    def divided(self) -> bool:
        """Whether the mean balance is divided by the bias, of which an odd spring's is a multiple.

        What is left has no root where there is no bias. The curve of cycles with a bias goes
        smoothly through the pitchfork, to its mirror image, and not on to symmetric cycles.
        """
        return self.biased and self.spring.odd

    def loop(self, U: Array, k: Array, *, mean: bool = True) -> Loop:
        """1/G and its derivatives at speeds U and frequencies k, shape (m,).

        Without `mean` the two fields of 1/G(0) are zero.
        """
        A, b = self.family.stack(U)
        dA, db = self.family.derivative(U)
        c = self.family.c
        harmonic = inverse_transfer_gradient(A, b, c, dA, db, 1j * k)
        if not mean:
            return Loop(*harmonic, np.zeros(U.shape), np.zeros(U.shape))
        Z0, _, Z0_U = inverse_transfer_gradient(A, b, c, dA, db, np.zeros(U.shape))
        return Loop(*harmonic, np.asarray(Z0.real), np.asarray(Z0_U.real))

    def evaluate(self, y: Array) -> tuple[Array, Array]:
        """Residual (m, 3) and Jacobian (m, 3, 4) at unknowns y (m, 4)."""
        A, B, U, k = self.unpack(y)
        if self.divided:
            B = np.copysign(np.maximum(np.abs(B), LEAST * self.spring.scale), B)
        return self._assemble(
            A, B, U, k, self.loop(U, k, mean=self.biased), self.spring.describing(A, B)
        )

    def _assemble(
        self, A: Array, B: Array, U: Array, k: Array, loop: Loop, d: Describing
    ) -> tuple[Array, Array]:
        scale = self.spring.scale
        residual, jacobian = np.zeros((A.size, 3)), np.zeros((A.size, 3, 4))
        harmonic = loop.Z + d.N
        columns = {
            AMPLITUDE: A * (d.dn_p_dA + 1j * d.dn_q_dA),
            BIAS: scale * (d.dn_p_dB + 1j * d.dn_q_dB),
            SPEED: U * loop.Z_U,
            FREQUENCY: 1j * k * loop.Z_s,
        }
        residual[:, 0], residual[:, 1] = harmonic.real, harmonic.imag
        for index, column in columns.items():
            jacobian[:, 0, index], jacobian[:, 1, index] = column.real, column.imag
        if not self.biased:
            residual[:, 2], jacobian[:, 2, BIAS] = B / scale, 1.0
            return residual, jacobian
        residual[:, 2] = (loop.Z0 * B + d.F0) / scale
        jacobian[:, 2, AMPLITUDE] = A * d.dF0_dA / scale
        jacobian[:, 2, BIAS] = loop.Z0 + d.dF0_dB
        jacobian[:, 2, SPEED] = U * loop.Z0_U * B / scale
        flat = (np.abs(residual[:, 2]) < _FLAT) & np.all(np.abs(jacobian[:, 2]) < _FLAT, axis=1)
        if self.divided:
            share = B / scale
            residual[:, 2] /= share
            jacobian[:, 2] /= share[:, None]
            jacobian[:, 2, BIAS] -= residual[:, 2] / share
        # The mean balances on a whole interval of bias, on which N does not change: stay there.
        jacobian[flat, 2, BIAS] = 1.0
        residual[flat, 2] = 0.0
        return residual, jacobian

    def solve(self, y: Array, normal: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Newton's method for every guess at once, each within its own hyperplane.

        Parameters
        ----------
        y
            Guesses, shape (m, 4).
        normal
            Normals of the hyperplanes through the guesses, shape (4,) or (m, 4): the unit
            vector of the amplitude solves at that amplitude.

        Returns
        -------
        y, converged
            Shapes (m, 4) and (m,). Mirror images of biased cycles are left out.
        """
        y = np.array(y, dtype=float).reshape(-1, 4)
        rows = np.broadcast_to(normal, y.shape)
        done = np.zeros(len(y), dtype=bool)
        alive = np.all(np.isfinite(y), axis=1)
        for _ in range(_ITERATIONS):
            work = np.flatnonzero(alive & ~done)
            if work.size == 0:
                break
            update = self._update(y[work], rows[work])
            size = np.max(np.abs(update), axis=1)
            good = np.isfinite(size)
            alive[work[~good]] = False
            work, update, size = work[good], update[good], size[good]
            y[work] += update * np.minimum(1.0, _REACH / np.maximum(size, 1e-300))[:, None]
            done[work] = size < _CONVERGED
            alive[work] = np.all(np.abs(y[work]) < LIMIT, axis=1)
        return y, done & (y[:, BIAS] > 0.5 * LEAST) if self.divided else done

    def _update(self, y: Array, rows: Array) -> Array:
        residual, jacobian = self.evaluate(y)
        matrix = np.concatenate((jacobian, rows[:, None, :]), axis=1)
        rhs = np.concatenate((-residual, np.zeros((len(y), 1))), axis=1)
        try:
            return np.asarray(np.linalg.solve(matrix, rhs[:, :, None])[..., 0])
        except np.linalg.LinAlgError:
            finite = np.all(np.isfinite(matrix), axis=(1, 2))
            update = np.full(y.shape, np.nan)
            update[finite] = (np.linalg.pinv(matrix[finite]) @ rhs[finite, :, None])[..., 0]
            return update
