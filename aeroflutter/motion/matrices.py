"""The bare arrays of a system, and what they are with its springs in a mode."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeroflutter.model.lure import as_system

__all__ = ["Matrices", "closed", "matrices_of"]

Array = NDArray[np.float64]


class Matrices(NamedTuple):
    """A system as bare arrays: A (n, n), B (n, m), C (m, n) and d (n,)."""

    A: Array
    B: Array
    C: Array
    d: Array


def matrices_of(system: Any) -> Matrices:
    """The arrays of a system, contiguous."""
    whole = as_system(system)
    parts = whole.A, whole.B, whole.C, whole.d
    return Matrices(*(np.array(part, dtype=float, order="C") for part in parts))


def closed(A: Array, inputs: Array, C: Array, slopes: Array) -> Array:
    """[A - B diag(k) C, inputs] for each row of slopes, (k, n, n+q); B is in the first columns."""
    m, n = C.shape
    closed = np.empty((len(slopes), n, n + inputs.shape[1]))
    closed[:, :, n:] = inputs
    closed[:, :, :n] = A - (inputs[:, :m] * slopes[:, None]) @ C
    return closed
