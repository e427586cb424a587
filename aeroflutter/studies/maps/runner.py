"""Run a study: block by block, whoever computes and wherever the results go."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from aeroflutter.studies.maps.study import Executor, Outcome, Results, Study, Task

__all__ = ["Progress", "run"]


@dataclass(frozen=True)
class Progress:
    """How far a phase is: cells done by this run, done before it, and in all."""

    phase: str
    done: int
    before: int
    total: int


def run(
    study: Study,
    results: Results,
    executor: Executor,
    progress: Callable[[Progress], None] | None = None,
) -> None:
    """Compute what `results` does not hold yet.

    Parameters
    ----------
    study
        What to compute.
    results
        Where it goes; blocks already there are not computed again.
    executor
        Who computes.
    progress
        Called after every block.
    """
    for phase in study.phases:
        done = results.done(phase)
        tasks = study.tasks(phase, results)
        waiting = [task for task in tasks if not done[task.number]]
        total = sum(map(_cells, tasks))
        before = total - sum(map(_cells, waiting))
        finished = 0
        report = progress or (lambda state: None)
        report(Progress(phase, 0, before, total))
        for outcome in executor.run(study, waiting) if waiting else ():
            _enter(study, results, outcome)
            finished += _cells(outcome.task)
            report(Progress(phase, finished, before, total))


def _enter(study: Study, results: Results, outcome: Outcome) -> None:
    task = outcome.task
    if outcome.arrays is None:
        blank = study.failed(task)
        results.write_failed(task, blank, study.describe(task), outcome.failure or "no reason")
    else:
        results.write(outcome)


def _cells(task: Task) -> int:
    return int(np.prod([part.stop - part.start for part in task.region]))
