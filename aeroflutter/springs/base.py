"""What every spring is: a law F(α) with at most one number of memory, and nothing hidden."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, fields
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aeroflutter.errors import InputError
from aeroflutter.springs.piece_table import PieceTable

__all__ = ["Describing", "Pieces", "PiecewiseLinear", "Spring", "respond"]

Array = NDArray[np.float64]


class Describing(NamedTuple):
    """Describing function of a spring under α = B + A sin θ, with its partial derivatives.

    F ≈ F0 + n_p A sin θ + n_q A cos θ; every field has the shape of A and B broadcast together.
    Derivatives are with respect to the amplitude A and the bias B; at a kink of the
    describing function they are those of one side.
    """

    F0: Array
    n_p: Array
    n_q: Array
    dF0_dA: Array
    dF0_dB: Array
    dn_p_dA: Array
    dn_p_dB: Array
    dn_q_dA: Array
    dn_q_dB: Array

    @property
    def N(self) -> NDArray[np.complex128]:
        """The complex describing function n_p + j n_q."""
        return self.n_p + 1j * self.n_q


class Spring(ABC):
    """A restoring moment against pitch, F(α), in radians of a linear spring of unit slope.

    Springs are immutable. A law with memory receives its memory and returns it; springs
    without memory carry 0.0 through the same calls.
    """

    __slots__ = ()
    kind: ClassVar[str]

    @property
    @abstractmethod
    def scale(self) -> float:
        """Size of the nonlinearity in radians; 1.0 where it has none."""

    @property
    @abstractmethod
    def odd(self) -> bool:
        """Whether F(-α) = -F(α) for the whole law, memory included."""

    @abstractmethod
    def moment(self, alpha: ArrayLike, memory: ArrayLike = 0.0) -> Array:
        """Restoring moment F at pitch `alpha` with `memory`, broadcast together (radians)."""

    @abstractmethod
    def describing(self, amplitude: ArrayLike, bias: ArrayLike = 0.0) -> Describing:
        """Describing function under α = bias + amplitude·sin θ, in closed form."""

    @abstractmethod
    def scaled(self, factor: float) -> Self:
        """The spring with pitch and moment both multiplied by `factor` > 0."""

    @abstractmethod
    def slope_range(self) -> tuple[float, float]:
        """Smallest and largest incremental slope dF/dα; infinite where it has no bound."""

    @abstractmethod
    def span(self) -> tuple[float, float]:
        """Pitches between which the law is nonlinear; beyond them it is (close to) straight."""

    def piece_table(self) -> PieceTable | None:
        """The law as modes of straight pieces, or None if it is not made of such."""
        return None

    def rate_table(self) -> PieceTable | None:
        """What the law adds to its pieces as a law of α', such as friction, or None."""
        return None

    def polynomial(self) -> tuple[float, ...] | None:
        """Coefficients β₁, β₂, … of F = Σ βᵢ αⁱ, or None if the law is no polynomial."""
        return None

    def corners(self, bias: ArrayLike = 0.0) -> Array:
        """Amplitudes, shape (m, ...), at which the describing function has a kink at a bias."""
        return np.empty((0, *np.shape(bias)))

    def initial_memory(self, alpha: ArrayLike) -> Array:
        """Memory at the start of a motion from pitch `alpha`."""
        return np.zeros(np.shape(alpha))

    def advance(self, memory: ArrayLike, alpha: ArrayLike) -> Array:
        """Memory after pitch has moved monotonically to `alpha`."""
        return np.zeros(np.broadcast_shapes(np.shape(memory), np.shape(alpha)))


@dataclass(frozen=True, slots=True, eq=False)
class Pieces:
    """A static piecewise-linear law: F = slopes[i] α + offsets[i] on piece i.

    Attributes
    ----------
    breaks
        Ascending pitches where the pieces meet, shape (m-1,), radians.
    slopes, offsets
        Slope (dimensionless) and intercept (radians) of each piece, shape (m,).
    """

    breaks: Array
    slopes: Array
    offsets: Array

    @classmethod
    def from_slopes(cls, breaks: ArrayLike, slopes: ArrayLike, first_offset: float) -> Pieces:
        """Build the continuous law with these slopes, starting from the first intercept."""
        b, s = np.asarray(breaks, dtype=float), np.asarray(slopes, dtype=float)
        steps = -np.diff(s) * b
        return cls(b, s, first_offset + np.concatenate(([0.0], np.cumsum(steps))))

    def moment(self, alpha: ArrayLike) -> Array:
        """Evaluate F at `alpha`; the law is continuous, so the side at a break is immaterial."""
        pitch = np.asarray(alpha, dtype=float)
        piece = np.searchsorted(self.breaks, pitch)
        return np.asarray(self.slopes[piece] * pitch + self.offsets[piece])


