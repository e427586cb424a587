"""Compiled proofs that a motion of the exact engine is decided: it decays, or grows, for good."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from aeroflutter.kernels import kernel
from aeroflutter.kernels.arrays import Real1, Real2, Real3, Whole1, Whole2
from aeroflutter.motion._kernel_exact import Law, output, window
from aeroflutter.motion._kernel_exact_tables import Array, Tables

ONWARD = -1
DAMPED, LCO, APERIODIC, DIVERGENT, UNDECIDED = 0, 1, 2, 3, 4
TRAPPED, AT_REST, CONVERGED, KNOWN, UNSETTLED, ESCAPED, GREW = 0, 1, 2, 3, 4, 5, 6
DRIFTING, NO_CYCLE, OUT_OF_TIME, NEUTRAL, OVERFLOWED, CHATTERING = 7, 8, 9, 10, 11, 12

MARGIN = 1.0 + 1e-9  # of the proofs, for the round-off in their tables
STILL = 1e-11  # relative rate of change of a motion at rest


class Proofs(NamedTuple):
    """What ends a motion for good. p pieces (of a loop: the stick), q unstable coordinates.

    Attributes
    ----------
    decays
        1 where all motion about the rest of the piece dies out, (p,).
    rows, heads
        Coordinates whose groups each never grow, scaled so that the norms of the groups add up
        to a bound of |y - rest|, (p, n, n); a 1 marks the first row of a group, (p, n).
    centre, rest
        Equilibrium a + b h and its y, (p, 2, n) and (p, 2).
    free
        Row that adds the y of a motion that a neutral piece leaves behind, (p, n).
    grows, against
        Coordinates that grow on the outer piece, real and imaginary rows (q, 2, n), and the size
        from which the spring cannot turn them back, (q,).
    unstable
        1 if an outer piece is unstable.
    """

    decays: Whole1
    rows: Real3
    heads: Whole2
    centre: Real3
    rest: Real2
    free: Real2
    grows: Real3
    against: Real1
    unstable: int


@kernel
def trapped(
    proofs: Proofs, p: int, h: float, low: float, high: float, xs: Array, row: int, y: float
) -> float:
    """The y of rest if the motion provably never leaves its piece again, else NaN."""
    if proofs.decays[p] == 0:
        return np.nan
    n = proofs.free.shape[1]
    rest = proofs.rest[p, 0] + proofs.rest[p, 1] * h
    for j in range(n):
        rest += proofs.free[p, j] * xs[row, j]
    room = min(high - rest, rest - low)
    if not abs(y - rest) < room:  # the bound is no less: spare the work
        return np.nan
    bound, group = 0.0, 0.0
    for i in range(n):
        value = 0.0
        for j in range(n):
            away = xs[row, j] - proofs.centre[p, 0, j] - proofs.centre[p, 1, j] * h
            value += proofs.rows[p, i, j] * away
        if proofs.heads[p, i]:
            bound += np.sqrt(group)
            group = 0.0
        group += value * value
    bound += np.sqrt(group)
    return rest if bound * MARGIN < room else np.nan


@kernel
def escaped(proofs: Proofs, xs: Array, row: int) -> bool:
    """Whether an unstable coordinate is beyond what the spring can oppose."""
    for k in range(proofs.against.size):
        real = 0.0
        imaginary = 0.0
        for j in range(proofs.grows.shape[2]):
            real += proofs.grows[k, 0, j] * xs[row, j]
            imaginary += proofs.grows[k, 1, j] * xs[row, j]
        if np.sqrt(real * real + imaginary * imaginary) > proofs.against[k] * MARGIN:
            return True
    return False


@kernel
def still(generator: Array, p: int, xs: Array, now: int) -> bool:
    """Whether the rate of every state is round-off of the terms that make it up."""
    n = generator.shape[1]
    for i in range(n):
        total = 0.0
        terms = 0.0
        for j in range(n + 1):
            term = generator[p, i, j] * xs[now, j]
            total += term
            terms += abs(term)
        if abs(total) > STILL * terms:
            return False
    return True


@kernel
def certain(
    tables: Tables, law: Law, proofs: Proofs, xs: Array, now: int, h: float, mode: int
) -> tuple[int, int]:
    """End state that (x, u) alone proves, or `ONWARD`."""
    p, u, low, high, direction = window(law, mode, h)
    xs[now, tables.c.size] = u
    if direction == 0:
        y = output(tables.c, xs, now)
        rest = trapped(proofs, 0 if law.memory else mode, h, low, high, xs, now, y)
        if not np.isnan(rest):
            return DAMPED, TRAPPED
    if escaped(proofs, xs, now):
        return DIVERGENT, ESCAPED
    if still(tables.generator, p, xs, now):
        return DAMPED, AT_REST
    return ONWARD, 0


@kernel
def rest_of(law: Law, proofs: Proofs, c: Array, xs: Array, now: int, h: float, mode: int) -> float:
    """The y at which a damped motion comes to rest."""
    _, _, low, high, direction = window(law, mode, h)
    rest, y = np.nan, output(c, xs, now)
    if direction == 0:
        rest = trapped(proofs, 0 if law.memory else mode, h, low, high, xs, now, y)
    return y if np.isnan(rest) else rest
