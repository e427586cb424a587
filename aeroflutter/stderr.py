"""Lines on stderr, which nobody may hear: a full disk there, or a reader that has gone."""

from __future__ import annotations

import os
import sys

__all__ = ["aside", "silenced"]


def aside(text: str) -> None:
    """Print text on stderr; where that cannot be done, neither it nor what follows is printed."""
    try:
        print(text, file=sys.stderr, flush=True)
    except (OSError, ValueError):  # a full disk, a reader that has gone, a closed stream
        silenced(sys.stderr)


def silenced(stream: object) -> None:
    """Send what is still to be printed nowhere: nor may Python flush it at exit."""
    descriptor = 1 if stream is sys.stdout else 2
    os.dup2(os.open(os.devnull, os.O_WRONLY), descriptor)
