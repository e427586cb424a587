"""What certifies, once and for all motions of a flow, that one of them is over.

In a mode with the constant inputs u, x' = A x + B u. Where A is stable about x_e, modal coordinates
z_i = l_i (x - x_e) satisfy |z_i(t)| <= |z_i(0)|, and so for every output

    |y(t) - y_e| <= Σ |c v_i| |z_i(0)|,

the best that the quadratic Lyapunov functions Σ w_i |z_i|² can do over all weights w_i. If the
bound is less than the distance of y_e from the edges of the mode, no switch can follow. Where
the eigenvectors are no basis to be trusted, one Lyapunov function of A takes their place.

Where a pair of eigenvalues is imaginary its |z_i| stays as it is: the bound holds, no switch can
follow, and the motion neither dies out nor grows.

A mode that leaves y free (freeplay about the quarter chord) has a zero eigenvalue. Without a
constant input its coordinate stays as it is, and y_e is where it leaves y.

Outside all switches F_i = k_i y_i + d_i with |d_i| <= p_i. An unstable coordinate z = l x of the
closed matrix obeys z' = s z - Σ l b_i d_i + l d, hence |z|' >= Re s |z| - Σ |l b_i| p_i - |l d|:
beyond (Σ |l b_i| p_i + |l d|) / Re s it grows for good.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from aeroflutter.motion._kernel_proofs import Proofs
from aeroflutter.motion.basins import Loop, basins_of
from aeroflutter.motion.step_tables import balance
from aeroflutter.springs._kernel_columns import DIRECTION, OFFSET, PIECE, SLOPE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from aeroflutter.motion.flow import Flow

    Array = NDArray[np.float64]

__all__ = ["proofs_of", "proofs_of_many"]

ZERO = 1e-11  # eigenvalues below this part of the largest are zero
APART = 1e6  # times that: how far round-off may part the two zeros of a drift
BALANCED = 1e-12  # relative size of what is left of an equilibrium
BASIS = 1e9  # condition beyond which eigenvectors are no basis to be trusted
# Whether the motion about the rest of a mode dies out; whether it goes on, but does not grow.
NEVER, UNLESS_PUSHED, ALWAYS, SWINGS = 0, 2, 1, 3


class Spectra(NamedTuple):
    """Eigenvalues of k matrices, and which of them are zero; right and left eigenvectors.

    Attributes
    ----------
    matrices, values, vectors, inverse
        (k, n, n), (k, n), (k, n, n), (k, n, n).
    small
        What counts as zero, (k,).
    scale
        What the states are measured in, (k, n).
    trusted
        Whether the eigenvectors are a basis to be trusted, (k,).
    """

    matrices: Array
    values: Any
    vectors: Any
    inverse: Any
    small: Array
    scale: Array
    trusted: NDArray[np.bool_]

    @classmethod
    def of(cls, matrices: Array, slack: NDArray[np.int64] | None = None) -> Spectra:
        """Spectra of matrices, (k, n, n), with as many zeros that are not defective, (k,)."""
        n = matrices.shape[1]
        values, vectors = np.linalg.eig(matrices)
        scale = np.array([balance(one) for one in matrices]).reshape(matrices.shape[:2])
        for i, count in enumerate(() if slack is None else slack):
            if count:  # eigenvectors of zeros that round-off parts are whatever it makes of them
                vectors = vectors.astype(complex)
                zeros = np.argsort(np.abs(values[i]))[:count]
                balanced = matrices[i] * scale[i] / scale[i][:, None]
                vectors[i][:, zeros] = scale[i][:, None] * np.linalg.svd(balanced)[2][-count:].T
        inverse = _inverses(vectors)
        sizes = np.sqrt(np.sum(np.abs(vectors / scale[:, :, None]) ** 2, axis=1))
        with np.errstate(over="ignore", invalid="ignore"):  # a basis that is none is not trusted
            scaled = np.abs(sizes[:, :, None] * inverse * scale[:, None, :]) ** 2
        condition = np.sqrt(n * np.sum(scaled, axis=(1, 2)))  # Frobenius: unit columns
        small = ZERO * np.max(np.abs(values), axis=1)
        return cls(matrices, values, vectors, inverse, small, scale, condition < BASIS)


def _inverses(vectors: Any) -> Any:
    """Inverses of k matrices; infinities for those that have none."""
    try:
        return np.linalg.inv(vectors)
    except np.linalg.LinAlgError:
        if len(vectors) == 1:
            return np.full_like(vectors, np.inf)
        return np.concatenate([_inverses(one[None]) for one in vectors])


def proofs_of(flow: Flow, known: Proofs | None = None) -> Proofs:
    """Proofs for the modes of a flow that have their tables.

    Parameters
    ----------
    flow
        The flow.
    known
        Proofs of the first of them.
    """
    if known is None:
        return proofs_of_many([flow])[0]
    first = known.decays.size
    generators = flow.arrays.generator[first:]
    outputs, slack = _outputs(flow)
    spectra = Spectra.of(generators[:, :, : flow.n], slack[first:])
    outputs = None if outputs is None else outputs[first:]
    at = np.arange(len(generators))
    new = _decays(generators, flow.C, spectra, at, outputs, slack[first:])
    joined: Any = [np.concatenate(pair) for pair in zip(known[: len(new)], new, strict=True)]
    rests = joined[0], joined[4]
    return Proofs._make(
        (*joined, known.grows, known.against, *_corners(flow, *rests), known.unstable, known.idle)
    )


def proofs_of_many(flows: Sequence[Flow]) -> list[Proofs]:
    """Proofs for flows with the same springs and as many tables each, made together."""
    first = flows[0]
    k, n = first.arrays.step.size, first.n
    generators = np.concatenate([flow.arrays.generator for flow in flows])
    rests = np.flatnonzero(np.tile(_can_rest(first), len(flows)))
    outputs, slack = _outputs(first)
    slack = np.tile(slack, len(flows))
    spectra = Spectra.of(generators[rests, :, :n], slack[rests])
    parts = _decays(generators, first.C, spectra, rests, outputs, slack)
    outer = list(product(*(set(piece.outside) for piece in first.pieces)))
    closed = [flow.closed(slopes) for flow in flows for slopes in outer]
    values = np.linalg.eigvals(np.array(closed))
    small = ZERO * np.max(np.abs(values), axis=1)
    rising = np.max(values.real, axis=1) > small
    oscillates = np.where(np.abs(values.imag) > small[:, None], values.real, -np.inf)
    idling = ~rising & (np.max(oscillates, axis=1) >= -small)
    unstable, idle = (
        np.any(which.reshape(len(flows), len(outer)), axis=1) for which in (rising, idling)
    )
    found = []
    for i, flow in enumerate(flows):
        own: Any = (part[i * k : (i + 1) * k] for part in parts)
        grows = np.zeros((0, 2, n)), np.zeros(0)
        if unstable[i] and len(outer) == 1:
            grows = _growth(flow, Spectra.of(np.array(closed[i : i + 1])))
        own = list(own)
        corners = _corners(flow, own[0], own[4])
        found.append(Proofs._make((*own, *grows, *corners, int(unstable[i]), int(idle[i]))))
    return found


def _corners(flow: Flow, decays: NDArray[np.int64], centre: Array) -> tuple[Array, Array]:
    """Rests at corners of the law of a lone spring, and their forms; see `Proofs`."""
    n, piece = flow.n, flow.pieces[0]
    none = np.zeros((0, n + 1)), np.zeros((0, n, n))
    if flow.m > 1 or piece.memory or piece.jumps or piece.modes == 1 or decays.size == 0:
        return none
    tables = flow.arrays.lookup[piece.rows[:, PIECE].astype(np.int64)]
    rests = (tables >= 0) & (decays[tables] == ALWAYS)
    inputs = np.column_stack((-piece.rows[:, OFFSET], np.ones(piece.modes)))[:, : flow.inputs]
    centres = np.einsum("knq,kq->kn", centre[tables], inputs)
    found = basins_of(Loop(flow.A, flow.B[:, 0], flow.C[0], flow.d), piece, rests, centres)
    if not found:
        return none
    return np.array([[*one.centre, one.rest] for one in found]), np.array(
        [one.form for one in found]
    )


def _can_rest(flow: Flow) -> NDArray[np.bool_]:
    """Whether a motion can stay in a mode with each table: not where an output must go on, (k,)."""
    k = flow.arrays.step.size
    places = np.argsort(flow.arrays.lookup)[-k:] if k else np.empty(0, dtype=np.int64)
    rests = np.ones(k, dtype=bool)
    for piece, slopes in zip(flow.pieces, flow.laws.slopes_at(places).T, strict=True):
        free = piece.rows[piece.rows[:, DIRECTION] == 0.0, SLOPE]
        rests &= np.isin(slopes, free) | np.isnan(slopes)
    return rests


def _outputs(flow: Flow) -> tuple[Array | None, NDArray[np.int64]]:
    """What ends each mode, where a law slides, and how many coordinates then stay as they are."""
    k, springs = flow.arrays.step.size, len(flow.springs)
    slack = np.zeros(k, dtype=np.int64)
    if flow.outputs is None:
        return None, slack
    places = np.argsort(flow.arrays.lookup)[-k:]
    stuck = np.isnan(flow.laws.slopes_at(places))
    return flow.outputs, np.sum(stuck, axis=1) + np.sum(stuck[:, springs:], axis=1)


def _decays(
    generators: Array,
    C: Array,
    spectra: Spectra,
    at: NDArray[np.int64],
    outputs: Array | None,
    slack: NDArray[np.int64],
) -> tuple[Any, ...]:
    """What says that a mode dies out: the first seven fields of `Proofs`.

    Of the generators only those `at` some places have their spectra, and a motion can rest there.

    Modal coordinates, each weighted by the outputs that it makes: LAPACK puts the two of a pair
    side by side, and the real and the imaginary part of the first are a group. Where laws slide,
    `outputs` (k, m, n+q) are what ends a mode, and `slack` (k,) coordinates stay as they are.
    """
    values, left = spectra.values, spectra.inverse
    n = values.shape[1]
    neutral = np.abs(values) <= spectra.small[:, None]
    count = np.sum(neutral, axis=1)
    apart = np.abs(values.imag) > spectra.small[:, None] * APART  # else a zero that is defective
    swings = (np.abs(values.real) <= spectra.small[:, None]) & apart
    slack = slack[at]
    falls = np.all((values.real < -spectra.small[:, None]) | neutral, axis=1)
    falls &= np.where(slack > 0, count == slack, count < 2)
    if outputs is not None:
        C, direct = outputs[at, :, :n], outputs[at, :, n:]
    slow = ~neutral & ~apart & (np.abs(values.real) <= spectra.small[:, None])
    stays = np.all(values.real <= spectra.small[:, None], axis=1) & (count == 0)
    stays &= ~np.any(slow, axis=1)
    decays = np.where(falls, np.where(count > 0, UNLESS_PUSHED, ALWAYS), NEVER)
    decays[stays & np.any(swings, axis=1)] = SWINGS
    decays[~spectra.trusted] = NEVER
    with np.errstate(invalid="ignore"):
        made = C @ spectra.vectors
        paired = np.where(values.imag > 0.0, 2.0, 1.0) * ((values.imag >= 0.0) & ~neutral)
        weights = np.abs(made) * paired[:, None, :]
        rows = np.where(values.imag[:, :, None] >= 0.0, left.real, -left.imag)
        rows = np.where(neutral[:, :, None], 0.0, rows)
        free = ((made * neutral[:, None, :]) @ np.where(neutral[:, :, None], left, 0.0)).real
    heads = (values.imag >= 0.0).astype(np.int64)
    heads[swings & (heads == 1)] = 2
    for i in np.flatnonzero(falls & ~spectra.trusted & (count == 0)):
        found = _quadratic(spectra.matrices[i], C, spectra.scale[i])
        if found is not None:
            decays[i] = ALWAYS
            rows[i], heads[i], weights[i] = found
    sure = (decays == ALWAYS) | (decays == SWINGS)
    centre = np.zeros((decays.size, n, generators.shape[2] - n))
    centre[sure] = -np.linalg.solve(spectra.matrices[sure], generators[at[sure], :, n:])
    rest = C @ centre
    if outputs is not None:
        _rest_of_sliders(generators[at, :, n:], spectra, slack, decays, centre)
        rest = C @ centre + direct - free @ centre
    parts = decays, rows, heads, weights, centre, rest, free
    return tuple(_spread(part, at, len(generators)) for part in parts)


def _rest_of_sliders(
    inputs: Array, spectra: Spectra, slack: NDArray[np.int64], decays: Any, centre: Array
) -> None:
    """Equilibria of modes in which laws slide, any that there is: the others differ by `free`."""
    for i in np.flatnonzero((slack > 0) & (decays == UNLESS_PUSHED)):
        A = spectra.matrices[i]
        found = -np.linalg.pinv(A, rcond=ZERO) @ inputs[i]
        size = np.abs(A) @ np.abs(found) + np.abs(inputs[i])
        if np.all(np.abs(A @ found + inputs[i]) <= BALANCED * size.max()):
            centre[i], decays[i] = found, ALWAYS


def _spread(part: Any, at: NDArray[np.int64], count: int) -> Any:
    """Rows put to their places among `count`, zeros elsewhere."""
    whole = np.zeros((count, *part.shape[1:]), dtype=part.dtype)
    whole[at] = part
    return whole


def _quadratic(A: Array, C: Array, scale: Array) -> tuple[Array, NDArray[np.int64], Array] | None:
    """One Lyapunov function, its root weighted by the largest outputs on its unit level."""
    import scipy.linalg

    m, n = C.shape
    D = A * scale[None, :] / scale[:, None]
    P = scipy.linalg.solve_continuous_lyapunov(D.T, -np.eye(n) * np.abs(D).max())
    P = 0.5 * (P + P.T)
    if np.linalg.eigvalsh(P).min() <= 0.0 or np.linalg.eigvalsh(D.T @ P + P @ D).max() >= 0.0:
        return None
    scaled = C * scale
    heads, weights = np.zeros(n, dtype=np.int64), np.zeros((m, n))
    heads[0] = 1
    weights[:, 0] = np.sqrt(np.sum(scaled.T * np.linalg.solve(P, scaled.T), axis=0))
    return np.linalg.cholesky(P).T / scale[None, :], heads, weights


def _growth(flow: Flow, outer: Spectra) -> tuple[Array, Array]:
    """Unstable coordinates of the outer mode, and the size beyond which they grow for good."""
    values, rows = outer.values[0], outer.inverse[0]
    if not outer.trusted[0]:
        values, vectors = np.linalg.eig(outer.matrices[0].T)
        rows = vectors.T
    grows = (values.real > outer.small[0]) & (values.imag >= 0.0)
    left = rows[grows]
    push = np.array([piece.push for piece in flow.pieces])
    against = (np.abs(left @ flow.B) @ push + np.abs(left @ flow.d)) / values[grows].real
    return np.stack((left.real, left.imag), axis=1), np.ascontiguousarray(against)
