"""Following one family of cycles in one direction, leg by leg.

A cycle grows by decades along its family, and the place where it is best started moves; so the walk
is cut into legs, each with its own starting place and units.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from aeroflutter.errors import ConvergenceError
from aeroflutter.orbits.continuation import State, correct
from aeroflutter.orbits.cycles.leg import (
    STALLED,
    Leg,
    changes,
    located,
    start_leg,
    turned,
)
from aeroflutter.orbits.cycles.measure import Frame, cycle_at
from aeroflutter.orbits.cycles.options import CycleOptions
from aeroflutter.orbits.cycles.result import Cycle
from aeroflutter.orbits.cycles.shooting import Shooting

__all__ = [
    "BACK",
    "FAILURES",
    "LARGEST",
    "NOT_ENTERED",
    "Place",
    "Strand",
    "between",
    "crossing",
    "follow",
    "level",
    "meeting",
    "same",
]

Array = NDArray[np.float64]

_PERIOD, _SPEED = -2, -1  # places among the unknowns

_GROWTH = 1.6  # a leg ends when the cycle has grown or shrunk by this
_SAME = 1e-6  # relative difference between two measurements of one cycle
_CLOSE = 1e-11  # closure of a cycle
_CRAWL = 1e-8  # a step this short that does not close stands at a corner
_BEYOND = 1e-4  # first step beyond a corner: another part of the curve may be near
_COINCIDE = 1e-6  # distance within which a corner and a change of sequence are one event

BACK = "the family comes back to the one it branched from"
NOT_ENTERED = "the other side of the first cycle could not be entered"
_LINEAR = "the spring no longer switches: cycles of a linear system, of any amplitude"
_HOPF = "the cycles shrink to rest: a Hopf bifurcation"
_SHRUNK = 1e-3  # of the spring's scale, below which cycles of a smooth spring are all alike
_CLOSED = "the curve closes"
LARGEST = "the amplitude has reached"
_MANY = "cycles were followed"
_NO_START = "the cycle could not be started from elsewhere"
_BROKEN = "what follows cannot be told"
FAILURES = (STALLED, _MANY, _NO_START, _BROKEN, NOT_ENTERED)
"""Reasons for which a strand ends before its curve does."""


@dataclass(frozen=True, eq=False)
class Place:
    """A cycle on a strand.

    Attributes
    ----------
    at
        Distance along the strand.
    leg, state, cycle
        Where it was found, and what it is.
    kind
        What happens there, if anything.
    seam
        Whether it only repeats the place before it, in the units of the next leg.
    """

    at: float
    leg: Leg
    state: State
    cycle: Cycle
    kind: str = ""
    seam: bool = False


@dataclass(eq=False)
class Strand:
    """A family followed in one direction; `stop` says why it ended."""

    places: list[Place] = field(default_factory=list)
    stop: str = ""
    closed: bool = False

    def add(self, leg: Leg, state: State, kind: str = "", *, seam: bool = False) -> Place:
        """Add the cycle at a state."""
        place = Place(leg.offset + state.arclength, leg, state, leg.cycle(state), kind, seam)
        self.places.append(place)
        return place

    @property
    def end(self) -> Place:
        """Where it has got to."""
        return self.places[-1]

    @property
    def middle(self) -> Place:
        """A place well inside it."""
        return self.places[len(self.places) // 2]


def follow(
    frame: Frame,
    shooting: Shooting,
    q: Array,
    along: Array | None,
    options: CycleOptions,
    *,
    halves: tuple[float, ...] = (),
    watch: Callable[[Cycle], None] = lambda cycle: None,
) -> Strand:
    """Follow a family in one direction until it ends.

    Parameters
    ----------
    q, along
        A cycle, or a guess of one, and the direction in which to leave it (None to choose one).
    halves
        Signs s for which the family may end where z(T/2) = s z: on the one from which it branched.
    watch
        Called with every cycle found.

    Returns
    -------
    Strand
        Never an error for a family that cannot be followed further: `stop` says where and why.

    Raises
    ------
    ConvergenceError
        If there is no cycle near q.
    """
    strand = Strand()
    leg = start_leg(frame, shooting, q, along, options, halves=halves)
    strand.add(leg, leg.walk.first)
    turned_at = -np.inf
    while not strand.stop:
        try:
            q, along = _walk(leg, strand, options, watch)
            corner = _corner(leg, strand) if strand.stop == STALLED else None
        except ConvergenceError as error:
            strand.stop = f"{_BROKEN}: {error}"
            break
        if corner is not None and strand.end.at > turned_at + _BEYOND:
            strand.stop, (q, along), turned_at = "", corner, strand.end.at
        if len(strand.places) > options.max_states:
            strand.stop = f"{options.max_states} {_MANY}"
        if strand.stop:
            break
        try:
            at = strand.end.at
            step = None if corner is None else _BEYOND
            leg = start_leg(
                frame, leg.shooting, q, along, options, offset=at, halves=halves, step=step
            )
            strand.add(leg, leg.walk.first, seam=corner is None)
        except ConvergenceError as error:
            strand.stop = f"{_NO_START}: {error}"
    cycle = strand.end.cycle
    ratio = cycle.speed if np.isnan(cycle.speed_ratio) else cycle.speed_ratio
    unit = frame.loop.family.units[0]
    size = np.degrees(cycle.amplitude) if unit == "rad" else cycle.amplitude
    strand.stop += f" (at {ratio:.6g}, amplitude {size:.4g} {'deg' if unit == 'rad' else unit})"
    return strand


def _walk(
    leg: Leg, strand: Strand, options: CycleOptions, watch: Callable[[Cycle], None]
) -> tuple[Array, Array]:
    """Walk until the leg or the strand ends; where it ended, and the tangent there."""
    walk, old, known = leg.walk, leg.walk.first, 0
    start = strand.end.cycle
    for state in walk:
        if state is old:
            continue
        events, known = walk.events[known:], len(walk.events)
        if leg.comes_back(old.x, state.x):
            strand.stop = BACK
            return old.x, old.tangent
        strand.stop = _note(leg, strand, _happenings(leg, old, state, located(leg, events)))
        if strand.stop:
            return state.x, state.tangent
        if len(strand.places) > 4 and crossing(leg, old, state, strand.places[0].cycle):
            strand.stop, strand.closed = _CLOSED, True
            return state.x, state.tangent
        cycle = strand.add(leg, state).cycle
        if cycle.switches == 0 and not leg.frame.loop.smooth:
            strand.places.pop()
            strand.stop = _LINEAR
            return state.x, state.tangent
        if cycle.closure > _CLOSE and state.arclength - old.arclength < _CRAWL:
            strand.stop = STALLED
            return state.x, state.tangent
        watch(cycle)
        strand.stop = _limit(leg, cycle, options) or _named(leg, walk.stop)
        grown = cycle.amplitude / start.amplitude
        if not 1 / _GROWTH < grown < _GROWTH or leg.flat(state.x, cycle):
            return state.x, state.tangent
        if strand.stop or len(strand.places) > options.max_states:
            return state.x, state.tangent
        old = state
    strand.stop = _named(leg, walk.stop)
    return old.x, old.tangent


def _corner(leg: Leg, strand: Strand) -> tuple[Array, Array] | None:
    """A start and a direction beyond a corner at the end of a strand, which is marked.

    A branch may end at a corner: where its parent grazes, it leaves it with a kink, and beyond it
    would only come back half a period late.
    """
    while len(strand.places) > 1 and strand.end.cycle.closure > _CLOSE and strand.end.leg is leg:
        if strand.end.seam:
            break
        strand.places.pop()  # beyond the corner, where Newton's method only seemed to converge
    near = strand.end.at - _COINCIDE
    before = next((p for p in reversed(strand.places) if p.leg is leg and p.at < near), None)
    if before is None:
        return None
    found = turned(leg, strand.end.state, leg.switches(before.state.x))
    if found is not None and leg.comes_back(before.state.x, found[0]):
        strand.stop = BACK
        return None
    if found is not None:
        reverses = found[1][-1] * (strand.end.state.x - before.state.x)[-1] < 0
        while strand.places[-2].kind == "grazing" and strand.places[-2].at > near:
            del strand.places[-2]  # the same event
        strand.places[-1] = replace(strand.end, kind="corner" if reverses else "grazing")
    return found


def _happenings(
    leg: Leg, old: State, new: State, found: list[tuple[str, State]]
) -> list[tuple[str, State]]:
    """Everything that happens within a step, in order."""
    corners = [state.arclength for kind, state in found if kind == "corner"]
    found += [
        ("grazing", state)
        for state in changes(leg, old, new)
        if not any(abs(state.arclength - corner) < _COINCIDE for corner in corners)
    ]
    return sorted(found, key=lambda entry: entry[1].arclength)


def _note(leg: Leg, strand: Strand, found: list[tuple[str, State]]) -> str:
    """Add what happens to the strand, and say why it ends if it does."""
    for kind, state in found:
        cycle = strand.add(leg, state, kind).cycle
        if cycle.switches == 0 and not leg.frame.loop.smooth:
            if kind != "grazing":  # beyond the end, where any amplitude will do
                strand.places.pop()
            return _LINEAR
    return ""


def _limit(leg: Leg, cycle: Cycle, options: CycleOptions) -> str:
    if cycle.amplitude > options.largest * leg.shooting.loop.spring.scale:
        return f"{LARGEST} {options.largest:g} times the spring's scale"
    loop = leg.shooting.loop
    if loop.smooth and cycle.amplitude < _SHRUNK * loop.spring.scale:
        return _HOPF
    return ""


def _named(leg: Leg, stop: str) -> str:
    """A reason of the walk in the words of this problem."""
    if "min_step" in stop:
        return STALLED
    if stop.startswith("max_states"):
        return f"{leg.walk.options.max_states} {_MANY}"
    m = leg.shooting.loop.m
    for index, name in ((m, "the longest period"), (m + 1, "the end of the range of speeds")):
        if stop.startswith(f"unknown {index} "):
            return name
    return stop


def crossing(leg: Leg, old: State, new: State, cycle: Cycle) -> bool:
    """Whether the curve passes through a known cycle between two states of a leg."""
    periods = old.x[-2], new.x[-2]
    if not min(periods) - 0.1 < np.log(cycle.period) < max(periods) + 0.1:
        return False
    there = {_SPEED: cycle.speed / leg.shooting.reference, _PERIOD: float(np.log(cycle.period))}
    for place, value in there.items():  # beside a fold the speed does not tell, but the period does
        found = meeting(leg, old, new, value, place)
        if found is not None and same(found[1], cycle):
            return True
    return False


def meeting(
    leg: Leg, old: State, new: State, value: float, place: int = _SPEED
) -> tuple[Array, Cycle] | None:
    """The cycle at a speed (over the reference) between two states of a leg, None if none.

    Or with another value of the unknown at `place`.
    """
    span = new.x[place] - old.x[place]
    if span == 0 or not -1e-9 <= (value - old.x[place]) / span <= 1 + 1e-9:
        return None
    guess = old.x + (new.x - old.x) * ((value - old.x[place]) / span)
    return cycle_with(leg, guess, value, place)


def cycle_with(
    leg: Leg, guess: Array, value: float, place: int = _SPEED
) -> tuple[Array, Cycle] | None:
    """The cycle at exactly a speed (over the reference) near a guess, None if there is none."""
    guess = guess.copy()
    guess[place] = value
    try:
        q, _ = correct(leg.shooting, guess, np.eye(guess.size)[place], leg.walk.options)
        q[place] = value
        return q, cycle_at(leg.frame, leg.shooting, q)
    except ConvergenceError:
        return None


def level(one: Place, other: Place, cycle: Cycle) -> bool:
    """Whether a cycle lies between neighbours that differ in nothing but their size.

    Where the loop is homogeneous there are cycles of any amplitude, at one speed.
    """
    sizes = one.cycle.amplitude, other.cycle.amplitude
    if not min(sizes) <= cycle.amplitude <= max(sizes):
        return False
    ratios = [
        (known.speed / cycle.speed, known.period / cycle.period,
         known.first_harmonic * cycle.amplitude / (known.amplitude * cycle.first_harmonic))
        for known in (one.cycle, other.cycle)
    ]  # fmt: skip
    return bool(np.max(np.abs(np.array(ratios) - 1.0)) < _SAME)


def same(one: Cycle, other: Cycle) -> bool:
    """Whether two cycles are one, or mirror images of each other."""
    differences = (
        (one.speed / other.speed - 1.0) * other.amplitude,
        one.amplitude - other.amplitude,
        one.first_harmonic - other.first_harmonic,
        (one.period / other.period - 1.0) * other.amplitude,
    )
    return bool(np.max(np.abs(differences)) < _SAME * other.amplitude)


def between(one: Place, other: Place, fraction: float = 0.5) -> Place | None:
    """A cycle between two neighbours of a leg, None where there is none to be found."""
    leg = one.leg
    if leg is not other.leg or other.at <= one.at:
        return None
    try:
        x, newton = leg.walk.point(one.state, other.state, fraction)
        walked = float(np.linalg.norm((x - one.state.x) / leg.walk.scale))
        at = one.state.arclength + walked
        state = State(x, one.state.tangent, at, newton=newton)
        return Place(leg.offset + at, leg, state, leg.cycle(state))
    except ConvergenceError:
        return None
