"""How far from a sinusoid the motion is: the harmonics that the describing function leaves out.

The spring's answer to the sinusoid has harmonics F_k; the loop turns them into harmonics of pitch

    a_k = -F_k / (1/G(j k ω) + s),

where s, the mean slope of the spring along the sinusoid, closes the loop to first order. (Not
dF₀/dB, which is the same without memory: a loop that never meets its stops follows its mean
without a moment, so that dF₀/dB jumps at A = D + δ while the motion does not.) The distortion is
the norm of a_2 … a_K over the amplitude: where it is not small, the describing function should
not be believed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.model.lure import inverse_transfer
from aeroflutter.orbits.describing.balance import Balance
from aeroflutter.springs import Describing, Hysteresis, Spring, respond

__all__ = ["answer_harmonics", "harmonics", "mean_slope"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


def answer_harmonics(
    spring: Spring, amplitude: Array, bias: Array, highest: int, samples: int
) -> Complex:
    """Harmonics of the spring's steady answer to α = bias + amplitude·sin θ.

    Returns
    -------
    array (m, highest + 1)
        F_k in F = F_0 + Re Σ F_k e^{jkθ} (so that F_1 = -j N A), from `samples` a period.
    """
    theta = 2 * np.pi * np.arange(-samples, samples) / samples - np.pi / 2
    # The first period, which starts at the lowest pitch, makes the memory that of a steady loop.
    alpha = bias + amplitude * np.sin(theta)[:, None]
    moment, _ = respond(spring, alpha)
    spectrum = np.fft.rfft(moment[samples:], axis=0)[: highest + 1] / samples
    turns = np.exp(1j * np.arange(highest + 1) * np.pi / 2)
    found: Complex = (spectrum * turns[:, None]).T
    found[:, 1:] *= 2
    return found


def mean_slope(spring: Spring, amplitude: Array, bias: Array, d: Describing) -> Array:
    """Slope dF/dα averaged over the motion α = bias + amplitude·sin θ, (m,).

    Parameters
    ----------
    d
        Describing function of the motion: without memory its dF₀/dB is the mean slope.
    """
    if not isinstance(spring, Hysteresis):
        return d.dF0_dB
    # the slider slides over [bottom, top], upwards at the moment v1 and downwards at v2
    top = np.clip(bias + amplitude - spring.v1, spring.h_low, spring.h_high)
    bottom = np.clip(bias - amplitude - spring.v2, spring.h_low, spring.h_high)
    top = np.maximum(top, bottom)

    def angle(pitch: Array) -> Array:
        return np.arcsin(np.clip((pitch - bias) / amplitude, -1.0, 1.0))

    slid = sum(angle(top + level) - angle(bottom + level) for level in (spring.v1, spring.v2))
    return np.asarray(1.0 - slid / (2 * np.pi))


def harmonics(balance: Balance, y: Array, d: Describing, highest: int, samples: int) -> Complex:
    """Predicted harmonics 2 … `highest` of the motion over its amplitude, (m, highest - 1)."""
    A, B, U, k = balance.unpack(y)
    answer = answer_harmonics(balance.spring, A, B, highest, samples)[:, 2:]
    orders = np.arange(2, highest + 1)
    matrices, b = balance.family.stack(U)
    Z = inverse_transfer(matrices[:, None], b[:, None], balance.family.c, 1j * k[:, None] * orders)
    slope = mean_slope(balance.spring, A, B, d)
    return np.asarray(-answer / (Z + slope[:, None]) / A[:, None])
