"""End states of random motions against long integrations by SciPy, and maps against single motions.

    python -m benchmarks.verdicts_campaign motions 0:500
    python -m benchmarks.verdicts_campaign maps 0:100

Motions: random sections (Wagner or quasi-steady, damping 0 to 0.002), springs of every kind
(corners at rest, negative slopes, tables through the origin, cubics from a fiftieth of the flutter
speed) and starts. Each is integrated by DOP853 at a tolerance of 1e-10, restarted at every switch
located on its dense output, with none of the engine's code (`tests.marching.event_march`), for one
and a half times as long as the engine took to decide, but for 60 to 200 of its longest periods. Its
size, half peak-to-peak of 64 samples over 1.3 of the longest periods, is taken after a half, three
quarters and the whole of that time: s1, s2, s3. A verdict is contradicted

- damped: unless s3 is nothing (1e-6 of the spring's scale) or below s1 (a fall by less than 5 %, or
  a rise by less, is no contradiction, and counted as slow);
- lco: unless s3 is within 5 % of the amplitude, or has come nearer to it by a third since s1;
- aperiodic: unless s3 is between a third and three times the amplitude;
- neutral: unless s3 is between a third and three times s1; divergent: unless s3 has grown.

Maps: 50 pitches a column, each cell decided in the column and alone. Where the two differ, the cell
is decided again from pitches a few units of the last place away: a long chaotic transient may end
on one attractor or another by round-off alone, and then no engine can say which.
"""

from __future__ import annotations

import sys
from collections import Counter
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from aeroflutter import (
    Bilinear,
    Cubic,
    Freeplay,
    Hysteresis,
    SectionFamily,
    Spring,
    Table,
    TypicalSection,
)
from aeroflutter.linear.rootlocus import flutter_speed
from aeroflutter.model.aerodynamics import QuasiSteady, Wagner
from aeroflutter.model.lure import LureSystem
from aeroflutter.motion.endstates import EndOptions, end_states
from aeroflutter.motion.flow import Flow
from aeroflutter.motion.response import STATES, Initial, Response, SimulateOptions, simulate
from aeroflutter.motion.settling import closed_slopes, period_range
from aeroflutter.studies.maps.columns import decide_cells
from tests.marching import event_march

PERIODS = 60.0, 200.0  # of the integration, at least and at most
TOLERANCE = 1e-10
STILL = 1e-9  # rate of change over that at the start, below which a motion is at rest
MARCH = SimulateOptions(record=False, duration=1e7)


class Case(NamedTuple):
    """A random motion."""

    system: LureSystem
    spring: Spring
    initial: Initial
    words: str


def table_through_origin(rng: np.random.Generator) -> Table:
    """A measured table that holds (0, 0), a corner there; sometimes one slope is negative."""
    steps = rng.uniform(0.3, 1.0, 4)
    pitch = np.array([-steps[0] - steps[1], -steps[1], 0.0, steps[2], steps[2] + steps[3]])
    slopes = rng.uniform(0.3, 1.5, 4)
    if rng.random() < 0.3:
        slopes[rng.integers(4)] = rng.uniform(-0.6, 0.0)
    left = -np.cumsum((slopes[1::-1]) * steps[1::-1])[::-1]
    right = np.cumsum(slopes[2:] * steps[2:])
    return Table(tuple(pitch), (*left, 0.0, *right))


SPRINGS = (
    table_through_origin,
    lambda rng: Bilinear(0.0, rng.uniform(-0.5, 0.9), rng.uniform(-0.3, 0.3), rng.uniform(0.3, 1)),
    lambda rng: Bilinear(*rng.uniform([-0.5, -1.0, -0.5, 0.3], [0.5, 0.9, 0.5, 1.0])),
    lambda rng: Freeplay(1.0, rng.uniform(-0.3, 0.3)),
    lambda rng: Hysteresis(rng.uniform(0.05, 1), rng.uniform(0.05, 1)),
    lambda rng: Hysteresis(*rng.uniform(0.05, 1, 2), *rng.uniform(-0.3, 0.3, 2)),
    lambda rng: Cubic(1.0, rng.choice([3.0, 80.0, -0.5])),
)


