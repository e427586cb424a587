"""Maps computed by the command line and killed on the way: what tests and benchmarks share."""

from __future__ import annotations

import contextlib
import json
import os
import random
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import zarr

PATIENCE = 300.0  # seconds until something is taken to hang
LOOK = 0.002


def command(case: str, out: Path, *options: str) -> list[str]:
    return [sys.executable, "-m", "aeroflutter", "map", case, "--out", str(out), "--json", *options]


def start(words: Sequence[str], file_limit: int | None = None) -> subprocess.Popen[str]:
    def limited() -> None:
        if file_limit is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (file_limit, file_limit))

    return subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=limited
    )


def finish(words: Sequence[str], code: int = 0, file_limit: int | None = None) -> str:
    """Run to the end; what it says on stdout, or on stderr where it is to fail."""
    process = start(words, file_limit)
    out, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == code, err
    return err if code else out


def arrays(store: Path) -> dict[str, bytes]:
    """Whatever a store holds of its cells, bit for bit."""
    group = zarr.open_group(store, mode="r")
    return {name: np.asarray(array[...]).tobytes() for name, array in group.arrays()}


def committed(store: Path) -> int:
    """Blocks that a store holds, from its files alone."""
    return sum(1 for _ in (store / "blocks" / "cells" / "c").glob("*/0"))


def children(process: subprocess.Popen[str]) -> list[int]:
    """Processes started by a process, worker processes among them."""
    found = []
    for task in Path(f"/proc/{process.pid}/task").iterdir():
        with contextlib.suppress(OSError):  # threads come and go
            found += [int(pid) for pid in (task / "children").read_text().split()]
    return found


def workers(process: subprocess.Popen[str]) -> list[int]:
    """Spawned workers, multiprocessing's resource tracker left out."""
    found = []
    for pid in children(process):
        with contextlib.suppress(OSError):
            if b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes():
                found.append(pid)
    return found


def wait_for_blocks(process: subprocess.Popen[str], store: Path, blocks: int) -> bool:
    """Wait until a run has committed so many blocks; False if it ended before."""
    deadline = time.monotonic() + PATIENCE
    while process.poll() is None:
        if committed(store) >= blocks:
            return True
        assert time.monotonic() < deadline, "the run hangs"
        time.sleep(LOOK)
    return False


def alive(pid: int) -> bool:
    with contextlib.suppress(OSError):
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    return False


def kill_parent(words: Sequence[str], store: Path, blocks: int, chance: random.Random) -> bool:
    """SIGKILL a run at a random moment after some blocks; False if it was done before.

    Workers must not outlive it: that they do is an assertion.
    """
    process = start(words)
    running = wait_for_blocks(process, store, blocks)
    orphans = workers(process) if running else []
    time.sleep(chance.uniform(0.0, 0.05))
    with contextlib.suppress(ProcessLookupError):
        process.send_signal(signal.SIGKILL)
    process.communicate()
    deadline = time.monotonic() + PATIENCE
    while any(alive(pid) for pid in orphans):
        assert time.monotonic() < deadline, "workers outlive their parent"
        time.sleep(0.05)
    return process.returncode == -signal.SIGKILL


def kill_workers(words: Sequence[str], store: Path, kills: int, chance: random.Random) -> int:
    """SIGKILL workers of a run at random moments, and let it finish; how many were killed."""
    process = start(words)
    killed = 0
    for blocks in range(1, kills + 1):
        if not wait_for_blocks(process, store, blocks):
            break
        time.sleep(chance.uniform(0.0, 0.05))
        for pid in workers(process)[:1]:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
                killed += 1
    _, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, err
    return killed


@contextlib.contextmanager
def dask(folder: Path, number: int = 2) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """A Dask scheduler and workers under a nanny; its address, and the nannies' process."""
    file = folder / "scheduler.json"
    shared = ("--scheduler-file", str(file), "--no-dashboard")
    scheduler = _daemon("dask_scheduler", *shared, "--port", "0", "--host", "127.0.0.1")
    threads = ("--nworkers", str(number), "--nthreads", "1")
    nannies = _daemon("dask_worker", *shared, *threads, "--local-directory", str(folder))
    try:
        yield _address(file), nannies
    finally:
        for process in (nannies, scheduler):
            process.terminate()
        for process in (nannies, scheduler):
            process.wait(PATIENCE)


def _daemon(name: str, *options: str) -> subprocess.Popen[str]:
    words = [sys.executable, "-m", f"distributed.cli.{name}", *options]
    return subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, text=True)


def _address(file: Path) -> str:
    deadline = time.monotonic() + PATIENCE
    while True:
        with contextlib.suppress(OSError, ValueError):
            return json.loads(file.read_text())["address"]
        assert time.monotonic() < deadline, "the scheduler does not start"
        time.sleep(0.05)
