"""The monodromy of a cycle on which several springs act, each with its own segments or slope.

A perturbation (v, δh) of the cycle obeys v' = A v - Σ b_i (p_i(θ) c_i v - δh_i), δh_i being kept
while the memory of spring i is held, made anew at an extremum of its y, and none while its slider
moves or lies at a stop. Between the changes of all springs the slopes of those of straight pieces
are constant; where no other kind is there the product of exponentials is exact.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from aeroflutter.model.system import System
from aeroflutter.orbits.harmonic.moment import Answer, Segmented

__all__ = ["monodromy"]

Real = NDArray[np.float64]

_HIGHEST = 512  # harmonics of the slope of a law known by its values
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
    pieces = [
        _Piecewise(one.start, one.slopes, one.made) if isinstance(one, Segmented) else None
        for one in answers
    ]
    window = _TURN / fold
    places = [part.start % _TURN for part in pieces if part is not None]
    inside = np.concatenate([np.zeros(0), *places])
    inside = np.unique(np.concatenate(([0.0, window], inside[inside < window])))
    angles = inside[np.concatenate(([True], np.diff(inside) > 0.0))]
    if all(part is not None for part in pieces):
        return _product(system, omega, pieces, angles, None, 1)
    slopes = [_slope(one) for one in answers]
    steps = _STEPS[0]
    coarse = _product(system, omega, pieces, angles, slopes, steps)
    while True:
        fine = _product(system, omega, pieces, angles, slopes, 2 * steps)
        close = np.max(np.abs(fine - coarse)) <= 15 * _CLOSE * np.max(np.abs(fine))
        steps *= 2
        if close or steps >= _STEPS[1]:
            return np.asarray(fine + (fine - coarse) / 15)
        coarse = fine


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
) -> Real:
    n, m = system.B.shape
    total = np.eye(n + m)
    for begin, end in pairwise(angles):
        slopes, held = np.zeros(m), np.zeros(m)
        for i, part in enumerate(pieces):
            if part is None:
                total[n + i] = 0.0
                continue
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
