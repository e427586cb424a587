"""Flutter maps: how the motion ends in every cell of a grid (figures 5.5a to 5.31a)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from aeroflutter.analysis import Result
from aeroflutter.errors import InputError
from aeroflutter.kernels import expect
from aeroflutter.motion.response import SimulateOptions
from aeroflutter.studies.maps.attractors import label
from aeroflutter.studies.maps.cells import Cells, axis_identity
from aeroflutter.studies.maps.engines import FAILED, MARCH, Ends, decide_all, march_identity
from aeroflutter.studies.maps.executors import Threads
from aeroflutter.studies.maps.fingerprint import code_hash
from aeroflutter.studies.maps.grid import Grid
from aeroflutter.studies.maps.refine import bisect
from aeroflutter.studies.maps.results import MemoryResults
from aeroflutter.studies.maps.runner import Progress, run
from aeroflutter.studies.maps.study import AnyArray, Executor, Results, Task, Variable
from aeroflutter.verdicts import STATES

__all__ = ["FlutterMap", "MapOptions", "MapStudy", "collect", "flutter_map"]

Array = NDArray[np.float64]

LARGE = 1500  # cells from which all kernels are compiled before the first
SAME_CYCLE = {"exact": 1e-6, "houbolt": 0.02}  # how well two cells find the same cycle


@dataclass(frozen=True, kw_only=True)
class MapOptions:
    """How cells are decided.

    Parameters
    ----------
    march : SimulateOptions
        Engine, criteria and limits of every cell.
    refine : float, optional
        Refine the boundaries between regions to this width, in units of either axis.

    Raises
    ------
    InputError
        If the width is not positive.
    """

    march: SimulateOptions = MARCH
    refine: float | None = None

    def __post_init__(self) -> None:
        if self.refine is not None and not (np.isfinite(self.refine) and self.refine > 0):
            raise InputError(f"refine: {self.refine!r} is not a positive width")

    def identity(self) -> dict[str, Any]:
        """The options in JSON's types."""
        return {**march_identity(self.march), "refine": self.refine}


CELLS = (
    Variable("state", "i1", FAILED),
    Variable("amplitude_deg", "f8", np.nan),
    Variable("bias_deg", "f8", np.nan),
    Variable("period", "f8", np.nan),
    Variable("rest_deg", "f8", np.nan),
    Variable("decided_at", "f8", np.nan),
)
EDGES = (
    Variable("boundary_x", "f8", np.nan, "edges"),
    Variable("boundary_y", "f8", np.nan, "edges"),
)
LABELS = (Variable("attractor", "i4", 0, "labels"),)


