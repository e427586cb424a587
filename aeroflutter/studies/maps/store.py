"""A store on disk (zarr, format 3) that survives whatever happens to the run that writes it.

A block is a whole number of chunks. Its arrays are written first and its commit marker, the SHA-256
of what was written, last; every file appears under its name only when it is complete. A block
without a marker was not computed. Only the process that runs the study writes, and it holds a
lock on the store's directory while it does.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import hashlib
import os
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from aeroflutter.errors import InputError
from aeroflutter.studies.maps.results import shape_of
from aeroflutter.studies.maps.study import AnyArray, Outcome, Region, Study, Task

if TYPE_CHECKING:
    import zarr

__all__ = ["Store", "StoreFull"]

MARK = "aeroflutter_study"  # attribute by which a store is known to be one of ours
FORMAT = 1
MOST_DIFFERENCES = 8
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


class StoreFull(OSError):
    """The disk, a quota or a limit on the size of files stopped a write."""


class Store:
    """Results of a study in a zarr directory; made by `Store.create` and `Store.resume`."""

    def __init__(self, path: Path, group: zarr.Group, study: Study, lock: int) -> None:
        self.path, self.study = path, study
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
        if path.exists():
            if not overwrite:
                raise InputError(
                    f"{path}: exists; give another name, --resume to go on with it, "
                    "or --overwrite to replace it"
                )
            _check_ours(path)
        with _writing(path):
            part = path.with_name(f".{path.name}.part")
            if part.exists():  # left by a run that was killed while it laid out its store
                _remove(part)
            part.mkdir()
            lock = _locked(part)
            try:
                _lay_out(part, study)
                if path.exists():
                    _remove(path)
                part.rename(path)
            except BaseException:
                os.close(lock)
                shutil.rmtree(part, ignore_errors=True)
                raise
            return cls(path, _opened(path), study, lock)

    @classmethod
    def resume(cls, path: Path, study: Study) -> Store:
        """An existing store, checked: it must hold this very study, every committed block intact.

        Raises
        ------
        InputError
            If there is none, it is foreign or damaged, or holds another study; the lines then
            say what differs.
        """
        group = _opened(path)
        stored: Any = group.attrs[MARK]
        differences = differing(stored["identity"], study.identity())
        if differences:
            head = f"{path}: holds another study; use another name, or --overwrite to replace it"
            raise InputError([head, *(f"{path}: {line}" for line in differences)])
        lock = _locked(path)
        try:
            store = cls(path, group, study, lock)
            store._check()
        except (KeyError, ValueError, TypeError, RuntimeError, OSError) as error:
            os.close(lock)
            raise _damaged(path, f"{type(error).__name__}: {error}") from error
        except InputError:
            os.close(lock)
            raise
        for part in path.rglob("*.partial"):  # left by a run that was killed while it wrote
            part.unlink()
        store._forget_failures()
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
        """
        task = outcome.task
        assert outcome.arrays is not None
        with _writing(self.path):
            for name, values in self._of_phase(task.phase, outcome.arrays).items():
                self._arrays[name][task.region] = values
            self._seconds[task.phase][task.number] = outcome.cpu
            self._digests[task.phase][task.number] = _digest(outcome.arrays)

    def write_failed(self, task: Task, arrays: Mapping[str, AnyArray], what: str, why: str) -> None:
        """Note a block that failed. It is not committed, so that a resumed run tries it again."""
        with _writing(self.path):
            for name, values in self._of_phase(task.phase, arrays).items():
                self._arrays[name][task.region] = values
            self._note(failures=[*self.failures, {"block": what, "reason": why}])

    def read(self, name: str, region: Region | None = None) -> AnyArray:
        """One variable, or a region of it."""
        return np.asarray(self._arrays[name][region or ...])

    def put(self, name: str, values: AnyArray) -> None:
        """Replace a whole variable, one that is derived from the others."""
        with _writing(self.path):
            self._arrays[name][...] = values

    def annotate(
        self, attributes: Mapping[str, Any], variables: Mapping[str, tuple[str, str]]
    ) -> None:
        """Attributes of the whole, in JSON's types, and (units, long name) of its variables."""
        with _writing(self.path):
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

    def _of_phase(self, phase: str, arrays: Mapping[str, AnyArray]) -> dict[str, AnyArray]:
        names = [v.name for v in self.study.variables if v.phase == phase]
        return {name: arrays[name] for name in names}

    def _check(self) -> None:
        """Compare every committed block with its marker."""
        for variable in self.study.variables:
            array = self._arrays[variable.name]
            if array.shape != shape_of(self.study) or array.dtype != np.dtype(variable.dtype):
                raise _damaged(self.path, f"{variable.name} is not what was created")
        for phase in self.study.phases:
            digests = self._digests[phase][:]
            done = np.any(digests != 0, axis=1)
            names = [v.name for v in self.study.variables if v.phase == phase]
            whole = {name: self._arrays[name][:] for name in names} if done.any() else {}
            for number, region in enumerate(_regions(self.study)):
                if done[number]:
                    found = {name: values[region] for name, values in whole.items()}
                    if not np.array_equal(_digest(found), digests[number]):
                        raise _damaged(self.path, f"block {number} of {phase} is not as committed")


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


