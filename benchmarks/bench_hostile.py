"""Mangled inputs over all commands and kinds of file: a line and an exit code, never a traceback.

`python -m benchmarks bench_hostile` tries `HOSTILE_TRIES` of them (20 000), each in an empty folder
and in a process that is forked from this one, some of them in turn; one that fails is tried once
more in a process of its own. What was tried is noted in the file `HOSTILE_RECORD`, if that is set,
and not tried again. A command has to work, to refuse in lines, or to work on until it is cut off;
see `verdict` for what counts as a failure.
"""

from __future__ import annotations

import contextlib
import gc
import io
import json
import os
import resource
import shutil
import signal
import sys
import tempfile
import threading
import time
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from random import Random
from typing import IO, Any

from aeroflutter.cli import COMMANDS, main
from benchmarks import Measurement
from benchmarks._mangling import WAYS, prepare

TRIES = int(os.environ.get("HOSTILE_TRIES", "20000"))
FIRST = int(os.environ.get("HOSTILE_FIRST", "0"))
RECORD = os.environ.get("HOSTILE_RECORD")
TOGETHER = 25  # tries in one process
PATIENCE, PATIENT = 0.3, 3.0  # seconds of CPU time until a command is cut off; and of one in forty
PATIENCES = {"store": 2.0, "import": 1.0}  # what has to come to its end
HANGS = 150.0  # seconds of the clock after which one that is not cut off hangs
MEMORY = 8 << 30
FINE = (0, 1, 2, 3)  # exit codes by which a command says what became of it
LONGEST = 1000  # characters of a line of a refusal

Record = dict[str, Any]


def measure() -> Iterator[Measurement]:
    """How many were tried, how many of them ended wrong."""
    known = _recorded()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        whole = folder / "whole"
        whole.mkdir()
        assert _reaped(_forked(lambda: prepare(whole), folder), 1e6) == 0
        _ready()
        waiting = [number for number in range(FIRST, FIRST + TRIES) if number not in known]
        while waiting:
            for one in _batch(waiting[:TOGETHER], folder):
                known[one["number"]] = one
                waiting.remove(one["number"])
                _note(one)
    outcomes = Counter(one["outcome"].partition(":")[0] for one in known.values())
    yield Measurement("mangled inputs", len(known), "")
    for outcome in ("worked", "refused", "cut off"):
        yield Measurement(f"of them {outcome}", outcomes.pop(outcome, 0), "")
    yield Measurement("failures", outcomes.total(), "", target=0)
    for of in ("way", "command"):
        for name, count in sorted(Counter(one[of] for one in known.values()).items()):
            yield Measurement(f"{of} {name}", count, "")


def _recorded() -> dict[int, Record]:
    if not RECORD or not Path(RECORD).exists():
        return {}
    lines = Path(RECORD).read_text(encoding="utf-8").splitlines()
    return {one["number"]: one for one in map(json.loads, lines)}


def _note(one: Record) -> None:
    if one["outcome"].startswith("WRONG"):
        print(one["number"], one["way"], one["outcome"], one["words"], file=sys.stderr, flush=True)
    if RECORD:
        with open(RECORD, "a", encoding="utf-8") as file:
            file.write(json.dumps(one) + "\n")


def _ready() -> None:
    """Import and load what commands need, so that no fork has to; no thread may be left."""
    import netCDF4  # noqa: F401
    import scipy.stats  # noqa: F401
    import xarray  # noqa: F401
    import zarr  # noqa: F401

    from aeroflutter.kernels.warmup import warm_up
    from aeroflutter.studies.maps.fingerprint import code_hash

    warm_up()
    with contextlib.redirect_stdout(io.StringIO()), tempfile.TemporaryDirectory() as folder:
        for line in ("rootlocus run14", "df run14 --points 3", "spring run14", "onset run14"):
            ends = ["--plot", f"{folder}/a.png", "--out", f"{folder}/a.nc", "--overwrite"]
            assert main([*line.split(), *ends]) == 0
    for roots in (
        ("aeroflutter.reproduce.press",),
        ("aeroflutter.studies.maps.flutter_map", "aeroflutter.studies.cases"),
        ("aeroflutter.studies.maps.sweep", "aeroflutter.studies.sampled"),
    ):
        code_hash(*roots)
    assert threading.active_count() == 1
    gc.freeze()


