"""Floquet multipliers of a cycle by harmonic balance, from its monodromy.

A perturbation v of the cycle obeys v' = A v - b δF with the linearised answer of the spring,

    δF = p(θ) c v - δh,        δh = c v(θ_r) while the memory made at θ_r is held, else 0.

Where the spring has straight pieces the slope p is constant on each segment of the cycle, so the
monodromy is a product of matrix exponentials and has no error of its own; so is that of a law that
jumps, with what the jumps do to v between them (`joint`). Else p is a smooth
function of θ, and the product is Magnus's of the fourth order (Iserles & Nørsett 1999, with two
Gauss points a step), extrapolated once. What is left is the error of the cycle itself, and the
trivial multiplier, which only the exact cycle has at one, tells it.

Half-wave symmetric cycles are taken over half a period, in which the slope repeats: the
multipliers ν of the half-period map followed by the reflection have the squares ν².
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from aeroflutter.errors import ConvergenceError
from aeroflutter.model.lure import AnyFamily, LureSystem, as_family
from aeroflutter.model.system import System
from aeroflutter.orbits.harmonic.balance import Cycle
from aeroflutter.orbits.harmonic.joint import monodromy
from aeroflutter.orbits.harmonic.moment import (
    Answer,
    Followed,
    Segmented,
    Switched,
    waveform,
)

__all__ = ["Multipliers", "multipliers"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

_HIGHEST = 512  # harmonics of the slope of a law known by its values
_NOTHING = 1e-14  # of the largest harmonic of the slope
_STEPS = (64, 4096)  # fewest and most steps of a smooth product
_CLOSE = 1e-8  # change of the product, relative to it, at which there are enough
_GAUSS = 0.5 - np.sqrt(3) / 6
_ROUND_OFF = 1e-9  # of an angle


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
        Of `basic`: distance of the trivial multiplier from one, times the largest other one where
        that is greater than one.
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
    family: AnyFamily, cycle: Cycle, answer: Answer | Sequence[Answer], symmetric: bool
) -> Multipliers:
    """Multipliers of a cycle.

    Parameters
    ----------
    family : Family or LureFamily
    cycle : Cycle
    answer : Answer, or a sequence of them
        Of the spring to the cycle, or of every spring.
    symmetric : bool
        Whether the cycle is half-wave symmetric.

    Raises
    ------
    ConvergenceError
        If the monodromy overflows.
    """
    answers = answer if isinstance(answer, Sequence) else (answer,)
    whole, fold = as_family(family), 2 if symmetric else 1
    # not `at`: a walk may look beyond the last sample before it knows that it ends there
    system = System(*whole.stack(cycle.speed), whole.names, whole.units, whole.state_names)
    system, answers = _by_loops(system, answers)
    with np.errstate(over="ignore", invalid="ignore"):
        if len(answers) > 1 or isinstance(answers[0], Switched):
            matrix = monodromy(system, cycle.omega, answers, fold)
        elif isinstance(answers[0], Segmented):
            matrix = _by_segments(LureSystem.of(system), cycle.omega, answers[0], fold)
        else:
            matrix = _by_steps(LureSystem.of(system), cycle.omega, answers[0], fold)
    if not np.all(np.isfinite(matrix)):
        raise ConvergenceError("the monodromy overflows")
    roots = np.asarray(np.linalg.eigvals(-matrix if symmetric else matrix), dtype=complex)
    trivial = int(np.argmin(np.abs(roots - 1.0)))
    others = np.delete(roots, trivial)
    others = others[np.argsort(-np.abs(others), kind="stable")][: system.order - 1]
    basic = np.concatenate((roots[trivial : trivial + 1], others))
    error = float(abs(basic[0] - 1.0) * np.max(np.abs(others), initial=1.0))
    return Multipliers(basic**2, basic, error) if symmetric else Multipliers(basic, None, error)


def _by_segments(system: LureSystem, omega: float, answer: Segmented, fold: int) -> Real:
    """Derivative of the state after a period (over `fold`) by the state before it, (n, n)."""
    n, b, c = system.order, system.b, system.c
    # start where no memory is held: then nothing but the state says how it goes on
    order = np.roll(np.arange(answer.start.size), -int(np.argmax(np.isnan(answer.made))))
    length = (answer.end - answer.start)[order]
    until = np.minimum(np.cumsum(length), 2 * np.pi / fold)
    lasts = np.diff(until, prepend=0.0)
    total, memory = np.eye(n), np.zeros(n)
    for i, angle in zip(order[lasts > 0], lasts[lasts > 0], strict=True):
        slope, made = answer.slopes[i], answer.made[i]
        if abs(made - answer.start[i]) < _ROUND_OFF:
            memory = c @ total
        augmented = np.zeros((n + 1, n + 1))
        augmented[:n, :n] = system.closed(slope)
        augmented[:n, n] = 0.0 if np.isnan(made) else b
        flow = expm(augmented * (angle / omega))
        total = flow[:n, :n] @ total + np.outer(flow[:n, n], memory)
    return total


def _by_loops(system: System, answers: Sequence[Answer]) -> tuple[System, tuple[Answer, ...]]:
    """The same loop with y less its output in place of play: a loop without stops, fed back."""
    A, B, found = np.array(system.A), np.array(system.B), list(answers)
    for i, one in enumerate(answers):
        if isinstance(one, Followed):
            A -= np.outer(B[:, i], system.C[i])
            B[:, i] = -B[:, i]
            found[i] = one.loop
    return replace(system, A=A, B=B), tuple(found)


def _by_steps(system: LureSystem, omega: float, answer: Answer, fold: int) -> Real:
    """The same where the slope is smooth."""
    P = 2.0 * answer.slope(_HIGHEST)
    P[0] *= 0.5
    P = P[: int(np.flatnonzero(np.abs(P) >= _NOTHING * np.max(np.abs(P)))[-1]) + 1]
    period = 2 * np.pi / (omega * fold)

    def product(steps: int) -> Real:
        first, second = (_shifted(P, steps * fold, at)[:steps] for at in (_GAUSS, 1.0 - _GAUSS))
        return _magnus(system, first, second, period / steps)

    steps = _STEPS[0]
    while steps * fold <= 2 * P.size:
        steps *= 2
    coarse, fine = product(steps), product(2 * steps)
    while np.max(np.abs(fine - coarse)) > 15 * _CLOSE * np.max(np.abs(fine)) and steps < _STEPS[1]:
        steps *= 2
        coarse, fine = fine, product(2 * steps)
    return np.asarray(fine + (fine - coarse) / 15)


def _shifted(P: Complex, count: int, shift: float) -> Real:
    """Re Σ P_k e^(jkθ) at θ = 2π (i + shift)/count."""
    return waveform(P * np.exp(2j * np.pi * np.arange(P.size) * shift / count), count)


def _magnus(system: LureSystem, first: Real, second: Real, h: float) -> Real:
    """Product over steps of length h of v' = (A - p b c) v, p given at two Gauss points of each."""
    A, B = system.A, np.outer(system.b, system.c)
    commutator = A @ B - B @ A
    exponents = (
        h * A
        - (0.5 * h) * (first + second)[:, None, None] * B
        + (np.sqrt(3) / 12 * h * h) * (second - first)[:, None, None] * commutator
    )
    factors = _exponentials(exponents)
    while len(factors) > 1:  # steps is a power of two
        factors = factors[1::2] @ factors[0::2]
    return np.asarray(factors[0])


def _exponentials(matrices: Real) -> Real:
    """Matrix exponentials, (m, n, n): Taylor's series after scaling below a quarter."""
    size = float(np.max(np.sum(np.abs(matrices), axis=2)))
    halvings = max(0, int(np.ceil(np.log2(max(size, 1e-300) / 0.25))))
    scaled = matrices / 2.0**halvings
    unit = np.eye(matrices.shape[1])
    total = unit + scaled / 9
    for k in range(8, 0, -1):  # 0.25^10/10! is below round-off
        total = unit + scaled @ total / k
    for _ in range(halvings):
        total = total @ total
    return np.asarray(total)
