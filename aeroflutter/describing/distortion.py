"""How far from a sinusoid the motion is: the harmonics that the describing function leaves out.

The spring's answer to the sinusoid has harmonics F_k; the loop turns them into harmonics of pitch

    a_k = -F_k / (1/G(j k ω) + s),    s = dF₀/dB,

where s, the mean incremental slope of the spring under the sinusoid, closes the loop to first
order. The distortion is the norm of a_2 … a_K over the amplitude: where it is not small, the
describing function should not be believed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.describing.balance import Balance
from aeroflutter.lure import inverse_transfer
from aeroflutter.springs import Describing, Spring, respond

__all__ = ["answer_harmonics", "harmonics"]

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


def harmonics(balance: Balance, y: Array, d: Describing, highest: int, samples: int) -> Complex:
    """Predicted harmonics 2 … `highest` of the motion over its amplitude, (m, highest - 1)."""
    A, B, U, k = balance.unpack(y)
    answer = answer_harmonics(balance.spring, A, B, highest, samples)[:, 2:]
    orders = np.arange(2, highest + 1)
    matrices, b = balance.family.stack(U)
    Z = inverse_transfer(matrices[:, None], b[:, None], balance.family.c, 1j * k[:, None] * orders)
    return np.asarray(-answer / (Z + d.dF0_dB[:, None]) / A[:, None])
