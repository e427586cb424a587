"""Commands of one spring of two checkouts in turn: CPU time of whole processes, imports and all.

    python -m benchmarks.paired_commands BEFORE AFTER [ROUNDS]

BEFORE and AFTER are folders of checkouts, each with its `.venv`. In each round both run the same
command, one after the other; what is printed are the medians over the rounds and their ratio. A run
that is not counted comes first, so that the caches of machine code are full.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median

COMMANDS = (
    "validate run14",
    "rootlocus run14",
    "spring run14",
    "df run14",
    "loop run14 --speed-ratio 0.95",
    "hb run14",
    "simulate run14 --speed-ratio 0.94",
    "simulate run103 --speed-ratio 0.8",
    "chaos freeplay-02 --speed-ratio 0.3",
    "sweep run14 --sample 10 --seed 1 --vary section.mu=normal(100,5)",
    "map run14",
    "lco run14",
    "lco run103",
    "tolerance run14 --vary size --speed-ratio 0.95 --amplitude-deg 2",
)
ANSWERED = (0, 3)
"""Exit codes of commands that did their work."""


def cpu_of(checkout: Path, command: str, folder: str) -> float:
    """CPU seconds, user and system, of one command, started in a folder of its own."""
    program = checkout / ".venv" / "bin" / "aeroflutter"
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "MPLBACKEND": "Agg"}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        [program, *command.split()], cwd=folder, env=environment, capture_output=True, text=True
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode not in ANSWERED:
        sys.exit(f"{program} {command}: exit code {done.returncode}\n{done.stderr}")
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main(before: str, after: str, rounds: str = "5") -> None:
    """Both in turn, command by command."""
    sides = [Path(before).resolve(), Path(after).resolve()]
    print(f"{'CPU seconds, medians':<66}{'before':>9}{'after':>9}{'ratio':>8}")
    with tempfile.TemporaryDirectory() as folder:
        for command in COMMANDS:
            found = [[cpu_of(s, command, folder) for s in sides] for _ in range(int(rounds) + 1)]
            old, new = (median(side) for side in zip(*found[1:], strict=True))
            print(f"{command:<66}{old:>9.3f}{new:>9.3f}{new / old:>8.2f}", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