def _batch(numbers: Sequence[int], folder: Path) -> list[Record]:
    """Tries in one process, as far as it lives; those that go wrong once more, alone."""
    found = _together(numbers, folder)
    for place, one in enumerate(found):
        if one["outcome"].startswith("WRONG") and len(numbers) > 1:
            [again] = _together([one["number"]], folder)
            if not again["outcome"].startswith("WRONG"):
                one["outcome"] += f" [alone: {again['outcome']}]"
            found[place] = one
    return found


def _together(numbers: Sequence[int], folder: Path) -> list[Record]:
    """Tries in one process; the last is the one at which it died, if it did."""
    reader, writer = os.pipe()
    with os.fdopen(reader, encoding="utf-8") as heard, os.fdopen(writer, "w") as said:
        pid = _forked(lambda: _series(numbers, folder, said), folder)
        said.close()
        watch = threading.Timer(HANGS * len(numbers), os.killpg, (pid, signal.SIGKILL))
        watch.start()
        lines = [json.loads(line) for line in heard]
        watch.cancel()
        watch.join()
        code = _reaped(pid, HANGS)
    found = [one for one in lines if "outcome" in one]
    if code != 0 and lines:
        last = lines[-1]
        cut = code == -signal.SIGPROF
        last["outcome"] = "cut off" if cut else f"WRONG: died with {code}: {_said(folder)}"
        found.append(last)
    return found


def _series(numbers: Sequence[int], folder: Path, tell: IO[str]) -> int:
    before = dict(os.environ)
    for number in numbers:
        chance = Random(f"2026-{number}")
        name = list(WAYS)[number % len(WAYS)]
        here = folder / "here"
        shutil.rmtree(here, ignore_errors=True)
        here.mkdir()
        os.chdir(here)
        words = WAYS[name](here, folder / "whole", chance)
        patience = PATIENT if chance.random() < 1 / 40 else PATIENCES.get(name, PATIENCE)
        strict = chance.random() < 0.25  # as with `python -W error`
        command = next((word for word in words if word in COMMANDS), "other")
        about = {"number": number, "way": name, "command": command, "strict": strict}
        about["words"] = [word[:300] for word in words]
        print(json.dumps(about), file=tell, flush=True)
        os.environ.clear()
        os.environ.update(before)
        _settled(here, patience)
        begin = time.process_time()
        with warnings.catch_warnings():
            if strict:
                warnings.simplefilter("error")
            code, error = _run(words)
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(OSError, ValueError):
                stream.flush()
        about["outcome"] = error or verdict(words, code, here)
        about["seconds"] = round(time.process_time() - begin, 3)
        print(json.dumps(about), file=tell, flush=True)
    return 0


def _run(words: list[str]) -> tuple[int, str]:
    """Exit code of a command line, and what came out of it that may not."""
    while words and "=" in words[0] and words[0].partition("=")[0].isupper():
        name, _, value = words[0].partition("=")
        os.environ[name], words = value, words[1:]
    try:
        return (_checked(Path(words[1])) if words[:1] == ["CHECK"] else main(words)), ""
    except BaseException as error:  # noqa: BLE001 - that is what is looked for
        return 99, f"WRONG: came out: {type(error).__name__}: {error}"


def _checked(file: Path) -> int:
    """What the checker says of a certificate, as a command would."""
    from aeroflutter.cli.streams import say
    from aeroflutter.errors import AeroflutterError
    from aeroflutter.guarantees.absence import Certificate
    from aeroflutter.guarantees.absence.checker import Refused, check

    try:
        check(Certificate.load(file), 2000)
    except (AeroflutterError, Refused) as error:
        say(str(error))
        return 2
    return 0


def _forked(call: Callable[[], int | None], folder: Path) -> int:
    """A process of its own in which something is called."""
    sys.stdout.flush()
    sys.stderr.flush()
    pid = os.fork()
    if pid:
        return pid
    code = 99
    try:
        os.setpgid(0, 0)
        _settled(folder, 0.0)
        code = call() or 0
    except BaseException as error:  # noqa: BLE001 - said, and an exit code
        print(f"{type(error).__name__}: {error}", file=sys.stderr, flush=True)
    finally:
        os._exit(code)


