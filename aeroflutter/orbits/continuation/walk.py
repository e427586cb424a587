"""Walking along a curve: predictor, corrector, events, kinks, the faces of the box."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from aeroflutter.errors import ConvergenceError
from aeroflutter.orbits.continuation.newton import correct, scale_of, show, tangent_at
from aeroflutter.orbits.continuation.problem import (
    Array,
    Branch,
    ContinuationOptions,
    Event,
    Problem,
    State,
    Test,
)

Place = TypeVar("Place", State, Event)

_ON_KINK = 1e-12  # a kink function below this is zero: the walk stands on the kink
_LEVEL = 1e-9  # of a unit tangent: what changes less does not change, and turns by round-off
_BEYOND = 1e-6  # how far beyond a kink its other tangent is taken


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
        self.scale = scale_of(start, self.options)
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

    def _state(
        self, x: Array, tangent: Array, arclength: float, newton: int, only: str = ""
    ) -> State:
        """A state with all its test functions, or with one of them."""
        tests = {only: self.tests[only]} if only else self.tests
        values = {name: float(test(x, tangent)) for name, test in tests.items()}
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
                self.stop = f"{failure}; the step fell to min_step at x = {show(old.x)}"
                return None, step
            step = max(o.min_step, step * max(0.1, min(0.5, o.max_turn / turn)))

    def _try(self, old: State, step: float) -> tuple[State | None, float, str]:
        """One step: the new state, the angle by which the curve has turned, what went wrong."""
        guess = old.x + step * old.tangent
        try:
            new, turn = self._corrected(old, guess)
        except ConvergenceError as error:
            kink = self._landed(old, guess)
            return (None, 1.0, str(error)) if kink is None else (kink, 0.0, "")
        kink = self._first_kink(old, new)
        if kink is None and turn > self.options.max_turn:
            kink = self._landed(old, guess)
        return (new, turn, "") if kink is None else (kink, 0.0, "")

    def _corrected(self, old: State, guess: Array) -> tuple[State, float]:
        x, newton = correct(self.problem, guess, old.tangent / self.scale**2, self.options)
        tangent = tangent_at(self.problem, x, old.tangent, self.scale)
        cosine = np.clip(np.sum(tangent * old.tangent / self.scale**2), -1.0, 1.0)
        chord = float(np.linalg.norm((x - old.x) / self.scale))
        if chord > self.options.farthest:
            raise ConvergenceError("Newton's method went to another part of the curve")
        new = self._state(x, tangent, old.arclength + chord, newton)
        return new, float(np.arccos(cosine))

    def _first_kink(self, old: State, new: State) -> State | None:
        """The kink that a step has crossed first, with the tangent beyond it."""
        landed = self._landed(old, new.x)
        if landed is not None and landed.arclength <= new.arclength:
            return landed
        found = []
        for name in self.kinks:
            if abs(old.tests[name]) > _ON_KINK and old.tests[name] * new.tests[name] < 0:
                state = self._zero(old, new, name)
                found += [(state, name)] if state else []
        if not found:
            return None
        kink, name = min(found, key=lambda entry: entry[0].arclength)
        beyond = kink.x + _BEYOND * (new.x - kink.x)
        tangent = tangent_at(self.problem, beyond, new.x - old.x, self.scale)
        return self._on_kink(kink, tangent, name)

    def _landed(self, old: State, guess: Array) -> State | None:
        """The kink between a state and a guess, if the curve leads there.

        Newton's method is run within the kink itself: beyond it the curve may turn back by more
        than a right angle, where the hyperplane of a step misses it.
        """
        crossed = []
        for name, kink in self.kinks.items():
            here, there = old.tests[name], float(kink(guess, old.tangent))
            if abs(here) > _ON_KINK and here * there < 0:
                crossed.append((here / (here - there), name))
        if not crossed:
            return None
        fraction, name = min(crossed)
        try:
            return self._land(old, old.x + fraction * (guess - old.x), guess, name)
        except ConvergenceError:
            return None

    def _land(self, old: State, x: Array, guess: Array, name: str) -> State | None:
        kink = self.kinks[name]
        for _ in range(self.options.max_newton):
            normal = self._gradient(kink, x, old.tangent)
            across = self.scale**2 * normal / float(np.sum((self.scale * normal) ** 2))
            x = x - float(kink(x, old.tangent)) * across
            x, newton = correct(self.problem, x, normal, self.options)
            if abs(float(kink(x, old.tangent))) < _ON_KINK:
                break
        chord, reach = (float(np.linalg.norm((p - old.x) / self.scale)) for p in (x, guess))
        if chord > 2 * reach or abs(float(kink(x, old.tangent))) > _ON_KINK:
            return None
        ahead = -np.sign(old.tests[name])
        tangent = tangent_at(self.problem, x + ahead * _BEYOND * across, None, self.scale)
        tangent = tangent * (ahead * np.sign(float(normal @ tangent)) or 1.0)
        return self._on_kink(self._state(x, tangent, old.arclength + chord, newton), tangent, name)

    def _gradient(self, kink: Test, x: Array, tangent: Array) -> Array:
        steps = 1e-6 * np.diag(self.scale)
        rise = [float(kink(x + h, tangent)) - float(kink(x - h, tangent)) for h in steps]
        return np.array(rise) / (2e-6 * self.scale)

    def _on_kink(self, state: State, tangent: Array, name: str) -> State:
        tests = self._state(state.x, tangent, 0.0, 0).tests | {name: 0.0}
        return replace(state, tangent=tangent, tests=tests, corner=True)

    def _next_step(self, step: float, newton: int, turn: float) -> float:
        low, high = self.options.min_step, self.options.max_step
        by_newton = 2.0 ** ((self.options.aim_newton - newton) / 2 + 0.25)
        by_turn = 0.5 * self.options.max_turn / turn if turn > 0 else 2.0
        return float(np.clip(step * min(2.0, max(0.5, min(by_newton, by_turn))), low, high))

    def point(self, old: State, new: State, fraction: float) -> tuple[Array, int]:
        """The point of the curve above a fraction of the chord, and the iterations it took."""
        chord = new.x - old.x
        length = new.arclength - old.arclength
        t, r = fraction, 1.0 - fraction
        bulge = r * (length * old.tangent - chord) + t * (chord - length * new.tangent)
        guess = r * old.x + t * new.x + t * r * bulge
        normal = chord / self.scale**2
        guess = guess + chord * float(normal @ (old.x + t * chord - guess)) / float(normal @ chord)
        return correct(self.problem, guess, normal, self.options)

    def between(self, old: State, new: State, fraction: float, only: str = "") -> State:
        """The state of the curve above a fraction of the chord from `old` to `new`.

        Of the test functions, which may be costly, `only` one is evaluated if it is named.
        """
        if fraction in (0.0, 1.0):
            return new if fraction else old
        x, newton = self.point(old, new, fraction)
        tangent = tangent_at(self.problem, x, old.tangent, self.scale)
        walked = float(np.linalg.norm((x - old.x) / self.scale))
        return self._state(x, tangent, old.arclength + walked, newton, only)

    def _zero(self, old: State, new: State, name: str) -> State | None:
        return self._root(old, new, lambda state: state.tests[name], name)

    def _root(
        self, old: State, new: State, value: Callable[[State], float], only: str = ""
    ) -> State | None:
        """The state between two others where `value` changes sign, or None."""
        at: dict[float, State] = {}

        def f(fraction: float) -> float:
            at[fraction] = self.between(old, new, fraction, only)
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
            size = max(abs(old.tests[name]), abs(new.tests[name]))
            if name in self.options.folds and size < _LEVEL:
                continue
            state = self._zero(old, new, name)
            if state is None:
                continue
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
