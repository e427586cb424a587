"""Mangled inputs over all commands and kinds of file: a line and an exit code, never a traceback.

`python -m benchmarks bench_hostile` tries `TRIES` of them. A case, a model, a table of points, a
store, a certificate or an option is spoilt at random; the command then has to work, to refuse in
lines, or to be cut off where it works on (`PATIENCE`). Exit code 70, any exception that comes out,
and output beside the refusal count as failures, and are printed.
"""

from __future__ import annotations

import contextlib
import io
import os
import random
import shutil
import signal
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

from aeroflutter.case.source import builtin_names
from aeroflutter.cli import COMMANDS, main
from benchmarks import Measurement
from tests.mangled import MUTATIONS, NASTY, VALID

TRIES = int(os.environ.get("HOSTILE_TRIES", "20000"))
PATIENCE = 2.0  # seconds of CPU time after which what works is believed to work
FINE = (0, 1, 2, 3)  # exit codes by which a command says what became of it

QUICK = {
    "validate": (),
    "rootlocus": ("--speed-range", "1:2"),
    "simulate": ("--speed", "1", "--duration", "20"),
    "df": ("--points", "5"),
    "map": ("--speed", "1,2", "--alpha-deg", "1,2", "--workers", "0", "--duration", "20"),
}
OUTSIDE = ("warmup", "reproduce", "cases")  # they take no case


class Enough(BaseException):
    """A command that works on."""


def measure() -> Iterator[Measurement]:
    """How many were tried, how many of them ended wrong."""
    chance = random.Random(2026)
    found: Counter[str] = Counter()
    signal.signal(signal.SIGPROF, _ring)
    with tempfile.TemporaryDirectory() as name, contextlib.chdir(name):
        ways = _ways(Path(name))
        for number in range(TRIES):
            kind = list(ways)[number % len(ways)]
            words = ways[kind](chance)
            outcome = _tried(words)
            found[outcome] += 1
            if outcome.startswith("WRONG"):
                print(kind, outcome, [word[:200] for word in words], file=sys.stderr)
    wrong = sum(count for outcome, count in found.items() if outcome.startswith("WRONG"))
    yield Measurement("mangled inputs", TRIES, "")
    for outcome in ("worked", "refused", "cut off"):
        yield Measurement(f"of them {outcome}", found[outcome], "")
    yield Measurement("tracebacks, exit code 70, stray output", wrong, "", target=0)


def _ring(*_: object) -> None:
    raise Enough


def _tried(words: list[str]) -> str:
    """What became of one command line."""
    out, err = io.StringIO(), io.StringIO()
    signal.setitimer(signal.ITIMER_PROF, PATIENCE)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = main(words)
    except Enough:
        return "cut off"
    except BaseException as error:  # noqa: BLE001 - that is what is looked for
        return f"WRONG {type(error).__name__}: {error}"
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
    if code not in FINE or "Traceback" in err.getvalue():
        return f"WRONG exit code {code}: {err.getvalue()[-300:]}"
    if code == 2 and words[0] != "validate" and out.getvalue():
        return f"WRONG stdout of a refusal: {out.getvalue()[:100]}"
    return "worked" if code == 0 else "refused"


def _ways(folder: Path) -> dict[str, Callable[[random.Random], list[str]]]:
    """By kind of input: something that writes one and gives a command line that reads it."""
    models = sorted((Path(__file__).parents[1] / "tests" / "data").glob("*.op4"))
    store = folder / "whole.zarr"
    main(["map", "linear-02", *QUICK["map"], "--out", str(store), "--json"])

    def case(chance: random.Random) -> list[str]:
        text = _mangled(chance.choice(VALID).encode(), chance)
        (folder / "case.toml").write_bytes(text)
        command = chance.choice(list(QUICK))
        return [command, "case.toml", *QUICK[command], "--json"]

    def option(chance: random.Random) -> list[str]:
        command = chance.choice([name for name in COMMANDS if name not in OUTSIDE])
        key = chance.choice(["--set", *_options(command)])
        value = chance.choice(NASTY)
        if key == "--set":
            value = f"{chance.choice(['section.mu', 'spring.kind', 'spring', 'a.b', ''])}={value}"
        return [command, chance.choice(builtin_names()), key, value.replace("\0", "")]

    def points(chance: random.Random) -> list[str]:
        text = b"speed_ratio,amplitude_deg\n" + b"0.5,1.0\n0.6,2.0\n" * 20
        (folder / "points.csv").write_bytes(_mangled(text, chance))
        return ["lco", "run14", "--points-csv", "points.csv", "--plot", "points.txt"]

    def model(chance: random.Random) -> list[str]:
        (folder / "model.op4").write_bytes(_mangled(chance.choice(models).read_bytes(), chance))
        return ["import", "model.op4", "-o", "model.toml"]

    def kept(chance: random.Random) -> list[str]:
        spoilt = folder / "spoilt.zarr"
        shutil.rmtree(spoilt, ignore_errors=True)
        shutil.copytree(store, spoilt)
        files = [file for file in sorted(spoilt.rglob("*")) if file.is_file()]
        for file in chance.sample(files, chance.randint(1, 3)):
            if chance.random() < 0.3:
                file.unlink()
            else:
                file.write_bytes(_mangled(file.read_bytes(), chance))
        how = chance.choice(["--resume", "--overwrite"])
        return ["map", "linear-02", *QUICK["map"], "--out", str(spoilt), how, "--json"]

    ways = {"case": case, "option": option, "points": points, "store": kept}
    if models and "import" in COMMANDS:
        ways["model"] = model
    return ways


def _options(command: str) -> list[str]:
    """Names of the options of a command, by its help."""
    if command not in _KNOWN:
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            main([command, "--help"])
        words = {word.strip(",") for word in out.getvalue().split() if word.startswith("--")}
        _KNOWN[command] = sorted(word for word in words if word not in ("--help", "--version"))
    return _KNOWN[command]


_KNOWN: dict[str, list[str]] = {}


def _mangled(data: bytes, chance: random.Random) -> bytes:
    """Lines dropped, doubled, cut, spoilt; bytes flipped; or anything at all."""
    if chance.random() < 0.05:
        return chance.randbytes(chance.randrange(200))
    lines = data.decode("latin-1").split("\n")
    for _ in range(chance.randint(0, 4)):
        change = chance.choice(MUTATIONS)
        lines = change(lines, chance.randrange(len(lines)), chance.randrange(0x2FFF)) or [""]
    spoilt = bytearray("\n".join(lines).encode("utf-8", "surrogatepass"))
    for _ in range(chance.choice([0, 0, 1, 3]) if spoilt else 0):
        spoilt[chance.randrange(len(spoilt))] = chance.randrange(256)
    return bytes(spoilt)