def _reaped(pid: int, patience: float) -> int:
    """Exit code of a process, or less the signal that ended it; what it started ends with it."""
    deadline = time.monotonic() + patience
    while not (done := os.waitpid(pid, os.WNOHANG))[0]:
        if time.monotonic() > deadline:
            os.kill(pid, signal.SIGKILL)
        time.sleep(0.001)
    with contextlib.suppress(OSError):
        os.killpg(pid, signal.SIGKILL)
    return os.waitstatus_to_exitcode(done[1])


def _settled(here: Path, patience: float) -> None:
    """Streams into files, a folder to work in, limits."""
    os.environ["TMPDIR"] = str(here)
    tempfile.tempdir = None
    for descriptor, name in ((1, "stdout"), (2, "stderr")):
        file = os.open(_streams(here) / name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(file, descriptor)
        os.close(file)
        stream = open(descriptor, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
        setattr(sys, name, stream)
    null = os.open(os.devnull, os.O_RDONLY)
    os.dup2(null, 0)
    os.close(null)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    signal.setitimer(signal.ITIMER_PROF, patience)


def _streams(here: Path) -> Path:
    return here.parent if here.name == "here" else here


def _said(here: Path, name: str = "stderr") -> str:
    return (_streams(here) / name).read_bytes().decode("utf-8", "replace")


def verdict(words: list[str], code: int, here: Path) -> str:
    """What became of a command: "worked", "refused", or WRONG and why.

    Wrong are: an exit code that is none of the documented ones, 70 among them; an exception that
    came out, a warning of a library; control characters that a terminal obeys; a refusal without a
    line, with a line that nobody reads to its end, or with half a result on stdout; JSON that is
    none; a file that was asked for and is not there; half a file that is left behind.
    """
    out, err = _said(here, "stdout"), _said(here)
    for wrong, why in (
        (code not in FINE, f"exit code {code}"),
        ("Traceback" in err, "traceback"),
        ("Warning" in err, "warning"),
        (_obeyed(out) or _obeyed(err), "control characters"),
        (code != 0 and _ill_said(err), "no line of refusal, or one too long"),
        (code == 2 and bool(out) and not _late(words, err), "stdout of a refusal"),
        (code == 0 and "--json" in words and not _is_json(out), "no JSON"),
        (code == 0 and not _written(words, here, out), "the file is not there"),
        (bool([*here.rglob(".aeroflutter-*"), *here.rglob("*.partial")]), "half a file"),
    ):
        if wrong:
            story = "".join(file.read_text()[-6000:] for file in here.glob("aeroflutter-*.txt"))
            return f"WRONG: {why}: {err[-400:]} | {out[-200:]} | {story}"
    return "worked" if code == 0 else "refused"


def _obeyed(text: str) -> bool:
    return not all(character.isprintable() or character == "\n" for character in text)


def _ill_said(err: str) -> bool:
    lines = err.splitlines()
    return (
        not lines
        or not lines[-1].startswith("aeroflutter: ")
        or any(len(line) > LONGEST for line in lines)
    )


def _late(words: list[str], err: str) -> bool:
    """Whether what is refused leaves a result: a file cannot be written, or drawn, after all."""
    return words[0] == "validate" or "cannot be written" in err or "no attractor to draw" in err


def _is_help(out: str) -> bool:
    """Help or version, asked for by one of the words."""
    return out.startswith("Usage") or out.strip().replace(".", "").isdigit()


def _is_json(out: str) -> bool:
    def refuse(name: str) -> None:
        raise ValueError(name)

    if _is_help(out):
        return True
    try:
        json.loads(out, parse_constant=refuse)
    except ValueError:
        return False
    return out.count("\n") == 1


def _written(words: list[str], here: Path, out: str) -> bool:
    return _is_help(out) or all(
        (here / name).is_file()
        for option, name in pairwise(words)
        if option in ("--out", "--plot", "--certificate")
        and name in ("out.nc", "plot.png", "plot.svg", "proof.json")
    )
