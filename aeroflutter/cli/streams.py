"""What a command line can count on: open streams, text that no terminal obeys, a way to end."""

from __future__ import annotations

import contextlib
import io
import os
import signal
import sys
import threading
from collections.abc import Iterator

from aeroflutter.stderr import aside

__all__ = ["Terminated", "opened", "printable", "say", "terminable"]


LONGEST = 800  # characters of a line that somebody is to read


def opened() -> None:
    """Give a stream that was closed, or left out, the null device.

    Otherwise the first file that is opened takes the place of the stream, and is written to by
    whoever believes to print.
    """
    for descriptor, name, mode in ((0, "stdin", "r"), (1, "stdout", "w"), (2, "stderr", "w")):
        try:
            os.fstat(descriptor)
        except OSError:
            null = os.open(os.devnull, os.O_RDWR)
            if null != descriptor:
                os.dup2(null, descriptor)
                os.close(null)
        if getattr(sys, name) is None:
            setattr(sys, name, open(descriptor, mode, encoding="utf-8", closefd=False))  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a terminal without UTF-8 still gets its text
            stream.reconfigure(errors="backslashreplace")


def printable(text: str) -> str:
    """Text in which control characters are spelt out, so that a terminal does not obey them."""
    return "".join(
        c if c.isprintable() or c == "\n" else c.encode("unicode_escape").decode() for c in text
    )


def say(line: str) -> None:
    """Print a line on stderr, one whatever is in it, if anyone can hear it."""
    text = printable(line).replace("\n", "\\n")
    if len(text) > LONGEST:  # what was given, repeated; the remedy stands at the end
        text = f"{text[: LONGEST // 2]} … {text[-LONGEST // 2 :]}"
    aside(f"aeroflutter: {text}")


class Terminated(KeyboardInterrupt):
    """A request to end, as of a batch system whose time is up: answered as Ctrl-C is."""


@contextlib.contextmanager
def terminable() -> Iterator[None]:
    """Have SIGTERM raise `Terminated`, so that a command can say how to go on.

    Who has an answer of their own to it, or calls from another thread, keeps it.
    """
    alone = threading.current_thread() is threading.main_thread()
    if not alone or signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL:
        yield
        return

    def answer(*_: object) -> None:
        raise Terminated

    signal.signal(signal.SIGTERM, answer)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
