"""Exact cycles next to one that is known: by its harmonics, or with another spring."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.model.lure import LureFamily
from aeroflutter.orbits.cycles.loop import Loop
from aeroflutter.orbits.cycles.measure import cycle_at
from aeroflutter.orbits.cycles.options import CycleOptions
from aeroflutter.orbits.cycles.result import Cycle, LimitCycles
from aeroflutter.orbits.cycles.search import Search, Seed
from aeroflutter.orbits.cycles.seeds import converged
from aeroflutter.springs import Spring

__all__ = ["cycle_near", "family_near"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_SAMPLES = 4096
_FURTHER = 6  # times that a family is followed on towards its lowest cycle
_ABOUT = CycleOptions(
    points=6, simulations=0, depth=0, max_states=12, speed_ratio_range=(1e-3, 10.0)
)


def cycle_near(family: LureFamily, spring: Spring, Y: Complex, omega: float, speed: float) -> Cycle:
    """Newton's method on the shooting equations from y = Re Σ Y_k e^(jkωτ), at its speed.

    Parameters
    ----------
    family, spring
        The loop; the spring is piecewise linear.
    Y : complex array (H+1,)
        Harmonics of the approximate cycle, the mean (real) first, radians.
    omega, speed
        Its reduced frequency and U*.

    Raises
    ------
    InputError
        If the spring is not piecewise linear.
    ConvergenceError
        If there is no cycle nearby.
    """
    frame = Search(family, spring).frame
    Y = np.array(Y, dtype=complex)
    Y[0] -= frame.centre.pitch
    even = Y[::2]
    symmetric = frame.centre.odd and bool(np.max(np.abs(even)) <= 1e-9 * np.max(np.abs(Y)))
    z = _start(frame.loop, Y, omega, speed)
    shooting, q = converged(frame, z, 2 * np.pi / omega, speed, symmetric)
    return cycle_at(frame, shooting, q)


def family_near(family: LureFamily, spring: Spring, known: LimitCycles) -> LimitCycles:
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


def _near(family: LureFamily, spring: Spring, known: LimitCycles) -> LimitCycles:
    search = Search(family, spring, _ABOUT)
    centre, memory = search.frame.centre, search.frame.loop.memory
    lowest = [] if known.onset is None else [known.onset.cycle]
    for cycle in (*lowest, *(one for one in known.cycles if one.family == lowest[0].family)):
        z = cycle.state - centre.rest(family, cycle.speed)
        z = np.append(z, cycle.memory - centre.memory) if memory else z
        symmetric = cycle.symmetric and centre.odd
        period = 2 * np.pi / cycle.omega
        search.try_seed(Seed(z, period, cycle.speed, symmetric, "neighbour"))
        if search.families:
            break
    return search.result()


def _start(loop: Loop, Y: Complex, omega: float, speed: float) -> Array:
    """A point z of the motion, where shooting likes to start."""
    A, b = loop.family.stack(speed)
    n, ks = loop.n, np.arange(Y.size)
    # c x = Y_k and the moment F_k that it takes, harmonic by harmonic
    matrix = np.zeros((ks.size, n + 1, n + 1), dtype=complex)
    matrix[:, :n, :n] = 1j * ks[:, None, None] * omega * np.eye(n) - A
    matrix[:, :n, n], matrix[:, n, :n] = b, loop.family.c
    right = np.zeros((ks.size, n + 1, 1), dtype=complex)
    right[:, n, 0] = Y
    motion = np.linalg.solve(matrix, right)[..., 0]
    theta = 2 * np.pi * np.arange(_SAMPLES) / _SAMPLES
    moment = (np.exp(1j * np.outer(theta, ks)) @ motion[:, n]).real
    y = (np.exp(1j * np.outer(theta, ks)) @ Y).real
    at = theta[np.argmax(y)]
    if loop.memory:
        middle = loop.spring.v_off  # type: ignore[union-attr]
        falls = np.flatnonzero((moment > middle) & (np.roll(moment, -1) <= middle))
        at = theta[falls[np.argmin((np.roll(moment, -1) - moment)[falls])]]
    here = (np.exp(1j * at * ks) @ motion).real
    x, F = here[:n], here[n]
    return np.append(x, loop.family.c @ x - F) if loop.memory else x
