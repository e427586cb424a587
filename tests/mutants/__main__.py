"""Apply every mutant to a copy of the package, one after the other, and run its tests.

    python -m tests.mutants [--list] [word …]

With words, only mutants whose name contains one of them. Exit status 1 if a mutant survives, or if
a test fails without any mutant.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from tests.mutants import ROOT, Mutant, mutants

PASSED, FAILED = 0, 1  # pytest's exit codes; others say that it could not run the tests
PATIENCE = 300.0  # seconds until a mutant hangs, which is a way to be noticed


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.mutants", description=__doc__)
    parser.add_argument("words", nargs="*", help="parts of names of mutants")
    parser.add_argument("--list", action="store_true", help="name them and stop")
    chosen = parser.parse_args(words)
    todo = [
        mutant
        for mutant in mutants()
        if not chosen.words or any(word in mutant.name for word in chosen.words)
    ]
    if chosen.list:
        print("\n".join(mutant.name for mutant in todo))
        return 0
    with tempfile.TemporaryDirectory() as folder:
        copy = copied(Path(folder))
        return 1 if [*sound(copy, todo), *survivors(copy, todo)] else 0


def copied(folder: Path) -> Path:
    """The package, its generated modules, the derivation and the tests, in a place apart."""
    without = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "aeroflutter", folder / "aeroflutter", ignore=without)
    shutil.copytree(ROOT / "generated", folder / "aeroflutter" / "generated", ignore=without)
    shutil.copytree(ROOT / "derive", folder / "derive", ignore=without)
    shutil.copytree(ROOT / "tests", folder / "tests", ignore=without)
    shutil.copy(ROOT / "pyproject.toml", folder)
    return folder


def sound(copy: Path, todo: Sequence[Mutant]) -> list[str]:
    """What is wrong before any mistake is made."""
    wrong = []
    for compiled in (False, True):
        tests = sorted({test for one in todo if one.compiled == compiled for test in one.tests})
        if tests and run(copy, tests, compiled, copy / "cache" / str(compiled), None) != PASSED:
            wrong.append("compiled" if compiled else "uncompiled")
            print(f"tests fail without a mutant ({wrong[-1]})", flush=True)
    return wrong


def survivors(copy: Path, todo: Sequence[Mutant]) -> list[str]:
    """Names of the mutants that no test notices."""
    alive = []
    for number, mutant in enumerate(todo):
        began = time.monotonic()
        file = copy / mutant.file
        before = file.read_text()
        file.write_text(mutant.applied(before))
        try:
            code = run(copy, mutant.tests, mutant.compiled, cache(copy, mutant, number))
        finally:
            file.write_text(before)
        verdict = {FAILED: "killed", PASSED: "SURVIVED"}.get(code, f"NOT RUN (pytest: {code})")
        if code != FAILED:
            alive.append(mutant.name)
        print(f"{verdict:9} {time.monotonic() - began:5.1f} s  {mutant.name}", flush=True)
    print(f"{len(todo) - len(alive)} of {len(todo)} mutants killed")
    return alive


def cache(copy: Path, mutant: Mutant, number: int) -> Path:
    """Machine code of kernels that are not touched is shared; numba knows files, not mistakes."""
    touched = Path(mutant.file).name.startswith("_kernel")
    return copy / "cache" / (str(number) if touched else str(mutant.compiled))


def run(
    copy: Path, tests: Sequence[str], compiled: bool, kept: Path, patience: float | None = PATIENCE
) -> int:
    """Pytest's exit code."""
    environment = os.environ | {
        "PYTHONPATH": str(copy),
        "PYTHONDONTWRITEBYTECODE": "1",
        "NUMBA_CACHE_DIR": str(kept),
        "NUMBA_DISABLE_JIT": "0" if compiled else "1",
        "OPENBLAS_NUM_THREADS": "1",
    }
    words = [sys.executable, "-m", "pytest", "-x", "-q", "-n", "0", "-p", "no:cacheprovider"]
    try:
        done = subprocess.run(
            [*words, *tests], cwd=copy, env=environment, capture_output=True, timeout=patience
        )
    except subprocess.TimeoutExpired:
        return FAILED
    if done.returncode not in (PASSED, FAILED):
        sys.stdout.write(done.stdout.decode() + done.stderr.decode())
    return done.returncode


if __name__ == "__main__":
    sys.exit(main())
