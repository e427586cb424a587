"""End states of the exact engine: damped, limit cycle, aperiodic, divergent, or why undecided."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from aeroflutter.errors import InputError
from aeroflutter.motion import _kernel_ends as kernel
from aeroflutter.motion import _kernel_proofs as codes
from aeroflutter.motion._kernel_ends import Cycles
from aeroflutter.motion.judge import CONTRACTS, Settling
from aeroflutter.motion.swings import Lap
from aeroflutter.verdicts import STATES

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from aeroflutter.motion.flow import Flow
    from aeroflutter.motion.response import State

    Array = NDArray[np.float64]

__all__ = [
    "EndOptions",
    "EndState",
    "EndStates",
    "end_state",
    "end_states",
    "reason",
]

REASONS = {
    codes.TRAPPED: "a bound of all further motion on this branch of the spring stays within it",
    codes.CORNERED: "a Lyapunov function of the pieces that meet at the rest falls from here on",
    codes.AT_REST: "the section has come to rest",
    codes.FADED: "the oscillation has fallen to nothing against the spring, and falls",
    codes.RETREATS: "the law is straight but for a corner at the rest, and the motion shrinks "
    "turn by turn ({rate:.3g} % a hundred cycles)",
    codes.CONVERGED: "the motion closes in on an attracting cycle of {loops:.0f} loop(s), largest "
    "multiplier {radius:.6g}",
    codes.KNOWN: "the motion closes in on a known attracting cycle of {loops:.0f} loop(s), "
    "largest multiplier {radius:.6g}",
    codes.UNSETTLED: "bounded, its envelope stationary over {maxima:.0f} cycles, neighbours part: "
    "exponent {exponent:.3g}",
    codes.TORUS: "bounded, its envelope stationary over {maxima:.0f} cycles, no return like "
    "another and neighbours neither part nor meet: exponent {exponent:.1g}",
    codes.ESCAPED: "an unstable mode has outgrown all that the spring can oppose",
    codes.OUTGROWN: "it swings over the whole law and grows by {rate:.3g} % a hundred "
    "cycles, as by the describing function it does at every larger size",
    codes.GREW: "pitch passed the bound of growth with an unstable outer branch",
    codes.DRIFTING: "still settling after {maxima:.0f} cycles: the height of a loop changes by "
    "{rate:.3g} % a hundred cycles",
    codes.NO_CYCLE: "neither at rest nor oscillating at tau = {time:g}",
    codes.OUT_OF_TIME: "not settled at tau = {time:g}",
    codes.NEUTRAL: "a cycle that neither attracts nor repels: a multiplier on the unit circle",
    codes.SWINGING: "an oscillation on this branch of the spring for good, which neither attracts "
    "nor repels: it is not damped, and does not grow",
    codes.FLUTTER: "outside the spring's nonlinearity an oscillation neither grows nor dies out, "
    "as at the flutter speed or where nothing is damped",
    codes.LOSSLESS: "nothing is damped: the motion neither settles nor grows",
    codes.OVERFLOWED: "the motion overflowed at tau = {time:g}",
    codes.CHATTERING: "switches without progress in time at tau = {time:g}",
    CONTRACTS: "it switches ever faster, and a bound on all its later swings shrinks to nothing",
}


@dataclass(frozen=True, kw_only=True)
class EndOptions:
    """When an end state is settled.

    Parameters
    ----------
    cycles
        A bounded motion that does not settle is judged after this many cycles, twice as many, four
        times as many, and so on.
    patience
        It is undecided after this many times as many, or twenty times as many again where it comes
        to a halt on a cycle, or changes so fast that this may end it.
    growth
        Where the outer branch is unstable, a motion diverges beyond this multiple of the larger
        of spring scale and initial pitch, if it is not proved to diverge before.
    duration
        Longest time, τ.

    Raises
    ------
    InputError
        Naming every option that is out of range.
    """

    cycles: int = 400
    patience: int = 50
    growth: float = 1e3
    duration: float = np.inf

    def __post_init__(self) -> None:
        problems = [
            f"{name}: {getattr(self, name)!r} is less than one; give a whole number above"
            for name in ("cycles", "patience")
            if self.cycles < 1 or self.patience < 1
            if getattr(self, name) < 1
        ]
        problems += [
            f"{name}: {getattr(self, name)!r} is not a positive number; give one above zero"
            for name in ("growth", "duration")
            if not getattr(self, name) > 0.0
        ]
        if problems:
            raise InputError(problems)


@dataclass(frozen=True, kw_only=True)
class EndState:
    """How one motion ends.

    Attributes
    ----------
    state, reason
        One of the six states, and what decided it.
    time
        When it was certain, τ.
    amplitude, bias
        Half peak-to-peak and midrange of y over the exact cycle, rad; 0 and the rest for a damped
        motion; over the last loops of one that does not settle.
    period, first_harmonic, loops, multiplier
        Of a limit cycle: T, amplitude of the fundamental of y, maxima a period, largest modulus
        of its Floquet multipliers.
    rest
        y at which a damped motion comes to rest, rad.
    final_state, final_memory
        Where the march stopped, (n,).
    cycle
        The attracting cycle, if one was found: one entry, ready to be known to other motions.
    lap
        That cycle once round: all coordinates, then all springs.
    """

    state: State
    reason: str
    time: float
    amplitude: float
    bias: float
    period: float
    first_harmonic: float
    loops: int
    multiplier: float
    rest: float
    final_state: Array = field(repr=False)
    final_memory: float = field(repr=False)
    cycle: Cycles | None = field(default=None, repr=False)
    lap: Lap | None = field(default=None, repr=False)


class EndStates(NamedTuple):
    """How m motions of one system end; see `EndState`.

    Attributes
    ----------
    state
        Places in `STATES`, (m,).
    reason
        Codes; `reason(...)` puts them into words, (m,).
    time, amplitude, bias, period, rest, multiplier
        (m,) each.
    loops, attractor
        Maxima a period, and place among `cycles` (-1 for none), (m,).
    final_states, final_memory
        (m, n) and (m,).
    cycles
        The known cycles and, if they were shared, those found.
    """

    state: NDArray[np.int64]
    reason: NDArray[np.int64]
    time: Array
    amplitude: Array
    bias: Array
    period: Array
    rest: Array
    multiplier: Array
    loops: NDArray[np.int64]
    attractor: NDArray[np.int64]
    final_states: Array
    final_memory: Array
    cycles: Cycles


def reason(code: int, numbers: Array) -> str:
    """A reason code with its numbers (`_kernel_ends.NUMBERS`,) in words."""
    return REASONS[code].format(
        time=numbers[kernel.TIME],
        maxima=numbers[kernel.MAXIMA],
        loops=numbers[kernel.LOOPS],
        radius=numbers[kernel.RADIUS],
        rate=100.0 * numbers[kernel.RATE],
        exponent=numbers[kernel.EXPONENT],
    )


def end_state(
    flow: Flow, state: ArrayLike, memory: ArrayLike, options: EndOptions | None = None
) -> EndState:
    """Decide how the motion from one initial state ends.

    Parameters
    ----------
    flow
        System and springs.
    state, memory
        Where the motion starts, (n,), and the memory of each spring there, (m,) or one for all.
    options
        When an end state is settled.

    Examples
    --------
    >>> from aeroflutter import Hysteresis, SectionFamily, TypicalSection
    >>> from aeroflutter.motion.flow import Flow
    >>> system = SectionFamily(TypicalSection(omega_bar=0.8)).at(3.9)
    >>> end = end_state(Flow(system, [Hysteresis(1.0, 0.2)]), [0, 6, 0, 0, 0, 0], 0.1)
    >>> end.state, round(end.amplitude, 6)
    ('lco', 1.283152)
    """
    settled = Settling(flow, np.array(state, dtype=float)[None], memory, options or EndOptions())
    settled.run()
    numbers, (code, why) = settled.numbers[0], settled.codes[0]
    held = settled.memories[0]
    found = settled.found if code == codes.LCO else None
    lap = None if found is None else Lap.of(flow, found.z[0], float(found.period[0]))
    return EndState(
        state=STATES[code],
        reason=reason(why, numbers),
        time=float(numbers[kernel.TIME]),
        amplitude=float(numbers[kernel.AMPLITUDE]),
        bias=float(numbers[kernel.BIAS]),
        period=float(numbers[kernel.PERIOD]),
        first_harmonic=np.nan if lap is None else lap.fundamental(-len(flow.springs)),
        loops=0 if np.isnan(numbers[kernel.LOOPS]) else int(numbers[kernel.LOOPS]),
        multiplier=float(numbers[kernel.RADIUS]),
        rest=float(numbers[kernel.REST]),
        final_state=settled.states[0],
        final_memory=float(held[0]) if held.size == 1 else held,
        cycle=found,
        lap=lap,
    )


def end_states(
    flow: Flow,
    states: ArrayLike,
    memory: ArrayLike,
    options: EndOptions | None = None,
    known: Cycles | None = None,
    share: bool = False,
) -> EndStates:
    """Decide how many motions of one system end.

    Parameters
    ----------
    flow
        System and springs.
    states, memory
        Where the motions start, (c, n), and the memories there, (c, m), (c,) or one for all.
    options
        When an end state is settled.
    known
        Attracting cycles; nearness to one of them ends a motion without a search of its own.
    share
        Whether a cycle found by one motion is known to those after it: faster, and cells of
        one attractor share a label, but the last digits then depend on the order.
    """
    x = np.array(states, dtype=float, order="C", ndmin=2)
    settled = Settling(flow, x, memory, options or EndOptions(), known, share)
    settled.run()
    numbers = settled.numbers
    whole = np.nan_to_num(numbers[:, [kernel.LOOPS, kernel.ATTRACTOR]], nan=-1.0).astype(np.int64)
    held = settled.memories
    return EndStates(
        state=settled.codes[:, 0],
        reason=settled.codes[:, 1],
        time=numbers[:, kernel.TIME],
        amplitude=numbers[:, kernel.AMPLITUDE],
        bias=numbers[:, kernel.BIAS],
        period=numbers[:, kernel.PERIOD],
        rest=numbers[:, kernel.REST],
        multiplier=numbers[:, kernel.RADIUS],
        loops=np.maximum(whole[:, 0], 0),
        attractor=whole[:, 1],
        final_states=x,
        final_memory=held[:, 0] if held.shape[1] == 1 else held,
        cycles=settled.shared,
    )
