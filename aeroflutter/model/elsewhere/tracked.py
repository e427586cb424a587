"""State spaces given at several speeds: of one set of states, or of states that differ.

Where every matrix has the same states, entries are splined. A reduced or balanced model has states
of its own at each speed; only what does not depend on the choice of states may be interpolated
then: poles, and what each contributes to the transfer function. Every system, closed by springs of
unit slope, is brought to its modes; modes are matched from one speed to the next, and splined.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from aeroflutter.errors import InputError
from aeroflutter.model.elsewhere.sampled import SplinedModel
from aeroflutter.model.section import Scale
from aeroflutter.model.system import Complex, Real

__all__ = ["same_states", "sampled", "tracked"]

_SMOOTH = 0.5  # of what a step of entries may be from the neighbours' straight line
_APART = 1e-7  # poles nearer than that share modes


def sampled(
    speeds: Sequence[float],
    A: Real,
    B: Real,
    C: Real,
    scale: Scale | None = None,
    *,
    same: bool | None = None,
    **names: Any,
) -> tuple[SplinedModel, tuple[str, ...]]:
    """A family through state spaces at several speeds, and what is to be said of it.

    Parameters
    ----------
    speeds : sequence of float
        Strictly increasing, at least two.
    A : array (k, n, n)
    B : array (k, n, m)
    C : array (k, m, n)
    scale : Scale, optional
    same : bool, optional
        Whether all speeds have the same states; found out by default.
    names : tuples of str
        As of a :class:`~aeroflutter.model.system.System`.

    Raises
    ------
    InputError
        If states differ and their modes cannot be followed.
    """
    if same_states(A, B, C) if same is None else same:
        return SplinedModel(speeds, A, B, C, scale=scale, **names), ()
    A, B, C = tracked(np.asarray(speeds), A, B, C)
    names.pop("state_names", None)
    note = "the states differ from speed to speed: modes were followed, and are what is splined"
    return SplinedModel(speeds, A, B, C, scale=scale, **names), (note,)


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
    forms = [
        _real_form(p[o], b[o], c[:, o])
        for p, b, c, o in zip(poles, left, right, order, strict=True)
    ]
    form, inputs, outputs = (np.array(part) for part in zip(*forms, strict=True))
    return form + inputs @ outputs, inputs, outputs


def _modes(A: Real, B: Real, C: Real) -> tuple[Complex, Complex, Complex]:
    """Poles (h,) of the upper half plane and the real axis, rows of B (h, m), columns of C (m, h).

    Each mode is as large in what drives it as in what it drives, and the largest of its outputs is
    real and positive, so that its numbers depend on the transfer function alone.
    """
    poles, vectors = np.linalg.eig(A)
    drives, outputs = np.linalg.solve(vectors, B.astype(complex)), C @ vectors
    upper = poles.imag > -_APART * np.abs(poles).max()
    upper &= ~((poles.imag < 0) & (np.abs(poles.imag) <= _APART * np.abs(poles)))
    poles, drives, outputs = poles[upper], drives[upper], outputs[:, upper]
    sizes = np.linalg.norm(drives, axis=1), np.linalg.norm(outputs, axis=0)
    ratio = np.sqrt(np.where(sizes[0] > 0, sizes[0], 1.0) / np.where(sizes[1] > 0, sizes[1], 1.0))
    largest = outputs[np.argmax(np.abs(outputs), axis=0), np.arange(len(poles))]
    turn = np.where(np.abs(largest) > 0, largest / np.where(largest == 0, 1.0, np.abs(largest)), 1)
    factor = ratio / turn
    return poles, drives / factor[:, None], outputs * factor


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
