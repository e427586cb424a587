"""A spring seen from its own centre, where that makes the whole loop odd.

If F(y_c + d) - F_c is odd in d and the system is at rest at (y_c, F_c) at every speed, that is
y_c/G(0) + F_c = 0, then motion about that rest obeys the same system with the odd spring.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aeroflutter.model.lure import LureFamily, static_stiffness
from aeroflutter.springs import Bilinear, Freeplay, Hysteresis, PiecewiseLinear, Table

__all__ = ["Centre", "centre", "static_state"]

Array = NDArray[np.float64]

_ROUND_OFF = 1e-12


@dataclass(frozen=True, eq=False)
class Centre:
    """A spring moved to the origin.

    Attributes
    ----------
    spring
        The spring as seen from `pitch`; the original where the loop is not odd.
    pitch
        Where it was, radians.
    memory
        What its memory was there, radians.
    odd
        Whether the loop is odd about it.
    """

    spring: PiecewiseLinear | Hysteresis
    pitch: float
    memory: float
    odd: bool

    def rest(self, family: LureFamily, speed: float) -> Array:
        """State (n,) about which motion is described: zero, or the rest at `pitch`."""
        if self.pitch == 0.0:
            return np.zeros(family.c.size)
        return static_state(family, speed, self.pitch)


def static_state(family: LureFamily, speed: float, pitch: float) -> Array:
    """State at rest with c x = `pitch`, whatever moment that takes, (n,)."""
    A, b = family.stack(speed)
    n = b.size
    matrix = np.zeros((n + 1, n + 1))
    matrix[:n, :n], matrix[:n, n], matrix[n, :n] = -A, b, family.c
    return np.asarray(np.linalg.solve(matrix, np.append(np.zeros(n), pitch))[:n])


def centre(family: LureFamily, spring: PiecewiseLinear | Hysteresis) -> Centre:
    """The spring about its centre if the loop is odd about it, else as it is."""
    moved = _moved(spring)
    if moved is not None:
        about, pitch, moment = moved
        memory = pitch - moment
        if about.odd and _rests(family, pitch, moment, spring.scale):
            return Centre(about, pitch, memory if isinstance(spring, Hysteresis) else 0.0, True)
    return Centre(spring, 0.0, 0.0, False)


def _rests(family: LureFamily, pitch: float, moment: float, scale: float) -> bool:
    if pitch == 0.0 and moment == 0.0:
        return True
    loads = static_stiffness(family) * pitch + moment
    return bool(np.all(np.abs(loads) <= _ROUND_OFF * scale))


def _moved(
    spring: PiecewiseLinear | Hysteresis,
) -> tuple[PiecewiseLinear | Hysteresis, float, float] | None:
    """The spring about the middle of its span, with pitch and moment there."""
    move = _MOVES.get(type(spring))
    return None if move is None else move(spring)


def _hysteresis(s: Hysteresis) -> tuple[Hysteresis, float, float]:
    return Hysteresis(s.delta_v, s.delta_h), s.centre, s.v_off


def _freeplay(s: Freeplay) -> tuple[Freeplay, float, float]:
    return Freeplay(s.gap), s.centre, 0.0


def _bilinear(s: Bilinear) -> tuple[Bilinear, float, float]:
    half = s.delta / 2
    return Bilinear(-s.m_f * half, s.m_f, -half, s.delta), s.alpha_f + half, s.m0 + s.m_f * half


def _table(s: Table) -> tuple[Table, float, float]:
    breaks = s.pieces().breaks
    pitch = 0.5 * float(breaks[0] + breaks[-1]) if breaks.size else 0.0
    moment = float(s.moment(pitch))
    return (
        Table(tuple(p - pitch for p in s.pitch), tuple(m - moment for m in s.moments)),
        pitch,
        moment,
    )


_MOVES: dict[type, Callable[..., tuple[PiecewiseLinear | Hysteresis, float, float]]] = {
    Hysteresis: _hysteresis,
    Freeplay: _freeplay,
    Bilinear: _bilinear,
    Table: _table,
}