@dataclass(frozen=True, eq=False)
class MapStudy:
    """A flutter map as a study, see `study.Study`.

    Parameters
    ----------
    cells : Cells
        What stands in the cells.
    options : MapOptions
    about : mapping
        What else belongs to the identity of the map: the case, in JSON's types.
    """

    cells: Cells
    options: MapOptions = field(default_factory=MapOptions)
    about: Mapping[str, Any] = field(default_factory=dict)
    kind: str = "map"

    @property
    def grid(self) -> Grid:
        """The grid of the map."""
        return self.cells.grid

    @property
    def dimensions(self) -> dict[str, AnyArray]:
        """Coordinates of either axis."""
        x, y = self.grid.x, self.grid.y
        return {x.name: x.values, y.name: y.values}

    @property
    def block_shape(self) -> tuple[int, int]:
        """Shape of a block."""
        return self.grid.block_shape

    @property
    def phases(self) -> tuple[str, ...]:
        """First the cells, then the boundaries between them if they are asked for."""
        return ("cells",) if self.options.refine is None else ("cells", "edges")

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Results a cell."""
        return CELLS + (() if self.options.refine is None else EDGES) + LABELS

    def identity(self) -> dict[str, Any]:
        """Whatever the results depend on, in JSON's types."""
        from aeroflutter import __version__

        return {
            "kind": self.kind,
            **self.about,
            "axes": axis_identity(self.grid),
            "cells": self.cells.identity(),
            "options": self.options.identity(),
            "aeroflutter": __version__,
            "code_sha256": code_hash(__name__, type(self.cells).__module__),
        }

    def tasks(self, phase: str, results: Results) -> list[Task]:
        """One task a block; those of the boundaries carry the states of their cells."""
        blocks = self.grid.blocks()
        if phase == "cells":
            return [Task(phase, block.number, (block.x, block.y)) for block in blocks]
        state = results.read("state")
        return [
            Task(phase, block.number, (block.x, block.y), {"state": _with_next(state, block)})
            for block in blocks
        ]

    def compute(self, task: Task) -> dict[str, AnyArray]:
        """Results of one block."""
        return self._ends(task) if task.phase == "cells" else self._edges(task)

    def failed(self, task: Task) -> dict[str, AnyArray]:
        """What stands in the cells of a block that could not be computed."""
        shape = tuple(part.stop - part.start for part in task.region)
        return {
            v.name: np.full(shape, v.fill, dtype=v.dtype)
            for v in self.variables
            if v.phase == task.phase
        }

    def describe(self, task: Task) -> str:
        """The block by its number and the ranges of its axes."""
        ranges = [
            f"{axis.key} {axis.values[part][0]:.6g} to {axis.values[part][-1]:.6g}"
            for axis, part in zip((self.grid.x, self.grid.y), task.region, strict=True)
        ]
        return f"block {task.number} of {task.phase}: {', '.join(ranges)}"

    def warm_up(self) -> None:
        """Decide one cell, which loads or compiles the engine."""
        if self.grid.cells > LARGE:
            expect("a large map")
        self.states(self.grid.x.values[:1], self.grid.y.values[:1])

    def states(self, x: Array, y: Array) -> NDArray[np.int8]:
        """States of the points (x, y), (m,) each."""
        return self.ends(x, y).state

    def ends(self, x: Array, y: Array) -> Ends:
        """How the points (x, y) end, (m,) each."""
        whole: tuple[AnyArray, ...] = Ends(
            np.empty(x.size, dtype=np.int8), *(np.empty(x.size) for _ in range(5))
        )
        for group, ends in decide_all(self.cells.groups(x, y), self.options.march):
            for target, part in zip(whole, ends, strict=True):
                target[group.index] = part
        return Ends(*whole)

    def _ends(self, task: Task) -> dict[str, AnyArray]:
        x, y = _points(self.grid, task)
        ends = self.ends(x, y)
        shape = tuple(part.stop - part.start for part in task.region)
        found = {
            "state": ends.state,
            "amplitude_deg": np.degrees(ends.amplitude),
            "bias_deg": np.degrees(ends.bias),
            "period": ends.period,
            "rest_deg": np.degrees(ends.rest),
            "decided_at": ends.time,
        }
        return {name: values.reshape(shape) for name, values in found.items()}

    def _edges(self, task: Task) -> dict[str, AnyArray]:
        """Boundaries between each cell and the next along x, and along y; NaN for none."""
        state = task.given["state"]
        xs, ys = (
            axis.values[part.start : part.stop + 1]
            for axis, part in zip((self.grid.x, self.grid.y), task.region, strict=True)
        )
        found = self.failed(task)
        nx, ny = found["boundary_x"].shape
        here, right, up = state[:nx, :ny], state[1:, :ny], state[:nx, 1:]
        i, j = np.nonzero(here[: len(right)] != right)
        found["boundary_x"][i, j] = self._refined(0, ys[j], xs[i], xs[i + 1], here[i, j])
        i, j = np.nonzero(here[:, : up.shape[1]] != up)
        found["boundary_y"][i, j] = self._refined(1, xs[i], ys[j], ys[j + 1], here[i, j])
        return found

    def _refined(
        self, along: int, fixed: Array, low: Array, high: Array, of_low: NDArray[np.int8]
    ) -> Array:
        assert self.options.refine is not None

        def decided(at: Array, other: Array) -> NDArray[np.int8]:
            return self.states(at, other) if along == 0 else self.states(other, at)

        return bisect(decided, fixed, low, high, of_low, self.options.refine)


