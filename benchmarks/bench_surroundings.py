"""Commands where they are not at home: no home, no disk, no streams, no scheduler; a table.

A row is one thing that is wrong around a command; every command that applies is run in it, and has
to do what it does elsewhere, or to end in one line. `python -m benchmarks bench_surroundings` takes
some minutes; rows that need a name space of mounts are left out where none may be made. Dask has
its own rows, each a map that is gone on with afterwards and must be the one of a quiet run.
"""

from __future__ import annotations

import contextlib
import http.server
import json
import os
import shlex
import shutil
import signal
import socketserver
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

from benchmarks import Measurement
from tests.killing import PATIENCE, arrays, committed, finish, workers

PROGRAM = [sys.executable, "-m", "aeroflutter"]
ROOT = Path(__file__).parents[1]

# What prints, and what writes a file of each kind: the word of its name is what it is called.
PRINTING = {
    "cases": "cases",
    "init": "init",
    "validate": "validate run14",
    "onset": "onset run14",
    "rootlocus": "rootlocus run14 --json",
    "pk": "pk plate.toml --points 5",
    "df": "df run14 --points 5",
    "lco": "lco run14 --points 4 --simulations 0 --depth 0",
    "tolerance": "tolerance run14 --speed-ratio 0.95 --amplitude-deg 1",
    "hb": "hb run14 --harmonics 3 --max-step 0.5",
    "loop": "loop run14 --speed-ratio 0.95",
    "spring": "spring run14",
    "simulate": "simulate run14 --speed-ratio 0.9",
    "chaos": "chaos run14 --speed-ratio 0.95 --cycles 40 --transient 5",
    "map": "map run14 --speed 2,3 --alpha-deg 1,2 --workers 0",
    "sweep": "sweep run14 --vary section.mu=normal(100,5) --sample 3 --workers 0",
    "warmup": "warmup",
}
WRITING = {
    "import": "import plate.npz --out {0}/new.toml --set stiffness=[100.0]",
    "init FILE": "init {0}/new.toml",
    "rootlocus --out": "rootlocus run14 --out {0}/a.nc",
    "rootlocus --plot": "rootlocus run14 --plot {0}/a.png",
    "df --out --plot": "df run14 --points 5 --out {0}/a.nc --plot {0}/a.svg",
    "onset --certificate": "onset run14 --certificate {0}/a.json",
    "map --out": "map run14 --speed 2,3 --alpha-deg 1:5:3000 --workers 0 --out {0}/a.zarr",
    "map --out NetCDF": "map run14 --speed 2,3 --alpha-deg 1,2 --workers 0 --out {0}/a.nc",
    "sweep --out": "sweep run14 --vary section.mu=normal(100,5) --sample 3 --out {0}/a.zarr",
    "reproduce": "reproduce --only 4.9 --workers 1 --folder {0}/figures",
    "report": "report linear-02 --speed-ratio 0.9,1 --alpha-deg 1,3 --periods 2 --out {0}/a.html",
}
TOLD = (  # what has a result besides its file, which has to stand on stdout
    "rootlocus --out", "rootlocus --plot", "df --out --plot", "onset --certificate",
)  # fmt: skip
ONLY = os.environ.get("SURROUNDINGS", "")  # a word of the rows to take


class Ran(NamedTuple):
    code: int
    out: str
    err: str

    @property
    def plain(self) -> bool:
        """No traceback, no word of a library, no line too long."""
        text = self.out + self.err
        return not any(word in text for word in ("Traceback", "Warning", "Exception ignored"))


def measure() -> Iterator[Measurement]:
    """Of every row, how many commands did what they should."""
    with tempfile.TemporaryDirectory() as name, contextlib.chdir(name):
        _lay_out(Path(name))
        for row, commands, run, good in _rows(Path(name)):
            if ONLY not in row:
                continue
            held, faults = 0, []
            for command, words in commands.items():
                found = run(words)
                if found.plain and good(command, found):
                    held += 1
                else:
                    faults.append(command)
                    print(f"{row}: {command}: {found}"[:1500], file=sys.stderr, flush=True)
            yield Measurement(f"{row}: of {len(commands)} commands failed", len(faults), "", 0)
        for row, outcome in _clusters(Path(name)) if ONLY.startswith("Dask") or not ONLY else ():
            yield Measurement(f"Dask, {row}", 0 if outcome else 1, "", 0)


