"""End states of random motions against long integrations by DOP853; maps against single motions.

    python -m benchmarks.verdicts_campaign motions 0:500
    python -m benchmarks.verdicts_campaign maps 0:100

Motions: random sections (Wagner or quasi-steady, damping 0 to 0.002), springs of every kind
(corners at rest, negative slopes, tables through the origin, cubics from a fiftieth of the flutter
speed) and starts. Each is marched anew from its start by `_long_march`, DOP853 at a tolerance of
1e-11 that ends a leg at every switch and shares no code with the engine, for one and a half times
as long as the engine took to decide, but for 100 to 20 000 of its longest periods; it ends before
that where x' has fallen to 1e-10 of what it was (at rest) or y has passed 10 000 times its start.
The time is cut into ten parts, and s1 to s10 are half peak-to-peak of y in each. Where that says
otherwise than the engine (a beat may hide a slow change), the march is made again over the full
20 000 periods, and these decide. A verdict is contradicted

- damped: unless s10 is below 1e-6 of the spring's scale, or below s9, s9 below s7 and s7 below s4:
  it falls on. Where it has fallen by less than a tenth from s1 it is counted as slow, and shown;
- lco: unless s10 is within 1 % of the amplitude, or nearer to it by a tenth than s1;
- aperiodic: if it rests, has left, or s6 to s10 all agree with the one before to 1e-6;
- neutral: if it rests, has left, or s10 differs by more than 5 % from s4 with s7 and s9 in order
  between them;
- divergent: unless y has left, or s10 is above s9, s9 above s7 and s7 above s4.

Neighbours may part for long before a motion settles, and go to different ends: where marches at
tolerances from 1e-12 to 1e-8 do not agree with each other to 1 %, round-off has the choice, and the
motion is marched from where the engine judged it. Such motions are counted as split.

Maps: 50 pitches a column, each cell decided in the column and alone.
"""

from __future__ import annotations

import sys
from collections import Counter
from typing import NamedTuple

import numpy as np

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
from aeroflutter.studies.maps.columns import decide_cells
from benchmarks._long_march import law_of, march

PERIODS = np.array([100.0, 20_000.0])  # of the integration, at least and at most
TOLERANCE = 1e-11
STILL = 1e-10  # rate of change over that at the start, below which a motion is at rest
FAR = 1e4  # times the start or the scale
PARTS = 10
STEPS = 12  # a period, at least
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


def sizes(
    case: Case, time: float, tolerance: float = TOLERANCE, end: Response | None = None
) -> np.ndarray:
    """s₁ to s₁₀; zeros from where the motion rests on, infinities from where it has left.

    From the start of the case, or from where a march of it ended.
    """
    system, spring = case.system, case.spring
    x, h = case.initial.start(system, spring)
    if end is not None:
        x, h = end.final_state, end.final_memory
    y = float(system.c @ x)
    law, far = law_of(spring), FAR * max(spring.scale, abs(y))
    rate = system.A @ x - system.b * float(spring.moment(y, h))
    step = periods(case)[0] / STEPS
    A, b, c = (np.ascontiguousarray(part, dtype=float) for part in (system.A, system.b, system.c))
    still = STILL * float(np.abs(rate).max())
    start = np.array(x, dtype=float)
    found = march(A, b, c, law, start, float(h), time, PARTS, tolerance, step, still, far)
    return 0.5 * (found[:, 1] - found[:, 0])


def periods(case: Case) -> tuple[float, float]:
    """Shortest and longest period of the pieces; of a cubic at 0 and at the start."""
    y = float(case.system.c @ case.initial.vector(case.system))
    law = law_of(case.spring)
    slopes = law.slopes
    if isinstance(case.spring, Cubic):
        slopes = law.slopes[0] + 3.0 * law.slopes[1] * y**2 * np.array([0.0, 1.0])
    elif slopes.size == 0:
        slopes = np.array([0.0, 1.0])
    system = case.system
    roots = np.concatenate(
        [np.linalg.eigvals(system.A - slope * np.outer(system.b, system.c)) for slope in slopes]
    )
    w = np.abs(roots.imag)
    w = w[(w > 1e-3 * w.max()) & (w > np.abs(roots.real))]
    return (2 * np.pi / w.max(), 2 * np.pi / w.min()) if w.size else (50.0, 50.0)


