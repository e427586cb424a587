"""The equations of the harmonic balance, for the continuation.

A cycle y = Re Σ Y_k e^(jkωτ) of the loop x' = A(U) x - B(U) F(C x) satisfies

    Y_k/G(jkω; U) + F_k(Y) = 0        k = 0, 1, … H  (or k odd, for half-wave symmetric cycles)

with 1/G, a matrix where there are several springs, which exists at the poles of G: for
a_h = -1/2, 1/G(0) = 0 and the mean says F_0 = 0. Springs that share a coordinate act as one: their
rows of G are the same, so there is one block a coordinate. Time starts where the first harmonic of
the leading coordinate is a rising sine, Y_1 = -jA. The unknowns are

    x = (ln A, η, ln ω, ln U),   η = Y_k/A for all other Y_k, real parts before imaginary parts,

in units of each coordinate's own size.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.errors import ConvergenceError
from aeroflutter.model.lure import AnyFamily, as_family
from aeroflutter.model.system import inverse_transfer, inverse_transfer_gradient
from aeroflutter.orbits.harmonic.channels import Together, channels_of
from aeroflutter.orbits.harmonic.moment import Answer, answer
from aeroflutter.orbits.result import Cycle
from aeroflutter.springs import Springs, each

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
    family : Family or LureFamily
    spring : Spring, or a sequence of them
        Simplified; of several one an output.
    count : int
        Highest harmonic H.
    symmetric : bool
        Whether only odd harmonics take part.
    lead : int
        The channel whose first harmonic is the unit of all; the first by default.

    Attributes
    ----------
    channels
        The coordinates in which springs act, G of them.
    ks
        Harmonics that take part, (K,).
    rest, oscillating
        Places of the unknown η among the harmonics of all channels, channel by channel, (G K,):
        of their real and of their imaginary parts.
    """

    def __init__(
        self,
        family: AnyFamily,
        spring: Springs,
        count: int,
        symmetric: bool,
        lead: int = 0,
    ) -> None:
        self.family, self.symmetric = as_family(family), symmetric
        self.springs, self.lead = each(spring), lead
        self.channels = channels_of(self.family, self.springs)
        self._outputs = [channel.springs[0] for channel in self.channels]
        self.spring = self.springs[self._outputs[lead]]
        sizes = np.array([self.springs[i].scale for i in self._outputs])
        self.sizes = sizes / sizes[lead]
        self.ks = harmonics(count, symmetric)
        K, G = self.ks.size, len(self.channels)
        self.orders = np.tile(self.ks, G)
        self.first = lead * K + int(np.flatnonzero(self.ks == 1)[0])
        others = np.arange(G * K) != self.first
        self.rest = np.flatnonzero(others)
        self.oscillating = np.flatnonzero(others & (self.orders > 0))
        # the means have no imaginary parts
        self._rows = np.delete(np.arange(2 * G * K), G * K + np.flatnonzero(self.orders == 0))
        self._last: tuple[Real, Real, Real] | None = None
        self._answered: tuple[Real, tuple[Answer, ...]] | None = None
        self._truncations: dict[bytes, float] = {}

    @property
    def unknowns(self) -> int:
        """Number of unknowns n; there are n - 1 equations."""
        return 3 + self.rest.size + self.oscillating.size

    def unpack(self, x: Real) -> Cycle:
        """The cycle of unknowns x (n,)."""
        Y = np.zeros((len(self.channels), int(self.ks[-1]) + 1), dtype=complex)
        Y[:, self.ks] = np.exp(x[AMPLITUDE]) * self.sizes[:, None] * self._relative(x)
        omega, speed = float(np.exp(x[FREQUENCY])), float(np.exp(x[SPEED]))
        if len(self.springs) == 1:
            return Cycle(Y[0], omega, speed)
        outputs = np.empty((len(self.springs), Y.shape[1]), dtype=complex)
        for row, channel in zip(Y, self.channels, strict=True):
            outputs[list(channel.springs)] = row
        return Cycle(outputs[0], omega, speed, outputs=outputs)

    def pack(self, cycle: Cycle) -> Real:
        """Unknowns (n,) of a cycle; harmonics are dropped or start at zero as need be."""
        given = cycle.motions[self._outputs]
        Y = np.zeros((len(self.channels), int(self.ks[-1]) + 1), dtype=complex)
        common = min(Y.shape[1], given.shape[1])
        Y[:, :common] = given[:, :common]
        first = Y[self.lead, 1]
        A = abs(first)
        # shift time until the first harmonic is a sine
        Y = Y * (-1j * np.conj(first) / A) ** np.arange(Y.shape[1]) / A / self.sizes[:, None]
        eta = Y[:, self.ks].ravel()
        x = np.empty(self.unknowns)
        x[AMPLITUDE], x[FREQUENCY], x[SPEED] = np.log([A, cycle.omega, cycle.speed])
        x[1 : 1 + self.rest.size] = eta[self.rest].real
        x[1 + self.rest.size : -2] = eta[self.oscillating].imag
        return x

    def residual(self, x: Real) -> Real:
        """Residual (n-1,): the imbalance of each harmonic over the amplitude."""
        return self._evaluate(x)[0]

    def jacobian(self, x: Real) -> Real:
        """Jacobian (n-1, n), exact."""
        return self._evaluate(x)[1]

    def answers(self, x: Real) -> tuple[Answer, ...]:
        """What each spring answers to the motion of unknowns x."""
        if self._answered is None or not np.array_equal(self._answered[0], x):
            motions = self.unpack(x).motions
            made = tuple(answer(*pair) for pair in zip(self.springs, motions, strict=True))
            self._answered = np.array(x), made
        return self._answered[1]

    def answer(self, x: Real) -> Answer:
        """What they answer in the coordinate of the first spring of the leading channel."""
        return self._by_channel(x)[self.lead]

    def margin(self, x: Real) -> float:
        """Distance of the spring nearest to it from a change of its sequence of segments."""
        return min(one.margin for one in self.answers(x))

    def sequence(self, x: Real) -> tuple[int, ...]:
        """What tells the sequences of segments of all springs apart."""
        return sum((one.sequence for one in self.answers(x)), ())

    def straight(self, x: Real) -> bool:
        """Whether every spring stays on one straight piece."""
        return all(one.straight for one in self.answers(x))

    def _by_channel(self, x: Real) -> list[Answer]:
        every = self.answers(x)
        return [
            every[channel.springs[0]]
            if len(channel.springs) == 1
            else Together(
                every[channel.springs[0]].Y,
                tuple(every[i] for i in channel.springs),
                channel.weights,
            )
            for channel in self.channels
        ]

    def _matrices(self, speed: float) -> tuple[Real, Real, Real]:
        """A, B and C, one column and one row a channel."""
        A, B, C, _ = self.family.stack(speed)
        return A, B[..., self._outputs], C[..., self._outputs, :]

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
        """Harmonics H+1 … top, and an estimate of each over the amplitude."""
        ks, left = self.predicted(x, top)
        firsts = np.abs(self.unpack(x).motions[self._outputs, 1]) / self.sizes
        return ks, np.abs(left / self.sizes).max(axis=1) / firsts.max()

    def predicted(self, x: Real, top: int) -> tuple[Index, Complex]:
        """Harmonics H+1 … top of all channels as they would be, (k,) and (k, G).

        One step of Newton's method on each alone: the imbalance of the harmonic over the loop's
        stiffness against it.
        """
        cycle, given = self.unpack(x), self._by_channel(x)
        ks = np.arange(int(self.ks[-1]) + 1, top + 1)
        if self.symmetric:
            ks = ks[ks % 2 == 1]
        stiffness = inverse_transfer(*self._matrices(cycle.speed), 1j * ks * cycle.omega)
        own = np.array([one.stiffness(ks) for one in given])
        stiffness = stiffness + np.eye(len(given)) * own.T[:, :, None]
        moments = np.array([one.moment(top + 1)[ks] for one in given])
        return ks, np.asarray(-np.linalg.solve(stiffness, moments.T[:, :, None])[..., 0])

    def linearised(self, x: Real) -> tuple[Real, Real]:
        """The balance linearised at a cycle, in all harmonics of all channels as real numbers.

        Returns
        -------
        J, M
            Derivatives of the imbalance (mean of every channel first, where it takes part, then
            real and imaginary parts of the rest), and of that of the oscillating part by the rate
            at which it grows.
        """
        cycle = self.unpack(x)
        A, B, C = self._matrices(cycle.speed)
        s = 1j * self.ks * cycle.omega
        nothing = np.zeros_like(A), np.zeros_like(B), np.zeros_like(C)
        found = inverse_transfer_gradient(A, B, C, *nothing, s)
        Z, Z_s, _ = (part * self.sizes / self.sizes[:, None] for part in found)
        J, M = self._answered_by(self._by_channel(x)), np.zeros(2 * (2 * self.orders.size,))
        _add_blocks(J, Z)
        _add_blocks(M, Z_s)
        means, rest = np.flatnonzero(self.orders == 0), np.flatnonzero(self.orders > 0)
        fast = np.concatenate((rest, self.orders.size + rest))
        order = np.concatenate((means, fast))
        return J[np.ix_(order, order)], M[np.ix_(fast, fast)]

    def _relative(self, x: Real) -> Complex:
        """Y_k/A, in units of each channel's size, for every k that takes part, (G, K)."""
        eta = np.zeros(self.orders.size, dtype=complex)
        eta[self.first] = -1j
        eta[self.rest] = x[1 : 1 + self.rest.size]
        eta[self.oscillating] += 1j * x[1 + self.rest.size : -2]
        return eta.reshape(-1, self.ks.size)

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
        cycle, eta = self.unpack(x), self._relative(x)
        units = float(np.exp(x[AMPLITUDE])) * self.sizes
        given = self._by_channel(x)
        highest = int(self.ks[-1]) + 1
        F = np.array([one.moment(highest)[self.ks] for one in given]) / units[:, None]
        s = 1j * self.ks * cycle.omega
        A, B, C = self._matrices(cycle.speed)
        dA, dB, dC, _ = self.family.derivative(cycle.speed)
        dB, dC = dB[:, self._outputs], dC[self._outputs]
        found = inverse_transfer_gradient(A, B, C, dA, dB, dC, s)
        Z, Z_s, Z_U = (part * self.sizes / self.sizes[:, None] for part in found)
        J = self._answered_by(given)
        by_amplitude = J @ _parts(eta) - _parts(F)
        _add_blocks(J, Z)
        columns = [
            by_amplitude[:, None],
            J[:, self.rest],
            J[:, self.orders.size + self.oscillating],
            _parts(_times(Z_s, s * eta))[:, None],
            _parts(_times(Z_U, cycle.speed * eta))[:, None],
        ]
        residual = _parts(_times(Z, eta) + F)[self._rows]
        jacobian = np.hstack(columns)[self._rows]
        if not self.symmetric:
            self._stay(residual, jacobian)
        return residual, jacobian

    def _answered_by(self, given: list[Answer]) -> Real:
        """∂F/∂Y of all channels as real numbers, real parts before imaginary ones."""
        if len(given) == 1:
            return given[0].derivative(self.ks)
        K, N = self.ks.size, self.orders.size
        J = np.zeros((2 * N, 2 * N))
        for g, one in enumerate(given):
            at = np.concatenate((np.arange(K), N + np.arange(K))) + g * K
            J[np.ix_(at, at)] = one.derivative(self.ks)
        return J

    def _stay(self, residual: Real, jacobian: Real) -> None:
        """Where a mean balances on a whole interval (a loop that never meets its stops): stay."""
        for mean in np.flatnonzero(self.orders == 0):  # its row has no imaginary one before it
            if abs(residual[mean]) < _FLAT and np.all(abs(jacobian[mean]) < _FLAT):
                residual[mean] = 0.0
                jacobian[mean, 1 + int(np.searchsorted(self.rest, mean))] = 1.0


def _times(Z: Complex, eta: Complex) -> Complex:
    """Z_k η_k for every harmonic, (G, K), from Z (K, G, G) and η (G, K)."""
    if eta.shape[0] == 1:
        return np.asarray(Z[:, 0, 0] * eta)
    return np.asarray(np.einsum("kgh,hk->gk", Z, eta))


def _add_blocks(J: Real, Z: Complex) -> None:
    """Add Z_k (K, G, G) to what a harmonic of one channel does to the same one of another."""
    K, G = Z.shape[:2]
    N, at = G * K, np.arange(K)
    for g in range(G):
        for h in range(G):
            row, column, z = g * K + at, h * K + at, Z[:, g, h]
            J[row, column] += z.real
            J[row, column + N] -= z.imag
            J[row + N, column] += z.imag
            J[row + N, column + N] += z.real


def _parts(values: Complex) -> Real:
    return np.concatenate((values.real.ravel(), values.imag.ravel()))
