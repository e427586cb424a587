"""End states of the exact engine: damped, limit cycle, aperiodic, divergent, or why undecided."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from aeroflutter.errors import InputError
from aeroflutter.motion import _kernel_cycle as closing
from aeroflutter.motion import _kernel_ends as kernel
from aeroflutter.motion import _kernel_proofs as codes
from aeroflutter.motion._kernel_ends import MOST_LOOPS, RING, Cycles
from aeroflutter.motion._kernel_flow import PLACE, Motion
from aeroflutter.motion.march import fundamental, workspace
from aeroflutter.motion.response import STATES
from aeroflutter.springs._kernel_columns import CEILING, FLOOR

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from aeroflutter.motion.flow import Flow
    from aeroflutter.motion.response import State

    Array = NDArray[np.float64]

__all__ = [
    "EndOptions",
    "EndState",
    "EndStates",
    "Settling",
    "end_state",
    "end_states",
    "reason",
]

EXACT = 1e-9  # relative distance of two returns of a motion that is a cycle

REASONS = {
    codes.TRAPPED: "a bound of all further motion on this branch of the spring stays within it",
    codes.AT_REST: "the section has come to rest",
    codes.CONVERGED: "the motion closes in on an attracting cycle of {loops:.0f} loop(s), largest "
    "multiplier {radius:.6g}",
    codes.KNOWN: "the motion closes in on a known attracting cycle of {loops:.0f} loop(s), "
    "largest multiplier {radius:.6g}",
    codes.UNSETTLED: "bounded and not settling over {maxima:.0f} cycles",
    codes.ESCAPED: "an unstable mode has outgrown all that the spring can oppose",
    codes.GREW: "pitch passed the bound of growth with an unstable outer branch",
    codes.DRIFTING: "still settling after {maxima:.0f} cycles",
    codes.NO_CYCLE: "neither at rest nor oscillating at tau = {time:g}",
    codes.OUT_OF_TIME: "not settled at tau = {time:g}",
    codes.NEUTRAL: "a cycle that neither attracts nor repels: a multiplier on the unit circle",
    codes.OVERFLOWED: "the motion overflowed at tau = {time:g}",
    codes.CHATTERING: "switches without progress in time at tau = {time:g}",
}


@dataclass(frozen=True, kw_only=True)
class EndOptions:
    """When an end state is settled.

    Parameters
    ----------
    cycles
        A bounded motion that does not settle over this many cycles is aperiodic.
    patience
        A motion that is still settling may take this many times as many.
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
        One of the five states, and what decided it.
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
    return EndState(
        state=STATES[code],
        reason=reason(why, numbers),
        time=float(numbers[kernel.TIME]),
        amplitude=float(numbers[kernel.AMPLITUDE]),
        bias=float(numbers[kernel.BIAS]),
        period=float(numbers[kernel.PERIOD]),
        first_harmonic=(
            np.nan if found is None else fundamental(flow, found.z[0], float(found.period[0]))
        ),
        loops=0 if np.isnan(numbers[kernel.LOOPS]) else int(numbers[kernel.LOOPS]),
        multiplier=float(numbers[kernel.RADIUS]),
        rest=float(numbers[kernel.REST]),
        final_state=settled.states[0],
        final_memory=float(held[0]) if held.size == 1 else held,
        cycle=found,
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


class Settling:
    """Motions on their way to their end states: the kernel, and what it leaves to its caller.

    Parameters
    ----------
    flow, options
        As for `end_states`.
    states, memory
        Where the motions start, (c, n), and the memories there, (c, m), (c,) or one for all.
    known, share
        As for `end_states`.

    Attributes
    ----------
    states, memories, codes, numbers
        See `_kernel_ends.settle`.
    cycles
        The known ones, and room for those found.
    """

    def __init__(
        self,
        flow: Flow,
        states: Array,
        memory: ArrayLike,
        options: EndOptions,
        known: Cycles | None = None,
        share: bool = False,
    ) -> None:
        m = flow.m
        self.flow, self.options, self.share = flow, options, share
        self.take(states, memory)
        before = 0 if known is None else int(known.loops.size)
        self.cycles = no_cycles(before + (MOST_LOOPS if share else 0) + 1, flow.n + m)
        if known is not None:
            for part, source in zip(self.cycles, known, strict=True):
                part[:before] = source
        self.motion = workspace(flow, reaches=True)
        self.probe: tuple[Motion, Motion] | None = None
        self.past = _history(flow, int(options.cycles))
        self.past.memo[kernel.COUNT] = before

    def take(self, states: Array, memory: ArrayLike) -> None:
        """Take up other motions."""
        count = states.shape[0]
        given = np.asarray(memory, dtype=float)
        if given.ndim == 1 and given.size == count and count != self.flow.m:
            given = given[:, None]
        self.states, self.memories = states, np.array(np.broadcast_to(given, (count, self.flow.m)))
        self.codes = np.empty((count, 2), dtype=np.int64)
        self.numbers = np.empty((count, kernel.NUMBERS))

    @property
    def shared(self) -> Cycles:
        """The known cycles."""
        return Cycles._make(part[: self.past.memo[kernel.COUNT]] for part in self.cycles)

    @property
    def found(self) -> Cycles:
        """The cycle that the last motion found."""
        place = int(self.past.memo[kernel.COUNT])
        return Cycles._make(part[place : place + 1].copy() for part in self.cycles)

    def run(self) -> None:
        """Settle all of them."""
        self.past.memo[[kernel.CELL, kernel.PHASE]] = 0
        limits = np.array(
            [
                self.options.duration,
                self.options.growth,
                self.flow.springs[0].scale,
                self.options.cycles,
            ],
            dtype=float,
        )
        answers = {
            kernel.CLOSING: self._close,
            kernel.BESIDE: self._beside,
            kernel.COUNTED: self._count,
            kernel.FOUND: self._keep,
            kernel.UNPREPARED: self._prepare,
        }
        while True:
            why = kernel.settle(
                self.flow.arrays, self.motion, self.flow.proofs, self.cycles, self.past, limits,
                self.states, self.memories, self.codes, self.numbers,
            )  # fmt: skip
            if why == kernel.OVER:
                return
            answers[why]()

    def _find(self, lag: int, period: float) -> int:
        """Newton's method from the last return; the cycle goes behind the known ones."""
        past = self.past
        place, k = int(past.memo[kernel.COUNT]), int(past.memo[kernel.MAXIMUM])
        if self.probe is None:
            m = past.size.size
            self.probe = workspace(self.flow, np.zeros((m, m))), workspace(self.flow, reaches=True)
        while True:
            found = closing.find_cycle(
                self.flow.arrays, *self.probe, past.points[k % RING], period, lag, past.size,
                float(past.clock[kernel.SPAN]), self.cycles, place,
            )  # fmt: skip
            if found != closing.UNPREPARED:
                return int(found)
            self.flow.prepare(np.array([self.probe[0].memo[PLACE]]))

    def _close(self) -> None:
        """A motion has nearly closed."""
        memo, times = self.past.memo, self.past.times
        k, lag = int(memo[kernel.MAXIMUM]), int(memo[kernel.BEHIND])
        found = self._find(lag, float(times[k % RING] - times[(k - lag) % RING]))
        miss = 4.0 * self.past.clock[kernel.TRIES]
        if found == closing.ATTRACTS:
            memo[kernel.OWN], memo[kernel.PHASE] = 1, kernel.COUNTING
        elif found == closing.INDIFFERENT and miss < EXACT:
            self._end(codes.UNDECIDED, codes.NEUTRAL)

    def _beside(self) -> None:
        """A motion goes to a member of a continuum of cycles: take the one at hand."""
        place = int(self.past.memo[kernel.COUNT])
        cycles = self.cycles
        self._find(int(cycles.loops[place]), float(cycles.period[place]))
        row = self.numbers[self.past.memo[kernel.CELL]]
        row[kernel.AMPLITUDE], row[kernel.BIAS] = cycles.amplitude[place], cycles.bias[place]
        row[kernel.PERIOD], row[kernel.RADIUS] = cycles.period[place], cycles.radius[place]
        row[kernel.LOOPS], row[kernel.ATTRACTOR] = cycles.loops[place], -1
        self._end(codes.LCO, codes.CONVERGED)

    def _count(self) -> None:
        """A motion has made as many maxima as are judged together."""
        past, options = self.past, self.options
        if not settling(past.peaks, past.misses):
            self._end(codes.APERIODIC, codes.UNSETTLED)
        elif past.memo[kernel.MAXIMUM] + 1 >= options.cycles * options.patience:
            self._end(codes.UNDECIDED, codes.DRIFTING)

    def _keep(self) -> None:
        """A motion has gone to a cycle that it found itself: let those after it know."""
        memo, place = self.past.memo, int(self.past.memo[kernel.COUNT])
        if self.share and not self.cycles.free[place] and place < self.cycles.loops.size - 1:
            self.numbers[memo[kernel.CELL] - 1, kernel.ATTRACTOR] = place
            memo[kernel.COUNT] += 1

    def _prepare(self) -> None:
        """A mode has no table."""
        self.flow.prepare(np.array([self.motion.memo[PLACE]]))

    def _end(self, state: int, why: int) -> None:
        memo = self.past.memo
        memo[kernel.STATE], memo[kernel.REASON], memo[kernel.PHASE] = state, why, kernel.ENDING


def _history(flow: Flow, cycles: int) -> kernel.History:
    """Room for the history of one motion after another."""
    k = flow.n + flow.m
    widths = [
        piece.rows[0, CEILING] - piece.rows[0, FLOOR] if piece.memory else 0.0
        for piece in flow.pieces
    ]
    return kernel.History(
        points=np.zeros((RING, k)),
        times=np.zeros(RING),
        peaks=np.zeros(cycles),
        troughs=np.zeros(cycles),
        misses=np.zeros(cycles),
        size=np.zeros(k),
        widths=np.array(widths),
        clock=np.zeros(kernel.CLOCKS),
        memo=np.zeros(kernel.MEMOS, dtype=np.int64),
        scratch=np.zeros((4, k)),
    )


def no_cycles(count: int, size: int) -> Cycles:
    """Room for so many cycles whose points have so many entries."""
    numbers = (np.zeros(count) for _ in range(4))
    return Cycles(
        np.zeros((count, size)), np.ones((count, size)), np.zeros((count, size, size)),
        np.zeros((count, size, size)), np.zeros(count), np.zeros(count, dtype=np.int64),
        np.zeros(count, dtype=np.int64), *numbers,
    )  # fmt: skip


def settling(peaks: Array, misses: Array) -> bool:
    """Whether a motion of these maxima is still on its way somewhere.

    Parameters
    ----------
    peaks
        Maxima of y, oldest first, (k,).
    misses
        Relative distance of each to the nearest of the `MOST_LOOPS` before it, (k,).

    Returns
    -------
    bool
        True if the misses of the last quarter are under half those of the first, or if the
        peaks of the last quarter creep one way at some fixed lag.
    """
    quarter = peaks.size // 4
    if quarter == 0:
        return False
    last = peaks.size - quarter
    if np.max(misses[last:]) < 0.5 * np.max(misses[:quarter]):
        return True
    for lag in range(1, min(MOST_LOOPS, quarter) + 1):
        steps = peaks[last:] - peaks[last - lag : -lag]
        if np.all(steps <= 0.0) or np.all(steps >= 0.0):
            return True
    return False
