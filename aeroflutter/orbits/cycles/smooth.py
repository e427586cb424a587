"""The flow of polynomials and what is beside them at one speed, as shooting sees it: by series."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from aeroflutter.errors import ConvergenceError
from aeroflutter.model.family import Family
from aeroflutter.model.system import System
from aeroflutter.motion.chaos.smooth_window import passage
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
HUGE = 1e100
SAMPLES = 1024  # of a cycle, between which extremes are looked for


class SmoothFlow:
    """Laws of which one has no straight pieces: the same as `loop.Flow` of those.

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
        named = family.names, family.units, family.state_names
        system = System(self.A, self.B, self.C, self.d, *named)
        self.loop = SmoothLoop.of(system, springs, (self.dA, self.dB))

    def rate(self, z: Array) -> Array:
        """z' at a point where the memories are at rest, (N,)."""
        rate = np.zeros(z.size)
        rate[: self.loop.system.order] = self.loop.rate(z)
        return rate

    def moments(self, z: Array) -> tuple[Array, Array]:
        """F at a point and its slope in y, (m,) each."""
        return self.loop.moments(z), self.loop.slopes(z)

    def passage(self, z: Array, duration: float) -> Passage:
        """The motion from z over a duration, linearised; see `motion.flow.Flow.passage`."""
        return passage(self.loop, z, duration, CLOSE)

    def trace(self, z: Array, duration: float, samples: int) -> Trace:
        """The motion from z over a duration, sampled; see `motion.flow.Flow.trace`."""
        size = float(np.max(np.abs(z))) or 1.0
        limits = Limits(duration / samples, HUGE, duration, size, duration)
        motion = stepper_of(self.loop, z, limits)
        stretch = motion.march(duration)
        if stretch.failure or not np.all(np.isfinite(motion.state)):
            raise ConvergenceError("the motion does not stay bounded and regular over a period")
        points = np.vstack((z, stretch.samples))[:samples]
        turns = np.column_stack((stretch.turns, np.ones(len(stretch.turns))))
        if len(turns):  # maxima and minima take turns
            turns[1::2, 2] = -1.0
            turns[:, 2] *= -np.sign(self._bend(float(turns[0, 0]), z))
        states, memory = self.loop.state(points), self.loop.memories(points)
        moments = self.loop.forces(points)
        return Trace(motion.state, states, memory[:, 0], turns, stretch.events, memory, moments)

    def extremes(self, z: Array, period: float, rows: Array) -> tuple[Array, Array]:
        """Lowest and highest of rows @ x on the cycle through z."""
        trace = self.trace(z, period, SAMPLES)
        rates = trace.states @ self.A.T - trace.moments @ self.B.T + self.d
        return extremes(trace.states, rates, period / SAMPLES, rows)

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
            yield flow.loop.point(run.final_state, run.final_memory), run.period
