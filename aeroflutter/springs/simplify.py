"""Degenerate laws, turned into the simpler spring that they are."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from aeroflutter.springs.base import PiecewiseLinear, Spring
from aeroflutter.springs.hysteresis import Hysteresis
from aeroflutter.springs.polynomial import Polynomial
from aeroflutter.springs.static import Bilinear, Cubic, Freeplay, Linear

__all__ = ["simplify", "straight"]


def simplify(spring: Spring) -> Spring:
    """The simplest spring with the same law.

    Hysteresis without height (ΔV = 0) is freeplay: h = clip(α - V_off, stops), so the moment is
    V_off across α = V_off + H_off ± ΔH/2. Without width (ΔH = 0) the slider cannot move:
    F = α - H_off. Freeplay with a moment in its gap is a bilinear spring. Straight tables,
    closed gaps and polynomials of the first degree are linear.
    """
    if isinstance(spring, Hysteresis):
        return _simplify_loop(spring)
    powers = spring.polynomial()
    if powers is not None and not any(powers[1:]):
        return Linear(powers[0])
    if isinstance(spring, Polynomial) and spring.odd and not any(spring.beta[3:]):
        return Cubic(spring.beta[0], spring.beta[2])
    if isinstance(spring, PiecewiseLinear) and not isinstance(spring, Linear):
        return _simplify_pieces(spring)
    return spring


@lru_cache(maxsize=64)
def straight(spring: Spring) -> bool:
    """Whether a law is made of straight pieces, which the exact engine takes."""
    return simplify(spring).piece_table() is not None


def _simplify_loop(loop: Hysteresis) -> Spring:
    if loop.delta_h == 0:
        return Linear(1.0, loop.h_off)
    if loop.delta_v > 0:
        return loop
    if loop.v_off == 0:
        return Freeplay(loop.delta_h, loop.h_off)
    return Bilinear(loop.v_off, 0.0, loop.v_off + loop.h_low, loop.delta_h)


def _simplify_pieces(spring: PiecewiseLinear) -> Spring:
    pieces = spring.pieces()
    slope = float(pieces.slopes[0])
    if not np.all(pieces.slopes == slope):
        return spring
    if slope == 0 and pieces.offsets[0] != 0:
        return spring  # a constant moment has no centre
    return Linear(slope, -float(pieces.offsets[0]) / slope if slope else 0.0)
