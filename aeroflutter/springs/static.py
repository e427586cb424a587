"""Springs without memory: linear, cubic, measured table, bilinear with preload, freeplay."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from aeroflutter.errors import InputError
from aeroflutter.springs.base import (
    Array,
    Describing,
    Pieces,
    PiecewiseLinear,
    Spring,
    check_factor,
    check_fields,
)

__all__ = ["Bilinear", "Cubic", "DeadZone", "Freeplay", "Linear", "Saturation", "Table"]


@dataclass(frozen=True, slots=True)
class Linear(PiecewiseLinear):
    """Linear spring F = stiffness·(α - centre).

    Parameters
    ----------
    stiffness
        Slope relative to the stiffness that defines ω_α; any finite number.
    centre
        Pitch of zero moment, radians.
    """

    stiffness: float = 1.0
    centre: float = 0.0
    kind: ClassVar[str] = "linear"

    def __post_init__(self) -> None:
        check_fields(self)

    def pieces(self) -> Pieces:
        """One piece, no breaks."""
        return Pieces.from_slopes([], [self.stiffness], -self.stiffness * self.centre)

    def describing(self, amplitude: ArrayLike, bias: ArrayLike = 0.0) -> Describing:
        """Describing function under α = bias + amplitude·sin θ."""
        from aeroflutter.generated import describing as forms

        return Describing(*forms.linear(amplitude, bias, self.stiffness, self.centre))

    def scaled(self, factor: float) -> Self:
        """The same slope about a centre multiplied by `factor`."""
        return type(self)(self.stiffness, self.centre * check_factor(factor))


@dataclass(frozen=True, slots=True)
class Led(Linear):
    """A linear spring that stands outside of the linear system: its coordinate is told of.

    Parameters
    ----------
    extent
        What motions are measured by there.
    """

    extent: float = 1.0

    @property
    def scale(self) -> float:
        """`extent`: the spring itself has no size."""
        return self.extent


@dataclass(frozen=True, slots=True)
class Cubic(Spring):
    """Cubic spring F = β₁ α + β₃ α³, hardening for β₃ > 0 and softening for β₃ < 0.

    Parameters
    ----------
    beta1
        Slope at the origin.
    beta3
        Cubic coefficient, per square radian.
    """

    beta1: float = 1.0
    beta3: float = 0.0
    kind: ClassVar[str] = "cubic"

    def __post_init__(self) -> None:
        check_fields(self)

    def polynomial(self) -> tuple[float, ...]:
        """β₁, 0, β₃."""
        return self.beta1, 0.0, self.beta3

    @property
    def scale(self) -> float:
        """Pitch at which the cubic moment equals the linear one (or 1, if there is no linear)."""
        if self.beta3 == 0:
            return 1.0
        return float(np.sqrt((abs(self.beta1) or 1.0) / abs(self.beta3)))

    @property
    def odd(self) -> bool:
        """Always."""
        return True

    def moment(self, alpha: ArrayLike, memory: ArrayLike = 0.0) -> Array:
        """Restoring moment F at pitch `alpha` (radians); `memory` is ignored."""
        pitch = np.asarray(alpha, dtype=float)
        value = pitch * (self.beta1 + self.beta3 * pitch * pitch)
        return np.broadcast_to(value, np.broadcast_shapes(value.shape, np.shape(memory))).copy()

    def describing(self, amplitude: ArrayLike, bias: ArrayLike = 0.0) -> Describing:
        """Describing function under α = bias + amplitude·sin θ."""
        from aeroflutter.generated import describing as forms

        return Describing(*forms.cubic(amplitude, bias, self.beta1, self.beta3))

    def scaled(self, factor: float) -> Self:
        """The spring with pitch and moment both multiplied by `factor`."""
        return type(self)(self.beta1, self.beta3 / check_factor(factor) ** 2)

    def span(self) -> tuple[float, float]:
        """Where the cubic moment is below the linear one: a cubic is nonlinear everywhere."""
        return -self.scale, self.scale

    def slope_range(self) -> tuple[float, float]:
        """From β₁ to ±∞, by the sign of β₃."""
        low = self.beta1 if self.beta3 >= 0 else -np.inf
        high = self.beta1 if self.beta3 <= 0 else np.inf
        return low, high


@dataclass(frozen=True, slots=True)
class Table(PiecewiseLinear):
    """Measured moment-rotation table, straight between its points and beyond its ends.

    Parameters
    ----------
    pitch
        Strictly ascending pitches, at least two, radians.
    moments
        Moment at each pitch, radians of a linear spring of unit slope.
    """

    pitch: tuple[float, ...]
    moments: tuple[float, ...]
    kind: ClassVar[str] = "table"

    def __post_init__(self) -> None:
        problems: list[str] = []
        for name in ("pitch", "moments"):
            object.__setattr__(self, name, _numbers(name, getattr(self, name), problems))
        if not problems and len(self.pitch) != len(self.moments):
            problems.append(
                f"moments: has {len(self.moments)} values for {len(self.pitch)} of pitch; "
                "give one moment a pitch"
            )
        if not problems and len(self.pitch) < 2:
            problems.append("pitch: a table needs at least two points")
        if not problems and np.any(np.diff(self.pitch) <= 0):
            problems.append("pitch: must ascend strictly from point to point")
        if problems:
            raise InputError(problems)

    def pieces(self) -> Pieces:
        """One piece from corner to corner; the end pieces go on beyond the table."""
        return _straight_pieces(self.pitch, self.moments)

    def scaled(self, factor: float) -> Self:
        """The table with pitch and moment both multiplied by `factor`."""
        f = check_factor(factor)
        return type(self)(
            tuple(f * value for value in self.pitch), tuple(f * value for value in self.moments)
        )


@dataclass(frozen=True, slots=True)
class Bilinear(PiecewiseLinear):
    """Bilinear spring with preload: unit slope outside a flat of slope `m_f` and width `delta`.

    F = α + m0 - α_f below α_f;  m0 + m_f (α - α_f) on the flat;
    α + m0 - α_f + δ (m_f - 1) above it (Price, Alighanbari & Lee 1995).

    Parameters
    ----------
    m0
        Moment at the start of the flat (preload), radians.
    m_f
        Slope of the flat.
    alpha_f
        Pitch at the start of the flat, radians.
    delta
        Width of the flat, radians.
    """

    m0: float = 0.0
    m_f: float = 0.0
    alpha_f: float = 0.0
    delta: float = 0.0
    kind: ClassVar[str] = "bilinear"

    def __post_init__(self) -> None:
        check_fields(self, non_negative=("delta",))

    def pieces(self) -> Pieces:
        """Three pieces; one where the flat has no width."""
        start = self.m0 - self.alpha_f
        if self.delta == 0:
            return Pieces.from_slopes([], [1.0], start)
        breaks = [self.alpha_f, self.alpha_f + self.delta]
        return Pieces.from_slopes(breaks, [1.0, self.m_f, 1.0], start)

    def describing(self, amplitude: ArrayLike, bias: ArrayLike = 0.0) -> Describing:
        """Describing function under α = bias + amplitude·sin θ."""
        from aeroflutter.generated import describing as forms

        return Describing(
            *forms.bilinear(amplitude, bias, self.m0, self.m_f, self.alpha_f, self.delta)
        )

    def scaled(self, factor: float) -> Self:
        """The spring with its three lengths multiplied by `factor`."""
        f = check_factor(factor)
        return type(self)(f * self.m0, self.m_f, f * self.alpha_f, f * self.delta)


@dataclass(frozen=True, slots=True)
class Freeplay(PiecewiseLinear):
    """Freeplay: no moment across a gap, unit slope outside it.

    Parameters
    ----------
    gap
        Full width of the gap, radians.
    centre
        Pitch at the middle of the gap, radians.
    """

    gap: float = 0.0
    centre: float = 0.0
    kind: ClassVar[str] = "freeplay"

    def __post_init__(self) -> None:
        check_fields(self, non_negative=("gap",))

    def pieces(self) -> Pieces:
        """Three pieces; one where there is no gap."""
        if self.gap == 0:
            return Pieces.from_slopes([], [1.0], -self.centre)
        low, high = self.centre - self.gap / 2, self.centre + self.gap / 2
        # The intercepts are given, not summed up from the left: the flat is then exactly zero.
        return Pieces(
            np.array([low, high]), np.array([1.0, 0.0, 1.0]), np.array([-low, 0.0, -high])
        )

    def describing(self, amplitude: ArrayLike, bias: ArrayLike = 0.0) -> Describing:
        """Describing function under α = bias + amplitude·sin θ."""
        from aeroflutter.generated import describing as forms

        return Describing(*forms.freeplay(amplitude, bias, self.gap, self.centre))

    def scaled(self, factor: float) -> Self:
        """The gap and its centre multiplied by `factor`."""
        f = check_factor(factor)
        return type(self)(f * self.gap, f * self.centre)


@dataclass(frozen=True, slots=True)
class Saturation(PiecewiseLinear):
    """Saturation F = slope·α up to ±limit, the constant slope·limit beyond.

    Parameters
    ----------
    limit
        Pitch at which the moment stops growing, radians.
    slope
        Slope below it.
    """

    limit: float = 1.0
    slope: float = 1.0
    kind: ClassVar[str] = "saturation"

    def __post_init__(self) -> None:
        check_fields(self, positive=("limit",))

    def pieces(self) -> Pieces:
        """Three pieces."""
        top = self.slope * self.limit
        return Pieces(
            np.array([-self.limit, self.limit]),
            np.array([0.0, self.slope, 0.0]),
            np.array([-top, 0.0, top]),
        )

    def scaled(self, factor: float) -> Self:
        """The limit multiplied by `factor`."""
        return type(self)(check_factor(factor) * self.limit, self.slope)


@dataclass(frozen=True, slots=True)
class DeadZone(PiecewiseLinear):
    """Dead zone: no moment across a gap about zero, slope·(α ∓ gap/2) beyond.

    Parameters
    ----------
    gap
        Full width of the gap, radians.
    slope
        Slope beyond it.
    """

    gap: float = 1.0
    slope: float = 1.0
    kind: ClassVar[str] = "dead-zone"

    def __post_init__(self) -> None:
        check_fields(self, positive=("gap",))

    def pieces(self) -> Pieces:
        """Three pieces."""
        half = 0.5 * self.gap
        return Pieces(
            np.array([-half, half]),
            np.array([self.slope, 0.0, self.slope]),
            np.array([self.slope * half, 0.0, -self.slope * half]),
        )

    def scaled(self, factor: float) -> Self:
        """The gap multiplied by `factor`."""
        return type(self)(check_factor(factor) * self.gap, self.slope)


@lru_cache(maxsize=64)
def _straight_pieces(pitch: tuple[float, ...], moments: tuple[float, ...]) -> Pieces:
    """The pieces of a table: points on a line, but for their round-off, are no corners.

    Slopes that are the same but for it are made the same: they share a mode of the flow.
    """
    x, F = np.array(pitch), np.array(moments)
    steepest = np.max(np.abs(np.diff(F) / np.diff(x)))
    noise = 4.0 * np.finfo(float).eps * (np.abs(F) + steepest * np.abs(x))
    corners = _corners(x, F, noise)
    x, F, noise = x[corners], F[corners], noise[corners]
    slopes = np.diff(F) / np.diff(x)
    room = (noise[1:] + noise[:-1]) / np.diff(x)
    for i in range(1, slopes.size):
        same = np.flatnonzero(np.abs(slopes[:i] - slopes[i]) <= room[:i] + room[i])
        slopes[i] = slopes[same[0]] if same.size else slopes[i]
    return Pieces(x[1:-1], slopes, F[:-1] - slopes * x[:-1])


def _corners(x: Array, F: Array, noise: Array) -> list[int]:
    """Places of the first point, the last, and those where the line through them bends.

    A line goes on for as long as all points passed lie on its chord, so that many small bends do
    not add up to a large one.
    """
    slopes = np.diff(F) / np.diff(x)
    bends = np.abs(np.diff(slopes)) * np.minimum(np.diff(x)[:-1], np.diff(x)[1:]) > noise[1:-1]
    kept = [0]
    for end in range(2, x.size):
        start, inner = kept[-1], slice(kept[-1] + 1, end)
        chord = F[start] + (F[end] - F[start]) / (x[end] - x[start]) * (x[inner] - x[start])
        if bends[end - 2] or np.any(np.abs(chord - F[inner]) > noise[inner]):
            kept.append(end - 1)
    return [*kept, x.size - 1]


def _numbers(name: str, values: Any, problems: list[str]) -> tuple[float, ...]:
    """A tuple of finite floats; what is wrong is appended to `problems`."""
    if isinstance(values, str) or not isinstance(values, (Sequence, np.ndarray)):
        problems.append(f"{name}: must be a list of numbers, not {values!r}")
        return ()
    try:
        numbers = tuple(float(value) for value in values)
    except (TypeError, ValueError):
        problems.append(f"{name}: must hold numbers only")
        return ()
    if not np.all(np.isfinite(numbers)):
        problems.append(f"{name}: must hold finite numbers only")
    return numbers
