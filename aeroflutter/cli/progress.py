"""Progress of long runs on stderr: a bar on a terminal, plain lines elsewhere."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

from aeroflutter.stderr import aside

if TYPE_CHECKING:
    from aeroflutter.studies.maps import Progress

FIRST, OFTEN = 5.0, 10.0  # seconds until the first plain line, and between two
PATIENCE = 2.0  # seconds before a bar of one long run appears

Report = Callable[["Progress"], None]


def pace(rate: float, unit: str) -> str:
    """How fast things are done, or, where it is less than one a second, how long one takes."""
    if rate >= 10.0:
        return f"{rate:,.0f} {unit}/s"
    return f"{rate:.1f} {unit}/s" if rate >= 1.0 else f"{1.0 / rate:.3g} s for one of the {unit}"


@contextlib.contextmanager
def progress(unit: str) -> Iterator[Report]:
    """Somewhere to report progress, with the rate in `unit` a second and the time left."""
    if sys.stderr.isatty():
        with _bar(unit) as report:
            yield report
    else:
        yield _Lines(unit)


@contextlib.contextmanager
def _bar(unit: str) -> Iterator[Report]:
    from rich.console import Console
    from rich.progress import BarColumn, TaskID, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:,.0f}/{task.total:,.0f}"),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(),
    )
    tasks: dict[str, tuple[TaskID, float]] = {}
    with Bar(*columns, console=Console(stderr=True), transient=True) as bar:

        def report(state: Progress) -> None:
            if state.phase not in tasks:
                name = bar.add_task(state.phase, total=state.total, rate="")
                tasks[state.phase] = name, time.monotonic()
            name, begin = tasks[state.phase]
            rate = state.done / max(time.monotonic() - begin, 1e-9)
            text = pace(rate, unit) if state.done else ""
            bar.update(name, completed=state.before + state.done, rate=text)

        yield report


class _Lines:
    """A line now and then, for logs."""

    def __init__(self, unit: str) -> None:
        self.unit = unit
        self.phase = ""
        self.begin = self.next = 0.0

    def __call__(self, state: Progress) -> None:
        now = time.monotonic()
        if state.phase != self.phase:
            self.phase, self.begin, self.next = state.phase, now, now + FIRST
            if state.before:
                aside(f"{state.phase}: {state.before:,} done before")
        if now < self.next or state.done == 0:
            return
        self.next = now + OFTEN
        rate = state.done / (now - self.begin)
        left = (state.total - state.before - state.done) / rate
        aside(
            f"{state.phase}: {state.before + state.done:,} of {state.total:,} {self.unit}, "
            f"{pace(rate, self.unit)}, {left:.0f} s left"
        )


@contextlib.contextmanager
def counting(unit: str) -> Iterator[Callable[[object], None]]:
    """Something to call with every result of a search of unknown length: counts them on stderr."""
    count, then = 0, time.monotonic() + FIRST

    def tick(_: object) -> None:
        nonlocal count, then
        count += 1
        if time.monotonic() > then:
            then = time.monotonic() + OFTEN
            aside(f"{count:,} {unit} so far")

    yield tick


@contextlib.contextmanager
def late_bar(label: str) -> Iterator[Callable[[float], None]]:
    """A progress bar on a terminal that appears when the work takes longer than `PATIENCE`.

    It appears by the clock: the first use of an engine compiles it, which tells nothing of its
    progress.

    Yields
    ------
    callable
        To be called now and then with the fraction done.
    """
    from threading import Timer

    bars: list[Any] = []

    def show() -> None:
        bar = _percents()
        bar.add_task(label, total=1.0)
        bar.start()
        bars.append(bar)

    def tick(fraction: float) -> None:
        for bar in bars:
            bar.update(bar.task_ids[0], completed=fraction)

    timer = Timer(PATIENCE, show)
    timer.daemon = True
    if sys.stderr.isatty():
        timer.start()
    try:
        yield tick
    finally:
        timer.cancel()
        if timer.is_alive():
            timer.join()  # it may be about to show the bar
        for bar in bars:
            bar.stop()


def _percents() -> Any:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeRemainingColumn(),
        console=Console(stderr=True),
        transient=True,
    )
