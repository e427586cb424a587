"""A loop of laws without memory, as the engines of series and DOP853 see it.

Polynomials are one piece; of several springs those of straight pieces are as many as they have.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, reduce
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from aeroflutter.errors import InputError
from aeroflutter.model.lure import as_system
from aeroflutter.springs import alone, each
from aeroflutter.springs._kernel_columns import HIGH, LOW, OFFSET, SLOPE

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from aeroflutter.model.lure import AnySystem
    from aeroflutter.model.system import System
    from aeroflutter.springs import Spring, Springs

    Array = NDArray[np.float64]

__all__ = ["Pieces", "SmoothLoop", "forgetful", "scalar_law", "slope_law"]

NEWTON = 30
ROUND_OFF = 1e-12  # of a rest, in the size of the state that it is looked for from
FAR = 10.0  # scales of the laws, beyond which a rest is not next to a state
DIFFERENCE = 6e-6  # cube root of round-off: the best step of a central difference


class Pieces(NamedTuple):
    """Laws of polynomial pieces; see `_kernel_taylor`.

    Attributes
    ----------
    beta, edges
        A row a piece: coefficients from the constant on, and the ends of y.
    first
        Row of each spring's lowest piece, (m,).
    """

    beta: Array
    edges: Array
    first: NDArray[np.int64]

    def rows(self, y: Array) -> NDArray[np.int64]:
        """The piece that each output is on."""
        ends = np.append(self.first[1:], len(self.beta))
        return np.array(
            [
                first + np.searchsorted(self.edges[first : end - 1, 1], at)
                for first, end, at in zip(self.first, ends, y, strict=True)
            ],
            dtype=np.int64,
        )


@dataclass(frozen=True, eq=False)
class SmoothLoop:
    """x' = A x - B F(C x) + d, F one law without memory an output.

    Attributes
    ----------
    system, springs
        The two; y, of which turning points are asked, is the first output.
    """

    system: System
    springs: tuple[Spring, ...]

    @classmethod
    def of(cls, system: AnySystem, spring: Springs) -> SmoothLoop:
        """The loop of a system and its spring or springs.

        Raises
        ------
        InputError
            If one of several has a memory or jumps.
        """
        springs = each(spring)
        for one in springs if len(springs) > 1 else ():
            if not forgetful(one):
                raise InputError(
                    f'spring: "{one.kind}" has a memory or jumps, which the exact flow of straight '
                    "pieces follows, and one beside it has no straight pieces, for which there are "
                    "series: no engine does both. Give that one as a table, or use `aeroflutter hb`"
                )
        return cls(as_system(system), springs)

    @property
    def spring(self) -> Spring | tuple[Spring, ...]:
        """The law, or all of several."""
        return alone(self.springs)

    @cached_property
    def pieces(self) -> Pieces | None:
        """The laws as polynomial pieces, or None if one is no such thing."""
        tables = [_pieces(one, alone=len(self.springs) == 1) for one in self.springs]
        if any(table is None for table in tables):
            return None
        known = [table for table in tables if table is not None]
        width = max(beta.shape[1] for beta, _ in known)
        rows = [np.pad(beta, ((0, 0), (0, width - beta.shape[1]))) for beta, _ in known]
        first = np.cumsum([0, *(len(beta) for beta in rows[:-1])])
        edges = np.vstack([ends for _, ends in known])
        return Pieces(np.ascontiguousarray(np.vstack(rows)), np.ascontiguousarray(edges), first)

    @cached_property
    def _laws(self) -> list[tuple[Callable[[float], float], Callable[[float], float]]]:
        return [(scalar_law(one), slope_law(one)) for one in self.springs]

    def y(self, x: Array) -> float:
        """The first output."""
        return float(self.system.C[0] @ x)

    def moments(self, y: Array) -> Array:
        """F at outputs (m,)."""
        return np.array([law(at) for (law, _), at in zip(self._laws, y.tolist(), strict=True)])

    def slopes(self, y: Array) -> Array:
        """F' at outputs (m,)."""
        return np.array([slope(at) for (_, slope), at in zip(self._laws, y.tolist(), strict=True)])

    def rate(self, x: Array) -> Array:
        """x' at a state (n,)."""
        system = self.system
        return np.asarray(system.A @ x - system.B @ self.moments(system.C @ x) + system.load)

    def forces(self, states: Array) -> Array:
        """F at states (k, n), (k, m)."""
        outputs = self.system.C @ states.T
        pairs = zip(self.springs, outputs, strict=True)
        return np.column_stack([np.asarray(one.moment(y)) for one, y in pairs])

    def rates(self, states: Array) -> Array:
        """x' at states (k, n)."""
        system = self.system
        return np.asarray(states @ system.A.T - self.forces(states) @ system.B.T + system.load)

    def linear(self, x: Array) -> Array:
        """The matrix of small motions about a state, (n, n)."""
        return self.system.closed(self.slopes(self.system.C @ x))

    def bend(self, x: Array) -> float:
        """y'' at a state."""
        return float(self.system.C[0] @ self.linear(x) @ self.rate(x))

    def rest_near(self, state: Array) -> Array | None:
        """The rest next to a state, (n,), by Newton's method; None if there is none."""
        x, scales = state.copy(), np.array([one.scale for one in self.springs])
        for _ in range(NEWTON):
            try:
                change = np.linalg.solve(self.linear(x), self.rate(x))
            except np.linalg.LinAlgError:
                return None
            x = x - change
            moved = np.abs(self.system.C @ (x - state)) / scales
            if not (np.all(np.isfinite(x)) and np.max(moved) < FAR):
                return None
            if np.max(np.abs(change)) <= ROUND_OFF * np.max(np.abs(state)):
                return x
        return None


def forgetful(spring: Spring) -> bool:
    """Whether a law has neither memory nor jumps."""
    table = spring.piece_table()
    jumps = spring.rate_table() is not None
    return not jumps and (table is None or not (table.remembers or table.jumps))


def _pieces(spring: Spring, *, alone: bool) -> tuple[Array, Array] | None:
    """Coefficients and ends of the pieces of a law; of a lone one only if it is a polynomial."""
    powers = spring.polynomial()
    if powers is not None:
        return np.array([[0.0, *powers]]), np.array([[-np.inf, np.inf]])
    table = spring.piece_table()
    if table is None or alone:
        return None
    return table.rows[:, [OFFSET, SLOPE]], table.rows[:, [LOW, HIGH]]


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
