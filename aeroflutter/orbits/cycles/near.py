"""Exact cycles next to one that is known: by its harmonics, or with another spring."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.model.lure import AnyFamily
from aeroflutter.orbits.cycles.measure import cycle_at
from aeroflutter.orbits.cycles.options import CycleOptions
from aeroflutter.orbits.cycles.result import Cycle, LimitCycles
from aeroflutter.orbits.cycles.search import Search, Seed
from aeroflutter.orbits.cycles.seeds import converged, point_of
from aeroflutter.springs import Springs

__all__ = ["cycle_near", "family_near"]

Complex = NDArray[np.complex128]

_FURTHER = 6  # times that a family is followed on towards its lowest cycle
_ABOUT = CycleOptions(
    points=6, simulations=0, depth=0, max_states=12, speed_ratio_range=(1e-3, 10.0)
)


def cycle_near(family: AnyFamily, spring: Springs, Y: Complex, omega: float, speed: float) -> Cycle:
    """Newton's method on the shooting equations from y = Re Σ Y_k e^(jkωτ), at its speed.

    Parameters
    ----------
    family, spring
        The loop.
    Y : complex array (H+1,)
        Harmonics of the approximate cycle, the mean (real) first, radians; of several springs
        (m, H+1), one row the coordinate of each.
    omega, speed
        Its reduced frequency and U*.

    Raises
    ------
    InputError
        If no engine follows the springs together.
    ConvergenceError
        If there is no cycle nearby.
    """
    search = Search(family, spring)
    frame = search.frame
    Y = np.array(Y, dtype=complex, ndmin=2)[search.kept]
    Y[:, 0] -= frame.centre.pitch
    even = np.max(np.abs(Y[:, ::2]), axis=1)
    symmetric = frame.centre.odd and bool(np.all(even <= 1e-9 * np.max(np.abs(Y), axis=1)))
    z = point_of(frame.loop, Y, omega, speed)
    shooting, q = converged(frame, z, 2 * np.pi / omega, speed, symmetric)
    return cycle_at(frame, shooting, q)


def family_near(family: AnyFamily, spring: Springs, known: LimitCycles) -> LimitCycles:
    """A little of the family of cycles that known ones of a slightly different spring lead to.

    Parameters
    ----------
    family, spring
        The loop; the spring is piecewise linear.
    known
        Exact cycles of the same family of systems: what `limit_cycles` or this function found.

    Returns
    -------
    LimitCycles
        About the lowest cycle of the family, a few either way; empty where none was found.
    """
    found = _near(family, spring, known)
    for _ in range(_FURTHER):
        if found.onset is None or found.onset.kind != "edge":
            break
        lower = _near(family, spring, found)
        if lower.onset is None or lower.onset.cycle.speed >= found.onset.cycle.speed:
            break
        found = lower
    return found


def _near(family: AnyFamily, spring: Springs, known: LimitCycles) -> LimitCycles:
    search = Search(family, spring, _ABOUT)
    centre, held = search.frame.centre, search.frame.loop.held
    lowest = [] if known.onset is None else [known.onset.cycle]
    for cycle in (*lowest, *(one for one in known.cycles if one.family == lowest[0].family)):
        z = cycle.state - centre.rest(family, cycle.speed)
        z = np.append(z, (np.atleast_1d(cycle.memory)[search.kept] - centre.memory)[held])
        symmetric = cycle.symmetric and centre.odd
        period = 2 * np.pi / cycle.omega
        search.try_seed(Seed(z, period, cycle.speed, symmetric, "neighbour"))
        if search.families:
            break
    return search.result()
