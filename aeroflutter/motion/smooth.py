"""Laws without straight pieces (cubic), alone or beside others, under the same end states.

What is marched is a point z = (x, h, …), see `smooth_laws`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from aeroflutter.motion.response import MOST_SAMPLES, Response, traces
from aeroflutter.motion.settling import Verdict, period_range
from aeroflutter.motion.smooth_cycle import settled_cycle
from aeroflutter.motion.smooth_laws import SmoothLoop
from aeroflutter.motion.smooth_steps import Limits, Stretch, stepper_of
from aeroflutter.motion.smooth_watch import JointWatch, slopes_of, watch_over
from aeroflutter.motion.swings import rows_of, swings_of, unknown

if TYPE_CHECKING:
    from typing import Any

    from numpy.typing import NDArray

    from aeroflutter.model.lure import AnySystem
    from aeroflutter.motion.response import SimulateOptions
    from aeroflutter.springs import Springs

    Array = NDArray[np.float64]

__all__ = ["march"]

STEPS_A_PERIOD = 4  # at least so many, so that no turning point hides within a step
RECURRENCE = 1e-5
DRIFT = 1e-7
LONGEST = 1e7  # τ within which an end state is looked for, if nothing else is asked
PATIENCE = 50  # times `cycles` that a motion still settling may take
CIRCLE = 1e-5  # distance of a multiplier from one that differences do not tell from zero
NEITHER = "a cycle that neither attracts nor repels: a multiplier on the unit circle"
BESIDE = 0.2  # of its size: how far a cycle may be that a motion still moves to
APPROACHES = "the motion moves to an attracting cycle beside it by {rate:.3g} % a hundred cycles"
COARSE = 64  # samples a window where no record is wanted
KEPT = 40  # windows of a motion of which no record is wanted


def march(
    system: AnySystem, spring: Springs, state: Array, memory: Any, options: SimulateOptions
) -> Response:
    """March by Taylor series or DOP853; see `motion.response.simulate`.

    Raises
    ------
    InputError
        If one of several springs jumps.
    """
    run = _Run(SmoothLoop.of(system, spring), state, memory, options)
    run.go()
    return run.response()


class _Run:
    """One march, shown to the watch a window at a time."""

    def __init__(
        self, loop: SmoothLoop, state: Array, memory: Any, options: SimulateOptions
    ) -> None:
        self.loop, self.options = loop, options
        start = loop.point(state, memory)
        shortest, longest = period_range(loop.system, slopes_of(loop, start))
        step = shortest / STEPS_A_PERIOD if np.isfinite(shortest) else np.inf
        self.window = longest if np.isfinite(longest) else 100.0
        self.watch = watch_over(loop, start, options, RECURRENCE, DRIFT)
        dt = options.dt if options.record else max(options.dt, self.window / COARSE)
        self.limits = Limits(dt, self.watch.bound, self._longest(), self.watch.size, step)
        self.motion = stepper_of(loop, start, self.limits)
        self.due = options.cycles
        self.samples: list[Array] = [self.motion.state[None].copy()]
        self.verdict: Verdict | None = None
        self.cycle: dict[str, Any] = {}
        self.failure = ""

    def go(self) -> None:
        """March until the end state is certain or the time is up."""
        limit = self.limits.time
        while self.motion.time < limit and not (self.verdict and self.options.decide):
            stretch = self.motion.march(min(self.motion.time + self.window, limit))
            self.samples.append(stretch.samples)
            if not self.options.record:
                del self.samples[:-KEPT]
            verdict = self._judge(stretch)
            self.failure = stretch.failure
            out = not abs(self.loop.y(self.motion.state)) <= self.watch.bound
            self.verdict = verdict if out else self.verdict or verdict
            if out or self.failure or self._given_up():
                return

    def _longest(self) -> float:
        """Time after which the march ends in any case: what is recorded has to be kept."""
        if self.options.duration is not None or not self.options.decide:
            return self.options.limit
        return min(LONGEST, MOST_SAMPLES * self.options.dt) if self.options.record else LONGEST

    def _given_up(self) -> bool:
        """Whether a bounded motion has had its cycles, many times as many while it settles."""
        cycles = self.watch.turns // 2
        if not self.options.decide or self.options.criteria == "thesis" or cycles < self.due:
            return False
        self.due *= 2
        if self._last().state != "undecided":
            return True
        if cycles < PATIENCE * self.options.cycles:
            return False
        self.verdict = self._approaching()
        return True

    def _approaching(self) -> Verdict | None:
        """The verdict on a motion that is still on its way to an attracting cycle beside it."""
        watch, way = self.watch, self.watch.envelope.goes_on()
        if not way:
            return None
        period = float(watch.times[-1] - watch.times[-3])
        found = settled_cycle(self.loop, self.motion.state, period, self.limits, BESIDE)
        if found is None or not found["multiplier"] < 1.0 - CIRCLE:
            return None
        low, high = watch.envelope.last()
        if not 0.0 < way * (found["amplitude"] / (0.5 * (high - low)) - 1.0) < BESIDE:
            return None
        self.cycle = found
        return Verdict("lco", APPROACHES.format(rate=100.0 * watch.envelope.change().rate), 1)

    def _judge(self, stretch: Stretch) -> Verdict | None:
        """Show a window to the watch."""
        if self.options.progress:
            self.options.progress(min(1.0, self.motion.time / self.limits.time))
        with np.errstate(over="ignore", invalid="ignore"):
            points = np.concatenate([stretch.samples, self.motion.state[None]])
            pitch = self.loop.state(points) @ self.loop.system.C[0]
        times, values = stretch.turns.T
        seen = np.concatenate((pitch, values))
        if isinstance(self.watch, JointWatch):
            self.watch.here = self.motion.state
        found = self.watch.add(times, values, float(np.min(seen)), float(np.max(seen)))
        return found or self.watch.trapped(self.motion.state, 0.0)

    def response(self) -> Response:
        """The result, once the march is over."""
        points, dt, loop = np.concatenate(self.samples), self.limits.dt, self.loop
        states, memories = loop.state(points), loop.memories(points)
        verdict = self.verdict or self._last()
        kept = states if self.options.record else states[:0]
        measures = self.watch.measures(verdict, lambda n: states[-n:] @ loop.system.C[0], dt)
        extras = {"loops": verdict.loops, "rtol": self.motion.tolerance}
        cycle = self.cycle or self._cycle(verdict, measures.get("period", np.nan))
        if cycle:
            extras["multiplier"] = cycle.pop("multiplier")
            if abs(extras["multiplier"] - 1.0) < CIRCLE:
                verdict = Verdict("neutral", NEITHER)
        low, high = cycle.pop("swings", None) or self._extremes(verdict, states)
        coordinates, springs = swings_of(loop.system, low, high)
        held = loop.memories(self.motion.state)
        return Response(
            state=verdict.state,
            reason=verdict.reason,
            engine="smooth",
            duration=self.motion.time,
            final_state=loop.state(self.motion.state).copy(),
            final_memory=held if held.size > 1 else float(held[0]),
            extras=extras,
            coordinates=tuple(coordinates),
            springs=tuple(springs),
            **(measures | cycle),
            **traces(
                loop.system,
                loop.springs[0],
                np.asarray(dt * np.arange(kept.shape[0]), dtype=np.float64),
                kept,
                memories[: kept.shape[0], 0],
            ),
        )

    def _extremes(self, verdict: Verdict, states: Array) -> tuple[Array, Array]:
        """Lowest and highest of all coordinates and springs, of what settled on no cycle."""
        if verdict.state == "divergent":
            return unknown(self.loop.system)
        if verdict.state == "damped":
            rest = self.loop.rest_near(self.motion.state)
            last = self.loop.state(self.motion.state if rest is None else rest)[None]
        else:
            last = states[-max(2, int(self.window / self.limits.dt)) :]
        y = last @ rows_of(self.loop.system).T
        return y.min(axis=0), y.max(axis=0)

    def _cycle(self, verdict: Verdict, period: float) -> dict[str, Any]:
        """The cycle itself, if the motion has been seen to settle on one."""
        if verdict.state != "lco" or self.options.criteria == "thesis" or not np.isfinite(period):
            return {}
        return settled_cycle(self.loop, self.motion.state, period, self.limits) or {}

    def _last(self) -> Verdict:
        if self.failure:
            return Verdict("undecided", self.failure)
        return self.watch.last(self.motion.time, self.motion.state)
