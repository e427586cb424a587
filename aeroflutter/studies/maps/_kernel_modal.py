"""Compiled proofs of decay for the loop's one stick piece, the common case of a map's columns.

The same modal bounds as `timemarch.proofs`, without what makes them general: where the piece is
neither strictly stable nor well conditioned, the general ones are asked.
"""

from __future__ import annotations

import numpy as np

from aeroflutter.kernels import kernel
from aeroflutter.kernels.arrays import Real1, Real2, Whole1

SMALL = 1e-11  # eigenvalues to the left of this part of the largest count as stable
BASIS = 1e8  # Frobenius condition of the eigenvectors up to which they are trusted


@kernel(entry=True)
def modal(
    A: Real2, b: Real1, c: Real1, rows: Real2, heads: Whole1, centre: Real1, rest: Real1
) -> bool:
    """Fill the proofs of one stable piece x' = A x + b h of a loop.

    Parameters
    ----------
    A
        System with the spring closed at slope one, (n, n).
    b, c
        Input and output, (n,).
    rows, heads
        Modal coordinates scaled by the y that they make, (n, n), and the first row of each, (n,).
    centre, rest
        Equilibrium a unit of h, (n,), and its y, (1,).

    Returns
    -------
    bool
        False if the piece may grow, or its eigenvectors are no basis to be trusted.
    """
    n = c.size
    values, vectors = np.linalg.eig(A.astype(np.complex128))
    largest = 0.0
    for k in range(n):
        largest = max(largest, abs(values[k]))
    for k in range(n):
        if values[k].real >= -SMALL * largest:
            return False
    left = np.linalg.inv(vectors)
    right, across = 0.0, 0.0
    for i in range(n):
        for j in range(n):
            right += abs(vectors[i, j]) ** 2
            across += abs(left[i, j]) ** 2
    if not np.sqrt(right * across) < BASIS:
        return False
    place = 0
    for k in range(n):
        if values[k].imag < -SMALL * largest:
            continue
        paired = values[k].imag > SMALL * largest
        weight = 0.0 * 1j
        for i in range(n):
            weight += c[i] * vectors[i, k]
        scale = abs(weight) * (2.0 if paired else 1.0)
        for j in range(n):
            rows[place, j] = scale * left[k, j].real
        heads[place] = 1
        if paired:
            for j in range(n):
                rows[place + 1, j] = scale * left[k, j].imag
        place += 2 if paired else 1
        if place > n:
            return False
    if place != n:
        return False
    balance = np.linalg.solve(A, b)
    rest[0] = 0.0
    for i in range(n):
        centre[i] = -balance[i]
        rest[0] -= c[i] * balance[i]
    return True
