"""The spring's answer to a periodic motion, harmonic by harmonic, with its exact linearisation.

Motion and moment are y = Re Σ Y_k e^(jkθ) and F = Re Σ F_k e^(jkθ), k = 0 … H. The linearised
answer is

    δF(θ) = p(θ) δy(θ) - Σ δy(θ_r) over the segments whose memory was made at θ_r,

p being the slope along the motion: where the slider of a hysteresis loop has turned back on a
flat, the memory is h = y(θ_r) - V, and it is kept until the slider moves again.

Piecewise-linear laws are integrated segment by segment in closed form. Sampling them instead, as
the alternating frequency-time method does, leaves an error that falls only with the square of the
number of samples (the moment has kinks) and a Jacobian that jumps whenever a kink passes a sample.
Polynomial laws are sampled finely enough for no harmonic to alias, which is exact too. Where a law
jumps by J as q passes a level at θ_s, q being y (relay) or y' (friction), the linearised answer is
that the jump moves, δF(θ) = J/q'(θ_s) δq(θ_s) δ(θ - θ_s). Any other law is sampled, with the
Jacobian by differences.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aeroflutter.errors import ConvergenceError
from aeroflutter.orbits.harmonic import _kernel_segments as kernel
from aeroflutter.springs import (
    Friction,
    Hysteresis,
    PiecewiseLinear,
    Play,
    Relay,
    Spring,
    respond,
)

__all__ = ["Answer", "Held", "Switched", "answer", "waveform"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

_SAMPLES = 2048  # of a law that is only known by its values
_DIFFERENCE = 1e-6


@dataclass(frozen=True, eq=False)
class Held:
    """Stretches of the cycle on which the moment contains the motion at an earlier extremum.

    Attributes
    ----------
    at, start, end
        The extremum and the two ends of each stretch, angles of shape (m,), at <= start.
    """

    at: Real
    start: Real
    end: Real


_NOTHING_HELD = Held(np.empty(0), np.empty(0), np.empty(0))


class Answer(ABC):
    """What a spring answers to the motion with harmonics `Y`, shape (H+1,). Obligations:

    1. `moment(n)` are the harmonics F_0 … F_(n-1).
    2. `slope(n)` are the Fourier coefficients P_0 … P_(n-1) of the slope, (1/2π) ∫ p e^(-jkθ) dθ.
    3. `held` are the stretches on which the moment remembers an extremum.
    4. `margin` is the distance in pitch from the next change of the sequence of segments.
    5. `sequence` tells two sequences of segments apart; `straight` says that there is one only.
    6. `extremes` are the smallest and the largest y.
    """

    Y: Complex
    held: Held = _NOTHING_HELD
    margin: float = np.inf
    sequence: tuple[int, ...] = ()
    straight: bool = False

    @abstractmethod
    def moment(self, count: int) -> Complex: ...

    @abstractmethod
    def slope(self, count: int) -> Complex: ...

    def stiffness(self, ks: NDArray[np.intp]) -> Complex:
        """What the answer adds to the stiffness against each harmonic alone, (k,)."""
        return np.full(ks.size, self.slope(1)[0])

    @property
    def extremes(self) -> tuple[float, float]:
        """Smallest and largest y over the period."""
        turns = kernel.extrema(self.Y, _samples(self.Y))
        values = [kernel.value(self.Y, float(theta))[0] for theta in turns]
        return min(values), max(values)

    def derivative(self, ks: NDArray[np.intp]) -> Real:
        """∂(F_k)/∂(Y_l) for k, l in `ks` as real numbers, shape (2m, 2m).

        Rows are Re F, then Im F; columns Re Y, then Im Y.
        """
        P = self.slope(2 * int(ks[-1]) + 1)
        difference = ks[:, None] - ks[None, :]
        A = np.where(difference >= 0, P[np.abs(difference)], np.conj(P[np.abs(difference)]))
        B = P[ks[:, None] + ks[None, :]]
        if self.held.at.size:
            weights = _stretches(self.held, ks)
            phases = np.exp(1j * np.outer(self.held.at, ks))
            A = A - weights.T @ phases
            B = B - weights.T @ np.conj(phases)
        if ks[0] == 0:  # the mean is real, and half of what the formula of the others gives
            A[0], B[0] = 0.5 * A[0], 0.5 * B[0]
        m = ks.size
        J = np.empty((2 * m, 2 * m))
        J[:m, :m], J[m:, :m] = (A + B).real, (A + B).imag
        J[:m, m:], J[m:, m:] = (B - A).imag, (A - B).real
        return J


def _stretches(held: Held, ks: NDArray[np.intp]) -> Complex:
    """(1/2π) ∫ e^(-jkθ) dθ over each held stretch, shape (m, k)."""
    count = int(ks[-1]) + 1
    rows = [
        kernel.series(held.start[i : i + 1], held.end[i : i + 1], np.ones(1), count)[ks]
        for i in range(held.at.size)
    ]
    return np.array(rows)


@dataclass(frozen=True, eq=False)
class Segmented(Answer):
    """The answer of a law of straight pieces, from its segments along the motion."""

    Y: Complex
    start: Real
    end: Real
    slopes: Real
    offsets: Real
    made: Real
    """Where the memory of each segment was made, NaN where it is none of the motion's."""
    turning: Real
    margin: float

    @property
    def held(self) -> Held:  # type: ignore[override]
        """The segments on which the moment remembers an extremum."""
        remembers = np.isfinite(self.made)
        return Held(self.made[remembers], self.start[remembers], self.end[remembers])

    @property
    def extremes(self) -> tuple[float, float]:
        """Smallest and largest y, known from the segments."""
        return float(self.turning.min()), float(self.turning.max())

    @property
    def sequence(self) -> tuple[int, ...]:  # type: ignore[override]
        """Numbers of segments, of flats among them, and of stretches that remember."""
        flats = int(np.count_nonzero(self.slopes < self.slopes.max()))
        return self.slopes.size, flats, self.held.at.size

    @property
    def straight(self) -> bool:  # type: ignore[override]
        """Whether the motion stays on one straight piece."""
        return bool(
            np.all(self.slopes == self.slopes[0]) and np.all(self.offsets == self.offsets[0])
        )

    def slope(self, count: int) -> Complex:
        """Fourier coefficients of the slope, in closed form."""
        return np.asarray(kernel.series(self.start, self.end, self.slopes, count))

    def moment(self, count: int) -> Complex:
        """Harmonics of the moment, in closed form."""
        Y, H = self.Y, self.Y.size - 1
        P = self.slope(count + H)
        F = 2.0 * kernel.series(self.start, self.end, self.offsets, count)
        # (slope · y)_k = Σ_l P_(k-l) Y_l + P_(k+l) conj(Y_l), the mean counting twice
        two_sided = np.concatenate((np.conj(P[H:0:-1]), P))
        F += np.convolve(two_sided, Y, "valid")[:count]
        F += np.convolve(P, np.conj(Y[::-1]), "valid")[:count]
        F[0] = 0.5 * F[0].real
        return F


