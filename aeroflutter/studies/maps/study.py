"""Studies: many independent computations, in blocks that are done, stored and resumed one by one.

A flutter map is one study, a Monte-Carlo sweep another. Whoever runs a study (threads, processes,
a cluster) and wherever its results go (memory, a store on disk) know no more of it than this.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

__all__ = ["Executor", "Outcome", "Results", "Study", "Task", "Variable", "Work", "carry_out"]

AnyArray = NDArray[Any]
Region = tuple[slice, ...]


@dataclass(frozen=True)
class Variable:
    """One result a cell: its name, its type, and what stands where it was not computed."""

    name: str
    dtype: str
    fill: float
    phase: str = "cells"


@dataclass(frozen=True, eq=False)
class Task:
    """One block of one phase: all that a worker needs besides the study itself.

    Attributes
    ----------
    phase, number
        Which phase, and which block of it.
    region
        The cells, as slices of the arrays of the study.
    given
        Results of earlier phases that this one needs.
    """

    phase: str
    number: int
    region: Region
    given: Mapping[str, AnyArray] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Outcome:
    """What became of a task: its arrays by name, or the reason why there are none.

    `cpu` is the CPU time that the computation took, in seconds.
    """

    task: Task
    arrays: Mapping[str, AnyArray] | None
    cpu: float = 0.0
    failure: str | None = None


class Work(Protocol):
    """What an executor needs to know. Obligations:

    1. Instances can be pickled and depend on nothing outside themselves.
    2. ``compute(task)`` depends on the task alone, not on what was computed before, elsewhere or
       at the same time.
    3. ``warm_up()`` compiles what ``compute`` calls, so that its time is not counted.
    """

    def compute(self, task: Task) -> dict[str, AnyArray]: ...

    def warm_up(self) -> None: ...


class Study(Work, Protocol):
    """Work whose results are kept. Obligations besides:

    1. ``compute(task)`` returns one array a variable of the phase, of the shape of the region.
    2. ``tasks(phase, results)`` lists the blocks of a phase; those of the second phase may read
       the results of the first.
    3. ``identity()`` holds, in JSON's types, whatever the results depend on.
    4. ``describe(task)`` says in one line what the block was, for messages.
    """

    @property
    def kind(self) -> str: ...

    @property
    def dimensions(self) -> Mapping[str, AnyArray]: ...

    @property
    def block_shape(self) -> tuple[int, ...]: ...

    @property
    def variables(self) -> Sequence[Variable]: ...

    @property
    def phases(self) -> Sequence[str]: ...

    def identity(self) -> dict[str, Any]: ...

    def tasks(self, phase: str, results: Results) -> list[Task]: ...

    def failed(self, task: Task) -> dict[str, AnyArray]: ...

    def describe(self, task: Task) -> str: ...


class Results(Protocol):
    """Where results go. ``write`` commits a block whole or not at all."""

    def done(self, phase: str) -> NDArray[np.bool_]: ...

    def write(self, outcome: Outcome) -> None: ...

    def write_failed(
        self, task: Task, arrays: Mapping[str, AnyArray], what: str, why: str
    ) -> None: ...

    def read(self, name: str, region: Region | None = None) -> AnyArray: ...

    @property
    def cpu_seconds(self) -> float: ...

    @property
    def failures(self) -> list[dict[str, str]]: ...


class Executor(Protocol):
    """Whoever computes. The order of outcomes is free; every task gets exactly one."""

    @property
    def workers(self) -> int: ...

    def run(self, study: Work, tasks: Sequence[Task]) -> Iterator[Outcome]: ...


def carry_out(study: Work, task: Task) -> Outcome:
    """Compute one task; an exception fails its block and no other."""
    begin = time.thread_time()
    try:
        arrays = study.compute(task)
    except Exception as error:  # noqa: BLE001 - whatever it was, the other blocks go on
        return Outcome(task, None, time.thread_time() - begin, f"{type(error).__name__}: {error}")
    return Outcome(task, arrays, time.thread_time() - begin)
