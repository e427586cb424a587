"""Motions on their way to their end states: the kernel, and what it leaves to its caller."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from aeroflutter.motion import _kernel_ends as kernel
from aeroflutter.motion import _kernel_proofs as codes
from aeroflutter.motion._kernel_attracted import closes_in
from aeroflutter.motion._kernel_cycle import ATTRACTS, INDIFFERENT
from aeroflutter.motion._kernel_ends import MOST_LOOPS, RING, Cycles
from aeroflutter.motion._kernel_flow import NOW, PLACE, TABLE, Motion
from aeroflutter.motion.basins import Loop
from aeroflutter.motion.closing import Closing, norm
from aeroflutter.motion.evidence import LONGEST, PATIENT, Envelope, growth_at, larger, lossless
from aeroflutter.motion.exponents import Exponents
from aeroflutter.motion.march import workspace
from aeroflutter.motion.reach import reach_of
from aeroflutter.motion.tangents import SIZING, growth, returns
from aeroflutter.springs._kernel_columns import CEILING, FLOOR, HIGH, LOW

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from aeroflutter.motion.endstates import EndOptions
    from aeroflutter.motion.flow import Flow
    from aeroflutter.springs import PieceTable

    Array = NDArray[np.float64]

__all__ = ["CONTRACTS", "Settling", "no_cycles"]

CONTRACTS = 100  # a reason that only the caller of the kernel finds
EXACT = 1e-9  # relative distance of two returns of a motion that is a cycle
NOTHING = 1e-9  # height of a loop that is nothing to the spring, over the least distance of edges
LEAST = 1e-12  # the same over the size of the law, for round-off
BESIDE = 0.3  # relative distance from a known cycle at which a motion is expected to go to it
CLEAR = 1e-3  # relative distance of two returns at which another cycle may be just beside it
MOST = 4000  # maxima over which an exponent is measured
SLOW = 100_000  # the same of a motion that dies down: how slowly, nothing bounds
LAST = 400  # the same of a motion that has faded: it is over soon
PERSISTENT = 20  # times as patient while it settles at a rate that is quick enough to end by then
ENDURING = 10_000  # loops from which the rate at which it settles is believed
ENOUGH = 0.2  # change of the height until then that may end it


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
        self.closing: Closing | None = None
        self.past = _history(flow, int(options.cycles))
        self.envelope, self._corner = Envelope(), np.nan
        self.past.memo[kernel.COUNT] = before

    def take(self, states: Array, memory: ArrayLike) -> None:
        """Take up other motions."""
        count = states.shape[0]
        given = np.asarray(memory, dtype=float)
        if given.ndim == 1 and given.size == count and count != len(self.flow.springs):
            given = given[:, None]
        held = self.flow.memories(given)
        self.states = states
        self.memories = np.array(np.broadcast_to(held, (count, self.flow.m)), order="C")
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
                min(_nothing(piece) for piece in self.flow.pieces),
            ],
            dtype=float,
        )
        answers = {
            kernel.CLOSING: self._close,
            kernel.BESIDE: self._beside,
            kernel.COUNTED: self._count,
            kernel.FOUND: self._keep,
            kernel.UNPREPARED: self._prepare,
            kernel.CREEPING: self._creep,
            kernel.FADING: self._fade,
            kernel.STALLED: self._stall,
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
        self.closing = self.closing or Closing(self.flow)
        return self.closing.find(
            past.points[k % RING], period, lag, past.size, float(past.clock[kernel.SPAN]),
            self.cycles, place,
        )  # fmt: skip

    def _close(self) -> None:
        """A motion has nearly closed."""
        memo, times = self.past.memo, self.past.times
        k, lag = int(memo[kernel.MAXIMUM]), int(memo[kernel.BEHIND])
        miss = 4.0 * self.past.clock[kernel.TRIES]
        if miss > CLEAR and self._beside_known(k):
            memo[kernel.PHASE] = kernel.COUNTING
            return
        found = self._find(lag, float(times[k % RING] - times[(k - lag) % RING]))
        if found == ATTRACTS:
            place = int(memo[kernel.COUNT])
            norm(self.cycles, place)
            self.cycles.reach[place] = reach_of(self.flow, self.cycles, place)
            memo[kernel.OWN], memo[kernel.PHASE] = 1, kernel.COUNTING
        elif found == INDIFFERENT and miss < EXACT:
            self._measure()
            self._end(codes.NEITHER, codes.NEUTRAL)

    def _beside_known(self, k: int) -> bool:
        """Whether the last returns pass by a shared cycle, or the motion's own: going on is cheaper

        than Newton's method.
        """
        cycles, points, count = self.cycles, self.past.points, int(self.past.memo[kernel.COUNT])
        first = 0 if self.share else count
        for j in range(first, count + int(self.past.memo[kernel.OWN])):
            loops = int(cycles.loops[j])
            rows = np.arange(max(k - loops + 1, 0), k + 1) % RING
            apart = np.max(np.abs(points[rows] - cycles.z[j]) / cycles.size[j], axis=1)
            if not cycles.free[j] and np.min(apart) < BESIDE:
                return True
        return False

    def _beside(self) -> None:
        """A motion goes to a member of a continuum of cycles: take the one at hand."""
        place = int(self.past.memo[kernel.COUNT])
        self._find(int(self.cycles.loops[place]), float(self.cycles.period[place]))
        self._measure()
        self._end(codes.LCO, codes.CONVERGED)

    def _measure(self) -> None:
        """Enter what there is to say of the cycle that was found last."""
        place, cycles = int(self.past.memo[kernel.COUNT]), self.cycles
        row = self.numbers[self.past.memo[kernel.CELL]]
        row[kernel.AMPLITUDE], row[kernel.BIAS] = cycles.amplitude[place], cycles.bias[place]
        row[kernel.PERIOD], row[kernel.RADIUS] = cycles.period[place], cycles.radius[place]
        row[kernel.LOOPS], row[kernel.ATTRACTOR] = cycles.loops[place], -1

    def _count(self) -> None:
        """A motion has made as many maxima as are judged together."""
        past, cycles = self.past, int(self.options.cycles)
        if self._quickens():
            self._end(codes.DAMPED, CONTRACTS, 0.0)
            return
        count = int(past.memo[kernel.MAXIMUM]) + 1
        if count == cycles:
            self.envelope = Envelope()
        self.envelope.add(past.peaks, past.troughs, past.misses)
        due = count // cycles
        look = due % PATIENT == 0
        patient = due < self.options.patience or not look or self._patient(due)
        if due & (due - 1) == 0 or not patient:  # one, two, four, eight, … times as many
            self._judge(count)
        elif look and self._outgrows():
            self._end(codes.DIVERGENT, codes.OUTGROWN)
        if past.memo[kernel.PHASE] != kernel.ENDING and not patient:
            self._end(codes.UNDECIDED, codes.DRIFTING)

    def _patient(self, due: int) -> bool:
        """Whether a motion may settle yet, after so many times the number of cycles.

        It may where it comes to a halt on a cycle, or changes so fast that it may be over in time.
        """
        change, past = self.envelope.change(), self.past
        left = (PERSISTENT * self.options.patience - due) * int(self.options.cycles)
        quick = (abs(change.total) + change.error) * left > ENOUGH * change.loops
        halts = past.memo[kernel.OWN] == 1 or self.envelope.halts()
        return self.envelope.loops >= ENDURING and left > 0 and bool(quick or halts)

    def _stall(self) -> None:
        """A motion switches without progress in time."""
        if self._quickens():
            self._end(codes.DAMPED, CONTRACTS, 0.0)
        else:
            self._end(codes.UNDECIDED, codes.CHATTERING)

    def _quickens(self) -> bool:
        """Whether the motion switches ever faster, and goes to y = 0 for certain."""
        if self.flow.contraction is None:
            return False
        now = self.motion.memo[NOW]
        return self.flow.contraction.holds(self.motion.xs[now, : self.flow.n])

    def _judge(self, count: int) -> None:
        """What the envelope so far is evidence of."""
        envelope, row = self.envelope, self.numbers[self.past.memo[kernel.CELL]]
        change, long = envelope.change(), count >= PATIENT * self.options.cycles
        row[kernel.RATE] = change.rate
        if envelope.retreats() and self._homogeneous() and self._meets(min(count, SLOW)):
            self._end(codes.DAMPED, codes.RETREATS, self._corner)
        elif long and self._outgrows():
            self._end(codes.DIVERGENT, codes.OUTGROWN)
        elif self.flow.proofs.idle and not self._lossless:  # nothing is an attractor
            if change.total > -change.error:
                self._end(codes.NEITHER, codes.FLUTTER)
        elif not change.moving or envelope.flat:
            self._bounded(count, long)

    def _bounded(self, count: int, long: bool) -> None:
        """What a motion is whose height may have settled."""
        found = self._exponents(min(count, MOST))
        if found is None:
            return
        self.numbers[self.past.memo[kernel.CELL], kernel.EXPONENT] = found.values[0]
        if self.envelope.chaotic(found):
            if self._remains():
                self._end(codes.APERIODIC, codes.UNSETTLED)
        elif self._long_cycle():
            self._measure()
            self._end(codes.LCO, codes.CONVERGED)
        elif self.flow.proofs.idle:
            self._end(codes.NEITHER, codes.FLUTTER)
        elif long:
            self._last_of_all()

    def _remains(self) -> bool:
        """Whether neighbours still part when the motion has gone on for long: transients end."""
        found = self._exponents(LAST, MOST)
        return found is not None and bool(found.values[0] > found.error[0])

    def _long_cycle(self) -> bool:
        """Whether the motion goes to an attracting cycle of more loops than the kernel looks back.

        By the kernel's own rule, once Newton's method has closed its nearest return.
        """
        n, past, cycles = self.flow.n, self.past, self.cycles
        if past.memo[kernel.OWN]:  # it closes in on a cycle of fewer
            return False
        start, place = past.points[past.memo[kernel.MAXIMUM] % RING], int(past.memo[kernel.COUNT])
        points, times = returns(self.flow, start[:n], start[n:], 2 * LONGEST + 1)
        if len(points) <= 2 * LONGEST:
            return False
        unit = np.maximum(past.size, 1e-14 * np.max(past.size))
        apart = np.max(np.abs(points[1 : LONGEST + 1] - points[0]) / unit, axis=1)
        lag = 1 + int(np.argmin(apart))
        if not apart[lag - 1] < CLEAR:
            return False
        self.closing = self.closing or Closing(self.flow)
        span = float(past.clock[kernel.SPAN])
        found = self.closing.find(
            points[0], float(times[lag] - times[0]), lag, past.size, span, cycles, place, LONGEST
        )
        if found != ATTRACTS or cycles.free[place] or lag % int(cycles.loops[place]):
            return False
        norm(cycles, place)
        d = np.zeros((4, n + self.flow.m))  # the last return first
        back = points[:: int(cycles.loops[place])][2::-1]
        d[:3] = (back - cycles.z[place]) / cycles.size[place]
        reach = reach_of(self.flow, cycles, place)
        return bool(
            closes_in(
                cycles.Q[place], cycles.P[place], cycles.slow[place], float(cycles.rho[place]),
                reach, d,
            )
        )  # fmt: skip

    @property
    def _lossless(self) -> bool:
        """Whether nothing is damped on any piece."""
        return lossless(self.flow.arrays.generator[:, :, : self.flow.n])

    def _last_of_all(self) -> None:
        """What a bounded motion that neither settles nor parts from its neighbours is."""
        if self._lossless:
            if self.envelope.flat:
                self._end(codes.NEITHER, codes.LOSSLESS)
        elif self.envelope.stationary():
            self._end(codes.APERIODIC, codes.TORUS)

    def _meets(self, count: int) -> bool:
        """Whether neighbours come nearer to each other: a mode that is small as yet may grow."""
        found = self._exponents(count)
        if found is None:
            return True
        error = max(float(found.statistical[0]), abs(float(found.drift[0])))
        return bool(found.values[0] < -error)

    def _fade(self) -> None:
        """A motion has been nothing to the spring for some loops."""
        if self.flow.sliders.size or self._meets(LAST):
            self._end(codes.DAMPED, codes.FADED, float(self.past.clock[kernel.GIVEN]))
        else:
            self.past.clock[kernel.QUIET] = -LAST

    def _exponents(self, count: int, after: int = SIZING) -> Exponents | None:
        """The largest exponent over so many maxima; None if the motion ends before."""
        n, past = self.flow.n, self.past
        point = past.points[past.memo[kernel.MAXIMUM] % RING]
        return growth(self.flow, point[:n], point[n:], count, after)

    def _outgrows(self) -> bool:
        """Whether the motion has outgrown the law, and grows at every larger size."""
        proofs, row = self.flow.proofs, self.numbers[self.past.memo[kernel.CELL]]
        row[kernel.RATE] = self.envelope.change().rate
        loose = proofs.unstable or (proofs.idle and self._lossless)
        if self.flow.m > 1 or not loose or self.envelope.goes_on() <= 0:
            return False
        flow, spring, (low, high) = self.flow, self.flow.springs[0], self.envelope.last()
        first, last = spring.span()
        if not low < first <= last < high:
            return False
        loop = Loop(flow.A, flow.B[:, 0], flow.C[0], flow.d)
        rates = growth_at(loop, spring, larger(0.5 * (high - low)), 0.5 * (high + low))
        return bool(np.all(rates > 0.0))

    def _homogeneous(self) -> bool:
        """Whether the motion is about a rest at a corner of the law, and reaches no other."""
        low, high = self.envelope.last()
        piece = self.flow.pieces[0]
        inside = [float(y) for y in piece.rows[:-1, HIGH] if low <= y <= high]
        if self.flow.m > 1 or piece.memory or piece.jumps or len(inside) != 1:
            return False
        self._corner = inside[0]
        slope, offset, *_ = piece.branch(self._corner)
        A, b, c = self.flow.A, self.flow.B[:, 0], self.flow.C[0]
        load = np.append(b * (slope * self._corner + offset) - self.flow.d, self._corner)
        rows = np.vstack((A, c))
        x = np.linalg.lstsq(rows, load, rcond=None)[0]
        terms = np.abs(rows) @ np.abs(x) + np.abs(load)
        return bool(np.all(np.abs(rows @ x - load) <= 1e-9 * terms + 1e-14 * piece.size))

    def _creep(self) -> None:
        """A motion has long had no extremum: it may creep up to a rest at the edge of its mode."""
        rest = one_sided(self.flow, self.motion)
        if not np.isnan(rest):
            self._end(codes.DAMPED, codes.TRAPPED, rest)
            return
        y = float(self.flow.C[0] @ self.motion.xs[self.motion.memo[NOW], : self.flow.n])
        floor, clock = _nothing(self.flow.pieces[0]), self.past.clock
        beside = np.abs(self.flow.pieces[0].rows[:, HIGH] - y).min() <= floor
        if beside and clock[kernel.SPAN] <= floor < clock[kernel.LARGEST]:
            self._end(codes.DAMPED, codes.FADED, y)
        else:
            self._end(codes.UNDECIDED, codes.NO_CYCLE)

    def _keep(self) -> None:
        """A motion has gone to a cycle that it found itself: let those after it know."""
        memo, place = self.past.memo, int(self.past.memo[kernel.COUNT])
        if self.share and not self.cycles.free[place] and place < self.cycles.loops.size - 1:
            self.numbers[memo[kernel.CELL] - 1, kernel.ATTRACTOR] = place
            memo[kernel.COUNT] += 1

    def _prepare(self) -> None:
        """A mode has no table."""
        self.flow.prepare(np.array([self.motion.memo[PLACE]]))

    def _end(self, state: int, why: int, rest: float = np.nan) -> None:
        memo = self.past.memo
        self.past.clock[kernel.GIVEN] = rest
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
        tops=np.zeros(RING),
        peaks=np.zeros(cycles),
        troughs=np.zeros(cycles),
        misses=np.zeros(cycles),
        size=np.zeros(k),
        widths=np.where(np.isfinite(widths), widths, 0.0),
        clock=np.zeros(kernel.CLOCKS),
        memo=np.zeros(kernel.MEMOS, dtype=np.int64),
        scratch=np.zeros((4, k)),
    )


def no_cycles(count: int, size: int) -> Cycles:
    """Room for so many cycles whose points have so many entries."""
    numbers = (np.zeros(count) for _ in range(4))
    return Cycles(
        np.zeros((count, size)), np.ones((count, size)), np.zeros((count, size, size)),
        np.zeros((count, size, size)), np.zeros(count), np.zeros((count, 2, size)),
        np.full(count, np.inf),
        np.zeros(count, dtype=np.int64), np.zeros(count, dtype=np.int64), *numbers,
    )  # fmt: skip


@lru_cache(maxsize=64)
def _nothing(piece: PieceTable) -> float:
    """Height of a loop that is nothing to a spring."""
    edges = np.unique(piece.rows[:, [LOW, HIGH]])
    gaps = np.diff(edges[np.isfinite(edges)])
    gaps = gaps[gaps > 1e-9 * piece.size]
    return float(max(NOTHING * np.min(gaps, initial=piece.size), LEAST * piece.size))


def one_sided(flow: Flow, motion: Motion) -> float:
    """The y of rest of a motion that creeps up to it from one side for good, else NaN.

    The slowest coordinate is real and outweighs all the others together, now and, since they decay
    faster, for ever: y - y_e keeps its sign, and the edge beyond y_e is never reached.
    """
    n, now, m = flow.n, motion.memo[NOW], flow.m
    p = motion.memo[TABLE]
    if p < 0 or m > 1 or motion.window[0, 2] != 0.0 or flow.pieces[0].jumps:
        return np.nan
    generator = flow.arrays.generator[p]
    values, vectors = np.linalg.eig(generator[:, :n])
    slowest = int(np.argmax(values.real))
    if not values[slowest].real < 0.0 or values[slowest].imag != 0.0:
        return np.nan
    centre = -np.linalg.solve(generator[:, :n], generator[:, n:] @ motion.inputs)
    rest, away = float(flow.C[0] @ centre), motion.xs[now, :n] - centre
    parts = (flow.C[0] @ vectors) * np.linalg.solve(vectors, away)
    lead = float(parts[slowest].real)
    others = float(np.sum(np.abs(np.delete(parts, slowest))))
    low, high = motion.window[0, 0], motion.window[0, 1]
    room, edge = (high - rest, rest - low) if lead > 0.0 else (rest - low, high - rest)
    size = max((abs(v) for v in (low, high) if np.isfinite(v)), default=0.0)  # an edge may be far
    stays = abs(lead) + others < room and abs(lead) > others and edge >= -1e-9 * size
    return rest if stays else np.nan
