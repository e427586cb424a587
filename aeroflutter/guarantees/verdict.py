"""When a describing function can be believed: a region that holds the cycle, or the reason why not.

Around every point of a describing function's curve a band of speed at its amplitude is sought that
is proved to contain a cycle (docs/theory/validity.md). The bands along a curve together are a tube
that the true family of cycles cannot leave; its section at the point's own speed is the band of
amplitude. Where the proof's hypotheses fail the calibrated distortion stands in.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aeroflutter.guarantees.bounds import Bounds, mean_square_bounds, supremum_bounds
from aeroflutter.guarantees.distortion import doubtful, expected_error
from aeroflutter.guarantees.law import Law, Unfit, law_of
from aeroflutter.guarantees.loop import highest_harmonic, sample_loop
from aeroflutter.guarantees.region import Regions, find_regions
from aeroflutter.model.lure import AnyFamily, LureFamily, as_lure
from aeroflutter.springs import Cubic, Springs, each

if TYPE_CHECKING:
    from aeroflutter.orbits.describing import DescribingCurve

__all__ = ["METHODS", "Guarantees", "guarantees", "guarantees_at"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Flags = NDArray[np.bool_]
Index = NDArray[np.intp]

_REACHES = (1.05, 1.2, 1.5, 2.0)  # pitch up to which a cubic's slope is bounded, over the amplitude
_BATCH = 2000  # triples evaluated at once
_SLOWEST = 0.6  # lowest frequency a region may reach, over the point's

METHODS = ("mean square", "supremum")


@dataclass(frozen=True, kw_only=True, eq=False)
class Guarantees:
    """What is proved about m points of a describing function.

    Attributes
    ----------
    guaranteed
        Whether a half-wave symmetric cycle of the point's amplitude (as first harmonic) is proved
        to exist in the bands, (m,).
    reason
        Why there is no guarantee; empty where there is one.
    method
        "mean square" or "supremum": the argument that gave the narrower band; "" where none did.
    speed, omega
        Bands of U* and of reduced frequency that contain that cycle, (m, 2); NaN where none.
    amplitude
        Band of the first harmonic of cycles at the point's own speed, radians, (m, 2): NaN where
        there is no guarantee, or where the curve given ends inside the band.
    exists_at_speed
        Whether a cycle is proved to exist at the point's own speed in that band, (m,). It is not
        beside a fold, where the band contains two cycles or none.
    rest
        Bound on the higher harmonics of the cycle, radians, (m,): see `Bounds.rest`.
    ratio
        Contraction ratio, (m,); the smaller, the safer.
    sigma
        Bound on ``|1/G + N|`` at the point, (m,).
    expected_error
        Calibrated 95 % limit of the relative error of the speed, from the distortion, (m,).
    doubtful
        Where there is no guarantee: whether the distortion says that the speed is likely to be
        off by more than one per cent, (m,).
    """

    guaranteed: Flags
    reason: tuple[str, ...]
    method: tuple[str, ...]
    speed: Real
    omega: Real
    amplitude: Real
    exists_at_speed: Flags
    rest: Real
    ratio: Real
    sigma: Real
    expected_error: Real
    doubtful: Flags


def guarantees(family: AnyFamily, spring: Springs, curve: DescribingCurve) -> Guarantees:
    """The guarantee of every point of a describing function's curve.

    Parameters
    ----------
    family, spring
        As for the curve.
    curve : DescribingCurve
        From `describing_curve`: bands of amplitude need neighbouring points.
    """
    found = guarantees_at(
        family,
        spring,
        amplitude=curve.amplitude,
        bias=curve.bias,
        speed=curve.speed,
        omega=curve.k,
        distortion=curve.distortion,
    )
    for number in np.unique(curve.family):
        mine = np.flatnonzero(curve.family == number)
        _amplitude_bands(found, mine, curve.amplitude[mine], curve.speed[mine])
    return found


def guarantees_at(
    family: AnyFamily,
    spring: Springs,
    *,
    amplitude: ArrayLike,
    bias: ArrayLike,
    speed: ArrayLike,
    omega: ArrayLike,
    distortion: ArrayLike,
) -> Guarantees:
    """The same for single points, without bands of amplitude.

    Parameters
    ----------
    amplitude, bias : array (m,)
        Radians.
    speed, omega : array (m,)
        U* and reduced frequency.
    distortion : array (m,)
        Predicted distortion of each point.
    """
    a, B, U, w, d = (
        np.atleast_1d(np.asarray(value, dtype=float))
        for value in (amplitude, bias, speed, omega, distortion)
    )
    builder = _Builder(a.size, d)
    if len(each(spring)) > 1:
        builder.refuse(np.ones(a.size, dtype=bool), "there are several springs: bands are for one")
        return builder.result()
    family, spring = as_lure(family), each(spring)[0]
    try:
        law = law_of(family, spring)
    except Unfit as unfit:
        builder.refuse(np.ones(a.size, dtype=bool), str(unfit))
        return builder.result()
    off_centre = np.abs(B - law.centre) > 1e-9 * (law.spring.scale + a)
    builder.refuse(off_centre, "the cycle has a bias of its own: it is not half-wave symmetric")
    builder.refuse(_straight(law, a), "the spring is linear at this amplitude")
    at = np.flatnonzero(builder.open)
    if at.size:
        builder.take(at, _attempts(family, law, a[at], U[at], w[at]))
    return builder.result()


def _straight(law: Law, amplitude: Real) -> Flags:
    d = law.spring.describing(amplitude, np.zeros_like(amplitude))
    return np.asarray((np.abs(d.dn_p_dA) + np.abs(d.dn_q_dA)) * amplitude < 1e-12)


@dataclass(frozen=True, eq=False)
class _Attempt:
    """One argument's regions, with the bounds at the points themselves."""

    method: str
    regions: Regions
    bounds: Bounds


