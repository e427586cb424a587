"""Compiled marches of the exact engine: with samples and logs, and with the Jacobian."""

from __future__ import annotations

import numpy as np

from aeroflutter.kernels import kernel
from aeroflutter.kernels.arrays import Real1, Real2, Whole1
from aeroflutter.motion._kernel_exact import (
    DONE,
    FULL,
    HUGE,
    NONE,
    OVERFLOW,
    REVERSAL,
    STICK,
    STUCK,
    ZENO,
    Law,
    advance,
    apply,
    clear,
    combine,
    event,
    flow_matrix,
    memory_at,
    moment,
    output,
    round_off,
    start,
    step_end,
    switch,
    window,
    workspace,
)
from aeroflutter.motion._kernel_exact_roots import Y
from aeroflutter.motion._kernel_exact_tables import DEGREE, WIDTH, Array, Tables

EVENT_COLUMNS = 5  # time, kind, mode after it, y, F
TURN_COLUMNS = 3  # time, y, +1 at a maximum and -1 at a minimum
SAMPLES, EVENTS, TURNS, TREND, ZERO_STEPS = 0, 1, 2, 3, 4  # what `memo` carries on


@kernel
def state_polynomial(table: Array, p: int, xs: Array, now: int, out: Array) -> None:
    """Power coefficients (w, n) of all states over a step from (x, u)."""
    n = out.shape[1]
    m = n + 1
    for k in range(WIDTH):
        for i in range(n):
            total = 0.0
            for j in range(m):
                total += table[p, k, i * m + j] * xs[now, j]
            out[k, i] = total


@kernel
def evaluate(coefficients: Array, s: float, states: Array, row: int) -> None:
    """States at a place s of the step, into a row of `states`."""
    for i in range(states.shape[1]):
        states[row, i] = coefficients[DEGREE, i]
    for k in range(DEGREE - 1, -1, -1):
        for i in range(states.shape[1]):
            states[row, i] = states[row, i] * s + coefficients[k, i]


@kernel(entry=True)
def march(
    tables: Tables,
    law: Law,
    x: Real1,
    h: float,
    mode: int,
    t: float,
    end: float,
    times: Real1,
    states: Real2,
    springs: Real2,
    events: Real2,
    turns: Real2,
    memo: Whole1,
) -> tuple[int, float, float, int]:
    """March from t to `end`, sampling and logging on the way.

    Parameters
    ----------
    x
        State at t, (n,); left as the state where the march stopped.
    h, mode
        Memory and mode; a negative mode is found from y.
    times
        Ascending times of samples, (k,), none before t.
    states, springs
        Filled with the samples: states (k, n); memory and moment (k, 2).
    events
        Filled with the switches, (.., EVENT_COLUMNS); they are not kept if it is empty.
    turns
        Filled with the extrema of y, (.., TURN_COLUMNS); none are looked for if it is empty. A
        step ends at each, as in `_kernel_exact_ends.settle`: both make the very same motion.
    memo
        (5,): counts of samples, events and turns so far, sign of y', switches without progress.

    Returns
    -------
    status, t, h, mode
        `FULL` if a log has no room for another step: empty it and call again.
    """
    n = x.size
    work = workspace(n)
    xs, w, line, M, c = work.xs, work.polynomials, work.line, work.M, tables.c
    coefficients = np.empty((WIDTH, n))
    now = 0
    xs[0, :n] = x
    if mode < 0:
        mode, h = start(law, h, output(c, xs, 0))
    p, u, low, high, direction = window(law, mode, h)
    status = DONE
    events_wanted, turns_wanted = events.shape[0] > 0, turns.shape[0] > 0
    while t < end:
        if (events_wanted and memo[EVENTS] >= events.shape[0]) or (
            turns_wanted and memo[TURNS] >= turns.shape[0]
        ):
            status = FULL
            break
        xs[now, n] = u
        combine(tables.lines, p, xs, now, line)
        if not abs(w[Y, DEGREE]) < HUGE:
            status = OVERFLOW
            break
        step = tables.step[p]
        s, kind, turns_here, trend = 1.0, NONE, False, memo[TREND]
        if turns_wanted:
            s, kind, turns_here, trend = step_end(
                tables.noise, law.size, xs, now, w, (low, high, direction), trend
            )
        elif not clear(w, low, high, direction):
            s, kind = event(w, low, high, direction, round_off(tables.noise, xs, now, law.size))
            s = min(s, 1.0)
        after = t + s * step
        if after > end:
            s, kind, after, turns_here = min((end - t) / step, 1.0), NONE, end, False
        memo[TREND] = trend
        sample = memo[SAMPLES]
        if sample < times.size and times[sample] <= after:
            state_polynomial(tables.flow, p, xs, now, coefficients)
            while sample < times.size and times[sample] <= after:
                evaluate(coefficients, max(times[sample] - t, 0.0) / step, states, sample)
                y = output(c, states, sample)
                springs[sample, 0] = memory_at(law, mode, h, y)
                springs[sample, 1] = moment(law, mode, h, y)
                sample += 1
            memo[SAMPLES] = sample
        advance(tables.flow, p, s, xs, now, line, M, n)
        now = 1 - now
        memo[ZERO_STEPS] = memo[ZERO_STEPS] + 1 if after == t else 0
        t = after
        if turns_here:
            row = turns[memo[TURNS]]
            row[0], row[1], row[2] = t, output(c, xs, now), trend
            memo[TURNS] += 1
            memo[TREND] = -trend
        if kind != NONE:
            y = output(c, xs, now)
            force = moment(law, mode, h, y)
            mode, h = switch(law, mode, h, y, kind)
            if events_wanted:
                row = events[memo[EVENTS]]
                row[0], row[1], row[2], row[3], row[4] = t, kind, mode, y, force
                memo[EVENTS] += 1
            p, u, low, high, direction = window(law, mode, h)
        if memo[ZERO_STEPS] > ZENO:
            status = STUCK
            break
    x[:] = xs[now, :n]
    return status, t, memory_at(law, mode, h, output(c, xs, now)), mode


