"""A store on disk (zarr, format 3) that survives whatever happens to the run that writes it.

A block is one chunk of each array. Its arrays are written first and made safe on the disk, and its
commit marker, the SHA-256 of what was written, comes last; every file appears under its name only
when it is complete. A block without a marker, or one that is not as its marker says, was not
computed. Only the process that runs the study writes, and it holds a lock on the store's directory
while it does.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from aeroflutter.disk import synced
from aeroflutter.errors import InputError
from aeroflutter.studies.maps.layout import (
    BROKEN,
    FORMAT,
    blocks_of,
    chunk_of,
    every_file,
    lay_out,
    mended,
)
from aeroflutter.studies.maps.ownership import (
    MARK,
    StoreFull,
    StoreMoved,
    begun,
    check_ours,
    discard,
    exists,
    locked,
    mark_of,
    placed,
    still_there,
    writing,
)
from aeroflutter.studies.maps.study import AnyArray, Outcome, Region, Study, Task

if TYPE_CHECKING:
    import zarr

__all__ = ["MARK", "Store", "StoreFull", "StoreMoved"]

MOST_DIFFERENCES = 8


class Store:
    """Results of a study in a zarr directory; made by `Store.create` and `Store.resume`.

    Attributes
    ----------
    path, study
        Where it is and what it holds.
    mended : tuple of str
        What was found damaged as it was resumed, a line each.
    """

    def __init__(self, path: Path, group: zarr.Group, study: Study, lock: int) -> None:
        self.path, self.study = path, study
        self.mended: tuple[str, ...] = ()
        self._lock = lock
        self._group = group
        self._arrays: dict[str, Any] = {v.name: group[v.name] for v in study.variables}
        self._digests: dict[str, Any] = {p: group[f"blocks/{p}"] for p in study.phases}
        self._seconds: dict[str, Any] = {p: group[f"blocks/{p}_cpu"] for p in study.phases}

    @classmethod
    def create(cls, path: Path, study: Study, *, overwrite: bool = False) -> Store:
        """A new, empty store.

        Raises
        ------
        InputError
            If something is there already (and is no store of ours, or `overwrite` is False), or
            the path cannot be written.
        StoreFull
            If there is no room for it.
        """
        if os.path.lexists(path):
            if not overwrite:
                raise exists(path)
            check_ours(path)
        with writing(path):
            part = begun(path)
            lock = locked(part)
            try:
                lay_out(part, study)
                synced(every_file(part))
                placed(part, path, overwrite=overwrite)
                synced([path.parent])
            except BaseException:
                os.close(lock)
                discard(part)
                raise
            return cls(path, mended(path, study)[0], study, lock)

    @classmethod
    def resume(cls, path: Path, study: Study) -> Store:
        """An existing store, checked: it must hold this very study.

        What is damaged is written anew or, if it is a block, counts as not computed; `mended`
        says what it was.

        Raises
        ------
        InputError
            If there is none, it is foreign, or holds another study; the lines then say what
            differs.
        """
        _check_study(path, study)
        with writing(path):
            lock = locked(path)
            try:
                for part in path.rglob("*.partial"):  # left by a run that was killed as it wrote
                    part.unlink()
                group, lines = mended(path, study)
                store = cls(path, group, study, lock)
                store.mended = (*lines, *store._uncommit_damaged())
                store._forget_failures()
            except BaseException:
                os.close(lock)
                raise
        return store

    def close(self) -> None:
        """Release the lock."""
        os.close(self._lock)

    def done(self, phase: str) -> NDArray[np.bool_]:
        """Whether each block of a phase has been committed."""
        return np.asarray(np.any(self._digests[phase][:] != 0, axis=1))

    def write(self, outcome: Outcome) -> None:
        """Write the arrays of a block, then its commit marker.

        Raises
        ------
        StoreFull
            If there is no room; the block then counts as not computed.
        StoreMoved
            If the store is no longer where it was.
        """
        task = outcome.task
        assert outcome.arrays is not None
        with self._writing():
            names = self._enter(task, outcome.arrays)
            self._make_safe(names, chunk_of(self.study, task.region))
            self._seconds[task.phase][task.number] = outcome.cpu
            self._digests[task.phase][task.number] = _digest(outcome.arrays)
            self._make_safe([f"blocks/{task.phase}"], (task.number, 0))

    def write_failed(self, task: Task, arrays: Mapping[str, AnyArray], what: str, why: str) -> None:
        """Note a block that failed. It is not committed, so that a resumed run tries it again."""
        with self._writing():
            self._enter(task, arrays)
            self._note(failures=[*self.failures, {"block": what, "reason": why}])

    def read(self, name: str, region: Region | None = None) -> AnyArray:
        """One variable, or a region of it."""
        return np.asarray(self._arrays[name][region or ...])

    def put(self, name: str, values: AnyArray) -> None:
        """Replace a whole variable, one that is derived from the others."""
        with self._writing():
            self._arrays[name][...] = values

    def annotate(
        self, attributes: Mapping[str, Any], variables: Mapping[str, tuple[str, str]]
    ) -> None:
        """Attributes of the whole, in JSON's types, and (units, long name) of its variables."""
        with self._writing():
            self._group.attrs.update(dict(attributes))
            for name in (*self._arrays, *self.study.dimensions):
                if name in variables:
                    units, long_name = variables[name]
                    self._group[name].attrs.update({"units": units, "long_name": long_name})

    @property
    def cpu_seconds(self) -> float:
        """CPU time of all committed blocks, those of earlier runs included."""
        return float(sum(np.nansum(seconds[:]) for seconds in self._seconds.values()))

    @property
    def failures(self) -> list[dict[str, str]]:
        """Blocks that failed: what they were and why."""
        return list(self._group.attrs[MARK]["failures"])  # type: ignore[index, call-overload, arg-type]

    def _note(self, **changes: Any) -> None:
        self._group.attrs.update({MARK: {**self._group.attrs[MARK], **changes}})  # type: ignore[dict-item]

    def _forget_failures(self) -> None:
        if self.failures:
            self._note(failures=[])

    def _enter(self, task: Task, arrays: Mapping[str, AnyArray]) -> list[str]:
        """Write the arrays of a block; their names."""
        names = [v.name for v in self.study.variables if v.phase == task.phase]
        for name in names:
            self._arrays[name][task.region] = arrays[name]
        return names

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """A write, with the store where it was both before and after."""
        still_there(self.path, self._lock)
        with writing(self.path):
            yield
        still_there(self.path, self._lock)

    def _make_safe(self, names: Iterable[str], index: Sequence[int]) -> None:
        """Have one chunk of each array reach the disk, and the folders that name them."""
        chunks = [self.path.joinpath(name, "c", *map(str, index)) for name in names]
        folders = {folder for chunk in chunks for folder in list(chunk.parents)[: len(index) + 1]}
        synced([*chunks, *folders])

    def _uncommit_damaged(self) -> list[str]:
        """Take the markers from blocks that are not as committed; a line for each."""
        lines = []
        for phase in self.study.phases:
            markers = _Readable(self._digests[phase])
            arrays = {
                v.name: _Readable(self._arrays[v.name])
                for v in self.study.variables
                if v.phase == phase
            }
            for number, region in enumerate(blocks_of(self.study)):
                try:
                    marker = markers[number]
                    found = {name: array[region] for name, array in arrays.items()}
                    whole = not marker.any() or np.array_equal(marker, _digest(found))
                except BROKEN:
                    whole = False
                if not whole:
                    self._digests[phase][number] = 0
                    self._seconds[phase][number] = np.nan
                    lines.append(f"block {number} of {phase} was damaged; it is computed again")
            lines += self._forget_unreadable_seconds(phase)
        return lines

    def _forget_unreadable_seconds(self, phase: str) -> list[str]:
        """Have no time stand where one cannot be read; no result is lost with it."""
        seconds, lost = _Readable(self._seconds[phase]), 0
        for number, _ in enumerate(blocks_of(self.study)):
            try:
                seconds[number]
            except BROKEN:
                self._seconds[phase][number] = np.nan
                lost += 1
        return [f"the CPU time of {lost} blocks of {phase} was damaged"] if lost else []