def _attempts(family: LureFamily, law: Law, a: Real, U: Real, w: Real) -> list[_Attempt]:
    """Every argument that applies to the law."""
    N = law.spring.describing(a, np.zeros_like(a)).N
    highest = highest_harmonic(family, U, _SLOWEST * w)
    F = law.harmonics(a, highest)
    limits: list[tuple[str, float]] = []
    if not law.memory:
        reaches = _REACHES if isinstance(law.spring, Cubic) else (1.0,)
        limits += [(METHODS[0], reach) for reach in reaches]
    if np.isfinite(law.bound):
        limits.append((METHODS[1], 1.0))
    found = []
    for method, reach in limits:
        problem = _Problem(family, law, method, a, F, highest, reach * a)
        regions = find_regions(family, N, U, w, problem.sigma)
        found.append(_Attempt(method, regions, problem.bounds(np.arange(U.size), U, w)))
    return found


@dataclass(frozen=True, eq=False)
class _Problem:
    """One argument at many points."""

    family: LureFamily
    law: Law
    method: str
    amplitude: Real
    F: Complex
    highest: int
    limit: Real

    def sigma(self, at: Index, U: Real, w: Real) -> Real:
        """σ at speeds and frequencies (m, j) of the points `at` (m,)."""
        index, flat_U, flat_w = np.repeat(at, U.shape[1]), U.ravel(), w.ravel()
        parts = [
            self.bounds(index[part], flat_U[part], flat_w[part]).sigma
            for part in (slice(i, i + _BATCH) for i in range(0, index.size, _BATCH))
        ]
        return np.concatenate([np.empty(0), *parts]).reshape(U.shape)

    def bounds(self, at: Index, U: Real, w: Real) -> Bounds:
        """The bounds at the points `at` with speeds and frequencies of their own, (m,)."""
        loop = sample_loop(self.family, U, w, self.highest)
        a, F = self.amplitude[at], self.F[at]
        if self.method == "supremum":
            return supremum_bounds(self.law, a, F, loop)
        return mean_square_bounds(self.law, a, F, loop, self.limit[at])


