"""Describing functions by brute force: run the law round a cycle and integrate what it answers.

Only the definition of a law is used. A law carries its moment together with the derivatives of the
moment by amplitude and bias, so the integrals of those are the derivatives of the integrals
(the moment is continuous where two branches of a law meet).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
NODES, WEIGHTS = np.polynomial.legendre.leggauss(24)
NAMES = ("F0", "n_p", "n_q", "dF0_dA", "dF0_dB", "dn_p_dA", "dn_p_dB", "dn_q_dA", "dn_q_dB")


@dataclass(frozen=True)
class Motion:
    """alpha = bias + amplitude sin(theta)."""

    amplitude: float
    bias: float

    def crossings(self, levels: Sequence[float]) -> list[float]:
        """Angles from -pi/2 to 3 pi/2 where pitch crosses some levels, and where it turns."""
        angles = [-0.5 * np.pi, 0.5 * np.pi, 1.5 * np.pi]
        for level in levels:
            ratio = (level - self.bias) / self.amplitude
            if abs(ratio) < 1:
                angles += [float(np.arcsin(ratio)), float(np.pi - np.arcsin(ratio))]
        return sorted(angles)


Answer = Callable[[Array], tuple[Array, Array, Array]]


def harmonics(motion: Motion, levels: Sequence[float], answer: Answer) -> dict[str, float]:
    """Mean, first harmonic and their derivatives of a law smooth between ``levels``.

    ``answer(theta)`` gives F, dF/dA and dF/dB at angles between two neighbouring crossings.
    """
    integrals = np.zeros((3, 3))
    corners = motion.crossings(levels)
    for low, high in itertools.pairwise(corners):
        theta = 0.5 * (high - low) * NODES + 0.5 * (high + low)
        weight = 0.5 * (high - low) * WEIGHTS
        values = np.stack(answer(theta))
        kernels = np.stack((np.full_like(theta, 0.5), np.sin(theta), np.cos(theta))) / np.pi
        integrals += (values * weight) @ kernels.T
    (F0, p, q), (F0_A, p_A, q_A), (F0_B, p_B, q_B) = integrals
    A = motion.amplitude
    results = (F0, p / A, q / A, F0_A, F0_B)
    results += (p_A / A - p / A**2, p_B / A, q_A / A - q / A**2, q_B / A)
    return dict(zip(NAMES, map(float, results), strict=True))


def static(motion: Motion, breaks: Array, slopes: Array, offsets: Array) -> dict[str, float]:
    """Any static piecewise-linear law."""

    def answer(theta: Array) -> tuple[Array, Array, Array]:
        alpha = motion.bias + motion.amplitude * np.sin(theta)
        piece = np.searchsorted(breaks, alpha)
        slope = slopes[piece]
        return slope * alpha + offsets[piece], slope * np.sin(theta), slope

    return harmonics(motion, list(breaks), answer)


@dataclass(frozen=True)
class Memory:
    """A memory with its derivatives by amplitude and bias."""

    value: float
    by_amplitude: float
    by_bias: float


@dataclass(frozen=True)
class Loop:
    """The clip law h <- clip(clip(h, alpha - V1, alpha - V2), stops), F = alpha - h."""

    delta_v: float
    delta_h: float
    v_off: float
    h_off: float

    @property
    def v1(self) -> float:
        return self.v_off + self.delta_v / 2

    @property
    def v2(self) -> float:
        return self.v_off - self.delta_v / 2

    @property
    def stops(self) -> tuple[float, float]:
        return self.h_off - self.delta_h / 2, self.h_off + self.delta_h / 2

    def advance(self, memory: Memory, alpha: float, sine: float) -> Memory:
        """The two clips, each passing on the derivatives of what it selects."""
        low, high = self.stops
        if memory.value < alpha - self.v1:
            memory = Memory(alpha - self.v1, sine, 1.0)
        if memory.value > alpha - self.v2:
            memory = Memory(alpha - self.v2, sine, 1.0)
        if memory.value <= low:
            memory = Memory(low, 0.0, 0.0)
        if memory.value >= high:
            memory = Memory(high, 0.0, 0.0)
        return memory

    def extremes(self, motion: Motion, memory: Memory, cycles: int = 3) -> tuple[Memory, Memory]:
        """Memory where pitch is lowest and highest, after some cycles from a memory."""
        A, B = motion.amplitude, motion.bias
        bottom = top = memory
        for _ in range(cycles):
            bottom = self.advance(top, B - A, -1.0)
            top = self.advance(bottom, B + A, 1.0)
        return self.advance(top, B - A, -1.0), top


def hysteresis(motion: Motion, loop: Loop, start: Memory) -> dict[str, float]:
    """The loop's steady answer, reached from a memory."""
    bottom, top = loop.extremes(motion, start)

    def answer(theta: Array) -> tuple[Array, Array, Array]:
        sine = np.sin(theta)
        alpha = motion.bias + motion.amplitude * sine
        before = bottom if theta[0] < 0.5 * np.pi else top
        states = [loop.advance(before, *pair) for pair in zip(alpha, sine, strict=True)]
        h, h_A, h_B = np.array([(s.value, s.by_amplitude, s.by_bias) for s in states]).T
        return alpha - h, sine - h_A, 1.0 - h_B

    levels = [h + v for h in (bottom.value, top.value) for v in (loop.v1, loop.v2)]
    return harmonics(motion, levels, answer)
