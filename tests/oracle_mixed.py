"""Motions with polynomials beside laws with memory, by SciPy's DOP853 with events.

Written from the equations alone, with none of the package: x' = A x - B F(C x) + d, each spring

- a polynomial, F = Σ beta[i] y^(i+1); or
- a loop, h <- clip(clip(h, y - v1, y - v2), h_low, h_high), F = y - h; or
- play, h <- clip(h, y - half, y + half), F = h, which is such a loop without stops, F = h.

A loop sticks, or slides while y rises (h = y - v1) or falls (h = y - v2), until y turns or h meets
its stop. F is continuous, so a change that comes late by a band of y counts to the second order:
edges are crossed by a band far above round-off, and no change is found twice.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

BAND = 1e-12
RTOL = 1e-12
STICK, RISE, FALL = 0, 1, 2


class Power(NamedTuple):
    """F = Σ beta[i] y^(i+1)."""

    beta: tuple[float, ...]


class Slider(NamedTuple):
    """F = y - h, or h if it is play, with h <- clip(clip(h, y - v1, y - v2), h_low, h_high)."""

    v1: float
    v2: float
    h_low: float = -np.inf
    h_high: float = np.inf
    play: bool = False


class _Run:
    """Modes and memories of all springs; a polynomial has neither."""

    def __init__(self, system, springs, x, memory):
        self.A, self.B, self.C, self.d = system
        self.springs, self.modes = springs, [STICK] * len(springs)
        self.h = [0.0] * len(springs)
        for i, (one, y, h) in enumerate(zip(springs, self.C @ x, memory, strict=True)):
            if isinstance(one, Slider):
                self.h[i] = min(max(min(max(h, y - one.v1), y - one.v2), one.h_low), one.h_high)

    def memory(self, i, y):
        one, mode = self.springs[i], self.modes[i]
        return self.h[i] if mode == STICK else y - (one.v1 if mode == RISE else one.v2)

    def force(self, i, y):
        one = self.springs[i]
        if isinstance(one, Power):
            return sum(b * y ** (k + 1) for k, b in enumerate(one.beta))
        return self.memory(i, y) if one.play else y - self.memory(i, y)

    def rate(self, _, x):
        forces = [self.force(i, y) for i, y in enumerate(self.C @ x)]
        return self.A @ x - self.B @ forces + self.d

    def guards(self, i):
        """Functions that fall through zero where the mode ends, and the mode that follows."""
        one, mode, c, h = self.springs[i], self.modes[i], self.C[i], self.h[i]
        if isinstance(one, Power):
            return
        if mode == STICK:
            if h < one.h_high:
                yield lambda _, x: h + one.v1 + BAND - c @ x, RISE
            if h > one.h_low:
                yield lambda _, x: c @ x - h - one.v2 + BAND, FALL
            return
        side, lag, stop = (1, one.v1, one.h_high) if mode == RISE else (-1, one.v2, one.h_low)
        yield lambda t, x: side * (c @ self.rate(t, x)) + BAND, STICK
        if np.isfinite(stop):
            yield lambda _, x: side * (stop + lag - c @ x) + 2 * BAND, STICK

    def switch(self, i, mode, y):
        one = self.springs[i]
        if mode == STICK:
            self.h[i] = min(max(self.memory(i, y), one.h_low), one.h_high)
        self.modes[i] = mode


def march(system, springs, x, memory, time, step=0.3):
    """State and memories (0 of a polynomial) at a time, and the number of switches."""
    run, t, switches = _Run(system, springs, np.asarray(x, float), memory), 0.0, 0
    size = float(np.abs(x).max())
    while t < time:
        found, owners = [], []
        for i in range(len(springs)):
            for guard, mode in run.guards(i):
                guard.terminal, guard.direction = True, -1
                found.append(guard)
                owners.append((i, mode))
        leg = solve_ivp(run.rate, (t, time), x, method="DOP853", events=found or None,
                        rtol=RTOL, atol=RTOL * size, max_step=step)  # fmt: skip
        assert leg.status >= 0
        t, x = float(leg.t[-1]), leg.y[:, -1]
        if leg.status == 1:
            (which,) = [k for k, times in enumerate(leg.t_events) if times.size]
            i, mode = owners[which]
            run.switch(i, mode, float(run.C[i] @ x))
            switches += 1
    y = run.C @ x
    held = [run.memory(i, y[i]) if isinstance(one, Slider) else 0.0
            for i, one in enumerate(springs)]  # fmt: skip
    return x, np.array(held), switches
