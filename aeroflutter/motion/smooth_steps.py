"""Steps along a motion: Taylor series for laws of polynomial pieces, DOP853 for others."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from aeroflutter.motion import _kernel_taylor as kernel
from aeroflutter.motion.smooth_laws import SmoothLoop

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from aeroflutter.model.lure import AnySystem
    from aeroflutter.motion.smooth_laws import Pieces
    from aeroflutter.springs import Springs

    Array = NDArray[np.float64]

__all__ = ["Limits", "Stepper", "Stretch", "stepper", "stepper_of"]

RTOL = 1e-11
TURNS = 256  # turning points, or switches, found before the kernel comes back for room


class Stretch(NamedTuple):
    """A part of a motion.

    Attributes
    ----------
    samples
        Points at the multiples of dt in it, (m, N).
    turns
        Time and y of the turning points in it, (k, 2).
    events
        Switches in it, (j, EVENT_COLUMNS), see `_kernel_taylor`; DOP853 tells none.
    failure
        Why the march cannot go on; empty if it can.
    """

    samples: Array
    turns: Array
    events: Array
    failure: str = ""


class Stepper(Protocol):
    """A motion that is marched on from where it is."""

    tolerance: float

    @property
    def time(self) -> float:
        """Time reached."""

    @property
    def state(self) -> Array:
        """The point there: state and memories, (N,)."""

    def march(self, until: float) -> Stretch:
        """March to a time, or a little further, or to where |y| has passed the bound."""


class Limits(NamedTuple):
    """What bounds a march.

    Attributes
    ----------
    dt
        Spacing of the samples.
    bound
        |y| beyond which it stops.
    time
        When it ends at the latest.
    size
        Size of the motion, of which DOP853 neglects a part.
    step
        Longest step in which DOP853 overlooks no turning point.
    """

    dt: float
    bound: float
    time: float
    size: float
    step: float


def stepper(system: AnySystem, spring: Springs, state: Array, limits: Limits) -> Stepper:
    """The stepper of a system and its spring, or springs."""
    return stepper_of(SmoothLoop.of(system, spring), state, limits)


def stepper_of(loop: SmoothLoop, state: Array, limits: Limits) -> Stepper:
    """The stepper of a loop."""
    if loop.pieces is not None:
        return _Taylor(loop.pieces, state, limits)
    return _Dop853(loop, state, limits)


class _Taylor:
    """Series to round-off; see `_kernel_taylor`."""

    tolerance = float(np.finfo(float).eps)

    def __init__(self, pieces: Pieces, point: Array, limits: Limits) -> None:
        self.law, self.limits = pieces.law, limits
        self.rows, self.state = pieces.begin(point)
        self.time, self.slope = 0.0, 0.0

    def march(self, until: float) -> Stretch:
        """See `Stepper`."""
        samples, turns, events, status = [], [], [], kernel.FULL
        dt, bound = self.limits.dt, self.limits.bound
        while status == kernel.FULL:
            room = np.empty((int((until - self.time) / dt) + 2, self.state.size))
            turn, event = np.empty((TURNS, 2)), np.empty((TURNS, kernel.EVENT_COLUMNS))
            status, self.time, self.slope, count, found, switched = kernel.march(
                self.law, self.rows, self.state, self.time, until, self.slope, bound, dt,
                room, turn, event,
            )  # fmt: skip
            samples.append(room[:count])
            turns.append(turn[:found])
            events.append(event[:switched])
        failure = f"no step is left at tau = {self.time:g}" if status == kernel.STALLED else ""
        joined = np.concatenate(samples), np.concatenate(turns), np.concatenate(events)
        return Stretch(*joined, failure)


class _Dop853:
    """SciPy's DOP853; turning points are roots of y' on its dense output."""

    tolerance = RTOL

    def __init__(self, loop: SmoothLoop, state: Array, limits: Limits) -> None:
        from scipy.integrate import DOP853

        self.loop, self.limits = loop, limits
        self.solver: Any = DOP853(
            lambda _, x: loop.rate(x), 0.0, state, limits.time,
            max_step=limits.step, rtol=RTOL, atol=RTOL * limits.size,
        )  # fmt: skip
        self.count = 1

    @property
    def time(self) -> float:
        """Time reached."""
        return float(self.solver.t)

    @property
    def state(self) -> Array:
        """State there."""
        return np.asarray(self.solver.y)

    def march(self, until: float) -> Stretch:
        """See `Stepper`."""
        samples, turns, failure = [np.empty((0, self.state.size))], [], ""
        with np.errstate(over="ignore", invalid="ignore"):
            while not failure and self.time < until:
                if self.solver.step():
                    failure = f"DOP853 gave up at tau = {self.time:g}"
                dense = self.solver.dense_output()
                samples.append(self._samples(dense))
                turns += self._turns(dense)
                if not abs(self.loop.y(self.state)) <= self.limits.bound:
                    break
        none = np.empty((0, kernel.EVENT_COLUMNS))
        return Stretch(np.concatenate(samples), np.array(turns).reshape(-1, 2), none, failure)

    def _samples(self, dense: Callable[[Any], Array]) -> Array:
        last = int(np.floor(self.time / self.limits.dt + 1e-9))
        times = self.limits.dt * np.arange(self.count, last + 1)
        self.count = max(self.count, last + 1)
        return dense(times).T if times.size else np.empty((0, self.state.size))

    def _turns(self, dense: Callable[[Any], Array]) -> list[tuple[float, float]]:
        from scipy.optimize import brentq

        grid = np.linspace(self.solver.t_old, self.solver.t, 4)
        slopes, found = [self._slope(x) for x in dense(grid).T], []
        for i in range(3):
            if slopes[i] * slopes[i + 1] < 0.0 or (slopes[i + 1] == 0.0 and slopes[i] != 0.0):
                time = brentq(
                    lambda t: self._slope(dense(t)), grid[i], grid[i + 1], xtol=1e-12, rtol=1e-14
                )
                found.append((float(time), self.loop.y(dense(time))))
        return found

    def _slope(self, x: Array) -> float:
        """Slope y'."""
        return self.loop.y(self.loop.rate(x))
