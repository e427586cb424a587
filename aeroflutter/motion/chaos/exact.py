"""Tangents of piecewise-linear springs, carried by the exact engine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.motion._kernel_flow import PLACE, UNKNOWN
from aeroflutter.motion.chaos import _kernel_tangent as kernel
from aeroflutter.motion.chaos.growth import Growth, Landing, first_tangents
from aeroflutter.motion.endstates import end_state
from aeroflutter.motion.flow import Flow
from aeroflutter.motion.march import March
from aeroflutter.motion.spectra import PoincareSection
from aeroflutter.springs import each

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from aeroflutter.model.lure import AnySystem
    from aeroflutter.springs import Springs

    Array = NDArray[np.float64]

__all__ = ["ExactEngine", "Tangents"]

SIZING = 64  # maxima from which the size of each state is taken


@dataclass(frozen=True)
class ExactEngine:
    """Matrix exponentials between switches; see `growth.Engine`."""

    flow: Flow
    name: str = "exact"
    default_cycles: int = 20_000

    @classmethod
    def of(cls, system: AnySystem, spring: Springs) -> ExactEngine:
        """The engine of one system with its springs."""
        return cls(Flow(system, each(spring)))

    def land(self, state: Array, memory: Any) -> Landing:
        """End state, proved or found by Newton; for a limit cycle, a point that is on it."""
        end = end_state(self.flow, state, memory)
        point, held = end.final_state, end.final_memory
        if end.cycle is not None:
            n = self.flow.n
            point, held = end.cycle.z[0, :n], _own(end.cycle.z[0, n:])
        return Landing(
            state=end.state, reason=end.reason, loops=end.loops, period=end.period,
            multiplier=end.multiplier, rest=end.rest, state_vector=point, memory=held,
        )  # fmt: skip

    def slope(self, landing: Landing) -> Any:
        """Slope of the branch on which the motion is, of each of several springs."""
        outputs, held = self.flow.C @ landing.state_vector, np.atleast_1d(landing.memory)
        slopes = [
            piece.branch(float(y), float(memory))[0]
            for piece, y, memory in zip(self.flow.pieces, outputs, held, strict=True)
        ]
        return _own(np.array(slopes))

    def grow(self, landing: Landing, count: int, transient: int, exponents: int) -> Growth:
        """Follow the motion with `exponents` tangents over `count` maxima."""
        flow, n = self.flow, self.flow.n
        start = flow.begin(landing.state_vector, landing.memory)
        march = March(flow, start, tangents=np.zeros((n + flow.m, exponents)), reaches=True)
        tangents = Tangents(march, np.ones(n + flow.m))
        tangents.over(SIZING)
        tangents.unit = self._unit(march.motion.reach)
        march.motion.tangents[:n] = tangents.unit[:n, None] * first_tangents(n, exponents)
        tangents.over(transient)
        points, times, troughs, logs = tangents.over(count)
        last = march.point()
        section = PoincareSection(
            time=times,
            pitch=points[:, :n] @ flow.C[0],
            states=points[:, :n],
            state_names=flow.system.state_names,
        )
        return Growth(
            section=section,
            memory=points[:, n] if flow.m == 1 else points[:, n:],
            troughs=troughs,
            time=times,
            logs=logs,
            final_state=last.x,
            final_memory=_own(last.memory),
        )

    def _unit(self, reach: Array) -> Array:
        """What counts as one of each (x, h): the size of each state, and that of y for its h."""
        largest = float(reach.max()) or 1.0
        sizes = np.abs(self.flow.C) @ reach
        memories = np.where(sizes > 0.0, sizes, largest)
        return np.concatenate((np.where(reach > 0.0, reach, largest), memories))


def _own(values: Array) -> Any:
    """The number of one spring, or those of several."""
    return float(values[0]) if values.size == 1 else values


@dataclass
class Tangents:
    """A motion with its tangents, between two calls of the kernel."""

    march: March
    unit: Array

    def over(self, count: int) -> tuple[Array, Array, Array, Array]:
        """Points, times, troughs and logarithms of the growth at the next maxima."""
        flow, motion = self.march.flow, self.march.motion
        m, k = motion.tangents.shape
        points, times = np.empty((count, m)), np.empty(count)
        troughs, logs = np.empty(count), np.empty((count, k))
        clock, total = np.array([np.inf, 0.0]), np.zeros(k)
        motion.clock[0] = 0.0
        status = UNKNOWN
        while status == UNKNOWN:
            status = kernel.returns(
                flow.arrays, motion, self.unit, total, clock, points, times, troughs, logs
            )
            if status == UNKNOWN:
                flow.prepare(np.array([motion.memo[PLACE]]))
        found = int(clock[kernel.COUNT])
        return points[:found], times[:found], troughs[:found], logs[:found]