def contradicted(case: Case, end: Response, s: np.ndarray) -> bool:
    """Whether the integration says otherwise; see above."""
    last, grown = s[-1], s[-1] > s[-2] > s[-4] > s[-7]
    if np.any(np.isnan(s)):
        return True
    if end.state == "damped":
        return not (last < 1e-6 * case.spring.scale or last < s[-2] < s[-4] < s[-7])
    if end.state == "lco":
        off = np.abs(s - end.amplitude)
        return not (off[-1] < 0.01 * end.amplitude or off[-1] < 0.9 * off[0])
    if end.state == "aperiodic":
        alike = np.all(np.abs(np.diff(s[PARTS // 2 :])) < 1e-6 * last)
        return bool(alike) or not 0.0 < last < np.inf
    if end.state == "neutral":
        moves = abs(last / s[-7] - 1.0) > 0.05 and (grown or last < s[-2] < s[-4] < s[-7])
        return moves or not 0.0 < last < np.inf
    if end.state == "divergent":
        return not (np.isinf(last) or grown)
    return False


def is_split(case: Case, time: float, s: np.ndarray) -> bool:
    """Whether marches at other tolerances end elsewhere."""
    others = (sizes(case, time, tolerance) for tolerance in (1e-12, 1e-10, 1e-9, 1e-8))
    return not all(np.allclose(s, other, 0.01) for other in others)


def motions(first: int, last: int) -> None:
    """Every verdict of a stretch of motions against its integration."""
    states: Counter[str] = Counter()
    wrong, slow, split = [], [], []
    for seed in range(first, last):
        case = random_case(seed)
        end = simulate(case.system, case.spring, case.initial, MARCH)
        states[end.state] += 1
        if end.state == "undecided":
            print(f"undecided ({end.reason}) {case.words}", flush=True)
            continue
        least, most = PERIODS * periods(case)[1]
        time = float(np.clip(1.5 * end.duration, least, most))
        s = sizes(case, time)
        if contradicted(case, end, s):
            time = float(most)
            s = sizes(case, time)
            if contradicted(case, end, s) and is_split(case, time, s):
                split.append(seed)
                s = sizes(case, time, end=end)
        if end.state == "damped" and s[-1] > max(0.9 * s[0], 1e-6 * case.spring.scale):
            slow.append(seed)
        if contradicted(case, end, s):
            wrong.append(seed)
            print(
                f"CONTRADICTED {end.state} ({end.reason}) amplitude {end.amplitude:.6g} at "
                f"{end.duration:.6g}, sizes {s} over {time:.5g}: {case.words}",
                flush=True,
            )
    print(
        f"motions {first}:{last}: {dict(states)}; contradicted: {wrong}; slow: {slow}; "
        f"split: {split}",
        flush=True,
    )


def maps(first: int, last: int) -> None:
    """Columns of maps, each cell in its column and alone."""
    cells, differ = 0, 0
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
            print(
                f"DIFFERS pitch {pitches[i]:.17g}: {STATES[column.state[i]]} "
                f"{column.amplitude[i]:.6g} in its column, {STATES[alone.state[i]]} "
                f"{alone.amplitude[i]:.6g} alone: {case.words}",
                flush=True,
            )
    print(f"columns {first}:{last}: {cells} cells, {differ} differ; {dict(states)}", flush=True)


if __name__ == "__main__":
    begin, end = map(int, sys.argv[2].split(":"))
    {"motions": motions, "maps": maps}[sys.argv[1]](begin, end)
