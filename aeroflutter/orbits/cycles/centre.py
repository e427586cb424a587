"""Springs seen from their own centres, where that makes the whole loop odd.

If F(y_c + d) - F_c is odd in d and the system is at rest at (y_c, F_c) at every speed, that is
y_c/G(0) + F_c = 0, then motion about that rest obeys the same system with the odd springs.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aeroflutter.model.lure import AnyFamily, as_family, as_lure, static_stiffness
from aeroflutter.model.system import inverse_transfer, solved
from aeroflutter.springs import (
    Bilinear,
    Freeplay,
    Hysteresis,
    PiecewiseLinear,
    Spring,
    Springs,
    Table,
    each,
)

__all__ = ["Centre", "centre", "static_state"]

Array = NDArray[np.float64]

_ROUND_OFF = 1e-12


@dataclass(frozen=True, eq=False)
class Centre:
    """Springs moved to the origin.

    Attributes
    ----------
    springs
        The springs as seen from `pitch`; the originals where the loop is not odd.
    pitch
        Where each was, (s,), in the unit of its coordinate.
    memory
        What the memory of each was there, (s,).
    odd
        Whether the loop is odd about it.
    """

    springs: tuple[Spring, ...]
    pitch: Array
    memory: Array
    odd: bool

    def rest(self, family: AnyFamily, speed: float) -> Array:
        """State (n,) about which motion is described: zero, or the rest at `pitch`."""
        if not np.any(self.pitch):
            return np.zeros(len(as_family(family).state_names))
        return static_state(family, speed, self.pitch)


def static_state(family: AnyFamily, speed: float, pitch: ArrayLike) -> Array:
    """State at rest with C x = `pitch`, whatever moments that takes, (n,)."""
    A, B, C, d = as_family(family).stack(speed)
    n, m = B.shape
    matrix = np.zeros((n + m, n + m))
    matrix[:n, :n], matrix[:n, n:], matrix[n:, :n] = -A, B, C
    right = np.concatenate((d, np.broadcast_to(np.asarray(pitch, dtype=float), (m,))))
    if m > 1 and len(np.unique(C, axis=0)) < m:  # springs that share a coordinate share its moment
        return np.asarray(np.linalg.lstsq(matrix, right, rcond=None)[0][:n])
    return np.asarray(solved(matrix, right[:, None])[:n, 0])


def centre(family: AnyFamily, spring: Springs) -> Centre:
    """The springs about their centres if the loop is odd about them, else as they are."""
    springs = each(spring)
    moved = [found for one in springs if (found := _moved(one)) is not None]
    if len(moved) == len(springs):
        about, pitch, moment = zip(*moved, strict=True)
        at, force = np.array(pitch), np.array(moment)
        scales = np.array([one.scale for one in springs])
        if all(one.odd for one in about) and _rests(family, at, force, scales):
            held = [isinstance(one, Hysteresis) for one in springs]
            return Centre(about, at, np.where(held, at - force, 0.0), True)
    return Centre(springs, np.zeros(len(springs)), np.zeros(len(springs)), False)


def _rests(family: AnyFamily, pitch: Array, moment: Array, scales: Array) -> bool:
    """Whether the springs' moments balance the loads at every speed."""
    if not (np.any(pitch) or np.any(moment)):
        return not np.any(as_family(family).stack(as_family(family).search_range[1])[3])
    if pitch.size == 1:
        loads = static_stiffness(as_lure(family))[:, None] * pitch + moment
        return bool(np.all(np.abs(loads) <= _ROUND_OFF * scales))
    whole = as_family(family)
    speeds = np.linspace(*whole.search_range, 5)
    A, B, C, d = whole.stack(speeds)
    if np.any(d) or len(np.unique(C[0], axis=0)) < pitch.size:
        return False
    loads = inverse_transfer(A, B, C, np.zeros(5)).real @ pitch + moment
    return bool(np.all(np.abs(loads) <= _ROUND_OFF * scales))


def _moved(
    spring: Spring,
) -> tuple[Spring, float, float] | None:
    """The spring about the middle of its span, with pitch and moment there."""
    move = _MOVES.get(type(spring))
    if move is None:
        return (spring, 0.0, 0.0) if spring.odd else None
    return move(spring)


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
