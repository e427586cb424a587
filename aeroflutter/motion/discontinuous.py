"""Laws that jump, as the exact flow takes them: by the relative degree of what they jump on.

A relay jumps on the sign of σ = r x: its own output y, or the rate y' where it is friction. With
g = r B, the part of F in -σ',

- g > 0: F can hold σ at zero. It slides there (Filippov): F is whatever keeps σ' = 0, as long as
  that is between the two sides. The motion is that of P A x with P = I - B g⁻¹ r, and the mode ends
  where F reaches an edge. Several at once: g = R B is a matrix, and which of them slide is its
  linear complementarity problem, which the march solves by letting go, in their order, those that
  cannot hold (Murty 1974). It has one answer for every load if g is a P-matrix.
- g = 0: there is no such mode; the motion crosses, ever faster where it dies down.
- g < 0: it crosses.

Friction jumps on the rate y' = C A x, so that C B has to be zero, and g = C A B.
"""

from __future__ import annotations

from itertools import chain, combinations
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from aeroflutter.errors import InputError
from aeroflutter.springs import PieceTable
from aeroflutter.springs._kernel_columns import HIGH, HOLDS, LOW
from aeroflutter.springs.piece_table import STUCK_MODE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from aeroflutter.motion.flow import Flow, Point
    from aeroflutter.motion.laws import Laws

    Array = NDArray[np.float64]

__all__ = ["Channels", "Modes", "channels_of", "holding", "modes_of"]

NOTHING = 1e-12  # relative size of a product that is zero
STILL = 1e-13  # relative size of an output that is zero
MOST = 10  # sliders for which all principal minors are looked at


class Channels(NamedTuple):
    """A system in which every law reads one output; rates of laws with friction come last.

    Attributes
    ----------
    B, C
        (n, m) and (m, n).
    pieces
        Of each, m of them.
    springs
        Place of the spring that each belongs to, (m,).
    rates
        How many of them are of rates.
    """

    B: Array
    C: Array
    pieces: list[PieceTable]
    springs: NDArray[np.int64]
    rates: int = 0

    def rows(self, dA: Array | None) -> Array:
        """Derivative of C when A changes by dA, (m, n)."""
        changed = np.zeros_like(self.C)
        if dA is not None and self.rates:
            own = self.springs[-self.rates :]
            changed[-self.rates :] = self.C[own] @ np.asarray(dA, dtype=float)
        return changed

    def forces(self, moments: Array) -> Array:
        """Moment of each spring from those of all channels, (..., m) -> (..., s)."""
        count = self.springs.size - self.rates
        total = moments[..., :count].copy()
        for i in range(count, self.springs.size):
            total[..., self.springs[i]] += moments[..., i]
        return total


class Modes(NamedTuple):
    """Linear modes: generators [A, B] (k, n, n+q), and what ends each: (k, m, n+q) rows."""

    generators: Array
    outputs: Array


def channels_of(A: Array, B: Array, C: Array, d: Array, laws: Laws) -> Channels:
    """The channels of springs with these laws.

    Raises
    ------
    InputError
        If friction acts on its rate directly or drives it, or sliders have no single answer.
    """
    springs, pieces = laws.springs, laws.pieces
    place = list(range(len(springs)))
    if laws.smooth:
        return Channels(B, C, pieces, np.array(place, dtype=np.int64))
    rates = [i for i, spring in enumerate(springs) if spring.rate_table() is not None]
    if rates:
        _refuse_direct(B, C, d, rates)
        tables = [springs[i].rate_table() for i in rates]
        pieces = [*pieces, *(table for table in tables if table is not None)]
        B, C = np.hstack((B, B[:, rates])), np.vstack((C, C[rates] @ A))
        place += rates
    gains = np.einsum("in,ni->i", C, B)
    sizes = np.linalg.norm(C, axis=1) * np.linalg.norm(B, axis=0)
    holds = [
        i
        for i, piece in enumerate(pieces)
        if piece.jumps
        and piece.rows[0, HIGH] == piece.rows[1, LOW]
        and gains[i] > NOTHING * sizes[i]
    ]
    for i in range(len(springs), len(pieces)):
        if i not in holds:
            raise InputError(
                "spring.kind: friction needs C A B > 0, a coordinate that it slows down; "
                "put it where the system has a mass"
            )
    _refuse_ambiguous(C, B, holds)
    pieces = [
        _sliding(piece, float(gains[i])) if i in holds else piece for i, piece in enumerate(pieces)
    ]
    B, C = np.ascontiguousarray(B), np.ascontiguousarray(C)
    return Channels(B, C, pieces, np.array(place, dtype=np.int64), len(rates))


