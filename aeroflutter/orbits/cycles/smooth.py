"""The flow of laws without memory at one speed, as shooting sees it: Taylor series to round-off."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from aeroflutter.errors import ConvergenceError
from aeroflutter.model.family import Family
from aeroflutter.model.system import System
from aeroflutter.motion.chaos.smooth_window import along_loop
from aeroflutter.motion.flow import Passage, Trace
from aeroflutter.motion.response import Initial, SimulateOptions, simulate
from aeroflutter.motion.smooth_laws import SmoothLoop
from aeroflutter.motion.smooth_steps import Limits, stepper_of
from aeroflutter.motion.swings import extremes

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from aeroflutter.springs import Spring

    Array = NDArray[np.float64]

__all__ = ["SmoothFlow", "settled"]

CLOSE = 1e-12  # tolerance of DOP853, where there are no series: cycles close to ten digits
DIFFERENCE = 6e-6  # cube root of round-off: the best step of a central difference
HUGE = 1e100
SAMPLES = 1024  # of a cycle, between which extremes are looked for


class SmoothFlow:
    """Laws without memory at one speed: the same as `loop.Flow` of straight pieces.

    Parameters
    ----------
    family, springs
        What is closed by what.
    speed
        U*.
    """

    def __init__(self, family: Family, springs: tuple[Spring, ...], speed: float) -> None:
        self.A, self.B, self.C, self.d = family.stack(speed)
        self.dA, self.dB, _, _ = family.derivative(speed)
        if not np.all(np.isfinite(self.A)):
            raise ConvergenceError("the system is not finite at this speed")
        self.springs, self.speed = springs, speed
        self._named = family.names, family.units, family.state_names
        self.loop = self._at(0.0)

    def _at(self, step: float) -> SmoothLoop:
        """The loop at a speed that differs by so much, to first order."""
        A, B = self.A + step * self.dA, self.B + step * self.dB
        return SmoothLoop.of(System(A, B, self.C, self.d, *self._named), self.springs)

    def rate(self, z: Array) -> Array:
        """z' at a point, (n,)."""
        return self.loop.rate(z)

    def moments(self, z: Array) -> tuple[Array, Array]:
        """F at a point and its slope in y, (m,) each."""
        y = self.C @ z
        return self.loop.moments(y), self.loop.slopes(y)

    def passage(self, z: Array, duration: float) -> Passage:
        """The motion from z over a duration, linearised; see `motion.flow.Flow.passage`."""
        n = z.size
        jacobian = np.empty((n, n + 1))
        motion = along_loop(self.loop, z, duration, duration, CLOSE)
        end, jacobian[:, :n], _ = motion(z, np.eye(n))
        step = DIFFERENCE * abs(self.speed)
        rise = self._end(z, duration, step) - self._end(z, duration, -step)
        jacobian[:, n] = rise / (2.0 * step)
        if not (np.all(np.isfinite(end)) and np.all(np.isfinite(jacobian))):
            raise ConvergenceError("the motion does not stay bounded and regular over a period")
        return Passage(end, jacobian, self.rate(end), ())

    def _end(self, z: Array, duration: float, step: float) -> Array:
        motion = stepper_of(self._at(step), z, Limits(duration, HUGE, duration, 1.0, duration))
        motion.march(duration)
        return motion.state

    def trace(self, z: Array, duration: float, samples: int) -> Trace:
        """The motion from z over a duration, sampled; see `motion.flow.Flow.trace`."""
        size = float(np.max(np.abs(z))) or 1.0
        limits = Limits(duration / samples, HUGE, duration, size, duration)
        motion = stepper_of(self.loop, z, limits)
        stretch = motion.march(duration)
        if stretch.failure or not np.all(np.isfinite(motion.state)):
            raise ConvergenceError("the motion does not stay bounded and regular over a period")
        states = np.vstack((z, stretch.samples))[:samples]
        turns = np.column_stack((stretch.turns, np.ones(len(stretch.turns))))
        if len(turns):  # maxima and minima take turns
            turns[1::2, 2] = -1.0
            turns[:, 2] *= -np.sign(self._bend(float(turns[0, 0]), z))
        moments = self.loop.forces(states)
        memory = np.zeros((len(states), len(self.springs)))
        return Trace(motion.state, states, memory[:, 0], turns, np.empty((0, 6)), memory, moments)

    def extremes(self, z: Array, period: float, rows: Array) -> tuple[Array, Array]:
        """Lowest and highest of rows @ x on the cycle through z."""
        states = self.trace(z, period, SAMPLES).states
        return extremes(states, self.loop.rates(states), period / SAMPLES, rows)

    def _bend(self, time: float, z: Array) -> float:
        """y'' at a time."""
        motion = stepper_of(self.loop, z, Limits(time or 1.0, HUGE, time, 1.0, time or 1.0))
        motion.march(time)
        return self.loop.bend(motion.state)


def settled(flow: SmoothFlow, states: Array, duration: float) -> Iterator[tuple[Array, float]]:
    """Points and periods of the cycles that motions are seen to settle on, (k, n) starts."""
    options = SimulateOptions(record=False, duration=duration if np.isfinite(duration) else None)
    for state in states:
        run = simulate(flow.loop.system, flow.springs, Initial(state=state), options)
        if run.state == "lco" and np.isfinite(run.period):
            yield run.final_state, run.period
