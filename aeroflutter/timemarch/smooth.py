"""Springs without linear pieces (cubic) on SciPy's DOP853, under the same end states."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.springs import Cubic
from aeroflutter.timemarch.response import Response, traces
from aeroflutter.timemarch.settling import Verdict, Watch, closed_slopes, period_range

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from aeroflutter.lure import LureSystem
    from aeroflutter.springs import Spring
    from aeroflutter.timemarch.response import SimulateOptions

    Array = NDArray[np.float64]

__all__ = ["march"]

RTOL = 1e-11
STEPS_A_PERIOD = 4  # at least so many, so that no turning point hides within a step
RECURRENCE = 1e-5
DRIFT = 1e-7


def march(
    system: LureSystem, spring: Spring, state: Array, memory: float, options: SimulateOptions
) -> Response:
    """March with DOP853; see `timemarch.response.simulate`.

    Pitch maxima and minima are roots of y' on the integrator's own dense output.
    """
    run = _Run(system, spring, state, memory, options)
    run.go()
    return run.response()


class _Run:
    """One march: steps of the integrator gathered into windows for the watch."""

    def __init__(
        self,
        system: LureSystem,
        spring: Spring,
        state: Array,
        memory: float,
        options: SimulateOptions,
    ) -> None:
        from scipy.integrate import DOP853

        self.system, self.spring, self.options, self.memory = system, spring, options, memory
        self.moment = scalar_law(spring)
        self.row, self.direct = system.c @ system.A, float(system.c @ system.b)
        slopes = closed_slopes(spring, float(system.c @ state))
        shortest, longest = period_range(system, slopes)
        self.longest_step = shortest / STEPS_A_PERIOD if np.isfinite(shortest) else np.inf
        self.window = longest if np.isfinite(longest) else 100.0
        self.watch = Watch.over(system, spring, state, options, RECURRENCE, DRIFT)
        self.verdict: Verdict | None = None
        self.solver: Any = DOP853(
            self.rate,
            0.0,
            state,
            options.limit,
            max_step=self.longest_step,
            rtol=RTOL,
            atol=RTOL * self.watch.size,
        )
        self.samples: list[Array] = [state[None]]
        self.count = 1
        self.turns: list[tuple[float, float]] = []

    def rate(self, _: float, x: Array) -> Array:
        """Right-hand side A x - b F(c x)."""
        return self.system.A @ x - self.system.b * self.moment(float(self.system.c @ x))

    def go(self) -> None:
        """March until the end state is certain or the time is up."""
        due, first = self.window, 1
        while self.solver.status == "running" and not (self.verdict and self.options.decide):
            with np.errstate(over="ignore", invalid="ignore"):
                message = self.solver.step()
                self._take_step()
            out = not abs(float(self.system.c @ self.solver.y)) <= self.watch.bound
            if out or message or self.solver.t >= min(due, self.options.limit):
                verdict = self._judge(first)
                self.verdict = verdict if out else self.verdict or verdict
                due, first = self.solver.t + self.window, len(self.samples)
            if out or message:
                return

    def _take_step(self) -> None:
        """Sample the step and find its turning points."""
        dense = self.solver.dense_output()
        last = int(np.floor(self.solver.t / self.options.dt + 1e-9))
        if last >= self.count:
            self.samples.append(dense(self.options.dt * np.arange(self.count, last + 1)).T)
            self.count = last + 1
        grid = np.linspace(self.solver.t_old, self.solver.t, 4)
        slopes = [self._slope(x) for x in dense(grid).T]
        for i in range(3):
            if slopes[i] * slopes[i + 1] < 0.0 or (slopes[i + 1] == 0.0 and slopes[i] != 0.0):
                time = self._turn(dense, grid[i], grid[i + 1])
                self.turns.append((time, float(self.system.c @ dense(time))))

    def _slope(self, x: Array) -> float:
        """Slope y' = c A x - (c b) F(y)."""
        slope = float(self.row @ x)
        return slope - self.direct * self.moment(float(self.system.c @ x)) if self.direct else slope

    def _turn(self, dense: Callable[[float], Array], low: float, high: float) -> float:
        from scipy.optimize import brentq

        return float(brentq(lambda t: self._slope(dense(t)), low, high, xtol=1e-12, rtol=1e-14))

    def _judge(self, first: int) -> Verdict | None:
        """Show the last window to the watch."""
        turns = np.array(self.turns).reshape(-1, 2)
        self.turns = []
        pitch = np.concatenate([*self.samples[first:], self.solver.y[None]]) @ self.system.c
        if self.options.progress:
            self.options.progress(self.solver.t / self.options.limit)
        low, high = float(np.min(pitch)), float(np.max(pitch))
        return self.watch.add(turns[:, 0], turns[:, 1], low, high)

    def response(self) -> Response:
        """The result, once the march is over."""
        states = np.concatenate(self.samples)
        dt = self.options.dt
        verdict = self.verdict or self._last()
        kept = states if self.options.record else states[:0]
        return Response(
            state=verdict.state,
            reason=verdict.reason,
            engine="smooth",
            duration=float(self.solver.t),
            final_state=self.solver.y.copy(),
            final_memory=self.memory,
            extras={"loops": verdict.loops, "rtol": RTOL},
            **self.watch.measures(verdict, lambda n: states[-n:] @ self.system.c, dt),
            **traces(
                self.system,
                self.spring,
                np.asarray(dt * np.arange(kept.shape[0]), dtype=np.float64),
                kept,
                np.full(kept.shape[0], self.memory),
            ),
        )

    def _last(self) -> Verdict:
        if self.solver.status == "failed":
            return Verdict("undecided", f"DOP853 gave up at tau = {self.solver.t:g}")
        return self.watch.last(float(self.solver.t))


def scalar_law(spring: Spring) -> Callable[[float], float]:
    """The moment of one pitch, without the cost of arrays where the law is known."""
    if isinstance(spring, Cubic):
        beta1, beta3 = spring.beta1, spring.beta3
        return lambda y: y * (beta1 + beta3 * y * y)
    return lambda y: float(spring.moment(y))
