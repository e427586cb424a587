"""Stability of cycles by quasi-static rules, as far as a describing function can tell."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeroflutter.orbits.describing.balance import AMPLITUDE, SPEED, Balance
from aeroflutter.orbits.describing.scan import closed_eigenvalues
from aeroflutter.springs import Describing

__all__ = ["Stability", "growing_others", "stability"]

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_NEUTRAL = 1e-9
_REAL = 0.2  # a growing root with |Im| below this fraction of Re counts as one of a split pair


class Stability(NamedTuple):
    """What the quasi-static rules say of cycles, fields of shape (m,).

    Attributes
    ----------
    drift
        A d(Re λ)/dA at fixed speed, the bias following: the cycle attracts where it is negative.
    slope
        dU/dA along the curve, radians⁻¹; where damping falls with speed, the cycle is stable
        where this is positive (the sign rule).
    others
        Number of other growing roots of A - N b c.
    bias_stable
        Whether the mean returns after a push at fixed amplitude (stiffness dF₀/dB).
    rules_agree
        Whether the sign rule and the drift say the same (or the drift is zero).
    stable
        drift < 0, no other growing root, and a stable bias.
    """

    drift: Array
    slope: Array
    others: NDArray[np.int64]
    bias_stable: Flags
    rules_agree: Flags
    stable: Flags


def stability(balance: Balance, y: Array, d: Describing) -> Stability:
    """Stability of the cycles y (m, 4) with describing functions d."""
    A, _, U, k = balance.unpack(y)
    loop = balance.loop(U, k)
    stiffness = loop.Z0 + d.dF0_dB
    free = balance.biased & (np.abs(stiffness) > _NEUTRAL)
    dB_dA = np.where(free, -d.dF0_dA / np.where(free, stiffness, 1.0), 0.0)
    dN_dA = d.dn_p_dA + d.dn_p_dB * dB_dA + 1j * (d.dn_q_dA + d.dn_q_dB * dB_dA)
    slope = _slope(balance, y)
    if balance.multiplicity == 1:
        drift = A * (-dN_dA / loop.Z_s).real
    else:  # a double root splits with infinite speed: only its side is known
        drift = -np.sign(slope)
    others = growing_others(
        closed_eigenvalues(balance.family, U, d.n_p, d.n_q), k, balance.multiplicity
    )
    bias_stable = _bias_stable(balance, U, d.dF0_dB)
    attracts, neutral = drift < -_NEUTRAL * k, np.abs(drift) <= _NEUTRAL * k
    return Stability(
        drift,
        slope,
        others,
        bias_stable,
        neutral | ((slope > 0) == attracts),
        attracts & (others == 0) & bias_stable,
    )


def _slope(balance: Balance, y: Array) -> Array:
    """dU/dA along the curve; infinite where the amplitude turns."""
    A, _, U, _ = balance.unpack(y)
    tangent = np.linalg.svd(balance.evaluate(y)[1])[2][:, -1]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(U * tangent[:, SPEED] / (A * tangent[:, AMPLITUDE]))


def growing_others(roots: NDArray[np.complex128], k: Array, multiplicity: int) -> NDArray[np.int64]:
    """Growing roots besides the cycle's own.

    A complex N belongs to roots with positive imaginary part. A pair that has turned real still
    grows: two real ones count as one oscillatory; a single real one is left to the bias.
    """
    own = np.argsort(np.abs(roots - 1j * k[:, None]), axis=1)[:, :multiplicity]
    size = np.max(np.abs(roots), axis=1, keepdims=True, initial=0.0)
    growing = roots.real > _NEUTRAL * size
    np.put_along_axis(growing, own, False, axis=1)
    real = np.abs(roots.imag) <= _REAL * roots.real
    oscillating = np.sum(growing & ~real & (roots.imag > 0), axis=1)
    return np.asarray(oscillating + np.sum(growing & real, axis=1) // 2, dtype=np.int64)


def _bias_stable(balance: Balance, U: Array, stiffness: Array) -> Flags:
    """Whether A - (dF₀/dB) b c has an even number of growing real roots (none diverges)."""
    A, b = balance.family.stack(U)
    feedback = b[:, :, None] * balance.family.c
    open_loop, unit = np.linalg.det(-A), np.linalg.det(feedback - A)
    value = open_loop + stiffness * (unit - open_loop)
    return np.asarray(value >= -1e-9 * (np.abs(open_loop) + np.abs(unit - open_loop)))
