"""The relay: a moment of one size that jumps from one sign to the other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from aeroflutter.springs.base import Array, Describing, Spring, check_factor, check_fields
from aeroflutter.springs.piece_table import PieceTable

__all__ = ["Relay"]


@dataclass(frozen=True, slots=True)
class Relay(Spring):
    """F = +M once α has risen through half the width, -M once it fell through minus that.

    Without width F = M sgn α, and what happens at α = 0 is for the loop to say: it slides there
    where F enters α', else it crosses. The memory is the side that F is on, +1 or -1.

    Parameters
    ----------
    level
        Size M of the moment, radians.
    width
        Total width of the hysteresis, radians.
    """

    level: float = 1.0
    width: float = 0.0
    kind: ClassVar[str] = "relay"

    def __post_init__(self) -> None:
        check_fields(self, non_negative=("width",), positive=("level",))

    @property
    def scale(self) -> float:
        """The larger of the moment and half the width."""
        return max(self.level, 0.5 * self.width)

    @property
    def odd(self) -> bool:
        """Always."""
        return True

    def initial_memory(self, alpha: ArrayLike) -> Array:
        """The upper side for α ≥ 0."""
        return np.where(np.asarray(alpha, dtype=float) >= 0.0, 1.0, -1.0)

    def advance(self, memory: ArrayLike, alpha: ArrayLike) -> Array:
        """The side after pitch has moved monotonically to `alpha`."""
        pitch, half = np.asarray(alpha, dtype=float), 0.5 * self.width
        crossed = np.where(pitch > half, 1.0, np.where(pitch < -half, -1.0, np.sign(memory)))
        return np.asarray(crossed)

    def moment(self, alpha: ArrayLike, memory: ArrayLike = 0.0) -> Array:
        """Moment F at pitch `alpha` on the side `memory`, which matters within the width only."""
        return np.asarray(self.level * self.advance(memory, alpha))

    def piece_table(self) -> PieceTable:
        """The two sides."""
        return PieceTable.relay(self.level, 0.5 * self.width)

    def describing(self, amplitude: ArrayLike, bias: ArrayLike = 0.0) -> Describing:
        """Describing function under α = bias + amplitude·sin θ."""
        from aeroflutter.generated import switched as forms

        return Describing(*forms.relay(amplitude, bias, self.level, self.width))

    def scaled(self, factor: float) -> Self:
        """The moment and the width multiplied by `factor`."""
        f = check_factor(factor)
        return type(self)(f * self.level, f * self.width)

    def span(self) -> tuple[float, float]:
        """The two edges."""
        return -0.5 * self.width, 0.5 * self.width

    def corners(self, bias: ArrayLike = 0.0) -> Array:
        """The amplitude from which it switches both ways."""
        if self.width == 0.0:
            return np.empty((0, *np.shape(bias)))
        return np.asarray(0.5 * self.width + np.abs(np.asarray(bias, dtype=float)))[None]

    def slope_range(self) -> tuple[float, float]:
        """Zero on either side; a jump has no bound."""
        return 0.0, np.inf
