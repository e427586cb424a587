"""What the first commands on an empty cache of machine code cost beyond those on a full one.

CPU time, user and system, of whole processes. Each command has a cache of its own; what it then
still runs uncompiled is in its second and third run, so those are counted as well. The full cache
is made by `aeroflutter warmup`.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Iterator

from benchmarks import Measurement

MAP = ("--speed-ratio", "0.9:1.0:20", "--alpha-deg", "0:10:20")
COMMANDS = {
    "simulate": (5.0, ("simulate", "run14", "--speed-ratio", "0.94")),
    "hb": (5.0, ("hb", "run14")),
    "chaos, short": (5.0, ("chaos", "run14", "--speed-ratio", "0.95", "--alpha-deg", "6")),
    "map, 20 by 20": (5.0, ("map", "run14", *MAP)),
    "lco": (10.0, ("lco", "run14")),
}
RUNS = 3
WARM = 2  # runs on the full cache, of which the least counts


def measure() -> Iterator[Measurement]:
    """CPU seconds of the first run and of the first three, beyond as many on a full cache."""
    with tempfile.TemporaryDirectory() as full:
        yield Measurement("aeroflutter warmup", _cpu(full, "warmup"))
        warm = {
            name: min(_cpu(full, *words) for _ in range(WARM))
            for name, (_, words) in COMMANDS.items()
        }
    for name, (most, words) in COMMANDS.items():
        with tempfile.TemporaryDirectory() as empty:
            more = [_cpu(empty, *words) - warm[name] for _ in range(RUNS)]
        yield Measurement(f"{name}, on a full cache", warm[name])
        yield Measurement(f"{name}, the first run adds", more[0], target=most)
        yield Measurement(f"{name}, the first {RUNS} runs add", sum(more))


def _cpu(cache: str, *words: str) -> float:
    line = [sys.executable, "-m", "aeroflutter", *words]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    environment = os.environ | {"NUMBA_CACHE_DIR": cache, "OPENBLAS_NUM_THREADS": "1"}
    subprocess.run(line, check=True, capture_output=True, env=environment)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
