"""The grid of a map: two axes, and the blocks in which its cells are computed and stored."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aeroflutter.errors import InputError
from aeroflutter.limits import within

__all__ = ["Axis", "Block", "Grid", "ratios_around", "round_values"]

Array = NDArray[np.float64]

SMALLEST_BLOCK, LARGEST_BLOCK = 100, 8192  # cells: the price of a commit, the loss with a worker
BLOCKS = 48  # as many as that where neither limit is reached


@dataclass(frozen=True, eq=False)
class Axis:
    """One axis of a map.

    Parameters
    ----------
    key : str
        What varies: "speed", "speed_ratio", "velocity" (m/s), or the dotted path of a key of a
        case.
    values : array (m,)
        Finite, strictly increasing or decreasing; in the units of the key.

    Raises
    ------
    InputError
        If there are no values, one is not finite, or they are not in order.
    """

    key: str
    values: Array

    def __post_init__(self) -> None:
        values = np.array(self.values, dtype=float).ravel()
        values.flags.writeable = False
        object.__setattr__(self, "values", values)
        steps = np.diff(values)
        if values.size == 0 or not np.all(np.isfinite(values)):
            raise InputError(f"{self.key}: needs at least one value, all of them finite")
        if not (np.all(steps > 0) or np.all(steps < 0)):
            raise InputError(f"{self.key}: must be in ascending or descending order, none twice")

    @property
    def name(self) -> str:
        """The last part of the key, with which datasets name the axis."""
        return self.key.rpartition(".")[2]

    def __len__(self) -> int:
        return int(self.values.size)


@dataclass(frozen=True)
class Block:
    """Cells computed together and committed together: `x` and `y` are ranges of indices."""

    number: int
    x: slice
    y: slice

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of cells along x and y."""
        return self.x.stop - self.x.start, self.y.stop - self.y.start

    @property
    def cells(self) -> int:
        """Number of cells."""
        return self.shape[0] * self.shape[1]


@dataclass(frozen=True, eq=False)
class Grid:
    """Two axes and their division into blocks, which depends on nothing but their lengths.

    Parameters
    ----------
    x, y : Axis

    Raises
    ------
    InputError
        If both axes vary the same key.
    """

    x: Axis
    y: Axis

    def __post_init__(self) -> None:
        both = {self.x.key, self.y.key}
        if len(both) == 1 or both <= {"speed", "speed_ratio", "velocity"}:
            raise InputError(f"{self.y.key}: stands on both axes; let them vary two things")
        within("cells", self.cells, "map")

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of cells along x and y."""
        return len(self.x), len(self.y)

    @property
    def cells(self) -> int:
        """Number of cells."""
        return len(self.x) * len(self.y)

    @property
    def block_shape(self) -> tuple[int, int]:
        """Shape of a block: whole columns, unless a column alone is too many cells."""
        size = min(max(self.cells // BLOCKS, SMALLEST_BLOCK), LARGEST_BLOCK)
        rows = min(len(self.y), LARGEST_BLOCK)
        return min(max(size // rows, 1), len(self.x)), rows

    def blocks(self) -> list[Block]:
        """All blocks, numbered column by column."""
        columns, rows = self.block_shape
        nx, ny = self.shape
        corners = [(i, j) for i in range(0, nx, columns) for j in range(0, ny, rows)]
        return [
            Block(number, slice(i, min(i + columns, nx)), slice(j, min(j + rows, ny)))
            for number, (i, j) in enumerate(corners)
        ]

    def points(self, block: Block) -> tuple[Array, Array]:
        """Coordinates (m,) of the cells of a block, column by column."""
        nx, ny = block.shape
        x = np.repeat(self.x.values[block.x], ny)
        return x, np.tile(self.y.values[block.y], nx)


def ratios_around(onset: float, most: int) -> Array:
    """Speed ratios of a map: from below an onset of limit cycles to above flutter.

    Parameters
    ----------
    onset : float
        U*/U*_L of the onset.
    most : int
        How many at most.
    """
    near = onset > 1.0 - 1e-3  # a branch that starts at flutter goes up from it
    high = max(1.5, 1.25 * onset) if near else 1.0 + 0.25 * (1.0 - onset)
    return round_values(max(0.05, onset - 0.3 * (high - onset)), high, most)


def round_values(low: float, high: float, most: int) -> Array:
    """At most so many round values, equally spaced, that cover a range."""
    for step in (n * 10.0**power for power in range(-4, 3) for n in (1.0, 2.0, 2.5, 5.0)):
        first, last = np.floor(low / step + 1e-9), np.ceil(high / step - 1e-9)
        if last - first < most:
            break
    return np.round(step * np.arange(max(first, 1.0), last + 1.0), 6)
