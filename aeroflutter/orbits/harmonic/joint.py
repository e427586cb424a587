"""The monodromy of a cycle on which several springs act, each with its own segments or slope.

A perturbation (v, δh) of the cycle obeys v' = A v - Σ b_i (p_i(θ) c_i v - δh_i), δh_i being kept
while the memory of spring i is held, made anew at an extremum of its y, and none while its slider
moves or lies at a stop. Between the changes of all springs the slopes of those of straight pieces
are constant; where no other kind is there the product of exponentials is exact. Where a law jumps
by J as g x passes a level, the time at which it does moves with v (Aizerman & Gantmakher 1958):

    v⁺ = v⁻ - b J (g v⁻)/(g x'⁻).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from aeroflutter.model.system import System
from aeroflutter.orbits.harmonic.moment import Answer, Segmented, Switched

__all__ = ["monodromy"]

Real = NDArray[np.float64]

_HIGHEST = 512  # harmonics of the slope of a law known by its values
_TAIL = 256  # further harmonics of a motion whose springs jump
_STEPS = (64, 4096)  # fewest and most steps a period where a slope is smooth
_CLOSE = 1e-8  # change of the product, relative to it, at which there are enough
_GAUSS = 0.5 - np.sqrt(3) / 6
_TURN = 2 * np.pi
_ROUND_OFF = 1e-9  # of an angle


@dataclass(frozen=True)
class _Piecewise:
    """A spring of straight pieces along the cycle."""

    start: Real
    slopes: Real
    made: Real
    jumps: Switched | None = None

    @classmethod
    def of(cls, one: Answer) -> _Piecewise | None:
        """Those of an answer, if it has such."""
        if isinstance(one, Segmented):
            return cls(one.start, one.slopes, one.made)
        if isinstance(one, Switched):
            slopes = np.full(one.start.size, one.beta)
            return cls(one.start, slopes, np.full(one.start.size, np.nan), one)
        return None

    def jump(self, theta: float) -> int:
        """Number of the jump at an angle, -1 if there is none."""
        if self.jumps is None or self.jumps.straight:
            return -1
        away = np.abs((self.start - theta + 0.5) % _TURN - 0.5)
        return int(np.argmin(away)) if away.min() < _ROUND_OFF else -1

    def kick(self, system: System, i: int, theta: float, rates: Real | None) -> Real:
        """What a jump of spring i at an angle makes of v, (n, n); the unit matrix without one.

        `rates` are those with which q passes its level at the jumps, just before them.
        """
        law, unit, at = self.jumps, np.eye(system.order), self.jump(theta)
        if law is None or rates is None or at < 0:
            return unit
        g = _passing(system, i, law)
        return np.asarray(unit - np.outer(system.B[:, i] * law.jumps[at], g) / rates[at])

    def at(self, theta: float) -> int:
        """The segment at an angle."""
        past = (theta - self.start[0]) % _TURN + self.start[0]
        return int(np.searchsorted(self.start, past, side="right") - 1)


def monodromy(system: System, omega: float, answers: Sequence[Answer], fold: int) -> Real:
    """Derivative of state and memories after a period (over `fold`) by those before it.

    Parameters
    ----------
    system
        With m outputs.
    omega
        Reduced frequency of the cycle.
    answers
        Of each spring to its y.
    fold
        Two for half a period.

    Returns
    -------
    array (n+m, n+m)
        Memories that are none, or are erased on the way, give zero eigenvalues.
    """
    pieces = [_Piecewise.of(one) for one in answers]
    angles = _changes(pieces, fold)
    rates = _rates(system, omega, answers)
    if all(part is not None for part in pieces):
        return _product(system, omega, pieces, angles, None, 1, rates)
    slopes = [_slope(one) for one in answers]
    steps = _STEPS[0]
    coarse = _product(system, omega, pieces, angles, slopes, steps, rates)
    while True:
        fine = _product(system, omega, pieces, angles, slopes, 2 * steps, rates)
        close = np.max(np.abs(fine - coarse)) <= 15 * _CLOSE * np.max(np.abs(fine))
        steps *= 2
        if close or steps >= _STEPS[1]:
            return np.asarray(fine + (fine - coarse) / 15)
        coarse = fine


def _passing(system: System, i: int, law: Switched) -> Real:
    """g of what passes a level at the jumps of spring i, (n,): y or y'."""
    return np.asarray(system.C[i] @ system.A if law.order == 1 else system.C[i])


def _changes(pieces: Sequence[_Piecewise | None], fold: int) -> Real:
    """Angles at which some law changes, from 0 to the end of a period (over `fold`)."""
    window = _TURN / fold
    places = [part.start % _TURN for part in pieces if part is not None]
    inside = np.concatenate([np.zeros(0), *places])
    inside = np.unique(np.concatenate(([0.0, window], inside[inside < window])))
    return np.asarray(inside[np.concatenate(([True], np.diff(inside) > 0.0))])


