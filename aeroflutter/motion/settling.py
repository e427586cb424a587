"""End states of a march that is watched from outside: Houbolt's and of smooth springs."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from aeroflutter.model.lure import as_system
from aeroflutter.motion._kernel_settle import fundamental, repeats
from aeroflutter.motion.basins import Basin, smooth_basin
from aeroflutter.motion.evidence import (
    GROUP,
    LONGEST,
    PATIENT,
    Envelope,
    growth_at,
    lossless,
    smaller,
)
from aeroflutter.motion.parting import exponents
from aeroflutter.motion.response import SimulateOptions, State

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import Any

    from numpy.typing import NDArray

    from aeroflutter.model.lure import AnySystem, LureSystem
    from aeroflutter.motion.exponents import Exponents
    from aeroflutter.motion.flow import Flow
    from aeroflutter.springs import Spring

    Array = NDArray[np.float64]

__all__ = [
    *("Verdict", "Watch", "closed_slopes", "cycle_measures", "period_range", "rest_pitch"),
    "sample_spacing",
]

MOST_LOOPS = 16
KEPT = 4096
QUIET = 1e-6
STILL = 1e-9  # of the largest root: what grows no faster does not grow
NEWTON = 30
MEASURED = 1000  # oscillations over which an exponent is measured
CENTRED = 0.05  # of its size: how far the middle of a motion may be from its rest
DWINDLES = (
    "it shrinks by {rate:.3g} % a hundred cycles, as by the describing function it does at every "
    "smaller size down to a rest that attracts"
)
OVERFLOW = 1e150  # rad; squares of larger numbers are not finite
THESIS_DAMPED = np.radians(0.001)
THESIS_DIVERGENT = np.radians(100.0)


@dataclass(frozen=True)
class Verdict:
    """An end state and the evidence for it; `loops` is the n of a period-n motion."""

    state: State
    reason: str
    loops: int = 0


@dataclass
class Watch:
    """Judge of a march, shown one window of the motion after another.

    Parameters
    ----------
    system, spring
        What is marching.
    options
        Criteria, number of cycles and growth.
    size
        Scale of the nonlinearity or, for a linear spring, of the motion itself, rad.
    start
        Pitch at the start, rad.
    recurrence, drift
        See `_kernel_settle.repeats`: how well the engine's own noise lets a cycle repeat.
    """

    system: LureSystem
    spring: Spring
    options: SimulateOptions
    size: float
    start: float
    recurrence: float
    drift: float
    times: Array = field(default_factory=lambda: np.empty(0))
    values: Array = field(default_factory=lambda: np.empty(0))
    turns: int = 0
    rest: float = np.nan
    ranges: list[tuple[float, float]] = field(default_factory=list)
    envelope: Envelope = field(default_factory=Envelope)
    loose: Array = field(default_factory=lambda: np.empty(0))
    basins: dict[object, Basin | None] = field(default_factory=dict)

    @classmethod
    def over(
        cls,
        system: LureSystem,
        spring: Spring,
        state: Array,
        options: SimulateOptions,
        recurrence: float,
        drift: float,
    ) -> Watch:
        """Watch a march from `state`."""
        pitch = float(system.c @ state)
        size = spring.scale
        if len(closed_slopes(spring, pitch)) == 1:
            size = abs(pitch) or float(np.linalg.norm(state)) or 1.0
        return cls(system, spring, options, size, pitch, recurrence, drift)

    @property
    def bound(self) -> float:
        """Pitch beyond which the motion has diverged, rad."""
        if self.options.criteria == "thesis":
            return THESIS_DIVERGENT
        return min(self.options.growth * max(self.size, abs(self.start)), OVERFLOW)

    def add(self, times: Array, values: Array, low: float, high: float) -> Verdict | None:
        """Look at one more window.

        Parameters
        ----------
        times, values
            Turning points of pitch in the window.
        low, high
            Extremes of pitch in the window.

        Returns
        -------
        Verdict or None
            The end state, once it is certain.
        """
        self.turns += values.size
        self.times = np.concatenate((self.times, times))[-KEPT:]
        self.values = np.concatenate((self.values, values))[-KEPT:]
        self._enter(values)
        self.ranges = [*self.ranges[-3:], (low, high)]
        if not max(abs(low), abs(high)) <= self.bound:
            return self.diverged(max(abs(low), abs(high)))
        if self.options.criteria == "thesis":
            return self._thesis()
        return self._calm() or self._cycle(MOST_LOOPS)

    def _enter(self, values: Array) -> None:
        """Enter turning points among the loops of the envelope."""
        loose = np.concatenate((self.loose, values))
        if loose.size > 1 and loose[0] > loose[1]:
            loose = loose[1:]  # a loop begins with its minimum
        whole = 2 * GROUP * (loose.size // (2 * GROUP))
        peaks, troughs = loose[1:whole:2], loose[:whole:2]
        if whole:
            before = np.concatenate((np.full(MOST_LOOPS, np.inf), peaks))
            nearest = np.min(
                [
                    np.abs(peaks - before[MOST_LOOPS - lag : before.size - lag])
                    for lag in range(1, MOST_LOOPS + 1)
                ],
                axis=0,
            )
            heights = np.maximum(peaks - troughs, 1e-300)
            misses = np.where(np.isfinite(nearest), nearest / heights, 0.0)
            self.envelope.add(peaks, troughs, misses)
        self.loose = loose[whole:]

    def trapped(self, state: Array, memory: float) -> Verdict | None:
        """The proof that the motion comes to rest, if there is one."""
        if self.options.criteria == "thesis":
            return None
        self.rest = self._rest(state, memory)
        if np.isnan(self.rest):
            return None
        return Verdict("damped", "the motion provably decays to a rest from here on")

    def _rest(self, state: Array, memory: float) -> float:
        """Pitch of the rest to which the motion provably comes, or NaN."""
        if self.spring.piece_table() is not None:
            return rest_pitch(self.system, self.spring, state, memory)
        middle = 0.5 * sum(self.ranges[-1]) if self.ranges else float(self.system.c @ state)
        near = self._still_pitch(middle)
        if np.isnan(near):
            return near
        known = round(near / self.size, 9)
        if known not in self.basins:
            self.basins[known] = smooth_basin(self.system, self.spring, near, self.size)
        basin = self.basins[known]
        if basin is None:
            return float("nan")
        away = state - basin.centre
        return basin.rest if float(away @ basin.form @ away) < 1.0 else float("nan")

    def _still_pitch(self, pitch: float) -> float:
        """The equilibrium next to a pitch, by Newton's method; NaN if there is none."""
        stiffness, step = self.system.static_gain_inverse(), 1e-6 * self.size
        for _ in range(NEWTON):
            force = float(self.spring.moment(pitch)) + stiffness * pitch
            slope = self._slope(pitch) + stiffness
            change = force / slope if slope else np.inf
            if not abs(change) < 10.0 * self.size:
                return float("nan")
            pitch -= change
            if abs(change) < 1e-3 * step:
                return 0.0 if abs(pitch) < step and self.spring.moment(0.0) == 0.0 else pitch
        return float("nan")

    def _slope(self, pitch: float) -> float:
        """Slope of the spring at a pitch, by differences."""
        step = 1e-6 * self.size
        rise = self.spring.moment(pitch + step) - self.spring.moment(pitch - step)
        return float(rise) / (2.0 * step)

    def measures(self, verdict: Verdict, last: Callable[[int], Array], dt: float) -> dict[str, Any]:
        """Amplitude, bias, period, first harmonic and rest of a Response.

        Parameters
        ----------
        verdict
            The end state.
        last, dt
            The last so many uniform samples of pitch, or as many as are kept; their spacing.
        """
        if verdict.state == "divergent":
            return {}
        low, high = self.ranges[-1]
        middle = 0.5 * (low + high)
        if verdict.state == "damped":
            rest = middle if np.isnan(self.rest) else self.rest
            return {"amplitude": 0.0, "bias": rest, "rest": rest}
        if verdict.state != "lco" or self.values.size < 2 * verdict.loops + 1:
            return {"amplitude": 0.5 * (high - low), "bias": middle}
        found = cycle_measures(self.times, self.values, verdict.loops)
        period = found["period"] / dt
        return found | {"first_harmonic": fundamental(last(int(period) + 5), period)}

    def diverged(self, reached: float) -> Verdict:
        """The verdict on a motion that has left its bound."""
        if self.bound >= OVERFLOW or not abs(reached) < OVERFLOW:
            return Verdict("divergent", "pitch grew until it overflowed")
        return Verdict("divergent", f"pitch passed {np.degrees(self.bound):.6g} deg")

    def _thesis(self) -> Verdict | None:
        if 0.5 * self._width() < THESIS_DAMPED:
            return Verdict("damped", "pitch amplitude fell below 0.001 deg")
        return None

    def _calm(self) -> Verdict | None:
        falling = len(self.ranges) > 1 and self._width() <= self._width(-2)
        if falling and 0.5 * self._width() <= QUIET * self.size and self._holds():
            return Verdict("damped", f"the oscillation fell below {QUIET:g} of the spring's scale")
        return None

    def _holds(self) -> bool:
        """Whether small motions about where the motion is do not grow."""
        matrix = self.system.closed(self._slope(0.5 * sum(self.ranges[-1])))
        values = np.linalg.eigvals(matrix)
        return bool(values.real.max() <= STILL * np.abs(values).max())

    def _width(self, window: int = -1) -> float:
        low, high = self.ranges[window]
        return high - low

    def _cycle(self, most: int) -> Verdict | None:
        loops, _ = repeats(self.times, self.values, most, self.recurrence, self.drift)
        if loops == 0:
            return None
        return Verdict("lco", f"the motion repeats after {_loops(loops)}", loops)

    def last(self, time: float, state: Array | None = None, memory: float = 0.0) -> Verdict:
        """The end state when the time is up without a decision.

        Parameters
        ----------
        time
            When that is.
        state, memory
            Where the motion stands, (n,); without it nothing is measured there.
        """
        if self.options.criteria == "thesis":
            return Verdict("lco", f"neither damped nor divergent after tau = {time:g}", 1)
        cycles, envelope = self.turns // 2, self.envelope
        if envelope.loops >= self.options.cycles and state is not None:
            verdict = self._evident(state, memory)
            if verdict is not None:
                return verdict
        why = "not settled"
        if envelope.loops:
            rate = 100.0 * envelope.change().rate
            why = f"still drifting by {rate:.3g} % a hundred cycles"
        return Verdict("undecided", f"{why} at tau = {time:g} after {cycles} cycles")

    def _evident(self, state: Array, memory: float) -> Verdict | None:
        """What the envelope is evidence of, by the rules of the exact engine."""
        envelope, cycles = self.envelope, self.turns // 2
        long = envelope.loops >= PATIENT * self.options.cycles
        if long and self._dwindles():
            rate = -100.0 * envelope.change().rate
            return Verdict("damped", DWINDLES.format(rate=rate))
        if envelope.change().moving and not envelope.flat:
            return None
        found = self._parting(state, memory, min(envelope.loops, MEASURED))
        if found is None:
            return None
        said = f"bounded, its envelope stationary over {cycles} cycles"
        if envelope.chaotic(found):
            return Verdict("aperiodic", f"{said}, neighbours part: exponent {found.values[0]:.3g}")
        cycle = self._cycle(LONGEST)
        if cycle is not None:
            return cycle
        if long and self._lossless(state):
            if envelope.flat:
                return Verdict("neutral", "nothing is damped: the motion neither settles nor grows")
        elif long and envelope.stationary():
            return Verdict("aperiodic", f"{said}, neighbours neither part nor meet")
        return None

    def _parting(self, state: Array, memory: float, count: int) -> Exponents | None:
        """How fast neighbours part over so many maxima."""
        return exponents(self.system, self.spring, state, memory, count)

    def _lossless(self, state: Array) -> bool:
        """Whether nothing is damped."""
        slopes = closed_slopes(self.spring, float(self.system.c @ state))
        return lossless(np.array([self.system.closed(slope) for slope in slopes]))

    def _dwindles(self) -> bool:
        """Whether the motion shrinks about a rest, and does so at every smaller size."""
        if self.spring.piece_table() is not None or self.envelope.goes_on() >= 0:
            return False
        low, high = self.envelope.last()
        size, rest = 0.5 * (high - low), self._still_pitch(0.5 * (high + low))
        if not abs(0.5 * (high + low) - rest) < CENTRED * size:
            return False
        closed = self.system.closed(self._slope(rest))
        rates = growth_at(self.system, self.spring, smaller(size), rest)
        values = np.linalg.eigvals(closed)
        if np.all(values.real < -STILL * np.abs(values).max()) and np.all(rates < 0.0):
            self.rest = rest
            return True
        return False


