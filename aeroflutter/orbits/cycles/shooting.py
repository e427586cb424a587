"""Limit cycles as roots of the (half-)period map, with speed as the last unknown.

A cycle through the point z with period T at speed U solves

    z(T) - z = 0            or, where the loop is odd,     z(T/2) + z = 0
    phase(z) = 0

in the unknowns q = (z, ln T, U/U_ref), z being the state and the memory of every spring that has
one. The flow runs from switch to switch, whatever their
order, so the sequence of switches is an outcome and never assumed; it may change along a branch.
With memory the phase condition puts the start where the moment falls through the loop's middle:
the slider rests there, and every cycle on which it ever slides has such a point. Without memory
the start is an extremum of y. Both conditions are homogeneous, so they stay where they are as a
cycle grows. Of several springs one leads, see `Phase`.

At an integrator (A x_e = 0, c x_e = 1; for the section a_h = -1/2) a loop that never meets its
stops may sit anywhere: its cycles come in a continuum of bias. The half-period map picks the
central one. On the full map the memory at the start is then held at `hold`. So it is for a loop
that sticks all the way while other springs switch, whose place is free within bounds.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aeroflutter.errors import ConvergenceError
from aeroflutter.motion._kernel_roots import REVERSAL
from aeroflutter.motion.flow import Passage
from aeroflutter.orbits.cycles.centre import static_state
from aeroflutter.orbits.cycles.loop import Flow, Loop
from aeroflutter.orbits.cycles.smooth import SmoothFlow
from aeroflutter.springs import Hysteresis
from aeroflutter.springs._kernel_columns import STICK

__all__ = ["Phase", "Shooting", "Shot"]

Array = NDArray[np.float64]

_KEPT = 8  # shots: events are looked for between states that are used again
_LOG_PERIOD = 5.0  # by which Newton's method may change ln T


@dataclass(frozen=True, eq=False)
class Shot:
    """The shooting equations at one q.

    Attributes
    ----------
    residual, jacobian
        Shapes (m+1,) and (m+1, m+2).
    monodromy
        Derivative of the map that the cycle is a fixed point of, (m, m): of the period map, or of
        z -> -z(T/2).
    motion
        Gives z' at the start, (m,).
    passage
        The motion over the (half) period.
    free
        How many loops could sit elsewhere: the cycle belongs to a continuum of bias.
    stuck
        Places in z of memories that stay as they are all along, where other springs switch.
    """

    residual: Array
    jacobian: Array
    monodromy: Array
    motion: Callable[[], Array]
    passage: Passage
    free: int
    stuck: NDArray[np.intp]

    @cached_property
    def rate(self) -> Array:
        """z' at the start, (m,)."""
        return self.motion()


class Phase(NamedTuple):
    """Where a cycle starts.

    Attributes
    ----------
    lead
        Place of the spring that tells.
    memory
        Whether its moment falls through the middle of its loop there.
    falls
        Whether its y falls through zero there: it may switch where y turns. Else y is extremal.
    """

    lead: int = 0
    memory: bool = False
    falls: bool = False

    @classmethod
    def of(cls, loop: Loop, lead: int = 0) -> Phase:
        """Where cycles start by a spring."""
        memory = lead in loop.held and not loop.falls[lead]
        return cls(lead, memory, loop.falls[lead])


