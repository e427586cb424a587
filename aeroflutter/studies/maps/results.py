"""Results of a study in memory: what a run without a store keeps."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from aeroflutter.studies.maps.study import AnyArray, Outcome, Region, Study, Task

__all__ = ["MemoryResults", "shape_of"]


def shape_of(study: Study) -> tuple[int, ...]:
    """Shape of the arrays of a study."""
    return tuple(len(values) for values in study.dimensions.values())


class MemoryResults:
    """Arrays in memory, with the interface of a store."""

    def __init__(self, study: Study) -> None:
        shape = shape_of(study)
        self.arrays = {v.name: np.full(shape, v.fill, dtype=v.dtype) for v in study.variables}
        self.cpu_seconds = 0.0
        self.failures: list[dict[str, str]] = []
        blocks = [-(-n // b) for n, b in zip(shape, study.block_shape, strict=True)]
        self._done = {phase: np.zeros(int(np.prod(blocks)), dtype=bool) for phase in study.phases}

    def done(self, phase: str) -> NDArray[np.bool_]:
        """Whether each block of a phase has been written."""
        return self._done[phase].copy()

    def write(self, outcome: Outcome) -> None:
        """Keep the arrays of a block."""
        assert outcome.arrays is not None
        self._keep(outcome.task, outcome.arrays)
        self._done[outcome.task.phase][outcome.task.number] = True
        self.cpu_seconds += outcome.cpu

    def write_failed(self, task: Task, arrays: Mapping[str, AnyArray], what: str, why: str) -> None:
        """Keep that a block failed."""
        self._keep(task, arrays)
        self.failures.append({"block": what, "reason": why})

    def _keep(self, task: Task, arrays: Mapping[str, AnyArray]) -> None:
        for name, values in arrays.items():
            self.arrays[name][task.region] = values

    def read(self, name: str, region: Region | None = None) -> AnyArray:
        """One variable, or a region of it."""
        return self.arrays[name][region or ()].copy()

    def put(self, name: str, values: AnyArray) -> None:
        """Replace a whole variable, one that is derived from the others."""
        self.arrays[name][...] = values
