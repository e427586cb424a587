"""Executors on this machine: threads of this process, and processes that may die."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.connection import wait as wait_for
from multiprocessing.process import BaseProcess
from typing import Any

from aeroflutter.errors import AeroflutterError
from aeroflutter.studies.maps.study import Outcome, Task, Work, carry_out

__all__ = ["MOST_DEATHS", "Processes", "Threads", "cores"]

MOST_DEATHS = 3  # workers that one block may kill


def cores() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@dataclass(frozen=True)
class Threads:
    """Threads of this process; the compiled engines release the interpreter's lock."""

    workers: int = 1

    def run(self, study: Work, tasks: Sequence[Task]) -> Iterator[Outcome]:
        """Outcomes as they come."""
        waiting = deque(tasks)
        running: set[Future[Outcome]] = set()
        pool = ThreadPoolExecutor(self.workers)
        try:
            while waiting or running:
                while waiting and len(running) < self.workers + 1:
                    running.add(pool.submit(carry_out, study, waiting.popleft()))
                finished, running = wait(running, return_when=FIRST_COMPLETED)
                yield from (future.result() for future in finished)
        finally:
            pool.shutdown(cancel_futures=True)


@dataclass
class _Worker:
    """A process and the block that it has at hand."""

    process: BaseProcess
    pipe: Connection
    ready: bool = False
    task: Task | None = None


@dataclass(frozen=True)
class Processes:
    """Processes, started afresh (spawn). One that dies costs its block, which is tried again.

    A block at which `MOST_DEATHS` workers died is given up.

    Raises
    ------
    AeroflutterError
        If workers die before they have begun to work.
    """

    workers: int

    def run(self, study: Work, tasks: Sequence[Task]) -> Iterator[Outcome]:
        """Outcomes as they come."""
        return _Pool(self.workers, study, tasks).outcomes()


class _Pool:
    def __init__(self, workers: int, study: Work, tasks: Sequence[Task]) -> None:
        self.size, self.study = workers, study
        self.waiting = deque(tasks)
        self.deaths: dict[int, int] = {}
        self.stillborn = 0
        self.workers: list[_Worker] = []

    def outcomes(self) -> Iterator[Outcome]:
        try:
            while self.waiting or any(worker.task for worker in self.workers):
                self._man()
                yield from self._listen()
        finally:
            self._dismiss()

    def _man(self) -> None:
        """As many workers as there is work for."""
        busy = sum(worker.task is not None for worker in self.workers)
        while len(self.workers) < min(self.size, busy + len(self.waiting)):
            self.workers.append(_start(self.study))
        for worker in self.workers:
            if worker.ready and worker.task is None and self.waiting:
                worker.task = self.waiting.popleft()
                with contextlib.suppress(OSError):  # it has died, and will be found so
                    worker.pipe.send(worker.task)

    def _listen(self) -> Iterator[Outcome]:
        """Whatever has come in, waiting for something if nothing has."""
        sources: list[Any] = [worker.pipe for worker in self.workers]
        heard = wait_for(sources + [worker.process.sentinel for worker in self.workers])
        for worker in list(self.workers):
            if worker.pipe in heard or worker.process.sentinel in heard:
                outcome = self._hear(worker)
                if outcome is not None:
                    yield outcome

    def _hear(self, worker: _Worker) -> Outcome | None:
        """One message of a worker, or its death."""
        try:
            if not worker.pipe.poll():
                return None if worker.process.is_alive() else self._bury(worker)
            message = worker.pipe.recv()
        except (EOFError, OSError):
            return self._bury(worker)
        if message is None:
            worker.ready, self.stillborn = True, 0
            return None
        task, worker.task = worker.task, None
        assert task is not None
        arrays, cpu, failure = message
        return Outcome(task, arrays, cpu, failure)

    def _bury(self, worker: _Worker) -> Outcome | None:
        """Put the block of a dead worker back, or give it up."""
        worker.process.join()
        worker.pipe.close()
        self.workers.remove(worker)
        task = worker.task
        if task is None:
            self.stillborn += not worker.ready
            if self.stillborn > MOST_DEATHS:
                raise AeroflutterError(
                    f"workers die as they start (exit code {worker.process.exitcode}); "
                    "--workers 0 computes in this process"
                )
            return None
        self.deaths[task.number] = self.deaths.get(task.number, 0) + 1
        if self.deaths[task.number] < MOST_DEATHS:
            self.waiting.append(task)
            return None
        code = worker.process.exitcode
        return Outcome(task, None, 0.0, f"{MOST_DEATHS} workers died at it, the last with {code}")

    def _dismiss(self) -> None:
        for worker in self.workers:
            worker.process.kill()
        for worker in self.workers:
            worker.process.join()
            worker.pipe.close()


def _start(study: Work) -> _Worker:
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(target=_work, args=(there, study), daemon=True)
    process.start()
    there.close()  # so that the end of either process is the end of the pipe
    return _Worker(process, here)


def _work(pipe: Connection, study: Work) -> None:
    """A worker: computes what comes through the pipe until there is no one at its other end."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to answer
    try:
        study.warm_up()
        pipe.send(None)
        while True:
            outcome = carry_out(study, pipe.recv())
            pipe.send((outcome.arrays, outcome.cpu, outcome.failure))
    except (EOFError, BrokenPipeError, ConnectionResetError):
        return
