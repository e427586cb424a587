"""Bands of amplitude at single points: the tube of guarantees cut at the point's own speed.

A curve's points bound each other's amplitude, no closer than they lie. For single points two more
are taken on either side, just far enough for their bands of speed to exclude the speed: one above
it, one below, so that the continuum of cycles between them crosses it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.errors import ConvergenceError
from aeroflutter.guarantees.verdict import Guarantees, guarantees_at
from aeroflutter.model.lure import LureFamily
from aeroflutter.orbits.harmonic import Cycle, HarmonicOptions, sinusoid, solve_cycle
from aeroflutter.springs import Spring, simplify

__all__ = ["cut"]

Real = NDArray[np.float64]

_FACTORS = (1.5, 3.0)  # of the distance at which bands as wide as the point's own would exclude it
_FARTHEST = 0.3  # of the amplitude


def cut(
    family: LureFamily,
    spring: Spring,
    found: Guarantees,
    *,
    amplitude: Real,
    bias: Real,
    speed: Real,
    omega: Real,
    slope: Real,
) -> None:
    """Fill the bands of amplitude of the guaranteed points, where they can be had.

    Beside a fold, where no neighbour lies on the other side of the speed, they are left open.

    Parameters
    ----------
    found : Guarantees
        From `guarantees_at`, of these points.
    amplitude, bias, speed, omega : array (m,)
        The points; radians, U* and reduced frequency.
    slope : array (m,)
        dU/dA along the describing function's curve, per radian.
    """
    spring = simplify(spring)
    with np.errstate(divide="ignore", invalid="ignore"):
        half = np.max(np.abs(found.speed - speed[:, None]), axis=1)
        reach = half / np.abs(slope) / amplitude
    for i in np.flatnonzero(found.guaranteed & np.isfinite(reach)):
        point = sinusoid(float(amplitude[i]), float(bias[i]), float(omega[i]), float(speed[i]))
        for factor in _FACTORS:
            share = max(factor * float(reach[i]), 1e-9)
            ends = _ends(family, spring, point, share) if share < _FARTHEST else None
            if ends is not None:
                found.amplitude[i], found.exists_at_speed[i] = ends, True
                break


def _ends(
    family: LureFamily, spring: Spring, point: Cycle, share: float
) -> tuple[float, float] | None:
    """Amplitudes on either side whose bands exclude the speed from either side, or None."""
    a, bias = point.first_harmonic, float(point.Y[0].real)
    try:
        below, above = (_at(family, spring, point, (1 + sign * share) * a) for sign in (-1, 1))
    except ConvergenceError:
        return None
    bands = guarantees_at(
        family,
        spring,
        amplitude=[below.first_harmonic, above.first_harmonic],
        bias=[bias, bias],
        speed=[below.speed, above.speed],
        omega=[below.omega, above.omega],
        distortion=[0.0, 0.0],
    )
    (low, high), (low_above, high_above) = bands.speed
    # NaN, which compares false, where there is none
    if high < point.speed < low_above or high_above < point.speed < low:
        return below.first_harmonic, above.first_harmonic
    return None


def _at(family: LureFamily, spring: Spring, guess: Cycle, amplitude: float) -> Cycle:
    """The describing function's cycle of another amplitude, near a guess."""
    bias = float(guess.Y[0].real)
    start = sinusoid(amplitude, bias, guess.omega, guess.speed)
    one, symmetric = HarmonicOptions(harmonics=1), spring.odd and bias == 0.0
    return solve_cycle(family, spring, start, hold="amplitude", options=one, symmetric=symmetric)
