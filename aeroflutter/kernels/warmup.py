"""Compiles every kernel that Python calls."""

from __future__ import annotations

import time
from importlib import import_module
from typing import NamedTuple

from aeroflutter.kernels.arrays import argument_types
from aeroflutter.kernels.decorator import ENTRIES
from aeroflutter.kernels.store import folder, is_kernel_module, sources

__all__ = ["Warmed", "warm_up"]


class Warmed(NamedTuple):
    """What there was to compile.

    Attributes
    ----------
    compiled, kept
        Number of entry points that were compiled, and that were on disk.
    seconds
        Time that it took.
    folder
        Where the machine code is, or None where it cannot be kept.
    """

    compiled: int
    kept: int
    seconds: float
    folder: str | None


def warm_up() -> Warmed:
    """Compile every entry point of the package for its one signature, or load it from the disk."""
    for name, _ in sources():
        if is_kernel_module(name):
            import_module(name)
    begin = time.perf_counter()
    for entry in ENTRIES.values():
        if not entry.signatures:
            entry.compile(argument_types(entry.py_func))
    compiled = sum(bool(entry.stats.cache_misses) for entry in ENTRIES.values())
    place = folder()
    return Warmed(
        compiled=compiled,
        kept=len(ENTRIES) - compiled,
        seconds=time.perf_counter() - begin,
        folder=str(place) if place is not None and place.is_dir() else None,
    )