@kernel
def _start_memory(law: Law, c: Array, h0: float, h: float, dh: Array) -> None:
    """Derivative of the memory after the starting clips, over (x, h, parameter)."""
    n = c.size
    dh[:] = 0.0
    if law.memory == 0:
        return
    if h == h0:
        dh[n] = 1.0
    elif h != law.loop[2] and h != law.loop[3]:
        dh[:n] = c


@kernel
def _carry(M: Array, dM: Array, S: Array, du: Array, xs: Array, now: int, scratch: Array) -> None:
    """Sensitivities over a step: S ← E S + g du, and the parameter's own part from dM."""
    n, columns = S.shape
    m = n + 1
    for i in range(n):
        for k in range(columns):
            total = M[0, i * m + n] * du[k]
            for j in range(n):
                total += M[0, i * m + j] * S[j, k]
            scratch[i, k] = total
        if dM.size:
            for j in range(m):
                scratch[i, columns - 1] += dM[0, i * m + j] * xs[now, j]
    S[:] = scratch


@kernel(entry=True)
def flow(
    tables: Tables,
    law: Law,
    x: Real1,
    h: float,
    mode: int,
    duration: float,
    jacobian: Real2,
    events: Real2,
) -> tuple[int, float, int, int]:
    """The flow over `duration`, with its Jacobian.

    Parameters
    ----------
    x
        Initial state (n,); left as the final one.
    h, mode
        Initial memory and mode; a negative mode is found from y.
    jacobian
        Filled with d(x, h)/d(x0, h0, parameter), (n+1, n+2). The last column is zero unless the
        tables were built with dA and db.
    events
        Filled with as many switches as there is room for, (.., EVENT_COLUMNS).

    Returns
    -------
    status, h, mode, count
        `count` is the number of switches, noted or not.

    Notes
    -----
    F is continuous, so x' is, and a switch leaves the sensitivities as they are. Only the memory
    jumps: it forgets where it meets a stop, and takes up y at a reversal, where dh = c dx
    because y' = 0.
    """
    n = x.size
    work = workspace(n)
    xs, w, line, M, c = work.xs, work.polynomials, work.line, work.M, tables.c
    S = np.zeros((n, n + 2))
    scratch = np.empty((n, n + 2))
    dh = np.zeros(n + 2)
    none = np.zeros(n + 2)
    dM = np.empty((min(1, tables.d_flow.shape[1]), tables.d_flow.shape[2]))
    for i in range(n):
        S[i, i] = 1.0
    now = 0
    xs[0, :n] = x
    first, starting = start(law, h, output(c, xs, 0))
    _start_memory(law, c, h, starting, dh)
    mode, h = (first if mode < 0 else mode), starting
    t = 0.0
    count = 0
    zero_steps = 0
    status = DONE
    while t < duration:
        p, u, low, high, direction = window(law, mode, h)
        xs[now, n] = u
        combine(tables.lines, p, xs, now, line)
        if not abs(w[Y, DEGREE]) < HUGE:
            status = OVERFLOW
            break
        step = tables.step[p]
        s, kind = 1.0, NONE
        if not clear(w, low, high, direction):
            tolerance = round_off(tables.noise, xs, now, law.size)
            s, kind = event(w, low, high, direction, tolerance)
            s = min(s, 1.0)
        after = t + s * step
        if after > duration:
            s, kind, after = min((duration - t) / step, 1.0), NONE, duration
        flow_matrix(tables.flow, p, s, M)
        if dM.size:
            flow_matrix(tables.d_flow, p, s, dM)
        sticks = law.memory == 1 and mode == STICK
        _carry(M, dM, S, dh if sticks else none, xs, now, scratch)
        apply(M, xs, now, n)
        now = 1 - now
        zero_steps = zero_steps + 1 if after == t else 0
        t = after
        if kind != NONE:
            y = output(c, xs, now)
            force = moment(law, mode, h, y)
            mode, h = switch(law, mode, h, y, kind)
            if kind == REVERSAL:
                _row(c, S, dh)
            elif law.memory == 1 and mode == STICK:
                dh[:] = 0.0
            if count < events.shape[0]:
                row = events[count]
                row[0], row[1], row[2], row[3], row[4] = t, kind, mode, y, force
            count += 1
        if zero_steps > ZENO:
            status = STUCK
            break
    x[:] = xs[now, :n]
    if law.memory == 1 and mode != STICK:
        h = memory_at(law, mode, h, output(c, xs, now))
        _row(c, S, dh)
    jacobian[:n] = S
    jacobian[n] = dh
    return status, h, mode, count


@kernel
def _row(c: Array, S: Array, out: Array) -> None:
    """C S, the sensitivity of y."""
    for k in range(S.shape[1]):
        total = 0.0
        for i in range(c.size):
            total += c[i] * S[i, k]
        out[k] = total


@kernel(entry=True)
def rate(tables: Tables, law: Law, x: Real1, h: float, mode: int, out: Real1) -> None:
    """X' at a state, (n,)."""
    n = x.size
    p, u, _, _, _ = window(law, mode, h)
    G = tables.generator[p]
    for i in range(n):
        total = G[i, n] * u
        for j in range(n):
            total += G[i, j] * x[j]
        out[i] = total
