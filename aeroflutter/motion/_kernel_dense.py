"""Compiled algebra of small dense matrices, as cycles and their stability need it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.kernels import kernel

Array = NDArray[np.float64]
Index = NDArray[np.int64]

RANK = 1e-9  # pivots below this part of the first one are a continuum of cycles


@kernel(inner=True, bare=True)
def eliminate(J: Array, r: Array, step: Array, order: Index) -> int:
    """Solve J step = r by elimination with complete pivoting; returns the rank.

    Directions without a pivot are left alone, so a member of a continuum of solutions is found
    next to where the search stands. `order` is room for as many whole numbers.
    """
    m = r.size
    for k in range(m):
        order[k] = k
    rank = m
    largest = 0.0
    for k in range(m):
        pivot, row, column = 0.0, k, k
        for i in range(k, m):
            for j in range(k, m):
                if abs(J[i, j]) > pivot:
                    pivot, row, column = abs(J[i, j]), i, j
        largest = max(largest, pivot)
        if pivot <= RANK * largest:
            rank = k
            break
        for j in range(m):
            J[k, j], J[row, j] = J[row, j], J[k, j]
        r[k], r[row] = r[row], r[k]
        for i in range(m):
            J[i, k], J[i, column] = J[i, column], J[i, k]
        order[k], order[column] = order[column], order[k]
        for i in range(k + 1, m):
            factor = J[i, k] / J[k, k]
            for j in range(k, m):
                J[i, j] -= factor * J[k, j]
            r[i] -= factor * r[k]
    for k in range(m):
        step[k] = 0.0
    for k in range(rank - 1, -1, -1):
        total = r[k]
        for j in range(k + 1, rank):
            total -= J[k, j] * step[order[j]]
        step[order[k]] = total / J[k, k]
    return rank