def _lay_out(folder: Path) -> None:
    """A model of another program for the commands that read one."""
    import numpy as np

    k = np.array([0.0, 0.05, 0.1, 0.3, 0.6, 1.0])
    steady, rate = np.array([[0.0, 4.0], [0.0, 1.0]]), np.array([[2.0, 1.0], [0.5, 1.0]])
    forces = steady + 1j * k[:, None, None] * rate
    np.savez(
        folder / "plate.npz", M=np.eye(2), K=np.diag([2500.0, 10000.0]), k=k, Q=forces,
        semichord=0.5, density=1.2, rows=np.eye(2)[1:], names=np.array(["tail"]),
    )  # fmt: skip
    assert _run("import plate.npz --out plate.toml --set stiffness=[100.0]").code == 0


def _run(line: str, *, before: list[str] | None = None, **env: str) -> Ran:
    return _shell(shlex.join([*(before or PROGRAM), *shlex.split(line)]), **env)


def _shell(command: str, cwd: str | None = None, **env: str) -> Ran:
    done = subprocess.run(
        ["bash", "-c", command], capture_output=True, cwd=cwd, timeout=PATIENCE, check=False,
        env={**os.environ, "MPLBACKEND": "Agg", **env},
    )  # fmt: skip
    out, err = (one.decode("utf-8", "replace") for one in (done.stdout, done.stderr))
    return Ran(done.returncode, out, err)


def _line_of(words: str) -> str:
    return shlex.join([*PROGRAM, *shlex.split(words)])


Row = tuple[str, dict[str, str], Callable[[str], Ran], Callable[[str, Ran], bool]]


