"""How far coordinates and springs move on a cycle that is known by its harmonics."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.model.family import Family
from aeroflutter.model.system import solved
from aeroflutter.motion.swings import Swing, extremes, rows_of, swings_of
from aeroflutter.orbits.result import Cycle

__all__ = ["harmonic_swings", "states_of"]

Complex = NDArray[np.complex128]

_SAMPLES = 16  # a period of the highest harmonic


def states_of(family: Family, cycle: Cycle) -> Complex:
    """Harmonics of every state on a cycle, (n, H+1).

    Harmonic by harmonic (jkω - A) X + B F = d and C X = Y, for whatever F that takes; springs that
    share a coordinate share what they take.
    """
    A, B, C, d = family.stack(cycle.speed)
    n, m = B.shape
    Y = cycle.motions
    ks = np.arange(Y.shape[1])
    matrix = np.zeros((ks.size, n + m, n + m), dtype=complex)
    matrix[:, :n, :n] = 1j * cycle.omega * ks[:, None, None] * np.eye(n) - A
    matrix[:, :n, n:], matrix[:, n:, :n] = B, C
    right = np.zeros((ks.size, n + m, 1), dtype=complex)
    right[0, :n, 0] = d
    right[:, n:, 0] = Y.T
    shared = len(np.unique(C, axis=0)) < m
    # of F that do the same the least is as good as any other
    found = np.linalg.pinv(matrix) @ right if shared else solved(matrix, right)
    return np.asarray(found[:, :n, 0].T)


def harmonic_swings(family: Family, cycle: Cycle) -> tuple[tuple[Swing, ...], tuple[Swing, ...]]:
    """Swings of all coordinates and of all springs."""
    X, system = states_of(family, cycle), family.at(cycle.speed)
    rows = rows_of(system)
    if X.shape[1] == 2:  # a sinusoid
        mean, first = rows @ X[:, 0].real, np.abs(rows @ X[:, 1])
        coordinates, springs = swings_of(system, mean - first, mean + first)
        return tuple(coordinates), tuple(springs)
    count = _SAMPLES * X.shape[1]
    angles = np.outer(2 * np.pi * np.arange(count + 1) / count, np.arange(X.shape[1]))
    wave = np.exp(1j * angles)
    states = (wave @ X.T).real
    rates = (wave @ (1j * np.arange(X.shape[1]) * X).T).real  # by the angle
    low, high = extremes(states, rates, 2 * np.pi / count, rows)
    coordinates, springs = swings_of(system, low, high)
    return tuple(coordinates), tuple(springs)
