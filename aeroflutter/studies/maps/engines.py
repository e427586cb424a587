"""How the cells of one group end: the exact engine all at once, the others cell by cell."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeroflutter.motion.response import STATES, SimulateOptions
from aeroflutter.springs import Hysteresis, PiecewiseLinear
from aeroflutter.studies.maps.cells import Group

__all__ = ["FAILED", "MARCH", "Ends", "decide", "march_identity"]

Array = NDArray[np.float64]

FAILED = -1  # code of a cell whose block could not be computed
PATIENCE = 50  # times `cycles` that a motion still settling may take on the exact engine
MARCH = SimulateOptions(engine="exact", record=False, duration=1e7)


def march_identity(options: SimulateOptions) -> dict[str, Any]:
    """Options on which end states depend, in JSON's types."""
    found = asdict(options)
    for name in ("progress", "record", "decide"):
        del found[name]
    return found


class Ends(NamedTuple):
    """How m motions end.

    Attributes
    ----------
    state
        Places in `STATES`, (m,).
    amplitude, bias, period, rest
        As in `timemarch.response.Response`, rad and τ, (m,).
    time
        When the end was certain, τ, (m,).
    """

    state: NDArray[np.int8]
    amplitude: Array
    bias: Array
    period: Array
    rest: Array
    time: Array


def decide(group: Group, options: SimulateOptions) -> Ends:
    """End states of the cells of a group.

    Cells are decided in their order. On the exact engine an attracting cycle that one cell has
    found is known to those after it; what it takes to be attracted to it is the same for all.
    """
    straight = isinstance(group.spring, PiecewiseLinear | Hysteresis)
    if options.engine == "exact" and straight:
        return _exact(group, options)
    return _one_by_one(group, options, straight)


def _exact(group: Group, options: SimulateOptions) -> Ends:
    from aeroflutter.motion.endstates import EndOptions
    from aeroflutter.studies.maps.columns import decide_cells

    limits = EndOptions(
        cycles=options.cycles,
        patience=PATIENCE,
        growth=options.growth,
        duration=options.limit,
    )
    system, spring, cap = group.system, group.spring, options.step_cap
    found = decide_cells(system, spring, group.states, group.memory, limits, cap)
    return Ends(found.state.astype(np.int8), *found[1:])


def _one_by_one(group: Group, options: SimulateOptions, straight: bool) -> Ends:
    from aeroflutter.motion import houbolt, smooth

    engine = houbolt if straight or options.engine == "houbolt" else smooth
    ends = Ends(
        np.zeros(group.index.size, dtype=np.int8), *(np.empty(group.index.size) for _ in range(5))
    )
    for i, (state, memory) in enumerate(zip(group.states, group.memory, strict=True)):
        found = engine.march(group.system, group.spring, state, float(memory), options)
        ends.state[i] = STATES.index(found.state)
        ends.amplitude[i], ends.bias[i] = found.amplitude, found.bias
        ends.period[i], ends.rest[i], ends.time[i] = found.period, found.rest, found.duration
    return ends
