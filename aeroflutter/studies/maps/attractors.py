"""Which cells end on the same attractor, from where they end."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.verdicts import STATES

__all__ = ["NONE", "label"]

Array = NDArray[np.float64]
Labels = NDArray[np.int32]

NONE = 0  # cells that end on no attractor: divergent, undecided, failed
DAMPED, LCO, APERIODIC = (STATES.index(name) for name in ("damped", "lco", "aperiodic"))
ALIKE = 0.05  # aperiodic motions of so nearly the same size are one attractor
FAMILY = 0.15  # change of a cycle from one column to the next that still makes it the same family


def label(
    state: NDArray[np.int8],
    amplitude: Array,
    bias: Array,
    period: Array,
    shared: int | None,
    tolerance: float,
) -> Labels:
    """Number the attractors of a map.

    Within a line of cells with one system, cells whose cycles agree in amplitude, bias and period
    share a number. From one line to the next a number goes on with the cycle that is nearest both
    ways. Rest is one attractor, 1: with friction or play it is a continuum.

    Parameters
    ----------
    state
        Places in `STATES`, (nx, ny).
    amplitude, bias, period
        Where the cells end, (nx, ny), any one unit of angle.
    shared
        The axis along which the system changes, 0 or 1, so that the other's cells share it;
        None if it changes along both.
    tolerance
        Relative difference within which two cycles of one system are the same.

    Returns
    -------
    array (nx, ny)
        Numbers from 1 in the order in which they are met, column by column; 0 for none.
    """
    ends = np.stack((amplitude, bias, period), axis=-1)
    if shared == 1:
        return np.ascontiguousarray(_label(state.T, np.swapaxes(ends, 0, 1), tolerance).T)
    return _label(state, ends, tolerance if shared == 0 else FAMILY)


def _label(state: NDArray[np.int8], ends: Array, tolerance: float) -> Labels:
    labels = np.where(state == DAMPED, 1, NONE).astype(np.int32)
    taken = 1
    for code, alike in ((LCO, tolerance), (APERIODIC, max(tolerance, ALIKE))):
        if not np.any(state == code):
            continue
        before, numbers = np.empty((0, 3)), np.empty(0, dtype=np.int32)
        for column, values, out in zip(state, ends, labels, strict=True):
            here = np.flatnonzero(column == code)
            centres, member = _distinct(values[here], alike)
            now, taken = _continued(centres, before, numbers, taken)
            out[here] = now[member]
            before, numbers = centres, now
    return labels


def _distinct(values: Array, tolerance: float) -> tuple[Array, NDArray[np.int64]]:
    """Values (k, 3) that differ by more than the tolerance, and which of them each one is."""
    centres: list[Array] = []
    member = np.full(len(values), -1, dtype=np.int64)
    left = np.arange(len(values))
    while left.size:
        centre = values[left[0]]
        near = _distance(values[left], centre) <= tolerance
        near[0] = True
        member[left[near]] = len(centres)
        centres.append(centre)
        left = left[~near]
    return np.reshape(centres, (-1, 3)), member


def _distance(values: Array, centre: Array) -> Array:
    """Largest difference of amplitude, bias (both of the amplitude) and period (of itself)."""
    with np.errstate(invalid="ignore", divide="ignore"):
        away = np.abs(values - centre) / centre[[0, 0, 2]]
    away[np.isnan(away)] = 0.0
    return np.asarray(away.max(axis=-1))


def _continued(centres: Array, before: Array, numbers: Labels, taken: int) -> tuple[Labels, int]:
    """Numbers for the attractors of a column, those of the column before going on."""
    found = np.zeros(len(centres), dtype=np.int32)
    if len(before) and len(centres):
        away = np.array([_distance(before, centre) for centre in centres])
        for i, j in enumerate(np.argmin(away, axis=1)):
            if away[i, j] <= FAMILY and np.argmin(away[:, j]) == i:
                found[i] = numbers[j]
    for new in np.flatnonzero(found == 0):
        taken += 1
        found[new] = taken
    return found, taken