@dataclass(frozen=True, eq=False)
class Polynomial(Answer):
    """The answer of a polynomial law, from samples too many to alias."""

    Y: Complex
    beta: tuple[float, ...]

    def slope(self, count: int) -> Complex:
        """Fourier coefficients of Σ i βᵢ yⁱ⁻¹."""
        steep = [i * b for i, b in enumerate(self.beta, start=1)]
        samples = max((len(steep) - 1) * self.Y.size + count, 2 * (self.Y.size + count))
        y = waveform(self.Y, _power_of_two(samples))
        return _transform(np.asarray(np.polynomial.polynomial.polyval(y, steep)), count)

    def moment(self, count: int) -> Complex:
        """Harmonics of Σ βᵢ yⁱ."""
        samples = max(len(self.beta) * self.Y.size + count, 2 * count)
        y = waveform(self.Y, _power_of_two(samples))
        F = 2 * _transform(y * np.polynomial.polynomial.polyval(y, self.beta), count)
        F[0] *= 0.5
        return F


@dataclass(frozen=True, eq=False)
class Followed(Answer):
    """The answer of play, whose output is the memory of a loop without stops: y less its moment."""

    Y: Complex
    loop: Answer

    @property
    def margin(self) -> float:  # type: ignore[override]
        """As of the loop."""
        return self.loop.margin

    @property
    def sequence(self) -> tuple[int, ...]:  # type: ignore[override]
        """As of the loop."""
        return self.loop.sequence

    @property
    def straight(self) -> bool:  # type: ignore[override]
        """Whether the slack is never taken up."""
        return self.loop.straight

    @property
    def extremes(self) -> tuple[float, float]:
        """As of the loop."""
        return self.loop.extremes

    @property
    def _input(self) -> Polynomial:
        return Polynomial(self.Y, (1.0,))

    def slope(self, count: int) -> Complex:
        """Fourier coefficients of one less the slope of the loop."""
        return self._input.slope(count) - self.loop.slope(count)

    def moment(self, count: int) -> Complex:
        """Harmonics of y less those of the moment of the loop."""
        return self._input.moment(count) - self.loop.moment(count)

    def derivative(self, ks: NDArray[np.intp]) -> Real:
        """∂(F_k)/∂(Y_l), see `Answer`."""
        return self._input.derivative(ks) - self.loop.derivative(ks)