class _Readable:
    """An array, read at once if all of it can be, else as far as it can."""

    def __init__(self, array: Any) -> None:
        self.values = array
        with suppress(*BROKEN):
            self.values = np.asarray(array[:])

    def __getitem__(self, region: Any) -> AnyArray:
        return np.asarray(self.values[region])


def _check_study(path: Path, study: Study) -> None:
    """Refuse to resume what is no store, or one of another study."""
    if not os.path.lexists(path):
        raise InputError(f"{path}: there is no store to resume; leave out --resume to begin one")
    mark = mark_of(path)
    if mark is None:
        what = "or damaged beyond knowing" if (path / "zarr.json").exists() else "and no zarr group"
        raise InputError(f"{path}: is no store of aeroflutter, {what}; give another name")
    if mark.get("format") != FORMAT:
        raise InputError(
            f"{path}: has format {mark.get('format')}, this version writes {FORMAT}; "
            "use --overwrite to begin again"
        )
    differences = differing(mark["identity"], study.identity())
    if differences:
        head = f"{path}: holds another study; use another name, or --overwrite to replace it"
        raise InputError([head, *(f"{path}: {line}" for line in differences)])


def differing(stored: Mapping[str, Any], wanted: Mapping[str, Any]) -> list[str]:
    """One line for each key in which two nested records differ, a few at most."""
    old, new = _flat(stored), _flat(wanted)
    keys = [key for key in {**old, **new} if old.get(key) != new.get(key)]
    lines = [
        f"{key} is {_shown(old, key)} in the store, {_shown(new, key)} here"
        for key in keys[:MOST_DIFFERENCES]
    ]
    return lines + (
        [f"and {len(keys) - len(lines)} more differences"] if len(keys) > len(lines) else []
    )


def _flat(record: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for key, value in record.items():
        if isinstance(value, Mapping):
            flat |= _flat(value, f"{prefix}{key}.")
        else:
            flat[f"{prefix}{key}"] = list(value) if isinstance(value, tuple) else value
    return flat


def _shown(record: Mapping[str, Any], key: str) -> str:
    return f"{record[key]!r}" if key in record else "absent"


def _digest(arrays: Mapping[str, AnyArray]) -> NDArray[np.uint8]:
    digest = hashlib.sha256()
    for name in sorted(arrays):
        digest.update(name.encode() + np.ascontiguousarray(arrays[name]).tobytes())
    return np.frombuffer(digest.digest(), dtype=np.uint8)
