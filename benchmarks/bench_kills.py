"""Commands that are killed, resumed, and must be the uninterrupted ones, bit for bit.

`map`, `sweep`, `reproduce` and `report` die by SIGKILL, SIGTERM and SIGINT at random moments,
`KILLS_OF` times in all (200), and go on; what was finished before is neither lost nor altered nor
made again. Maps besides: workers die, a Dask worker dies (none may outlive its parent), the disk is
full at every stage (a limit on the size of files).
"""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple

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
OF_COMMANDS = int(os.environ.get("KILLS_OF", "200"))
RECORD = os.environ.get("KILLS_RECORD")  # a file of lines, where it is set
# Freeplay at low speed takes its time; the boundaries are a second phase to be killed in.
CASE = "run100"
GRID = ("--speed-ratio", "0.12:1:150", "--alpha-deg", "-15:15:60")
BLOCKS = 50  # of that grid, see `maps.grid`
LIMITS = (1_000, 3_000, 10_000, 20_000)  # bytes a file


def measure() -> Iterator[Measurement]:
    """Stores that differ from the uninterrupted one, for every way to die."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        yield from _commands(folder)
        if os.environ.get("KILLS_ONLY"):
            return
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


class Job(NamedTuple):
    """A command that can be killed and go on.

    `out` is what it writes, a file or a folder; `resume` are the words by which it goes on where
    something is there.
    """

    command: str
    words: tuple[str, ...]
    out: str
    resume: tuple[str, ...] = ()


JOBS = (
    Job("map", ("map", "run100", "--speed-ratio", "0.12:1:60", "--alpha-deg", "-15:15:16"),
        "a.zarr", ("--resume",)),
    Job("map", ("map", "run14", "--speed-ratio", "0.9:1:12", "--alpha-deg", "1:9:12", "--refine",
                "--tolerance", "0.01", "--workers", "2"), "a.zarr", ("--resume",)),
    Job("sweep", ("sweep", "run14", "--vary", "section.mu=normal(100,5)", "--sample", "60",
                  "--speed-ratio", "0.95", "--workers", "0"), "a.zarr", ("--resume",)),
    Job("reproduce", ("reproduce", "--only", "3.2", "--only", "4.9", "--only", "4.12", "--workers",
                      "1"), "figures"),
    Job("report", ("report", "linear-02", "--speed-ratio", "0.9:1:4", "--alpha-deg", "1,3",
                   "--periods", "2"), "page.html"),
)  # fmt: skip
WAYS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
CODES = {signal.SIGKILL: (-9,), signal.SIGTERM: (-15, 143), signal.SIGINT: (-2, 130)}


class Wrong(Exception):
    """Something was lost, or ended as it may not."""


def _commands(folder: Path) -> Iterator[Measurement]:
    """Every command by every signal, at random moments of runs afresh and of runs that go on."""
    signal.signal(signal.SIGINT, signal.default_int_handler)  # in the background it is ignored
    chance = random.Random(2028)
    wholes, times = {}, {}
    for job in JOBS:
        out = folder / "whole" / job.out
        out.parent.mkdir(exist_ok=True)
        begin = time.monotonic()
        finish(_line(job, out))
        times[job], wholes[job] = time.monotonic() - begin, _contents(out)
        shutil.rmtree(out.parent)
    killed: Counter[str] = Counter()
    wrongs, runs = [], 0
    while killed.total() < OF_COMMANDS:
        job = JOBS[runs % len(JOBS)]
        out = folder / f"run{runs}" / job.out
        out.parent.mkdir()
        runs += 1
        try:
            for _ in range(chance.randint(2, 5)):
                way = chance.choice(WAYS)
                killed[f"{job.command} by {way.name}"] += _killed(job, out, way, chance, times[job])
            before = _finished(out)
            finish(_line(job, out))
            _same_as(wholes[job], out, before)
        except (Wrong, AssertionError) as wrong:
            wrongs.append(f"{job.command}: {wrong}")
            print(wrongs[-1], file=sys.stderr, flush=True)
        if RECORD:
            Path(RECORD).write_text(json.dumps([killed, wrongs]), encoding="utf-8")
        shutil.rmtree(out.parent, ignore_errors=True)
    for name, count in sorted(killed.items()):
        yield Measurement(f"kills of {name}", count, "")
    yield Measurement("kills of commands", killed.total(), "")
    yield Measurement("of their results lost, altered or made twice", len(wrongs), "", target=0)


def _line(job: Job, out: Path) -> list[str]:
    option = "--folder" if job.command == "reproduce" else "--out"
    resume = job.resume if (out / "zarr.json").exists() else ()
    return [sys.executable, "-m", "aeroflutter", *job.words, option, str(out), "--json", *resume]


def _killed(job: Job, out: Path, way: signal.Signals, chance: random.Random, whole: float) -> bool:
    """Kill a run at a random moment; False if it was done before. What was finished must stay."""
    before = _finished(out)
    process = subprocess.Popen(
        _line(job, out), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )
    try:
        process.wait(chance.uniform(0.05, 1.0) * whole)
    except subprocess.TimeoutExpired:
        process.send_signal(way)
    _, err = process.communicate(timeout=300)
    _kept(before, _finished(out))
    if process.returncode == 0:
        return False
    if process.returncode not in CODES[way]:
        raise Wrong(f"{way.name}: exit code {process.returncode}: {err[-300:]}")
    if "Traceback" in err and "aeroflutter/cli" in err:  # before that Python answers by itself
        raise Wrong(f"{way.name}: {err[-600:]}")
    return True


def _contents(out: Path) -> dict[str, str]:
    """All that is promised bit for bit, by the names of its files."""
    if out.suffix == ".zarr":
        return {name: sha256(data).hexdigest() for name, data in arrays(out).items()}
    files = [out] if out.is_file() else sorted(out.iterdir())
    # Part of a file that was being written as the power went lies about under a name of its own.
    return {file.name: sha256(file.read_bytes()).hexdigest() for file in files if not _part(file)}


def _part(file: Path) -> bool:
    return file.name.startswith(".aeroflutter-")


def _finished(out: Path) -> dict[str, int]:
    """When everything that counts as finished was written, in nanoseconds."""
    if out.suffix == ".zarr":
        blocks = out / "blocks"
        markers = [file for file in blocks.glob("*/c/*/0") if not _is_blank(file)]
        numbers = [(file.parts[-4], file.parts[-2]) for file in markers]
        files = [*markers]
        if (blocks / "cells").exists():
            width = len(list((out / "state" / "c" / "0").glob("*"))) or 1
            files += [
                out / "state" / "c" / str(int(number) // width) / str(int(number) % width)
                for phase, number in numbers
                if phase == "cells"
            ]
    else:
        # An exhibit is finished with its record; a page when it is there.
        records = list(out.glob("*.json")) if out.is_dir() else []
        files = records or ([out] if out.is_file() else [])
    return {str(file): file.stat().st_mtime_ns for file in files if file.exists()}


def _is_blank(marker: Path) -> bool:
    return marker.stat().st_size == 0


def _kept(before: dict[str, int], after: dict[str, int]) -> None:
    lost = [name for name in before if name not in after]
    again = [name for name, when in before.items() if after.get(name, when) != when]
    # A page and the index are made by every run; a record or a block is not.
    again = [name for name in again if not name.endswith(".html")]
    if lost or again:
        raise Wrong(f"lost {lost[:3]}, made again {again[:3]}")


def _same_as(whole: dict[str, str], out: Path, before: dict[str, int]) -> None:
    _kept(before, _finished(out))
    found = _contents(out)
    differ = [name for name in {*whole, *found} if whole.get(name) != found.get(name)]
    differ = [name for name in differ if not name.endswith("_cpu")]
    if differ:
        raise Wrong(f"differ: {differ}")
