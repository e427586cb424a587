"""What certifies, once and for all motions of a system, that one of them is over.

On a linear piece of slope k with the constant input u, x' = A_k x + b u. Where A_k is stable about
x_e, modal coordinates z_i = l_i (x - x_e) satisfy |z_i(t)| <= |z_i(0)|, and so

    |y(t) - y_e| <= Σ |c v_i| |z_i(0)|,

the best that the quadratic Lyapunov functions Σ w_i |z_i|² can do over all weights w_i. If the
bound is less than the distance of y_e from the edges of the piece, no switch can follow. Where
the eigenvectors are no basis to be trusted, one Lyapunov function of A_k takes their place.

A piece that leaves y free (freeplay about the quarter chord) has a zero eigenvalue. Without a
constant moment its coordinate stays as it is, and y_e is where it leaves y.

Outside all switches F = k y + d with |d| <= d_max. An unstable coordinate z = l x of A_k obeys
z' = p z - l b d, hence |z|' >= Re p |z| - |l b| d_max: beyond |l b| d_max / Re p it grows for good.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import scipy.linalg

from aeroflutter.timemarch._kernel_exact_proofs import Proofs

if TYPE_CHECKING:
    from typing import Any

    from numpy.typing import NDArray

    from aeroflutter.lure import LureSystem
    from aeroflutter.timemarch._kernel_exact import Law

    Array = NDArray[np.float64]

__all__ = ["proofs_of"]

ZERO = 1e-11  # eigenvalues below this part of the largest are zero
BASIS = 1e9  # condition beyond which eigenvectors are no basis to be trusted


class Decay(NamedTuple):
    """Coordinates of one piece that never grow; see `Proofs`."""

    rows: Array
    heads: NDArray[np.int64]
    free: Array


def proofs_of(system: LureSystem, law: Law) -> Proofs:
    """Proofs for a system with a piecewise-linear spring.

    Parameters
    ----------
    system
        x' = A x - b F(c x), n states.
    law
        The spring as the kernels' numbers.
    """
    n = system.order
    slopes = np.array([1.0]) if law.memory else law.slopes
    inputs = [(0.0, 1.0)] if law.memory else [(-offset, 0.0) for offset in law.offsets]
    p = slopes.size
    decays, heads = np.zeros(p, dtype=np.int64), np.zeros((p, n), dtype=np.int64)
    rows, centre, rest = np.zeros((p, n, n)), np.zeros((p, 2, n)), np.zeros((p, 2))
    free = np.zeros((p, n))
    for i in range(p):
        A = system.closed(slopes[i])
        pushed = bool(np.any(inputs[i]))
        decay = _decay(A, system.c, pushed)
        if decay is None:
            continue
        decays[i] = 1
        rows[i], heads[i], free[i] = decay
        if pushed:
            balance = -np.linalg.solve(A, system.b)
            centre[i] = np.outer(inputs[i], balance)
            rest[i] = centre[i] @ system.c
    grows, against = _growth(system, law)
    ends = (1.0,) if law.memory else (law.slopes[0], law.slopes[-1])
    unstable = any(_abscissa(system.closed(slope)) > 0.0 for slope in ends)
    return Proofs(decays, rows, heads, centre, rest, free, grows, against, int(unstable))


def _abscissa(A: Array) -> float:
    """Largest real part of the eigenvalues that is not round-off, or zero."""
    values = np.linalg.eigvals(A)
    largest = float(values.real.max())
    return largest if largest > ZERO * np.abs(values).max() else 0.0


def _decay(A: Array, c: Array, pushed: bool) -> Decay | None:
    """Coordinates in which x' = A x decays, or stays if nothing pushes it; None if it may grow."""
    values, vectors = np.linalg.eig(A)
    small = ZERO * np.abs(values).max()
    neutral = np.abs(values) <= small
    if np.any(values.real[~neutral] >= -small) or neutral.sum() > 1 or (neutral.any() and pushed):
        return None
    scale = scipy.linalg.matrix_balance(A, permute=False)[1].diagonal()
    balanced = vectors / scale[:, None]
    balanced = balanced / np.linalg.norm(balanced, axis=0)
    if np.linalg.cond(balanced) < BASIS:
        return _modal(c, values, vectors, neutral)
    return None if neutral.any() else _quadratic(A, c, scale)


def _modal(c: Array, values: Any, vectors: Any, neutral: NDArray[np.bool_]) -> Decay:
    """Modal coordinates, each scaled by the y that it makes."""
    n = c.size
    left = np.linalg.inv(vectors)
    weight = np.abs(c @ vectors)
    rows, heads, free = np.zeros((n, n)), np.zeros(n, dtype=np.int64), np.zeros(n)
    place = 0
    for i in np.flatnonzero(values.imag >= 0.0):
        if neutral[i]:
            free = ((c @ vectors)[i] * left[i]).real
            continue
        paired = values[i].imag > 0.0
        rows[place] = (2.0 if paired else 1.0) * weight[i] * left[i].real
        heads[place] = 1
        if paired:
            rows[place + 1] = 2.0 * weight[i] * left[i].imag
        place += 2 if paired else 1
    heads[place:] = 1
    return Decay(rows, heads, free)


def _quadratic(A: Array, c: Array, scale: Array) -> Decay | None:
    """One Lyapunov function, whose root is scaled by the largest y on its unit level."""
    n = c.size
    D = A * scale[None, :] / scale[:, None]
    P = scipy.linalg.solve_continuous_lyapunov(D.T, -np.eye(n) * np.abs(D).max())
    P = 0.5 * (P + P.T)
    if np.linalg.eigvalsh(P).min() <= 0.0 or np.linalg.eigvalsh(D.T @ P + P @ D).max() >= 0.0:
        return None
    reach = np.sqrt((c * scale) @ np.linalg.solve(P, c * scale))
    rows = reach * np.linalg.cholesky(P).T / scale[None, :]
    heads = np.zeros(n, dtype=np.int64)
    heads[0] = 1
    return Decay(rows, heads, np.zeros(n))


def _growth(system: LureSystem, law: Law) -> tuple[Array, Array]:
    """Unstable coordinates of the outer piece and the size beyond which they grow for good."""
    n = system.order
    none = np.zeros((0, 2, n)), np.zeros(0)
    if law.memory:
        slope, push = 1.0, float(np.abs(law.loop[2:]).max())
    else:
        slope, breaks = law.slopes[0], law.edges[1:-1]
        if slope != law.slopes[-1]:
            return none
        between = law.slopes[1:] * breaks + law.offsets[1:] - slope * breaks
        push = float(np.abs(np.append(between, law.offsets[[0, -1]])).max())
    A = system.closed(slope)
    values, vectors = scipy.linalg.eig(A.T)
    grows = (values.real > ZERO * np.abs(values).max()) & (values.imag >= 0.0)
    if not grows.any():
        return none
    left = vectors[:, grows].T
    rows = np.stack((left.real, left.imag), axis=1)
    return rows, np.abs(left @ system.b) * push / values[grows].real