def _loops(count: int) -> str:
    return "one loop" if count == 1 else f"{count} loops"


def closed_slopes(spring: Spring, pitch: float) -> tuple[float, ...]:
    """Slopes that the spring can have, as far as they are finite; at `pitch` if they are not."""
    slopes = set(spring.slope_range())
    table = spring.piece_table()
    if table is not None:
        slopes |= set(table.slopes)
    finite = {float(slope) for slope in slopes if np.isfinite(slope)}
    if len(finite) < len(slopes):
        step = 1e-6 * max(abs(pitch), spring.scale)
        rise = spring.moment(pitch + step) - spring.moment(pitch - step)
        finite.add(float(rise) / (2.0 * step))
    return tuple(sorted(finite))


def period_range(system: AnySystem, slopes: Sequence[Any]) -> tuple[float, float]:
    """Shortest and longest period of oscillation over the linear pieces, τ; NaN without any.

    `slopes` holds what `system.closed` takes, once a piece. Roots that decay or grow by more than a
    factor exp(2π) in a turn do not count as oscillations.
    """
    roots = np.concatenate([np.linalg.eigvals(system.closed(slope)) for slope in slopes])
    frequencies = np.abs(roots.imag)
    frequencies = frequencies[(frequencies > 1e-6) & (frequencies > np.abs(roots.real))]
    if frequencies.size == 0:
        return float("nan"), float("nan")
    return float(2 * np.pi / frequencies.max()), float(2 * np.pi / frequencies.min())


