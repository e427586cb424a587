"""Maps that are killed twenty times over: resumed, they are the uninterrupted one, bit for bit.

The parent dies by SIGKILL at random moments (workers must not outlive it), workers die, a Dask
worker dies, the disk is full at every stage (a limit on the size of files).
"""

from __future__ import annotations

import os
import random
import signal
import tempfile
from collections.abc import Iterator
from pathlib import Path

from benchmarks import Measurement
from tests.killing import (
    arrays,
    command,
    committed,
    dask,
    finish,
    kill_parent,
    kill_workers,
    start,
    wait_for_blocks,
    workers,
)

KILLS = 20
# Freeplay at low speed takes its time; the boundaries are a second phase to be killed in.
CASE = "run100"
GRID = ("--speed-ratio", "0.12:1:150", "--alpha-deg", "-15:15:60")
BLOCKS = 50  # of that grid, see `maps.grid`
LIMITS = (1_000, 3_000, 10_000, 20_000)  # bytes a file


def measure() -> Iterator[Measurement]:
    """Stores that differ from the uninterrupted one, for every way to die."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        whole = folder / "whole.zarr"
        finish(command(CASE, whole, *GRID))
        wanted = arrays(whole)
        for way in (_parents, _workers, _cluster, _disk):
            yield from way(folder, wanted)


def _differ(store: Path, wanted: dict[str, bytes]) -> int:
    found = arrays(store)
    return sum(found.get(name) != values for name, values in wanted.items())


def _parents(folder: Path, wanted: dict[str, bytes]) -> Iterator[Measurement]:
    """SIGKILL in runs that start afresh, and in ones that go on, at random moments."""
    chance = random.Random(2026)
    killed, differ, round_ = 0, 0, 0
    while killed < KILLS:
        store = folder / f"parent{round_}.zarr"
        words = command(CASE, store, *GRID, "--workers", "2")
        for _ in range(4):
            resumed = ["--resume"] if store.exists() else []
            after = committed(store) + chance.randrange(0, BLOCKS // 4)
            killed += kill_parent([*words, *resumed], store, after, chance)
        finish([*words, "--resume"])
        differ += _differ(store, wanted)
        round_ += 1
    yield Measurement("SIGKILLs of the parent", killed, "")
    yield Measurement("arrays that differ after them", differ, "", target=0)


def _workers(folder: Path, wanted: dict[str, bytes]) -> Iterator[Measurement]:
    store = folder / "workers.zarr"
    words = command(CASE, store, *GRID, "--workers", "2")
    killed = kill_workers(words, store, KILLS, random.Random(2027))
    yield Measurement("SIGKILLs of workers", killed, "")
    yield Measurement("arrays that differ after them", _differ(store, wanted), "", target=0)


def _cluster(folder: Path, wanted: dict[str, bytes]) -> Iterator[Measurement]:
    store = folder / "dask.zarr"
    killed = 0
    with dask(folder) as (address, nannies):
        process = start(command(CASE, store, *GRID, "--scheduler", address))
        for after in (2, BLOCKS // 2):
            if wait_for_blocks(process, store, after):
                for pid in workers(nannies)[:1]:
                    os.kill(pid, signal.SIGKILL)
                    killed += 1
        _, err = process.communicate()
    assert process.returncode == 0, err
    yield Measurement("SIGKILLs of Dask workers", killed, "")
    yield Measurement("arrays that differ after them", _differ(store, wanted), "", target=0)


def _disk(folder: Path, wanted: dict[str, bytes]) -> Iterator[Measurement]:
    """A full disk before the store is laid out, and in the middle of a block."""
    told, differ = 0, 0
    for limit in LIMITS:
        store = folder / f"full{limit}.zarr"
        words = command(CASE, store, *GRID, "--workers", "0")
        process = start(words, limit)
        _, err = process.communicate()
        told += process.returncode == 0 or ("no room to write" in err and "Traceback" not in err)
        begun = (store / "zarr.json").exists()
        finish([*words, "--resume" if begun else "--overwrite"])
        differ += _differ(store, wanted)
    yield Measurement("full disks told plainly, of four", told, "")
    yield Measurement("arrays that differ after them", differ, "", target=0)
