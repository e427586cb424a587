"""Stability by Hill's determinant, without spurious exponents to sort out.

A perturbation v = e^(sτ) Σ v_n e^(jnωτ) of a cycle satisfies v_n/G(s + jnω) + (δF)_n = 0, an
infinite homogeneous system. Usually it is truncated and solved as an eigenvalue problem, whose
exponents are then to be sorted into true and spurious ones. The system is scalar, however, in the
one coordinate that the spring feels, and its determinant, normalised harmonic by harmonic,

    D(s) = det[δ_mn + H(s + jmω) (δF_mn - P_0 δ_mn)],   H = G/(1 + P_0 G),

is a Fredholm determinant. It depends on s only through the multiplier λ = e^(sT), vanishes at
those of the cycle, has poles at those of the mean system A - P_0 b c and tends to one for λ → ∞:

    D(λ) det[λI - e^((A - P_0 b c)T)] = det[λI - Φ(T)].

The right-hand side is a monic polynomial of degree n. Its values at n + 1 points of a circle give
it, and its roots are the n multipliers, no more and no fewer. That the leading coefficient comes
out as one and that one multiplier comes out as trivial are two checks of the truncation.

Half-wave symmetric cycles are taken over half a period, in which the slope repeats: the
multipliers ν of the half-period map (followed by the reflection) have the squares ν².
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aeroflutter.errors import ConvergenceError
from aeroflutter.model.lure import LureFamily
from aeroflutter.orbits.harmonic._kernel_hill import determinants
from aeroflutter.orbits.harmonic.balance import Cycle
from aeroflutter.orbits.harmonic.moment import Answer

__all__ = ["Multipliers", "multipliers"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

_MARGIN = 1.3  # radius of the circle of samples over the spectral radius of the mean system
_COUNTS = (8, 12, 16, 24, 32, 48, 64, 96, 128)  # truncations tried, one after the other


@dataclass(frozen=True, eq=False)
class Multipliers:
    """Floquet multipliers of a cycle.

    Attributes
    ----------
    all
        Multipliers over one period, shape (n,): the trivial one, then by falling modulus.
    half
        Of symmetric cycles, those of the half-period map with reflection, in the same order;
        None otherwise.
    error
        Of `basic`; largest of: distance of the trivial multiplier from one, of the leading
        coefficient from one, and of the two largest other ones from those of the truncation before.
    """

    all: Complex
    half: Complex | None
    error: float

    @property
    def basic(self) -> Complex:
        """Those of the half-period map where there is one, else those of the period."""
        return self.all if self.half is None else self.half

    @property
    def error_of_all(self) -> float:
        """The error of `all`, which are the squares of `half` where there is one."""
        if self.half is None:
            return self.error
        return 2 * self.error * max(1.0, float(np.max(np.abs(self.half[1:3]))))


def multipliers(
    family: LureFamily, cycle: Cycle, answer: Answer, symmetric: bool, tolerance: float = 1e-4
) -> Multipliers:
    """Multipliers of a cycle from Hill's determinant.

    Parameters
    ----------
    family : LureFamily
    cycle : Cycle
    answer : Answer
        Of the spring to the cycle.
    symmetric : bool
        Whether the cycle is half-wave symmetric.
    tolerance : float
        The truncation is raised until the multipliers move by less; at 128 harmonics of the
        period (of the half period where the cycle is symmetric) they are left as they are.
    """
    sign = -1.0 if symmetric else 1.0
    hill = _Hill(family, cycle, answer, 2 if symmetric else 1)
    before, error = np.empty(0, dtype=complex), np.inf
    for count in _COUNTS:
        roots, leading = hill.roots(count)
        trivial = int(np.argmin(np.abs(roots - sign)))
        others = np.delete(roots, trivial)
        others = others[np.argsort(-np.abs(others), kind="stable")]
        if before.size:
            shifts = [np.min(np.abs(before - root)) for root in (roots[trivial], *others[:2])]
            moved = max(abs(leading - 1.0), *shifts)
            error = float(max(abs(roots[trivial] - sign), moved))
            if moved < tolerance:  # what is left of the error is the cycle's own
                break
        before = roots
    basic = np.concatenate((roots[trivial : trivial + 1], others)) * sign
    return Multipliers(basic**2, basic, error) if symmetric else Multipliers(basic, None, error)


class _Hill:
    """The determinant of one cycle, sampled on a circle of multipliers."""

    def __init__(self, family: LureFamily, cycle: Cycle, answer: Answer, fold: int) -> None:
        self.answer, self.fold = answer, fold
        self.omega = fold * cycle.omega
        self.period = 2 * np.pi / self.omega
        system = family.at(cycle.speed)
        self.P0 = float(answer.slope(1)[0].real)
        self.mean = _Modes.of(system.closed(self.P0), system.b, system.c)
        self.mean_roots = np.exp(self.mean.poles * self.period)
        self.radius = _MARGIN * max(1.0, float(np.max(np.abs(self.mean_roots))))
        size = system.order + 1
        # the points come in conjugate pairs, at which the determinant is conjugate
        self.nodes = self.radius * np.exp(2j * np.pi * (np.arange(size) + 0.5) / size)
        self.upper = self.nodes[: (size + 1) // 2]
        self.sigma = np.log(self.upper) / (2 * np.pi)

    def roots(self, count: int) -> tuple[Complex, complex]:
        """Zeros and leading coefficient of the polynomial, from harmonics -count … count."""
        n = np.arange(-count, count + 1)
        P = self.answer.slope(2 * count * self.fold + 1)[:: self.fold]
        two_sided = np.concatenate((np.conj(P[:0:-1]), P))
        kernel = two_sided[n[:, None] - n[None, :] + 2 * count]
        np.fill_diagonal(kernel, 0.0)
        H = self.mean.transfer((self.sigma[:, None] + 1j * n) * self.omega)
        if self.answer.held.at.size:
            kernel = kernel - _held_kernel(self.answer, self.fold, n, self.sigma)
        D = determinants(H[:, :, None] * kernel + np.eye(n.size))
        return self._polynomial(D * np.prod(self.upper[:, None] - self.mean_roots, axis=1))

    def _polynomial(self, upper: Complex) -> tuple[Complex, complex]:
        """Zeros and leading coefficient of the real polynomial with these values at `upper`."""
        size = self.nodes.size
        values = np.empty(size, dtype=complex)
        values[: upper.size] = upper
        values[size - upper.size :] = np.conj(upper[::-1])
        # equidistant points on a circle: the inverse of their Vandermonde matrix is its adjoint
        powers = (self.nodes[:, None] / self.radius) ** np.arange(size)
        scaled = (np.conj(powers.T) @ values).real / size
        if not np.all(np.isfinite(scaled)):
            raise ConvergenceError("Hill's determinant overflows")
        roots = self.radius * np.asarray(np.roots(scaled[::-1]), dtype=np.complex128)
        return roots, complex(scaled[-1] / self.radius ** (size - 1))


@dataclass(frozen=True, eq=False)
class _Modes:
    """Partial fractions of c (sI - A)^-1 b."""

    poles: Complex
    residues: Complex

    @classmethod
    def of(cls, A: Real, b: Real, c: Real) -> _Modes:
        poles, right = np.linalg.eig(A)
        return cls(poles, (c @ right) * np.linalg.solve(right, b))

    def transfer(self, s: Complex) -> Complex:
        return np.asarray(np.sum(self.residues / (s[..., None] - self.poles), axis=-1))


def _held_kernel(answer: Answer, fold: int, n: NDArray[np.intp], sigma: Complex) -> Complex:
    """Share of each v_n in each harmonic of the memory, shape (samples, 2m+1, 2m+1).

    σ = s/ω of the determinant's own frequency. A stretch on which the moment holds y(θ_r) gives
    (1/T) ∫ e^(-(s + jmω)τ) dτ · e^((s + jnω)τ_r).
    """
    total = np.zeros((sigma.size, n.size, n.size), dtype=complex)
    held = answer.held
    own = held.start < held.start.min(initial=np.inf) + 2 * np.pi / fold - 1e-9
    for at, start, end in zip(held.at[own], held.start[own], held.end[own], strict=True):
        at, start, end = at * fold, start * fold, end * fold
        rate = sigma[:, None] + 1j * n
        # measured from θ_r, so that no exponential overflows
        weight = (np.exp(-rate * (start - at)) - np.exp(-rate * (end - at))) / rate
        phase = np.exp(1j * (n[None, :] - n[:, None]) * at)
        total += weight[:, :, None] * phase / (2 * np.pi)
    return total
