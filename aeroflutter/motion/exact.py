"""The exact engine: from switch to switch of a piecewise-linear spring, without time-step error.

Within a linear piece the motion is the exponential of its matrix, the next switch is located to
round-off, and the end state is certified (`endstates`). What is sampled is computed afterwards by
`_Trace`, which makes the same steps as the judge did, to the last bit.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.model.coordinates import named_rows
from aeroflutter.model.lure import as_system
from aeroflutter.motion._kernel_flow import DONE, FULL, OVERFLOW, STUCK
from aeroflutter.motion.endstates import EndOptions, EndState, end_state
from aeroflutter.motion.flow import Flow
from aeroflutter.motion.march import LOG, March
from aeroflutter.motion.response import MOST_SAMPLES, Response, traces
from aeroflutter.motion.settling import Verdict, Watch, closed_slopes, period_range
from aeroflutter.motion.swings import (
    Swing,
    rest_extremes,
    rows_of,
    swings_of,
    unknown,
)
from aeroflutter.springs import each

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from aeroflutter.model.lure import AnySystem
    from aeroflutter.motion.response import SimulateOptions
    from aeroflutter.springs import Spring, Springs

    Array = NDArray[np.float64]

__all__ = ["march"]

LONGEST = 1e7  # τ within which an end state is looked for, if nothing else is asked
LEAST = 400.0  # τ that a recorded march goes on for at least, so that there is something to see
ENOUGH = 100  # of its longest periods, which are so where they are short in the unit of time
PERIODS_A_WINDOW = 4  # of the thesis's criteria
KINDS = "1 lower edge of a piece, 2 upper edge, 3 pitch turns on a flat"


def march(
    system: AnySystem, spring: Springs, state: Array, memory: Any, options: SimulateOptions
) -> Response:
    """March from switch to switch; see `motion.response.simulate`.

    Parameters
    ----------
    system, spring, state, memory, options
        As for every engine. Without a duration the end state is looked for until τ = `LONGEST`;
        what is recorded lasts for `LEAST` at least, or for `ENOUGH` periods.

    Raises
    ------
    InputError
        If the spring is not piecewise linear.
    """
    springs = each(spring)
    flow = _flow(system, springs, options.step_cap)
    if options.criteria == "thesis":
        return _watched(flow, springs[0], state, memory, options)
    longest = LONGEST if options.duration is None and options.decide else options.limit
    limits = EndOptions(cycles=options.cycles, growth=options.growth, duration=longest)
    end = end_state(flow, state, memory, limits)
    until = min(end.time, longest) if options.decide else longest
    if options.record and not (flow.contraction and end.state == "damped"):
        until = max(until, min(_least(flow), longest))
    trace = _Trace(flow, springs, state, memory, options, until)
    if not options.record:
        trace.jump(end, until)
    trace.go(until)
    coordinates, moving = _swings(flow, end, trace)
    return trace.response(
        end.state, end.reason, coordinates=coordinates, springs=moving, **_measures(end)
    )


@lru_cache(maxsize=16)
def _flow(system: AnySystem, springs: tuple[Spring, ...], step_cap: float | None) -> Flow:
    """Shared by all marches of one system (systems are equal only to themselves)."""
    return Flow(system, springs, step_cap)


def _swings(flow: Flow, end: EndState, trace: _Trace) -> tuple[tuple[Swing, ...], ...]:
    """How far coordinates and springs move: on the cycle, at rest, or at the end of the record."""
    if end.lap is not None:
        low, high = end.lap.extremes()
    elif end.state == "damped":
        memory = np.atleast_1d(end.final_memory)
        low, high = rest_extremes(flow, end.final_state, memory, end.rest)
    elif end.state == "divergent" or not trace.march.filled:
        low, high = unknown(flow.system)
    else:
        kept = trace.march.states[: trace.march.filled] @ rows_of(flow.system).T
        last = kept[-max(2, len(kept) // 5) :]
        low, high = last.min(axis=0), last.max(axis=0)
    found = swings_of(flow.system, low, high)
    if end.state != "divergent":  # what the end state says of the first spring is exact
        exact: Any = {"amplitude": end.amplitude, "bias": end.bias}
        alike = [np.array_equal(one.row, flow.C[0]) for one in named_rows(flow.system)]
        found = (
            [one._replace(**exact) if so else one for one, so in zip(found[0], alike, strict=True)],
            [found[1][0]._replace(**exact), *found[1][1:]],
        )
    return tuple(map(tuple, found))


def _measures(end: EndState) -> dict[str, Any]:
    """Amplitude, bias, period, first harmonic and rest of a Response."""
    extras: dict[str, Any] = {"loops": end.loops, "event_kinds": KINDS}
    if end.state == "divergent":
        return {"extras": extras}
    found: dict[str, Any] = {"amplitude": end.amplitude, "bias": end.bias, "rest": end.rest}
    if end.cycle is not None:
        found |= {"period": end.period, "first_harmonic": end.first_harmonic}
        extras["multiplier"] = end.multiplier
    return found | {"extras": extras}


def _least(flow: Flow) -> float:
    """How long a recorded march goes on for at least."""
    system = as_system(flow.system)
    slopes = [np.full(len(system.C), slope) for slope in (0.0, 1.0)]  # friction adds to flow.m
    _, longest = period_range(system, slopes)
    return float(np.fmin(LEAST, ENOUGH * longest))


class _Trace:
    """The march of which a Response tells."""

    def __init__(
        self,
        flow: Flow,
        springs: Sequence[Spring],
        state: Array,
        memory: Any,
        options: SimulateOptions,
        until: float,
    ) -> None:
        self.flow, self.springs, self.options, self.until = flow, springs, options, until
        wanted = until / options.dt  # samples; infinite where dt is next to nothing
        if wanted < np.inf:
            spacing = options.dt * (1 + int(wanted) // MOST_SAMPLES)
        else:
            spacing = until / MOST_SAMPLES
        count = 1 + int(until / spacing * (1.0 + 1e-12)) if options.record else 0
        turns = options.record or options.criteria == "thesis"
        switches = turns or options.progress is not None  # a full log is when progress is told
        self.march = March(
            flow, flow.begin(state, memory), spacing * np.arange(count, dtype=np.float64),
            events=LOG if switches else 0, turns=LOG if turns else 0,
        )  # fmt: skip
        self.status = DONE
        self.events: list[Array] = []

    def jump(self, end: EndState, until: float) -> None:
        """Take over where the judge stopped, if not beyond `until`: nothing before is wanted."""
        if end.time <= until:
            point = self.flow.begin(end.final_state, end.final_memory)
            self.march.stand(point._replace(time=end.time))

    def go(self, end: float) -> Array:
        """March on to a time, or to an overflow; the extrema on the way."""
        turns = []
        while True:
            self.status = self.march.run(end)
            turns.append(self.march.turns())
            if self.options.record:
                self.events.append(self.march.events()[:, :2])
            self.march.empty()
            if self.options.progress:
                done = self.march.time / self.until if self.until > 0.0 else 1.0
                self.options.progress(min(done, 1.0))
            if self.status != FULL:
                return np.concatenate(turns)

    def response(self, state: Any, reason: str, **measures: Any) -> Response:
        """The result, once the march is over."""
        march, system = self.march, self.flow.system
        if self.status == OVERFLOW:
            reason += f"; the march overflowed at tau = {march.time:g} and ends there"
        elif self.status == STUCK:
            reason += f"; the march came to a standstill at tau = {march.time:g}"
        time, states = march.times[: march.filled], march.states[: march.filled]
        point, memory = march.point(), march.memory[: march.filled, 0]
        last = point.memory
        for i, (spring, row) in enumerate(zip(self.springs, self.flow.C, strict=False)):
            if not self.flow.memory[i]:  # static, or a loop without height or width
                last[i] = spring.advance(last[i], float(row @ point.x))
        if not self.flow.memory[0]:
            memory = np.asarray(self.springs[0].advance(memory, states @ self.flow.C[0]))
        kept = traces(system, self.springs[0], time, states, memory)
        if any(piece.jumps for piece in self.flow.pieces) and time.size:
            kept["moment"] = self.flow.channels.forces(march.moments[: march.filled])[:, 0]
        return Response(
            state=state,
            reason=reason,
            engine="exact",
            duration=march.time,
            final_state=point.x,
            final_memory=float(last[0]) if last.size == 1 else last,
            events=np.concatenate(self.events) if self.events else np.empty((0, 2)),
            **measures,
            **kept,
        )


def _watched(
    flow: Flow, spring: Spring, state: Array, memory: float, options: SimulateOptions
) -> Response:
    """The end states of the thesis, judged window by window as for the other engines."""
    system, simple = flow.system, flow.springs[0]
    _, longest = period_range(system, closed_slopes(simple, float(system.c @ state)))
    window = max(PERIODS_A_WINDOW * np.nan_to_num(longest), LEAST)
    watch = Watch.over(system, simple, state, options, 0.0, 0.0)
    trace = _Trace(flow, [spring], state, memory, options, options.limit)
    verdict: Verdict | None = None
    while trace.march.time < options.limit and not (verdict and options.decide):
        begin = float(system.c @ trace.march.point().x)
        turns = trace.go(min(trace.march.time + window, options.limit))
        reached = np.concatenate(([begin, float(system.c @ trace.march.point().x)], turns[:, 1]))
        seen = watch.add(turns[:, 0], turns[:, 1], float(reached.min()), float(reached.max()))
        verdict = verdict or seen
        if trace.status != DONE:
            break
    verdict = verdict or watch.last(trace.march.time)
    pitch = trace.march.states[: trace.march.filled] @ system.c
    extras = {"loops": verdict.loops, "event_kinds": KINDS}
    measures = watch.measures(verdict, lambda count: pitch[-count:], options.dt)
    return trace.response(verdict.state, verdict.reason, extras=extras, **measures)
