"""Flutter maps: the exact engine against the thesis's method in Fortran, cell by cell.

Both decide the same cells in turn, in one run; the best CPU time of a few rounds counts, with
compilation left out. Where they differ away from a boundary, a long integration of high accuracy
(SciPy, restarted at every switch) says who is right.
"""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeroflutter import Hysteresis, SectionFamily, TypicalSection
from aeroflutter.linear.rootlocus import flutter_speed
from aeroflutter.motion.response import STATES, Initial
from aeroflutter.studies.maps import Axis, FlutterMap, Grid, MapStudy, SpeedPitch, flutter_map
from benchmarks import Measurement, fortran_baseline
from tests.marching import event_march

COLUMNS, ROWS = 40, 25
PITCHES = (1.0, 15.0)
DT, STEPS = 0.1, 50_000
ROUNDS = 5
LONG = {True: 3_000.0, False: 15_000.0}  # τ of the long integration: where damped, and else
WATCHED, SAMPLES = 80.0, 41  # τ at its end in which its size is taken
DAMPED, LCO, DIVERGENT = (STATES.index(name) for name in ("damped", "lco", "divergent"))
OF_FORTRAN = np.array([-1, DAMPED, LCO, DIVERGENT])
SIZE = 0.02  # relative difference of amplitudes up to which the baseline agrees


class Run(NamedTuple):
    """A run of the thesis, the speeds of its map, and the least gain in CPU time wanted of it."""

    name: str
    omega_bar: float
    delta_v: float
    delta_h: float
    ratios: tuple[float, float]
    gain: float


RUNS = (
    Run("run 14", 0.8, 1.0, 0.2, (0.85, 0.999), 10.0),
    Run("run 102", 0.2, 0.4, 1.0, (0.45, 0.999), 4.0),
)


class Baseline(NamedTuple):
    """What the Fortran program found: states and amplitudes in degrees, (nx, ny), CPU seconds."""

    state: NDArray[np.int8]
    amplitude: NDArray[np.float64]
    seconds: float


def measure() -> Iterator[Measurement]:
    """CPU time a cell of both, their agreement, and undecided cells, for two runs."""
    with tempfile.TemporaryDirectory() as folder:
        program = fortran_baseline(Path(folder))
        for run in RUNS:
            yield from _compared(run, program)


def _compared(run: Run, program: Path | None) -> Iterator[Measurement]:
    cells = cells_of(run)
    MapStudy(cells).warm_up()
    found, seconds, baseline = None, np.inf, None
    for _ in range(ROUNDS):
        found = flutter_map(cells)
        seconds = min(seconds, found.cpu_seconds)
        if program is not None:
            again = fortran_map(program, run, cells)
            least = again.seconds if baseline is None else min(again.seconds, baseline.seconds)
            baseline = again._replace(seconds=least)
    assert found is not None
    yield Measurement(f"{run.name}: exact engine, a cell", 1e6 * seconds / cells.grid.cells, "us")
    yield Measurement(f"{run.name}: undecided", found.count("undecided"), "cells", target=0)
    if baseline is None:
        print("  gfortran is not installed: no baseline to compare with")
        return
    yield Measurement(
        f"{run.name}: Fortran, a cell", 1e6 * baseline.seconds / found.grid.cells, "us"
    )
    share = seconds / baseline.seconds
    yield Measurement(f"{run.name}: exact over Fortran", share, "", target=1.0 / run.gain)
    yield from _agreement(run, cells, found, baseline)


def cells_of(run: Run) -> SpeedPitch:
    """The cells of a run."""
    family = SectionFamily(TypicalSection(omega_bar=run.omega_bar))
    grid = Grid(
        Axis("speed_ratio", np.linspace(*run.ratios, COLUMNS)),
        Axis("initial.alpha_deg", np.linspace(*PITCHES, ROWS)),
    )
    spring = Hysteresis(np.radians(run.delta_v), np.radians(run.delta_h))
    flutter = flutter_speed(family)
    assert flutter is not None
    return SpeedPitch(family, spring, grid, flutter)