class _Builder:
    """Fills the arrays of the result."""

    def __init__(self, m: int, distortion: Real) -> None:
        self.open = np.ones(m, dtype=bool)
        self.found = np.zeros(m, dtype=bool)
        self.reason, self.method = [""] * m, [""] * m
        self.speed, self.omega = np.full((m, 2), np.nan), np.full((m, 2), np.nan)
        self.rest, self.ratio, self.sigma = (np.full(m, np.nan) for _ in range(3))
        self.distortion = distortion

    def refuse(self, where: Flags, reason: str) -> None:
        """Leave points without a guarantee."""
        for i in np.flatnonzero(where & self.open):
            self.reason[i] = reason
        self.open &= ~where

    def take(self, at: Index, attempts: list[_Attempt]) -> None:
        """Of each point the attempt with the narrowest band of speed, or the nearest to one."""
        widths = [
            np.where(t.regions.found, np.ptp(t.regions.speed, axis=1), np.inf) for t in attempts
        ]
        best = np.argmin(widths, axis=0)
        closest = np.argmin([t.bounds.ratio for t in attempts], axis=0)
        for j, i in enumerate(at):
            if attempts[best[j]].regions.found[j]:
                self._found(i, attempts[best[j]], j)
            else:
                self._not_found(i, attempts[closest[j]].bounds, j)

    def _found(self, i: int, attempt: _Attempt, j: int) -> None:
        self.found[i], self.method[i] = True, attempt.method
        self.speed[i], self.omega[i] = attempt.regions.speed[j], attempt.regions.omega[j]
        self.ratio[i], self.sigma[i] = attempt.bounds.ratio[j], attempt.bounds.sigma[j]
        self.rest[i] = attempt.bounds.rest[j]

    def _not_found(self, i: int, bounds: Bounds, j: int) -> None:
        self.ratio[i], self.sigma[i] = bounds.ratio[j], bounds.sigma[j]
        if bounds.ratio[j] < 1:
            self.reason[i] = "the bound is too wide: its region of speed does not close"
        else:
            self.reason[i] = (
                "the loop does not filter the harmonics enough "
                f"(contraction ratio {bounds.ratio[j]:.2f}, needs to be below 1)"
            )

    def result(self) -> Guarantees:
        """The result, without bands of amplitude."""
        return Guarantees(
            guaranteed=self.found,
            reason=tuple(self.reason),
            method=tuple(self.method),
            speed=self.speed,
            omega=self.omega,
            amplitude=np.full(self.speed.shape, np.nan),
            exists_at_speed=np.zeros(self.found.shape, dtype=bool),
            rest=self.rest,
            ratio=self.ratio,
            sigma=self.sigma,
            expected_error=expected_error(self.distortion),
            doubtful=~self.found & doubtful(self.distortion),
        )


def _amplitude_bands(found: Guarantees, mine: Index, a: Real, U: Real) -> None:
    """Sections of the tube of speed bands at each point's own speed, along one family.

    Walking away from the point along the curve, the section ends at the first neighbour whose band
    no longer contains the speed. If those at either end lie on opposite sides of it, the continuum
    of cycles that joins them crosses the speed: a cycle exists there.
    """
    low, high = found.speed[mine, 0], found.speed[mine, 1]
    for j, i in enumerate(mine):
        if not found.guaranteed[i]:
            continue
        ends = [_leaves(low, high, U[j], j, direction) for direction in (-1, 1)]
        if any(not found.guaranteed[mine[end]] for end in ends if end is not None) or None in ends:
            continue
        first, last = (end for end in ends if end is not None)
        stretch = a[first : last + 1]
        found.amplitude[i] = stretch.min(), stretch.max()
        found.exists_at_speed[i] = (U[j] < low[first]) != (U[j] < low[last])


def _leaves(low: Real, high: Real, speed: float, start: int, direction: int) -> int | None:
    """First index from `start` on whose band misses the speed; None at the curve's end."""
    n = start + direction
    while 0 <= n < low.size and low[n] <= speed <= high[n]:
        n += direction
    return n if 0 <= n < low.size else None
