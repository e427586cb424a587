"""Time marching: the thesis's method in Fortran, compiled Houbolt, the exact engine and SciPy.

All march the same cells of run 14 (hysteresis, limit cycles, so that no engine may stop early) side
by side in one run; medians of alternated rounds of CPU time, and of the ratios within each, for the
clock of a machine drifts; compilation left out. The engines in
Python also set up each cell and say how it ends, which costs them the same however long the march:
they are measured over the 50 000 steps of the thesis and over ten times as many.
"""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from statistics import median
from time import process_time

import numpy as np

from aeroflutter import Hysteresis, SectionFamily, TypicalSection
from aeroflutter.linear.rootlocus import flutter_speed
from aeroflutter.motion.houbolt import march as houbolt_march
from aeroflutter.motion.response import Initial, SimulateOptions, simulate
from benchmarks import Measurement, fortran_baseline

OMEGA_BAR, DELTA_V, DELTA_H = 0.8, 1.0, 0.2
RATIOS, PITCHES = np.linspace(0.935, 0.955, 10), np.linspace(6.0, 8.0, 5)
DT, STEPS = 0.1, 50_000
ROUNDS = 15
SCIPY_TAU = 200.0

FORTRAN, COMPILED = "Houbolt, Fortran", "Houbolt, compiled"
TEN = 10  # times as long
EXACT, LONGER = "exact engine", "exact engine, ten times as long"
COMPILED_LONGER = f"{COMPILED}, ten times as long"
DECIDED, SCIPY = "exact engine until it is certain", "SciPy DOP853 with events"

FAMILY = SectionFamily(TypicalSection(omega_bar=OMEGA_BAR))
SPRING = Hysteresis(np.radians(DELTA_V), np.radians(DELTA_H))


def measure() -> Iterator[Measurement]:
    """CPU time a unit of simulated tau and a step, and each engine's share of the baseline's."""
    reference = flutter_speed(FAMILY)
    assert reference is not None
    systems = [FAMILY.at(ratio * reference) for ratio in RATIOS]
    cells = [(system, Initial(alpha=np.radians(a))) for system in systems for a in PITCHES]
    simulated = len(cells) * STEPS * DT
    with tempfile.TemporaryDirectory() as folder:
        runs: dict[str, tuple[Callable[[], float], float]] = {
            COMPILED: (lambda: _houbolt(cells, STEPS * DT), simulated),
            COMPILED_LONGER: (lambda: _houbolt(cells, TEN * STEPS * DT), TEN * simulated),
            EXACT: (lambda: _exact(cells, STEPS * DT), simulated),
            LONGER: (lambda: _exact(cells, TEN * STEPS * DT), TEN * simulated),
            DECIDED: (lambda: _decided(cells), simulated),
            SCIPY: (lambda: _scipy(cells[0]), SCIPY_TAU),
        }
        fortran = _fortran(Path(folder), reference)
        if fortran is not None:
            runs = {FORTRAN: (fortran, simulated), **runs}
        rounds = _alternated({name: run for name, (run, _) in runs.items()})
    per_tau = {name: np.array(rounds[name]) / tau for name, (_, tau) in runs.items()}
    for name, values in per_tau.items():
        value = median(values)
        yield Measurement(f"{name}, a unit of tau", 1e9 * value, "ns")
        if name in (FORTRAN, COMPILED, COMPILED_LONGER):
            yield Measurement(f"{name}, a step", 1e9 * DT * value, "ns")
    if FORTRAN not in per_tau:
        print("  gfortran is not installed: no baseline to compare with")
    else:
        aims = {COMPILED: 1.5, COMPILED_LONGER: 1.5, EXACT: 0.5, LONGER: 0.5}
        aims |= {DECIDED: None, SCIPY: None}
        for name, aim in aims.items():
            share = median(per_tau[name] / per_tau[FORTRAN])
            yield Measurement(f"{name}, of the Fortran's CPU time", share, "", target=aim)
    yield Measurement(f"{DECIDED}, a cell", 1e6 * median(rounds[DECIDED]) / len(cells), "us")


