"""Cycles of one fixed system: where ``G(j omega) N(A) = -1``, whatever the system is."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.errors import InputError
from aeroflutter.model.lure import FixedFamily, LureSystem
from aeroflutter.orbits.describing.balance import AMPLITUDE, FREQUENCY, SPEED, Balance
from aeroflutter.orbits.describing.options import linear_limit
from aeroflutter.orbits.describing.scan import candidates, closed_eigenvalues, distinct
from aeroflutter.springs import Spring

__all__ = ["describing_intersections"]

_STATIONS = 400  # amplitudes at which the roots of A - N b c are looked at
_LARGE, _LARGEST = 1e3, 1e9  # amplitudes over the law's scale: beyond the first, N hardly changes
_FAR = 60  # amplitudes between those


def describing_intersections(
    system: LureSystem, spring: Spring, amplitude_range: tuple[float, float] | None = None
) -> NDArray[np.float64]:
    """Amplitude and frequency of every unbiased cycle of a fixed system.

    Parameters
    ----------
    system
        Any linear system with one scalar feedback.
    spring
        An odd law; biased cycles need the curve over speed.
    amplitude_range
        Lowest and highest amplitude; by default from where the law becomes nonlinear to a
        billion times its scale.

    Returns
    -------
    array (m, 2)
        Amplitude and frequency (per unit of the system's own time), by amplitude.

    Raises
    ------
    InputError
        If the law is not odd, or the range is empty.
    """
    if not spring.odd:
        raise InputError("spring: must be odd; cycles of others have a bias")
    low, high = amplitude_range or (
        linear_limit(spring) or 1e-3 * spring.scale,
        _LARGEST * spring.scale,
    )
    if not 0 < low < high < np.inf:
        raise InputError(f"amplitude_range: needs 0 < low < high, finite, not {(low, high)!r}")
    balance = Balance(FixedFamily(system), spring, False)
    amplitudes = np.geomspace(low, high, _STATIONS)
    if amplitude_range is None:
        near = np.geomspace(low, _LARGE * spring.scale, _STATIONS)
        amplitudes = np.append(near, np.geomspace(near[-1], high, _FAR)[1:])
    d = spring.describing(amplitudes, 0.0)
    speeds = np.ones(amplitudes.size)  # any: the system does not depend on it
    roots = closed_eigenvalues(balance.family, speeds, d.n_p, d.n_q)
    successor = np.append(np.arange(1, amplitudes.size), -1)
    guesses = [
        balance.pack(
            amplitudes[i] ** (1 - t) * amplitudes[j] ** t, np.zeros(t.size), np.ones(t.size), k
        )
        for i, j, t, k in candidates(roots, successor)
        if t.size
    ]
    if not guesses:
        return np.empty((0, 2))
    found, converged = balance.solve(np.concatenate(guesses), np.eye(4)[SPEED])
    inside = (found[:, AMPLITUDE] >= np.log(low)) & (found[:, AMPLITUDE] <= np.log(high))
    kept = found[distinct(found, converged & inside)]
    return np.exp(kept[:, [AMPLITUDE, FREQUENCY]])
