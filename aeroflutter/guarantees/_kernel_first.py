"""Compiled: the first harmonic of a spring's answer to many motions, exactly.

The motions are y(θ) = Re Σ Y_k e^(jkθ); the answer's straight segments along each are integrated
in closed form.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.kernels import kernel
from aeroflutter.kernels.arrays import Complex2, Real1
from aeroflutter.orbits.harmonic._kernel_segments import extrema, loop_segments, static_segments

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


@kernel(entry=True)
def of_static(Y: Complex2, samples: int, breaks: Real1, slopes: Real1, offsets: Real1) -> Complex:
    """First harmonics (m,) of a static law's answer to motions Y (m, H+1)."""
    out = np.empty(Y.shape[0], dtype=np.complex128)
    for i in range(Y.shape[0]):
        turns = extrema(Y[i], samples)
        out[i] = _first(Y[i], static_segments(Y[i], turns, breaks, slopes, offsets))
    return out


@kernel(entry=True)
def of_loop(Y: Complex2, samples: int, friction: float, play: float) -> Complex:
    """The same of a hysteresis loop about zero on its periodic memory."""
    out = np.empty(Y.shape[0], dtype=np.complex128)
    for i in range(Y.shape[0]):
        turns = extrema(Y[i], samples)
        out[i] = _first(Y[i], loop_segments(Y[i], turns, friction, -friction, -play, play))
    return out


@kernel
def _first(Y: Complex, rows: Real) -> complex:
    """(1/π) ∫ (slope·y + offset) e^(-jθ) dθ over the segments."""
    total = 0j
    for i in range(rows.shape[0]):
        start, end, slope, offset = rows[i, 0], rows[i, 1], rows[i, 2], rows[i, 3]
        za, zb = complex(np.cos(start), -np.sin(start)), complex(np.cos(end), -np.sin(end))
        total += offset * 1j * (zb - za)
        if slope == 0.0:
            continue
        # y e^(-jθ) = ½ Σ Y_k e^(j(k-1)θ) + conj(Y_k) e^(-j(k+1)θ)
        part = 2.0 * Y[0].real * 1j * (zb - za)
        below_a, below_b, above_a, above_b = za.conjugate(), zb.conjugate(), za * za, zb * zb
        part += Y[1] * (end - start) + Y[1].conjugate() * 0.5j * (above_b - above_a)
        for k in range(2, Y.size):
            above_a *= za
            above_b *= zb
            part += Y[k] * (below_b - below_a) / (1j * (k - 1))
            part += Y[k].conjugate() * 1j * (above_b - above_a) / (k + 1)
            below_a *= za.conjugate()
            below_b *= zb.conjugate()
        total += 0.5 * slope * part
    return total / np.pi
