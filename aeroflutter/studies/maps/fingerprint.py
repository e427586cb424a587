"""A hash of the code on which the numbers of a study depend."""

from __future__ import annotations

import functools
import hashlib
from importlib import resources
from importlib.resources.abc import Traversable

__all__ = ["code_hash"]

PARTS = ("bracket.py",)
FOLDERS = ("model", "linear", "springs", "motion", "orbits/describing", "generated", "studies/maps")


@functools.cache
def code_hash(*more: str) -> str:
    """SHA-256 over the modules of the model and of the engines, and of more folders."""
    root = resources.files("aeroflutter")
    digest = hashlib.sha256()
    for name in PARTS:
        _add(digest, root / name)
    for name in (*FOLDERS, *more):
        folder = resources.files("aeroflutter.generated") if name == "generated" else root / name
        for file in sorted(folder.iterdir(), key=lambda entry: entry.name):
            if file.name.endswith(".py"):
                _add(digest, file)
    return digest.hexdigest()


def _add(digest: hashlib._Hash, file: Traversable) -> None:
    digest.update(file.name.encode() + b"\0" + file.read_bytes())
