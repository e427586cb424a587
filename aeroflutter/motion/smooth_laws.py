"""A loop of laws of which one has no straight pieces, as the engines of series and DOP853 see it.

Polynomials are one piece; of several springs those of straight pieces are as many as they have. A
point z holds the state and the memory of every spring that has one: z = (x, h, …).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, reduce
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from aeroflutter.errors import InputError
from aeroflutter.model.lure import as_system
from aeroflutter.motion._kernel_taylor import Law
from aeroflutter.springs import PieceTable, alone, each, simplify
from aeroflutter.springs._kernel_columns import (
    CEILING,
    FLOOR,
    OFFSET,
    SLIDES,
    SLOPE,
    STICK,
    TO_LOW,
    TO_TURN,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from aeroflutter.model.lure import AnySystem
    from aeroflutter.model.system import System
    from aeroflutter.springs import Spring, Springs

    Array = NDArray[np.float64]

__all__ = ["Pieces", "SmoothLoop", "jumps", "scalar_law", "slope_law"]

NEWTON = 30
ROUND_OFF = 1e-12  # of a rest, in the size of the state that it is looked for from
FAR = 10.0  # scales of the laws, beyond which a rest is not next to a state
DIFFERENCE = 6e-6  # cube root of round-off: the best step of a central difference
NOTHING = np.empty((0, 0))


class Pieces(NamedTuple):
    """Laws of polynomial pieces.

    Attributes
    ----------
    law
        The loop as the kernels see it.
    tables
        The modes of each spring.
    """

    law: Law
    tables: tuple[PieceTable, ...]

    def begin(self, z: Array) -> tuple[NDArray[np.int64], Array]:
        """Mode of each spring, among all, at a point, and the point with memories made to fit."""
        law, z = self.law, z.astype(float)
        modes = law.first.copy()
        for s, table in enumerate(self.tables):
            if table.modes > 1:
                place, y = law.held[s], float(law.C[s] @ z[: law.A.shape[0]])
                mode, held = table.start(y, float(z[place]) if table.memory else 0.0)
                modes[s] += mode
                if table.memory:
                    z[place] = held
        return modes, z

    def tangents(self, z: Array, given: Array, columns: int) -> Array:
        """Derivative of a point that was made to fit by what was given, (N, columns)."""
        law, n = self.law, self.law.A.shape[0]
        found = np.eye(z.size, columns)
        for s in np.flatnonzero(law.held >= 0):
            place, table = law.held[s], self.tables[s]
            if z[place] != given[place]:
                found[place] = 0.0
                if table.rows[STICK, FLOOR] < z[place] < table.rows[STICK, CEILING]:
                    found[place, :n] = law.C[s]
        return found

    def rate(self, rows: NDArray[np.int64], z: Array, x_rate: Array) -> Array:
        """z' of a motion in these modes, from its x'."""
        law, rate = self.law, np.zeros(z.size)
        rate[: x_rate.size] = x_rate
        for s in np.flatnonzero(law.held >= 0):
            rate[law.held[s]] = law.table[rows[s], SLIDES] * (law.C[s] @ x_rate)
        return rate


@dataclass(frozen=True, eq=False)
class SmoothLoop:
    """x' = A x - B F(C x) + d, F one law an output.

    Attributes
    ----------
    system, springs
        The two; y, of which turning points are asked, is the first output.
    change
        Derivatives of A and B with respect to a parameter, if there is one.
    """

    system: System
    springs: tuple[Spring, ...]
    change: tuple[Array, Array] | None = None

    @classmethod
    def of(
        cls, system: AnySystem, spring: Springs, change: tuple[Array, Array] | None = None
    ) -> SmoothLoop:
        """The loop of a system and its spring or springs.

        Raises
        ------
        InputError
            If one of several jumps, or has a memory beside one without polynomial pieces.
        """
        springs = each(spring)
        if len(springs) > 1:  # a loop without friction has no memory
            springs = tuple(simplify(one) for one in springs)
        loop = cls(as_system(system), springs, change)
        for one in springs if len(springs) > 1 else ():
            if jumps(one):
                raise InputError(
                    f'spring: "{one.kind}" jumps, which only the exact flow of straight pieces '
                    "follows, and one beside it has none. Give that one as a table, or use "
                    "`aeroflutter hb`"
                )
        if loop.held.size and loop.pieces is None:
            raise InputError(
                f'spring: "{springs[loop.held[0]].kind}" has a memory, and of one beside it only '
                "values are known. Give that one as a table or a polynomial, or use "
                "`aeroflutter hb`"
            )
        return loop

    @property
    def spring(self) -> Spring | tuple[Spring, ...]:
        """The law, or all of several."""
        return alone(self.springs)

    @cached_property
    def held(self) -> NDArray[np.int64]:
        """Places of the springs with a memory, in the order of z."""
        return np.array([i for i, one in enumerate(self.springs) if _remembers(one)], np.int64)

    @cached_property
    def pieces(self) -> Pieces | None:
        """The laws as polynomial pieces, or None if one is no such thing."""
        tables = [_table(one, alone=len(self.springs) == 1) for one in self.springs]
        known = tuple(table for table in tables if table is not None)
        if len(known) < len(tables):
            return None
        rows = [table.rows.copy() for table in known]
        first = np.cumsum([0, *(len(part) for part in rows[:-1])], dtype=np.int64)
        for part, at in zip(rows, first, strict=True):
            part[:, TO_LOW : TO_TURN + 1] += at
        table = np.vstack(rows)
        powers = max(1, *(len(one.polynomial() or ()) for one in self.springs))
        beta = np.zeros((len(table), powers + 1))
        beta[:, :2] = table[:, [OFFSET, SLOPE]]
        for one, at in zip(self.springs, first, strict=True):
            given = one.polynomial()
            if given is not None:
                beta[at, 1 : 1 + len(given)] = given
        held, system = np.full(len(rows), -1, dtype=np.int64), self.system
        held[self.held] = system.order + np.arange(self.held.size)
        change = self.change or (NOTHING, NOTHING)
        A, B, C, d, dA, dB = (
            np.array(part, dtype=float, order="C")
            for part in (system.A, system.B, system.C, system.load, *change)
        )
        return Pieces(Law(A, B, C, d, dA, dB, beta, table, first, held), known)

    @cached_property
    def _laws(self) -> list[tuple[Callable[[float], float], Callable[[float], float]]]:
        return [(scalar_law(one), slope_law(one)) for one in self.springs]

    def moved(self, step: float) -> SmoothLoop:
        """The loop at a parameter that differs by so much, to first order."""
        if self.change is None:
            return self
        known, (dA, dB) = self.system, self.change
        system = replace(known, A=known.A + step * dA, B=known.B + step * dB)
        return SmoothLoop(system, self.springs)

    # --- points

    def point(self, state: Array, memory: Any) -> Array:
        """z of a state (n,) and the memory of every spring, or one number for all."""
        given = np.broadcast_to(np.asarray(memory, dtype=float), (len(self.springs),))
        return np.append(state, given[self.held])

    def state(self, z: Array) -> Array:
        """x of points (…, N)."""
        return z[..., : self.system.order]

    def memories(self, z: Array) -> Array:
        """Memory of every spring at points (…, N), (…, m)."""
        found = np.zeros((*z.shape[:-1], len(self.springs)))
        found[..., self.held] = z[..., self.system.order :]
        return found

    def y(self, z: Array) -> float:
        """The first output."""
        return float(self.system.C[0] @ self.state(z))

    def outputs(self, z: Array) -> Array:
        """All outputs at a point, (m,)."""
        return np.asarray(self.system.C @ self.state(z))

    def moments(self, z: Array) -> Array:
        """F at a point, (m,)."""
        values = zip(self.outputs(z).tolist(), self.memories(z).tolist(), strict=True)
        return np.array(
            [
                float(one.moment(y, h)) if i in self.held else law(y)
                for i, ((law, _), one, (y, h)) in enumerate(
                    zip(self._laws, self.springs, values, strict=True)
                )
            ]
        )

    def slopes(self, z: Array) -> Array:
        """F' at a point, of a loop where it sticks, (m,)."""
        found = zip(self._laws, self.outputs(z).tolist(), strict=True)
        slopes = np.array([slope(y) for (_, slope), y in found])
        for i in self.held:
            table = self.springs[i].piece_table()
            slopes[i] = table.rows[STICK, SLOPE] if table is not None else 0.0
        return slopes

    def rate(self, z: Array) -> Array:
        """x' at a point, (n,)."""
        system = self.system
        return np.asarray(system.A @ self.state(z) - system.B @ self.moments(z) + system.load)

    def forces(self, points: Array) -> Array:
        """F at points (k, N), (k, m)."""
        outputs, memories = self.system.C @ self.state(points).T, self.memories(points).T
        triples = zip(self.springs, outputs, memories, strict=True)
        return np.column_stack([np.asarray(one.moment(y, h)) for one, y, h in triples])

    def rates(self, points: Array) -> Array:
        """x' at points (k, N), (k, n)."""
        system = self.system
        return np.asarray(
            self.state(points) @ system.A.T - self.forces(points) @ system.B.T + system.load
        )

    def linear(self, z: Array) -> Array:
        """The matrix of small motions about a point, loops sticking, (n, n)."""
        return self.system.closed(self.slopes(z))

    def bend(self, z: Array) -> float:
        """y'' at a point."""
        return float(self.system.C[0] @ self.linear(z) @ self.rate(z))

    def window(self, i: int, z: Array) -> tuple[float, float]:
        """Edges between which a loop sticks at a point."""
        table = self.springs[i].piece_table()
        memory = float(self.memories(z)[i])
        return (-np.inf, np.inf) if table is None else table.window(STICK, memory)

    def sticks(self, z: Array) -> bool:
        """Whether every loop can hold the memory that it has at a point."""
        y = self.outputs(z)
        return all(low <= y[i] <= high for i in self.held for low, high in [self.window(i, z)])

    def rest_near(self, point: Array) -> Array | None:
        """The rest next to a point, (N,), by Newton's method; None if there is none.

        Loops stick: there is none where one of them would have moved.
        """
        z, n = point.copy(), self.system.order
        scales = np.array([one.scale for one in self.springs])
        for _ in range(NEWTON):
            try:
                change = np.linalg.solve(self.linear(z), self.rate(z))
            except np.linalg.LinAlgError:
                return None
            z[:n] -= change
            moved = np.abs(self.system.C @ (z - point)[:n]) / scales
            if not (np.all(np.isfinite(z)) and np.max(moved) < FAR):
                return None
            if np.max(np.abs(change)) <= ROUND_OFF * np.max(np.abs(self.state(point))):
                return z if self.sticks(z) else None
        return None


