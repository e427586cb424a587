"""One motion on its way: marched by the kernel, sampled from the steps that it made."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from aeroflutter.motion import _kernel_flow as kernel
from aeroflutter.motion._kernel_jump import jump
from aeroflutter.motion._kernel_roots import NONE, ROWS, SPACE, WIDTH, Y
from aeroflutter.motion.step_tables import padded
from aeroflutter.springs.piece_table import STUCK_MODE

if TYPE_CHECKING:
    from aeroflutter.motion.flow import Flow, Point

__all__ = ["FOREVER", "March", "stand", "workspace"]

Array = NDArray[np.float64]

FOREVER = 2**62
LOG = 256  # rows of a log, emptied as often as needed


def workspace(flow: Flow, tangents: Array | None = None, reaches: bool = False) -> kernel.Motion:
    """A motion of this flow that stands nowhere yet; see `_kernel_flow.Motion`."""
    n, m, q = flow.n, flow.m, flow.inputs
    columns = 2 * m * SPACE + padded(n)
    w = np.zeros((ROWS + columns // SPACE + 1, SPACE))
    size = n * (n + q)
    carried = np.zeros((n + m, 0)) if tangents is None else np.array(tangents, dtype=float)
    return kernel.Motion(
        xs=np.zeros((2, padded(n + q))),
        w=w,
        line=w[Y:].reshape(-1)[:columns],
        M=np.zeros(size),
        dM=np.zeros(flow.arrays.d_flow.shape[2] and size),
        h=np.zeros(m),
        modes=np.zeros(m, dtype=np.int64),
        window=np.zeros((m, 3)),
        inputs=np.ones(q),
        clock=np.zeros(1),
        memo=np.zeros(kernel.MEMOS, dtype=np.int64),
        reach=np.zeros(n if reaches else 0),
        tangents=carried,
        scratch=np.zeros((n, carried.shape[1])),
        since=np.zeros((2, padded(n + q))),
        was=np.zeros(q),
        rates=np.zeros((2, n)),
        watched=np.zeros(0, dtype=np.int64),
        none=np.zeros((0, 0)),
    )


def stand(motion: kernel.Motion, point: Point) -> None:
    """Take up a motion at a point."""
    motion.xs[0, : point.x.size] = point.x
    motion.h[:], motion.modes[:] = point.memory, point.modes
    motion.clock[0] = point.time
    memo = motion.memo
    memo[kernel.NOW] = memo[kernel.TREND] = memo[kernel.JUMPED] = memo[kernel.STILL] = 0
    memo[kernel.TABLE] = -1


class March:
    """A motion that goes on from where it stands, and what is kept of it.

    Parameters
    ----------
    flow
        The flow.
    point
        Where the motion starts.
    times
        Ascending times of samples, (k,).
    events, turns
        Rows of the logs of switches and of extrema of the first output; none are kept without.
    tangents
        Columns (δx, δh) to be carried along, (n+m, any number).
    reaches
        Whether the largest size of each state is kept, in `motion.reach`.

    Attributes
    ----------
    states, memory, moments
        Samples so far: (k, n), (k, m), (k, m).
    motion
        Where it stands, as the kernel sees it.
    """

    def __init__(
        self,
        flow: Flow,
        point: Point,
        times: Array | None = None,
        events: int = 0,
        turns: int = 0,
        tangents: Array | None = None,
        reaches: bool = False,
    ) -> None:
        self.flow = flow
        self.times = np.empty(0) if times is None else np.asarray(times, dtype=float)
        self.filled = 0
        self.states = np.empty((self.times.size, flow.n))
        self.memory = np.empty((self.times.size, flow.m))
        self.moments = np.empty((self.times.size, flow.m))
        self.motion = workspace(flow, tangents, reaches)
        self._events = np.empty((events, kernel.EVENT_COLUMNS))
        self._turns = np.empty((turns, kernel.TURN_COLUMNS))
        width = flow.arrays.noise.shape[1]
        self._steps = np.empty((LOG, 2 + width + 2 * flow.m))
        self.stand(point)

    def stand(self, point: Point) -> None:
        """Take up the motion at a point."""
        stand(self.motion, point)

    @property
    def time(self) -> float:
        """Where it stands."""
        return float(self.motion.clock[0])

    def point(self) -> Point:
        """Where it stands."""
        from aeroflutter.motion.flow import Point

        memo = self.motion.memo
        x = self.motion.xs[memo[kernel.NOW], : self.flow.n].copy()
        held = self.motion.h.copy()
        for i, piece in enumerate(self.flow.pieces):
            held[i] = piece.held(int(self.motion.modes[i]), float(self.flow.C[i] @ x), held[i])
        kind = int(memo[kernel.LAST])
        event = (int(memo[kernel.SPRING]), kind) if kind != NONE else None
        return Point(self.time, x, held, self.motion.modes.copy(), event)

    def events(self) -> Array:
        """Switches in the log, (i, EVENT_COLUMNS)."""
        return self._events[: self.motion.memo[kernel.EVENTS]].copy()

    def turns(self) -> Array:
        """Extrema of the first output in the log, (j, TURN_COLUMNS)."""
        return self._turns[: self.motion.memo[kernel.TURNS]].copy()

    def empty(self) -> None:
        """Forget what is in the logs."""
        self.motion.memo[[kernel.EVENTS, kernel.TURNS]] = 0

    def run(self, end: float, most: int = FOREVER, stop: int = kernel.NOWHERE) -> int:
        """March to a time, or to what stops it before; see `_kernel_flow.march`."""
        while True:
            wanted = self.filled < self.times.size
            status = self._leg(end, most, stop, wanted)
            if wanted:
                self._sample(int(self.motion.memo[kernel.STEPS]))
            if status != kernel.FULL or self._full:
                return status

    def _leg(self, end: float, most: int, stop: int, keep: bool) -> int:
        """March on with an empty log of steps, through modes without a table yet."""
        memo = self.motion.memo
        memo[kernel.STEPS] = 0
        while True:
            status = kernel.march(
                self.flow.arrays, self.motion, end, most, stop,
                self._steps if keep else self._steps[:0], self._events, self._turns,
            )  # fmt: skip
            if status == kernel.LEAPT:
                jump(self.flow.arrays, self.motion)
                continue
            if status != kernel.UNKNOWN:
                return int(status)
            self.flow.prepare(np.array([memo[kernel.PLACE]]))

    @property
    def _full(self) -> bool:
        """Whether a log that the caller empties is full."""
        memo = self.motion.memo
        return bool(
            0 < self._events.shape[0] <= memo[kernel.EVENTS]
            or 0 < self._turns.shape[0] <= memo[kernel.TURNS]
        )

    def through(self, end: float, rows: Array) -> tuple[Array, Array, Array]:
        """March to a time; what rows of the state do on the way.

        Parameters
        ----------
        rows
            (r, n).

        Returns
        -------
        starts, lengths, powers
            Of each step, (i,) twice; of each row at the time t after its start, the coefficients
            of the powers of t over the length, (i, WIDTH, r).
        """
        parts = []
        status = kernel.FULL
        while status == kernel.FULL:
            status = self._leg(end, FOREVER, kernel.NOWHERE, True)
            log = self._steps[: self.motion.memo[kernel.STEPS]]
            lengths = np.diff(np.append(log[:, 0], self.time))
            tables = log[:, 1].astype(np.int64)
            arrays, width = self.flow.arrays, self.flow.arrays.noise.shape[1]
            known = arrays.flow[:, :WIDTH].reshape(-1, WIDTH, self.flow.n, width)
            made = (rows @ known)[tables] @ log[:, None, 2 : 2 + width, None]
            share = (lengths / arrays.step[tables])[:, None] ** np.arange(WIDTH)
            parts.append((log[:, 0].copy(), lengths, made[..., 0] * share[..., None]))
        starts, lengths, powers = (np.concatenate(part) for part in zip(*parts, strict=True))
        return starts, lengths, powers

    def _sample(self, count: int) -> None:
        """Fill in the samples that lie within the last `count` steps."""
        log, flow = self._steps[:count], self.flow
        ends = np.append(log[1:, 0], self.time)
        until = int(np.searchsorted(self.times, self.time, side="right"))
        chosen = np.arange(self.filled, until)
        step = np.minimum(np.searchsorted(ends, self.times[chosen]), count - 1)
        tables = log[step, 1].astype(np.int64)
        width = flow.arrays.noise.shape[1]
        powers = np.ones((WIDTH, chosen.size))
        into = (self.times[chosen] - log[step, 0]) / flow.arrays.step[tables]
        np.maximum(into, 0.0, out=powers[1])
        for order in range(2, WIDTH):
            np.multiply(powers[order - 1], powers[1], out=powers[order])
        first = np.flatnonzero(np.diff(step, prepend=-1))  # samples of one step are neighbours
        entries = log[step[first], 2 : 2 + width]
        series = np.empty((first.size, WIDTH * flow.n))
        for table in set(tables[first].tolist()):
            own = tables[first] == table
            matrix = flow.arrays.flow[table, :WIDTH].reshape(WIDTH * flow.n, width)
            series[own] = entries[own] @ matrix.T
        for (a, b), one in zip(pairwise((*first, chosen.size)), series, strict=True):
            self.states[self.filled + a : self.filled + b] = powers[:, a:b].T @ one.reshape(
                WIDTH, -1
            )
        if chosen.size:
            modes = log[step, 2 + width : 2 + width + flow.m].astype(np.int64)
            self._springs(chosen, modes, log[step, 2 + width + flow.m :])
            if flow.sliders.size:
                self._holding(chosen, modes, log[step, 1 : 2 + width])
        self.filled = until

    def _springs(self, chosen: NDArray[np.int64], modes: NDArray[np.int64], held: Array) -> None:
        """Memory and moment of each spring at samples whose states are there."""
        y = self.states[chosen] @ self.flow.C.T
        for i, piece in enumerate(self.flow.pieces):
            memory, moments = piece.at(modes[:, i], y[:, i], held[:, i])
            self.memory[chosen, i], self.moments[chosen, i] = memory, moments

    def _holding(self, chosen: NDArray[np.int64], modes: NDArray[np.int64], log: Array) -> None:
        """Moments of laws that hold their outputs at zero; `log` has table and (x, u) of steps."""
        n, flow = self.flow.n, self.flow
        gains = np.einsum("in,ni->i", flow.C, flow.B)
        assert flow.outputs is not None  # there are laws that slide
        entries = np.hstack((self.states[chosen], log[:, 1 + n :]))
        for i in flow.sliders:
            at = modes[:, i] == STUCK_MODE
            rows = flow.outputs[log[at, 0].astype(np.int64), i]
            self.moments[chosen[at], i] = np.sum(rows * entries[at], axis=1) / gains[i]
