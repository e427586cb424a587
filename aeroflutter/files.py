"""Files written whole or not at all."""

from __future__ import annotations

import os
import re
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from aeroflutter.disk import ABANDONED, synced
from aeroflutter.errors import InputError
from aeroflutter.limits import limit

_PART = re.compile(r"\.aeroflutter-[0-9a-f]{32}\.part(\.\w+)?")


def read_bytes(path: Path, label: str) -> bytes:
    """A whole file, as long as it is of reasonable size: it may be a device that never ends.

    Parameters
    ----------
    path
        The file.
    label
        What names it, as the line of a refusal begins.

    Raises
    ------
    InputError
        If it cannot be read, or is larger than the limit `bytes`.
    """
    most = limit("bytes")
    try:
        with open(path, "rb") as file:
            data = file.read(most + 1)
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"{label}: cannot be read: {reason}") from None
    if len(data) > most:
        raise InputError(f"{label}: is larger than {most} bytes, which is the limit for a file")
    return data


def _clear(folder: Path) -> None:
    """Delete what runs left that were killed as they wrote, an hour later."""
    with suppress(OSError):
        for left in folder.glob(".aeroflutter-*.part*"):
            mine = _PART.fullmatch(left.name) is not None and left.is_file()
            if mine and time.time() - left.lstat().st_mtime > ABANDONED:
                left.unlink(missing_ok=True)


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary path beside `path` to write to; it takes the place of `path` on success.

    A reader never sees half a file, and a run that fails leaves an older file alone; nor does a
    loss of power, since what is written is on the disk before it has the name. The temporary name
    keeps the suffix, since writers choose their format by it.

    Raises
    ------
    InputError
        If the file cannot be written; the message names it and says why.
    """
    part = path.with_name(f".aeroflutter-{uuid.uuid4().hex}.part{path.suffix}")
    _clear(path.parent)
    try:
        yield part
        synced([part])
        os.replace(part, path)
        with suppress(OSError):  # a folder that may be written to and not read
            synced([path.parent])
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror or error}") from error
    finally:
        part.unlink(missing_ok=True)