@dataclass(frozen=True, eq=False)
class Switched(Answer):
    """The answer of a law that jumps: β y, and a constant between two jumps.

    Attributes
    ----------
    start, values
        Where stretches begin on which the rest of F is constant: at the jumps, if there are any,
        and what it is there, (r,).
    jumps
        By how much it jumps there, (r,).
    order, rates
        Whether y (0) or y' (1) passes a level there, and the derivative of that, (r,).
    beta
        Slope of what does not jump.
    """

    Y: Complex
    start: Real
    values: Real
    jumps: Real
    order: int
    rates: Real
    beta: float
    margin: float

    @property
    def at(self) -> Real:
        """Where it jumps, (r,)."""
        return self.start[self.jumps != 0.0]

    @property
    def sequence(self) -> tuple[int, ...]:  # type: ignore[override]
        """The number of jumps."""
        return (self.at.size,)

    @property
    def straight(self) -> bool:  # type: ignore[override]
        """Whether it never jumps."""
        return self.at.size == 0

    def moment(self, count: int) -> Complex:
        """Harmonics of the moment, in closed form."""
        end = np.append(self.start[1:], self.start[0] + 2 * np.pi)
        F = 2.0 * kernel.series(self.start, end, self.values, count)
        F[0] = 0.5 * F[0].real
        common = min(count, self.Y.size)
        F[:common] += self.beta * self.Y[:common]
        return F

    def slope(self, count: int) -> Complex:
        """Fourier coefficients of the slope: of what jumps with y, one impulse a jump."""
        P = np.zeros(count, dtype=complex)
        if self.order == 0:
            P += self.weights @ np.exp(-1j * np.outer(self.at, np.arange(count))) / (2 * np.pi)
        P[0] += self.beta
        return P

    def stiffness(self, ks: NDArray[np.intp]) -> Complex:
        """That of the slope's mean; what jumps with y' damps."""
        mean = np.full(ks.size, self.slope(1)[0])
        return mean + 1j * ks * float(self.weights.sum()) / (2 * np.pi) * self.order

    def derivative(self, ks: NDArray[np.intp]) -> Real:
        """∂(F_k)/∂(Y_l): what jumps moves with q at the jumps alone."""
        phases = np.exp(-1j * np.outer(ks, self.at))
        answered = phases * (self.weights / np.pi)
        if ks[0] == 0:
            answered[0] *= 0.5
        moved = (1j * ks) ** self.order * np.conj(phases.T)
        moved = np.hstack((moved.real, -moved.imag))
        J = np.vstack((answered.real, answered.imag)) @ moved
        return J + self.beta * np.eye(2 * ks.size)

    @property
    def weights(self) -> Real:
        """J/q' of every jump, (r,)."""
        return (self.jumps / self.rates)[self.jumps != 0.0]


def _of_relay(spring: Relay, Y: Complex, turns: Real) -> Switched:
    """The answer of a relay: between its edges it stays on the side that it was on."""
    half = 0.5 * spring.width
    breaks, sides = ([0.0], [-1.0, 1.0]) if half == 0.0 else ([-half, half], [-1.0, 0.0, 1.0])
    rows = kernel.static_segments(Y, turns, np.array(breaks), np.zeros(len(sides)), np.array(sides))
    start, _, _, side, _, margin, _ = np.ascontiguousarray(rows.T)
    known = np.flatnonzero(side)
    if known.size == 0:  # it never leaves the space between its edges
        known, side[0] = np.zeros(1, dtype=np.intp), spring.initial_memory(waveform(Y, 64)[0])
    last = known[np.searchsorted(known, np.arange(side.size), side="right") - 1]
    values = spring.level * side[last]
    jumps = values - np.roll(values, 1)
    begins = np.flatnonzero(jumps) if np.any(jumps) else np.zeros(1, dtype=np.intp)
    start, values, jumps = start[begins], values[begins], jumps[begins]
    rates = np.array([kernel.value(Y, float(theta))[1] for theta in start])
    return Switched(Y, start, values, jumps, 0, rates, 0.0, float(margin.min()))


def _of_friction(spring: Friction, Y: Complex, turns: Real) -> Switched:
    """The answer of friction: it jumps where the motion turns, and never sticks."""
    y, _, bends = np.array([kernel.value(Y, float(theta)) for theta in turns]).T
    legs = np.roll(y, -1) - y
    values = spring.friction * np.sign(legs)
    jumps, margin = values - np.roll(values, 1), float(np.abs(legs).min())
    return Switched(Y, turns, values, jumps, 1, bends, spring.beta1, margin)