def random_family(rng: np.random.Generator) -> SectionFamily:
    """A section of any kind."""
    r_alpha = rng.uniform(0.4, 0.65)
    damping = rng.choice([0.0, 1.0], 2) * rng.uniform(0.0, 0.002, 2)
    section = TypicalSection(
        mu=float(np.exp(rng.uniform(np.log(20), np.log(250)))),
        a_h=-0.5 if rng.random() < 0.5 else float(rng.uniform(-0.5, 0.2)),
        x_alpha=float(rng.uniform(0.05, 0.6) * r_alpha),
        r_alpha=float(r_alpha),
        omega_bar=float(np.exp(rng.uniform(np.log(0.15), np.log(1.1)))),
        zeta_alpha=float(damping[0]),
        zeta_xi=float(damping[1]),
    )
    return SectionFamily(section, QuasiSteady() if rng.random() < 0.33 else Wagner())


def random_case(seed: int) -> Case:
    """Motion number `seed`."""
    rng = np.random.default_rng([2024, seed])
    family, flutter = random_family(rng), None
    while (flutter := flutter_speed(family)) is None:
        family = random_family(rng)
    spring = SPRINGS[rng.integers(len(SPRINGS))](rng)
    ratio = rng.uniform(0.02 if spring.kind == "cubic" else 0.1, 1.02)
    size = spring.scale * np.exp(rng.uniform(np.log(0.1), np.log(10)))
    alpha = float(rng.choice([-1, 1]) * size)
    rates = 0.1 * alpha * rng.uniform(-1, 1, 3)
    start = Initial(alpha=alpha, alpha_rate=rates[0], xi=rates[1] * 10, xi_rate=rates[2])
    words = (
        f"{seed}: {family.section} {family.aerodynamics} {spring} ratio {ratio:.4f} from {start}"
    )
    return Case(family.at(ratio * flutter), spring, start, words)


def sizes(case: Case, time: float) -> np.ndarray:
    """s₁, s₂, s₃ of the motion; infinite once it has left for good."""
    system, spring = case.system, case.spring
    x, h = case.initial.start(system, spring)
    longest = periods(case)[1]
    window, still = 1.3 * longest, STILL * np.abs(rate(case, x, h)).max()
    found, now, far = [], 0.0, 1e4 * max(spring.scale, abs(float(system.c @ x)))
    for part in (0.5, 0.75, 1.0):
        while now < part * time:
            step = min(longest, part * time - now)
            x, h = onward(system, spring, x, h, step)
            now += step
            if np.abs(rate(case, x, h)).max() < still:
                return np.append(found, np.zeros(3 - len(found)))
        y = [float(system.c @ x)]
        for _ in range(63):
            x, h = onward(system, spring, x, h, window / 63)
            y.append(float(system.c @ x))
        now = part * time + window
        if not np.all(np.abs(y) < far):
            return np.full(3, np.inf)
        found.append(0.5 * np.ptp(y))
    return np.array(found)


def rate(case: Case, x: Any, h: float) -> Any:
    """x'."""
    y = case.system.c @ x
    return case.system.A @ x - case.system.b * float(case.spring.moment(y, h))


def onward(system: LureSystem, spring: Spring, x: Any, h: float, time: float) -> tuple[Any, float]:
    """State and memory a time later."""
    if time <= 0.0:
        return x, h
    if isinstance(spring, Cubic):

        def rate(_: float, z: Any) -> Any:
            y = system.c @ z
            return system.A @ z - system.b * (spring.beta1 * y + spring.beta3 * y**3)

        far = lambda _, z: abs(system.c @ z) - 1e6  # noqa: E731
        far.terminal = True
        size = np.abs(x).max()
        end = solve_ivp(
            rate, (0, time), x, "DOP853", rtol=TOLERANCE, atol=TOLERANCE * size, events=far
        )
        return end.y[:, -1], h
    return event_march(system, spring, x, h, time, rtol=TOLERANCE)


def periods(case: Case) -> tuple[float, float]:
    """Shortest and longest period of the linear pieces."""
    start = float(case.system.c @ case.initial.vector(case.system))
    shortest, longest = period_range(case.system, closed_slopes(case.spring, start))
    return (shortest, longest) if np.isfinite(longest) else (50.0, 50.0)


