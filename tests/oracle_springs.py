"""Motions of linear systems with several nonlinear springs, by Runge and Kutta with events.

Written from the equations alone, with none of the package: x' = A x - B F(C x) + d, each spring

- static, straight between its breaks: F = slope y + offset; or
- a loop of one memory, h <- clip(clip(h, y - v1, y - v2), h_low, h_high), F = y - h.

The law of a loop is followed as the three motions that the two clips allow: it sticks (h is kept),
or slides on the flat F = v1 while y rises (h = y - v1) or on F = v2 while y falls (h = y - v2),
until y turns or the memory meets its stop. In each the system is linear, and SciPy's DOP853
integrates it with its variation; every change is located to round-off and the integrator started
afresh.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import scipy.integrate
import scipy.optimize

RTOL = 1e-13
ROUND = 8 * np.finfo(float).eps
STEP = 0.5  # of the time scale of the system: no guard turns twice between two of the samples
SAMPLES = np.linspace(0.0, 1.0, 9)

STICK, RISE, FALL = 0, 1, 2


class Static(NamedTuple):
    """F = slopes[i] y + offsets[i] between breaks[i - 1] and breaks[i]."""

    breaks: tuple[float, ...]
    slopes: tuple[float, ...]
    offsets: tuple[float, ...]


class Loop(NamedTuple):
    """F = y - h with h <- clip(clip(h, y - v1, y - v2), h_low, h_high)."""

    v1: float
    v2: float
    h_low: float
    h_high: float


class System(NamedTuple):
    """x' = A x - B F(C x) + d."""

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    d: np.ndarray


class Event(NamedTuple):
    """A change of one spring, and how fast its guard fell to zero, over the fastest possible."""

    time: float
    spring: int
    kind: str  # "corner", "slip", "stop" or "reversal"
    speed: float


class Guard(NamedTuple):
    """side (w x' or w x - level) that is positive while the mode lasts; the mode that follows."""

    rate: bool  # whether it is y' that is watched, not y
    side: float
    level: float
    kind: str
    follows: int


@dataclass
class Motion:
    """States at the times asked for, and what lies between them.

    `x` (k, n), `memory` (k, loops), `jacobian` (k, n + loops, n + loops) of the end against the
    start; `growth` is the largest norm that the Jacobian had on the way, at least one. `clearance`
    is the least distance, relative to the size of y, by which a guard turned without being met or
    was overrun: where it is small, one more event or one less is a matter of round-off (states do
    not mind, the Jacobian does).
    """

    x: np.ndarray
    memory: np.ndarray
    jacobian: np.ndarray
    events: list[Event]
    growth: float
    size: float
    clearance: float


