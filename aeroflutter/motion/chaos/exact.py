"""Tangents of piecewise-linear springs, carried by the exact engine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.motion.chaos.growth import Growth, Landing
from aeroflutter.motion.endstates import end_state
from aeroflutter.motion.flow import Flow
from aeroflutter.motion.march import March
from aeroflutter.motion.spectra import PoincareSection
from aeroflutter.motion.tangents import Tangents
from aeroflutter.springs import each

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from aeroflutter.model.lure import AnySystem
    from aeroflutter.springs import Springs

    Array = NDArray[np.float64]

__all__ = ["ExactEngine"]


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

    def closed(self, landing: Landing) -> Array:
        """The system on the branches on which the motion is, (n, n); where it sticks, too."""
        flow = self.flow
        march = March(flow, flow.begin(landing.state_vector, landing.memory))
        if flow.sliders.size:  # where it sticks, round-off may have left it a rate
            march.run(1.0)
        table = flow.table(march.motion.modes)
        return np.array(flow.arrays.generator[table, :, : flow.n])

    def grow(self, landing: Landing, count: int, transient: int, exponents: int) -> Growth:
        """Follow the motion with `exponents` tangents over `count` maxima."""
        flow, n = self.flow, self.flow.n
        tangents = Tangents.along(flow, landing.state_vector, landing.memory, exponents)
        tangents.over(transient)
        points, times, troughs, logs = tangents.over(count)
        last = tangents.march.point()
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


def _own(values: Array) -> Any:
    """The number of one spring, or those of several."""
    return float(values[0]) if values.size == 1 else values
