"""Compiled: determinants of a few middling matrices, where a threaded LAPACK loses time waiting."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.kernels import kernel
from aeroflutter.kernels.arrays import Complex3

Complex = NDArray[np.complex128]


@kernel(entry=True)
def determinants(matrices: Complex3) -> Complex:
    """Determinants of matrices (m, n, n), by elimination with partial pivoting; they are spent."""
    m, n = matrices.shape[:2]
    out = np.ones(m, dtype=np.complex128)
    for i in range(m):
        a = matrices[i]
        for k in range(n):
            p = k
            best = abs(a[k, k].real) + abs(a[k, k].imag)
            for r in range(k + 1, n):
                size = abs(a[r, k].real) + abs(a[r, k].imag)
                if size > best:
                    p, best = r, size
            if best == 0.0:
                out[i] = 0.0
                break
            if p != k:
                for c in range(k, n):
                    a[k, c], a[p, c] = a[p, c], a[k, c]
                out[i] = -out[i]
            out[i] *= a[k, k]
            inverse = 1.0 / a[k, k]
            for r in range(k + 1, n):
                factor = a[r, k] * inverse
                if factor != 0.0:
                    for c in range(k + 1, n):
                        a[r, c] -= factor * a[k, c]
    return out
