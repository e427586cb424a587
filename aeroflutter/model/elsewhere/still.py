"""States that have no part in the loop and neither grow nor decay.

A rigid motion that no spring feels, a mode that no force touches: such states oscillate or drift
for ever by themselves, move nothing that is asked for, and would have every analysis call a cycle
neutral. They are found by what is zero in the matrices at every speed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.model.system import Real

__all__ = ["still_states"]

_NEUTRAL = 1e-9  # |Re p| of a neutral root, over the largest |p| of its block


def still_states(A: Real, B: Real, C: Real) -> NDArray[np.bool_]:
    """Which states may be left out without a change of the transfer function, (n,).

    Parameters
    ----------
    A : array (k, n, n)
    B : array (k, n, m)
    C : array (k, m, n)
        At several speeds.

    Returns
    -------
    array (n,)
        True for the states of every block that is not on a way from an input to an output and
        whose roots are neutral at every speed. Blocks are the strongly connected components of the
        states, one acting on another where an entry of ``A`` is not zero at some speed.
    """
    from scipy.sparse.csgraph import connected_components

    acts = np.any(A, axis=0)  # acts[i, j]: state j acts on state i
    driven = _reached(acts, np.any(B, axis=(0, 2)))
    felt = _reached(acts.T, np.any(C, axis=(0, 1)))
    still = np.zeros(len(acts), dtype=bool)
    count, block = connected_components(acts, directed=True, connection="strong")
    for number in range(count):
        own = np.flatnonzero(block == number)
        if not np.any(driven[own] & felt[own]) and _neutral(A[:, own[:, None], own]):
            still[own] = True
    return still


def _reached(acts: NDArray[np.bool_], start: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which states some of them act on, by however many others, themselves included."""
    found = start
    while True:
        more = found | np.any(acts[:, found], axis=1)
        if np.array_equal(more, found):
            return found
        found = more


def _neutral(A: Real) -> bool:
    roots = np.linalg.eigvals(A)
    size = np.abs(roots).max(axis=1, keepdims=True)
    return bool(np.all(np.abs(roots.real) <= _NEUTRAL * size))
