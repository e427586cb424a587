"""A window of a motion and its tangents: Taylor series for polynomials, DOP853 for others."""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from aeroflutter.motion._kernel_taylor import FULL
from aeroflutter.motion.chaos import _kernel_tangents as kernel
from aeroflutter.motion.smooth_steps import scalar_law

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from aeroflutter.model.lure import LureSystem
    from aeroflutter.springs import Spring

    Array = NDArray[np.float64]

__all__ = ["along", "slope_law"]

RTOL = 1e-9
STEPS_A_PERIOD = 4
TURNS = 64  # turning points found before the kernel comes back for room
DIFFERENCE = 6e-6  # cube root of round-off: the best step of a central difference


class Motion(Protocol):
    """A motion that goes on from window to window."""

    def __call__(self, x: Array, tangents: Array) -> tuple[Array, Array, Array]:
        """State (n,), tangents (n, k) and turning points of the next window.

        A turning point is its time, 1 at maxima and -1 at minima, and the state there: (m, 2 + n).
        """


def along(system: LureSystem, spring: Spring, x: Array, window: float, shortest: float) -> Motion:
    """The motion from a state in windows of one length.

    Parameters
    ----------
    shortest
        Shortest period of oscillation; DOP853 takes steps in which no turning point hides.
    """
    powers = spring.polynomial()
    if powers is not None:
        return _Series(system, powers, window)
    longest_step = min(window, shortest) / STEPS_A_PERIOD
    return _Dop853(system, spring, window, longest_step, float(np.abs(x).max()) or 1.0)


class _Series:
    """See `_kernel_tangents`."""

    def __init__(self, system: LureSystem, powers: tuple[float, ...], window: float) -> None:
        self.law = system.A, system.b, system.c, np.array(powers)
        self.window, self.slope = window, 0.0

    def __call__(self, x: Array, tangents: Array) -> tuple[Array, Array, Array]:
        x, tangents, time = x.copy(), np.ascontiguousarray(tangents), 0.0
        turns, status = [], FULL
        while status == FULL:
            room = np.empty((TURNS, 2 + x.size))
            status, time, self.slope, found = kernel.march(
                *self.law, x, tangents, time, self.window, self.slope, room
            )
            turns.append(room[:found])
        return x, tangents, np.concatenate(turns)


@dataclass(frozen=True)
class _Turn:
    """Slope y' of the motion, as an event of SciPy: falling at maxima, rising at minima."""

    system: LureSystem
    moment: Callable[[float], float]
    direction: int

    def __call__(self, _: float, z: Array) -> float:
        c, b = self.system.c, self.system.b
        x = z.reshape(c.size, -1)[:, 0]
        return float(c @ (self.system.A @ x)) - float(c @ b) * self.moment(float(c @ x))


class _Dop853:
    """Motion and tangents as one vector."""

    def __init__(
        self, system: LureSystem, spring: Spring, window: float, longest_step: float, size: float
    ) -> None:
        self.A, self.b, self.c = system.A, system.b, system.c
        self.moment, self.slope = scalar_law(spring), slope_law(spring)
        self.turns = _Turn(system, self.moment, -1), _Turn(system, self.moment, 1)
        self.window, self.longest_step, self.size = window, longest_step, size
        self.first_step: float | None = None

    def __call__(self, x: Array, tangents: Array) -> tuple[Array, Array, Array]:
        from scipy.integrate import solve_ivp

        start = np.column_stack((x, tangents))
        scale = np.ones_like(start)
        scale[:, 0] = self.size
        found: Any = solve_ivp(
            self._rate, (0.0, self.window), start.ravel(), method="DOP853",
            events=self.turns, rtol=RTOL, atol=RTOL * scale.ravel(),
            max_step=self.longest_step, first_step=self.first_step,
        )  # fmt: skip
        self.first_step = float(np.median(np.diff(found.t)))
        end = found.y[:, -1].reshape(x.size, -1)
        turns = [
            np.array([time, side, *z.reshape(x.size, -1)[:, 0]])
            for side, times, states in zip((1, -1), found.t_events, found.y_events, strict=True)
            for time, z in zip(times, states, strict=True)
        ]
        turns.sort(key=lambda turn: float(turn[0]))
        return end[:, 0].copy(), end[:, 1:], np.array(turns).reshape(-1, 2 + x.size)

    def _rate(self, _: float, z: Array) -> Array:
        """Motion and tangents, (n (1 + k),)."""
        columns = z.reshape(self.c.size, -1)
        change = self.A @ columns
        y = self.c @ columns
        pitch = float(y[0])
        y[0], y[1:] = self.moment(pitch), self.slope(pitch) * y[1:]
        change -= np.outer(self.b, y)
        return change.ravel()


def slope_law(spring: Spring) -> Callable[[float], float]:
    """Incremental slope of a smooth spring at one pitch."""
    powers = spring.polynomial()
    if powers is not None:
        steep = [i * b for i, b in enumerate(powers, start=1)][::-1]
        return lambda y: reduce(lambda value, b: value * y + b, steep, 0.0)
    step = DIFFERENCE * spring.scale
    law = scalar_law(spring)
    return lambda y: (law(y + step) - law(y - step)) / (2.0 * step)
