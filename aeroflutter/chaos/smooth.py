"""Tangents of springs without linear pieces: DOP853 on the variational equations.

δ' = (A - F'(c x) b c) δ, integrated together with the motion and made orthonormal again once an
oscillation.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.chaos.growth import Growth, Landing, first_tangents
from aeroflutter.springs import Cubic
from aeroflutter.timemarch.response import Initial, SimulateOptions, simulate
from aeroflutter.timemarch.settling import closed_slopes, period_range
from aeroflutter.timemarch.smooth_steps import scalar_law
from aeroflutter.timemarch.spectra import PoincareSection

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from aeroflutter.lure import LureSystem
    from aeroflutter.springs import Spring

    Array = NDArray[np.float64]

__all__ = ["SmoothEngine", "slope_law"]

RTOL = 1e-9
STEPS_A_PERIOD = 4
WATCHED = 500.0  # longest periods over which an end state is looked for
NO_PERIOD = 100.0  # τ, for systems that do not oscillate
DIFFERENCE = 6e-6  # cube root of round-off: the best step of a central difference


@dataclass(frozen=True)
class SmoothEngine:
    """SciPy's DOP853; see `growth.Engine`."""

    system: LureSystem
    spring: Spring
    progress: Callable[[float], None] | None = None
    name: str = "smooth"
    default_cycles: int = 1000

    def land(self, state: Array, memory: float) -> Landing:
        """End state by the recurrence of the motion itself."""
        _, longest = self.periods(state)
        options = SimulateOptions(engine="exact", record=False, duration=WATCHED * longest)
        end = simulate(self.system, self.spring, Initial(state=state, memory=memory), options)
        return Landing(
            state=end.state, reason=end.reason, loops=int(end.extras.get("loops", 0)),
            period=end.period, multiplier=float("nan"), rest=end.rest,
            state_vector=end.final_state, memory=end.final_memory,
        )  # fmt: skip

    def periods(self, state: Array) -> tuple[float, float]:
        """Shortest and longest period of small oscillations at rest and about a state, τ."""
        slopes = closed_slopes(self.spring, float(self.system.c @ state))
        shortest, longest = period_range(self.system, slopes)
        return (shortest, longest) if np.isfinite(longest) else (NO_PERIOD, NO_PERIOD)

    def slope(self, landing: Landing) -> float:
        """Incremental slope at the pitch where the motion is."""
        return slope_law(self.spring)(float(self.system.c @ landing.state_vector))

    def grow(self, landing: Landing, count: int, transient: int, exponents: int) -> Growth:
        """Follow the motion with `exponents` tangents over about `count` maxima."""
        march = _March(self, landing, exponents)
        march.over(transient)
        march.restart()
        for done in range(count):
            march.over(1)
            if self.progress and done % 16 == 0:
                self.progress((transient + done) / (transient + count))
        return march.growth()


@dataclass(frozen=True)
class _Turn:
    """Slope y' of the motion, as an event of SciPy: falling at maxima, rising at minima."""

    system: LureSystem
    moment: Callable[[float], float]
    direction: int

    def __call__(self, _: float, z: Array) -> float:
        c, b = self.system.c, self.system.b
        x = z.reshape(c.size, -1)[:, 0]
        return float(c @ (self.system.A @ x)) - float(c @ b) * self.moment(float(c @ x))


