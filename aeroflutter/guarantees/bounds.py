"""Bounds on |1/G(jω) + N(a)| at a half-wave symmetric cycle; proofs in docs/theory/validity.md.

Two arguments, each a contraction of the higher harmonics η (odd k >= 3) of y = a sin θ + η at
given amplitude a and frequency ω:

- in the mean square, for static springs of incremental slope in [p, q] (Mees & Bergen 1975);
- in the supremum norm, for springs F = s y - u with u Lipschitz, bounded and monotone: static
  springs with straight ends, and hysteresis, whose memory is such a u.

Infinite sums end in a bound on their tail, suprema over a grid in a bound on what lies between
its points; round-off is not accounted for.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aeroflutter.guarantees.law import Law
from aeroflutter.guarantees.loop import LoopSamples

__all__ = ["Bounds", "mean_square_bounds", "supremum_bounds"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

_ROUNDS, _SETTLED = 6, 0.98  # of the reach, which shrinks from round to round
_KEPT = 8  # higher harmonics of the first iterate whose effect is computed; the rest is bounded


@dataclass(frozen=True, eq=False)
class Bounds:
    """Bounds at m triples of amplitude, speed and frequency.

    Attributes
    ----------
    sigma
        Bound on |1/G + N|, (m,); infinite where the argument fails.
    rest
        Bound on the higher harmonics: on |η| for the supremum norm, on its root mean square
        times √2 for the mean square, radians, (m,).
    ratio
        Contraction ratio, (m,); the argument needs it below one.
    reach
        Bound on |η|, radians, (m,).
    """

    sigma: Real
    rest: Real
    ratio: Real
    reach: Real


def mean_square_bounds(
    law: Law, amplitude: Real, F: Complex, loop: LoopSamples, limit: Real
) -> Bounds:
    """Mees and Bergen's bound, with the harmonics of the answer weighted one by one.

    Parameters
    ----------
    amplitude : array (m,)
    F : complex array (m, n)
        Harmonics 1, 3, … of the answer to a sin θ.
    loop : LoopSamples
    limit : array (m,)
        Pitch up to which a cubic's slope is bounded: the bounds are about cycles that stay below
        it, and fail where the one that they give might not. Immaterial for bounded slopes.
    """
    p, q = law.slopes(limit)
    c, r = 0.5 * (p + q), 0.5 * (q - p)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        K = 1 / np.abs(loop.Z[:, 1:] + c[:, None])
        beyond = loop.tail / np.maximum(1 - np.abs(c) * loop.tail, 0)
        ratio = r * np.maximum(K.max(axis=1), beyond)
        left = law.variation(amplitude) / np.pi / np.sqrt(6.0 * loop.ks[-1] ** 3)
        filtered = np.sqrt(np.sum((K * np.abs(F[:, 1:])) ** 2, axis=1) + (beyond * left) ** 2)
        rest = np.where(ratio < 1, filtered / (1 - ratio), np.inf)
        first = -F[:, 1:] / (loop.Z[:, 1:] + c[:, None])
        width = np.sqrt(np.sum(K**2, axis=1) + _squares(loop, beyond))
        reach = sum(_supremum(first, loop, beyond, law.variation(amplitude))) + width * r * rest
        inside = np.isfinite(law.bound) | (amplitude + reach <= limit)
        dropped = np.sqrt(np.sum(np.abs(first[:, _KEPT:]) ** 2, axis=1)) + beyond * left
        second = _shift(law, amplitude, F, first) + r * (ratio * rest + dropped) / amplitude
        sigma = np.minimum(r * rest / amplitude, second)
        sigma = np.where(inside & np.isfinite(rest), sigma, np.inf)
    return Bounds(sigma, rest, ratio, reach)


def supremum_bounds(law: Law, amplitude: Real, F: Complex, loop: LoopSamples) -> Bounds:
    """The bound by the supremum norm.

    Parameters
    ----------
    amplitude : array (m,)
    F : complex array (m, n)
        Harmonics 1, 3, … of the answer to a sin θ.
    loop : LoopSamples
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        H = 1 / (loop.Z[:, 1:] + law.stiffness)
        beyond = loop.tail / np.maximum(1 - abs(law.stiffness) * loop.tail, 0)
        kernel = _Kernel(H, loop, beyond)
        first, between, tail = _supremum(H * F[:, 1:], loop, beyond, law.variation(amplitude))
        first = first + between + tail
        # η is filtered out of u, and |u| is bounded: every cycle lies within this reach
        reach = kernel.norm(np.full(amplitude.shape, np.pi)) * law.bound
        for _ in range(_ROUNDS):
            before = reach
            ratio = law.lipschitz * kernel.norm(law.active(amplitude, reach))
            reach = np.minimum(reach, first + ratio * reach)
            reach = np.where(ratio < 1, np.minimum(reach, first / (1 - ratio)), reach)
            if np.all(reach >= _SETTLED * before):
                break
        width = law.active(amplitude, reach)
        ratio = law.lipschitz * kernel.norm(width)
        share = 4 / np.pi * np.sin(width / 2)
        by_reach = law.lipschitz * share / amplitude
        dropped = np.sum(np.abs(H * F[:, 1:])[:, _KEPT:], axis=1) + tail
        second = _shift(law, amplitude, F, -H * F[:, 1:]) + by_reach * (ratio * reach + dropped)
        good = (ratio < 1) & np.isfinite(reach)
        sigma = np.where(good, np.minimum(by_reach * reach, second), np.inf)
    return Bounds(sigma, reach, ratio, reach)


