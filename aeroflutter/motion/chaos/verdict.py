"""Periodic, quasi-periodic or chaotic: the verdict on one motion, with the numbers behind it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.analysis import Result
from aeroflutter.motion.chaos.options import ChaosOptions
from aeroflutter.motion.entry import at_a_speed
from aeroflutter.motion.exponents import Exponents, measured, of_eigenvalues
from aeroflutter.motion.response import Initial, Response, SimulateOptions, simulate
from aeroflutter.springs import alone, each, simplify, straight
from aeroflutter.verdicts import VERDICTS, Verdict

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from aeroflutter.model.lure import AnySystem
    from aeroflutter.motion.chaos.growth import Engine, Growth, Landing
    from aeroflutter.motion.spectra import PoincareSection
    from aeroflutter.springs import Springs

    Array = NDArray[np.float64]

__all__ = ["VERDICTS", "ChaosResult", "Verdict", "chaos", "recurrence"]

MOST_LOOPS = 512  # of a period that recurrence alone can show
RECURS = 1e-6  # relative distance of returns that are the same
NOISE = 1e-9  # states that are smaller than this part of the largest are round-off
CLOSING, FEW_LOOPS = 1e-3, 16  # as near after so few loops, a motion closes in on a cycle
LEAST_RETURNS = 64  # that must be the same
STEADY = 3.0  # the error of a zero exponent over its resolution: more, and the run is not steady
DOUBLINGS = 3
AT_END = ("damped", "divergent")
PROVISIONAL = ("undecided", "quasi-periodic")


@dataclass(frozen=True, kw_only=True)
class ChaosResult(Result):
    """What kind of motion it is.

    Attributes
    ----------
    verdict
        One of `VERDICTS`.
    reason
        One line: the numbers that decide it.
    engine
        "exact" or "smooth".
    loops
        n of a period-n motion: maxima of y in one period; 0 if it is not periodic.
    period
        Of a periodic motion, τ.
    multiplier
        Largest modulus of the Floquet multipliers of a cycle that Newton has closed, else NaN.
    exponents
        Lyapunov exponents with their error. Of a motion that comes to rest or diverges: real
        parts of the eigenvalues of the branch on which it does.
    amplitude, bias
        Half peak-to-peak and midrange of y over the measured stretch, rad.
    return_time
        Mean time from maximum to maximum, τ.
    section
        Time, y and states at the maxima.
    memory, troughs
        Memory there, and the lowest minimum before each, (m,).
    transient
        Maxima left out before the measured stretch.
    final_state, final_memory
        Where the motion was left, (n,).
    """

    verdict: Verdict
    reason: str
    engine: str
    loops: int
    period: float
    multiplier: float
    exponents: Exponents
    amplitude: float
    bias: float
    return_time: float
    section: PoincareSection = field(repr=False)
    memory: Array = field(repr=False)
    troughs: Array = field(repr=False)
    transient: int
    final_state: Array = field(repr=False)
    final_memory: Any

    @property
    def name(self) -> str:
        """The verdict, with n if it is periodic."""
        return f"period-{self.loops}" if self.verdict == "periodic" else self.verdict

    @property
    def floquet(self) -> float:
        """Exponent that the leading multiplier gives, log|μ|/T; NaN without one."""
        with np.errstate(divide="ignore"):
            return float(np.log(self.multiplier) / self.period)

    def peaks(self, most: int = 200) -> Array:
        """The n maxima of y of a periodic motion, else the last `most`, rad."""
        return self.section.pitch[-min(self.loops or most, most) :]

    def trace(self, system: AnySystem, spring: Springs, cycles: int = 400) -> Response:
        """The motion marched on with samples, for phase planes and spectra.

        Parameters
        ----------
        system, spring
            Those of the motion.
        cycles
            Oscillations, or as many periods of a periodic motion as they make.
        """
        step = self.return_time / 64 if np.isfinite(self.return_time) else 0.1
        return simulate(
            system,
            spring,
            Initial(state=self.final_state, memory=self.final_memory),
            SimulateOptions(duration=64 * cycles * step, dt=step, decide=False),
        )


@at_a_speed
def chaos(
    system: AnySystem,
    spring: Springs,
    initial: Initial | None = None,
    options: ChaosOptions | None = None,
    progress: Callable[[float], None] | None = None,
) -> ChaosResult:
    """Say what kind of motion a Lur'e system settles into, with its Lyapunov exponents.

    Parameters
    ----------
    system
        x' = A x - b F(c x) at one speed.
    spring
        Piecewise-linear springs and loops go to the exact engine, cubic ones to Taylor series,
        other laws to DOP853.
    initial
        Motion at τ = 0.
    options
        How long to follow it.
    progress
        Called now and then with the fraction done; the exact engine needs no time.

    Notes
    -----
    A motion that the end states of the engine call a limit cycle is periodic, and its exponents
    are measured on the cycle. One that does not settle is chaotic if the largest exponent exceeds
    its error, periodic if its returns recur, quasi-periodic if two exponents are zero within
    their error. After the measurement the end state is asked for again, so that a chaotic
    transient is not taken for chaos: the verdict is then that of what came after it. Where two
    exponents are zero, or nothing is decided, the measurement goes on over twice the length, up
    to `DOUBLINGS` times: a slow attraction to a cycle then shows.

    Examples
    --------
    >>> from aeroflutter import Freeplay, SectionFamily, TypicalSection
    >>> system = SectionFamily(TypicalSection(omega_bar=0.2)).at(0.3 * 6.285)
    >>> found = chaos(system, Freeplay(0.01), Initial(alpha=0.1), ChaosOptions(cycles=2000))
    >>> found.verdict
    'chaotic'
    """
    options = options or ChaosOptions()
    state, memory = (initial or Initial()).start(system, spring)
    engine = _engine(system, spring, progress)
    count = min(options.exponents, system.order)
    length = engine.default_cycles if options.cycles is None else options.cycles
    landing, transient, longer = engine.land(state, memory), 0, 0
    while landing.state not in AT_END:
        whole = _whole(length, options.blocks * max(landing.loops, 1))
        growth = engine.grow(landing, whole, options.transient, count)
        transient += options.transient
        exponents = measured(growth.time, growth.logs, options.blocks)
        if landing.state == "lco":
            return _result(engine, landing, growth, exponents, transient)
        landing = engine.land(growth.final_state, growth.final_memory)
        if landing.state not in (*AT_END, "lco"):
            result = _result(engine, landing, growth, exponents, transient)
            if result.verdict not in PROVISIONAL or longer == DOUBLINGS:
                return result
            length, longer = 2 * length, longer + 1
        transient += growth.section.pitch.size
    return _settled(system, engine, landing, count, transient)


def _engine(system: AnySystem, spring: Springs, progress: Callable[[float], None] | None) -> Engine:
    simple = alone([simplify(one) for one in each(spring)])
    if all(map(straight, each(simple))):
        from aeroflutter.motion.chaos.exact import ExactEngine

        return ExactEngine.of(system, simple)
    from aeroflutter.motion.chaos.smooth import SmoothEngine

    return SmoothEngine(system, simple, progress)


def _whole(length: int, part: int) -> int:
    """The length, rounded up to whole parts: periods in every block, so that they are alike."""
    return part * -(-length // part)


def _result(
    engine: Engine, landing: Landing, growth: Growth, exponents: Exponents, transient: int
) -> ChaosResult:
    verdict, reason, loops = _judge(landing, growth, exponents)
    time = growth.section.time
    low = float(np.min(growth.troughs, initial=np.inf))
    high = float(np.max(growth.section.pitch, initial=-np.inf))
    between = float(np.diff(time).mean()) if time.size > 1 else float("nan")
    return ChaosResult(
        verdict=verdict,
        reason=reason,
        engine=engine.name,
        loops=loops,
        period=landing.period if landing.state == "lco" else _period(time, loops),
        multiplier=landing.multiplier,
        exponents=exponents,
        amplitude=0.5 * (high - low),
        bias=0.5 * (high + low),
        return_time=between,
        section=growth.section,
        memory=growth.memory,
        troughs=growth.troughs,
        transient=transient,
        final_state=growth.final_state,
        final_memory=growth.final_memory,
    )


def _judge(landing: Landing, growth: Growth, exponents: Exponents) -> tuple[Verdict, str, int]:
    """Verdict, its reason and n."""
    values, error = exponents.values, exponents.error
    if landing.state == "lco":
        return "periodic", landing.reason, landing.loops
    if not np.isfinite(values[0]):
        return "undecided", f"too few oscillations to measure; {landing.reason}", 0
    largest = f"largest exponent {values[0]:.4g} ± {error[0]:.2g} per unit tau"
    positive, steady = values[0] > error[0], error[0] <= STEADY * exponents.resolution
    loops = recurrence(growth.section.states)
    if loops:
        why = f"{largest}; in the end returns recur after {loops} loop(s)"
        return ("periodic", why, loops) if steady and not positive else ("undecided", why, 0)
    if positive:
        return "chaotic", f"{largest}: positive", 0
    closing = 0 < recurrence(growth.section.states, CLOSING) <= FEW_LOOPS
    if landing.state in ("aperiodic", "neutral") and _two_zeros(exponents) and not closing:
        second = f"second {values[1]:.4g} ± {error[1]:.2g}"
        return "quasi-periodic", f"{largest}, {second}: both zero, and no recurrence", 0
    return "undecided", f"{largest}: not positive, but no recurrence; {landing.reason}", 0


def _two_zeros(exponents: Exponents) -> bool:
    """Whether the two largest exponents are zero, and well enough known to say so."""
    values, error = exponents.values[:2], exponents.error[:2]
    small = (np.abs(values) <= error) & (error <= STEADY * exponents.resolution)
    return values.size == 2 and bool(small.all())


def _period(time: Array, loops: int) -> float:
    """Time of the last so many loops; NaN for none."""
    return float(time[-1] - time[-1 - loops]) if loops else float("nan")


def recurrence(states: Array, tolerance: float = RECURS) -> int:
    """Smallest n after which the last returns repeat, at most `MOST_LOOPS`; 0 if there is none.

    Parameters
    ----------
    states
        States at successive maxima, (m, n).
    tolerance
        Relative distance of returns that count as the same.
    """
    size = np.abs(states).max(axis=0, initial=0.0)
    largest = float(size.max(initial=0.0)) or 1.0
    tail = states / np.where(size > NOISE * largest, size, largest)  # y' vanishes at a maximum
    for n in range(1, min(MOST_LOOPS, tail.shape[0] // 4) + 1):
        m = max(2 * n, LEAST_RETURNS)
        if m + n <= tail.shape[0] and np.abs(tail[-m:] - tail[-m - n : -n]).max() < tolerance:
            return n
    return 0


def _settled(
    system: AnySystem, engine: Engine, landing: Landing, count: int, transient: int
) -> ChaosResult:
    """The result of a motion that came to rest or left."""
    from aeroflutter.motion.spectra import PoincareSection

    none, n = np.empty(0), system.order
    section = PoincareSection(
        time=none, pitch=none, states=np.empty((0, n)), state_names=system.state_names
    )
    rest = landing.state == "damped"
    return ChaosResult(
        verdict="damped" if rest else "divergent",
        reason=landing.reason,
        engine=engine.name,
        loops=0,
        period=float("nan"),
        multiplier=float("nan"),
        exponents=of_eigenvalues(engine.closed(landing), count),
        amplitude=0.0 if rest else float("nan"),
        bias=landing.rest,
        return_time=float("nan"),
        section=section,
        memory=none,
        troughs=none,
        transient=transient,
        final_state=landing.state_vector,
        final_memory=landing.memory,
    )