def contradicted(case: Case, end: Response, s: np.ndarray) -> bool:
    """Whether the integration says otherwise."""
    scale = case.spring.scale
    if end.state == "damped":
        return not (s[2] < 1e-6 * scale or s[2] < 1.05 * s[0])
    if end.state == "lco":
        off = np.abs(s - end.amplitude)
        return not (off[2] < 0.05 * end.amplitude or off[2] < 0.67 * off[0])
    if end.state == "aperiodic":
        return not 0.33 * end.amplitude < s[2] < 3.0 * end.amplitude
    if end.state == "neutral":
        return not 1 / 3 < s[2] / s[0] < 3.0
    if end.state == "divergent":
        return not s[2] > s[0] and bool(np.isfinite(s[2]))
    return False


def motions(first: int, last: int) -> None:
    """Every verdict of a stretch of motions against its integration."""
    states: Counter[str] = Counter()
    wrong, slow = [], []
    for seed in range(first, last):
        case = random_case(seed)
        end = simulate(case.system, case.spring, case.initial, MARCH)
        states[end.state] += 1
        if end.state == "undecided":
            print(f"undecided ({end.reason}) {case.words}", flush=True)
            continue
        longest = periods(case)[1]
        time = float(np.clip(1.5 * end.duration, PERIODS[0] * longest, PERIODS[1] * longest))
        s = sizes(case, time)
        if end.state == "damped" and s[2] > max(0.95 * s[0], 1e-6 * case.spring.scale):
            slow.append(seed)
        if contradicted(case, end, s):
            wrong.append(seed)
            print(
                f"CONTRADICTED {end.state} ({end.reason}) amplitude {end.amplitude:.6g} at "
                f"{end.duration:.6g}, sizes {s} over {time:.5g}: {case.words}",
                flush=True,
            )
    print(
        f"motions {first}:{last}: {dict(states)}; contradicted: {wrong}; slow: {slow}", flush=True
    )


def maps(first: int, last: int) -> None:
    """Columns of maps, each cell in its column and alone."""
    cells, differ, fickle = 0, 0, 0
    states: Counter[str] = Counter()
    for seed in range(first, last):
        rng = np.random.default_rng([7, seed])
        case = random_case(100_000 + seed)
        while isinstance(case.spring, Cubic):
            case = random_case(int(rng.integers(10**6, 10**7)))
        pitches = (
            np.linspace(-1, 1, 50) * case.spring.scale * np.exp(rng.uniform(np.log(1), np.log(10)))
        )
        starts = [Initial(alpha=float(pitch)).start(case.system, case.spring) for pitch in pitches]
        x, h = np.array([one for one, _ in starts]), np.array([one for _, one in starts])
        flow, options = Flow(case.system, [case.spring]), EndOptions(duration=1e7)
        column = decide_cells(flow, x, h, options)
        alone = end_states(Flow(case.system, [case.spring]), x, h, options)
        same = column.state == alone.state
        cycles = same & (alone.state == STATES.index("lco"))
        same[cycles] = np.isclose(column.amplitude[cycles], alone.amplitude[cycles], rtol=1e-6)
        cells, differ = cells + same.size, differ + int(np.sum(~same))
        states.update(STATES[code] for code in alone.state)
        for i in np.flatnonzero(~same):
            if by_round_off(case, flow, float(pitches[i]), options):
                fickle += 1
                continue
            print(
                f"DIFFERS pitch {pitches[i]:.17g}: {STATES[column.state[i]]} "
                f"{column.amplitude[i]:.6g} in its column, {STATES[alone.state[i]]} "
                f"{alone.amplitude[i]:.6g} alone: {case.words}",
                flush=True,
            )
    print(
        f"columns {first}:{last}: {cells} cells, {differ} differ, "
        f"{fickle} of them by round-off; {dict(states)}",
        flush=True,
    )


def by_round_off(case: Case, flow: Flow, pitch: float, options: EndOptions) -> bool:
    """Whether pitches that differ by a few units of the last place end in different ways."""
    near = pitch * (1.0 + 4e-16 * np.arange(-4, 5))
    starts = [Initial(alpha=float(one)).start(case.system, case.spring) for one in near]
    x, h = np.array([one for one, _ in starts]), np.array([one for _, one in starts])
    return len(set(end_states(flow, x, h, options).state.tolist())) > 1


if __name__ == "__main__":
    begin, end = map(int, sys.argv[2].split(":"))
    {"motions": motions, "maps": maps}[sys.argv[1]](begin, end)
