"""The law of a spring of straight pieces, stated once: everything else is read off this table.

A mode is a straight piece with a window: F = slope·y + offset - held·h while y stays between two
edges and, on the flat of a loop, goes on in one direction. Modes of a static law are its pieces,
without memory. The loop has three: it sticks with the memory h, between edges that move with h
and are gone where the slider is at a stop, or slides on either flat, h = y - lag.

Kernels, Houbolt's scheme, guarantees, centring and rest positions read this table, so a spring
that states one is known to all of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aeroflutter.errors import InputError
from aeroflutter.springs._kernel_columns import (
    BRANCH,
    CEILING,
    COLUMNS,
    DIRECTION,
    FALLING,
    FLOOR,
    HELD,
    HIGH,
    HOLDS,
    JUMPS,
    LAG,
    LOW,
    MOVES,
    OFFSET,
    PIECE,
    RISING,
    SLIDES,
    SLOPE,
    STICK,
    TO_HIGH,
    TO_LOW,
    TO_TURN,
)

__all__ = ["PieceTable"]

STUCK_MODE = 2  # of a relay that slides

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PieceTable:
    """Modes of a spring of straight pieces.

    Attributes
    ----------
    rows
        One row a mode, (modes, COLUMNS); see `_kernel_columns`.
    slopes
        Distinct slopes, (k,); NaN stands for the mode in which F is what keeps y at its edge.
    memory
        Whether the law has one: the number h.
    size
        Largest number of the law, for round-off (the unit of y).
    """

    rows: Array
    slopes: Array
    memory: bool
    size: float

    @classmethod
    def static(cls, breaks: ArrayLike, slopes: ArrayLike, offsets: ArrayLike) -> PieceTable:
        """A law without memory: F = slopes[i] y + offsets[i] between the breaks.

        Parameters
        ----------
        breaks, slopes, offsets
            Ascending, (p-1,); (p,) each.

        Raises
        ------
        InputError
            If the shapes do not fit or the law jumps at a break.
        """
        at, steep, start = (np.asarray(part, dtype=float) for part in (breaks, slopes, offsets))
        if not (steep.ndim == 1 and start.shape == steep.shape and at.shape == (steep.size - 1,)):
            raise InputError(
                f"pieces: {at.size} breaks, {steep.size} slopes and {start.size} offsets do not "
                "fit; give one slope and one offset a piece and one break between two"
            )
        edges = np.concatenate(([-np.inf], at, [np.inf]))
        rows = _blank(steep.size)
        rows[:, SLOPE], rows[:, OFFSET] = steep, start
        rows[:, LOW], rows[:, HIGH] = edges[:-1], edges[1:]
        rows[:, TO_LOW] = np.arange(-1, steep.size - 1)
        rows[:, TO_HIGH] = np.arange(1, steep.size + 1)
        size = float(np.max(np.abs(np.concatenate((at, start)))))
        return cls._indexed(rows, False, size)

    @classmethod
    def loop(cls, v1: float, v2: float, h_low: float, h_high: float) -> PieceTable:
        """The loop h ← clip(clip(h, y - v1, y - v2), h_low, h_high), F = y - h.

        Parameters
        ----------
        v1, v2
            Moments on the flats of a rising and of a falling motion, v1 > v2.
        h_low, h_high
            Stops of the slider, h_low < h_high.
        """
        rows = _blank(3)
        rows[:, FLOOR], rows[:, CEILING] = h_low, h_high
        rows[STICK, [SLOPE, HELD, MOVES]] = 1.0
        rows[STICK, [LOW, HIGH]] = v2, v1
        rows[STICK, [TO_LOW, TO_HIGH]] = FALLING, RISING
        for flat, lag, direction in ((RISING, v1, 1.0), (FALLING, v2, -1.0)):
            rows[flat, [OFFSET, LAG]] = lag
            rows[flat, [DIRECTION, SLIDES]] = direction, 1.0
            rows[flat, [TO_LOW, TO_HIGH, TO_TURN]] = STICK
        rows[RISING, HIGH], rows[FALLING, LOW] = h_high + v1, h_low + v2
        return cls._indexed(rows, True, float(np.max(np.abs([v1, v2, h_low, h_high]))))

    @classmethod
    def play(cls, half: float) -> PieceTable:
        """The follower h ← clip(h, y - half, y + half), F = h."""
        rows = _blank(3)
        rows[STICK, [HELD, MOVES]] = -1.0, 1.0
        rows[STICK, [LOW, HIGH]] = -half, half
        rows[STICK, [TO_LOW, TO_HIGH]] = FALLING, RISING
        for way, direction in ((RISING, 1.0), (FALLING, -1.0)):
            rows[way, [SLOPE, OFFSET, LAG]] = 1.0, -direction * half, direction * half
            rows[way, [DIRECTION, SLIDES, TO_TURN]] = direction, 1.0, STICK
        return cls._indexed(rows, True, half)

    @classmethod
    def relay(cls, level: float, half: float, slides: bool = False) -> PieceTable:
        """F = ±level, which jumps where y rises through `half` and falls through `-half`.

        Parameters
        ----------
        level, half
            Size of F; half the width of the hysteresis.
        slides
            Whether y can stay on its edge, F being what keeps it there: for a relay without width
            whose F enters y'. The edges of that mode are those of F.
        """
        rows = _blank(2 + slides)
        rows[:2, OFFSET], rows[:2, JUMPS] = (-level, level), 1.0
        rows[0, HIGH], rows[1, LOW] = half, -half
        rows[0, TO_HIGH], rows[1, TO_LOW] = (STUCK_MODE, STUCK_MODE) if slides else (1.0, 0.0)
        if half > 0.0:
            rows[:2, BRANCH] = -1.0, 1.0
        if slides:
            rows[STUCK_MODE, [HOLDS, LOW, HIGH]] = 1.0, -level, level
            rows[STUCK_MODE, [TO_LOW, TO_HIGH]] = 0.0, 1.0
            rows[STUCK_MODE, PIECE] = 1.0
            return cls(rows, np.array([0.0, np.nan]), False, level)
        return cls._indexed(rows, False, max(level, half))

    @classmethod
    def _indexed(cls, rows: Array, memory: bool, size: float) -> PieceTable:
        slopes, place = np.unique(rows[:, SLOPE], return_inverse=True)
        rows[:, PIECE] = place
        return cls(rows, slopes, memory, size)

    @property
    def modes(self) -> int:
        """Number of modes."""
        return int(self.rows.shape[0])

    @property
    def outside(self) -> tuple[float, float]:
        """Slopes of the law below and above all its edges."""
        if self.memory:
            far = STICK if np.isfinite(self.rows[STICK, CEILING]) else RISING
            return float(self.rows[far, SLOPE]), float(self.rows[far, SLOPE])
        return float(self.rows[0, SLOPE]), float(self.rows[-1, SLOPE])

    @property
    def remembers(self) -> bool:
        """Whether a motion depends on more than its state: on h, or on the side of a relay."""
        return self.memory or bool(np.any(self.rows[:, BRANCH]))

    @cached_property
    def jumps(self) -> bool:
        """Whether F jumps."""
        return bool(np.any(self.rows[:, JUMPS]))

    @property
    def push(self) -> float:
        """Most by which F differs from the straight line of its slope outside, if that is one."""
        if self.memory:
            stops = np.abs(self.rows[STICK, [FLOOR, CEILING]])
            return float(np.max(stops if np.all(np.isfinite(stops)) else self.rows[:, LAG]))
        if self.jumps:
            return float(np.max(np.abs(self.rows[:, OFFSET])))
        slope, breaks = self.outside[0], self.rows[:-1, HIGH]
        between = (self.rows[1:, SLOPE] - slope) * breaks + self.rows[1:, OFFSET]
        return float(np.max(np.abs(np.append(between, self.rows[[0, -1], OFFSET]))))

    def start(self, y: float, memory: float = 0.0) -> tuple[int, float]:
        """Mode and memory with which a motion from y begins."""
        if self.memory:
            stick = self.rows[STICK]
            held = min(max(memory, y - stick[HIGH]), y - stick[LOW])
            return STICK, float(min(max(held, stick[FLOOR]), stick[CEILING]))
        if self.jumps:
            return self._side(y, memory)
        return int(np.searchsorted(self.rows[:-1, HIGH], y, side="right")), 0.0

    def _side(self, y: float, memory: float) -> tuple[int, float]:
        """Side of a relay, the one that is remembered where y does not tell."""
        high = y >= self.rows[0, HIGH] or (memory > 0.0 and y > self.rows[1, LOW])
        return int(high), float(self.rows[int(high), BRANCH])

    def held(self, mode: int, y: float, memory: float) -> float:
        """Memory at y within a mode: h where it sticks, y - lag between the stops on a flat."""
        row = self.rows[mode]
        if not row[SLIDES]:
            return memory
        return float(min(max(y - row[LAG], row[FLOOR]), row[CEILING]))

    def at(self, modes: NDArray[np.int64], y: Array, memory: Array) -> tuple[Array, Array]:
        """Memory and moment at many y within their modes, see `held`, all of one shape."""
        rows = self.rows[modes]
        moments = rows[:, SLOPE] * y + rows[:, OFFSET] - rows[:, HELD] * memory
        if not self.memory:
            return np.zeros(y.shape), moments
        slid = np.minimum(np.maximum(y - rows[:, LAG], rows[:, FLOOR]), rows[:, CEILING])
        return np.where(rows[:, SLIDES] != 0.0, slid, memory), moments

    def window(self, mode: int, memory: float = 0.0) -> tuple[float, float]:
        """Lower and upper edge of y in a mode."""
        row = self.rows[mode]
        low, high = row[LOW] + row[MOVES] * memory, row[HIGH] + row[MOVES] * memory
        if row[MOVES]:
            low = -np.inf if memory <= row[FLOOR] else low
            high = np.inf if memory >= row[CEILING] else high
        return float(low), float(high)

    def branch(self, y: float, memory: float = 0.0) -> tuple[float, float, float, float]:
        """Slope and offset of the piece on which a motion at rest would be, and its window."""
        mode, held = self.start(y, memory)
        row = self.rows[mode]
        return float(row[SLOPE]), float(row[OFFSET] - row[HELD] * held), *self.window(mode, held)


def _blank(modes: int) -> Array:
    """Rows without edges, memory or successors."""
    rows = np.zeros((modes, COLUMNS))
    rows[:, [LOW, FLOOR]], rows[:, [HIGH, CEILING]] = -np.inf, np.inf
    rows[:, [TO_LOW, TO_HIGH, TO_TURN]] = -1.0
    return rows
