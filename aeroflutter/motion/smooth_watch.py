"""The judge of a march with several laws without memory: rests and small motions in all of them."""

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
    loop: SmoothLoop, state: Array, options: SimulateOptions, recurrence: float, drift: float
) -> Watch:
    """Watch a march from `state`."""
    system = loop.system
    if len(loop.springs) == 1 and not np.any(system.load):
        alone = LureSystem.of(system)
        return Watch.over(alone, loop.springs[0], state, options, recurrence, drift)
    first, y = loop.springs[0], loop.y(state)
    size = first.scale
    if len(closed_slopes(first, y)) == 1:
        size = abs(y) or float(np.linalg.norm(state)) or 1.0
    seen = LureSystem(system.A, system.B[:, 0], system.C[0], system.state_names)
    return JointWatch(seen, first, options, size, y, recurrence, drift, loop=loop, here=state)


def slopes_of(loop: SmoothLoop, state: Array) -> list[tuple[float, ...]]:
    """Slopes that the springs can have together, as far as they are finite."""
    y = loop.system.C @ state
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
        x = self.loop.rest_near(state)
        if x is None:
            return float("nan")
        scales = np.array([one.scale for one in self.loop.springs])
        known = tuple(np.round(self.loop.system.C @ x / scales, 9).tolist())
        if known not in self.basins:
            self.basins[known] = joint_basin(self.loop, x)
        basin: Basin | None = self.basins[known]
        if basin is None:
            return float("nan")
        away = state - basin.centre
        return basin.rest if float(away @ basin.form @ away) < 1.0 else float("nan")

    def _holds(self) -> bool:
        values = np.linalg.eigvals(self.loop.linear(self.here))
        return bool(values.real.max() <= STILL * np.abs(values).max())

    def _parting(self, state: Array, memory: float, count: int) -> Exponents | None:
        return exponents(self.loop.system, self.loop.springs, state, memory, count)

    def _dwindles(self) -> bool:
        return False  # one describing function does not tell how several springs act together

    def _lossless(self, state: Array) -> bool:
        return lossless(self.loop.system.closed(slopes_of(self.loop, state)))
