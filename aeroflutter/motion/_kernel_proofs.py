"""Compiled proofs that a motion is decided for good: it stays in its mode, or has escaped."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeroflutter.kernels import kernel
from aeroflutter.kernels.arrays import Real1, Real2, Real3, Whole1, Whole2
from aeroflutter.motion._kernel_flow import NOW, TABLE, UNKNOWN, Motion, System, enter, output
from aeroflutter.springs._kernel_columns import HOLDS

Array = NDArray[np.float64]

ONWARD = -1
DAMPED, LCO, APERIODIC, DIVERGENT, UNDECIDED, NEITHER = 0, 1, 2, 3, 4, 5
TRAPPED, AT_REST, CONVERGED, KNOWN, UNSETTLED, ESCAPED, GREW = 0, 1, 2, 3, 4, 5, 6
DRIFTING, NO_CYCLE, OUT_OF_TIME, NEUTRAL, OVERFLOWED, CHATTERING = 7, 8, 9, 10, 11, 12
SWINGING, CORNERED, FADED, RETREATS, TORUS, FLUTTER, LOSSLESS = 13, 14, 15, 16, 17, 18, 19
OUTGROWN = 20

MARGIN = 1.0 + 1e-9  # of the proofs, for the round-off in their tables
REST_RATE = 1e-11  # relative rate of change of a motion at rest


class Proofs(NamedTuple):
    """What ends a motion for good. k tables, n states, m outputs, q inputs, g coordinates, r rests.

    Attributes
    ----------
    decays
        1 where all motion about the rest of the mode dies out, 2 where it does if no input pushes
        (one coordinate then stays as it is), 3 where some of it goes on and none grows, else 0,
        (k,).
    rows, heads
        Coordinates whose groups each never grow, (k, n, n); a 1 marks the first row of a group, a 2
        that of one that does not shrink either, (k, n).
    weights
        Most that a group of norm 1 adds to each output, at the first row of the group, (k, m, n).
    centre, rest
        Equilibrium a unit of each input, (k, n, q), and its outputs, (k, m, q).
    free
        Rows that add the outputs of what a neutral mode leaves behind, (k, m, n).
    grows, against
        Coordinates that grow on the outer mode, real and imaginary rows (g, 2, n), and the size
        from which the springs cannot turn them back, (g,).
    corners, forms
        Rests at corners of the law, behind each its y, (r, n+1), and the form that is below one
        where all motion comes to it, (r, n, n); see `basins`.
    unstable, idle
        1 if an outer mode is unstable, and if one neither grows nor dies out.
    """

    decays: Whole1
    rows: Real3
    heads: Whole2
    weights: Real3
    centre: Real3
    rest: Real3
    free: Real3
    grows: Real3
    against: Real1
    corners: Real2
    forms: Real3
    unstable: int
    idle: int


@kernel(inner=True, bare=True)
def trapped(system: System, motion: Motion, proofs: Proofs, p: int) -> float:
    """The y of rest if the motion provably never leaves its mode again, else NaN."""
    xs, now, window = motion.xs, motion.memo[NOW], motion.window
    m, n = system.C.shape
    if proofs.decays[p] == 0:
        return np.nan
    for i in range(m):
        if window[i, 2] != 0.0:
            return np.nan
    if proofs.decays[p] == 2:
        for j in range(motion.inputs.size):
            if motion.inputs[j] != 0.0:
                return np.nan
    first = np.nan
    for i in range(m):
        rest, y = 0.0, 0.0
        for j in range(motion.inputs.size):
            rest += proofs.rest[p, i, j] * motion.inputs[j]
        for j in range(n):
            rest += proofs.free[p, i, j] * xs[now, j]
            y += system.C[i, j] * xs[now, j]
        room = min(window[i, 1] - rest, rest - window[i, 0])
        if system.laws[i, motion.modes[i], HOLDS] != 0.0:  # the edges are those of F
            y = rest
        if not abs(y - rest) < room:  # the bound is no less: spare the work
            return np.nan
        bound, group, weight = 0.0, 0.0, 0.0
        for row in range(n):
            value = 0.0
            for j in range(n):
                away = xs[now, j]
                for k in range(motion.inputs.size):
                    away -= proofs.centre[p, j, k] * motion.inputs[k]
                value += proofs.rows[p, row, j] * away
            if proofs.heads[p, row]:
                bound += weight * np.sqrt(group)
                group, weight = 0.0, proofs.weights[p, i, row]
            group += value * value
        bound += weight * np.sqrt(group)
        if not bound * MARGIN < room:
            return np.nan
        if i == 0:
            first = rest
    return first


@kernel(inner=True, bare=True)
def cornered(C: Array, xs: Array, now: int, proofs: Proofs) -> float:
    """The y of rest if the motion provably comes to a rest at a corner of the law, else NaN."""
    n = C.shape[1]
    for r in range(proofs.forms.shape[0]):
        total = 0.0
        for i in range(n):
            row = 0.0
            for j in range(n):
                row += proofs.forms[r, i, j] * (xs[now, j] - proofs.corners[r, j])
            total += row * (xs[now, i] - proofs.corners[r, i])
        if total * MARGIN < 1.0:
            return proofs.corners[r, n]
    return np.nan


@kernel(inner=True, bare=True)
def swing(system: System, motion: Motion, proofs: Proofs, p: int) -> float:
    """Amplitude of the first output once all that dies out on a mode has done so."""
    n, now, total = system.C.shape[1], motion.memo[NOW], 0.0
    first = 0
    for row in range(n):
        if proofs.heads[p, row] != 2:
            continue
        group = 0.0
        for other in range(row, min(row + 2, n)):
            value = 0.0
            for j in range(n):
                away = motion.xs[now, j]
                for k in range(motion.inputs.size):
                    away -= proofs.centre[p, j, k] * motion.inputs[k]
                value += proofs.rows[p, other, j] * away
            group += value * value
        total += proofs.weights[p, first, row] * np.sqrt(group)
    return total


@kernel(inner=True, bare=True)
def resting(system: System, motion: Motion, proofs: Proofs, p: int) -> tuple[int, int, float]:
    """Whether the motion provably comes to rest, or swings in its mode for ever, or `ONWARD`."""
    rest = trapped(system, motion, proofs, p)
    if not np.isnan(rest):
        if proofs.decays[p] == 3:
            return NEITHER, SWINGING, rest
        return DAMPED, TRAPPED, rest
    rest = cornered(system.C, motion.xs, motion.memo[NOW], proofs)
    if not np.isnan(rest):
        return DAMPED, CORNERED, rest
    return ONWARD, 0, rest


@kernel(inner=True, bare=True)
def certain(system: System, motion: Motion, proofs: Proofs) -> tuple[int, int, float]:
    """End state that the state alone proves, or `ONWARD`; its reason; the y of rest."""
    memo, xs, n = motion.memo, motion.xs, system.C.shape[1]
    if memo[TABLE] < 0:
        memo[TABLE] = enter(system, motion)
        if memo[TABLE] < 0:
            return ONWARD, UNKNOWN, np.nan
    p, now = memo[TABLE], memo[NOW]
    for j in range(motion.inputs.size):
        xs[now, n + j] = motion.inputs[j]
    state, reason, rest = resting(system, motion, proofs, p)
    if state == DAMPED:
        return state, reason, rest
    for k in range(proofs.against.size):
        real, imaginary = 0.0, 0.0
        for j in range(n):
            real += proofs.grows[k, 0, j] * xs[now, j]
            imaginary += proofs.grows[k, 1, j] * xs[now, j]
        if np.sqrt(real * real + imaginary * imaginary) > proofs.against[k] * MARGIN:
            return DIVERGENT, ESCAPED, rest
    for i in range(n):
        total, terms = 0.0, 0.0
        for j in range(n + motion.inputs.size):
            term = system.generator[p, i, j] * xs[now, j]
            total += term
            terms += abs(term)
        if abs(total) > REST_RATE * terms:
            return state, reason, rest
    first = 0
    return DAMPED, AT_REST, output(system.C, first, xs, now)
