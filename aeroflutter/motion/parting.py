"""How fast neighbours of a motion part, on whichever engine knows its tangents."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from aeroflutter.motion.exponents import Exponents, measured
from aeroflutter.motion.tangents import BLOCKS, growth

if TYPE_CHECKING:
    from typing import Any

    from numpy.typing import NDArray

    from aeroflutter.model.lure import AnySystem
    from aeroflutter.springs import Springs

    Array = NDArray[np.float64]

__all__ = ["exponents"]


def exponents(
    system: AnySystem, spring: Springs, state: Array, memory: Any, count: int
) -> Exponents | None:
    """The largest Lyapunov exponent over the next so many maxima; None if the motion ends before.

    Parameters
    ----------
    system, spring
        What is marching.
    state, memory
        Where it stands, (n,).
    count
        Maxima of y.
    """
    from aeroflutter.springs import each, straight

    if all(map(straight, each(spring))):
        from aeroflutter.motion.flow import Flow

        return growth(Flow(system, each(spring)), state, memory, count)
    from aeroflutter.motion.chaos.growth import Landing
    from aeroflutter.motion.chaos.smooth import SmoothEngine

    here = Landing(
        state="undecided", reason="", loops=0, period=np.nan, multiplier=np.nan, rest=np.nan,
        state_vector=state, memory=memory,
    )  # fmt: skip
    found = SmoothEngine(system, spring).grow(here, count, 0, 1)
    if found.time.size < BLOCKS or not np.all(np.isfinite(found.logs)):
        return None
    return measured(found.time, found.logs, BLOCKS)