class Shooting:
    """The problem of one kind of cycle, for the continuation.

    Parameters
    ----------
    loop
        The loop.
    symmetric
        Whether to shoot over half a period onto the mirror image.
    reference
        Speed U* that is the unit of the last unknown.
    hold
        Memories at the start of a cycle in a continuum of bias, one a spring that has one.
    phase
        Where a cycle starts; by default by the first spring.

    Notes
    -----
    The period of the first q that is shot bounds those of the others.
    """

    def __init__(
        self,
        loop: Loop,
        symmetric: bool,
        reference: float,
        hold: ArrayLike = 0.0,
        phase: Phase | None = None,
    ) -> None:
        self.loop, self.symmetric, self.reference = loop, symmetric, reference
        self.hold = np.broadcast_to(np.asarray(hold, dtype=float), loop.held.shape)
        self.phase = phase or Phase.of(loop)
        self._log_period: float | None = None
        self._sign = -1.0 if symmetric else 1.0
        self._shots: dict[bytes, Shot] = {}

    def residual(self, q: Array) -> Array:
        """Shooting equations, (m+1,)."""
        return self.shot(q).residual

    def jacobian(self, q: Array) -> Array:
        """Their derivative, (m+1, m+2)."""
        return self.shot(q).jacobian

    def pack(self, z: Array, period: float, speed: float) -> Array:
        """q of a point, a period and a speed U*."""
        return np.concatenate((z, [np.log(period), speed / self.reference]))

    def unpack(self, q: Array) -> tuple[Array, float, float]:
        """Point, period and speed U*."""
        return q[:-2], float(np.exp(q[-2])), float(q[-1] * self.reference)

    def flow(self, q: Array) -> Flow | SmoothFlow:
        """The flow at the speed of q."""
        return self.loop.at(float(q[-1] * self.reference))

    def shot(self, q: Array) -> Shot:
        """The equations at q; the last few are kept."""
        key = q.tobytes()
        if key not in self._shots:
            shot = self._shoot(np.asarray(q))
            if len(self._shots) == _KEPT:
                del self._shots[next(iter(self._shots))]
            self._shots[key] = shot
        return self._shots[key]

    def _shoot(self, q: Array) -> Shot:
        if self._log_period is None:
            self._log_period = float(q[-2])
        if not abs(q[-2] - self._log_period) < _LOG_PERIOD:
            raise ConvergenceError("the period has left all bounds")
        z, period, speed = self.unpack(q)
        m = z.size
        flow = self.loop.at(speed)
        duration = period / 2 if self.symmetric else period
        passage = flow.passage(z, duration)
        residual, jacobian = np.empty(m + 1), np.zeros((m + 1, m + 2))
        residual[:m] = self._sign * passage.end - z
        jacobian[:m, :m] = self._sign * passage.jacobian[:, :m]
        monodromy = jacobian[:m, :m].copy()
        jacobian[np.arange(m), np.arange(m)] -= 1.0
        jacobian[:m, m] = self._sign * passage.rate * duration
        jacobian[:m, m + 1] = self._sign * passage.jacobian[:, m] * self.reference
        residual[m], jacobian[m, :m], slope = self._phase(flow, z)
        jacobian[m, m + 1] = slope * self.reference
        stuck = self._stuck(passage)
        free = [place for place in self._free(passage, z) if place not in stuck]
        if not self.symmetric:
            for place in free:
                drift = self._drift(speed, place)
                residual[:m] += drift * (z[place] - self.hold[place - self.loop.n])
                jacobian[:m, place] += drift
        if stuck.size and not self.symmetric:
            residual[stuck] = z[stuck] - self.hold[stuck - self.loop.n]
            jacobian[stuck] = 0.0
            jacobian[stuck, stuck] = 1.0
        motion = partial(flow.rate, z)
        return Shot(residual, jacobian, monodromy, motion, passage, len(free), stuck)

    def _phase(self, flow: Flow | SmoothFlow, z: Array) -> tuple[float, Array, float]:
        """Phase condition, its gradient in z (m,) and its derivative with respect to U."""
        loop, lead, n = self.loop, self.phase.lead, self.loop.n
        c, gradient = loop.C[lead], np.zeros(z.size)
        if self.phase.memory:
            place = n + int(np.searchsorted(loop.held, lead))
            middle = getattr(loop.springs[lead], "v_off", 0.0)
            gradient[:n], gradient[place] = c, -1.0
            return float(c @ z[:n] - z[place] - middle), gradient, 0.0
        if self.phase.falls:
            gradient[:n] = c
            return float(c @ z[:n]), gradient, 0.0
        moments, slopes = flow.moments(z)
        push = c @ flow.B
        gradient[:n] = c @ flow.A - (push * slopes) @ flow.C
        gradient[n:] = push[loop.held]
        value = float(c @ (flow.A @ z[:n] + flow.d) - push @ moments)
        return value, gradient, float(c @ (flow.dA @ z[:n]) - (c @ flow.dB) @ moments)

    def _free(self, passage: Passage, z: Array) -> Iterator[int]:
        """Places in z of loops that could sit elsewhere: no stop is met, and A integrates."""
        loop = self.loop
        for place, i in enumerate(loop.held, start=loop.n):
            spring = loop.springs[i]
            if not (loop.integrates[i] and isinstance(spring, Hysteresis)):
                continue
            own = passage.switches
            if len(loop.springs) > 1:
                own = tuple(switch[1:] for switch in own if switch[0] == i)
            if not meets_stop(own) and spring.h_low < z[place] < spring.h_high:
                yield place

    def _stuck(self, passage: Passage) -> NDArray[np.intp]:
        """Places in z of the memories of loops that stick while other springs switch."""
        if len(self.loop.springs) == 1:
            return np.empty(0, dtype=np.intp)
        moving = {switch[0] for switch in passage.switches}
        still = [i for i, spring in enumerate(self.loop.held) if spring not in moving]
        return self.loop.n + np.array(still, dtype=np.intp)

    def _drift(self, speed: float, place: int) -> Array:
        """By what z moves where a loop that is free sits elsewhere by one."""
        moved = self.loop.held[place - self.loop.n]
        alone = np.arange(len(self.loop.springs)) == moved
        drift = np.zeros(self.loop.m)
        drift[: self.loop.n] = static_state(self.loop.family, speed, alone.astype(float))
        drift[place] = 1.0
        return drift


def meets_stop(switches: tuple[tuple[int, ...], ...]) -> bool:
    """Whether the slider of a loop is carried onto a stop: a flat that ends at an edge."""
    return any(kind != REVERSAL and mode == STICK for kind, mode in switches)
