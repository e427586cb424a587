"""What a command line can count on: three open streams, and text that no terminal obeys."""

from __future__ import annotations

import io
import os
import sys

__all__ = ["opened", "printable", "say", "silenced"]


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


def silenced(stream: io.TextIOBase | object) -> None:
    """Send what is still to be printed nowhere: nor may Python flush it at exit."""
    descriptor = 1 if stream is sys.stdout else 2
    os.dup2(os.open(os.devnull, os.O_WRONLY), descriptor)


def printable(text: str) -> str:
    """Text in which control characters are spelt out, so that a terminal does not obey them."""
    return "".join(
        c if c.isprintable() or c == "\n" else c.encode("unicode_escape").decode() for c in text
    )


def say(line: str) -> None:
    """Print a line on stderr, if anyone can hear it."""
    try:
        print(f"aeroflutter: {printable(line)}", file=sys.stderr, flush=True)
    except (OSError, ValueError):  # a full disk, a reader that has gone, a closed stream
        silenced(sys.stderr)