@dataclass(frozen=True, eq=False)
class Sampled(Answer):
    """The answer of a law known only by its values, memory carried round until it repeats."""

    Y: Complex
    spring: Spring

    def slope(self, count: int) -> Complex:
        """Fourier coefficients of the slope along the motion, by central differences."""
        return _transform(self._slopes(), count)

    def moment(self, count: int) -> Complex:
        """Harmonics of the moment by fast Fourier transform."""
        F = 2 * _transform(self._moment(self.Y), count)
        F[0] *= 0.5
        return F

    def derivative(self, ks: NDArray[np.intp]) -> Real:
        """∂(F_k)/∂(Y_l) by central differences of the whole answer, memory included."""
        step = _DIFFERENCE * float(np.max(np.abs(self.Y)))
        columns = []
        for factor in (1.0, 1j):
            for k in ks:
                shift = np.zeros(self.Y.size, dtype=complex)
                shift[k] = factor * step
                change = self._moment(self.Y + shift) - self._moment(self.Y - shift)
                F = 2 * _transform(change, int(ks[-1]) + 1)[ks] / (2 * step)
                if ks[0] == 0:
                    F[0] *= 0.5
                columns.append(np.concatenate((F.real, F.imag)))
        return np.array(columns).T

    def _moment(self, Y: Complex) -> Real:
        y = waveform(Y, _SAMPLES)
        return respond(self.spring, np.tile(y, 3))[0][2 * _SAMPLES :]

    def _slopes(self) -> Real:
        y = waveform(self.Y, _SAMPLES)
        memory = respond(self.spring, np.tile(y, 3))[1][2 * _SAMPLES :]
        step = _DIFFERENCE * float(np.max(np.abs(self.Y)))
        high, low = (self.spring.moment(y + s, memory) for s in (step, -step))
        return np.asarray((high - low) / (2 * step))


def answer(spring: Spring, Y: Complex) -> Answer:
    """What `spring` answers to the motion y = Re Σ Y_k e^(jkθ), in its steady state.

    Parameters
    ----------
    spring : Spring
    Y : complex array (H+1,)
        Harmonics of the motion, the mean (real) first; radians.

    Notes
    -----
    A degenerate law is to be simplified first: a loop without height has no memory to hold.
    """
    powers = spring.polynomial()
    if powers is not None:
        return Polynomial(Y, powers)
    if not np.all(np.isfinite(Y)):
        raise ConvergenceError("the motion leaves all bounds")
    if not isinstance(spring, (Friction, Hysteresis, PiecewiseLinear, Play, Relay)):
        return Sampled(Y, spring)
    turns = kernel.extrema(Y, _samples(Y))
    if turns.size == 0:
        raise ConvergenceError("the motion has no extremum")
    if isinstance(spring, Relay):
        return _of_relay(spring, Y, turns)
    if isinstance(spring, Friction):
        return _of_friction(spring, Y, turns)
    if isinstance(spring, Hysteresis):
        rows = kernel.loop_segments(Y, turns, spring.v1, spring.v2, spring.h_low, spring.h_high)
    elif isinstance(spring, Play):
        half, far = 0.5 * spring.delta_v, 4.0 * (float(np.sum(np.abs(Y))) + spring.delta_v)
        rows = kernel.loop_segments(Y, turns, half, -half, -far, far)
    else:
        p = spring.pieces()
        rows = kernel.static_segments(Y, turns, p.breaks, p.slopes, p.offsets)
    start, end, slopes, offsets, made, margin, turning = np.ascontiguousarray(rows.T)
    values = turning[np.isfinite(turning)]
    found = Segmented(Y, start, end, slopes, offsets, made, values, float(np.min(margin)))
    return Followed(Y, found) if isinstance(spring, Play) else found


def waveform(Y: Complex, samples: int) -> Real:
    """y at θ = 2π i/samples; `samples` exceeds twice the highest harmonic."""
    half = np.zeros(samples // 2 + 1, dtype=complex)
    half[: Y.size] = 0.5 * samples * Y
    half[0] *= 2
    return np.fft.irfft(half, samples)


def _transform(samples: Real, count: int) -> Complex:
    """Fourier coefficients 0 … count-1 of samples over one period."""
    return np.asarray(np.fft.rfft(samples)[:count] / samples.size)


def _samples(Y: Complex) -> int:
    """Samples a period in which the extrema of y are looked for: four an oscillation or more."""
    return _power_of_two(4 * Y.size)


def _power_of_two(least: int) -> int:
    return max(64, 1 << (int(least) - 1).bit_length())
