"""Compiled work of a step with its matrix: the state at its end, and the tangents over it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from aeroflutter.kernels import kernel
from aeroflutter.motion._kernel_roots import WIDTH
from aeroflutter.springs._kernel_columns import HELD

if TYPE_CHECKING:
    from aeroflutter.motion._kernel_flow import Motion, System

Array = NDArray[np.float64]


@kernel(inner=True, bare=True)
def flow_matrix(table: Array, p: int, s: float, M: Array) -> None:
    """M(s), (size,), from its power coefficients (k, w + 1, size)."""
    s2 = s * s
    s3 = s2 * s
    s4 = s2 * s2
    for k in range(M.size):
        M[k] = (table[p, 12, k] + s * table[p, 13, k]) + (
            s2 * table[p, 14, k] + s3 * table[p, 15, k]
        )
    for j in range(8, -1, -4):
        for k in range(M.size):
            M[k] = M[k] * s4 + (
                (table[p, j, k] + s * table[p, j + 1, k])
                + (s2 * table[p, j + 2, k] + s3 * table[p, j + 3, k])
            )


@kernel(inner=True, bare=True)
def apply(M: Array, xs: Array, now: int, n: int) -> None:
    """The other row of `xs` ← M (x, u), for M flattened by rows."""
    m = M.size // n
    for i in range(n - n % 3, n):
        s0 = 0.0
        for j in range(m):
            s0 += M[i * m + j] * xs[now, j]
        xs[1 - now, i] = s0
    for i in range(0, n - 2, 3):  # three rows at a time hide the latency of the sums
        r0, r1, r2 = i * m, (i + 1) * m, (i + 2) * m
        s0 = s1 = s2 = 0.0
        for j in range(m):
            v = xs[now, j]
            s0 += M[r0 + j] * v
            s1 += M[r1 + j] * v
            s2 += M[r2 + j] * v
        xs[1 - now, i] = s0
        xs[1 - now, i + 1] = s1
        xs[1 - now, i + 2] = s2


@kernel(inner=True, bare=True)
def carry(system: System, motion: Motion, xs: Array, now: int) -> None:
    """Tangents over a step from (x, u) whose M is known: δx ← E δx + g δu, and the parameter's.

    Where F is continuous, so is x', and a switch leaves the tangents of the states as they are.
    """
    n = system.C.shape[1]
    M, tangents, scratch = motion.M, motion.tangents, motion.scratch
    columns = tangents.shape[1]
    width = M.size // n
    for i in range(n):
        for k in range(columns):
            scratch[i, k] = M[i * width] * tangents[0, k]
        for j in range(1, n):
            factor = M[i * width + j]
            for k in range(columns):
                scratch[i, k] += factor * tangents[j, k]
        for spring in range(system.C.shape[0]):
            factor = system.laws[spring, motion.modes[spring], HELD] * M[i * width + n + spring]
            if factor != 0.0:
                for k in range(columns):
                    scratch[i, k] += factor * tangents[n + spring, k]
        if motion.dM.size:
            for j in range(width):
                scratch[i, columns - 1] += motion.dM[i * width + j] * xs[now, j]
    for i in range(n):
        for k in range(columns):
            tangents[i, k] = scratch[i, k]


@kernel(inner=True, bare=True)
def catch_up(system: System, motion: Motion, p: int, count: int) -> None:
    """Carry the tangents over whole steps on a table, from `since` on.

    Where there are many states as many at once as there are tables of.
    """
    n, first = system.C.shape[1], 0
    level = system.flow.shape[1] - WIDTH - 1
    while count > 0:
        while 1 << level > count:
            level -= 1
        for k in range(motion.M.size):
            motion.M[k] = system.flow[p, WIDTH + level, k]
        for k in range(motion.dM.size):
            motion.dM[k] = system.d_flow[p, WIDTH + level, k]
        carry(system, motion, motion.since, first)
        apply(motion.M, motion.since, first, n)
        for j in range(n):
            motion.since[0, j] = motion.since[1, j]
        count -= 1 << level


@kernel(inner=True, bare=True)
def follow_y(C: Array, spring: int, tangents: Array) -> None:
    """Tangent of a memory that moves with y: δh = C δx."""
    n = C.shape[1]
    for k in range(tangents.shape[1]):
        total = 0.0
        for i in range(n):
            total += C[spring, i] * tangents[i, k]
        tangents[n + spring, k] = total
