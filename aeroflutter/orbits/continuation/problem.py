"""What is followed, how, and what comes out: problem, options, states, branch."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aeroflutter.errors import InputError

Array = NDArray[np.float64]
Scale = float | Array
Test = Callable[[Array, Array], float]
"""A test function of the point and the unit tangent; an event is a change of its sign."""


class Problem(Protocol):
    """A curve in n unknowns. Obligations:

    1. The residual vanishes on the curve and is smooth, or at least Lipschitz.
    2. The Jacobian is its derivative (one-sided at a kink).
    3. Where x has no meaning, either is not finite or raises ConvergenceError; the step is then
       shortened.
    """

    def residual(self, x: Array) -> Array:
        """Value at x, shape (n-1,)."""
        ...

    def jacobian(self, x: Array) -> Array:
        """Derivative at x, shape (n-1, n)."""
        ...


@dataclass(frozen=True, kw_only=True)
class ContinuationOptions:
    """How to walk. Lengths are measured in unknowns divided by `scale`.

    Parameters
    ----------
    step, min_step, max_step
        First, smallest and largest step along the curve.
    max_states
        States after which a walk stops.
    tolerance
        Last Newton update, relative to ``1 + |x|``; the error is of the order of its square.
    settled
        Newton update, likewise, below which a point is left as it is, so that a problem that
        remembers its last points need not be evaluated again.
    max_newton, aim_newton
        Iterations after which a correction has failed, and the number the step aims at.
    max_turn
        Largest angle between consecutive tangents, radians.
    farthest
        Largest distance between consecutive states: what Newton's method finds further off is
        another part of the curve, or another curve. At a corner it may be right.
    locate
        Tolerance on the arclength of located events.
    low, high
        Box, shape (n,) or scalars; the walk ends exactly on its faces.
    scale
        Size of each unknown, shape (n,) or a scalar.
    folds
        Extrema to locate: {"fold": 0} names those of the first unknown.
    closing
        Distance within which a walk has come back to its start.
    """

    step: float = 0.02
    min_step: float = 1e-8
    max_step: float = 0.2
    max_states: int = 2000
    tolerance: float = 1e-10
    settled: float = 1e-16
    max_newton: int = 8
    aim_newton: int = 3
    max_turn: float = 0.35
    farthest: float = np.inf
    locate: float = 1e-13
    low: ArrayLike = -np.inf
    high: ArrayLike = np.inf
    scale: ArrayLike = 1.0
    folds: Mapping[str, int] = field(default_factory=dict)
    closing: float = 1e-6

    def __post_init__(self) -> None:
        problems = [
            f"{entry.name}: must be positive, not {getattr(self, entry.name)!r}"
            for entry in fields(self)
            if entry.type in ("int", "float") and not getattr(self, entry.name) > 0
        ]
        if not problems and not self.min_step <= self.step <= self.max_step:
            span = f"[{self.min_step!r}, {self.max_step!r}]"
            problems.append(f"step: must lie in [min_step, max_step] = {span}, not {self.step!r}")
        if not np.all(np.asarray(self.scale) > 0):
            problems.append(f"scale: every entry must be positive, not {self.scale!r}")
        if not np.all(np.asarray(self.low) < np.asarray(self.high)):
            problems.append("low, high: every low must be below its high")
        if problems:
            raise InputError(problems)


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """A point of the curve.

    Attributes
    ----------
    x, tangent
        Point and tangent along the walk, shape (n,), of unit length in scaled unknowns.
    arclength
        Sum of chords from the start, in scaled unknowns; negative on the way back.
    tests, newton
        Value of every test function; Newton iterations spent.
    corner
        Whether the curve has a corner here, or just before, within `min_step`.
    """

    x: Array
    tangent: Array
    arclength: float = 0.0
    tests: dict[str, float] = field(default_factory=dict)
    newton: int = 0
    corner: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Event:
    """A located zero of a test function; `jump` where it changes sign without a zero."""

    name: str
    x: Array
    tangent: Array
    arclength: float
    jump: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Branch:
    """A traced curve: states and events by ascending arclength.

    Attributes
    ----------
    stops
        Why the curve ends at its first and at its last state.
    closed
        Whether it is a loop; its first point is then repeated at the end.
    """

    states: tuple[State, ...]
    events: tuple[Event, ...]
    stops: tuple[str, str]
    closed: bool

    @property
    def x(self) -> Array:
        """Points, shape (m, n)."""
        return np.array([state.x for state in self.states])
