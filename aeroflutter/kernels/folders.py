"""The folders of the cache: where they are, which are in use, which may go."""

from __future__ import annotations

import os
import re
import sys
import time
from contextlib import suppress
from pathlib import Path

__all__ = ["MOST_FOLDERS", "claim", "prune", "touch", "user_folder"]

MARKER = "made-by-aeroflutter.txt"
"""A folder is ours if it holds this file; the time of the file says when it was last used."""

MARKER_TEXT = "Machine code of aeroflutter, made again when it is missing: this folder may go.\n"
OURS = re.compile(r"[0-9a-f]{32}")
FILES = ("*.code", "*.code.*.part", "*.spent")
MOST_FOLDERS = 8
LONGEST_UNUSED = 30 * 86400.0
SHORTEST_UNUSED = 3600.0
"""Seconds: a folder used within the last hour stays, whatever their number; someone may be
filling it."""


def user_folder() -> Path | None:
    """The user's folder for caches of this program, or None where the user has no home.

    XDG_CACHE_HOME or ~/.cache; ~/Library/Caches on macOS; LOCALAPPDATA on Windows.
    """
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA", "")
    elif sys.platform == "darwin":
        base = _at_home("Library/Caches")
    else:
        base = os.environ.get("XDG_CACHE_HOME", "")
        if not os.path.isabs(base):  # to be ignored then, says the XDG specification
            base = _at_home(".cache")
    return Path(base) / "aeroflutter" if os.path.isabs(base) else None


def _at_home(name: str) -> str:
    # Without a home expanduser leaves the tilde, and a folder of that name would be made here;
    # with an empty one it takes the root of the file system.
    return "" if os.environ.get("HOME") == "" else os.path.expanduser(f"~/{name}")


def claim(folder: Path) -> None:
    """Make a folder and mark it as ours; where it is new, let old ones go.

    Raises
    ------
    OSError
        If it cannot be made or written.
    """
    marker = folder / MARKER
    if not marker.exists():
        folder.mkdir(parents=True, exist_ok=True)
        marker.write_text(MARKER_TEXT, encoding="utf-8")
        prune(folder.parent, keep=folder)


def touch(folder: Path) -> None:
    """Note that a folder is in use; nothing where it cannot be written."""
    with suppress(OSError):
        os.utime(folder / MARKER)


def prune(parent: Path, keep: Path) -> None:
    """Delete folders of ours that have not been used for long, or are too many.

    A folder goes only if it carries our kind of name and our marker, and out of it only our kinds
    of files; one with anything else in it stays, with its marker. Several processes may prune at
    once, and die while they do.

    Parameters
    ----------
    parent
        Folder of the folders.
    keep
        The one that stays in any case.
    """
    now = time.time()
    used = []
    with suppress(OSError):
        for folder in parent.iterdir():
            if OURS.fullmatch(folder.name) and folder != keep and not folder.is_symlink():
                with suppress(OSError):  # not ours, or gone meanwhile
                    used.append((now - (folder / MARKER).stat().st_mtime, folder))
    for place, (idle, folder) in enumerate(sorted(used), start=2):
        if idle > LONGEST_UNUSED or (place > MOST_FOLDERS and idle > SHORTEST_UNUSED):
            with suppress(OSError):
                _delete(folder)


def _delete(folder: Path) -> None:
    for pattern in FILES:
        for file in folder.glob(pattern):
            file.unlink(missing_ok=True)
    if all(entry.name == MARKER for entry in folder.iterdir()):
        (folder / MARKER).unlink(missing_ok=True)
        folder.rmdir()
