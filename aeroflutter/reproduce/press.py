"""Making exhibits and keeping them: what is there and still valid is not made again."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

from aeroflutter.case import Case, load_case
from aeroflutter.files import replacing
from aeroflutter.kernels.warmup import warm_up
from aeroflutter.reproduce import figures
from aeroflutter.reproduce.catalogue import Exhibit
from aeroflutter.studies.maps.executors import Processes
from aeroflutter.studies.maps.fingerprint import code_hash
from aeroflutter.studies.maps.study import Outcome, Task

__all__ = ["Printed", "reproduce"]


@dataclass(frozen=True, kw_only=True)
class Printed:
    """An exhibit on file.

    Attributes
    ----------
    exhibit
        What it is.
    file
        The figure or table.
    caption
        Caption with the facts.
    facts
        Numbers behind the caption.
    fresh
        Whether it was made now, and not taken as it was.
    problem
        Why it could not be made; empty if it could.
    """

    exhibit: Exhibit
    file: Path
    caption: str = ""
    facts: dict[str, Any]
    fresh: bool
    problem: str = ""


def reproduce(
    exhibits: Iterable[Exhibit],
    folder: Path,
    *,
    suffix: str = ".svg",
    workers: int = 2,
    again: bool = False,
    progress: Callable[[Printed], None] | None = None,
) -> list[Printed]:
    """Make the exhibits into a folder; those that are there from the same code are kept.

    Every finished exhibit is on disk before the next begins, so an interrupted run goes on where
    it stopped. One that fails says so and does not keep the others from being made.

    Parameters
    ----------
    exhibits
        Some of `EXHIBITS`.
    folder
        Where they go; it is created.
    suffix
        ".svg", ".pdf" or ".png".
    workers
        Processes that work side by side.
    again
        Make also those that are there.
    progress
        Called with each exhibit as it is finished.
    """
    folder.mkdir(parents=True, exist_ok=True)
    wanted = list(exhibits)
    # Figures of one case share its map and curve, so they go to one worker.
    jobs = [list(group) for _, group in groupby(wanted, key=lambda e: (e.case, str(e.changes)))]
    done: dict[str, Printed] = {}

    def finished(group: list[Printed]) -> None:
        for one in group:
            done[one.exhibit.number] = one
            if progress:
                progress(one)

    if workers <= 1 or len(jobs) == 1:
        for job in jobs:
            finished(_print_group(job, folder, suffix, again))
    else:
        warm_up()  # or each process would compile
        press = _Press(folder, suffix, again, jobs)
        tasks = [Task("exhibits", number, ()) for number in range(len(jobs))]
        for outcome in Processes(workers).run(press, tasks):
            finished(press.made(outcome))
    return [done[exhibit.number] for exhibit in wanted]


@dataclass(frozen=True)
class _Press:
    """The jobs as a study, so that a worker that dies costs its own job and no other."""

    folder: Path
    suffix: str
    again: bool
    jobs: list[list[Exhibit]]

    def warm_up(self) -> None: ...

    def compute(self, task: Task) -> dict[str, Any]:
        """One job; it goes on where a worker that died at it stopped."""
        job = self.jobs[task.number]
        return {"made": _print_group(job, self.folder, self.suffix, self.again)}

    def made(self, outcome: Outcome) -> list[Printed]:
        """The exhibits of a job, those of one that was given up with the reason."""
        if outcome.arrays is not None:
            made: Any = outcome.arrays["made"]
            return list(made)
        return [
            _failed(exhibit, _file(exhibit, self.folder, self.suffix), str(outcome.failure))
            for exhibit in self.jobs[outcome.task.number]
        ]


def _failed(exhibit: Exhibit, file: Path, problem: str) -> Printed:
    return Printed(exhibit=exhibit, file=file, facts={}, fresh=True, problem=problem)


def _file(exhibit: Exhibit, folder: Path, suffix: str) -> Path:
    return folder / (exhibit.name + (".md" if exhibit.kind == "onsets" else suffix))


def _print_group(group: list[Exhibit], folder: Path, suffix: str, again: bool) -> list[Printed]:
    return [_print(exhibit, folder, suffix, again) for exhibit in group]


def _print(exhibit: Exhibit, folder: Path, suffix: str, again: bool) -> Printed:
    case = load_case(exhibit.case, exhibit.changes)
    file = _file(exhibit, folder, suffix)
    record = folder / f"{exhibit.name}.json"
    identity = _identity(exhibit, case)
    kept = None if again else _kept(record, file, identity, exhibit)
    if kept is not None:
        return Printed(
            exhibit=exhibit, file=file, caption=kept["caption"], facts=kept["facts"], fresh=False
        )
    try:
        drawn = figures.KINDS[exhibit.kind](case, exhibit.title, **exhibit.settings)
    except Exception as error:  # noqa: BLE001 - the other exhibits are still to be made
        return _failed(exhibit, file, f"{type(error).__name__}: {error}")
    from aeroflutter.plots.style import save

    caption = exhibit.sentence(drawn.facts)
    with replacing(file) as part:
        if drawn.figure is not None:
            save(drawn.figure, part)
        else:
            part.write_text(drawn.table, encoding="utf-8")
    kept = {"identity": identity, "caption": caption, "facts": drawn.facts, "file": _digest(file)}
    with replacing(record) as part:
        part.write_text(json.dumps(kept, indent=1), encoding="utf-8")
    return Printed(exhibit=exhibit, file=file, caption=caption, facts=drawn.facts, fresh=True)


def _identity(exhibit: Exhibit, case: Case) -> str:
    """Hash of all that the exhibit depends on."""
    parts = json.dumps([asdict(exhibit), case.text, code_hash(__name__)], sort_keys=True)
    return hashlib.sha256(parts.encode()).hexdigest()


def _digest(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


def _kept(record: Path, file: Path, identity: str, exhibit: Exhibit) -> dict[str, Any] | None:
    """What was written of an exhibit made before, if it is still the same one."""
    try:
        kept = json.loads(record.read_text(encoding="utf-8"))
        same = kept["identity"] == identity and kept["file"] == _digest(file)
        told = isinstance(kept["facts"], dict) and exhibit.sentence(kept["facts"])
        whole = kept["caption"] == told
        return {"caption": kept["caption"], "facts": kept["facts"]} if same and whole else None
    except (OSError, ValueError, KeyError, TypeError):
        return None
