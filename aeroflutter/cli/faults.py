"""A fault of the program itself: one line for the user, everything else in a file to send."""

from __future__ import annotations

import platform
import sys
import tempfile
import traceback
from collections.abc import Sequence

from aeroflutter import __version__
from aeroflutter.cli.streams import say

__all__ = ["reported"]

WHERE = "the project's issue tracker"


def reported(error: BaseException, words: Sequence[str]) -> None:
    """Say that the program is at fault, and keep what its authors need to know.

    Parameters
    ----------
    error
        What came out of a command.
    words
        The command line.
    """
    story = _story(error, words)
    what = " ".join(f"{type(error).__name__}: {error}".split())[:200]
    try:
        with tempfile.NamedTemporaryFile(
            "w", prefix="aeroflutter-", suffix=".txt", delete=False, encoding="utf-8",
            errors="backslashreplace",
        ) as file:  # fmt: skip
            file.write(story)
    except OSError:
        say(f"this is a fault of the program ({what}); please report it with all of this:")
        for line in story.splitlines():
            say(line)
        return
    say(f"this is a fault of the program ({what}); please report it with the file {file.name}")


def _story(error: BaseException, words: Sequence[str]) -> str:
    from importlib.metadata import PackageNotFoundError, version

    def known(name: str) -> str:
        try:
            return f"{name} {version(name)}"
        except PackageNotFoundError:
            return f"{name} -"

    libraries = ("numpy", "scipy", "numba", "matplotlib", "xarray", "netcdf4", "zarr", "pydantic")
    return "\n".join([
        f"aeroflutter {__version__}, Python {platform.python_version()}, {platform.platform()}",
        ", ".join(map(known, libraries)),
        f"command: {list(words)!r}",
        f"optimised: {sys.flags.optimize}, warnings: {sys.warnoptions}",
        "",
        "".join(traceback.format_exception(error)),
    ])  # fmt: skip