@dataclass
class _Run:
    """A motion under way. Z = [x, dx/d(start)]; h and dh likewise, a row a spring."""

    system: System
    springs: tuple[Static | Loop, ...]
    Z: np.ndarray
    h: np.ndarray
    modes: list[int]
    time: float = 0.0
    events: list[Event] = field(default_factory=list)
    growth: float = 1.0
    size: float = 0.0
    clearance: float = np.inf

    def straight(self) -> tuple[np.ndarray, np.ndarray]:
        """M and R of Z' = M Z + R in the present modes."""
        A, B, C, d = self.system
        slopes = np.empty(len(self.springs))
        offsets = np.zeros_like(self.h)
        for i, (spring, mode) in enumerate(zip(self.springs, self.modes, strict=True)):
            if isinstance(spring, Static):
                slopes[i], offsets[i, 0] = spring.slopes[mode], spring.offsets[mode]
            elif mode == STICK:
                slopes[i], offsets[i] = 1.0, -self.h[i]
            else:
                slopes[i], offsets[i, 0] = 0.0, spring.v1 if mode == RISE else spring.v2
        R = -B @ offsets
        R[:, 0] += d
        return A - (B * slopes) @ C, R

    def memory(self, Z: np.ndarray) -> np.ndarray:
        """h and its derivatives at a state of the present modes."""
        h = self.h.copy()
        for i, (spring, mode) in enumerate(zip(self.springs, self.modes, strict=True)):
            if isinstance(spring, Loop) and mode != STICK:
                h[i] = self.system.C[i] @ Z
                h[i, 0] -= spring.v1 if mode == RISE else spring.v2
        return h

    def guards(self, i: int) -> list[Guard]:
        """What ends the present mode of spring i."""
        spring, mode = self.springs[i], self.modes[i]
        if isinstance(spring, Static):
            found = []
            if mode > 0:
                found.append(Guard(False, 1.0, spring.breaks[mode - 1], "corner", mode - 1))
            if mode < len(spring.breaks):
                found.append(Guard(False, -1.0, spring.breaks[mode], "corner", mode + 1))
            return found
        if mode == RISE:
            stop = Guard(False, -1.0, spring.h_high + spring.v1, "stop", STICK)
            return [stop, Guard(True, 1.0, 0.0, "reversal", STICK)]
        if mode == FALL:
            stop = Guard(False, 1.0, spring.h_low + spring.v2, "stop", STICK)
            return [stop, Guard(True, -1.0, 0.0, "reversal", STICK)]
        h, found = self.h[i, 0], []
        if h < spring.h_high:
            found.append(Guard(False, -1.0, h + spring.v1, "slip", RISE))
        if h > spring.h_low:
            found.append(Guard(False, 1.0, h + spring.v2, "slip", FALL))
        return found

    def switch(self, i: int, guard: Guard) -> None:
        """Into the mode that follows, the memory carried over."""
        spring, mode = self.springs[i], self.modes[i]
        if isinstance(spring, Loop) and mode != STICK:
            self.h = self.memory(self.Z)
            if guard.kind == "stop":  # at the stop whatever the start was
                self.h[i] = 0.0
                self.h[i, 0] = spring.h_high if mode == RISE else spring.h_low
        self.modes[i] = guard.follows

    def record(self, i: int, guard: Guard, speed: float) -> None:
        self.events.append(Event(self.time, i, guard.kind, speed))


def integrate(system, springs, x, memory, times, most=20_000) -> Motion:
    """Follow a motion from t = 0 to ascending `times`; `memory` has a number a loop, in order."""
    run = _begin(system, tuple(springs), np.asarray(x, float), np.asarray(memory, float))
    kept = [_look(run)]
    for time in times:
        while run.time < time:
            _settle(run)
            _stretch(run, time - run.time)
            assert len(run.events) < most, "the motion switches without end"
        run.time = time
        kept.append(_look(run))
    states, memories, jacobians = zip(*kept[1:], strict=True)
    return Motion(
        np.array(states),
        np.array(memories),
        np.array(jacobians),
        run.events,
        run.growth,
        run.size,
        run.clearance,
    )


def _begin(system: System, springs, x, memory) -> _Run:
    loops = [i for i, spring in enumerate(springs) if isinstance(spring, Loop)]
    assert len(loops) == len(memory)
    n, y = x.size, system.C @ x
    Z = np.zeros((n, 1 + n + len(loops)))
    Z[:, 0], Z[:, 1 : 1 + n] = x, np.eye(n)
    h, modes = np.zeros((len(springs), Z.shape[1])), []
    for i, spring in enumerate(springs):
        if isinstance(spring, Static):
            modes.append(int(np.searchsorted(spring.breaks, y[i])))
            continue
        given = memory[loops.index(i)]
        slid = np.clip(given, y[i] - spring.v1, y[i] - spring.v2)
        h[i, 0] = np.clip(slid, spring.h_low, spring.h_high)
        if h[i, 0] == given:
            h[i, 1 + n + loops.index(i)] = 1.0
        elif h[i, 0] == slid:  # the clip lets y through
            h[i, 1 : 1 + n] = system.C[i]
        modes.append(STICK)
    return _Run(system, springs, Z, h, modes)


def _look(run: _Run) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """State, memories and Jacobian now."""
    loops = [i for i, spring in enumerate(run.springs) if isinstance(spring, Loop)]
    h = run.memory(run.Z)[loops]
    jacobian = np.concatenate((run.Z, h))[:, 1:]
    run.growth = max(run.growth, float(np.linalg.norm(jacobian, 2)))
    return run.Z[:, 0].copy(), h[:, 0].copy(), jacobian


