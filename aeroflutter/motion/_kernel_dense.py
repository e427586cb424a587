"""Compiled algebra of small dense matrices, as cycles and their stability need it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.kernels import kernel

Array = NDArray[np.float64]

RANK = 1e-9  # pivots below this part of the first one are a continuum of cycles


@kernel(inner=True)
def eliminate(J: Array, r: Array, step: Array) -> int:
    """Solve J step = r by elimination with complete pivoting; returns the rank.

    Directions without a pivot are left alone, so a member of a continuum of solutions is found
    next to where the search stands.
    """
    m = r.size
    order = np.arange(m)
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
    step[:] = 0.0
    for k in range(rank - 1, -1, -1):
        total = r[k]
        for j in range(k + 1, rank):
            total -= J[k, j] * step[order[j]]
        step[order[k]] = total / J[k, k]
    return rank


@kernel(inner=True)
def contraction(Q: Array, radius: float, P: Array) -> float:
    """Norm in which the linear map Q contracts: P with Qᵀ P Q <= ρ² P, for ρ between radius and 1.

    Returns
    -------
    float
        ρ. P = Σ (Q/ρ)ᵀᵏ (Q/ρ)ᵏ, summed by doubling.
    """
    rho = 0.5 * (1.0 + radius)
    power = Q / rho
    P[:] = np.eye(Q.shape[0])
    for _ in range(40):
        P += power.T @ P @ power
        power = power @ power
        if np.max(np.abs(power)) < 1e-12:
            break
    return rho


@kernel(inner=True)
def slowest(Q: Array, P: Array, mu: complex, rows: Array) -> None:
    """Rows whose products with d are the coordinate of eigenvalue μ of Q, in lengths of norm P.

    Left and right eigenvector by inverse iteration; real part and imaginary part of the row, (2, n).
    """
    n = Q.shape[0]
    shifted = Q.astype(np.complex128)
    for i in range(n):
        shifted[i, i] -= mu + 1e-10 * (1.0 + abs(mu))
    right, left = np.empty(n, dtype=np.complex128), np.empty(n, dtype=np.complex128)
    for i in range(n):
        right[i] = left[i] = complex(1.0, 0.3) + 0.1 * i
    for _ in range(3):
        right[:] = np.linalg.solve(shifted, right)
        right /= np.max(np.abs(right))
        left[:] = np.linalg.solve(shifted.T.copy(), left)
        left /= np.max(np.abs(left))
    length, product = 0.0, 0j
    for i in range(n):
        product += left[i] * right[i]
        for j in range(n):
            length += (np.conj(right[i]) * P[i, j] * right[j]).real
    pair = 2.0 if abs(mu.imag) > 1e-9 * abs(mu) else 1.0
    factor = pair * np.sqrt(max(length, 0.0)) / product if product != 0j else 0j
    for i in range(n):
        rows[0, i], rows[1, i] = (factor * left[i]).real, (factor * left[i]).imag