def _rows(folder: Path) -> Iterator[Row]:
    """Name, commands, how they are run, and whether what one did is right."""
    both = PRINTING | {name: words.format(folder) for name, words in WRITING.items()}

    def fresh(run: Callable[[str], Ran]) -> Callable[[str], Ran]:
        def cleaned(words: str) -> Ran:
            for name in MADE:
                path = folder / name
                shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)
            return run(words)

        return cleaned

    def always(name: str, run: Callable[[str], Ran], commands: dict[str, str] = both) -> Row:
        return name, commands, fresh(run), lambda _, found: found.code == 0

    poor = {"LC_ALL": "POSIX", "LANG": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    yield always("quiet", _run)
    yield always("LANG=C, no UTF-8", lambda words: _run(words, **poor))
    for flags in ("-W error", "-OO"):
        line = [sys.executable, *flags.split(), "-m", "aeroflutter"]
        yield always(f"python {flags}", lambda words, line=line: _run(words, before=line))
    for closed in ("<&-", ">&-", "2>&-", "<&- >&- 2>&-", "2> /dev/full"):
        yield always(
            f"streams {closed}", lambda words, closed=closed: _shell(f"{_line_of(words)} {closed}")
        )
    gone = f"mkdir -p {folder}/gone; cd {folder}/gone; rmdir {folder}/gone; "
    whole = {name: words for name, words in both.items() if "plate" not in words}
    yield (
        "a deleted working directory", whole, fresh(lambda words: _shell(gone + _line_of(words))),
        lambda _, found: found.code == 0
        or (found.code == 1 and "the working directory has been removed" in found.err),
    )  # fmt: skip
    yield (
        "streams > /dev/full", PRINTING, lambda words: _shell(f"{_line_of(words)} > /dev/full"),
        lambda _, found: found.code == 1 and found.err.count("aeroflutter: ") == 1,
    )  # fmt: skip
    if subprocess.run(["unshare", "-m", "true"], capture_output=True, check=False).returncode == 0:
        homeless = {name: both[name] for name in (*PRINTING, *WRITING) if name.split()[0] in QUICK}
        yield always("a read-only install, no home", _without_home, homeless)
        yield _full(folder / "full")


def _mounted(mounts: list[str], then: str, **env: str) -> Ran:
    """A command in a name space of mounts of its own."""
    return _shell(f"unshare -m bash -c {shlex.quote(' && '.join([*mounts, then]))}", **env)


def _without_home(words: str) -> Ran:
    places = {ROOT, Path(sys.prefix), Path(sys.base_prefix)}
    mounts = [f"mount --bind {one} {one} && mount -o remount,ro,bind {one}" for one in places]
    none = {"HOME": "/nonexistent", "NUMBA_CACHE_DIR": "", "XDG_CACHE_HOME": ""}
    return _mounted(mounts, _line_of(words), **none)


def _full(disk: Path) -> Row:
    """Files for which there is no room: one line, the result told all the same, nothing left."""
    disk.mkdir()

    def run(words: str) -> Ran:
        fill = f"head -c 16384 /dev/zero > {disk}/fill"
        mounts = [f"mount -t tmpfs -o size=16k tmpfs {disk}", fill]
        left = f"ls -A {disk} | grep -v -e fill -e figures >&2"
        return _mounted(mounts, f"{{ {_line_of(words)}; code=$?; {left}; exit $code; }}")

    def good(command: str, found: Ran) -> bool:
        told = bool(found.out) == (command in TOLD)
        one = found.err.count("aeroflutter: ") == 1 and "No space left" in found.err
        return found.code in (1, 2) and one and told and ".aeroflutter-" not in found.err

    return "files on a full disk", {n: w.format(disk) for n, w in WRITING.items()}, run, good


QUICK = ("cases", "init", "validate", "rootlocus", "pk", "df", "spring", "import", "onset")
MADE = ("a.nc", "a.zarr", "a.png", "a.svg", "a.json", "a.html", "new.toml", "figures")


# Dask

STUDY = (
    "map", "run100", "--speed-ratio", "0.12:1:60", "--alpha-deg", "-15:15:16", "--json",
)  # fmt: skip


class Dask:
    """A scheduler, and workers with what environment they are given."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.running: list[subprocess.Popen[bytes]] = []
        self.address = ""

    def start(self, *, number: int = 2, **env: str) -> Dask:
        """Begin; `number` workers under a nanny."""
        file = self.folder / "scheduler.json"
        file.unlink(missing_ok=True)
        self._begin("dask_scheduler", "--port", "0", "--host", "127.0.0.1", file=file)
        deadline = time.monotonic() + PATIENCE
        while not self.address:
            with contextlib.suppress(OSError, ValueError):
                self.address = json.loads(file.read_text())["address"]
            assert time.monotonic() < deadline
            time.sleep(0.05)
        if number:
            words = ("--nworkers", str(number), "--nthreads", "1", "--local-directory", self.folder)
            self._begin("dask_worker", *map(str, words), file=file, **env)
        return self

    def _begin(self, name: str, *words: str, file: Path, **env: str) -> None:
        line = [sys.executable, "-m", f"distributed.cli.{name}", "--scheduler-file", str(file)]
        self.running.append(
            subprocess.Popen(
                [*line, "--no-dashboard", *words],
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                env={**os.environ, **env},
            )
        )

    def stop(self) -> None:
        """End what was begun."""
        for process in reversed(self.running):
            process.terminate()
        for process in self.running:
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(20.0)
            process.kill()


def _clusters(folder: Path) -> Iterator[tuple[str, bool]]:
    """Name of a row, and whether the run ended as it should and could be gone on with."""
    whole = folder / "whole.zarr"
    finish([*PROGRAM, *STUDY, "--out", str(whole)])
    wanted = arrays(whole)
    for row, act, lines in (
        ("a worker killed", _worker_killed, None),
        ("the scheduler killed", _scheduler_killed, ("Dask scheduler has gone", "go on with")),
        ("another version at the workers", _other_version, ("runs another version",)),
        ("no package at the workers", _no_package, ("lacks aeroflutter",)),
        ("no workers", _no_workers, ("has no workers",)),
        ("nothing listens", lambda *_: "tcp://127.0.0.1:9", ("no Dask scheduler answers",)),
        ("an HTTP server", _http_server, ("no Dask scheduler answers",)),
        ("a wrong scheme", lambda *_: "http://127.0.0.1:80", ("must be an address",)),
        ("no certificates", lambda *_: "tls://127.0.0.1:80", ("needs certificates",)),
    ):
        if ONLY.startswith("Dask ") and ONLY.removeprefix("Dask ") not in row:
            continue
        store = folder / "dask.zarr"
        shutil.rmtree(store, ignore_errors=True)
        found = _on_cluster(folder, store, act)
        good = found.plain and (found.code == 0 if lines is None else _refused(found, lines))
        resume = ["--resume"] if store.exists() else []
        finish([*PROGRAM, *STUDY, "--out", str(store), *resume])
        same = {name: data == wanted[name] for name, data in arrays(store).items()}
        if not (good and all(same.values())):
            print(f"Dask, {row}: {found} {same}"[:1500], file=sys.stderr, flush=True)
        yield row, good and all(same.values())


def _refused(found: Ran, lines: tuple[str, ...]) -> bool:
    told = [line for line in found.err.splitlines() if line.startswith("aeroflutter: ")]
    return found.code in (1, 2) and len(told) == 1 and all(one in found.err for one in lines)


def _on_cluster(folder: Path, store: Path, act: Callable[[Dask, Path], object]) -> Ran:
    """A map on a scheduler to which something happens."""
    dask = Dask(folder)
    try:
        then = act(dask, folder)
        address = then if isinstance(then, str) else dask.address
        process = subprocess.Popen(
            [*PROGRAM, *STUDY, "--out", str(store), "--scheduler", address],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        if callable(then):
            while process.poll() is None and committed(store) < 2:
                time.sleep(0.01)
            then()
        out, err = process.communicate(timeout=PATIENCE)
        return Ran(process.returncode, out, err)
    finally:
        dask.stop()


def _worker_killed(dask: Dask, folder: Path) -> object:
    dask.start()
    nannies = dask.running[1]
    return lambda: [os.kill(pid, signal.SIGKILL) for pid in workers(nannies)[:1]]


def _scheduler_killed(dask: Dask, folder: Path) -> object:
    dask.start()
    return lambda: dask.running[0].kill()


def _other_version(dask: Dask, folder: Path) -> object:
    other = folder / "other"
    shutil.rmtree(other, ignore_errors=True)
    skip = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "aeroflutter", other / "aeroflutter", ignore=skip)
    with open(other / "aeroflutter" / "springs" / "__init__.py", "a", encoding="utf-8") as file:
        file.write("\n# another version\n")
    return dask.start(PYTHONPATH=str(other)) and None


def _no_package(dask: Dask, folder: Path) -> object:
    empty = folder / "empty"
    (empty / "aeroflutter").mkdir(parents=True, exist_ok=True)
    text = "raise ModuleNotFoundError(\"No module named 'aeroflutter'\")\n"
    (empty / "aeroflutter" / "__init__.py").write_text(text)
    return dask.start(PYTHONPATH=str(empty)) and None


def _no_workers(dask: Dask, folder: Path) -> object:
    return dask.start(number=0) and None


def _http_server(dask: Dask, folder: Path) -> object:
    class Silent(http.server.BaseHTTPRequestHandler):
        def log_message(self, *_: object) -> None: ...

    server = socketserver.ThreadingTCPServer(("127.0.0.1", 0), Silent)
    server.daemon_threads = True
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return f"tcp://127.0.0.1:{server.server_address[1]}"