class PiecewiseLinear(Spring):
    """A static spring of straight pieces."""

    __slots__ = ()

    @abstractmethod
    def pieces(self) -> Pieces:
        """Breaks, slopes and intercepts of the law."""

    def piece_table(self) -> PieceTable:
        """One mode a piece."""
        pieces = self.pieces()
        return PieceTable.static(pieces.breaks, pieces.slopes, pieces.offsets)

    @property
    def scale(self) -> float:
        """Half the pitch range between the first and last break, or the size of a lone break."""
        breaks = self.pieces().breaks
        if breaks.size == 0:
            return 1.0
        size = 0.5 * (breaks[-1] - breaks[0]) if breaks.size > 1 else abs(breaks[0])
        return float(size) or 1.0

    @property
    def odd(self) -> bool:
        """Whether breaks and slopes mirror about a law that passes through the origin."""
        pieces = self.pieces()
        room = 1e-13 * np.max(np.abs(np.concatenate((pieces.breaks, pieces.offsets))))
        return bool(
            np.allclose(pieces.breaks, -pieces.breaks[::-1], rtol=0.0, atol=room)
            and np.allclose(pieces.slopes, pieces.slopes[::-1], rtol=1e-13, atol=0.0)
            and np.allclose(pieces.offsets, -pieces.offsets[::-1], rtol=0.0, atol=room)
        )

    def moment(self, alpha: ArrayLike, memory: ArrayLike = 0.0) -> Array:
        """Restoring moment F at pitch `alpha` (radians); `memory` is ignored."""
        return np.broadcast_to(
            self.pieces().moment(alpha), np.broadcast_shapes(np.shape(alpha), np.shape(memory))
        ).copy()

    def describing(self, amplitude: ArrayLike, bias: ArrayLike = 0.0) -> Describing:
        """Describing function under α = bias + amplitude·sin θ, summed over the pieces."""
        from aeroflutter.generated import describing as forms

        p = self.pieces()
        return Describing(*forms.piecewise_linear(amplitude, bias, p.breaks, p.slopes, p.offsets))

    def span(self) -> tuple[float, float]:
        """First and last break; a single pitch where there is one break or none."""
        pieces = self.pieces()
        if pieces.breaks.size == 0:
            slope, offset = float(pieces.slopes[0]), float(pieces.offsets[0])
            centre = -offset / slope if slope else 0.0
            return centre, centre
        return float(pieces.breaks[0]), float(pieces.breaks[-1])

    def slope_range(self) -> tuple[float, float]:
        """Smallest and largest slope of the pieces."""
        slopes = self.pieces().slopes
        return float(slopes.min()), float(slopes.max())


def respond(
    spring: Spring, alpha: ArrayLike, memory: float | ArrayLike | None = None
) -> tuple[Array, Array]:
    """Moment and memory of a spring under a prescribed motion, sample by sample.

    Between two samples the motion is taken as monotone, so the answer is exact wherever every
    reversal is a sample.

    Parameters
    ----------
    spring
        The spring.
    alpha
        Pitch against time along the first axis, shape (n, ...), radians.
    memory
        Memory before the first sample; by default the starting memory of the thesis.

    Returns
    -------
    moment, memory
        Both of the shape of `alpha`.
    """
    pitch = np.asarray(alpha, dtype=float)
    if pitch.ndim == 0 or not np.all(np.isfinite(pitch)):
        raise InputError("alpha: needs a sequence of finite pitches along its first axis")
    history = np.empty_like(pitch)
    state = spring.initial_memory(pitch[:1].reshape(pitch.shape[1:])) if memory is None else memory
    for i, now in enumerate(pitch):
        state = spring.advance(state, now)
        history[i] = state
    return spring.moment(pitch, history), history


def check_fields(
    spring: Any, *, non_negative: tuple[str, ...] = (), positive: tuple[str, ...] = ()
) -> None:
    """Turn every field into a finite float, or raise one InputError with all the problems."""
    problems = []
    for field in fields(spring):
        value = getattr(spring, field.name)
        try:
            number = float(value)
        except (TypeError, ValueError):
            problems.append(f"{field.name}: must be a number, not {value!r}")
            continue
        if not np.isfinite(number):
            problems.append(f"{field.name}: must be finite, not {value!r}")
        elif field.name in non_negative and number < 0:
            problems.append(f"{field.name}: must be zero or positive, not {value!r}")
        elif field.name in positive and number <= 0:
            problems.append(f"{field.name}: must be positive, not {value!r}")
        object.__setattr__(spring, field.name, number)
    if problems:
        raise InputError(problems)


def check_factor(factor: float) -> float:
    """A finite positive scale factor, or an InputError."""
    if not (np.isfinite(factor) and factor > 0):
        raise InputError(f"factor: must be finite and positive, not {factor!r}")
    return float(factor)
