"""The exact engine: from switch to switch of a piecewise-linear spring, without time-step error.

Within a linear piece the motion is the exponential of its matrix, the next switch is located to
round-off, and the end state is certified (`endstates`). What is sampled is computed afterwards by
`_Trace`, which makes the same steps as the judge did, to the last bit.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.motion import _kernel_exact_march as kernel
from aeroflutter.motion._kernel_exact import FULL, OVERFLOW, STUCK
from aeroflutter.motion.endstates import EndOptions, EndState, end_state
from aeroflutter.motion.prepared import Prepared
from aeroflutter.motion.response import MOST_SAMPLES, Response, traces
from aeroflutter.motion.settling import Verdict, Watch, closed_slopes, period_range

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from aeroflutter.model.lure import LureSystem
    from aeroflutter.motion.response import SimulateOptions
    from aeroflutter.springs import Spring

    Array = NDArray[np.float64]

__all__ = ["march"]

LONGEST = 1e7  # τ within which an end state is looked for, if nothing else is asked
ROWS = 1024  # switches and extrema in one piece of the log
LEAST = 400.0  # τ that a recorded march goes on for at least, so that there is something to see
PERIODS_A_WINDOW = 4  # of the thesis's criteria
KINDS = "1 lower edge of a piece, 2 upper edge, 3 pitch turns on a flat"


def march(
    system: LureSystem, spring: Spring, state: Array, memory: float, options: SimulateOptions
) -> Response:
    """March from switch to switch; see `timemarch.response.simulate`.

    Parameters
    ----------
    system, spring, state, memory, options
        As for every engine. Without a duration the end state is looked for until τ = `LONGEST`;
        what is recorded lasts for `LEAST` at least.

    Raises
    ------
    InputError
        If the spring is not piecewise linear.
    """
    prepared = _prepared(system, spring, options.step_cap)
    if options.criteria == "thesis":
        return _watched(prepared, spring, state, memory, options)
    longest = LONGEST if options.duration is None and options.decide else options.limit
    limits = EndOptions(cycles=options.cycles, growth=options.growth, duration=longest)
    end = end_state(prepared, state, memory, limits)
    until = min(end.time, longest) if options.decide else longest
    if options.record:
        until = max(until, min(LEAST, longest))
    trace = _Trace(prepared, spring, state, memory, options, until)
    if not options.record:
        trace.jump(end, until)
    trace.go(until)
    return trace.response(end.state, end.reason, **_measures(end))


@lru_cache(maxsize=16)
def _prepared(system: LureSystem, spring: Spring, step_cap: float | None) -> Prepared:
    """Shared by all marches of one system (systems are equal only to themselves)."""
    return Prepared.of(system, spring, step_cap)


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


class _Log:
    """The compiled march to a given time, with samples and everything that happens on the way.

    Parameters
    ----------
    prepared
        System and spring.
    state, memory
        Where the motion starts, (n,).
    times
        Ascending times of samples, (k,).
    turns
        Whether the extrema of y are logged, and steps end at them.
    switches
        Whether the switches are logged.
    """

    def __init__(
        self,
        prepared: Prepared,
        state: Array,
        memory: float,
        times: Array,
        turns: bool = False,
        switches: bool = True,
    ) -> None:
        self.prepared = prepared
        self.x, self.h, self.mode, self.t = np.array(state, dtype=float), memory, -1, 0.0
        self.status = 0
        self.times = times
        self.states = np.empty((times.size, self.x.size))
        self.springs = np.empty((times.size, 2))
        self.memo = np.zeros(5, dtype=np.int64)
        self._events = np.empty((ROWS if switches else 0, kernel.EVENT_COLUMNS))
        self._turns = np.empty((ROWS if turns else 0, kernel.TURN_COLUMNS))

    @property
    def filled(self) -> int:
        """Samples so far."""
        return int(self.memo[kernel.SAMPLES])

    def run(self, end: float) -> tuple[Array, Array]:
        """March towards `end`, until there or the log is full; the switches and extrema on the way.

        The log is full if `status` says so: call again.
        """
        self.memo[[kernel.EVENTS, kernel.TURNS]] = 0
        self.status, self.t, self.h, self.mode = kernel.march(
            self.prepared.tables,
            self.prepared.law,
            self.x,
            self.h,
            self.mode,
            self.t,
            end,
            self.times,
            self.states,
            self.springs,
            self._events,
            self._turns,
            self.memo,
        )
        events, turns = self.memo[kernel.EVENTS], self.memo[kernel.TURNS]
        return self._events[:events].copy(), self._turns[:turns].copy()


class _Trace:
    """The march of which a Response tells."""

    def __init__(
        self,
        prepared: Prepared,
        spring: Spring,
        state: Array,
        memory: float,
        options: SimulateOptions,
        until: float,
    ) -> None:
        self.prepared, self.spring, self.options, self.until = prepared, spring, options, until
        spacing = options.dt * (1 + int(until / options.dt) // MOST_SAMPLES)
        count = 1 + int(until / spacing * (1.0 + 1e-12)) if options.record else 0
        times = np.asarray(spacing * np.arange(count), dtype=np.float64)
        turns = options.record or options.criteria == "thesis"
        switches = turns or options.progress is not None  # a full log is when progress is told
        self.log = _Log(prepared, state, memory, times, turns, switches)
        self.events: list[Array] = []

    def jump(self, end: EndState, until: float) -> None:
        """Take over where the judge stopped, if not beyond `until`: nothing before is wanted."""
        if end.time <= until:
            self.log.x, self.log.h, self.log.t = end.final_state, end.final_memory, end.time

    def go(self, end: float) -> Array:
        """March on to a time, or to an overflow; the extrema on the way."""
        turns = []
        while True:
            events, found = self.log.run(end)
            turns.append(found)
            if self.options.record:
                self.events.append(events[:, :2])
            if self.options.progress:
                done = self.log.t / self.until if self.until > 0.0 else 1.0
                self.options.progress(min(done, 1.0))
            if self.log.status != FULL:
                return np.concatenate(turns)

    def response(self, state: Any, reason: str, **measures: Any) -> Response:
        """The result, once the march is over."""
        log, spring = self.log, self.spring
        if log.status == OVERFLOW:
            reason += f"; the march overflowed at tau = {log.t:g} and ends there"
        elif log.status == STUCK:
            reason += f"; the march came to a standstill at tau = {log.t:g}"
        time, states = log.times[: log.filled], log.states[: log.filled]
        pitch, memory = states @ self.prepared.system.c, log.springs[: log.filled, 0]
        last = log.h
        if not self.prepared.law.memory:  # static, or a loop without height or width
            memory = np.asarray(spring.advance(memory, pitch))
            last = float(spring.advance(last, float(self.prepared.system.c @ log.x)))
        return Response(
            state=state,
            reason=reason,
            engine="exact",
            duration=float(log.t),
            final_state=log.x,
            final_memory=float(last),
            events=np.concatenate(self.events) if self.events else np.empty((0, 2)),
            **measures,
            **traces(self.prepared.system, spring, time, states, memory),
        )


def _watched(
    prepared: Prepared, spring: Spring, state: Array, memory: float, options: SimulateOptions
) -> Response:
    """The end states of the thesis, judged window by window as for the other engines."""
    system = prepared.system
    _, longest = period_range(system, closed_slopes(prepared.spring, float(system.c @ state)))
    window = max(PERIODS_A_WINDOW * np.nan_to_num(longest), LEAST)
    watch = Watch.over(system, prepared.spring, state, options, 0.0, 0.0)
    trace = _Trace(prepared, spring, state, memory, options, options.limit)
    verdict: Verdict | None = None
    while trace.log.t < options.limit and not (verdict and options.decide):
        begin = float(system.c @ trace.log.x)
        turns = trace.go(min(trace.log.t + window, options.limit))
        reached = np.concatenate(([begin, float(system.c @ trace.log.x)], turns[:, 1]))
        seen = watch.add(turns[:, 0], turns[:, 1], float(reached.min()), float(reached.max()))
        verdict = verdict or seen
        if trace.log.status != 0:
            break
    verdict = verdict or watch.last(trace.log.t)
    pitch = trace.log.states[: trace.log.filled] @ system.c
    extras = {"loops": verdict.loops, "event_kinds": KINDS}
    measures = watch.measures(verdict, lambda count: pitch[-count:], options.dt)
    return trace.response(verdict.state, verdict.reason, extras=extras, **measures)
