"""Tangents of springs without linear pieces.

δ' = (A - B F'(C x) C) δ, integrated together with the motion and made orthonormal again once an
oscillation.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.motion.chaos.growth import Growth, Landing, first_tangents
from aeroflutter.motion.chaos.smooth_window import along_loop, slope_law
from aeroflutter.motion.response import Initial, SimulateOptions, simulate
from aeroflutter.motion.settling import period_range
from aeroflutter.motion.smooth_laws import SmoothLoop
from aeroflutter.motion.smooth_watch import slopes_of
from aeroflutter.motion.spectra import PoincareSection

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from aeroflutter.model.lure import AnySystem
    from aeroflutter.springs import Springs

    Array = NDArray[np.float64]

__all__ = ["SmoothEngine", "slope_law"]

WATCHED = 500.0  # longest periods over which an end state is looked for
NO_PERIOD = 100.0  # τ, for systems that do not oscillate


@dataclass(frozen=True)
class SmoothEngine:
    """Taylor series for polynomials, SciPy's DOP853 for other laws; see `growth.Engine`."""

    system: AnySystem
    spring: Springs
    progress: Callable[[float], None] | None = None
    name: str = "smooth"

    @cached_property
    def loop(self) -> SmoothLoop:
        """The two of them."""
        return SmoothLoop.of(self.system, self.spring)

    @property
    def default_cycles(self) -> int:
        """Maxima over which exponents are measured if nothing else is asked."""
        return 20_000 if self.loop.pieces is not None else 1000

    def land(self, state: Array, memory: Any) -> Landing:
        """End state by the recurrence of the motion itself."""
        _, longest = self.periods(state)
        options = SimulateOptions(engine="exact", record=False, duration=WATCHED * longest)
        end = simulate(self.system, self.spring, Initial(state=state, memory=memory), options)
        return Landing(
            state=end.state, reason=end.reason, loops=int(end.extras.get("loops", 0)),
            period=end.period, multiplier=end.extras.get("multiplier", np.nan), rest=end.rest,
            state_vector=end.final_state, memory=end.final_memory,
        )  # fmt: skip

    def periods(self, state: Array) -> tuple[float, float]:
        """Shortest and longest period of small oscillations at rest and about a state, τ."""
        shortest, longest = period_range(self.loop.system, slopes_of(self.loop, state))
        return (shortest, longest) if np.isfinite(longest) else (NO_PERIOD, NO_PERIOD)

    def closed(self, landing: Landing) -> Array:
        """The system linearised where the motion is, (n, n)."""
        slopes = self.loop.slopes(self.loop.point(landing.state_vector, landing.memory))
        return np.asarray(self.loop.system.closed(slopes))

    def grow(self, landing: Landing, count: int, transient: int, exponents: int) -> Growth:
        """Follow the motion with `exponents` tangents over about `count` maxima."""
        march = _March(self, landing, exponents)
        for _ in march.over(transient):
            pass
        march.restart()
        for done in march.over(count):
            if self.progress and done % 16 == 0:
                self.progress(min(1.0, (transient + done) / (transient + count)))
        return march.growth()


@dataclass
class _March:
    """The motion and its tangents, window after window."""

    engine: SmoothEngine
    landing: Landing
    exponents: int
    tops: list[Array] = field(default_factory=list)
    top_times: list[float] = field(default_factory=list)
    troughs: list[float] = field(default_factory=list)
    times: list[float] = field(default_factory=list)
    logs: list[Array] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.x = self.engine.loop.point(self.landing.state_vector, self.landing.memory)
        self.tangents = np.linalg.qr(first_tangents(self.x.size, self.exponents))[0]
        shortest, _ = self.engine.periods(self.x)
        self.periodic = bool(np.isfinite(self.landing.period))
        loops = max(self.landing.loops, 1)
        self.window = self.landing.period / loops if self.periodic else shortest
        self.motion = along_loop(self.engine.loop, self.x, self.window, shortest)
        self.restart()

    def restart(self) -> None:
        """Forget what was measured so far."""
        self.clock, self.total, self.trough = 0.0, np.zeros(self.exponents), np.inf
        for log in (self.tops, self.top_times, self.troughs, self.times, self.logs):
            log.clear()

    def over(self, maxima: int) -> Iterator[int]:
        """March over so many maxima, or windows if there are fewer: a cycle has one a window."""
        done = 0
        for _ in range(maxima):
            if done >= maxima:
                return
            self._take_window()
            done = done + 1 if self.periodic else len(self.tops)
            yield done

    def _take_window(self) -> None:
        self.x, tangents, turns = self.motion(self.x, self.tangents)
        for time, side, *state in turns.tolist():
            self._note(self.clock + time, side > 0, np.array(state))
        self.tangents, upper = np.linalg.qr(tangents)
        self.total = self.total + np.log(np.abs(np.diag(upper)))
        self.clock += self.window
        self.times.append(self.clock)
        self.logs.append(self.total)

    def _note(self, time: float, top: bool, x: Array) -> None:
        """Enter a turning point."""
        if not top:
            self.trough = min(self.trough, self.engine.loop.y(x))
            return
        self.tops.append(x)
        self.top_times.append(time)
        self.troughs.append(self.trough)
        self.trough = np.inf

    def growth(self) -> Growth:
        """What was measured since the last restart."""
        loop = self.engine.loop
        points = np.array(self.tops).reshape(-1, self.x.size)
        states, memory, last = loop.state(points), loop.memories(points), loop.memories(self.x)
        section = PoincareSection(
            time=np.array(self.top_times),
            pitch=states @ loop.system.C[0],
            states=states,
            state_names=loop.system.state_names,
        )
        return Growth(
            section=section, memory=memory if last.size > 1 else memory[:, 0],
            troughs=np.array(self.troughs),
            time=np.array(self.times), logs=np.array(self.logs).reshape(-1, self.exponents),
            final_state=loop.state(self.x),
            final_memory=last if last.size > 1 else float(last[0]),
        )  # fmt: skip
