"""The hysteresis loop of the thesis: one memory variable and two clips."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from aeroflutter.springs.base import Array, Describing, Spring, check_factor, check_fields
from aeroflutter.springs.piece_table import PieceTable

__all__ = ["Hysteresis"]


@dataclass(frozen=True, slots=True)
class Hysteresis(Spring):
    """Unit spring in series with a friction slider that moves between two stops (fig. 3.2).

    The memory h is the play of the slider; when pitch moves monotonically to α

        h ← clip(clip(h, α - V₁, α - V₂), H_off - ΔH/2, H_off + ΔH/2),   F = α - h

    with V₁ = V_off + ΔV/2 and V₂ = V_off - ΔV/2. A rising motion crosses the flat at the moment
    V₁, a falling one at V₂; a full loop dissipates ΔV·ΔH.

    Parameters
    ----------
    delta_v
        Height ΔV of the loop (twice the friction), radians.
    delta_h
        Width ΔH of the loop (the play), radians.
    v_off, h_off
        Offsets of the loop's centre: moment V_off at pitch V_off + H_off, radians.
    """

    delta_v: float = 0.0
    delta_h: float = 0.0
    v_off: float = 0.0
    h_off: float = 0.0
    kind: ClassVar[str] = "hysteresis"

    def __post_init__(self) -> None:
        check_fields(self, non_negative=("delta_v", "delta_h"))

    @property
    def v1(self) -> float:
        """Moment on the flat of a rising motion."""
        return self.v_off + self.delta_v / 2

    @property
    def v2(self) -> float:
        """Moment on the flat of a falling motion."""
        return self.v_off - self.delta_v / 2

    @property
    def h_low(self) -> float:
        """Lower stop of the slider."""
        return self.h_off - self.delta_h / 2

    @property
    def h_high(self) -> float:
        """Upper stop of the slider."""
        return self.h_off + self.delta_h / 2

    @property
    def centre(self) -> float:
        """Pitch about which the loop is symmetric."""
        return self.v_off + self.h_off

    @property
    def scale(self) -> float:
        """Half the width of the whole loop, (ΔV + ΔH)/2."""
        return (self.delta_v + self.delta_h) / 2 or 1.0

    @property
    def odd(self) -> bool:
        """Whether both offsets vanish."""
        return self.v_off == 0 and self.h_off == 0

    def initial_memory(self, alpha: ArrayLike) -> Array:
        """The descending branch for α ≥ 0, the ascending one for α < 0, as in the thesis."""
        start = np.where(np.asarray(alpha) >= 0, self.h_high, self.h_low)
        return self.advance(start, alpha)

    def advance(self, memory: ArrayLike, alpha: ArrayLike) -> Array:
        """Memory after pitch has moved monotonically to `alpha`: the slider, then the stops."""
        pitch = np.asarray(alpha, dtype=float)
        slid = np.minimum(np.maximum(memory, pitch - self.v1), pitch - self.v2)
        return np.minimum(np.maximum(slid, self.h_low), self.h_high)

    def moment(self, alpha: ArrayLike, memory: ArrayLike = 0.0) -> Array:
        """Restoring moment F = α - h (radians)."""
        return np.asarray(np.asarray(alpha, dtype=float) - memory)

    def piece_table(self) -> PieceTable:
        """Stick, and the flats of a rising and of a falling motion."""
        return PieceTable.loop(self.v1, self.v2, self.h_low, self.h_high)

    def describing(self, amplitude: ArrayLike, bias: ArrayLike = 0.0) -> Describing:
        """Describing function of the steady loop under α = bias + amplitude·sin θ.

        Where the motion never makes the slider move, the memory of its centre is taken.
        """
        from aeroflutter.generated import describing as forms

        return Describing(
            *forms.hysteresis(amplitude, bias, self.delta_v, self.delta_h, self.v_off, self.h_off)
        )

    def scaled(self, factor: float) -> Self:
        """The loop with its four lengths multiplied by `factor`."""
        f = check_factor(factor)
        return type(self)(f * self.delta_v, f * self.delta_h, f * self.v_off, f * self.h_off)

    def span(self) -> tuple[float, float]:
        """The outer corners of the loop, centre ± (ΔV + ΔH)/2."""
        half = (self.delta_v + self.delta_h) / 2
        return self.centre - half, self.centre + half

    def corners(self, bias: ArrayLike = 0.0) -> Array:
        """Amplitudes at which the slider begins to move and to reach either stop.

        Where the bias alone holds it at a stop, it moves once the far end of the motion slips.
        """
        shift = np.asarray(bias, dtype=float) - self.centre
        slip, full = self.delta_v / 2, (self.delta_v + self.delta_h) / 2
        moves = np.maximum(slip, np.abs(shift) + slip - self.delta_h / 2)
        return np.stack((moves, full - shift, full + shift))

    def slope_range(self) -> tuple[float, float]:
        """Zero on the flats, one elsewhere."""
        return 0.0, 1.0
