"""Chaos over a parameter: peaks against speed or damping, and the edges of chaotic bands."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from aeroflutter.analysis import Result
from aeroflutter.errors import InputError
from aeroflutter.motion.chaos.verdict import ChaosResult, chaos
from aeroflutter.motion.response import Initial

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

    from aeroflutter.model.lure import AnySystem
    from aeroflutter.motion.chaos.options import ChaosOptions
    from aeroflutter.springs import Springs

    Array = NDArray[np.float64]
    Systems = Callable[[float], AnySystem]

__all__ = ["Band", "ChaosScan", "Edge", "band_edge", "chaos_scan"]


class Edge(NamedTuple):
    """Two neighbouring values of the parameter, one outside chaos and one inside."""

    outside: float
    inside: float


class Band(NamedTuple):
    """Neighbouring values with chaos; an edge is None where the scan begins or ends in it."""

    first: float
    last: float
    lower: Edge | None
    upper: Edge | None


@dataclass(frozen=True, kw_only=True)
class ChaosScan(Result):
    """Verdicts over a parameter.

    Attributes
    ----------
    values
        Of the parameter, (m,).
    results
        One a value.
    """

    values: Array
    results: tuple[ChaosResult, ...] = field(repr=False)

    @property
    def verdicts(self) -> tuple[str, ...]:
        """One a value."""
        return tuple(result.verdict for result in self.results)

    @property
    def exponents(self) -> Array:
        """Lyapunov exponents, (m, k)."""
        return np.array([result.exponents.values for result in self.results])

    @property
    def errors(self) -> Array:
        """Their stated errors, (m, k)."""
        return np.array([result.exponents.error for result in self.results])

    @property
    def bands(self) -> tuple[Band, ...]:
        """Runs of neighbouring values that are chaotic, in ascending order."""
        order = np.argsort(self.values)
        values = self.values[order]
        inside = np.array([self.results[i].verdict == "chaotic" for i in order], dtype=int)
        steps = np.diff(inside, prepend=0, append=0)
        found = []
        for i, j in zip(np.flatnonzero(steps == 1), np.flatnonzero(steps == -1) - 1, strict=True):
            first, last = float(values[i]), float(values[j])
            lower = Edge(float(values[i - 1]), first) if i > 0 else None
            upper = Edge(float(values[j + 1]), last) if j + 1 < values.size else None
            found.append(Band(first, last, lower, upper))
        return tuple(found)


def chaos_scan(
    at: Systems,
    values: ArrayLike,
    spring: Springs,
    initial: Initial | None = None,
    options: ChaosOptions | None = None,
    *,
    follow: bool = False,
    progress: Callable[[float], None] | None = None,
) -> ChaosScan:
    """Verdicts over a parameter.

    Parameters
    ----------
    at
        The system at a value of the parameter, as `family.at` is for the speed.
    values
        Where to look, (m,).
    spring, initial, options
        As for `chaos`.
    follow
        Start each motion where the one before ended, to stay with its attractor, unless it came
        to rest or diverged; otherwise all start from `initial`.
    progress
        Called with the fraction done.

    Raises
    ------
    InputError
        If there are no values.
    """
    values = np.atleast_1d(np.asarray(values, dtype=float))
    if values.size == 0:
        raise InputError("values: there are none; give at least one")
    results: list[ChaosResult] = []
    start = initial
    for i, value in enumerate(values):
        result = chaos(at(float(value)), spring, start, options)
        results.append(result)
        moving = result.verdict not in ("damped", "divergent")
        if follow:
            start = _onward(result) if moving else initial
        if progress:
            progress((i + 1) / values.size)
    return ChaosScan(values=values, results=tuple(results))


def _onward(result: ChaosResult) -> Initial:
    return Initial(state=result.final_state, memory=result.final_memory)


def band_edge(
    at: Systems,
    edge: Edge,
    spring: Springs,
    initial: Initial | None = None,
    options: ChaosOptions | None = None,
    steps: int = 10,
) -> Edge:
    """Halve the gap between a value without chaos and one with it.

    Between the two there may be more edges than one, windows of periodic motion: halving finds
    one of them.

    Parameters
    ----------
    at, spring, initial, options
        As for `chaos_scan`.
    edge
        Between which values.
    steps
        Halvings.
    """
    outside, inside = edge
    for _ in range(steps):
        middle = 0.5 * (outside + inside)
        if chaos(at(middle), spring, initial, options).verdict == "chaotic":
            inside = middle
        else:
            outside = middle
    return Edge(outside, inside)
