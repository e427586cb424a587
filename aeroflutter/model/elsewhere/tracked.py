"""State spaces given at several speeds: of one set of states, or of states that differ.

Where every matrix has the same states, entries are splined. A reduced or balanced model has states
of its own at each speed; only what does not depend on the choice of states may be interpolated
then: poles, and what each contributes to the transfer function. Every system, closed by springs of
unit slope, is brought to its modes; modes are matched from one speed to the next, and splined.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.errors import InputError
from aeroflutter.model.system import Complex, Real

__all__ = ["outputs_first", "same_states", "tracked"]

_SMOOTH = 0.5  # of what a step of entries may be from the neighbours' straight line
_APART = 1e-7  # poles nearer than that share modes
_SKEW = 1e6  # condition of states of which the outputs are the first
_HIDDEN = 1e-10  # of the largest residue: what round-off leaves of a mode that is not in the loop


def same_states(A: Real, B: Real, C: Real) -> bool:
    """Whether matrices at neighbouring speeds are near one another as they stand.

    Two speeds say nothing about it; of more, each matrix must lie nearer to the mean of its
    neighbours than these are large.
    """
    if np.all(C[0] == C):
        return True  # rows that pick the same outputs everywhere
    stacked = [
        np.concatenate([a.ravel(), b.ravel(), c.ravel()]) for a, b, c in zip(A, B, C, strict=True)
    ]
    values = np.array(stacked)
    size = np.abs(values).max(axis=0)
    scaled = values / np.where(size > 0, size, 1.0)
    steps = np.linalg.norm(np.diff(scaled, axis=0), axis=1)
    return bool(np.max(steps) <= _SMOOTH * np.linalg.norm(scaled, axis=1).min())


def tracked(speeds: Real, A: Real, B: Real, C: Real) -> tuple[Real, Real, Real]:
    """The same systems in real modal form, modes in the same order and of the same size.

    Raises
    ------
    InputError
        Where poles come together, a pair becomes real, or modes cannot be told apart.
    """
    closed = A - B @ C  # without its springs a structure may be free, its poles all zero
    parts = zip(closed, B, C, strict=True)
    poles, left, right = zip(*(_modes(*one) for one in parts), strict=True)
    for i in range(len(speeds)):
        if not _separate(poles[i]):
            raise InputError(
                [f"A: at speed {speeds[i]:g} poles coincide and the states differ from speed to "
                 "speed, so modes cannot be followed; give all speeds in the same states"]
            )  # fmt: skip
    order = [np.argsort(poles[0].imag, kind="stable")]
    for i in range(1, len(speeds)):
        match = _matched(poles[i - 1][order[-1]], poles[i])
        if match is None:
            raise InputError(
                [f"A: between the speeds {speeds[i - 1]:g} and {speeds[i]:g} modes cannot be told "
                 "apart and the states differ; give speeds that are closer, or all in the same "
                 "states"]
            )  # fmt: skip
        order.append(match)
    P = np.array([one[o] for one, o in zip(poles, order, strict=True)])
    drives = np.array([one[o] for one, o in zip(left, order, strict=True)])
    outputs = np.array([one[:, o] for one, o in zip(right, order, strict=True)])
    parts = np.linalg.norm(drives, axis=2) * np.linalg.norm(outputs, axis=1)
    hidden = np.all(parts <= _HIDDEN * parts.max(axis=1, keepdims=True), axis=0)
    drives[:, hidden], outputs[:, :, hidden] = 0.0, 0.0
    for mode in np.flatnonzero(~hidden):
        factor = _gauge(drives[:, mode], outputs[:, :, mode])
        drives[:, mode] /= factor[:, None]
        outputs[:, :, mode] *= factor[:, None]
    forms = [_real_form(*one) for one in zip(P, drives, outputs, strict=True)]
    form, inputs, rows = (np.array(part) for part in zip(*forms, strict=True))
    return form + inputs @ rows, inputs, rows


def outputs_first(A: Real, B: Real, C: Real) -> tuple[Real, Real, Real]:
    """The same systems in states whose first are the outputs, so that ``C`` is one at all speeds.

    Parameters
    ----------
    A : array (k, n, n)
    B : array (k, n, m)
    C : array (k, m, n)

    Raises
    ------
    InputError
        Where outputs depend on one another, or turn too far from speed to speed.

    Notes
    -----
    With ``T = [C; N]``, the rows of ``N`` orthogonal to the mean of ``C``, and ``T x`` for ``x``.
    """
    m = C.shape[1]
    size = np.sqrt(np.mean(np.sum(C**2, axis=2), axis=0))[:, None]
    rest = np.linalg.svd(np.mean(C / size, axis=0))[2][m:]
    T = np.concatenate([C / size, np.broadcast_to(rest, (len(C), *rest.shape))], axis=1)
    if m > C.shape[2] or np.linalg.cond(T).max() > _SKEW:
        raise InputError(
            ["C: differs from speed to speed, and its rows depend on one another or turn too far; "
             "give all speeds in states in which C is the same"]
        )  # fmt: skip
    back = np.linalg.inv(T)
    rows = np.zeros((m, C.shape[2]))
    rows[:, :m] = np.diag(size[:, 0])
    return T @ A @ back, T @ B, np.broadcast_to(rows, C.shape)


def _modes(A: Real, B: Real, C: Real) -> tuple[Complex, Complex, Complex]:
    """Poles (h,) not below the real axis, with rows of B (h, m) and columns of C (m, h)."""
    poles, vectors = np.linalg.eig(A)
    drives, outputs = np.linalg.solve(vectors, B.astype(complex)), C @ vectors
    upper = poles.imag > -_APART * np.abs(poles).max()
    upper &= ~((poles.imag < 0) & (np.abs(poles.imag) <= _APART * np.abs(poles)))
    poles, drives, outputs = poles[upper], drives[upper], outputs[:, upper]
    return poles, drives, outputs


def _gauge(drives: Complex, outputs: Complex) -> Complex:
    """By what to multiply the outputs of a mode and divide its drives at every speed, (k,).

    Only their product is a matter of the system. The entry that is furthest from zero at all
    speeds is made one number at all of them, and the others are then as smooth as the product.

    Parameters
    ----------
    drives, outputs : array (k, m)
    """
    sizes = [np.linalg.norm(one, axis=1, keepdims=True) for one in (drives, outputs)]
    parts = np.hstack(
        [np.abs(one) / np.where(size > 0, size, 1.0)
         for one, size in zip((drives, outputs), sizes, strict=True)]
    )  # fmt: skip
    best = int(np.argmax(parts.min(axis=0)))
    entry = np.hstack([drives, outputs])[:, best]
    level = float(np.sqrt(np.mean(sizes[0] * sizes[1])))  # as large in what drives as in what shows
    entry = np.where(entry == 0, level, entry)
    return np.asarray(entry / level if best < drives.shape[1] else level / entry)


def _separate(poles: Complex) -> bool:
    distance = np.abs(poles[:, None] - poles[None, :]) + np.diag(np.full(poles.size, np.inf))
    return bool(distance.min(initial=np.inf) > _APART * np.abs(poles).max())


def _matched(before: Complex, poles: Complex) -> NDArray[np.intp] | None:
    """For each mode before its successor, or None where that is in doubt."""
    from scipy.optimize import linear_sum_assignment

    if before.size != poles.size:
        return None  # a pair has become real, or the other way
    distance = np.abs(before[:, None] - poles[None, :])
    _, match = linear_sum_assignment(distance**2)
    chosen = distance[np.arange(before.size), match]
    others = np.abs(poles[match][:, None] - poles[match][None, :])
    others += np.diag(np.full(poles.size, np.inf))
    if np.any(chosen > 0.5 * others.min(axis=1, initial=np.inf)):
        return None
    if np.any((before.imag != 0) != (poles[match].imag != 0)):
        return None
    return np.asarray(match)


def _real_form(poles: Complex, B: Complex, C: Complex) -> tuple[Real, Real, Real]:
    """Modes as blocks of one or two real states."""
    sizes = np.where(poles.imag != 0, 2, 1)
    n = int(sizes.sum())
    A, b, c = np.zeros((n, n)), np.zeros((n, B.shape[1])), np.zeros((C.shape[0], n))
    for at, size, pole, drive, output in zip(
        np.cumsum(sizes) - sizes, sizes, poles, B, C.T, strict=True
    ):
        A[at, at], b[at], c[:, at] = pole.real, drive.real, output.real
        if size == 2:  # x = Re z and Im z, y = 2 Re(c z)
            A[at : at + 2, at : at + 2] = [[pole.real, -pole.imag], [pole.imag, pole.real]]
            b[at + 1] = drive.imag
            c[:, at], c[:, at + 1] = 2 * output.real, -2 * output.imag
    return A, b, c