def _sliding(piece: PieceTable, gain: float) -> PieceTable:
    """A relay that slides; what ends that mode is read in units of g F."""
    table = PieceTable.relay(piece.push, 0.0, slides=True)
    stuck = table.rows[:, HOLDS] != 0.0
    table.rows[np.ix_(stuck, [LOW, HIGH])] *= gain
    return table


def _refuse_direct(B: Array, C: Array, d: Array, rates: list[int]) -> None:
    size = np.outer(np.linalg.norm(C[rates], axis=1), np.linalg.norm(B, axis=0))
    loads = np.abs(C[rates] @ d) > NOTHING * np.linalg.norm(C[rates], axis=1) * np.linalg.norm(d)
    if np.any(np.abs(C[rates] @ B) > NOTHING * size) or np.any(loads):
        raise InputError(
            "spring.kind: friction needs C B = 0, a coordinate whose rate no spring sets directly; "
            "put it where the system has a mass"
        )


def _refuse_ambiguous(C: Array, B: Array, holds: list[int]) -> None:
    if len(holds) > MOST:
        raise InputError(f"springs: {len(holds)} sliders at once; at most {MOST} are taken")
    gain = C[holds] @ B[:, holds]
    places = range(len(holds))
    sets = chain.from_iterable(combinations(places, size) for size in range(2, len(holds) + 1))
    for chosen in sets:
        part = gain[np.ix_(chosen, chosen)]
        if np.linalg.det(part / np.sqrt(np.outer(np.diag(part), np.diag(part)))) <= NOTHING:
            raise InputError(
                "springs: which of the sliders stick has no single answer (C A B is no P-matrix)"
            )


def modes_of(A: Any, inputs: Any, C: Any, slopes: Array) -> Modes:
    """Modes with these slopes; complex numbers for A, inputs and C are taken.

    Parameters
    ----------
    A, inputs, C
        (n, n), (n, q) with the m columns of B first, (m, n).
    slopes
        Of each law in each mode, (k, m); NaN where F is what keeps its output at zero.
    """
    m, n = C.shape
    q = inputs.shape[1]
    stuck = np.isnan(slopes)
    closed = A - np.einsum("im,km,mj->kij", inputs[:, :m], np.where(stuck, 0.0, slopes), C)
    rows = np.broadcast_to(inputs, (len(slopes), n, q))
    generators = np.concatenate((closed, rows), axis=2)
    outputs = np.zeros((len(slopes), m, n + q), dtype=generators.dtype)
    outputs[:, :, :n] = C
    for k in np.flatnonzero(np.any(stuck, axis=1)):
        held = np.flatnonzero(stuck[k])
        free = generators[k].copy()
        free[:, n + held] = 0.0
        R, B = C[held], inputs[:, held]
        gain = R @ B
        force = np.linalg.solve(gain, R @ free)
        outputs[k, held] = np.diag(gain)[:, None] * force
        generators[k] = free - B @ force
        # Off σ = 0, where round-off leads, nothing drives σ either.
        generators[k, :, :n] -= generators[k, :, :n] @ B @ np.linalg.solve(gain, R)
    return Modes(generators, outputs)


def holding(flow: Flow, point: Point) -> NDArray[np.int64]:
    """Modes of a point in which those laws hold their outputs at zero that can, (m,).

    Those that cannot let go in their order, which ends (Murty 1974).
    """
    modes = point.modes.copy()
    sigma, size = flow.C @ point.x, np.abs(flow.C) @ np.abs(point.x)
    still = [int(i) for i in flow.sliders if abs(sigma[i]) <= STILL * size[i]]
    modes[still] = STUCK_MODE
    for _ in range(3 ** len(still)):
        change = _let_go(flow, point._replace(modes=modes), still)
        if change is None:
            break
        modes[change[0]] = change[1]
    return modes


def _let_go(flow: Flow, point: Point, still: list[int]) -> tuple[int, int] | None:
    """The first law that is not in its mode for long, and the mode that it goes to."""
    table = flow.table(point.modes)
    assert flow.outputs is not None  # there are laws that slide
    held, rates = flow.outputs[table] @ flow.entries(point), flow.C @ flow.rate(point)
    for i in still:
        mode = point.modes[i]
        low, high = flow.pieces[i].rows[STUCK_MODE, [LOW, HIGH]]
        if mode == STUCK_MODE and not low <= held[i] <= high:
            return i, int(held[i] > high)
        if mode != STUCK_MODE and (2 * mode - 1) * rates[i] < 0.0:
            return i, STUCK_MODE
    return None