def _slope(one: Answer) -> Callable[[Real], Real]:
    """p(θ) of a smooth law."""
    P = 2.0 * one.slope(_HIGHEST)
    P[0] *= 0.5
    large = np.flatnonzero(np.abs(P) >= 1e-14 * np.max(np.abs(P)))
    P = P[: int(large[-1]) + 1 if large.size else 1]
    return lambda theta: (np.exp(1j * np.outer(theta, np.arange(P.size))) @ P).real


def _product(
    system: System,
    omega: float,
    pieces: Sequence[_Piecewise | None],
    angles: Real,
    smooth: Sequence[Callable[[Real], Real]] | None,
    steps: int,
    rates: Sequence[Real | None],
) -> Real:
    n, m = system.B.shape
    total = np.eye(n + m)
    for begin, end in pairwise(angles):
        slopes, held = np.zeros(m), np.zeros(m)
        for i, part in enumerate(pieces):
            if part is None:
                total[n + i] = 0.0
                continue
            total[:n] = part.kick(system, i, begin, rates[i]) @ total[:n]
            at = part.at(0.5 * (begin + end))
            slopes[i], made = part.slopes[at], part.made[at]
            if np.isnan(made):
                total[n + i] = 0.0
                continue
            held[i] = 1.0
            new = abs((part.start[at] - begin + 0.5) % _TURN - 0.5) < _ROUND_OFF
            if new and abs(made - part.start[at]) < _ROUND_OFF:
                total[n + i] = system.C[i] @ total[:n]
        length = (end - begin) / omega
        if smooth is None:
            flow = expm(_generator(system, slopes, held) * length)
        else:
            count = max(1, int(np.ceil(steps * (end - begin) / _TURN)))
            flow = _magnus(system, slopes, held, pieces, smooth, begin, end, omega, count)
        total = flow @ total
    return total


def _rates(system: System, omega: float, answers: Sequence[Answer]) -> list[Real | None]:
    """dq/dt just before the jumps of every spring that has some.

    Where F jumps the series of q' converges as slowly as 1/k. So the harmonics that were left out
    are put back, as the springs drive them, and what is left of the slowest of them, summed.
    """
    found: list[Real | None] = [None] * len(answers)
    if not any(isinstance(one, Switched) and not one.straight for one in answers):
        return found
    first, last = answers[0].Y.size, answers[0].Y.size + _TAIL
    ks = np.arange(first, last)
    F = np.array([one.moment(last)[ks] for one in answers])
    s = 1j * ks * omega
    resolvents = s[:, None, None] * np.eye(system.order) - system.A
    x = np.linalg.solve(resolvents, -(system.B @ F).T[..., None])
    for i, one in enumerate(answers):
        if not isinstance(one, Switched) or one.straight:
            continue
        g, b = _passing(system, i, one), system.B[:, i]
        tail = (np.exp(1j * np.outer(one.start, ks)) @ (s * (x[..., 0] @ g))).real
        tail += one.jumps * (g @ system.A @ b) / (np.pi * omega * (last - 0.5))
        # a series goes through the middle of what jumps
        found[i] = one.rates * omega ** (one.order + 1) + tail + 0.5 * (g @ b) * one.jumps
    return found


def _generator(system: System, slopes: Real, held: Real) -> Real:
    """Of (v, δh) in these slopes, memories being held where `held` is one."""
    n, m = system.B.shape
    matrix = np.zeros((n + m, n + m))
    matrix[:n, :n] = system.closed(slopes)
    matrix[:n, n:] = system.B * held
    return matrix


def _magnus(
    system: System,
    slopes: Real,
    held: Real,
    pieces: Sequence[_Piecewise | None],
    smooth: Sequence[Callable[[Real], Real]],
    begin: float,
    end: float,
    omega: float,
    count: int,
) -> Real:
    """Magnus's product of the fourth order over `count` steps of a stretch."""
    h = (end - begin) / count
    at = begin + h * (np.arange(count)[:, None] + np.array([_GAUSS, 1.0 - _GAUSS]))
    values = np.broadcast_to(slopes, (count, 2, slopes.size)).copy()
    for i, part in enumerate(pieces):
        if part is None:
            values[:, :, i] = smooth[i](at.ravel()).reshape(count, 2)
    step, total = h / omega, np.eye(sum(system.B.shape))
    for first, second in values:
        one, other = _generator(system, first, held), _generator(system, second, held)
        commutator = other @ one - one @ other
        exponent = 0.5 * step * (one + other) + np.sqrt(3) / 12 * step**2 * commutator
        total = expm(exponent) @ total
    return total
