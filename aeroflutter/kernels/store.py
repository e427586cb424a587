"""Machine code on disk: one folder for each state of all the kernels and of what compiles them.

numba's own cache looks at the file of a function alone. A function that takes a constant or
another function from a second file keeps its machine code when that file changes; and two
processes that save two versions of one function can leave the code of the one under the name of
the other. Here a folder belongs to one hash of all kernels, and a file to one version, named by
what it is: files never change, so that processes may read and write as they like.
"""

from __future__ import annotations

import functools
import hashlib
import os
import pickle
import sys
import uuid
from collections.abc import Callable, Iterator
from contextlib import suppress
from importlib import resources
from importlib.resources.abc import Traversable
from multiprocessing import parent_process
from pathlib import Path
from typing import Any

import llvmlite
import numba
import numpy as np
from numba.core import config, sigutils
from numba.core.caching import _Cache
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps

from aeroflutter.kernels.folders import claim, touch, user_folder
from aeroflutter.kernels.libraries import needs, ready
from aeroflutter.stderr import aside

__all__ = ["KernelCache", "folder", "is_kernel_module", "sources", "state_hash"]

SETTINGS = ("OPT", "LOOP_VECTORIZE", "SLP_VECTORIZE", "BOUNDSCHECK", "USING_SVML", "CPU_NAME")
"""Of numba's settings those that change the machine code and are not in its description of it."""

SEAL = hashlib.sha256().digest_size


def is_kernel_module(name: str) -> bool:
    """Whether a module is one of those whose sources the key of the cache covers."""
    return name.startswith("aeroflutter.") and name.rpartition(".")[2].startswith("_kernel")


def sources() -> Iterator[tuple[str, Traversable]]:
    """Name and file of every module on which machine code depends, in a fixed order."""
    root = resources.files("aeroflutter")
    yield from _modules(root / "kernels", "aeroflutter.kernels", "")
    yield from _modules(root, "aeroflutter", "_kernel")


def _modules(folder: Traversable, package: str, prefix: str) -> Iterator[tuple[str, Traversable]]:
    for entry in sorted(folder.iterdir(), key=lambda found: found.name):
        if entry.name.startswith(prefix) and entry.name.endswith(".py"):
            yield f"{package}.{entry.name[:-3]}", entry
        elif entry.is_dir() and entry.name.isidentifier():
            yield from _modules(entry, f"{package}.{entry.name}", prefix)


@functools.cache
def state_hash() -> str:
    """Hash of all kernels, of the libraries that compile them, and of numba's settings.

    It is taken once a process, with the first kernel: the sources that are imported then.
    """
    digest = hashlib.sha256()
    for name, file in sources():
        digest.update(name.encode() + b"\0" + file.read_bytes() + b"\0")
    versions = [sys.version, numba.__version__, llvmlite.__version__, np.__version__]
    settings = [(name, getattr(config, name, None)) for name in SETTINGS]
    digest.update(repr((versions, settings)).encode())
    return digest.hexdigest()[:32]


def folder() -> Path | None:
    """Where the machine code of this state is kept; None where there is no place for it."""
    chosen = getattr(config, "CACHE_DIR", "")  # NUMBA_CACHE_DIR, or what was set at run time
    base = Path(chosen) / "aeroflutter" if chosen else user_folder()
    return base and base / state_hash()


class KernelCache(_Cache):
    """Keeps the versions of one kernel; numba calls it, under its lock, for each it needs."""

    def __init__(self, function: Callable[..., Any]) -> None:
        module = function.__module__.removeprefix("aeroflutter.")
        self._name = f"{module}.{function.__qualname__}".replace("<", "").replace(">", "")
        self._code = hashlib.sha256(function.__code__.co_code).hexdigest()
        self._spent = f"{self._name}.spent"
        self._enabled = True
        state_hash()

    @property
    def cache_path(self) -> str | None:
        """Folder of the cache."""
        return str(folder() or "") or None

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The version for the types `sig` from the disk, or None."""
        home = folder()
        if home is None or not self._enabled:
            return None
        target_context.refresh()
        key = self._key(sig, target_context.codegen())
        try:
            content = (home / self._file(key)).read_bytes()
        except OSError:
            return None
        if _sealed(content[SEAL:]) != content:  # the disk lost some of it: it is made again
            return None
        found, called, reduced = pickle.loads(content[SEAL:])
        if found != key or not ready(called):
            return None
        touch(home)
        return CompileResult._rebuild(target_context, *reduced)

    def save_overload(self, sig: Any, data: Any) -> None:
        """Write the version for the types `sig`; where that fails, say so once and go on."""
        if not self._enabled or data.lifted or data.library.has_dynamic_globals:
            return
        home = folder()
        if home is None:
            _warn("there is no home directory")
            return
        key = self._key(sig, data.codegen)
        file = home / self._file(key)
        part = file.with_name(f"{file.name}.{uuid.uuid4().hex[:16]}.part")
        try:
            claim(home)
            part.write_bytes(_sealed(dumps((key, needs(data.library), data._reduce()))))
            os.replace(part, file)
        except OSError as error:
            _warn(f"{home.parent}: {error.strerror or error}")
            with suppress(OSError):
                part.unlink()

    def kept(self) -> bool:
        """Whether the disk holds a version of the kernel."""
        home = folder()
        return home is not None and any(home.glob(f"{self._name}-*.code"))

    def spent(self) -> float:
        """Seconds for which the kernel has run uncompiled so far."""
        try:
            return float((folder() / self._spent).read_text())  # type: ignore[operator]
        except (OSError, TypeError, ValueError):  # none yet, or no place, or the disk lost it
            return 0.0

    def spend(self, seconds: float) -> None:
        """Note for how long the kernel has run uncompiled; where that fails, it has not."""
        home = folder()
        if home is None or self.kept() or not seconds > self.spent():
            return
        with suppress(OSError):
            claim(home)
            (home / self._spent).write_text(f"{seconds:.3f}")

    def enable(self) -> None:
        """Use the disk again."""
        self._enabled = True

    def disable(self) -> None:
        """Neither load nor save."""
        self._enabled = False

    def flush(self) -> None:
        """Nothing to do: no file is ever out of date."""

    def _key(self, sig: Any, codegen: Any) -> tuple[Any, ...]:
        arguments, _ = sigutils.normalize_signature(sig)
        return (tuple(arguments), codegen.magic_tuple(), self._code)

    def _file(self, key: tuple[Any, ...]) -> str:
        return f"{self._name}-{hashlib.sha256(repr(key).encode()).hexdigest()[:16]}.code"


def _sealed(content: bytes) -> bytes:
    return hashlib.sha256(content).digest() + content


_warned: list[str] = []


def _warn(reason: str) -> None:
    """One line for each program: neither for each kernel nor for each of its worker processes."""
    if _warned or parent_process() is not None:
        return
    _warned.append(reason)
    aside(
        f"aeroflutter: machine code cannot be kept ({reason}), so every run compiles again; "
        "set NUMBA_CACHE_DIR to a folder that can be written"
    )
