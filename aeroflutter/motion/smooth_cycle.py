"""The attracting cycle that a motion with a smooth spring has settled on, by Newton's method."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.motion.chaos.smooth_window import passage
from aeroflutter.motion.smooth_steps import Limits, stepper_of
from aeroflutter.motion.swings import extremes, rows_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from aeroflutter.motion.smooth_laws import SmoothLoop

    Array = NDArray[np.float64]

__all__ = ["settled_cycle"]

SAMPLES = 512  # of a period
NEWTON = 8  # iterations
NEAR = 1e-2
CLOSED = 1e3  # times the tolerance of the march, in sizes
ONE = 1e-7  # from one: the multiplier of a memory of which all values do


def settled_cycle(
    loop: SmoothLoop, state: Array, period: float, limits: Limits, near: float = NEAR
) -> dict[str, Any] | None:
    """Measures of the cycle next to a state, None if Newton's method does not find it.

    The unknowns are the point and the period.

    Parameters
    ----------
    state, period
        A point near the cycle, (N,), and about how long it takes.
    near
        Of the size of the motion: a cycle farther away is another one.

    Returns
    -------
    dict
        amplitude, bias, period, first_harmonic; multiplier: the largest but the trivial one;
        swings: lowest and highest of all coordinates and springs.
    """
    orbit = _Orbit(loop, limits)
    x, T, sizes = state.copy(), period, orbit.sizes(state, period)
    along = np.zeros(x.size)  # the start may not move along the motion
    along[: loop.system.order] = loop.rate(x) / loop.state(sizes) ** 2
    for _ in range(NEWTON):
        end, rate, monodromy = orbit.shot(x, T, sizes)
        left = (end - x) / sizes
        if np.max(np.abs(left)) < CLOSED * orbit.tolerance:
            close = np.max(np.abs(x - state) / sizes) < near
            return orbit.measures(x, T, monodromy) if close else None
        matrix = np.zeros((x.size + 1, x.size + 1))
        matrix[:-1, :-1] = monodromy - np.eye(x.size)
        matrix[:-1, -1] = rate / sizes
        matrix[-1, :-1] = along * sizes
        step = np.linalg.lstsq(matrix, -np.append(left, 0.0), rcond=None)[0]
        x, T = x + sizes * step[:-1], T + float(step[-1])
        if not (np.all(np.isfinite(step)) and 0.5 < T / period < 2.0):
            return None
    return None


class _Orbit:
    """Motions of one loop from any state for any time."""

    def __init__(self, loop: SmoothLoop, limits: Limits) -> None:
        self.loop, self.limits = loop, limits
        start = np.zeros(loop.system.order + loop.held.size)
        self.tolerance = stepper_of(loop, start, limits).tolerance

    def march(self, x: Array, time: float, dt: float) -> tuple[Array, Array, Array]:
        """Where a motion ends, its samples and its turning points."""
        limits = self.limits._replace(dt=dt, bound=np.inf, time=time)
        motion = stepper_of(self.loop, x, limits)
        stretch = motion.march(time)
        return motion.state, np.vstack((x, stretch.samples)), stretch.turns

    def sizes(self, x: Array, period: float) -> Array:
        """Largest modulus of every state over a period, and not much less than the largest."""
        largest = np.max(np.abs(self.march(x, period, period / SAMPLES)[1]), axis=0)
        return np.asarray(np.maximum(largest, 1e-6 * largest.max()))

    def shot(self, x: Array, period: float, sizes: Array) -> tuple[Array, Array, Array]:
        """End of a motion, its rate there, and its sensitivity to the start in sizes."""
        found = passage(self.loop, x, period, self.tolerance)
        return found.end, found.rate, found.jacobian[:, :-1] * sizes / sizes[:, None]

    def measures(self, x: Array, period: float, monodromy: Array) -> dict[str, Any]:
        """What there is to say of a cycle."""
        _, samples, _ = self.march(x, period, period / SAMPLES)
        turns = self.march(x, 2.0 * period, period)[2][:, 1]
        pitch = self.loop.state(samples[:SAMPLES]) @ self.loop.system.C[0]
        rates = self.loop.rates(samples[: SAMPLES + 1])
        states = self.loop.state(samples[: SAMPLES + 1])
        rows = rows_of(self.loop.system)
        proper = np.linalg.eigvals(monodromy)
        for i in range(1 + self.loop.held.size):  # a loop that sticks, or may sit anywhere, has one
            nearest = int(np.argmin(np.abs(proper - 1.0)))
            if i == 0 or abs(proper[nearest] - 1.0) < ONE:
                proper = np.delete(proper, nearest)
        return {
            "amplitude": 0.5 * float(turns.max() - turns.min()),
            "bias": 0.5 * float(turns.max() + turns.min()),
            "period": period,
            "first_harmonic": 2.0 * float(np.abs(np.fft.rfft(pitch)[1])) / SAMPLES,
            "multiplier": float(np.abs(proper).max()),
            "swings": extremes(states, rates, period / SAMPLES, rows),
        }