def _values(run: _Run, i: int, guard: Guard, M, R, Z):
    """A guard, its first and its second derivative at a state Z, or at several."""
    rate = ((M @ Z[:, 0]).T + R[:, 0]).T
    second = M @ rate
    c = guard.side * run.system.C[i]
    if guard.rate:
        return c @ rate, c @ second, c @ (M @ second)
    return c @ Z[:, 0] - guard.side * guard.level, c @ rate, c @ second


def _sizes(run: _Run, i: int, guard: Guard, M, Z) -> tuple[float, float]:
    """What round-off in a guard and in its derivative is relative to: y, and y a time scale."""
    size = np.abs(run.system.C[i]) @ np.abs(Z[:, 0]) + abs(guard.level)
    rate = float(np.linalg.norm(M, 2))
    return (rate * size, rate**2 * size) if guard.rate else (size, rate * size)


def _settle(run: _Run) -> None:
    """Switch every spring that stands at the end of its mode and is about to leave it."""
    for _ in range(8 * len(run.springs)):
        leaving = _leaving(run)
        if leaving is None:
            return
        speed = _speed(run, *leaving, *run.straight(), run.Z)
        run.switch(*leaving)
        run.record(*leaving, speed)
    raise AssertionError("modes without end at one moment")


def _leaving(run: _Run) -> tuple[int, Guard] | None:
    M, R = run.straight()
    for i in range(len(run.springs)):
        for guard in run.guards(i):
            value, first, second = _values(run, i, guard, M, R, run.Z)
            room, slow = (ROUND * size for size in _sizes(run, i, guard, M, run.Z))
            if value <= room and (first < -slow or (abs(first) <= slow and second < 0)):
                return i, guard
    return None


def _stretch(run: _Run, left: float) -> None:
    """Integrate until the first event or the time left; switch there."""
    M, R = run.straight()
    shape, width = run.Z.shape, 1 / max(np.linalg.norm(M, 2), 1e-3 / left)

    def rhs(_t, flat):
        return (M @ flat.reshape(shape) + R).ravel()

    scale = np.abs(run.Z).max(axis=0) + np.abs(R).max(axis=0) * width
    atol = np.broadcast_to(RTOL * (scale + 1e-30), shape).ravel()
    solver = scipy.integrate.DOP853(
        rhs, 0.0, run.Z.ravel(), left, rtol=RTOL, atol=atol, max_step=STEP * width
    )
    while solver.status == "running":
        Z_before, before = run.Z, solver.t
        message = solver.step()
        assert solver.status != "failed", message
        met = _earliest(run, M, R, solver.dense_output(), before, solver.t)
        if met is not None:
            i, guard, near = met
            taken, run.Z, speed = _located(run, i, guard, M, R, Z_before, near - before)
            run.time += before + taken
            _measure(run)
            run.switch(i, guard)
            run.record(i, guard, speed)
            return
        run.Z = solver.y.reshape(shape)
        _measure(run)
    run.time += left


def _measure(run: _Run) -> None:
    run.size = max(run.size, float(np.abs(run.Z[:, 0]).max()))
    run.growth = max(run.growth, float(np.linalg.norm(run.Z[:, 1:], 2)))


def _earliest(run: _Run, M, R, dense, start: float, end: float):
    """Spring, guard and time of the first guard met on a step, or None."""
    best = None
    times = start + SAMPLES * (end - start)
    Z = dense(times).reshape(*run.Z.shape, times.size)
    for i in range(len(run.springs)):
        for guard in run.guards(i):
            value, slope = _values(run, i, guard, M, R, Z)[:2]
            if np.all(value[1:] >= 0) and not np.any((slope[:-1] < 0) & (slope[1:] > 0)):
                continue
            time = _met(run, i, guard, M, R, dense, times)
            if time is not None and (best is None or time < best[2]):
                best = (i, guard, time)
    return best


