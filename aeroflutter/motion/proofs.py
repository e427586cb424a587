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

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import scipy.linalg

from aeroflutter.motion._kernel_exact_proofs import Proofs
from aeroflutter.motion._kernel_exact_tables import balance

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from aeroflutter.model.lure import LureSystem
    from aeroflutter.motion._kernel_exact import Law

    Array = NDArray[np.float64]

__all__ = ["proofs_of"]

ZERO = 1e-11  # eigenvalues below this part of the largest are zero
BASIS = 1e9  # condition beyond which eigenvectors are no basis to be trusted


class Spectrum(NamedTuple):
    """Eigenvalues of a piece's matrix, those below `small` being zero; vectors, and their inverse.

    `scale` is what its coordinates are measured in. There is no inverse where the eigenvectors
    are no basis to be trusted.
    """

    matrix: Array
    values: Any
    vectors: Any
    inverse: Any | None
    scale: Array
    small: float

    @classmethod
    def of(cls, A: Array) -> Spectrum:
        """Spectrum of A, (n, n)."""
        values, vectors = np.linalg.eig(A)
        scale, small = balance(A), float(ZERO * np.abs(values).max())
        return cls(A, values, vectors, _inverse(vectors, scale), scale, small)

    @property
    def unstable(self) -> bool:
        """Whether an eigenvalue has a positive real part that is not round-off."""
        return bool(self.values.real.max() > self.small)


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
    spectra = {slope: Spectrum.of(system.closed(slope)) for slope in set(slopes.tolist())}
    p = slopes.size
    decays, heads = np.zeros(p, dtype=np.int64), np.zeros((p, n), dtype=np.int64)
    rows, centre, rest = np.zeros((p, n, n)), np.zeros((p, 2, n)), np.zeros((p, 2))
    free = np.zeros((p, n))
    for i, slope in enumerate(slopes.tolist()):
        pushed = bool(np.any(inputs[i]))
        decay = _decay(spectra[slope], system.c, pushed)
        if decay is None:
            continue
        decays[i] = 1
        rows[i], heads[i], free[i] = decay
        if pushed:
            steady = -np.linalg.solve(spectra[slope].matrix, system.b)
            centre[i] = np.outer(inputs[i], steady)
            rest[i] = centre[i] @ system.c
    grows, against = _growth(spectra, system.b, law)
    unstable = spectra[slopes[0]].unstable or spectra[slopes[-1]].unstable
    return Proofs(decays, rows, heads, centre, rest, free, grows, against, int(unstable))


def _inverse(vectors: Any, scale: Array) -> Any | None:
    """Inverse of the eigenvectors, if their condition in scaled coordinates is to be trusted."""
    sizes = np.sqrt(np.sum(np.abs(vectors / scale[:, None]) ** 2, axis=0))
    try:
        inverse = np.linalg.inv(vectors)
    except np.linalg.LinAlgError:
        return None
    scaled = sizes[:, None] * inverse * scale
    condition = np.sqrt(sizes.size * np.sum(np.abs(scaled) ** 2))  # Frobenius: unit columns
    return inverse if condition < BASIS else None


def _decay(spectrum: Spectrum, c: Array, pushed: bool) -> Decay | None:
    """Coordinates in which a piece decays, or stays if nothing pushes it; None if it may grow."""
    values = spectrum.values
    neutral = np.abs(values) <= spectrum.small
    if (
        np.any(values.real[~neutral] >= -spectrum.small)
        or neutral.sum() > 1
        or (neutral.any() and pushed)
    ):
        return None
    if spectrum.inverse is not None:
        return _modal(c, spectrum, neutral)
    return None if neutral.any() else _quadratic(spectrum.matrix, c, spectrum.scale)


def _modal(c: Array, spectrum: Spectrum, neutral: NDArray[np.bool_]) -> Decay:
    """Modal coordinates, each scaled by the y that it makes."""
    n = c.size
    values, vectors, left = spectrum.values, spectrum.vectors, spectrum.inverse
    assert left is not None
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


def _growth(spectra: dict[float, Spectrum], b: Array, law: Law) -> tuple[Array, Array]:
    """Unstable coordinates of the outer piece and the size beyond which they grow for good."""
    n = b.size
    none = np.zeros((0, 2, n)), np.zeros(0)
    if law.memory:
        slope, push = 1.0, float(np.abs(law.loop[2:]).max())
    else:
        slope, breaks = float(law.slopes[0]), law.edges[1:-1]
        if slope != law.slopes[-1]:
            return none
        between = law.slopes[1:] * breaks + law.offsets[1:] - slope * breaks
        push = float(np.abs(np.append(between, law.offsets[[0, -1]])).max())
    spectrum = spectra[slope]
    if not spectrum.unstable:
        return none
    values, rows = spectrum.values, spectrum.inverse
    if rows is None:
        values, vectors = np.linalg.eig(spectrum.matrix.T)
        rows = vectors.T
    grows = (values.real > spectrum.small) & (values.imag >= 0.0)
    left = rows[grows]
    return np.stack((left.real, left.imag), axis=1), np.abs(left @ b) * push / values[grows].real
