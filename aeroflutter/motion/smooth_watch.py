"""The judge of a march with several laws: rests and small motions in all of them."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from aeroflutter.model.lure import LureSystem
from aeroflutter.motion.basins import Basin, joint_basin
from aeroflutter.motion.evidence import lossless
from aeroflutter.motion.parting import exponents
from aeroflutter.motion.settling import STILL, Watch, closed_slopes

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from aeroflutter.motion.exponents import Exponents
    from aeroflutter.motion.response import SimulateOptions
    from aeroflutter.motion.smooth_laws import SmoothLoop

    Array = NDArray[np.float64]

__all__ = ["JointWatch", "slopes_of", "watch_over"]


def watch_over(
    loop: SmoothLoop, point: Array, options: SimulateOptions, recurrence: float, drift: float
) -> Watch:
    """Watch a march from a point."""
    system = loop.system
    if len(loop.springs) == 1 and not np.any(system.load):
        alone = LureSystem.of(system)
        return Watch.over(alone, loop.springs[0], point, options, recurrence, drift)
    first, y = loop.springs[0], loop.y(point)
    size = first.scale
    if len(closed_slopes(first, y)) == 1:
        size = abs(y) or float(np.linalg.norm(point)) or 1.0
    seen = LureSystem(system.A, system.B[:, 0], system.C[0], system.state_names)
    return JointWatch(seen, first, options, size, y, recurrence, drift, loop=loop, here=point)


def slopes_of(loop: SmoothLoop, point: Array) -> list[tuple[float, ...]]:
    """Slopes that the springs can have together, as far as they are finite."""
    y = loop.outputs(point)
    every = [closed_slopes(one, float(at)) for one, at in zip(loop.springs, y, strict=True)]
    return list(product(*every))


@dataclass
class JointWatch(Watch):
    """The same with several springs: what it asks of their laws it asks of the loop.

    Attributes
    ----------
    loop
        What is marching.
    here
        Where it stands, told before each window is shown.
    """

    loop: SmoothLoop = field(kw_only=True)
    here: Array = field(kw_only=True)

    def _rest(self, state: Array, memory: float) -> float:
        loop, rest = self.loop, self.loop.rest_near(state)
        if rest is None:
            return float("nan")
        scales = np.array([one.scale for one in loop.springs])
        known = tuple(np.round([loop.outputs(rest) / scales, loop.memories(rest) / scales], 9).flat)
        if known not in self.basins:
            self.basins[known] = joint_basin(loop, rest)
        basin: Basin | None = self.basins[known]
        if basin is None:
            return float("nan")
        away = loop.state(state) - basin.centre
        return basin.rest if float(away @ basin.form @ away) < 1.0 else float("nan")

    def _holds(self) -> bool:
        values = np.linalg.eigvals(self.loop.linear(self.here))
        return bool(values.real.max() <= STILL * np.abs(values).max())

    def _parting(self, state: Array, memory: float, count: int) -> Exponents | None:
        loop = self.loop
        return exponents(loop.system, loop.springs, loop.state(state), loop.memories(state), count)

    def _dwindles(self) -> bool:
        return False  # one describing function does not tell how several springs act together

    def _lossless(self, state: Array) -> bool:
        return lossless(self.loop.system.closed(slopes_of(self.loop, state)))
