"""References for the time marches, written apart from the package's own engines."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

from aeroflutter import (
    Bilinear,
    Freeplay,
    Hysteresis,
    Linear,
    SectionFamily,
    Table,
    TypicalSection,
)
from aeroflutter.linear.rootlocus import flutter_speed
from aeroflutter.motion.flow import Flow
from aeroflutter.motion.march import March
from aeroflutter.motion.response import Initial


def event_march(system, spring, state, memory, duration, rtol=1e-12):
    """State and memory at `duration` by SciPy's DOP853, restarted at every switch of the spring.

    Works from the law of the spring alone: breaks and moments of a static one, the two clips of
    the hysteresis loop.
    """
    A, b, c = system.A, system.b, system.c
    loop = spring.kind == "hysteresis"
    time, x, h = 0.0, np.array(state, dtype=float), float(memory)
    while time < duration:
        y, v = c @ x, c @ (A @ x)
        law, events = _loop_law(spring, h, y, v) if loop else _static_law(spring, y, v)

        def rate(t, z, law=law):
            return A @ z - b * (law[0] * (c @ z) + law[1])

        functions = [_watched(system, *event) for event in events]
        options = {"method": "DOP853", "rtol": rtol, "atol": rtol * 1e-2 * np.abs(x).max()}
        # A first short leg leaves the surface that ended the one before.
        leg = solve_ivp(rate, (time, min(time + 1e-7, duration)), x, **options)
        if leg.t[-1] < duration:
            begin, z = leg.t[-1], leg.y[:, -1]
            options |= {"events": functions, "dense_output": True}
            leg = solve_ivp(rate, (begin, duration), z, **options)
            passed = _first_passed(leg, functions)
            if passed is not None:
                leg = solve_ivp(rate, (begin, passed), z, **options)
        time, x = leg.t[-1], leg.y[:, -1]
        h = float(spring.advance(h, c @ x))
    return x, h


def _watched(system, kind, value, direction):
    """Event function that ends a leg."""

    def function(_, z):
        return system.c @ (system.A @ z) if kind == "turn" else system.c @ z - value

    function.terminal, function.direction = True, direction
    return function


def _first_passed(leg, functions):
    """A time at which a surface has been passed, if the integrator stepped over it and back."""
    parts = np.linspace(0.0, 1.0, 16, endpoint=False)[1:]
    times = (leg.t[:-1, None] + np.diff(leg.t)[:, None] * parts).ravel()
    states = leg.sol(times)
    found = []
    for function in functions:
        values = function(0.0, states)
        side = np.sign(function(0.0, leg.y[:, 0]))
        if side == function.direction:
            continue  # from here it is passed unnoticed, on purpose
        beyond = side * values < -1e-13 * np.abs(values).max()
        if beyond.any():
            found.append(times[np.argmax(beyond)])
    return min(found, default=None)


def _static_law(spring, y, v):
    pieces = spring.pieces()
    i = int(np.searchsorted(pieces.breaks, y + 1e-10 * np.sign(v) * spring.scale))
    events = [("cross", at, 0) for at in pieces.breaks]
    return (pieces.slopes[i], pieces.offsets[i]), events


def _loop_law(spring, h, y, v):
    tiny = 1e-10 * spring.scale
    rising = h < spring.h_high - tiny and y >= h + spring.v1 - tiny and v > tiny
    falling = h > spring.h_low + tiny and y <= h + spring.v2 + tiny and v < -tiny
    if rising:
        return (0.0, spring.v1), [("turn", 0.0, -1), ("cross", spring.h_high + spring.v1, 1)]
    if falling:
        return (0.0, spring.v2), [("turn", 0.0, 1), ("cross", spring.h_low + spring.v2, -1)]
    events = []
    if h < spring.h_high - tiny:
        events.append(("cross", h + spring.v1, 1))
    if h > spring.h_low + tiny:
        events.append(("cross", h + spring.v2, -1))
    return (1.0, -h), events


def plain_houbolt(section, a, b, speed, spring, alpha, dt, steps):
    """Pitch and heave by Houbolt's scheme as the thesis writes it, for the two-degree section.

    Mass and damping matrices from equations 3.9-3.10, the Wagner start as w(0) Σ a exp(-b τ),
    each Duhamel integral from zero, a 2 x 2 solve a step.
    """
    mu, a_h, x, r2 = section.mu, section.a_h, section.x_alpha, section.r_alpha**2
    M = np.array([[1 + 1 / mu, x - a_h / mu], [x / r2 - a_h / (mu * r2), 1]])
    M[1, 1] += (a_h**2 + 0.125) / (mu * r2)
    ratio = section.omega_bar / speed
    C = np.array([[2 * section.zeta_xi * ratio, 1 / mu], [0, 2 * section.zeta_alpha / speed]])
    C[1, 1] += (0.5 - a_h) / (mu * r2)
    K = np.array([[ratio**2, 0.0], [0.0, 0.0]])
    g = np.array([2 / mu, -(1 + 2 * a_h) / (mu * r2)])
    d0, d1 = np.array([0.0, 1.0]), np.array([1.0, 0.5 - a_h])
    push = np.array([0.0, 1 / speed**2])
    a, b = np.array(a), np.array(b)
    phi0 = 1 - a.sum()

    # start: derivatives of q at τ = 0 with F = slope α + offset of the starting branch
    h = float(spring.initial_memory(alpha))
    slope, offset = tangent_by_difference(spring, h, alpha)
    q = [np.array([0.0, alpha]), np.zeros(2)]
    lag = np.zeros(a.size)
    for k in range(3):
        w = d0 @ q[k] + d1 @ q[k + 1]
        F = slope * q[k][1] + (offset if k == 0 else 0.0)
        load = C @ q[k + 1] + K @ q[k] + g * (phi0 * w + (a * b) @ lag) + push * F
        q.append(-np.linalg.solve(M, load))
        lag = w - b * lag
    Q, L = [], []
    for t in (-dt, 0.0, dt):
        Q.append(q[0] + t * q[1] + t**2 / 2 * q[2])
        rate, acceleration = (q[k] + t * q[k + 1] + t**2 / 2 * q[k + 2] for k in (1, 2))
        L.append(d0 @ rate + d1 @ acceleration)
    older = L[2] - 3 * L[1] + 3 * L[0]
    e = np.exp(-b * dt)
    integral = dt / 24 * (9 * L[2] + 19 * L[1] * e - 5 * L[0] * e**2 + older * e**3)
    w0 = alpha
    memory = [h, float(spring.advance(h, Q[2][1]))]
    pitch, heave = [alpha, Q[2][1]], [0.0, Q[2][0]]
    for n in range(1, steps):
        tau = (n + 1) * dt
        predicted = 2 * Q[-1][1] - Q[-2][1]
        slope, offset = tangent_by_difference(spring, memory[-1], predicted)
        known = e * integral + dt / 24 * (19 * L[-1] * e - 5 * L[-2] * e**2 + L[-3] * e**3)
        v = (-18 * Q[-1] + 9 * Q[-2] - 2 * Q[-3]) / (6 * dt)
        acc = (-5 * Q[-1] + 4 * Q[-2] - Q[-3]) / dt**2
        # w, λ and W are linear in the new q: value at q = 0 and row
        w_row, w_known = d0 + d1 * 11 / (6 * dt), d1 @ v
        l_row, l_known = d0 * 11 / (6 * dt) + d1 * 2 / dt**2, d0 @ v + d1 @ acc
        W_row = w_row - a.sum() * 9 * dt / 24 * l_row
        W_known = w_known - w0 * (a @ np.exp(-b * tau)) - a @ (known + 9 * dt / 24 * l_known)
        P = 2 / dt**2 * M + 11 / (6 * dt) * C + K + np.outer(g, W_row)
        P[:, 1] += slope * push
        new = np.linalg.solve(P, -(M @ acc + C @ v + g * W_known + push * offset))
        L.append(l_row @ new + l_known)
        integral = known + 9 * dt / 24 * L[-1]
        Q.append(new)
        memory.append(float(spring.advance(memory[-1], new[1])))
        pitch.append(new[1])
        heave.append(new[0])
    return np.array(pitch), np.array(heave), np.array(memory)


def tangent_by_difference(spring, memory, pitch):
    """Slope and offset of the moment at `pitch`, the memory moving along with pitch."""
    step = 1e-7 * spring.scale
    moments = [
        float(spring.moment(p, spring.advance(memory, p))) for p in (pitch - step, pitch + step)
    ]
    slope = (moments[1] - moments[0]) / (2 * step)
    if spring.kind != "cubic":
        slope = round(slope)
    moment = float(spring.moment(pitch, spring.advance(memory, pitch)))
    return slope, moment - slope * pitch


def random_case(rng):
    """A section at a speed, a piecewise-linear spring of any kind and a motion at the start."""
    r_alpha = rng.uniform(0.4, 0.65)
    section = TypicalSection(
        mu=float(np.exp(rng.uniform(np.log(20), np.log(250)))),
        a_h=-0.5 if rng.random() < 0.5 else float(rng.uniform(-0.5, -0.1)),
        x_alpha=float(rng.uniform(0.05, 0.6) * r_alpha),
        r_alpha=float(r_alpha),
        omega_bar=float(np.exp(rng.uniform(np.log(0.15), np.log(1.1)))),
        zeta_alpha=float(rng.choice([0.0, rng.uniform(0, 0.03)])),
        zeta_xi=float(rng.choice([0.0, rng.uniform(0, 0.03)])),
    )
    family = SectionFamily(section)
    speed = (flutter_speed(family) or 4.0) * rng.uniform(0.3, 1.02)
    spring = SPRING_KINDS[rng.integers(len(SPRING_KINDS))](rng)
    alpha = float(rng.choice([-1, 1]) * spring.scale * np.exp(rng.uniform(np.log(0.3), np.log(20))))
    rates = 0.1 * alpha * rng.uniform(-1, 1, 3)
    return (
        family.at(speed),
        spring,
        Initial(alpha=alpha, alpha_rate=rates[0], xi=rates[1] * 10, xi_rate=rates[2]),
    )


def _random_table(rng):
    half = np.cumsum(rng.uniform(0.2, 0.6, size=3))
    moments = np.cumsum(np.diff(half, prepend=0.0) * rng.uniform(0.0, 1.6, size=3))
    half, moments = np.append(half, half[-1] + 1.0), np.append(moments, moments[-1] + 1.0)
    pitch = np.concatenate((-half[::-1], half)) + rng.uniform(-0.2, 0.2)
    return Table(tuple(pitch), tuple(np.concatenate((-moments[::-1], moments))))


SPRING_KINDS = (
    lambda rng: Linear(rng.uniform(0.3, 1.5), rng.uniform(-0.1, 0.1)),
    lambda rng: Freeplay(1.0, rng.uniform(-0.3, 0.3)),
    lambda rng: Bilinear(
        rng.uniform(-0.5, 0.5), rng.uniform(-0.1, 0.9), rng.uniform(-0.5, 0.5), rng.uniform(0.3, 1)
    ),
    _random_table,
    lambda rng: Hysteresis(rng.uniform(0.05, 1), rng.uniform(0.05, 1)),
    lambda rng: Hysteresis(*rng.uniform(0.05, 1, 2), *rng.uniform(-0.3, 0.3, 2)),
)


def growth(system, spring, state, memory, duration, legs=50):
    """State at `duration`, size of each state on the way, and growth of a disturbance until then.

    The growth is the largest norm of the variational flow from any of the legs' starts to the end,
    in units of those sizes.
    """
    flow, n = Flow(system, [spring]), system.order
    x = np.array(state, dtype=float)
    march = March(flow, flow.begin(x, memory), tangents=np.eye(n + 1))
    size, jacobians = np.abs(x), []
    for leg in range(1, legs + 1):
        march.motion.tangents[:] = np.eye(n + 1)
        assert march.run(leg * duration / legs) == 0
        x = march.point().x
        jacobians.append(march.motion.tangents.copy())
        size = np.maximum(size, np.abs(x))
    units = np.append(size, max(spring.scale, 1e-300))
    total, most = np.eye(n + 1), 1.0
    for J in reversed(jacobians):
        total = total @ J
        most = max(most, float(np.abs(total[:n] * units / size[:, None]).sum(axis=1).max()))
    return x, size, most
