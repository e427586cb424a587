"""Whose a directory is: stores are made exclusively, locked while written, deleted by file.

A directory is a store of ours if the attribute that says so can be parsed, from its root or from
the copy in `blocks`. What may be deleted is what such a store consists of, by a listing of it;
a file of anyone else in it stops the deletion.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import json
import os
import re
import signal
import threading
import time
import uuid
from collections.abc import Collection, Iterator
from pathlib import Path
from types import FrameType
from typing import Any

from aeroflutter.disk import ABANDONED
from aeroflutter.errors import AeroflutterError, InputError

__all__ = [
    "MARK",
    "StoreFull",
    "StoreMoved",
    "begun",
    "check_ours",
    "discard",
    "exists",
    "locked",
    "mark_of",
    "placed",
    "still_there",
    "writing",
]

MARK = "aeroflutter_study"  # attribute by which a store is known to be one of ours
COPY = "blocks"  # the group that holds it once more
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)

_METADATA = "zarr.json"
_PART = re.compile(r"\.aeroflutter-[0-9a-f]{32}\.part")
_UNFINISHED = re.compile(r".*\.[0-9a-f]{32}\.partial")


class StoreFull(OSError):
    """The disk, a quota or a limit on the size of files stopped a write."""


class StoreMoved(AeroflutterError):
    """A store was renamed or removed while a run wrote to it."""


def mark_of(path: Path) -> dict[str, Any] | None:
    """What the attribute of a store says, from its root or its copy; None if it is no store."""
    for metadata in (path / _METADATA, path / COPY / _METADATA):
        with contextlib.suppress(OSError, ValueError, AttributeError, RecursionError):
            mark = json.loads(metadata.read_bytes()).get("attributes", {}).get(MARK)
            if isinstance(mark, dict) and isinstance(mark.get("identity"), dict):
                return mark
    return None


def begun(path: Path) -> Path:
    """A new, empty directory beside `path`, in which its store is laid out."""
    for left in path.parent.glob(".aeroflutter-*.part"):
        _clear(left)
    part = path.with_name(f".aeroflutter-{uuid.uuid4().hex}.part")
    part.mkdir()
    return part


def _clear(part: Path) -> None:
    """Delete what a run left that was killed while it laid out its store."""
    with contextlib.suppress(OSError, InputError):
        if _PART.fullmatch(part.name) and time.time() - part.stat().st_mtime > ABANDONED:
            os.close(locked(part))
            discard(part)


def placed(part: Path, path: Path, *, overwrite: bool) -> None:
    """Give a store that is laid out its name, which must be free or may be overwritten.

    Raises
    ------
    InputError
        If something is there that is not to be overwritten, or not ours to overwrite.
    """
    if overwrite and os.path.lexists(path):
        _replace(part, path)
        return
    try:
        if os.path.lexists(path):  # even an empty folder is somebody's
            raise FileExistsError
        part.rename(path)  # never onto a folder that holds anything
    except OSError as error:
        if error.errno in (None, errno.EEXIST, errno.ENOTEMPTY, errno.ENOTDIR):
            raise exists(path) from error
        raise


def exists(path: Path) -> InputError:
    """That a name is taken."""
    return InputError(
        f"{path}: exists; give another name, --resume to go on with it, or --overwrite to "
        "replace it"
    )


def _replace(part: Path, path: Path) -> None:
    """Put a store in the place of another one, which is deleted."""
    check_ours(path)
    lock = locked(path)
    try:
        old = begun(path)
        path.rename(old)
        part.rename(path)
        discard(old)
    finally:
        os.close(lock)


def check_ours(path: Path) -> None:
    """Refuse to touch anything but a store of ours that holds nothing else.

    Raises
    ------
    InputError
        With what is there instead, or besides.
    """
    mark = None if path.is_symlink() or not path.is_dir() else mark_of(path)
    if mark is None:
        raise InputError(f"{path}: is no store of aeroflutter, so it is not overwritten; remove it")
    for file in _files(path):
        if not _ours(file.relative_to(path), mark.get("arrays")):
            raise InputError(
                f"{path}: holds {file.relative_to(path)}, which is not of a store, so it is not "
                "overwritten; move that file away"
            )


def discard(path: Path) -> None:
    """Delete the files of a store, and the folders that are empty then; nothing else."""
    for file in list(_files(path)):
        if _ours(file.relative_to(path)):
            file.unlink(missing_ok=True)
    for folder, _, _ in os.walk(path, topdown=False):
        with contextlib.suppress(OSError):  # someone put something there
            Path(folder).rmdir()


def _files(path: Path) -> Iterator[Path]:
    for folder, folders, names in os.walk(path):
        yield from (Path(folder, name) for name in names)
        yield from (Path(folder, name) for name in folders if Path(folder, name).is_symlink())


def _ours(relative: Path, arrays: Collection[str] | None = None) -> bool:
    """Whether a store has such a file: metadata, a chunk c/0/1 of an array, or half of either."""
    *folders, name = relative.parts
    metadata = name == _METADATA or _UNFINISHED.fullmatch(name) is not None
    if folders[:1] == [COPY]:
        folders, arrays = folders[1:], None
    if not folders:
        return metadata
    array, *inside = folders
    if arrays is not None and array not in arrays:
        return False
    if not inside:
        return metadata
    chunk = [*inside[1:], *([] if metadata else [name])]
    return inside[0] == "c" and all(part.isdigit() for part in chunk)


def locked(path: Path) -> int:
    """Lock a directory for as long as the returned descriptor is open.

    Raises
    ------
    InputError
        If another run holds it.
    """
    descriptor = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        still_there(path, descriptor)  # it may have been replaced between the two lines
    except (BlockingIOError, StoreMoved):
        os.close(descriptor)
        raise InputError(f"{path}: another run is writing to it; wait, or end that one") from None
    return descriptor


def still_there(path: Path, lock: int) -> None:
    """Refuse to write where the store is no more.

    Raises
    ------
    StoreMoved
        If the directory of that name is not the one that was locked.
    """
    with contextlib.suppress(FileNotFoundError, NotADirectoryError):
        if os.path.samestat(os.stat(path), os.fstat(lock)):
            return
    raise StoreMoved(
        f"{path}: was renamed or removed while the run wrote to it; the blocks written before are "
        "where it went: go on there with --resume"
    )


@contextlib.contextmanager
def writing(path: Path) -> Iterator[None]:
    """Say plainly what stopped a write; Ctrl-C and SIGTERM wait until its end."""
    try:
        with _unbroken():
            yield
    except StoreFull:
        raise
    except OSError as error:
        if error.errno in FULL:
            raise StoreFull(error.errno, f"{path}: no room to write: {error.strerror}") from error
        raise InputError(f"{path}: cannot be written: {error.strerror or error}") from error


@contextlib.contextmanager
def _unbroken() -> Iterator[None]:
    """Hold back what would stop a write: amid threads of zarr it can leave a lock for ever."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {which: signal.getsignal(which) for which in (signal.SIGINT, signal.SIGTERM)}
    answers = {which: answer for which, answer in before.items() if callable(answer)}
    came: list[tuple[int, FrameType | None]] = []
    for which in answers:
        signal.signal(which, lambda *one: came.append(one))
    try:
        yield
    finally:
        for which, answer in answers.items():
            signal.signal(which, answer)
        if came:
            answers[signal.Signals(came[0][0])](*came[0])
