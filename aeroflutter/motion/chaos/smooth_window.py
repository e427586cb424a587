"""A window of a motion and its tangents: Taylor series for polynomial pieces, DOP853 for others."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from aeroflutter.errors import ConvergenceError
from aeroflutter.motion._kernel_taylor import EVENT_COLUMNS, FULL
from aeroflutter.motion.chaos import _kernel_tangents as kernel
from aeroflutter.motion.flow import Passage, most_switches
from aeroflutter.motion.smooth_laws import SmoothLoop, slope_law
from aeroflutter.motion.smooth_steps import Limits, stepper_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from aeroflutter.model.lure import AnySystem
    from aeroflutter.motion.smooth_laws import Pieces
    from aeroflutter.springs import Springs

    Array = NDArray[np.float64]

__all__ = ["along", "along_loop", "passage", "slope_law"]

RTOL = 1e-9
STEPS_A_PERIOD = 4
DIFFERENCE = 6e-6  # cube root of round-off: the best step of a central difference
IRREGULAR = "the motion does not stay bounded and regular over a period"
TURNS = 64  # turning points found before the kernel comes back for room


class Motion(Protocol):
    """A motion that goes on from window to window."""

    def __call__(self, x: Array, tangents: Array) -> tuple[Array, Array, Array]:
        """Point (N,), tangents (N, k) and turning points of the next window.

        A turning point is its time, 1 at maxima and -1 at minima, and the point there: (m, 2 + N).
        """


def along(system: AnySystem, spring: Springs, x: Array, window: float, shortest: float) -> Motion:
    """The motion from a state in windows of one length.

    Parameters
    ----------
    shortest
        Shortest period of oscillation; DOP853 takes steps in which no turning point hides.
    """
    return along_loop(SmoothLoop.of(system, spring), x, window, shortest)


def along_loop(
    loop: SmoothLoop, x: Array, window: float, shortest: float, rtol: float = RTOL
) -> Motion:
    """The same of a loop; DOP853 marches at the tolerance `rtol`."""
    if loop.pieces is not None:
        return _Series(loop.pieces, window)
    longest_step = min(window, shortest) / STEPS_A_PERIOD
    size = float(np.abs(x).max()) or 1.0
    return _Dop853(loop, window, longest_step, size, rtol)


def passage(loop: SmoothLoop, z: Array, duration: float, rtol: float = RTOL) -> Passage:
    """The motion from z over a duration, linearised; see `motion.flow.Flow.passage`.

    Raises
    ------
    ConvergenceError
        If it does not stay bounded and regular, or turns or switches more often than a cycle can be
        expected to.
    """
    pieces = loop.pieces
    if pieces is None:
        found = _differenced(loop, z, duration, rtol)
    else:
        rows, end = pieces.begin(z)
        tangents = pieces.tangents(end, z, z.size + 1)
        most = most_switches(pieces.tables)
        time, _, events = _Series(pieces, duration).along(rows, end, tangents, most)
        if time < duration:
            raise ConvergenceError(IRREGULAR)
        rate = pieces.rate(rows, end, loop.rate(end))
        found = Passage(end, tangents, rate, switches_of(events))
    if not (np.all(np.isfinite(found.end)) and np.all(np.isfinite(found.jacobian))):
        raise ConvergenceError(IRREGULAR)
    return found


def switches_of(events: Array) -> tuple[tuple[int, ...], ...]:
    """Spring, kind and mode after it of switches (k, EVENT_COLUMNS), as in a `Passage`."""
    return tuple(map(tuple, events[:, [5, 1, 2]].astype(int).tolist()))


def _differenced(loop: SmoothLoop, z: Array, duration: float, rtol: float) -> Passage:
    """The same by DOP853, the derivative with respect to the parameter by differences."""
    jacobian = np.zeros((z.size, z.size + 1))
    end, jacobian[:, :-1], _ = along_loop(loop, z, duration, duration, rtol)(z, np.eye(z.size))
    if loop.change is not None:
        step = DIFFERENCE * np.abs(loop.system.A).max() / np.abs(loop.change[0]).max()
        limits = Limits(duration, np.inf, duration, 1.0, duration)
        for side in (1.0, -1.0):
            motion = stepper_of(loop.moved(side * step), z, limits)
            motion.march(duration)
            jacobian[:, -1] += side * motion.state / (2.0 * step)
    return Passage(end, jacobian, loop.rate(end), ())


class _Series:
    """See `_kernel_tangents`."""

    def __init__(self, pieces: Pieces, window: float) -> None:
        self.pieces, self.window, self.slope = pieces, window, 0.0

    def __call__(self, x: Array, tangents: Array) -> tuple[Array, Array, Array]:
        tangents = np.array(tangents, order="C")
        rows, z = self.pieces.begin(x)
        _, turns, _ = self.along(rows, z, tangents)
        return z, tangents, turns

    def along(
        self, rows: NDArray[np.int64], z: Array, tangents: Array, most: float = np.inf
    ) -> tuple[float, Array, Array]:
        """Time reached, turning points and switches; modes, point and tangents go along.

        It stops short once there are more than `most` of either.
        """
        turns: list[Array] = []
        events: list[Array] = []
        status, time = FULL, 0.0
        while status == FULL and TURNS * len(turns) <= most:
            room, event = np.empty((TURNS, 2 + z.size)), np.empty((TURNS, EVENT_COLUMNS))
            status, time, self.slope, found, switched = kernel.march(
                self.pieces.law, rows, z, tangents, time, self.window, self.slope, room, event
            )
            turns.append(room[:found])
            events.append(event[:switched])
        return time, np.concatenate(turns), np.concatenate(events)


@dataclass(frozen=True)
class _Turn:
    """Slope y' of the motion, as an event of SciPy: falling at maxima, rising at minima."""

    loop: SmoothLoop
    direction: int

    def __call__(self, _: float, z: Array) -> float:
        loop = self.loop
        return loop.y(loop.rate(z.reshape(loop.system.order, -1)[:, 0]))


class _Dop853:
    """Motion and tangents as one vector."""

    def __init__(
        self, loop: SmoothLoop, window: float, longest_step: float, size: float, rtol: float
    ) -> None:
        self.loop, self.turns = loop, (_Turn(loop, -1), _Turn(loop, 1))
        self.window, self.longest_step, self.size = window, longest_step, size
        self.rtol = rtol
        self.first_step: float | None = None

    def __call__(self, x: Array, tangents: Array) -> tuple[Array, Array, Array]:
        from scipy.integrate import solve_ivp

        start = np.column_stack((x, tangents))
        scale = np.ones_like(start)
        scale[:, 0] = self.size
        found: Any = solve_ivp(
            self._rate, (0.0, self.window), start.ravel(), method="DOP853",
            events=self.turns, rtol=self.rtol, atol=self.rtol * scale.ravel(),
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
        loop = self.loop
        columns = z.reshape(loop.system.order, -1)
        change = loop.linear(columns[:, 0]) @ columns
        change[:, 0] = loop.rate(columns[:, 0])
        return change.ravel()
