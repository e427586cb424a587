"""The equations of the harmonic balance, for the continuation.

A cycle y = Re Σ Y_k e^(jkωτ) of the loop x' = A(U) x - b(U) F(c x) satisfies

    Y_k/G(jkω; U) + F_k(Y) = 0        k = 0, 1, … H  (or k odd, for half-wave symmetric cycles)

with 1/G, which exists at the poles of G: for a_h = -1/2, 1/G(0) = 0 and the mean says F_0 = 0.
Time starts where the first harmonic is a rising sine, Y_1 = -jA. The unknowns are

    x = (ln A, η, ln ω, ln U),   η = Y_k/A for k ≠ 1, real parts before imaginary parts.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.errors import ConvergenceError
from aeroflutter.model.lure import LureFamily, inverse_transfer, inverse_transfer_gradient
from aeroflutter.orbits.harmonic.moment import Answer, answer
from aeroflutter.orbits.result import Cycle
from aeroflutter.springs import Spring

__all__ = ["Balance", "Cycle", "harmonics"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Index = NDArray[np.intp]

AMPLITUDE, FREQUENCY, SPEED = 0, -2, -1

_FLAT = 1e-12  # a mean balance whose whole row is below this holds on an interval of the mean


def harmonics(count: int, symmetric: bool) -> Index:
    """Harmonics up to `count` that take part: odd ones only in half-wave symmetric cycles."""
    return np.arange(1, count + 1, 2) if symmetric else np.arange(count + 1)


class Balance:
    """The harmonic balance as a curve in speed: a `Problem` of the continuation.

    Parameters
    ----------
    family : LureFamily
    spring : Spring
        Simplified.
    count : int
        Highest harmonic H.
    symmetric : bool
        Whether only odd harmonics take part.
    """

    def __init__(self, family: LureFamily, spring: Spring, count: int, symmetric: bool) -> None:
        self.family, self.spring, self.symmetric = family, spring, symmetric
        self.ks = harmonics(count, symmetric)
        self.first = int(np.flatnonzero(self.ks == 1)[0])
        self.rest = np.flatnonzero(self.ks != 1)
        self.oscillating = np.flatnonzero(self.ks > 1)
        self._rows = np.arange(2 * self.ks.size)
        if not symmetric:  # the mean has no imaginary part
            self._rows = np.delete(self._rows, self.ks.size)
        self._last: tuple[Real, Real, Real] | None = None
        self._answered: tuple[Real, Answer] | None = None
        self._truncations: dict[bytes, float] = {}

    @property
    def unknowns(self) -> int:
        """Number of unknowns n; there are n - 1 equations."""
        return 3 + self.rest.size + self.oscillating.size

    def unpack(self, x: Real) -> Cycle:
        """The cycle of unknowns x (n,)."""
        Y = np.zeros(int(self.ks[-1]) + 1, dtype=complex)
        Y[self.ks] = np.exp(x[AMPLITUDE]) * self._relative(x)
        return Cycle(Y, float(np.exp(x[FREQUENCY])), float(np.exp(x[SPEED])))

    def pack(self, cycle: Cycle) -> Real:
        """Unknowns (n,) of a cycle; harmonics are dropped or start at zero as need be."""
        Y = np.zeros(int(self.ks[-1]) + 1, dtype=complex)
        common = min(Y.size, cycle.Y.size)
        Y[:common] = cycle.Y[:common]
        A = abs(Y[1])
        # shift time until the first harmonic is a sine
        Y = Y * (-1j * np.conj(Y[1]) / A) ** np.arange(Y.size) / A
        x = np.empty(self.unknowns)
        x[AMPLITUDE], x[FREQUENCY], x[SPEED] = np.log([A, cycle.omega, cycle.speed])
        x[1 : 1 + self.rest.size] = Y[self.ks[self.rest]].real
        x[1 + self.rest.size : -2] = Y[self.ks[self.oscillating]].imag
        return x

    def residual(self, x: Real) -> Real:
        """Residual (n-1,): the imbalance of each harmonic over the amplitude."""
        return self._evaluate(x)[0]

    def jacobian(self, x: Real) -> Real:
        """Jacobian (n-1, n), exact."""
        return self._evaluate(x)[1]

    def answer(self, x: Real) -> Answer:
        """What the spring answers to the motion of unknowns x."""
        if self._answered is None or not np.array_equal(self._answered[0], x):
            self._answered = np.array(x), answer(self.spring, self.unpack(x).Y)
        return self._answered[1]

    def truncation(self, x: Real) -> float:
        """Estimate of the harmonics left out, as a share of the amplitude: H+1 … 2H+1 together."""
        key = x.tobytes()
        if key not in self._truncations:
            self._truncations[key] = float(self._missing(x, 2 * int(self.ks[-1]) + 1)[1].sum())
        return self._truncations[key]

    def sufficient(self, x: Real, tolerance: float, most: int) -> int:
        """Highest harmonic at which the estimate would fall below a tolerance, as seen from x."""
        ks, missing = self._missing(x, 2 * most + 1)
        total = np.concatenate(([0.0], np.cumsum(missing)))
        tops = np.unique(np.minimum(np.append(self.ks[-1:], ks), most))
        left_out = total[np.searchsorted(ks, 2 * tops + 1, "right")]
        left_out -= total[np.searchsorted(ks, tops, "right")]
        return int(tops[left_out <= tolerance][0]) if np.any(left_out <= tolerance) else most

    def _missing(self, x: Real, top: int) -> tuple[Index, Real]:
        """Harmonics H+1 … top, and an estimate of each over the amplitude.

        One step of Newton's method on each alone: the imbalance of the harmonic over the loop's
        stiffness against it.
        """
        cycle, given = self.unpack(x), self.answer(x)
        ks = np.arange(int(self.ks[-1]) + 1, top + 1)
        if self.symmetric:
            ks = ks[ks % 2 == 1]
        A, b = self.family.stack(cycle.speed)
        stiffness = inverse_transfer(A, b, self.family.c, 1j * ks * cycle.omega)
        stiffness = stiffness + given.slope(1)[0]
        return ks, np.abs(given.moment(top + 1)[ks] / stiffness) / cycle.first_harmonic

    def _relative(self, x: Real) -> Complex:
        """Y_k/A for every k that takes part."""
        eta = np.zeros(self.ks.size, dtype=complex)
        eta[self.first] = -1j
        eta[self.rest] = x[1 : 1 + self.rest.size]
        eta[self.oscillating] += 1j * x[1 + self.rest.size : -2]
        return eta

    def _evaluate(self, x: Real) -> tuple[Real, Real]:
        if self._last is not None and np.array_equal(self._last[0], x):
            return self._last[1:]
        try:
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
                residual, jacobian = self._assemble(np.asarray(x))
        except np.linalg.LinAlgError:
            raise ConvergenceError("the loop has no transfer function here") from None
        self._last = np.array(x), residual, jacobian
        return residual, jacobian

    def _assemble(self, x: Real) -> tuple[Real, Real]:
        cycle, eta, m = self.unpack(x), self._relative(x), self.ks.size
        scale = float(np.exp(x[AMPLITUDE]))
        given = self.answer(x)
        F = given.moment(int(self.ks[-1]) + 1)[self.ks] / scale
        s = 1j * self.ks * cycle.omega
        (A, b), (dA, db) = (f(cycle.speed) for f in (self.family.stack, self.family.derivative))
        Z, Z_s, Z_U = inverse_transfer_gradient(A, b, self.family.c, dA, db, s)
        J = given.derivative(self.ks)
        diagonal = np.arange(m)
        residual = _parts(Z * eta + F)
        by_amplitude = J @ _parts(eta) - _parts(F)
        J[diagonal, diagonal] += Z.real
        J[diagonal, diagonal + m] -= Z.imag
        J[diagonal + m, diagonal] += Z.imag
        J[diagonal + m, diagonal + m] += Z.real
        columns = [
            by_amplitude[:, None],
            J[:, self.rest],
            J[:, m + self.oscillating],
            _parts(Z_s * s * eta)[:, None],
            _parts(Z_U * cycle.speed * eta)[:, None],
        ]
        residual, jacobian = residual[self._rows], np.hstack(columns)[self._rows]
        if not self.symmetric and abs(residual[0]) < _FLAT and np.all(abs(jacobian[0]) < _FLAT):
            # The mean balances on a whole interval (a loop that never meets its stops): stay.
            residual[0], jacobian[0, 1] = 0.0, 1.0
        return residual, jacobian


def _parts(values: Complex) -> Real:
    return np.concatenate((values.real, values.imag))
