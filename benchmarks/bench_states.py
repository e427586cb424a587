"""What the analyses of cycles cost as the states grow: a flap of 8, 20, 40 and 60 states.

Eight states are the wing with a flap of Conner et al. (`benchmarks._flap`), fed by hand, with a
freeplay of one degree either way; the larger models add structural modes. The machine code is
warmed up on a section of six states.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from aeroflutter import Freeplay, Hysteresis, SectionFamily, TypicalSection
from aeroflutter.linear.rootlocus import flutter_point
from aeroflutter.motion.flow import Flow
from aeroflutter.motion.march import March
from aeroflutter.orbits.cycles import CycleOptions, cycles_at, limit_cycles
from aeroflutter.orbits.describing import describing_curve
from aeroflutter.orbits.harmonic import HarmonicOptions, harmonic_balance
from benchmarks import Measurement, cpu_seconds
from benchmarks._flap import Flap

SWITCHES = 400
SPEED = 12.0  # m/s, half the flutter speed: nine cycles and their periods doubled
PUBLISHED = 23.947, 6.103  # m/s and Hz, these equations elsewhere
GAP = Freeplay(np.radians(2.0))
LOOP = Hysteresis(np.radians(1.0), np.radians(2.0))


def measure() -> Iterator[Measurement]:
    """CPU seconds of curves, branches and cycles at a speed."""
    flutter = flutter_point(Flap())
    assert flutter is not None
    found = flutter.speed, flutter.k / (2 * np.pi)
    if not np.allclose(found, PUBLISHED, atol=6e-4):
        raise AssertionError(f"flutter at {found}: not the model that is to be measured")
    limit_cycles(SectionFamily(TypicalSection(omega_bar=0.8)), GAP, CycleOptions(simulations=1))
    for states, aim in ((8, None), (40, 1.5)):
        for what, spring in (("freeplay", GAP), ("hysteresis", LOOP)):
            seconds = cpu_seconds(partial(describing_curve, flap(states), spring), 3)
            yield Measurement(f"describing_curve, {what}, {states} states", seconds, "s", aim)
    for states in (6, 20, 60, 100):
        steps, switch = _switch(states)
        yield Measurement(f"steps a switch, {states} states", steps, "")
        yield Measurement(f"a switch with its steps, {states} states", 1e6 * switch, "us")
    settings = HarmonicOptions(harmonics=25)
    for states in (8, 40):
        seconds = one(partial(harmonic_balance, flap(states), LOOP, settings))
        yield Measurement(f"harmonic_balance, 25 harmonics, {states} states", seconds, "s", None)
    yield Measurement("limit_cycles, 8 states", one(partial(limit_cycles, Flap(), GAP)), "s", 20.0)
    for states, aim in ((8, None), (20, 3.0), (60, 20.0)):
        seconds = one(partial(cycles_at, flap(states), GAP, SPEED))
        yield Measurement(f"cycles_at half the flutter speed, {states} states", seconds, "s", aim)


def _switch(states: int) -> tuple[float, float]:
    """Steps and CPU seconds a switch, on the way into a limit cycle; tables made beforehand."""
    section = SectionFamily(TypicalSection(omega_bar=0.2))
    family, speed = (section, 4.5) if states == 6 else (flap(states), SPEED)
    flow = Flow(family.at(speed), [GAP])
    start = flow.start(3.0 * GAP.gap * flow.C[0])
    march = March(flow, start, events=SWITCHES)
    seconds = one(lambda: march.run(np.inf))
    steps, _, _ = March(flow, start).through(march.time, flow.C[:1])
    return steps.size / SWITCHES, seconds / SWITCHES


def flap(states: int) -> Flap:
    """The flap with as many further modes as make up the states."""
    return Flap((states - 8) // 2)


def one(call: Callable[[], object]) -> float:
    return cpu_seconds(call, 1)
