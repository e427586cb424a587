"""Limit cycles as roots of the (half-)period map, with speed as the last unknown.

A cycle through the point z with period T at speed U solves

    z(T) - z = 0            or, where the loop is odd,     z(T/2) + z = 0
    phase(z) = 0

in the unknowns q = (z, ln T, U/U_ref). The flow runs from switch to switch, whatever their
order, so the sequence of switches is an outcome and never assumed; it may change along a branch.
With memory the phase condition puts the start where the moment falls through the loop's middle:
the slider rests there, and every cycle on which it ever slides has such a point. Without memory
the start is an extremum of y. Both conditions are homogeneous, so they stay where they are as a
cycle grows.

At an integrator (A x_e = 0, c x_e = 1; for the section a_h = -1/2) a loop that never meets its
stops may sit anywhere: its cycles come in a continuum of bias. The half-period map picks the
central one. On the full map the memory at the start is then held at `hold`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aeroflutter.errors import ConvergenceError
from aeroflutter.motion._kernel_roots import REVERSAL
from aeroflutter.motion.flow import Passage
from aeroflutter.orbits.cycles.centre import static_state
from aeroflutter.orbits.cycles.loop import Flow, Loop
from aeroflutter.springs._kernel_columns import STICK

__all__ = ["Shooting", "Shot"]

Array = NDArray[np.float64]

_KEPT = 8  # shots: events are looked for between states that are used again
_LOG_PERIOD = 5.0  # by which Newton's method may change ln T


@dataclass(frozen=True, eq=False, slots=True)
class Shot:
    """The shooting equations at one q.

    Attributes
    ----------
    residual, jacobian
        Shapes (m+1,) and (m+1, m+2).
    monodromy
        Derivative of the map that the cycle is a fixed point of, (m, m): of the period map, or of
        z -> -z(T/2).
    rate
        z' at the start, (m,).
    passage
        The motion over the (half) period.
    free
        Whether the cycle belongs to a continuum of bias.
    """

    residual: Array
    jacobian: Array
    monodromy: Array
    rate: Array
    passage: Passage
    free: bool


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
        Memory at the start of a cycle in a continuum of bias.

    Notes
    -----
    The period of the first q that is shot bounds those of the others.
    """

    def __init__(self, loop: Loop, symmetric: bool, reference: float, hold: float = 0.0) -> None:
        self.loop, self.symmetric, self.reference, self.hold = loop, symmetric, reference, hold
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

    def flow(self, q: Array) -> Flow:
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
        free = self._free(flow, passage, z)
        if free and not self.symmetric:
            drift = self._drift(speed)
            residual[:m] += drift * (z[-1] - self.hold)
            jacobian[:m, m - 1] += drift
        return Shot(residual, jacobian, monodromy, flow.rate(z), passage, free)

    def _phase(self, flow: Flow, z: Array) -> tuple[float, Array, float]:
        """Phase condition, its gradient in z (m,) and its derivative with respect to U."""
        loop, c = self.loop, self.loop.family.c
        if loop.memory:
            middle = loop.spring.v_off  # type: ignore[union-attr]
            return float(c @ z[:-1] - z[-1] - middle), np.append(c, -1.0), 0.0
        moment, slope = flow.moment(z)
        gradient = c @ flow.A - (c @ flow.b) * slope * c
        value = float(c @ (flow.A @ z) - (c @ flow.b) * moment)
        return value, gradient, float(c @ (flow.dA @ z) - (c @ flow.db) * moment)

    def _free(self, flow: Flow, passage: Passage, z: Array) -> bool:
        """Whether the loop could as well sit elsewhere: it never meets a stop, and A integrates."""
        if not self.loop.memory or meets_stop(passage.switches):
            return False
        spring = self.loop.spring
        if not spring.h_low < z[-1] < spring.h_high:  # type: ignore[union-attr]
            return False
        return self.loop.integrates

    def _drift(self, speed: float) -> Array:
        return np.append(static_state(self.loop.family, speed, 1.0), 1.0)


def meets_stop(switches: tuple[tuple[int, ...], ...]) -> bool:
    """Whether the slider of a loop is carried onto a stop: a flat that ends at an edge."""
    return any(kind != REVERSAL and mode == STICK for kind, mode in switches)
