"""What the disk itself holds, whatever becomes of the run or of the power."""

from __future__ import annotations

import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

__all__ = ["ABANDONED", "synced"]

ABANDONED = 3600.0  # seconds after which half a file, or half a store, is nobody's any more


def synced(paths: Iterable[Path]) -> None:
    """Have files, and entries of folders, reach the disk itself; what is not there is left out."""
    for path in paths:
        with suppress(FileNotFoundError):
            descriptor = os.open(path, os.O_RDONLY)
            try:
                os.fsync(descriptor)
            finally:
                os.close(descriptor)
