"""Compiled variational flow of the exact engine: tangents carried from maximum to maximum of y.

Between switches a tangent (δx, δh) is carried by the same matrix exponential as the state. F is
continuous, so x' is, and the saltation matrix of a switch is the identity in x. The memory alone
jumps: where it meets a stop it forgets (δh = 0), and where pitch turns back on a flat it takes up
pitch, h = y - V, with δh = c δx because y' = 0 there. On a flat h follows y all along.
"""

from __future__ import annotations

import numpy as np

from aeroflutter.kernels import kernel
from aeroflutter.kernels.arrays import Real1, Real2
from aeroflutter.motion._kernel_exact import (
    HUGE,
    NONE,
    REVERSAL,
    STICK,
    ZENO,
    Law,
    advance,
    combine,
    flow_matrix,
    memory_at,
    output,
    start,
    step_end,
    switch,
    window,
    workspace,
)
from aeroflutter.motion._kernel_exact_ends import PATIENCE
from aeroflutter.motion._kernel_exact_roots import Y
from aeroflutter.motion._kernel_exact_tables import DEGREE, Array, Tables

DONE, OVERFLOW, STUCK, QUIET = 0, 1, 2, 3  # QUIET: no maximum of y within PATIENCE steps


@kernel
def carry(M: Array, tangents: Array, du: Array, scratch: Array) -> None:
    """Tangents of the states, the first n rows, over a step: δx ← E δx + g δu."""
    n = tangents.shape[0] - 1
    m = n + 1
    for i in range(n):
        for k in range(tangents.shape[1]):
            total = M[0, i * m + n] * du[k]
            for j in range(n):
                total += M[0, i * m + j] * tangents[j, k]
            scratch[i, k] = total
    tangents[:n] = scratch


@kernel
def follow_y(c: Array, tangents: Array) -> None:
    """Tangent of a memory that moves with y: δh = c δx, the last row."""
    n = c.size
    for k in range(tangents.shape[1]):
        total = 0.0
        for i in range(n):
            total += c[i] * tangents[i, k]
        tangents[n, k] = total


@kernel
def orthonormalise(tangents: Array, unit: Array, logs: Array) -> None:
    """Gram-Schmidt, done twice, in units of `unit`; adds the logarithms of the norms to `logs`.

    A tangent that has vanished stays zero and its logarithm is -inf.
    """
    m, columns = tangents.shape
    for k in range(columns):
        before = 0.0
        for i in range(m):
            before += (tangents[i, k] / unit[i]) ** 2
        for _ in range(2):
            for j in range(k):
                along = 0.0
                for i in range(m):
                    along += tangents[i, j] * tangents[i, k] / unit[i] ** 2
                for i in range(m):
                    tangents[i, k] -= along * tangents[i, j]
        total = 0.0
        for i in range(m):
            total += (tangents[i, k] / unit[i]) ** 2
        if total <= 1e-28 * before:
            tangents[:, k] = 0.0
            logs[k] = -np.inf
            continue
        norm = np.sqrt(total)
        logs[k] += np.log(norm)
        for i in range(m):
            tangents[i, k] /= norm


@kernel(entry=True)
def returns(
    tables: Tables,
    law: Law,
    x: Real1,
    h: float,
    mode: int,
    trend: int,
    tangents: Real2,
    unit: Real1,
    reach: Real1,
    points: Real2,
    times: Real1,
    troughs: Real1,
    logs: Real2,
) -> tuple[int, int, float, int, int]:
    """March over m maxima of y, the tangents made orthonormal again at each.

    Parameters
    ----------
    x
        State, (n,); left as the last one.
    h, mode, trend
        Memory, mode and sign of y'; a negative mode and a trend of 0 are found from the state.
    tangents
        Columns (δx, δh), (n+1, k); left as the last ones.
    unit
        What counts as one of each, (n+1,).
    reach
        Raised to the largest size of each state on the way, (n,).
    points, times, troughs
        Filled with (x, h) at the maxima, their times from here on, and the lowest minimum of y
        since the maximum before, (m, n+1), (m,), (m,).
    logs
        Filled with the growth of the tangents since here, logarithms, (m, k).

    Returns
    -------
    status, count, h, mode, trend
        `count` maxima were reached.
    """
    n, columns = x.size, tangents.shape[1]
    work = workspace(n)
    xs, w, line, M, c = work.xs, work.polynomials, work.line, work.M, tables.c
    scratch = np.empty((n, columns))
    none = np.zeros(columns)
    total = np.zeros(columns)
    now = 0
    xs[0, :n] = x
    if mode < 0:
        mode, h = start(law, h, output(c, xs, 0))
    p, u, low, high, direction = window(law, mode, h)
    t, trough = 0.0, np.inf
    count, steps, zero_steps = 0, 0, 0
    status = DONE
    while count < points.shape[0]:
        steps += 1
        xs[now, n] = u
        combine(tables.lines, p, xs, now, line)
        if not abs(w[Y, DEGREE]) < HUGE:
            status = OVERFLOW
            break
        s, kind, turns, trend = step_end(
            tables.noise, law.size, xs, now, w, (low, high, direction), trend
        )
        du = tangents[n] if law.memory == 1 and mode == STICK else none
        advance(tables.flow, p, s, xs, now, line, M, n)
        if s == 1.0:
            flow_matrix(tables.flow, p, s, M)  # which the state did not need
        carry(M, tangents, du, scratch)
        now = 1 - now
        for i in range(n):
            reach[i] = max(reach[i], abs(xs[now, i]))
        after = t + s * tables.step[p]
        zero_steps = zero_steps + 1 if after == t else 0
        t = after
        if kind != NONE:
            mode, h = switch(law, mode, h, output(c, xs, now), kind)
            if kind == REVERSAL:
                follow_y(c, tangents)
            elif law.memory == 1 and mode == STICK:
                tangents[n] = 0.0
            p, u, low, high, direction = window(law, mode, h)
        if turns:
            y = output(c, xs, now)
            steps = 0
            if trend < 0:
                trough = min(trough, y)
            else:
                held = memory_at(law, mode, h, y)
                if law.memory == 1 and mode != STICK:
                    follow_y(c, tangents)
                orthonormalise(tangents, unit, total)
                points[count, :n] = xs[now, :n]
                points[count, n] = held
                times[count], troughs[count], logs[count] = t, trough, total
                trough = np.inf
                count += 1
            trend = -trend
        if zero_steps > ZENO:
            status = STUCK
            break
        if steps > PATIENCE:
            status = QUIET
            break
    x[:] = xs[now, :n]
    return status, count, memory_at(law, mode, h, output(c, xs, now)), mode, trend
