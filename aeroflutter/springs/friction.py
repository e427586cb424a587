"""Coulomb friction in parallel with a linear spring: it sticks, exactly."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from aeroflutter.springs.base import Array, Describing, Spring, check_factor, check_fields
from aeroflutter.springs.piece_table import PieceTable

__all__ = ["Friction"]


@dataclass(frozen=True, slots=True)
class Friction(Spring):
    """F = β₁ α + F₀ sgn α', and any F₀ f with -1 ≤ f ≤ 1 that keeps α where it is, if one does.

    In a loop the friction is a relay of the rate α' that slides at α' = 0. Under a prescribed
    motion its memory is the pitch just behind the motion, one unit of the last digit away.

    Parameters
    ----------
    friction
        F₀, radians of a linear spring of unit slope.
    beta1
        Slope β₁ of the spring beside it; may be zero.
    """

    friction: float = 0.0
    beta1: float = 1.0
    kind: ClassVar[str] = "friction"

    def __post_init__(self) -> None:
        check_fields(self, positive=("friction",))

    @property
    def scale(self) -> float:
        """Pitch at which the spring is as strong as the friction; F₀ where there is no spring."""
        return self.friction / (abs(self.beta1) or 1.0)

    @property
    def odd(self) -> bool:
        """Always."""
        return True

    def initial_memory(self, alpha: ArrayLike) -> Array:
        """At rest: no friction before it moves."""
        return np.array(alpha, dtype=float)

    def advance(self, memory: ArrayLike, alpha: ArrayLike) -> Array:
        """The pitch just behind a motion that has gone monotonically to `alpha`."""
        pitch = np.asarray(alpha, dtype=float)
        way = np.sign(pitch - memory)
        behind = np.nextafter(pitch, pitch - np.where(way == 0.0, 1.0, way) * np.inf)
        return np.where(way == 0.0, memory, behind)

    def moment(self, alpha: ArrayLike, memory: ArrayLike = 0.0) -> Array:
        """Moment F at pitch `alpha` of a motion with the pitch `memory` just behind it."""
        pitch = np.asarray(alpha, dtype=float)
        return np.asarray(self.beta1 * pitch + self.friction * np.sign(pitch - memory))

    def piece_table(self) -> PieceTable:
        """The linear spring."""
        return PieceTable.static([], [self.beta1], [0.0])

    def rate_table(self) -> PieceTable:
        """The relay of the rate."""
        return PieceTable.relay(self.friction, 0.0)

    def describing(self, amplitude: ArrayLike, bias: ArrayLike = 0.0) -> Describing:
        """Describing function under α = bias + amplitude·sin θ."""
        from aeroflutter.generated import switched as forms

        return Describing(*forms.friction(amplitude, bias, self.friction, self.beta1))

    def scaled(self, factor: float) -> Self:
        """The friction multiplied by `factor`."""
        return type(self)(check_factor(factor) * self.friction, self.beta1)

    def span(self) -> tuple[float, float]:
        """The band in which it may rest without a load."""
        return -self.scale, self.scale

    def slope_range(self) -> tuple[float, float]:
        """β₁; a jump has no bound."""
        return self.beta1, np.inf