def fortran_map(program: Path, run: Run, cells: SpeedPitch) -> Baseline:
    """The same cells by the baseline."""
    words = [run.omega_bar, cells.reference, run.delta_v, run.delta_h, COLUMNS, ROWS]
    words += [*run.ratios, *PITCHES, DT, STEPS, "list"]
    done = subprocess.run([program, *map(str, words)], check=True, capture_output=True, text=True)
    *lines, summary = done.stdout.splitlines()
    table = np.array([line.split() for line in lines], dtype=float).reshape(COLUMNS, ROWS, 4)
    state = OF_FORTRAN[table[..., 2].astype(int)].astype(np.int8)
    return Baseline(state, table[..., 3], float(summary.split()[3]))


def _agreement(
    run: Run, cells: SpeedPitch, found: FlutterMap, baseline: Baseline
) -> Iterator[Measurement]:
    """Cells in which the states differ, and which of the two a long integration confirms."""
    differ = found.state != baseline.state
    yield Measurement(f"{run.name}: states differ", int(differ.sum()), "cells")
    inner = differ & ~beside_boundary(found.state)
    yield Measurement(f"{run.name}: of these away from boundaries", int(inner.sum()), "cells")
    wrong = 0
    for i, j in zip(*np.nonzero(differ), strict=True):
        speed, pitch = found.grid.x.values[i], found.grid.y.values[j]
        ours, theirs = STATES[found.state[i, j]], STATES[baseline.state[i, j]]
        longest = LONG[bool(found.state[i, j] == DAMPED)]
        size = long_amplitude(cells, speed, pitch, longest)
        sides = _confirms(run, found, (i, j), size)
        wrong += not sides
        print(
            f"    {speed:.5f}, {pitch:.3f} deg: exact {ours} {found.amplitude_deg[i, j]:.4f}, "
            f"Fortran {theirs} {baseline.amplitude[i, j]:.4f}, "
            f"tau = {longest:g} later {size:.4f} deg"
        )
    yield Measurement(
        f"{run.name}: a long integration sides with Fortran", wrong, "cells", target=0
    )
    both = (found.state == LCO) & (baseline.state == LCO)
    off = np.abs(baseline.amplitude[both] / found.amplitude_deg[both] - 1.0)
    yield Measurement(f"{run.name}: median difference of amplitude", float(np.median(off)), "")
    yield Measurement(
        f"{run.name}: amplitudes differ by over 2 %", int((off > SIZE).sum()), "cells"
    )


def beside_boundary(state: NDArray[np.int8]) -> NDArray[np.bool_]:
    """Cells with a neighbour, diagonal ones included, that ends otherwise."""
    padded = np.pad(state, 1, mode="edge")
    nx, ny = state.shape
    around = [padded[i : i + nx, j : j + ny] != state for i in range(3) for j in range(3)]
    return np.logical_or.reduce(around)


def long_amplitude(cells: SpeedPitch, ratio: float, pitch: float, longest: float) -> float:
    """Half peak-to-peak pitch in degrees at the end of a long accurate integration."""
    system = cells.family.at(ratio * cells.reference)
    x, h = Initial(alpha=np.radians(pitch)).start(system, cells.spring)
    x, h = event_march(system, cells.spring, x, h, longest, rtol=1e-11)
    pitches = [system.c @ x]
    for _ in range(SAMPLES - 1):
        x, h = event_march(system, cells.spring, x, h, WATCHED / (SAMPLES - 1), rtol=1e-11)
        pitches.append(system.c @ x)
    return float(np.degrees(np.ptp(pitches) / 2))


def _confirms(run: Run, found: FlutterMap, cell: tuple[int, int], size: float) -> bool:
    """Whether the end of the long integration is what the exact engine says.

    A damped motion stays on one branch of the spring, where it is less than half the height of
    the loop in size; a cycle has its amplitude, up to what the samples miss.
    """
    if found.state[cell] == DAMPED:
        return size < 0.5 * run.delta_v
    return found.state[cell] == LCO and abs(size / found.amplitude_deg[cell] - 1.0) < 0.05