def sample_spacing(system: AnySystem) -> float:
    """Spacing of samples that show every oscillation of a system with springs of slope one.

    A tenth of the shortest period and a hundredth of the longest; 0.1 where nothing oscillates.
    """
    ones = [np.ones(as_system(system).outputs)]
    shortest, longest = period_range(as_system(system), ones)
    return float(np.nan_to_num(min(0.1 * shortest, 0.01 * longest), nan=0.1))


def cycle_measures(times: Array, values: Array, loops: int) -> dict[str, float]:
    """Amplitude, bias and period of a steady motion.

    Parameters
    ----------
    times, values
        Turning points, the newest last.
    loops
        Oscillations a period.
    """
    lag = 2 * loops
    count = max(1, min(max(3, 8 // loops), (values.size - 1) // lag))
    period = (times[-1] - times[-1 - count * lag]) / count
    last = values[values.size - count * lag :].tolist()
    periods = [last[i : i + lag] for i in range(0, count * lag, lag)]
    high, low = sum(map(max, periods)) / count, sum(map(min, periods)) / count
    return {"amplitude": (high - low) / 2, "bias": (high + low) / 2, "period": float(period)}


def rest_pitch(system: LureSystem, spring: Spring, state: Array, memory: float) -> float:
    """Pitch at which the motion ends if it provably stays on its branch of the spring; else NaN.

    The exact engine's own proof; a smooth spring has no branch to stay on.
    """
    if spring.piece_table() is None:
        return float("nan")
    return _flow(system, spring).rest(state, memory)


@lru_cache(maxsize=16)
def _flow(system: LureSystem, spring: Spring) -> Flow:
    """Shared by all marches of one system (systems are equal only to themselves)."""
    from aeroflutter.motion.flow import Flow

    return Flow(system, [spring])
