"""The laws of the springs of a flow, assembled as its kernels take them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aeroflutter.errors import InputError
from aeroflutter.springs import PieceTable, Spring, simplify
from aeroflutter.springs._kernel_columns import COLUMNS, HOLDS

__all__ = ["Laws", "assembled", "laws_of", "pieces_of"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]


def pieces_of(springs: Sequence[Spring]) -> list[PieceTable]:
    """The piece tables of springs.

    Raises
    ------
    InputError
        If a spring is not made of straight pieces.
    """
    tables = [_piece_table(spring) for spring in springs]
    for spring, table in zip(springs, tables, strict=True):
        if table is None:
            raise InputError(
                f"spring.kind: {spring.kind!r} has no linear pieces; the exact engine takes "
                "linear, table, bilinear, freeplay and hysteresis"
            )
    return [table for table in tables if table is not None]


@lru_cache(maxsize=64)
def _piece_table(spring: Spring) -> PieceTable | None:
    """Made once for all speeds."""
    return spring.piece_table()


class Laws(NamedTuple):
    """What all flows with the same springs share.

    Attributes
    ----------
    springs, pieces
        The simplest springs with these laws, and their tables.
    memory, held
        Whether each spring has one, (m,), and which do.
    rows, sizes, strides
        As in `_kernel_flow.System`.
    places
        Number of modes of all springs together that differ in a slope.
    sliders
        Which laws can hold their output at zero.
    smooth
        Whether none of the springs jumps, or acts on the rate of its output.
    """

    springs: tuple[Spring, ...]
    pieces: list[PieceTable]
    memory: NDArray[np.bool_]
    held: Index
    rows: Array
    sizes: Array
    strides: Index
    places: int
    sliders: Index
    smooth: bool

    def slopes_at(self, places: ArrayLike) -> Array:
        """Slope of each spring in the modes at these places of `lookup`, (k, m)."""
        columns = [
            piece.slopes[(np.asarray(places) // stride) % piece.slopes.size]
            for piece, stride in zip(self.pieces, self.strides, strict=True)
        ]
        return np.stack(columns, axis=-1)


@lru_cache(maxsize=64)
def laws_of(springs: tuple[Spring, ...]) -> Laws:
    """Made once for all speeds."""
    simple = tuple(simplify(spring) for spring in springs)
    return assembled(simple, pieces_of(simple))


def assembled(simple: tuple[Spring, ...], pieces: list[PieceTable]) -> Laws:
    """The laws of springs that are as simple as can be, by their piece tables."""
    rows = np.zeros((len(pieces), max((piece.modes for piece in pieces), default=0), COLUMNS))
    for law, piece in zip(rows, pieces, strict=True):
        law[: piece.modes] = piece.rows
    counts = np.array([piece.slopes.size for piece in pieces], dtype=np.int64)
    memory = np.array([piece.memory for piece in pieces], dtype=bool)
    return Laws(
        simple,
        pieces,
        memory,
        np.flatnonzero(memory),
        rows,
        np.array([piece.size for piece in pieces]),
        np.cumprod(counts) // counts,
        int(np.prod(counts)),
        np.flatnonzero([np.any(piece.rows[:, HOLDS]) for piece in pieces]),
        not any(piece.jumps for piece in pieces)
        and all(spring.rate_table() is None for spring in simple),
    )