def _met(run: _Run, i: int, guard: Guard, M, R, dense, times) -> float | None:
    """When a guard first falls below zero; `settle` has seen to it that it starts above."""
    shape = run.Z.shape

    def value(t):
        return _values(run, i, guard, M, R, dense(t).reshape(shape))[0]

    def slope(t):
        return _values(run, i, guard, M, R, dense(t).reshape(shape))[1]

    size = _sizes(run, i, guard, M, run.Z)[0]
    room = ROUND * size
    g = np.array([value(t) for t in times])
    for a, b, ga, gb in zip(times[:-1], times[1:], g[:-1], g[1:], strict=True):
        edge = 0.0 if ga > room else -room  # about to leave its edge: round-off is no way back
        falls, rises = slope(a) < 0, slope(b) > 0
        if falls and rises:  # a least value in between
            low = scipy.optimize.brentq(slope, a, b, xtol=1e-15, rtol=ROUND)
            if ga > room:
                run.clearance = min(run.clearance, abs(value(low)) / size)
            if ga > 0 and value(low) < edge:
                return scipy.optimize.brentq(value, a, low, xtol=1e-15, rtol=ROUND)
        if gb < edge:
            if ga <= 0:  # from zero up and down again
                a = scipy.optimize.brentq(slope, a, b, xtol=1e-15, rtol=ROUND) if not falls else a
                if value(a) <= 0:
                    return a
            return scipy.optimize.brentq(value, a, b, xtol=1e-15, rtol=ROUND)
    return None


def _located(run: _Run, i: int, guard: Guard, M, R, Z, near: float):
    """Time, state and relative speed at an event: Newton's method on steps, not on interpolants."""
    shape = Z.shape
    taken = 0.0
    for step in (near, None, None, None):
        if step is None:
            value, first, _ = _values(run, i, guard, M, R, Z)
            step = -value / first if first < 0 else 0.0
            if abs(step) > 1e-3 * near + 1e-9:
                break  # nearly tangent: the interpolant's word is as good
        Z = _one_step(M, R, Z, step).reshape(shape)
        taken += step
    return taken, Z, _speed(run, i, guard, M, R, Z)


def _speed(run: _Run, i: int, guard: Guard, M, R, Z) -> float:
    """How fast a guard falls, over the fastest possible; negative where it grazes."""
    _, first, _ = _values(run, i, guard, M, R, Z)
    norm, size = np.linalg.norm(M, 2), max(run.size, float(np.abs(Z[:, 0]).max()))
    return -first / (norm ** (2 if guard.rate else 1) * size * np.linalg.norm(run.system.C[i]))


def _one_step(M, R, Z, h: float) -> np.ndarray:
    """One step of DOP853 over h, shorter than one whose error was accepted."""
    stages, tableau = [], scipy.integrate.DOP853
    for row in tableau.A:
        at = Z + h * sum((c * K for c, K in zip(row, stages, strict=False)), np.zeros_like(Z))
        stages.append(M @ at + R)
    return Z + h * sum(c * K for c, K in zip(tableau.B, stages, strict=True))


class Case(NamedTuple):
    """A motion to compare: what it is, its system and springs, its start, when to look."""

    name: str
    system: System
    springs: tuple[Static | Loop, ...]
    x: np.ndarray
    memory: np.ndarray
    times: np.ndarray


KINDS = ("hysteresis", "freeplay", "table", "bilinear")


