"""Reference for the exact engine: heyoka's Taylor series with their own events, piece by piece.

Nothing here comes from the package but the numbers of a system and of a spring. Moments and
switches are written anew from the definitions of the springs.

Moments are continuous, so a switch that comes late by a band of pitch changes the motion only to
the second order in that band. Every edge is therefore crossed by a band, far above round-off,
before it counts, and the next piece begins well within its own edges: no event lies at a restart,
none fires twice, and a motion that only touches an edge needs no care.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from typing import NamedTuple

import numpy as np

# In y, and in y' a unit of time; of the largest state so far, or of the spring's scale.
BAND = 1e-12


class Exit(NamedTuple):
    """What ends a leg: sign·(y or y') above sign·value by some bands; and the leg that follows."""

    quantity: str
    sign: int
    value: float
    then: Callable[[float], Leg]  # of y at the exit
    bands: int = 1


class Leg(NamedTuple):
    """F = slope y + offset until one of the exits; the memory at y on the way."""

    slope: float
    offset: float
    exits: list[Exit]
    memory: Callable[[float], float]


def taylor_march(system, spring, state, memory, duration):
    """State and memory at `duration` by heyoka's `taylor_adaptive`."""
    integrator = _integrator(system.order)
    integrator.time, integrator.state[:] = 0.0, state
    leg, band = _first_leg(spring, system.c @ state, memory), BAND * spring.scale
    while True:
        band = max(band, BAND * np.abs(integrator.state).max())
        rows, values = _prepare(integrator, system, leg, band)
        integrator.reset_cooldowns()
        outcome, *_ = integrator.propagate_until(
            float(duration), callback=partial(_inside, rows, values + 0.5 * band)
        )
        y = system.c @ integrator.state
        if outcome == type(outcome).time_limit:
            return integrator.state.copy(), leg.memory(y)
        leg = leg.exits[-1 - int(outcome)].then(y)


def _inside(rows, values, integrator):
    """Asked after every step: an exit passed without its event would be lost for good."""
    assert np.all(rows @ integrator.state < values), "an event was missed"
    return True


@cache
def _integrator(n):
    """x' = M x + f with two terminal events, rows·x rising through values: all of it parameters."""
    import heyoka as hy

    x = hy.make_vars(*(f"x{i}" for i in range(n)))
    at = iter(range((n + 1) * (n + 2)))

    def line():
        return hy.sum([hy.par[next(at)] * each for each in x]) + hy.par[next(at)]

    equations = [(each, line()) for each in x]
    rising = {"direction": hy.event_direction.positive, "cooldown": 0.0}
    events = [hy.t_event(line(), **rising) for _ in range(2)]
    return hy.taylor_adaptive(equations, np.zeros(n), t_events=events)


def _prepare(integrator, system, leg, band):
    """Write a leg into the integrator's parameters; rows and values of its exits."""
    n, c = system.order, system.c
    M, f = system.A - leg.slope * np.outer(system.b, c), -leg.offset * system.b
    rows, values = np.zeros((2, n)), np.ones(2)  # without an exit: 0 x - 1 < 0 for ever
    for i, out in enumerate(leg.exits):
        row, constant = (c, 0.0) if out.quantity == "y" else (c @ M, c @ f)
        rows[i] = out.sign * row
        values[i] = out.sign * (out.value - constant) + out.bands * band
    lines = np.vstack((np.column_stack((M, f)), np.column_stack((rows, -values))))
    integrator.pars[:] = lines.ravel()
    return rows, values


def _first_leg(spring, y, memory):
    if spring.kind != "hysteresis":
        points, ends = _corners(spring)
        return _piece(points, ends, sum(y > at for at, _ in points))
    low, high = spring.h_off - spring.delta_h / 2, spring.h_off + spring.delta_h / 2
    slid = np.clip(memory, y - _flat(spring, 1)[0], y - _flat(spring, -1)[0])
    return _stuck(spring, float(np.clip(slid, low, high)))


# --- static springs: straight between corners


def _corners(spring):
    """Pitch and moment at every corner, and the slopes below the first and above the last."""
    if spring.kind == "linear":
        return [(spring.centre, 0.0)], (spring.stiffness, spring.stiffness)
    if spring.kind == "freeplay":
        return [(spring.centre + side * spring.gap / 2, 0.0) for side in (-1, 1)], (1.0, 1.0)
    if spring.kind == "bilinear":
        start = (spring.alpha_f, spring.m0)
        return [start, (start[0] + spring.delta, start[1] + spring.m_f * spring.delta)], (1.0, 1.0)
    points = list(zip(spring.pitch, spring.moments, strict=True))
    return points[1:-1] or points[:1], (_rise(*points[:2]), _rise(*points[-2:]))


def _rise(one, other):
    return (other[1] - one[1]) / (other[0] - one[0])


def _piece(points, ends, i):
    """Leg between corners i - 1 and i."""
    below, above = points[i - 1 : i], points[i : i + 1]
    slope = _rise(*below, *above) if below and above else ends[bool(below)]
    at, moment = (below or above)[0]
    exits = [
        Exit("y", sign, corner, lambda _, i=i + sign: _piece(points, ends, i))
        for sign, side in ((-1, below), (1, above))
        for corner, _ in side
    ]
    return Leg(slope, moment - slope * at, exits, lambda _: 0.0)


# --- the loop: a unit spring in series with a slider between two stops


def _flat(loop, way):
    """Moment while pitch rises (1) or falls (-1) with the slider, and the stop ahead of it."""
    return loop.v_off + way * loop.delta_v / 2, loop.h_off + way * loop.delta_h / 2


def _stuck(loop, h):
    """The slider holds at h, F = y - h, until the moment overcomes it; never beyond a stop."""
    exits = []
    for way in (1, -1):
        moment, stop = _flat(loop, way)
        if way * (stop - h) > 0:
            exits.append(Exit("y", way, h + moment, lambda _, way=way: _slides(loop, way)))
    return Leg(1.0, -h, exits, lambda _: h)


def _slides(loop, way):
    """F stays at the flat's moment until pitch turns back or the slider is stopped.

    The slider, set off one band late however near to the stop, is stopped two bands late.
    """
    moment, stop = _flat(loop, way)

    def memory(y):
        return min(y - moment, stop) if way > 0 else max(y - moment, stop)

    turn = Exit("y'", -way, 0.0, lambda y: _stuck(loop, memory(y)))
    stopped = Exit("y", way, moment + stop, lambda _: _stuck(loop, stop), bands=2)
    return Leg(0.0, moment, [turn, stopped], memory)
