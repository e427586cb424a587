"""Pseudo-arclength continuation of the curve residual(x) = 0 of n-1 equations in n unknowns.

The predictor is the tangent, the corrector Newton's method on the hyperplane through the
prediction (Keller 1977). The step follows the number of Newton iterations and the angle by
which the curve turns. Folds and zeros of test functions are bracketed by consecutive states and
then located *on the curve*, by Brent's method along the chord with every trial point corrected.
A curve that turns sharply (by less than a right angle) has a corner there and is followed
around it; where the places of corners are known as zeros of `kinks`, it is led through them with
a tangent from either side. Nothing here knows what the unknowns mean.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

from aeroflutter.errors import ConvergenceError, InputError

Array = NDArray[np.float64]
Scale = float | Array
Test = Callable[[Array, Array], float]
"""A test function of the point and the unit tangent; an event is a change of its sign."""

_ON_KINK = 1e-12  # a kink function below this is zero: the walk stands on the kink


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
        Last Newton update, relative to 1 + |x|; the error is of the order of its square.
    max_newton, aim_newton
        Iterations after which a correction has failed, and the number the step aims at.
    max_turn
        Largest angle between consecutive tangents, radians.
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
    max_newton: int = 8
    aim_newton: int = 3
    max_turn: float = 0.35
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


Place = TypeVar("Place", State, Event)


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


def correct(
    problem: Problem,
    x: ArrayLike,
    direction: ArrayLike | None = None,
    options: ContinuationOptions | None = None,
) -> tuple[Array, int]:
    """Newton's method onto the curve, in the hyperplane through `x` normal to `direction`.

    Without a direction every update is the shortest one (Gauss-Newton).

    Returns
    -------
    x, iterations

    Raises
    ------
    ConvergenceError
        After `max_newton` iterations, or where the problem is undefined or singular.
    """
    options = options or ContinuationOptions()
    scale = _scale(x, options)
    point = np.array(x, dtype=float)
    for iteration in range(1, options.max_newton + 1):
        update = scale * _newton_update(problem, point, direction, scale)
        point = point + update
        size = np.linalg.norm(update / scale)
        if not np.isfinite(size):
            break
        if size <= options.tolerance * (1.0 + np.linalg.norm(point / scale)):
            return point, iteration
    raise ConvergenceError(f"Newton's method did not converge near x = {_show(x)}", point)


def tangent_at(problem: Problem, x: Array, along: Array | None = None, scale: Scale = 1.0) -> Array:
    """Unit tangent at a point of the curve, on the side of `along` where it is given."""
    try:
        if along is None:
            vector = np.linalg.svd(problem.jacobian(x) * scale)[2][-1]
        else:
            vector = np.linalg.solve(_bordered(problem, x, along, scale), np.eye(x.size)[-1])
    except np.linalg.LinAlgError:
        raise ConvergenceError(f"the curve has no tangent at x = {_show(x)}", x) from None
    return np.asarray(scale * vector / np.linalg.norm(vector))


def branch_test(problem: Problem, scale: Scale = 1.0) -> Test:
    """Test function whose simple zeros are branch points: det of Jacobian and tangent."""
    return lambda x, tangent: float(np.linalg.det(_bordered(problem, x, tangent, scale)))


def branch_direction(problem: Problem, x: Array, tangent: Array, scale: Scale = 1.0) -> Array:
    """At a simple branch point, the direction in the Jacobian's null space across the tangent.

    At a symmetric pitchfork it is the tangent of the other branch; elsewhere a start for it.
    """
    return np.asarray(scale * np.linalg.svd(_bordered(problem, x, tangent, scale))[2][-1])


def _bordered(problem: Problem, x: Array, row: Array, scale: Scale) -> Array:
    return np.vstack((problem.jacobian(x) * scale, row / scale))


class Walk:
    """Iterator over the states of a curve in one direction.

    Parameters
    ----------
    start
        A point near the curve, shape (n,).
    along
        Direction in which to leave it; by default the one of the null vector.
    tests
        Test functions by name.
    kinks
        Functions of order one, at whose zeros the problem is not smooth; events as well.

    Attributes
    ----------
    stop, closed
        Why the walk ended (empty while it goes on); whether it came back to its start.
    events
        Events located so far.
    """

    def __init__(
        self,
        problem: Problem,
        start: ArrayLike,
        along: ArrayLike | None = None,
        options: ContinuationOptions | None = None,
        tests: Mapping[str, Test] | None = None,
        kinks: Mapping[str, Test] | None = None,
    ) -> None:
        self.problem = problem
        self.options = options or ContinuationOptions()
        folds = {
            name: lambda x, tangent, index=index: float(tangent[index])
            for name, index in self.options.folds.items()
        }
        self.kinks = dict(kinks or {})
        self.tests = {**(tests or {}), **folds, **self.kinks}
        self.stop, self.closed = "", False
        self.events: list[Event] = []
        self.scale = _scale(start, self.options)
        side = None if along is None else np.asarray(along, dtype=float)
        normal = None if side is None else side / self.scale**2
        x, newton = correct(problem, start, normal, self.options)
        tangent = tangent_at(problem, x, side, self.scale)
        self.first = self._state(x, tangent, 0.0, newton)

    def __iter__(self) -> Iterator[State]:
        state, step = self.first, self.options.step
        yield state
        count = 1
        while not self.stop and count < self.options.max_states:
            new, step = self._advance(state, step)
            if new is None:
                break
            new = self._close(state, self._end_on_box(state, new))
            self.events += self._locate_all(state, new)
            yield new
            state, count = new, count + 1
        if not self.stop:
            self.stop = f"max_states = {self.options.max_states} reached"

    def _state(self, x: Array, tangent: Array, arclength: float, newton: int) -> State:
        values = {name: float(test(x, tangent)) for name, test in self.tests.items()}
        return State(x, tangent, arclength, values, newton)

    def _advance(self, old: State, step: float) -> tuple[State | None, float]:
        """The next state, and the step to try after it."""
        o = self.options
        while True:
            new, turn, failure = self._try(old, step)
            if new is not None and turn <= o.max_turn:
                return new, self._next_step(step, new.newton, turn)
            if new is not None and step <= o.min_step:
                return replace(new, corner=True), o.step
            if step <= o.min_step:
                self.stop = f"{failure}; the step fell to min_step at x = {_show(old.x)}"
                return None, step
            step = max(o.min_step, step * max(0.1, min(0.5, o.max_turn / turn)))

    def _try(self, old: State, step: float) -> tuple[State | None, float, str]:
        try:
            guess = old.x + step * old.tangent
            x, newton = correct(self.problem, guess, old.tangent / self.scale**2, self.options)
            tangent = tangent_at(self.problem, x, old.tangent, self.scale)
        except ConvergenceError as error:
            return None, 1.0, str(error)
        cosine = np.clip(np.sum(tangent * old.tangent / self.scale**2), -1.0, 1.0)
        chord = float(np.linalg.norm((x - old.x) / self.scale))
        new = self._state(x, tangent, old.arclength + chord, newton)
        kink = self._first_kink(old, new)
        return (new, float(np.arccos(cosine)), "") if kink is None else (kink, 0.0, "")

    def _first_kink(self, old: State, new: State) -> State | None:
        """The kink that a step crosses first, with the tangent beyond it."""
        found = []
        for name in self.kinks:
            if abs(old.tests[name]) > _ON_KINK and old.tests[name] * new.tests[name] < 0:
                state = self._zero(old, new, name)
                found += [(state, name)] if state else []
        if not found:
            return None
        kink, name = min(found, key=lambda entry: entry[0].arclength)
        beyond = kink.x + 1e-6 * (new.x - kink.x)
        tangent = tangent_at(self.problem, beyond, new.x - old.x, self.scale)
        tests = self._state(kink.x, tangent, 0.0, 0).tests | {name: 0.0}
        return replace(kink, tangent=tangent, tests=tests, corner=True)

    def _next_step(self, step: float, newton: int, turn: float) -> float:
        low, high = self.options.min_step, self.options.max_step
        by_newton = 2.0 ** ((self.options.aim_newton - newton) / 2 + 0.25)
        by_turn = 0.5 * self.options.max_turn / turn if turn > 0 else 2.0
        return float(np.clip(step * min(2.0, max(0.5, min(by_newton, by_turn))), low, high))

    def between(self, old: State, new: State, fraction: float) -> State:
        """The point of the curve above a fraction of the chord from `old` to `new`."""
        if fraction in (0.0, 1.0):
            return new if fraction else old
        chord = new.x - old.x
        length = new.arclength - old.arclength
        t, r = fraction, 1.0 - fraction
        bulge = r * (length * old.tangent - chord) + t * (chord - length * new.tangent)
        guess = r * old.x + t * new.x + t * r * bulge
        normal = chord / self.scale**2
        guess = guess + chord * float(normal @ (old.x + t * chord - guess)) / float(normal @ chord)
        x, newton = correct(self.problem, guess, normal, self.options)
        tangent = tangent_at(self.problem, x, old.tangent, self.scale)
        walked = float(np.linalg.norm((x - old.x) / self.scale))
        return self._state(x, tangent, old.arclength + walked, newton)

    def _zero(self, old: State, new: State, name: str) -> State | None:
        return self._root(old, new, lambda state: state.tests[name])

    def _root(self, old: State, new: State, value: Callable[[State], float]) -> State | None:
        """The state between two others where `value` changes sign, or None."""
        at: dict[float, State] = {}

        def f(fraction: float) -> float:
            at[fraction] = self.between(old, new, fraction)
            return value(at[fraction])

        ends = value(old), value(new)
        if not np.all(np.isfinite(ends)) or ends[0] * ends[1] > 0 or ends[0] == 0:
            return None
        if ends[1] == 0:
            return new
        xtol = max(self.options.locate / max(new.arclength - old.arclength, 1e-300), 1e-15)
        try:
            fraction = brentq(f, 0.0, 1.0, xtol=min(xtol, 0.1), rtol=8.9e-16)
        except ConvergenceError:
            return None
        return at[fraction]

    def _locate_all(self, old: State, new: State) -> list[Event]:
        found = []
        for name in self.tests:
            state = self._zero(old, new, name)
            if state is None:
                continue
            size = max(abs(old.tests[name]), abs(new.tests[name]))
            jump = name in self.kinks or bool(abs(state.tests[name]) > 1e-3 * size)
            found.append(Event(name, state.x, state.tangent, state.arclength, jump))
        return sorted(found, key=lambda event: event.arclength)

    def _end_on_box(self, old: State, new: State) -> State:
        """Where the step leaves the box, the state on the face that it crosses first."""
        low = np.broadcast_to(np.asarray(self.options.low, dtype=float), new.x.shape)
        high = np.broadcast_to(np.asarray(self.options.high, dtype=float), new.x.shape)
        faces = [(i, low[i]) for i in np.flatnonzero(new.x <= low)]
        faces += [(i, high[i]) for i in np.flatnonzero(new.x >= high)]
        if not faces:
            return new
        ends = []
        for i, bound in faces:
            state = self._root(old, new, lambda s, i=i, bound=bound: s.x[i] - bound)  # type: ignore[misc]
            ends.append((self._put_on(state or new, int(i), bound), i, bound))
        state, i, bound = min(ends, key=lambda end: end[0].arclength)
        self.stop = f"unknown {i} reached its limit {bound:g}"
        return state

    def _put_on(self, state: State, i: int, bound: float) -> State:
        """The state moved along the curve by round-off, exactly onto a face."""
        x = state.x.copy()
        x[i] = bound
        try:
            x, _ = correct(self.problem, x, np.eye(x.size)[i], self.options)
        except ConvergenceError:
            return state
        x[i] = bound
        return replace(state, x=x)

    def _close(self, old: State, new: State) -> State:
        """Where the step passes through the start of the walk, the closing state."""
        start, normal = self.first, self.first.tangent / self.scale**2

        def ahead(state: State) -> float:
            return float(normal @ (state.x - start.x))

        def apart(state: State) -> float:
            return float(np.linalg.norm((state.x - start.x) / self.scale))

        near = apart(new) <= 2 * (new.arclength - old.arclength)
        if old is start or not near or not ahead(old) < 0 <= ahead(new):
            return new
        state = self._root(old, new, ahead)
        if state is None or apart(state) > self.options.closing:
            return new
        self.stop, self.closed = "the curve closed", True
        return state


def trace(
    problem: Problem,
    start: ArrayLike,
    options: ContinuationOptions | None = None,
    tests: Mapping[str, Test] | None = None,
    kinks: Mapping[str, Test] | None = None,
) -> Branch:
    """Follow the curve through `start` both ways.

    A closed curve is walked once.

    Raises
    ------
    ConvergenceError
        If `start` cannot be corrected onto the curve. A walk that cannot go on is no error.
    """
    ahead = Walk(problem, start, None, options, tests, kinks)
    states = list(ahead)
    if ahead.closed:
        return Branch(tuple(states), tuple(ahead.events), (ahead.stop, ahead.stop), True)
    first = ahead.first
    back = Walk(problem, first.x, -first.tangent, options, tests, kinks)
    behind = [_reversed(state) for state in back]
    events = [_reversed(event) for event in back.events[::-1]]
    return Branch(
        tuple(behind[:0:-1] + states), tuple(events + ahead.events), (back.stop, ahead.stop), False
    )


def _reversed(place: Place) -> Place:
    return replace(place, tangent=-place.tangent, arclength=-place.arclength)


def _scale(x: ArrayLike, options: ContinuationOptions) -> Array:
    return np.broadcast_to(np.asarray(options.scale, dtype=float), np.shape(x))


def _newton_update(
    problem: Problem, point: Array, direction: ArrayLike | None, scale: Array
) -> Array:
    """Scaled Newton update; not finite where the problem is."""
    residual, jacobian = problem.residual(point), problem.jacobian(point) * scale
    if not (np.all(np.isfinite(residual)) and np.all(np.isfinite(jacobian))):
        return np.full(point.shape, np.nan)
    try:
        if direction is None:
            return np.asarray(-np.linalg.lstsq(jacobian, residual)[0])
        row = np.asarray(direction, dtype=float) * scale
        matrix = np.vstack((jacobian, row / np.linalg.norm(row)))
        return np.asarray(np.linalg.solve(matrix, -np.append(residual, 0.0)))
    except np.linalg.LinAlgError:
        return np.full(point.shape, np.nan)


def _show(x: ArrayLike) -> str:
    return "(" + ", ".join(f"{value:.6g}" for value in np.asarray(x, dtype=float)) + ")"