def _regions(study: Study) -> Iterator[Region]:
    """Regions of the blocks in the order of their numbers."""
    shape, block = shape_of(study), study.block_shape
    starts = [range(0, n, b) for n, b in zip(shape, block, strict=True)]
    for index in np.ndindex(*map(len, starts)):
        yield tuple(
            slice(starts[d][i], min(starts[d][i] + block[d], shape[d])) for d, i in enumerate(index)
        )


def _digest(arrays: Mapping[str, AnyArray]) -> NDArray[np.uint8]:
    digest = hashlib.sha256()
    for name in sorted(arrays):
        digest.update(name.encode() + np.ascontiguousarray(arrays[name]).tobytes())
    return np.frombuffer(digest.digest(), dtype=np.uint8)


def _lay_out(path: Path, study: Study) -> None:
    """The empty arrays, and the attribute that makes the store ours."""
    import zarr

    group = zarr.open_group(path, mode="a", zarr_format=3)
    shape, names = shape_of(study), list(study.dimensions)
    for variable in study.variables:
        group.create_array(
            variable.name,
            shape=shape,
            chunks=study.block_shape,
            dtype=variable.dtype,
            fill_value=variable.fill,
            dimension_names=names,
        )
    for name, values in study.dimensions.items():
        coordinate = group.create_array(
            name,
            shape=values.shape,
            chunks=values.shape,
            dtype=values.dtype,
            dimension_names=[name],
        )
        coordinate[:] = values
    blocks = group.create_group("blocks")
    count = sum(1 for _ in _regions(study))
    for phase in study.phases:
        blocks.create_array(phase, shape=(count, 32), chunks=(1, 32), dtype="u1", fill_value=0)
        blocks.create_array(
            f"{phase}_cpu", shape=(count,), chunks=(1,), dtype="f8", fill_value=np.nan
        )
    group.attrs.update({MARK: {"format": FORMAT, "identity": study.identity(), "failures": []}})


def _opened(path: Path) -> zarr.Group:
    """The group of a store of ours."""
    import zarr

    if not path.exists():
        raise InputError(f"{path}: there is no store to resume; leave out --resume to begin one")
    try:
        group = zarr.open_group(path, mode="r+", zarr_format=3)
        mark = group.attrs.get(MARK)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise _damaged(path, "it is no zarr group") from error
    if not isinstance(mark, dict) or "identity" not in mark:
        raise InputError(f"{path}: is no store of aeroflutter; give another name")
    if mark.get("format") != FORMAT:
        raise InputError(
            f"{path}: has format {mark.get('format')}, this version writes {FORMAT}; "
            "use --overwrite to begin again"
        )
    return group


def _damaged(path: Path, what: str) -> InputError:
    return InputError(
        f"{path}: is damaged ({' '.join(what.split())}); use --overwrite to begin again"
    )


def _check_ours(path: Path) -> None:
    """Leave anything but a store of ours alone, whatever was asked for."""
    ours = path.is_dir() and (path / "zarr.json").is_file()
    if ours:
        ours = MARK in (path / "zarr.json").read_text("utf-8", errors="replace")
    if not ours:
        raise InputError(f"{path}: is no store of aeroflutter, so it is not overwritten; remove it")


def _remove(path: Path) -> None:
    """Remove a store that no run is writing to."""
    os.close(_locked(path))
    shutil.rmtree(path)


def _locked(path: Path) -> int:
    """Lock the directory for as long as the returned descriptor is open."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(descriptor)
        raise InputError(f"{path}: another run is writing to it; wait, or end that one") from None
    return descriptor


@contextlib.contextmanager
def _writing(path: Path) -> Iterator[None]:
    """Say plainly what stopped a write."""
    try:
        yield
    except StoreFull:
        raise
    except OSError as error:
        if error.errno in FULL:
            raise StoreFull(error.errno, f"{path}: no room to write: {error.strerror}") from error
        raise InputError(f"{path}: cannot be written: {error.strerror or error}") from error
