"""Play, or backlash: an output that follows its input when the slack is taken up."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from aeroflutter.springs.base import Array, Describing, Spring, check_factor, check_fields
from aeroflutter.springs.piece_table import PieceTable

__all__ = ["Play"]


@dataclass(frozen=True, slots=True)
class Play(Spring):
    """F = h, which rests while α moves within ΔV/2 of it and then follows at that distance.

        h ← clip(h, α - ΔV/2, α + ΔV/2)

    It gives out the area of its loop, unlike a hinge: it belongs in control loops.

    Parameters
    ----------
    delta_v
        Total slack ΔV, radians.
    """

    delta_v: float = 1.0
    kind: ClassVar[str] = "play"

    def __post_init__(self) -> None:
        check_fields(self, positive=("delta_v",))

    @property
    def scale(self) -> float:
        """Half the slack."""
        return 0.5 * self.delta_v

    @property
    def odd(self) -> bool:
        """Always."""
        return True

    def initial_memory(self, alpha: ArrayLike) -> Array:
        """As near to zero as the slack allows."""
        return self.advance(0.0, alpha)

    def advance(self, memory: ArrayLike, alpha: ArrayLike) -> Array:
        """Output after pitch has moved monotonically to `alpha`."""
        pitch, half = np.asarray(alpha, dtype=float), 0.5 * self.delta_v
        return np.asarray(np.minimum(np.maximum(memory, pitch - half), pitch + half))

    def moment(self, alpha: ArrayLike, memory: ArrayLike = 0.0) -> Array:
        """The output (radians), which is the memory."""
        shape = np.broadcast_shapes(np.shape(alpha), np.shape(memory))
        return np.broadcast_to(np.asarray(memory, dtype=float), shape).copy()

    def piece_table(self) -> PieceTable:
        """Rest, and following a rising and a falling motion."""
        return PieceTable.play(0.5 * self.delta_v)

    def describing(self, amplitude: ArrayLike, bias: ArrayLike = 0.0) -> Describing:
        """Describing function under α = bias + amplitude·sin θ; at rest F is the bias."""
        from aeroflutter.generated import switched as forms

        return Describing(*forms.play(amplitude, bias, self.delta_v))

    def scaled(self, factor: float) -> Self:
        """The slack multiplied by `factor`."""
        return type(self)(check_factor(factor) * self.delta_v)

    def span(self) -> tuple[float, float]:
        """Half the slack to either side."""
        return -0.5 * self.delta_v, 0.5 * self.delta_v

    def corners(self, bias: ArrayLike = 0.0) -> Array:
        """The amplitude from which the output moves."""
        return np.full((1, *np.shape(bias)), 0.5 * self.delta_v)

    def slope_range(self) -> tuple[float, float]:
        """Zero at rest, one when it follows."""
        return 0.0, 1.0