def jumps(spring: Spring) -> bool:
    """Whether a law jumps."""
    table = spring.piece_table()
    return spring.rate_table() is not None or (table is not None and table.jumps)


def _remembers(spring: Spring) -> bool:
    table = spring.piece_table()
    return table is not None and table.memory


def _table(spring: Spring, *, alone: bool) -> PieceTable | None:
    """The modes of a law, one for a polynomial; of a lone one only if it is that."""
    if spring.polynomial() is not None:
        return PieceTable.static([], [1.0], [0.0])
    return None if alone else spring.piece_table()


def scalar_law(spring: Spring) -> Callable[[float], float]:
    """The moment of one pitch, without the cost of arrays where the law is known."""
    powers = spring.polynomial()
    if powers is not None:
        return lambda y: reduce(lambda value, b: y * (b + value), reversed(powers), 0.0)
    return lambda y: float(spring.moment(y))


def slope_law(spring: Spring) -> Callable[[float], float]:
    """Incremental slope of a law at one pitch."""
    powers = spring.polynomial()
    if powers is not None:
        steep = [i * b for i, b in enumerate(powers, start=1)][::-1]
        return lambda y: reduce(lambda value, b: value * y + b, steep, 0.0)
    step = DIFFERENCE * spring.scale
    law = scalar_law(spring)
    return lambda y: (law(y + step) - law(y - step)) / (2.0 * step)
