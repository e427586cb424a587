"""From a bound on |1/G + N| to a region of speed and frequency that holds the cycle.

At a given amplitude z(ω, U) = 1/G(jω; U) + N(a) vanishes at the describing function's point. The
region is the part W around it in which |z| <= s, the smallest s found for which the bound σ stays
below s all over W. Then

- there is no cycle on the rim of W, since |z| = s > σ there;
- the equation of the cycle, z = Δ with |Δ| <= σ, has the same degree on W as z = 0, which is
  ±1 as W is the image of a disc under a local inverse of z: there is a cycle in W.

W is sampled on rays; the speeds and frequencies of its rim are widened by what lies between rays.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aeroflutter.model.lure import LureFamily, inverse_transfer_gradient

__all__ = ["Regions", "find_regions"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Flags = NDArray[np.bool_]
Index = NDArray[np.intp]

Bound = Callable[[Index, Real, Real], Real]
"""σ of the points with these indices (m,) at speeds and frequencies (m, j), same shape."""

_RAYS = 16
_RINGS = (0.5, 1.0)
_ROUNDS = 8
_HEADROOM = 1.02  # s over the largest σ sampled
_WIDEST = 0.6  # |ln U| and |ln ω| beyond which a region is not followed
_NEWTON = 8


@dataclass(frozen=True, eq=False)
class Regions:
    """Regions around m points.

    Attributes
    ----------
    found
        Whether there is one, (m,).
    radius
        s, (m,); the last one tried where there is none.
    speed, omega
        Lowest and highest speed and frequency of the region, (m, 2); NaN where there is none.
    """

    found: Flags
    radius: Real
    speed: Real
    omega: Real


def find_regions(family: LureFamily, N: Complex, speed: Real, omega: Real, bound: Bound) -> Regions:
    """The regions of m points of a describing function.

    Parameters
    ----------
    N : complex array (m,)
        Describing function at each point.
    speed, omega : array (m,)
        Where 1/G(jω; U) + N = 0.
    bound : callable
    """
    disc = _Discs(family, N, speed, omega)
    sigma = bound(np.arange(N.size), speed[:, None], omega[:, None])[:, 0]
    found = np.zeros(N.size, dtype=bool)
    radius = _HEADROOM * sigma
    ends = np.full((2, N.size, 2), np.nan)
    alive = np.isfinite(sigma)
    for _ in range(_ROUNDS):
        at = np.flatnonzero(alive & ~found)
        if at.size == 0:
            break
        U, w, good = disc.points(at, radius[at])
        alive[at[~good]] = False
        at, U, w = at[good], U[good], w[good]
        worst = np.maximum(np.max(bound(at, U, w), axis=1, initial=0.0), sigma[at])
        alive[at[~np.isfinite(worst)]] = False
        done = worst * _HEADROOM <= radius[at] * (1 + 1e-12)
        for k, (values, centre) in enumerate(((U, speed), (w, omega))):
            ends[k, at[done]] = _widened(values[done][:, -_RAYS:], centre[at[done]])
        found[at[done]] = True
        more = ~done & np.isfinite(worst)
        radius[at[more]] = 1.1 * _HEADROOM * worst[more]
    return Regions(found, radius, ends[0], ends[1])


def _widened(rim: Real, centre: Real) -> Real:
    """Range of the rim's samples, widened by what may lie between two rays."""
    slack = 1 / np.cos(np.pi / _RAYS)
    low = centre + slack * (rim.min(axis=1) - centre)
    high = centre + slack * (rim.max(axis=1) - centre)
    return np.stack((low, high), axis=1)


class _Discs:
    """The inverse of z around each point, by Newton's method from ring to ring."""

    def __init__(self, family: LureFamily, N: Complex, speed: Real, omega: Real) -> None:
        self.family, self.N = family, N
        self.start = np.stack((np.log(speed), np.log(omega)), axis=-1)
        self.side = np.sign(self._z(self.start, N)[2])

    def points(self, at: Index, radius: Real) -> tuple[Real, Real, Flags]:
        """Speeds and frequencies (k, j) on the rings of the discs `at`, and which exist."""
        rays = np.exp(2j * np.pi * np.arange(_RAYS) / _RAYS)
        origin, N = self.start[at, None, :], self.N[at, None]
        x = np.repeat(origin, _RAYS, axis=1)
        good = np.ones(at.size, dtype=bool)
        rings = []
        for ring in _RINGS:
            target = ring * radius[:, None] * rays
            x = self._solve(x, target, N, origin)
            z, _, det = self._z(x, N)
            exact = np.abs(z - target) <= 1e-6 * np.abs(target) + 1e-14
            inside = np.max(np.abs(x - origin), axis=-1) < _WIDEST
            # the sign of the Jacobian tells that no fold of z was crossed
            good &= np.all(exact & inside & (np.sign(det) == self.side[at, None]), axis=1)
            rings.append(x)
        points = np.concatenate(rings, axis=1)
        return np.exp(points[..., 0]), np.exp(points[..., 1]), good

    def _solve(self, x: Real, target: Complex, N: Complex, origin: Real) -> Real:
        """Where z = target, by Newton's method; whatever was reached where it fails."""
        for _ in range(_NEWTON):
            z, gradient, det = self._z(x, N)
            step = _real_pair(gradient, target - z, det)
            size = np.max(np.abs(step), axis=-1, keepdims=True)
            x = x + step * np.minimum(1.0, 0.2 / np.maximum(size, 1e-300))
            x = np.clip(x, origin - 2 * _WIDEST, origin + 2 * _WIDEST)
            if np.max(size, initial=0.0) < 1e-9:
                break
        return x

    def _z(self, x: Real, N: Complex) -> tuple[Complex, Complex, Real]:
        """z, its gradient in (ln U, ln ω) and the determinant of that."""
        U, w = np.exp(x[..., 0]), np.exp(x[..., 1])
        (A, b), (dA, db) = self.family.stack(U), self.family.derivative(U)
        Z, Z_s, Z_U = inverse_transfer_gradient(A, b, self.family.c, dA, db, 1j * w)
        gradient = np.stack((U * Z_U, 1j * w * Z_s), axis=-1)
        return Z + N, gradient, (np.conj(gradient[..., 0]) * gradient[..., 1]).imag


def _real_pair(gradient: Complex, missing: Complex, det: Real) -> Real:
    """Changes of (ln U, ln ω) that change z by `missing`."""
    by_U, by_w = gradient[..., 0], gradient[..., 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        step = np.stack(
            (
                (missing.real * by_w.imag - missing.imag * by_w.real) / det,
                (by_U.real * missing.imag - by_U.imag * missing.real) / det,
            ),
            axis=-1,
        )
    return np.nan_to_num(step, nan=0.0, posinf=1.0, neginf=-1.0)