def _alternated(runs: dict[str, Callable[[], float]]) -> dict[str, list[float]]:
    """CPU seconds of each, taken in turn; the first turn compiles and does not count."""
    taken: dict[str, list[float]] = {name: [] for name in runs}
    for turn in range(ROUNDS + 1):
        for name, run in runs.items():
            seconds = run()
            if turn:
                taken[name].append(seconds)
    return taken


def _fortran(folder: Path, reference: float) -> Callable[[], float] | None:
    """The baseline on the same cells; None without a Fortran compiler."""
    program = fortran_baseline(folder)
    if program is None:
        return None
    grid = (RATIOS.size, PITCHES.size, RATIOS[0], RATIOS[-1], PITCHES[0], PITCHES[-1])
    words = [OMEGA_BAR, reference, DELTA_V, DELTA_H, *grid, DT, STEPS]

    def run() -> float:
        found = subprocess.run(
            [program, *map(str, words)], check=True, capture_output=True, text=True
        ).stdout.split()
        cycles = int(found[-2])
        assert cycles == RATIOS.size * PITCHES.size, "a cell stopped early"
        return float(found[found.index("seconds") + 1])

    return run


def _houbolt(cells: list, duration: float) -> float:
    options = SimulateOptions.thesis(record=False, dt=DT, duration=duration)
    begun = process_time()
    for system, start in cells:
        run = houbolt_march(system, SPRING, *start.start(system, SPRING), options)
        assert run.duration >= duration - DT
    return process_time() - begun


def _exact(cells: list, duration: float) -> float:
    options = SimulateOptions(record=False, decide=False, duration=duration)
    begun = process_time()
    for system, start in cells:
        run = simulate(system, SPRING, start, options)
        assert run.duration == duration
    return process_time() - begun


def _decided(cells: list) -> float:
    """The exact engine may stop when it is certain of the end."""
    options = SimulateOptions(record=False)
    begun = process_time()
    for system, start in cells:
        assert simulate(system, SPRING, start, options).state == "lco"
    return process_time() - begun


def _scipy(cell: tuple) -> float:
    """DOP853 restarted at every switch of the loop, the way it is done by hand."""
    from scipy.integrate import solve_ivp

    system, start = cell
    A, b, c = system.A, system.b, system.c
    x, h = start.start(system, SPRING)
    begun, time = process_time(), 0.0
    while time < SCIPY_TAU:
        y, v = c @ x, c @ (A @ x)
        flat = None
        if v > 0 and h < SPRING.h_high and y >= h + SPRING.v1 - 1e-12:
            flat, events = (
                SPRING.v1,
                [_event(c @ A, 0.0, -1), _event(c, SPRING.h_high + SPRING.v1, 1)],
            )
        elif v < 0 and h > SPRING.h_low and y <= h + SPRING.v2 + 1e-12:
            flat, events = (
                SPRING.v2,
                [_event(c @ A, 0.0, 1), _event(c, SPRING.h_low + SPRING.v2, -1)],
            )
        else:
            events = [_event(c, h + SPRING.v1, 1)] if h < SPRING.h_high else []
            events += [_event(c, h + SPRING.v2, -1)] if h > SPRING.h_low else []
        slope, offset = (1.0, -h) if flat is None else (0.0, flat)
        closed, push = A - slope * np.outer(b, c), b * offset

        def rate(_: float, z: np.ndarray, closed=closed, push=push) -> np.ndarray:
            return closed @ z - push

        # A short leg leaves the switch behind before the next one is looked for.
        options = {"method": "DOP853", "rtol": 1e-9, "atol": 1e-12}
        clear = solve_ivp(rate, (time, time + 1e-7), x, **options)
        leg = solve_ivp(rate, (time + 1e-7, SCIPY_TAU), clear.y[:, -1], events=events, **options)
        time, x = float(leg.t[-1]), leg.y[:, -1]
        h = float(SPRING.advance(h, c @ x))
    return process_time() - begun


def _event(row: np.ndarray, value: float, direction: int) -> Callable[[float, np.ndarray], float]:
    def crossing(_: float, x: np.ndarray) -> float:
        return float(row @ x) - value

    crossing.terminal, crossing.direction = True, direction  # type: ignore[attr-defined]
    return crossing
