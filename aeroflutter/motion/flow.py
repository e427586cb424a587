"""The exact flow of a linear system closed by springs of straight pieces.

`Flow` is what every exact analysis stands on: it starts a motion, advances it to the next event,
carries its Jacobian across, and samples it. A mode is one piece a spring; its table is made when
a motion first enters it, and kept.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import cached_property
from itertools import groupby, islice
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeroflutter.errors import ConvergenceError, InputError
from aeroflutter.motion import _kernel_flow as kernel
from aeroflutter.motion._kernel_flow import enter
from aeroflutter.motion._kernel_jump import before
from aeroflutter.motion._kernel_proofs import DAMPED, Proofs, resting
from aeroflutter.motion.contraction import Contraction, contraction_of
from aeroflutter.motion.discontinuous import channels_of, holding, modes_of
from aeroflutter.motion.laws import assembled, laws_of, pieces_of
from aeroflutter.motion.march import March
from aeroflutter.motion.matrices import Matrices, closed, matrices_of
from aeroflutter.motion.proofs import proofs_of, proofs_of_many
from aeroflutter.motion.step_tables import StepTables, build
from aeroflutter.springs._kernel_columns import (
    CEILING,
    FLOOR,
    HELD,
    OFFSET,
    PIECE,
    SLIDES,
)

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from aeroflutter.springs import Spring
    from aeroflutter.springs.piece_table import PieceTable

__all__ = ["Flow", "Matrices", "Passage", "Point", "Trace", "pieces_of"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

EVENTS = 400  # switches that a passage may have of springs with few corners
LOOPS = 8  # over all corners, up and down, that it may have of those with many
AT_ONCE = 16  # modes whose tables are made at once
BESIDE = 8  # modes made together where there are more: motions go on to the next slope
TOGETHER = 8  # flows whose tables are made at once: their work space stays in the cache


class Point(NamedTuple):
    """Where a motion stands.

    Attributes
    ----------
    time
        Since the start.
    x, memory
        State, (n,), and memory of each spring, (m,); zero for those without one.
    modes
        Mode of each spring, see `PieceTable`, (m,).
    event
        Place of the spring and kind of the switch that led here; None at the start.
    """

    time: float
    x: Array
    memory: Array
    modes: Index
    event: tuple[int, int] | None = None


class Passage(NamedTuple):
    """A stretch of motion with its linearisation; z = (x, memory of each spring that has one).

    Attributes
    ----------
    end
        Final z, (k,).
    jacobian
        d end / d (start, parameter), (k, k+1); the last column is zero without a parameter.
    rate
        z' at the end, (k,).
    switches
        What happened on the way: (kind, mode after it) of every switch, behind the spring's place
        where there are several.
    """

    end: Array
    jacobian: Array
    rate: Array
    switches: tuple[tuple[int, ...], ...]


class Trace(NamedTuple):
    """A stretch of motion with uniform samples.

    Attributes
    ----------
    end
        Final z, (k,).
    states, memory
        Samples at i·duration/k, (k, n), and of the first spring's memory, (k,).
    memories, moments
        Samples of the memory and of the moment of every spring, (k, m).
    turns
        Extrema of the first output: time, y, +1 at a maximum and -1 at a minimum, (j, 3).
    events
        Switches: time, kind, mode after it, y, F, spring, (i, 6).
    """

    end: Array
    states: Array
    memory: Array
    turns: Array
    events: Array
    memories: Array
    moments: Array


def most_switches(tables: Iterable[PieceTable]) -> int:
    """Switches that a passage of springs with these pieces may have."""
    return max(EVENTS, 2 * LOOPS * sum(table.modes for table in tables))


class Flow:
    """The piecewise flow of a system and its springs.

    Parameters
    ----------
    system
        x' = A x - B F(C x) + d, with A (n, n), B (n, m), C (m, n), d (n,); or A, b, c.
    springs
        One a column of B, each of straight pieces; a loop without height or width is taken as the
        freeplay or linear spring that it is. What friction adds to its spring is a law of its
        rate, and follows the springs as one more; see `discontinuous`.
    step_cap
        Longest internal step.
    derivative
        dA (n, n) and dB (n, m) with respect to a parameter, whose effect on the motion is then the
        last column of a passage's Jacobian.
    tables
        Makes the tables of all modes from their generators and the derivatives of those, instead of
        `step_tables.build`; asked where there are few modes and no law slides.

    Raises
    ------
    InputError
        If a spring is not made of straight pieces, their number is not that of the outputs, the
        step cap is not positive, or a law that jumps has no certain motion.

    Examples
    --------
    >>> from aeroflutter import Hysteresis, SectionFamily, TypicalSection
    >>> system = SectionFamily(TypicalSection(omega_bar=0.8)).at(3.9)
    >>> flow = Flow(system, [Hysteresis(1.0, 0.2)])
    >>> point = flow.advance(flow.start([0, 6, 0, 0, 0, 0]))
    >>> round(point.time, 4), point.event
    (6.6596, (0, 1))
    """

    def __init__(
        self,
        system: Any,
        springs: Sequence[Spring],
        step_cap: float | None = None,
        derivative: tuple[Array, Array] | None = None,
        tables: Callable[[Array, Array], StepTables] | None = None,
    ) -> None:
        self._blank(system, springs, step_cap, derivative)
        places = np.arange(self.arrays.lookup.size)
        if tables is None or self.sliders.size or places.size > AT_ONCE:
            _fill([self])
        else:
            generators, changes = self.generators(places)
            self._take(places, tables(generators, changes))

    @classmethod
    def bare(
        cls, system: Any, springs: Sequence[Spring], derivative: tuple[Array, Array] | None = None
    ) -> Flow:
        """One whose modes have no tables yet."""
        flow = cls.__new__(cls)
        flow._blank(system, springs, None, derivative)
        return flow

    @classmethod
    def many(
        cls, systems: Sequence[Any], springs: Sequence[Spring], step_cap: float | None = None
    ) -> list[Flow]:
        """Flows of systems with the same outputs and the same springs, made ready together.

        Parameters
        ----------
        systems, springs, step_cap
            As for one.
        """
        flows = [cls.__new__(cls) for _ in systems]
        for flow, system in zip(flows, systems, strict=True):
            flow._blank(system, springs, step_cap)
        _fill(flows)
        alike = not any(flow.sliders.size for flow in flows)
        if alike and len({flow.arrays.generator.shape for flow in flows}) == 1:
            for flow, proofs in zip(flows, proofs_of_many(flows), strict=True):
                flow._proofs = proofs
        return flows

    # --- tables

    def _blank(
        self,
        system: Any,
        springs: Sequence[Spring],
        step_cap: float | None,
        derivative: tuple[Array, Array] | None = None,
    ) -> None:
        """Take up all that is given, before any mode has its table."""
        if step_cap is not None and not step_cap > 0.0:
            raise InputError(f"step_cap: {step_cap!r} is not a positive number")
        laws = laws_of(tuple(springs))
        self.system, self._cap = system, np.inf if step_cap is None else float(step_cap)
        self.A, self.B, self.C, self.d = matrices_of(system)
        given, wanted = len(laws.pieces), self.B.shape[1]
        if given != wanted:
            raise InputError(f"springs: {given} for a system with {wanted} outputs")
        self.channels = channels_of(self.A, self.B, self.C, self.d, laws)
        if self.channels.pieces is not laws.pieces:
            laws = assembled(laws.springs, self.channels.pieces)
            self.B, self.C = self.channels.B, self.channels.C
        self.springs, self.pieces, self.memory, self.held = laws[:4]
        self.laws, self.sliders = laws, laws.sliders
        self.outputs: Array | None = None
        self.n, self.m = self.B.shape
        self._derivative = derivative
        self._proofs: Proofs | None = None
        self._pushes = np.column_stack((self.B, self.d)) if np.any(self.d) else self.B
        none, width = np.empty((0, 0, 0)), self.n + self._pushes.shape[1]
        changes = none if derivative is None else np.empty((0, 0, self.n * width))
        self.arrays = kernel.System(
            self.C, laws.rows, laws.sizes, laws.strides, np.full(laws.places, -1, dtype=np.int64),
            np.empty(0), none, none, np.empty((0, self.n, width)), changes,
            np.zeros((self.m, width)),
            self.channels.rows(None if derivative is None else derivative[0]),
        )  # fmt: skip

    def generators(self, places: Index) -> tuple[Array, Array]:
        """[A, B] of the modes at these places, (k, n, n+q), and their derivatives."""
        slopes = self.laws.slopes_at(places)
        change = self._d(slopes)
        made = closed(self.A, self._pushes, self.C, slopes)
        return made, np.zeros_like(made) if change is None else change

    def prepare(self, places: Index) -> None:
        """Make the tables of the modes at these places of `lookup`, and of those beside them."""
        beside = (places // BESIDE * BESIDE)[:, None] + np.arange(BESIDE)
        wanted = np.unique(beside[beside < self.arrays.lookup.size])
        places = wanted[self.arrays.lookup[wanted] < 0]
        slopes = self.laws.slopes_at(places)
        if not self.sliders.size:
            made = closed(self.A, self._pushes, self.C, slopes)
            self._take(places, build(made, self.C, self._cap, self._d(slopes)))
            return
        modes = modes_of(self.A, self._pushes, self.C, slopes)
        known = [] if self.outputs is None else [self.outputs]
        self.outputs = np.concatenate((*known, modes.outputs))
        self._take(places, build(modes.generators, modes.outputs, self._cap, self._d(slopes)))

    def _take(self, places: Index, tables: StepTables) -> None:
        """Enter tables, and the round-off that goes with them."""
        old = self.arrays
        old.lookup[places] = old.step.size + np.arange(places.size)
        if old.step.size:
            known = *old[5:10], old.noise[None]
            tables = StepTables(*map(np.concatenate, zip(known, tables, strict=True)))
        entered = tables._replace(noise=np.max(tables.noise, axis=0))
        self.arrays = old._replace(**entered._asdict())

    @property
    def proofs(self) -> Proofs:
        """What certifies the end of a motion, for the modes that have their tables."""
        if self._proofs is None or self._proofs.decays.size < self.arrays.step.size:
            self._proofs = proofs_of(self, self._proofs)
        return self._proofs

    @cached_property
    def contraction(self) -> Contraction | None:
        """What proves that a relay's switches die down, where it is of that kind."""
        return contraction_of(self)

    def closed(self, slopes: ArrayLike) -> Array:
        """A - B diag(slopes) C, (n, n)."""
        return np.asarray(self.A - (self.B * np.asarray(slopes)) @ self.C)

    def _d(self, slopes: Array) -> Array | None:
        """Derivative of the generators at these slopes."""
        if self._derivative is None:
            return None
        dA, dB = (np.asarray(part, dtype=float) for part in self._derivative)
        inputs = dB.reshape(self.n, -1)[:, self.channels.springs]
        if self.inputs > self.m:
            inputs = np.column_stack((inputs, np.zeros((self.n, self.inputs - self.m))))
        if not self.sliders.size:
            return closed(dA, inputs, self.C, slopes)
        h = 1e-30  # a step i h of the parameter: exact to round-off
        C = self.C + 1j * h * self.arrays.d_C
        moved = modes_of(self.A + 1j * h * dA, self._pushes + 1j * h * inputs, C, slopes)
        return np.ascontiguousarray(moved.generators.imag / h)

    @cached_property
    def most(self) -> int:
        """Switches that a passage may have."""
        return most_switches(self.pieces)

    @property
    def inputs(self) -> int:
        """Number of constant inputs of a mode: one a spring, and one for a load."""
        return int(self._pushes.shape[1])

    def place(self, modes: ArrayLike) -> int:
        """Place of a mode of all springs in `lookup`."""
        pieces = self.arrays.laws[np.arange(self.m), np.asarray(modes), PIECE].astype(np.int64)
        return int(pieces @ self.arrays.strides)

    def table(self, modes: ArrayLike) -> int:
        """The table of a mode of all springs, made if need be."""
        place = self.place(modes)
        if self.arrays.lookup[place] < 0:
            self.prepare(np.array([place]))
        return int(self.arrays.lookup[place])

    # --- motions

    def begin(self, x: ArrayLike, memory: ArrayLike = 0.0) -> Point:
        """Where a motion from a state begins, its memories made to fit, (n,) and (m,)."""
        state = np.array(x, dtype=float)
        held, modes = np.zeros(self.m), np.zeros(self.m, dtype=np.int64)
        given = self.memories(memory)
        for i, piece in enumerate(self.pieces):
            modes[i], held[i] = piece.start(float(self.C[i] @ state), float(given[i]))
        point = Point(0.0, state, held, modes)
        return point._replace(modes=holding(self, point)) if self.sliders.size else point

    def memories(self, given: ArrayLike) -> Array:
        """Memories of springs, (..., s) or one for all, with zeros for what they add, (..., m)."""
        values = np.asarray(given, dtype=float)
        if values.ndim == 0:
            return np.full(self.m, values)
        if values.shape == (self.m,):
            return values
        springs = len(self.springs)
        if values.shape[-1] == self.m or self.m == springs:
            return np.broadcast_to(values, np.broadcast_shapes(values.shape, (self.m,)))
        whole = np.broadcast_to(values, (*values.shape[:-1], springs))
        more = np.zeros((*whole.shape[:-1], self.m - springs))
        return np.concatenate((whole, more), axis=-1)

    def start(self, x: ArrayLike, memory: ArrayLike | None = None) -> Point:
        """Where a motion from a state begins.

        Parameters
        ----------
        x
            State, (n,).
        memory
            Memory of each spring, (m,), or one number for all; by default that of the thesis's
            starting branch.
        """
        if memory is not None:
            return self.begin(x, memory)
        y = (self.C @ np.asarray(x, dtype=float))[: len(self.springs)]
        starts = [spring.initial_memory(at) for spring, at in zip(self.springs, y, strict=True)]
        return self.begin(x, np.array(starts, dtype=float))

    def advance(self, point: Point, longest: float = np.inf) -> Point:
        """The point just after the next event, or after a time in which there was none."""
        march = March(self, point, events=1)
        march.run(point.time + longest)
        return march.point()

    def passage(self, z: Array, duration: float) -> Passage:
        """The motion from z over a duration, linearised.

        Raises
        ------
        ConvergenceError
            If the motion overflows or has more switches than a cycle can be expected to have.
        """
        n, k = self.n, self.n + self.held.size
        given = np.zeros(self.m)
        given[self.held] = z[n:]
        point = self.begin(z[:n], given)
        tangents = np.zeros((n + self.m, k + 1))
        tangents[np.arange(n), np.arange(n)] = 1.0
        for column, i in enumerate(self.held, start=n):
            row = self.pieces[i].rows[point.modes[i]]
            if point.memory[i] == given[i]:
                tangents[n + i, column] = 1.0
            elif row[FLOOR] < point.memory[i] < row[CEILING]:
                tangents[n + i, :n] = self.C[i]
        march = March(self, point, events=self.most, tangents=tangents)
        if march.run(duration) != kernel.DONE:
            raise ConvergenceError("the motion does not stay bounded and regular over a period")
        last = march.point()
        rate = np.append(self.rate(last), np.zeros(self.held.size))
        if march.motion.memo[kernel.JUMPED] > 0:  # at the end: the tangents are before it
            before(self.arrays, march.motion)
            rate[:n] = march.motion.rates[0]
        for row, i in enumerate(self.held, start=n):
            if self.pieces[i].rows[last.modes[i], SLIDES]:
                march.motion.tangents[n + i] = self.C[i] @ march.motion.tangents[:n]
                rate[row] = self.C[i] @ rate[:n]
        rows = np.concatenate((np.arange(n), n + self.held))
        return Passage(
            np.append(last.x, last.memory[self.held]),
            march.motion.tangents[rows],
            rate,
            self._switches(march.events()),
        )

    def _switches(self, events: Array) -> tuple[tuple[int, ...], ...]:
        columns = [1, 2] if self.m == 1 else [5, 1, 2]
        return tuple(map(tuple, events[:, columns].astype(int).tolist()))

    def trace(self, z: Array, duration: float, samples: int) -> Trace:
        """The motion from z over a duration, sampled uniformly, with its extrema and switches.

        Raises
        ------
        ConvergenceError
            If the motion overflows.
        """
        given = np.zeros(self.m)
        given[self.held] = z[self.n :]
        times: Array = np.arange(samples, dtype=np.float64) * (duration / samples)
        start = self.begin(z[: self.n], given)
        march = March(self, start, times=times, events=self.most, turns=EVENTS)
        if march.run(duration) != kernel.DONE:
            raise ConvergenceError("the motion does not stay bounded and regular over a period")
        last = march.point()
        return Trace(
            np.append(last.x, last.memory[self.held]),
            march.states,
            march.memory[:, 0],
            march.turns(),
            march.events(),
            march.memory,
            march.moments,
        )

    def rest(self, x: ArrayLike, memory: ArrayLike = 0.0) -> float:
        """y of rest of the first output if a motion provably comes to it; else NaN.

        It never leaves its mode again, or it is within the basin of a rest at a corner.
        """
        march = March(self, self.begin(x, memory))
        table = self.table(march.motion.modes)
        enter(self.arrays, march.motion)
        state, _, rest = resting(self.arrays, march.motion, self.proofs, table)
        return float(rest) if state == DAMPED else float("nan")

    # --- where a motion stands

    def entries(self, point: Point) -> Array:
        """(x, u) of a point, (n+q,)."""
        rows = self.arrays.laws[np.arange(self.m), point.modes]
        inputs = rows[:, HELD] * point.memory - rows[:, OFFSET]
        load = np.ones(self.inputs - self.m)
        return np.concatenate((point.x, inputs, load))

    def rate(self, point: Point) -> Array:
        """x' at a point, (n,)."""
        return np.asarray(self.arrays.generator[self.table(point.modes)] @ self.entries(point))


def _fill(flows: Sequence[Flow]) -> None:
    """Make the tables of flows with the same springs, if there are few enough to make them all."""
    count = flows[0].arrays.lookup.size
    if count > AT_ONCE:
        return
    if any(flow.sliders.size for flow in flows):
        for flow in flows:
            flow.prepare(np.arange(flow.arrays.lookup.size))
        return
    places = np.arange(count)
    slopes = flows[0].laws.slopes_at(places)
    for _, alike in groupby(flows, key=lambda flow: flow.inputs):
        while batch := list(islice(alike, TOGETHER)):
            generators = [closed(flow.A, flow._pushes, flow.C, slopes) for flow in batch]
            given = [d for flow in batch if (d := flow._d(slopes)) is not None]
            derivatives = np.concatenate(given) if given else None
            tables = build(np.concatenate(generators), batch[0].C, batch[0]._cap, derivatives)
            for i, flow in enumerate(batch):
                own = slice(i * count, (i + 1) * count)
                flow._take(places, StepTables(*(part[own] for part in tables)))
