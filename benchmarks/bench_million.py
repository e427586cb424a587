"""How the cost of a map grows from ten thousand cells to a million, on two worker processes.

Run 14 at the command line into a store. Memory is the sum of the high-water marks of the process
and its workers, more than what is ever in use at once.
"""

from __future__ import annotations

import contextlib
import json
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from benchmarks import Measurement
from tests.killing import children, command, start

SIDES = (100, 316, 1000)
MOST_MEMORY = 2048.0  # MiB
LOOK = 0.2


def measure() -> Iterator[Measurement]:
    """CPU time a cell, wall time and memory for each size, and the growth of the first."""
    per_cell = {}
    for side in SIDES:
        with tempfile.TemporaryDirectory() as folder:
            words = ("--speed-ratio", f"0.85:0.999:{side}", "--alpha-deg", f"1:15:{side}")
            begun = time.monotonic()
            told, memory = _run(command("run14", Path(folder) / "m.zarr", *words, "--workers", "2"))
            wall = time.monotonic() - begun
        per_cell[side] = told["cpu_seconds"] / told["cells"]
        name = f"{told['cells']} cells"
        yield Measurement(f"{name}: CPU time a cell", 1e6 * per_cell[side], "us")
        yield Measurement(f"{name}: wall time, start and store included", wall, "s")
        yield Measurement(f"{name}: memory of all processes", memory, "MiB", target=MOST_MEMORY)
        yield Measurement(f"{name}: undecided", told["undecided"], "cells", target=0)
    growth = per_cell[SIDES[-1]] / per_cell[SIDES[0]]
    yield Measurement("CPU time a cell, a million over ten thousand", growth, "")


def _run(words: list[str]) -> tuple[dict, float]:
    """What a run told, and the sum of its processes' largest resident sizes in MiB."""
    process = start(words)
    largest: dict[int, float] = {}
    while process.poll() is None:
        with contextlib.suppress(OSError):
            for pid in (process.pid, *children(process)):
                largest[pid] = max(_resident(pid), largest.get(pid, 0.0))
        time.sleep(LOOK)
    out, err = process.communicate()
    assert process.returncode == 0, err
    return json.loads(out), sum(largest.values())


def _resident(pid: int) -> float:
    for line in Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("VmHWM"):
            return float(line.split()[1]) / 1024.0
    return 0.0