class _Kernel:
    """κ(θ) = 2 Re Σ H_k e^(jkθ) of the higher harmonics, on a grid over half its period."""

    def __init__(self, H: Complex, loop: LoopSamples, beyond: Real) -> None:
        ks = loop.ks[1:]
        self.samples = _samples(ks)
        values = 2 * _waves(H, ks, self.samples)[:, : self.samples // 2]
        self.step = 2 * np.pi / self.samples
        # |κ| differs from its sample by ∫|κ'|: Cauchy and Schwarz, over all cells at once
        slope = np.sqrt(2 * np.sum((ks * np.abs(H)) ** 2, axis=1))
        self.slack = self.step / np.sqrt(12) * slope + np.sqrt(2 * _squares(loop, beyond))
        total = np.cumsum(np.abs(values), axis=1) * self.step
        zero = np.zeros((len(H), 1))
        self.total = np.concatenate((zero, total, total[:, -1:] + total), axis=1)

    def norm(self, width: Real) -> Real:
        """Largest (1/2π) ∫ |κ| over a stretch of this width in each half period, (m,)."""
        half = self.samples // 2
        width = np.where(np.isfinite(width), width, np.pi)
        cells = np.minimum(np.ceil(width / self.step).astype(int) + 1, half)
        ends = np.arange(half) + cells[:, None]
        masses = np.take_along_axis(self.total, ends, axis=1) - self.total[:, :half]
        return np.max(masses, axis=1) / np.pi + self.slack


def _samples(ks: NDArray[np.intp]) -> int:
    return 1 << int(np.ceil(np.log2(8 * ks[-1])))


def _waves(coefficients: Complex, ks: NDArray[np.intp], samples: int) -> Real:
    """Re Σ c_k e^(jkθ) at `samples` angles, (m, samples)."""
    spectrum = np.zeros((len(coefficients), samples // 2 + 1), dtype=complex)
    spectrum[:, ks] = 0.5 * samples * coefficients
    return np.asarray(np.fft.irfft(spectrum, samples, axis=1))


def _supremum(
    coefficients: Complex, loop: LoopSamples, beyond: Real, variation: Real
) -> tuple[Real, Real, Real]:
    """Of Re Σ c_k e^(jkθ): largest sample, bound on what lies between, and on the tail."""
    ks = loop.ks[1:]
    samples = _samples(ks)
    largest = np.max(np.abs(_waves(coefficients, ks, samples)), axis=1)
    between = np.pi / samples * np.sum(ks * np.abs(coefficients), axis=1)
    return largest, between, beyond * variation / (2 * np.pi * ks[-1])


def _shift(law: Law, amplitude: Real, F: Complex, first: Complex) -> Real:
    """How far the first iterate η¹ moves the describing function, |N(a sin θ + η¹) - N(a)|.

    Of η¹ the first harmonics `first` are taken, as many as `_KEPT`.
    """
    Y = np.zeros((amplitude.size, 2 * _KEPT + 2), dtype=complex)
    Y[:, 1] = -1j * amplitude
    Y[:, 3::2] = first[:, :_KEPT]
    return np.abs(law.first_harmonic(Y) - F[:, 0]) / amplitude


def _squares(loop: LoopSamples, beyond: Real) -> Real:
    """Bound on Σ |H_k|² beyond the last harmonic."""
    return beyond**2 * (1 + (loop.ks[-1] + 2) / (2.0 if loop.decay == 1 else 6.0))