@dataclass
class _March:
    """The motion and its tangents as one vector, window after window."""

    engine: SmoothEngine
    landing: Landing
    exponents: int
    tops: list[Array] = field(default_factory=list)
    top_times: list[float] = field(default_factory=list)
    troughs: list[float] = field(default_factory=list)
    times: list[float] = field(default_factory=list)
    logs: list[Array] = field(default_factory=list)

    def __post_init__(self) -> None:
        system, spring = self.engine.system, self.engine.spring
        self.A, self.b, self.c = system.A, system.b, system.c
        self.moment, self.slope = scalar_law(spring), slope_law(spring)
        self.falling, self.rising = _Turn(system, self.moment, -1), _Turn(system, self.moment, 1)
        self.x = self.landing.state_vector.copy()
        self.tangents = np.linalg.qr(first_tangents(self.x.size, self.exponents))[0]
        shortest, longest = self.engine.periods(self.x)
        self.window = self.landing.period / max(self.landing.loops, 1)
        if not np.isfinite(self.window):
            self.window = longest
        self.longest_step = min(self.window, shortest) / STEPS_A_PERIOD
        self.first_step: float | None = None
        self.size = float(np.abs(self.x).max()) or 1.0
        self.restart()

    def restart(self) -> None:
        """Forget what was measured so far."""
        self.clock, self.total, self.trough = 0.0, np.zeros(self.exponents), np.inf
        for log in (self.tops, self.top_times, self.troughs, self.times, self.logs):
            log.clear()

    def rate(self, _: float, z: Array) -> Array:
        """Motion and tangents, (n (1 + k),)."""
        columns = z.reshape(self.x.size, -1)
        change = self.A @ columns
        y = self.c @ columns
        pitch = float(y[0])
        y[0], y[1:] = self.moment(pitch), self.slope(pitch) * y[1:]
        change -= np.outer(self.b, y)
        return change.ravel()

    def over(self, windows: int) -> None:
        """March over some windows."""
        from scipy.integrate import solve_ivp

        n = self.x.size
        for _ in range(windows):
            start = np.column_stack((self.x, self.tangents))
            scale = np.ones_like(start)
            scale[:, 0] = self.size
            found: Any = solve_ivp(
                self.rate, (0.0, self.window), start.ravel(), method="DOP853",
                events=(self.falling, self.rising), rtol=RTOL, atol=RTOL * scale.ravel(),
                max_step=self.longest_step, first_step=self.first_step,
            )  # fmt: skip
            self.first_step = float(np.median(np.diff(found.t)))
            self._note(found.t_events, found.y_events)
            end = found.y[:, -1].reshape(n, -1)
            self.x = end[:, 0].copy()
            self.tangents, upper = np.linalg.qr(end[:, 1:])
            self.total = self.total + np.log(np.abs(np.diag(upper)))
            self.clock += self.window
            self.times.append(self.clock)
            self.logs.append(self.total)

    def _note(self, times: list[Array], states: list[Array]) -> None:
        """Enter the maxima and minima of a window in their order."""
        n = self.x.size
        turns = [(float(t), z, True) for t, z in zip(times[0], states[0], strict=True)]
        turns += [(float(t), z, False) for t, z in zip(times[1], states[1], strict=True)]
        for time, z, top in sorted(turns, key=lambda turn: turn[0]):
            x = z.reshape(n, -1)[:, 0]
            if not top:
                self.trough = min(self.trough, float(self.c @ x))
                continue
            self.tops.append(x.copy())
            self.top_times.append(self.clock + time)
            self.troughs.append(self.trough)
            self.trough = np.inf

    def growth(self) -> Growth:
        """What was measured since the last restart."""
        states = np.array(self.tops).reshape(-1, self.x.size)
        section = PoincareSection(
            time=np.array(self.top_times),
            pitch=states @ self.c,
            states=states,
            state_names=self.engine.system.state_names,
        )
        return Growth(
            section=section, memory=np.zeros(states.shape[0]), troughs=np.array(self.troughs),
            time=np.array(self.times), logs=np.array(self.logs).reshape(-1, self.exponents),
            final_state=self.x, final_memory=self.landing.memory,
        )  # fmt: skip


def slope_law(spring: Spring) -> Callable[[float], float]:
    """Incremental slope of a smooth spring at one pitch."""
    if isinstance(spring, Cubic):
        beta1, beta3 = spring.beta1, spring.beta3
        return lambda y: beta1 + 3.0 * beta3 * y * y
    step = DIFFERENCE * spring.scale
    law = scalar_law(spring)
    return lambda y: (law(y + step) - law(y - step)) / (2.0 * step)
