"""One line on stderr where compiling takes long, and while it does."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from aeroflutter.stderr import aside

__all__ = ["LONG", "compiling_time", "listen", "noticing"]

LONG = 2.0
"""Seconds of compiling in one command after which the line appears."""

LINE = (
    "aeroflutter: compiling for the first use, once, which takes some seconds "
    "(`aeroflutter warmup` compiles everything beforehand)"
)


class _Notice:
    """Adds up the time in which numba compiles kernels, and speaks once when it is `LONG`."""

    def __init__(self) -> None:
        self.active = False
        self.depth = 0
        self.since = self.spent = 0.0
        self.begun = self.worked = 0.0  # of the processor
        self.timer: threading.Timer | None = None

    def begin(self) -> None:
        """numba starts with a kernel, perhaps for the sake of another one."""
        self.depth += 1
        if self.depth == 1:
            self.since, self.begun = time.monotonic(), time.thread_time()
            if self.active:
                self.timer = threading.Timer(max(LONG - self.spent, 0.0), self.speak)
                self.timer.daemon = True
                self.timer.start()

    def end(self) -> None:
        """numba is done with a kernel, or has failed."""
        self.depth -= 1
        if self.depth == 0:
            self.spent += time.monotonic() - self.since
            self.worked += time.thread_time() - self.begun
            if self.timer is not None:
                self.timer.cancel()
                self.timer = None

    def speak(self) -> None:
        """The line, once."""
        if self.active:
            self.active = False
            aside(LINE)


_NOTICE = _Notice()
_listening: list[Any] = []


def compiling_time() -> float:
    """Seconds of the processor that compiling has taken in this process."""
    return _NOTICE.worked


@contextmanager
def noticing() -> Iterator[None]:
    """Within it, compiling for longer than `LONG` seconds in all is announced on stderr."""
    _NOTICE.active, _NOTICE.spent = True, 0.0
    try:
        yield
    finally:
        _NOTICE.active = False


def listen() -> None:
    """Hear when numba compiles; needed once a process, with the first kernel."""
    if _listening:
        return
    from numba.core import event

    class Listener(event.Listener):
        def on_start(self, event: Any) -> None:
            if _ours(event):
                _NOTICE.begin()

        def on_end(self, event: Any) -> None:
            if _ours(event):
                _NOTICE.end()

    _listening.append(Listener())
    event.register("numba:compile", _listening[0])


def _ours(event: Any) -> bool:
    # What others compile in this process is no concern of this program.
    return event.data["dispatcher"].py_func.__module__.startswith("aeroflutter.")
