"""Columns of a map on the exact engine: made ready together, decided cell after cell."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeroflutter.motion import _kernel_ends as ends
from aeroflutter.motion._kernel_cycle import ATTRACTS
from aeroflutter.motion._kernel_flow import AT_SWITCH, AT_TURN, LAST, STOPPED, TREND
from aeroflutter.motion._kernel_proofs import LCO
from aeroflutter.motion._kernel_roots import ABOVE
from aeroflutter.motion.closing import Closing, approach, norm, section_map
from aeroflutter.motion.endstates import EndOptions
from aeroflutter.motion.flow import Flow, Point
from aeroflutter.motion.judge import Settling, no_cycles
from aeroflutter.motion.march import March, workspace
from aeroflutter.motion.reach import SLOW, contracts_within, next_gate, reach_of
from aeroflutter.springs._kernel_columns import CEILING, FLOOR
from aeroflutter.studies.maps import _kernel_column as kernel
from aeroflutter.studies.maps._kernel_paths import Paths

__all__ = ["Column", "decide_cells"]

Array = NDArray[np.float64]

SAME = 1e-7  # relative difference of the measures of one cycle, closed twice
MOST_TURNS = 8  # of a motion that comes to the section, within a loop and a half
MOST_STEPS = 4096  # between two of them


class Column(NamedTuple):
    """How the cells of one system end, (c,) each; see `motion.endstates.EndStates`."""

    state: NDArray[np.int64]
    amplitude: Array
    bias: Array
    period: Array
    rest: Array
    time: Array


class Room(NamedTuple):
    """Work space of columns with as many states, one after another.

    Attributes
    ----------
    paths, targets
        What is known of the column at hand.
    """

    paths: Paths
    targets: kernel.Targets

    @classmethod
    def of(cls, n: int) -> Room:
        """Work space for n states."""
        return cls(_no_paths(n), _no_targets(n))


def decide_cells(
    flow: Flow, states: Array, memory: Array, options: EndOptions, room: Room | None = None
) -> Column:
    """End states of cells that share a flow of one spring, in their order.

    Parameters
    ----------
    flow
        The system and its spring.
    states, memory
        Where the cells start, (c, n) and (c,).
    options
        When an end state is settled.
    room
        Work space, if it is not to be made anew.
    """
    room = room or Room.of(flow.n)
    decided = _Decided(flow, np.array(states), np.array(memory)[:, None], options, room)
    decided.run()
    numbers = decided.numbers
    columns = (ends.AMPLITUDE, ends.BIAS, ends.PERIOD, ends.REST, ends.TIME)
    return Column(decided.codes[:, 0], *(numbers[:, column] for column in columns))


class _Decided:
    """Cells on their way to their end states: the kernel, and what it leaves to its caller."""

    def __init__(
        self, flow: Flow, states: Array, memories: Array, options: EndOptions, room: Room
    ) -> None:
        count = states.shape[0]
        self.flow, self.states, self.memories, self.options = flow, states, memories, options
        self.starts = states.copy(), memories.copy()
        self.codes = np.empty((count, 2), dtype=np.int64)
        self.numbers = np.empty((count, ends.NUMBERS))
        self.cycles = no_cycles(kernel.MOST_PATHS + 1, flow.n + 1)
        self.paths, self.targets = room
        modes = np.zeros(flow.pieces[0].modes, dtype=np.int64)
        self.motion = workspace(flow)._replace(watched=modes)
        self.memo = np.zeros(kernel.MEMOS, dtype=np.int64)
        self.closing: Closing | None = None
        self.closed = -1  # the last cell beside which a cycle was sought
        self.tried = 0  # known cycles whose reach on the section of maxima is known

    def run(self) -> None:
        """Decide all of them."""
        gate = self.flow.pieces[0].modes - 2
        while True:
            why = kernel.follow(
                self.flow.arrays, self.motion, self.flow.proofs, self.cycles, self.paths,
                self.targets, gate, self.options.duration, self.states, self.memories, self.codes,
                self.numbers, self.memo,
            )  # fmt: skip
            if why == kernel.OVER:
                return
            cell = int(self.memo[kernel.CELL])
            if why == kernel.CLOSING and self._close(cell):
                self.memo[kernel.GOES_ON] = 1
                continue
            self.memo[kernel.GOAL] = self._settle(cell)
            if self.paths.spread[0] > kernel.PARTED:  # the path may be that of another motion
                self.memo[kernel.RETURNS] = 0
            self.memo[kernel.CELL] += 1

    def _close(self, cell: int) -> bool:
        """Find the cycle beside the cell at hand; whether there is a new one to which it may go."""
        known, k = int(self.memo[kernel.CYCLES]), int(self.memo[kernel.RETURNS]) - 1
        if self.closed == cell or known == kernel.MOST_PATHS or k + 1 == kernel.MOST_RETURNS:
            return False
        self.closed, lag = cell, int(self.memo[kernel.LAG])
        loop = last_loop(self.flow, self.states[cell], self.memories[cell])
        if loop is None:
            return False
        guess = float(self.paths.times[k] - self.paths.times[k - lag])
        self.closing = self.closing or Closing(self.flow)
        found = self.closing.find(loop.point, guess, lag, loop.size, loop.span, self.cycles, known)
        if found != ATTRACTS or self.cycles.free[known] or self._is_known(known):
            return False
        returns = round(lag * float(self.cycles.period[known]) / guess)
        aim(self.flow, self.cycles, known, self.targets, self.closing, returns)
        if self.targets.lag[known] == 0:
            return False
        self.memo[kernel.CYCLES] = known + 1
        return True

    def _is_known(self, place: int) -> bool:
        """Whether a cycle is one of those before it."""
        of = np.column_stack((self.cycles.period, self.cycles.amplitude, self.cycles.bias))
        scale = np.array([self.cycles.period[place], *[self.cycles.amplitude[place]] * 2])
        return bool(np.any(np.all(np.abs(of[:place] - of[place]) < SAME * scale, axis=1)))

    def _settle(self, cell: int) -> int:
        """Settle a cell as if it were alone; the place of its cycle, or -1."""
        known, row = int(self.memo[kernel.CYCLES]), self.numbers[cell]
        start = self.starts[0][cell : cell + 1].copy(), self.starts[1][cell : cell + 1]
        for j in range(self.tried, known):
            norm(self.cycles, j)
            self.cycles.reach[j] = reach_of(self.flow, self.cycles, j)
        settling = Settling(self.flow, *start, self.options, share=True)
        settling.cycles, settling.past.memo[ends.COUNT] = self.cycles, known
        settling.run()
        row[:], self.codes[cell] = settling.numbers[0], settling.codes[0]
        # where there is no room among the targets, the next cells find it anew
        found = min(int(settling.past.memo[ends.COUNT]), kernel.MOST_PATHS)
        if found > known:
            aim(self.flow, self.cycles, known, self.targets)
            self.memo[kernel.CYCLES] = found
        self.tried = found
        place = int(row[ends.ATTRACTOR]) if self.codes[cell, 0] == LCO else -1
        return place if place < found else -1


class Loop(NamedTuple):
    """The loop of a motion from one maximum of the first output to the next.

    Attributes
    ----------
    point, size
        (x, h) where it ends, and the largest size of each on the way, (n+m,).
    span
        Height of the maximum over the lowest minimum.
    """

    point: Array
    size: Array
    span: float


def last_loop(flow: Flow, x: Array, memory: Array) -> Loop | None:
    """The first whole loop of a motion of one spring; None if it does not oscillate."""
    march = March(flow, flow.begin(x, memory), reaches=True)
    turns: list[float] = []
    maxima = 0
    for _ in range(MOST_TURNS):
        if march.run(np.inf, most=MOST_STEPS, stop=AT_TURN) != STOPPED:
            return None
        point = march.point()
        y = float(flow.C[0] @ point.x)
        if march.motion.memo[TREND] > 0:
            turns.append(y)
            continue
        maxima += 1
        if maxima == 2:
            break
        turns = []
        march.motion.reach[:] = np.abs(point.x)
    if maxima < 2 or not turns:
        return None
    span = y - min(turns)
    law = flow.pieces[0].rows[0]
    width = float(law[CEILING] - law[FLOOR]) if flow.memory[0] else 0.0
    held = max(span, width if np.isfinite(width) else 0.0)
    reach = np.maximum(march.motion.reach, np.abs(point.x))
    return Loop(np.append(point.x, point.memory), np.append(reach, held), span)


def _no_paths(n: int) -> Paths:
    """Room for the paths of a column; the last is that of the cell at hand."""
    count, length = kernel.MOST_PATHS + 1, kernel.MOST_RETURNS
    return Paths(
        points=np.empty((count, length, n)),
        rates=np.empty((count, length)),
        times=np.empty(length),
        smooth=np.zeros((count, length), dtype=np.int64),
        sizes=np.ones((count, n)),
        length=np.zeros(count, dtype=np.int64),
        cycle=np.zeros(count, dtype=np.int64),
        hints=np.zeros(count, dtype=np.int64),
        agreed=np.zeros(count, dtype=np.int64),
        far=np.zeros(count),
        waits=np.zeros(2, dtype=np.int64),
        spread=np.zeros(2),
    )


def _no_targets(n: int) -> kernel.Targets:
    """Room for the cycles of a column."""
    count = kernel.MOST_PATHS
    return kernel.Targets(
        np.zeros((count, n)), np.ones((count, n)), np.zeros((count, n, n)),
        np.zeros((count, n, n)), np.ones(count), np.zeros((count, 2, n)), np.full(count, np.inf),
        np.zeros(count, dtype=np.int64), np.zeros((4, n)),
    )  # fmt: skip


def aim(
    flow: Flow,
    cycles: ends.Cycles,
    j: int,
    targets: kernel.Targets,
    closing: Closing | None = None,
    lag: int | None = None,
) -> None:
    """Enter known cycle j among the targets, if it returns to the section.

    Parameters
    ----------
    closing
        Work space on this flow, if there is one.
    lag
        How often a period it returns, if that is known.
    """
    n, period, gate = flow.n, float(cycles.period[j]), flow.pieces[0].modes - 2
    targets.lag[j] = 0
    start = flow.begin(cycles.z[j, :n], cycles.z[j, n:])
    march, mode = March(flow, start, events=flow.most if lag is None else 0), -1
    if lag is None:
        march.run(period)
        lag = _returns(march, int(start.modes[0]), gate)
        march.stand(start)
    if lag == 0:
        return
    while mode != gate or march.motion.memo[LAST] != ABOVE:
        mode = int(march.motion.modes[0])
        march.empty()
        if march.run(period, stop=AT_SWITCH) != STOPPED:
            return
    point = march.point()
    monodromy = (closing or Closing(flow)).carried(point, period)
    if monodromy is None:
        return
    size = cycles.size[j, :n]
    Q = section_map(flow.C[0], monodromy, flow.rate(point), size)
    targets.point[j], targets.size[j], targets.Q[j] = point.x, size, Q
    targets.rho[j], targets.P[j], targets.slow[j] = approach(Q, float(cycles.radius[j]))
    targets.lag[j] = lag
    if cycles.radius[j] > SLOW:
        targets.reach[j] = _reach(flow, point, period, targets, j)
    else:
        targets.reach[j] = np.inf


def _returns(march: March, mode: int, gate: int) -> int:
    """How often a motion has come to the section that began in a mode.

    Counted from its maximum: over a period that begins on the section, round-off would decide
    whether the last return is one.
    """
    events = march.events()
    before = np.append(mode, events[:-1, 2])
    return int(np.sum((events[:, 1] == ABOVE) & (before == gate)))


def _reach(flow: Flow, point: Point, period: float, targets: kernel.Targets, j: int) -> float:
    """How far from a target the returns to the section were seen to come closer."""
    at, size, lag = targets.point[j], targets.size[j], int(targets.lag[j])

    def back(d: Array) -> Array | None:
        end = next_gate(flow, at + size * d, point.memory, lag, 0.2 * period / max(lag, 1))
        return None if end is None else np.asarray((end - at) / size)

    return contracts_within(targets.Q[j], targets.P[j], float(targets.rho[j]), back)
