"""Compiled functions: one decorator, and a cache on disk that cannot hold stale machine code.

Compiled functions live in files named `_kernel*.py` and carry `kernel`. They take numbers, arrays
and named tuples of both, and import nothing of the package but one another, so that their files
are all that their machine code depends on: `sources` lists them, and the folder of the cache
carries the hash of them all. numba is imported with the first kernel, not with the package.
"""

from __future__ import annotations

from aeroflutter.kernels.decorator import expect, kernel

__all__ = ["expect", "kernel"]
