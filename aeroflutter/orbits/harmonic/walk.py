"""Following a family of cycles: where the harmonics suffice, round sharp corners, to its ends."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aeroflutter.errors import ConvergenceError
from aeroflutter.orbits.continuation import (
    ContinuationOptions,
    Event,
    State,
    Test,
    Walk,
    tangent_at,
)
from aeroflutter.orbits.harmonic.balance import Balance
from aeroflutter.springs import Hysteresis

__all__ = ["Curve", "TooFewHarmonics", "follow"]

Real = NDArray[np.float64]

CORNERS = ("corner", "lower corner")
_TURNS = 4  # sharp corners turned on one walk
_PROBES = (1e-8, 1e-7, 1e-6, 1e-5, 1e-4)
_LEAVE = 1e-3  # first step away from a sharp corner


class TooFewHarmonics(Exception):
    """The harmonics left out matter at some state.

    Parameters
    ----------
    truncation
        Estimate of what is left out.
    state
        Where it was met.
    """

    def __init__(self, truncation: float, state: State) -> None:
        super().__init__(truncation)
        self.truncation, self.state = truncation, state


@dataclass(frozen=True, eq=False)
class Curve:
    """States and events along a family of cycles, and why it ends at either side."""

    states: tuple[State, ...]
    events: tuple[Event, ...]
    stops: tuple[str, str]
    closed: bool


def follow(
    balance: Balance,
    start: Real,
    options: ContinuationOptions,
    tests: Mapping[str, Test],
    tolerance: float,
    along: Real | None = None,
) -> Curve:
    """Follow the cycles through `start` both ways, or one way where `along` is given.

    Raises
    ------
    TooFewHarmonics
        As soon as the estimated truncation of a state exceeds `tolerance`.
    ConvergenceError
        If `start` does not converge.
    """
    ahead = _Side(balance, start, along, options, tests, tolerance)
    if ahead.closed or along is not None or not ahead.states:
        return Curve(tuple(ahead.states), tuple(ahead.events), ("start", ahead.stop), ahead.closed)
    first = ahead.states[0]
    behind = _Side(balance, first.x, -first.tangent, options, tests, tolerance)
    states = [replace(s, tangent=-s.tangent, arclength=-s.arclength) for s in behind.states]
    events = [replace(e, tangent=-e.tangent, arclength=-e.arclength) for e in behind.events]
    return Curve(
        tuple(states[:0:-1] + ahead.states),
        tuple(events[::-1] + ahead.events),
        (behind.stop, ahead.stop),
        False,
    )


class _Side:
    """The walk to one side, in as many pieces as there are sharp corners."""

    def __init__(
        self,
        balance: Balance,
        start: Real,
        along: Real | None,
        options: ContinuationOptions,
        tests: Mapping[str, Test],
        tolerance: float,
    ) -> None:
        self.balance, self.options, self.tolerance = balance, options, tolerance
        self.tests, self.kinks = tests, kinks(balance)
        self.states: list[State] = []
        self.events: list[Event] = []
        self.stop, self.closed = "", False
        walk: Walk | None = self._walk(start, along)
        for _ in range(_TURNS):
            if walk is None:
                break
            walk = self._run(walk)

    def _walk(self, start: Real, along: Real | None) -> Walk:
        return Walk(self.balance, start, along, self.options, self.tests, self.kinks)

    def _run(self, walk: Walk) -> Walk | None:
        """Take the states of a walk; the walk beyond, if it ends at a sharp corner."""
        offset = self.states[-1].arclength if self.states else 0.0
        for state in walk:
            if self.balance.straight(state.x):
                self.stop = "the motion stays on one straight piece of the spring"
                break
            truncation = self.balance.truncation(state.x)
            if truncation > self.tolerance:
                raise TooFewHarmonics(truncation, state)
            self.states.append(replace(state, arclength=state.arclength + offset))
        else:
            self.stop, self.closed = walk.stop, walk.closed
        self.events += [replace(e, arclength=e.arclength + offset) for e in walk.events]
        if "min_step" not in self.stop or not self.states:
            return None
        return self._round_corner(self.states[-1])

    def _round_corner(self, state: State) -> Walk | None:
        """A walk that leaves a corner where the curve turns back by more than a right angle.

        The equations differ on either side of it: the tangent just beyond gives the direction,
        and only a walk whose cycles switch in another sequence has left.
        """
        sequence = self.balance.sequence(state.x)
        for probe in _PROBES:
            beyond = state.x + probe * state.tangent
            if self.balance.sequence(beyond) != sequence:
                break
        else:
            return None
        tangent = tangent_at(self.balance, beyond)
        for direction in (tangent, -tangent):
            try:
                walk = self._walk(beyond + _LEAVE * direction, direction)
            except ConvergenceError:
                continue
            if self.balance.sequence(walk.first.x) != sequence:
                self.states[-1] = replace(state, corner=True)
                self.events.append(Event(CORNERS[0], state.x, state.tangent, state.arclength, True))
                return walk
        return None


def is_corner(name: str) -> bool:
    """Whether an event of a walk is one of the `kinks`."""
    return name.partition(" of ")[0] in CORNERS


def kinks(balance: Balance) -> dict[str, Test]:
    """Where the equations have a corner: a slider turns back exactly at one of its stops."""
    found: dict[str, Test] = {}
    for i, spring in enumerate(balance.springs):
        if isinstance(spring, Hysteresis):
            behind = f" of spring {i + 1}" if len(balance.springs) > 1 else ""
            tests = _stops(balance, i, spring)[: 1 if balance.symmetric else 2]
            found |= {name + behind: test for name, test in zip(CORNERS, tests, strict=False)}
    return found


def _stops(balance: Balance, i: int, spring: Hysteresis) -> tuple[Test, Test]:
    """How far y of spring i goes beyond the upper stop, and the lower one short of its own."""

    def top(x: Real, _: Real) -> float:
        reach = balance.answers(x)[i].extremes[1] - spring.v1 - spring.h_high
        return float(reach / spring.scale)

    def bottom(x: Real, _: Real) -> float:
        reach = balance.answers(x)[i].extremes[0] - spring.v2 - spring.h_low
        return float(reach / spring.scale)

    return top, bottom