def cases(count: int, seed: int = 14) -> list[Case]:
    """Random motions of two springs: every pairing of kinds, sections and other systems, ties."""
    makers = (_section_case, _section_case, _section_case, _any_case, _twin_case, _tie_case)
    found = []
    for number in range(count):
        rng = np.random.default_rng((seed, number))
        pair = (number // len(makers) + 5 * (number % len(makers))) % 16
        kinds = KINDS[pair // 4], KINDS[pair % 4]
        found.append(makers[number % len(makers)](rng, kinds, number))
    return found


def loops_case(seed: int) -> Case:
    """A section with two loops that starts inside both, where a small change is a small change."""
    rng = np.random.default_rng((77, seed))
    speed = rng.uniform(3, 5.5)
    system = section(rng, speed)
    springs = [spring(rng, "hysteresis") for _ in range(2)]
    memory = np.array([s.h_low + rng.uniform(0.3, 0.7) * (s.h_high - s.h_low) for s in springs])
    y = memory + np.array([s.v2 + rng.uniform(0.3, 0.7) * (s.v1 - s.v2) for s in springs])
    x = np.concatenate((y, 0.5 * rng.normal(size=2), [0, 0]))
    return Case(f"loops {seed}", system, tuple(springs), x, memory, np.array([40 * speed]))


def section(rng: np.random.Generator, speed: float) -> System:
    """A random section with springs in heave and in pitch (states ξ, α, ξ', α', z₁, z₂).

    ξ'' + x α'' + 2 ζ (ω/U) ξ' + (ω/U)² F₁(ξ) = -C_L/(π μ) and likewise in pitch, with Wagner's
    function as two lags.
    """
    mu, a_h, x = rng.uniform(30, 200), rng.uniform(-0.6, -0.2), rng.uniform(0.05, 0.35)
    r2, ratio = rng.uniform(0.45, 0.6) ** 2, rng.uniform(0.15, 1.3) / speed
    zeta = rng.uniform(0, 0.03, 2)
    a, b = np.array([0.165, 0.335]), np.array([0.0455, 0.3])
    # Each row: coefficients of (ξ, α, ξ', α', z₁, z₂), and of (ξ'', α'').
    w = np.array([0, 1, 1, 0.5 - a_h, 0, 0])
    W = (1 - a.sum()) * w + np.array([0, 0, 0, 0, *(a * b)])
    pitch_rate = np.array([0, 0, 0, 1.0, 0, 0])
    lift, lift_mass = np.pi * pitch_rate + 2 * np.pi * W, np.pi * np.array([1, -a_h])
    moment = np.pi * (0.5 + a_h) * W - np.pi / 2 * (0.5 - a_h) * pitch_rate
    moment_mass = np.pi / 2 * np.array([a_h, -(a_h**2) - 1 / 8])
    mass = np.array([[1, x], [x / r2, 1]])
    mass += np.array([lift_mass / (np.pi * mu), -2 * moment_mass / (np.pi * mu * r2)])
    damping = np.zeros((2, 6))
    damping[0, 2], damping[1, 3] = 2 * zeta[0] * ratio, 2 * zeta[1] / speed
    forces = -damping + np.array([-lift / (np.pi * mu), 2 * moment / (np.pi * mu * r2)])
    A = np.zeros((6, 6))
    A[0, 2] = A[1, 3] = 1.0
    A[2:4] = np.linalg.solve(mass, forces)
    A[4:], A[4, 4], A[5, 5] = w, -b[0], -b[1]
    B, d = np.zeros((6, 2)), np.zeros(6)
    B[2:4] = np.linalg.solve(mass, np.diag([ratio**2, 1 / speed**2]))
    angle = rng.uniform(-0.3, 0.3) * rng.integers(2)  # a steady incidence, every second time
    d[2:4] = np.linalg.solve(mass, [-2 * angle / mu, (1 + 2 * a_h) * angle / (mu * r2)])
    return System(A, B, np.eye(2, 6), d)


def spring(rng: np.random.Generator, kind: str) -> Static | Loop:
    """A spring of about unit size, with offsets every second time."""
    shift, load = rng.uniform(-0.4, 0.4, 2) * rng.integers(2)
    half = rng.uniform(0.1, 0.6)
    if kind == "hysteresis":
        friction = rng.uniform(0.05, 0.5)
        return Loop(load + friction, load - friction, shift - half, shift + half)
    if kind == "freeplay":
        low, high = shift - half, shift + half
        return Static((low, high), (1.0, 0.0, 1.0), (-low, 0.0, -high))
    if kind == "bilinear":
        return continuous((shift - half, shift + half), (1.0, rng.uniform(-0.3, 0.7), 1.0), load)
    breaks = np.sort(rng.uniform(-1.2, 1.2, rng.integers(1, 6)))
    return continuous(tuple(breaks), tuple(rng.uniform(0, 2, breaks.size + 1)), load)


def continuous(breaks, slopes, first_offset: float) -> Static:
    """The continuous law with these slopes."""
    steps = -np.diff(slopes) * np.asarray(breaks)
    offsets = first_offset + np.concatenate(([0.0], np.cumsum(steps)))
    return Static(tuple(map(float, breaks)), tuple(map(float, slopes)), tuple(map(float, offsets)))


def _case(name, rng, system, springs, kinds, duration, x=None) -> Case:
    x = rng.normal(size=len(system.A)) if x is None else x
    loops = [one for one in springs if isinstance(one, Loop)]
    memory = np.array([rng.uniform(one.h_low, one.h_high) for one in loops])
    name = f"{name}: {kinds[0]} and {kinds[1]}"
    return Case(name, system, tuple(springs), x, memory, duration * np.array([0.31, 0.72, 1.0]))


def _section_case(rng, kinds, number) -> Case:
    speed = rng.uniform(1.5, 5.0)
    system = section(rng, speed)
    springs = [spring(rng, kind) for kind in kinds]
    x = rng.normal(size=6) * np.array([1, 1, 0.2, 0.2, 0, 0])
    return _case(f"section {number}", rng, system, springs, kinds, 30 * speed, x)


def _any_case(rng, kinds, number) -> Case:
    """A system of 3 to 10 states, its output fed through by way of a state or at once."""
    n = int(rng.integers(3, 11))
    A = rng.normal(size=(n, n)) / np.sqrt(n)
    B, C = rng.normal(size=(n, 2)) * 0.5, rng.normal(size=(2, n)) / np.sqrt(n) * 2
    grows = [
        np.linalg.eigvals(A - (B * np.array(slopes)) @ C).real.max()
        for slopes in itertools.product((0.0, 1.0, 2.0), repeat=2)
    ]
    A -= (max(grows) - rng.uniform(-0.1, 0.3)) * np.eye(n)
    springs = [spring(rng, kind) for kind in kinds]
    system = System(A, B, C, rng.normal(size=n) * 0.2)
    return _case(f"system {number}", rng, system, springs, kinds, 25.0)


def _twin_case(rng, kinds, number) -> Case:
    """Two equal halves, coupled alike and started alike: both springs always switch at once."""
    kinds = (kinds[0], kinds[0])
    k, c = rng.uniform(0.1, 0.8, 2)
    own = np.array([[0, 1], [-k, rng.uniform(-0.1, 0.15)]])
    other = np.array([[0, 0], [c - 0.3, 0.05 * c]])
    A = np.block([[own, other], [other, own]])
    B, C = np.zeros((4, 2)), np.zeros((2, 4))
    B[1, 0] = B[3, 1] = 1.0
    C[0, 0] = C[1, 2] = 1.0
    one = spring(rng, kinds[0])
    d = np.tile([0.0, rng.uniform(-0.2, 0.2)], 2)
    x = np.tile(rng.normal(size=2), 2)
    case = _case(f"twins {number}", rng, System(A, B, C, d), (one, one), kinds, 40.0, x)
    return case._replace(memory=np.full(case.memory.shape, case.memory[:1]))


def _tie_case(rng, kinds, number) -> Case:
    """A loop meets a stop, or slips, where the other spring meets a corner or its own stop."""
    speed = rng.uniform(1.5, 5.0)
    system = section(rng, speed)
    springs = [Loop(0.3, -0.2, -0.25, 0.3), spring(rng, kinds[1])]
    first = STICK if number % 4 < 2 else RISE
    y1 = 0.3 + (0.1 if first == STICK else springs[0].h_high)
    other = springs[1]
    if isinstance(other, Loop):
        mode, y2 = RISE, other.h_high + other.v1
    else:
        mode, y2 = 0, other.breaks[0]
    x = np.concatenate(([y1, y2], rng.uniform(0.1, 0.4, 2), 0.1 * rng.normal(size=2)))
    Z = np.zeros((6, 1))
    Z[:, 0] = x
    run = _Run(system, tuple(springs), Z, np.array([[0.1], [0.0]]), [first, mode])
    M, R = run.straight()
    back = 0.4  # into the past, where neither has switched
    before = scipy.integrate.solve_ivp(
        lambda t, z: -(M @ z + R[:, 0]), (0, back), x, method="DOP853", rtol=RTOL, atol=1e-14
    ).y[:, -1]
    y = system.C @ before
    memory = [0.1 if first == STICK else y[0] - springs[0].v1]
    if isinstance(other, Loop):
        memory.append(y[1] - other.v1)
    case = _case(f"tie {number}", rng, system, springs, ("hysteresis", kinds[1]), 40.0, before)
    return case._replace(memory=np.array(memory))
