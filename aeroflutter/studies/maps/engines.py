"""How the cells of one group end: the exact engine all at once, the others cell by cell."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import asdict
from itertools import groupby, islice
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeroflutter.errors import InputError
from aeroflutter.motion.response import SimulateOptions
from aeroflutter.springs import each, straight
from aeroflutter.studies.maps.cells import Group
from aeroflutter.verdicts import STATES

if TYPE_CHECKING:
    from aeroflutter.motion.endstates import EndOptions
    from aeroflutter.motion.flow import Flow

__all__ = ["FAILED", "MARCH", "Ends", "decide", "decide_all", "march_identity"]

Array = NDArray[np.float64]

FAILED = -1  # code of a cell whose block could not be computed
PATIENCE = 50  # times `cycles` that a motion still settling may take on the exact engine
TOGETHER = 32  # groups whose flows are made ready together
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
        As in `motion.response.Response`, rad and τ, (m,).
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
    ((_, ends),) = decide_all([group], options)
    return ends


def decide_all(groups: Iterable[Group], options: SimulateOptions) -> Iterator[tuple[Group, Ends]]:
    """Each group with the end states of its cells, see `decide`.

    The exact engine makes the flows of groups with one spring ready together.
    """
    for spring, alike in groupby(groups, key=lambda group: group.spring):
        exact = all(map(straight, each(spring)))
        if options.engine == "exact" and exact:
            for batch in _batches(alike, TOGETHER):
                yield from _exact(batch, options)
        else:
            for group in alike:
                yield group, _one_by_one(group, options, exact)


def _batches(groups: Iterator[Group], size: int) -> Iterator[list[Group]]:
    while batch := list(islice(groups, size)):
        yield batch


def _exact(groups: list[Group], options: SimulateOptions) -> Iterator[tuple[Group, Ends]]:
    from aeroflutter.motion.endstates import EndOptions
    from aeroflutter.motion.flow import Flow
    from aeroflutter.studies.maps.columns import Room, decide_cells

    limits = EndOptions(
        cycles=options.cycles,
        patience=PATIENCE,
        growth=options.growth,
        duration=options.limit,
    )
    springs = each(groups[0].spring)
    flows = Flow.many([group.system for group in groups], springs, options.step_cap)
    room = Room.of(flows[0].n)
    for flow, group in zip(flows, groups, strict=True):
        if flow.m > 1:
            yield group, _together(flow, group, limits)
            continue
        found = decide_cells(flow, group.states, group.memory, limits, room)
        yield group, Ends(found.state.astype(np.int8), *found[1:])


def _together(flow: Flow, group: Group, limits: EndOptions) -> Ends:
    """The cells of several springs, those of one column sharing the cycles that they find."""
    from aeroflutter.motion.endstates import end_states

    found = end_states(flow, group.states, group.memory, limits, share=True)
    return Ends(
        found.state.astype(np.int8), found.amplitude, found.bias, found.period, found.rest,
        found.time,
    )  # fmt: skip


def _one_by_one(group: Group, options: SimulateOptions, exact: bool) -> Ends:
    from aeroflutter.motion import houbolt, smooth

    if options.engine == "houbolt" and len(each(group.spring)) > 1:
        raise InputError("engine: Houbolt's scheme takes one spring; use engine exact")
    engine: Any = houbolt if exact or options.engine == "houbolt" else smooth
    ends = Ends(
        np.zeros(group.index.size, dtype=np.int8), *(np.empty(group.index.size) for _ in range(5))
    )
    for i, (state, memory) in enumerate(zip(group.states, group.memory, strict=True)):
        found = engine.march(group.system, group.spring, state, memory, options)
        ends.state[i] = STATES.index(found.state)
        ends.amplitude[i], ends.bias[i] = found.amplitude, found.bias
        ends.period[i], ends.rest[i], ends.time[i] = found.period, found.rest, found.duration
    return ends
