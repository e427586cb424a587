"""Starts for the search: sinusoids of the describing function, end states of the exact engine."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.cycles.centre import static_state
from aeroflutter.cycles.loop import Loop
from aeroflutter.cycles.shooting import Shooting
from aeroflutter.springs import Hysteresis

__all__ = ["sinusoid"]

Array = NDArray[np.float64]


def sinusoid(shooting: Shooting, amplitude: float, bias: float, speed: float, k: float) -> Array:
    """Start q of the forced response to the moment of y = bias + amplitude cos kτ.

    Parameters
    ----------
    amplitude, bias, speed, k
        A cycle by the describing function.
    """
    loop = shooting.loop
    A, b = loop.family.stack(speed)
    N = complex(loop.spring.describing(amplitude, bias).N)
    wave = np.linalg.solve(1j * k * np.eye(loop.n) - A, -b * N * amplitude)
    mean = static_state(loop.family, speed, bias)
    angle, memory = _start(loop, amplitude, bias)
    x = mean + (wave * np.exp(1j * angle)).real
    z = np.append(x, memory) if loop.memory else x
    return shooting.pack(z, 2 * np.pi / k, speed)


def _start(loop: Loop, amplitude: float, bias: float) -> tuple[float, float]:
    """Angle after the maximum at which shooting starts, and the memory there."""
    spring = loop.spring
    if not isinstance(spring, Hysteresis):
        return 0.0, 0.0
    top = bias + amplitude
    memory = float(np.clip(top - spring.v1, spring.h_low, spring.h_high))
    return float(np.arccos(np.clip((memory + spring.v_off - bias) / amplitude, -1, 1))), memory