def _points(grid: Grid, task: Task) -> tuple[Array, Array]:
    x, y = (axis.values[part] for axis, part in zip((grid.x, grid.y), task.region, strict=True))
    return np.repeat(x, y.size), np.tile(y, x.size)


def _with_next(state: NDArray[np.int8], block: Any) -> NDArray[np.int8]:
    """States of a block with the next column and the next row, where there are any."""
    return state[block.x.start : block.x.stop + 1, block.y.start : block.y.stop + 1].copy()


@dataclass(frozen=True, kw_only=True, eq=False)
class FlutterMap(Result):
    """A finished map. Arrays are (nx, ny); angles are degrees here, as in files.

    Attributes
    ----------
    grid : Grid
    state
        Places in `STATES`; `FAILED` where a block could not be computed.
    amplitude_deg, bias_deg, period
        Of the motion in which the cell ends, as in `motion.response.Response`.
    rest_deg
        Pitch at which a damped motion comes to rest.
    decided_at
        Time τ after which the end was certain.
    attractor
        Cells of one attractor share a number, see `attractors.label`.
    boundary_x, boundary_y
        Refined boundary between a cell and the next along either axis; None if not asked for.
    cpu_seconds
        CPU time of all blocks.
    failures
        Blocks that could not be computed, and why.
    """

    grid: Grid
    state: NDArray[np.int8]
    amplitude_deg: Array
    bias_deg: Array
    period: Array
    rest_deg: Array
    decided_at: Array
    attractor: NDArray[np.int32]
    boundary_x: Array | None = None
    boundary_y: Array | None = None
    cpu_seconds: float = 0.0
    failures: Sequence[Mapping[str, str]] = ()

    def count(self, state: str) -> int:
        """Number of cells that end so; "failed" counts those that were not computed."""
        code = FAILED if state == "failed" else STATES.index(state)
        return int(np.count_nonzero(self.state == code))


def collect(study: MapStudy, results: Any) -> FlutterMap:
    """The map from its results, its attractors numbered and entered there."""
    found = {v.name: results.read(v.name) for v in study.variables if v.phase != "labels"}
    attractor = label(
        found["state"],
        found["amplitude_deg"],
        found["bias_deg"],
        found["period"],
        study.cells.shared,
        SAME_CYCLE.get(study.options.march.engine, SAME_CYCLE["exact"]),
    )
    results.put("attractor", attractor)
    return FlutterMap(
        grid=study.grid,
        attractor=attractor,
        cpu_seconds=results.cpu_seconds,
        failures=results.failures,
        **found,
    )


def flutter_map(
    cells: Cells,
    options: MapOptions | None = None,
    *,
    executor: Executor | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> FlutterMap:
    """Decide every cell of a map, in memory.

    Parameters
    ----------
    cells : Cells
        What stands in the cells: `SpeedPitch`, say.
    options : MapOptions, optional
    executor : Executor, optional
        Who computes; one thread of this process by default.
    progress : callable, optional
        Called after every block.

    Examples
    --------
    >>> import numpy as np
    >>> from aeroflutter import Hysteresis, SectionFamily, TypicalSection
    >>> from aeroflutter.studies.maps import Axis, Grid, SpeedPitch
    >>> grid = Grid(Axis("speed", np.array([3.4, 3.9])),
    ...             Axis("initial.alpha_deg", np.array([3.0, 6.0])))
    >>> spring = Hysteresis(np.radians(1.0), np.radians(0.2))
    >>> cells = SpeedPitch(SectionFamily(TypicalSection(omega_bar=0.8)), spring, grid)
    >>> flutter_map(cells).state.tolist()
    [[0, 0], [0, 1]]
    """
    study = MapStudy(cells, options or MapOptions())
    results = MemoryResults(study)
    study.warm_up()
    run(study, results, executor or Threads(), progress)
    return collect(study, results)
