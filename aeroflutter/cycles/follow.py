"""Following one family of cycles, leg by leg.

The cycle grows by decades along a family, and the place where it is best started moves. So the walk
is cut into legs, each with its own starting place and units; between two states of a leg everything
that happens is located: folds and changes of stability as zeros of test functions, changes of the
switching sequence by bisection.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from aeroflutter.continuation import (
    ContinuationOptions,
    Event,
    State,
    Test,
    Walk,
    correct,
    tangent_at,
)
from aeroflutter.cycles.measure import Frame, anchored, cycle_at, sizes_of, trace_of
from aeroflutter.cycles.options import CycleOptions
from aeroflutter.cycles.result import Cycle
from aeroflutter.cycles.shooting import Shooting
from aeroflutter.cycles.spectrum import Spectrum, spectrum
from aeroflutter.errors import ConvergenceError

__all__ = ["Leg", "Place", "Strand", "follow", "same"]

Array = NDArray[np.float64]

FOLD, FLIP, TORUS, GRAZING, RETURN = "fold", "flip", "torus", "grazing", "return"

_PERIOD, _SPEED = 0.3, 0.3  # sizes of ln T and of U/U_ref in the arclength
_GROWTH = 1.6  # a leg ends when the cycle has grown or shrunk by this
_SLOPE = 0.3  # or when its start has become flatter than this
_SAME = 1e-6  # relative difference of two measurements of one cycle
_LOCATE = 1e-11  # speed ratio to which a change of sequence is located
_CHANGES = 12  # of sequence, within one step


@dataclass(eq=False)
class Leg:
    """One walk with its equations, sizes and test functions."""

    frame: Frame
    shooting: Shooting
    sizes: Array
    walk: Walk
    offset: float

    def cycle(self, state: State) -> Cycle:
        """The cycle at a state of the walk."""
        return cycle_at(self.frame, self.shooting, state.x)

    def sequence(self, state: State) -> tuple[tuple[int, int], ...]:
        """Its switches."""
        return self.shooting.shot(state.x).passage.switches

    def flat(self, state: State, cycle: Cycle) -> bool:
        """Whether the start has become a bad place to start from."""
        loop, q = self.shooting.loop, state.x
        phase = self.shooting.jacobian(q)[-1, :-2] @ self.shooting.shot(q).rate
        omega = 2 * np.pi / cycle.period
        return bool(abs(phase) < _SLOPE * cycle.amplitude * omega ** (1 if loop.memory else 2))


@dataclass(frozen=True, eq=False)
class Place:
    """A cycle on a strand, at a distance along it; `kind` says what happens there, if anything."""

    at: float
    leg: Leg
    state: State
    cycle: Cycle
    kind: str = ""


@dataclass(eq=False)
class Strand:
    """A family followed in one direction."""

    places: list[Place] = field(default_factory=list)
    stop: str = ""
    closed: bool = False


def start_leg(
    frame: Frame,
    shooting: Shooting,
    q: Array,
    along: Array | None,
    options: CycleOptions,
    offset: float = 0.0,
    half: float | None = None,
) -> Leg:
    """A walk from the best starting place of the cycle at q.

    Parameters
    ----------
    half
        Sign s if the family may end where z(T/2) = s z, on the family it branched from.

    Raises
    ------
    ConvergenceError
        If there is no cycle near q.
    """
    q, along = anchored(shooting, q, along)
    hold = float(q[-3]) if shooting.loop.memory else 0.0
    shooting = Shooting(shooting.loop, shooting.symmetric, shooting.reference, hold)
    sizes = sizes_of(shooting, trace_of(shooting, q))
    m = sizes.size
    scale = np.concatenate((np.sqrt(m) * sizes, [_PERIOD, _SPEED]))
    low, high = np.full(m + 2, -np.inf), np.full(m + 2, np.inf)
    low[-1], high[-1] = options.limits(frame)
    high[-2] = np.log(options.longest_period(frame))
    settings = ContinuationOptions(
        step=options.step, max_step=options.max_step, min_step=1e-9,
        max_states=options.max_states, low=low, high=high, scale=scale, folds={FOLD: m + 1},
        locate=1e-12,
    )  # fmt: skip
    tests = _tests(shooting, sizes, q, half)
    return Leg(frame, shooting, sizes, Walk(shooting, q, along, settings, tests), offset)


def _tests(shooting: Shooting, sizes: Array, q: Array, half: float | None) -> dict[str, Test]:
    last: dict[bytes, Spectrum] = {}

    def spec(x: Array) -> Spectrum:
        key = x.tobytes()
        if key not in last:
            last.clear()
            shot = shooting.shot(x)
            last[key] = spectrum(shot, sizes, shooting.symmetric, shooting.loop.memory)
        return last[key]

    tests: dict[str, Test] = {
        FLIP: lambda x, tangent: spec(x).flip,
        TORUS: lambda x, tangent: spec(x).torus,
    }
    if half is not None:
        reference = unlikeness(shooting, sizes, q, half)
        tests[RETURN] = lambda x, tangent: float(reference @ unlikeness(shooting, sizes, x, half))
    return tests


def unlikeness(shooting: Shooting, sizes: Array, q: Array, sign: float) -> Array:
    """z(T/2) - sign z, in sizes, (m,): zero where the cycle is one of half the period."""
    z, period, _ = shooting.unpack(q)
    return np.asarray((shooting.flow(q).passage(z, period / 2).end - sign * z) / sizes)


def follow(
    frame: Frame,
    shooting: Shooting,
    q: Array,
    along: Array | None,
    options: CycleOptions,
    *,
    half: float | None = None,
    watch: Callable[[Cycle], None] = lambda cycle: None,
) -> Strand:
    """Follow a family in one direction until it ends.

    Returns
    -------
    Strand
        Whose `stop` says why and where it ended.

    Raises
    ------
    ConvergenceError
        If there is no cycle near q.
    """
    strand = Strand()
    leg = start_leg(frame, shooting, q, along, options, 0.0, half)
    while not strand.stop:
        q, along = _walk_leg(leg, strand, options, half, watch)
        if strand.stop == STALLED:
            turned = _turned(leg, strand)
            if turned is not None:
                strand.stop, (q, along) = "", turned
        if strand.stop:
            break
        try:
            leg = start_leg(frame, leg.shooting, q, along, options, strand.places[-1].at, half)
        except ConvergenceError as error:
            strand.stop = f"the cycle could not be started from elsewhere: {error}"
    strand.stop = _told(strand, options)
    return strand


def _walk_leg(
    leg: Leg,
    strand: Strand,
    options: CycleOptions,
    half: float | None,
    watch: Callable[[Cycle], None],
) -> tuple[Array, Array]:
    """Walk until the leg or the strand ends; where it ended and the tangent there."""
    walk, old, known = leg.walk, leg.walk.first, 0
    first_cycle = leg.cycle(old)
    if not strand.places:
        strand.places.append(Place(0.0, leg, old, first_cycle))
    for state in walk:
        if state is old:
            continue
        found = [(event.name, as_state(event)) for event in walk.events[known:]]
        jumps = {event.name: event.jump for event in walk.events[known:]}
        known = len(walk.events)
        found += [(GRAZING, place) for place in _changes(leg, old, state)]
        for name, place in sorted(found, key=lambda entry: entry[1].arclength):
            kind = _kind(leg, name, place, jumps.get(name, False))
            if kind:
                strand.places.append(_place(leg, place, kind))
            if kind == RETURN or (kind == GRAZING and not leg.sequence(place)):
                strand.stop = _END[kind]
                return state.x, state.tangent
        place = _place(leg, state)
        if _closes(leg, strand, old, state):
            strand.stop, strand.closed = "the curve closes", True
            return state.x, state.tangent
        strand.places.append(place)
        watch(place.cycle)
        strand.stop = _limit(leg, place, options) or _named(leg, walk.stop)
        grown = place.cycle.amplitude / first_cycle.amplitude
        if strand.stop or not 1 / _GROWTH < grown < _GROWTH or leg.flat(state, place.cycle):
            return state.x, state.tangent
        if len(strand.places) > options.max_states:
            break
        old = state
    strand.stop = _named(leg, walk.stop)
    return old.x, old.tangent


STALLED = "Newton's method fails at any step"

_END = {
    RETURN: "the family comes back to the one it branched from",
    GRAZING: "the spring no longer switches: cycles of a linear system, of any amplitude",
}


def _place(leg: Leg, state: State, kind: str = "") -> Place:
    return Place(leg.offset + state.arclength, leg, state, leg.cycle(state), kind)


def as_state(event: Event) -> State:
    """A located event as a state of its walk."""
    return State(event.x, event.tangent, event.arclength)


def _kind(leg: Leg, name: str, state: State, jump: bool) -> str:
    """What a located zero is called; empty if it is none of interest."""
    symmetric = leg.shooting.symmetric
    if name == FOLD:
        return "corner" if jump else FOLD
    if name == GRAZING:
        return GRAZING
    if jump:
        return ""
    if name == FLIP:
        return "symmetry-breaking" if symmetric else "period-doubling"
    if name == RETURN:
        return RETURN
    shot = leg.shooting.shot(state.x)
    pair = spectrum(shot, leg.sizes, symmetric, leg.shooting.loop.memory)
    return "neimark-sacker" if pair.closest_pair_is_complex else ""


def _linear_beyond(leg: Leg, place: State, new: State) -> bool:
    return not leg.sequence(new)


def _changes(leg: Leg, old: State, new: State) -> list[State]:
    """Every change of the switching sequence between two states, by bisection."""
    walk, found = leg.walk, []
    low, state, last = 0.0, old, leg.sequence(new)
    while leg.sequence(state) != last and len(found) < _CHANGES:
        here, high, beyond = leg.sequence(state), 1.0, new
        for _ in range(60):
            middle = 0.5 * (low + high)
            try:
                between = walk.between(old, new, middle)
            except ConvergenceError:
                return found
            if leg.sequence(between) == here:
                low, state = middle, between
            else:
                high, beyond = middle, between
            if high - low < 1e-7 and abs(beyond.x[-1] - state.x[-1]) < _LOCATE:
                break
        found.append(beyond)
        low, state = high, beyond
    return found


def _limit(leg: Leg, place: Place, options: CycleOptions) -> str:
    scale = leg.shooting.loop.spring.scale
    if place.cycle.amplitude > options.largest * scale:
        return f"amplitude {options.largest:g} times the spring's scale"
    return ""


def _turned(leg: Leg, strand: Strand) -> tuple[Array, Array] | None:
    """Start and direction beyond a sharp corner at the end of a leg, None if there is none.

    The map is smooth for each sequence of switches, and the curve of the next sequence leaves the
    corner along the null vector of its own Jacobian, even where that is more than a right angle off.
    """
    last = strand.places[-1]
    x, tangent = last.state.x, last.state.tangent
    here = leg.sequence(last.state)
    for reach in (1e-7, 1e-6, 1e-5, 1e-4):
        try:
            ahead = tangent_at(leg.shooting, x + reach * tangent, None, leg.walk.scale)
        except ConvergenceError:
            continue
        for direction in (ahead, -ahead):
            for step in (1e2 * reach, 1e3 * reach):
                found = _beyond(leg, x + step * direction, direction)
                if found is None or leg.shooting.shot(found).passage.switches == here:
                    continue
                back = direction[-1] * tangent[-1] < 0
                strand.places[-1] = replace(last, kind="corner" if back else GRAZING)
                return found, direction
    return None


def _beyond(leg: Leg, guess: Array, direction: Array) -> Array | None:
    try:
        return correct(leg.shooting, guess, direction / leg.walk.scale**2, leg.walk.options)[0]
    except ConvergenceError:
        return None


def _named(leg: Leg, stop: str) -> str:
    """A reason of the walk in the words of this problem."""
    if "min_step" in stop:
        return STALLED
    m = leg.shooting.loop.m
    for index, name in ((m, "the longest period"), (m + 1, "the end of the range of speeds")):
        if stop.startswith(f"unknown {index} "):
            return name
    return stop


def _closes(leg: Leg, strand: Strand, old: State, new: State) -> bool:
    """Whether the step passes through the first cycle of the strand."""
    if len(strand.places) < 5:
        return False
    return passes(leg, old, new, strand.places[0].cycle)


def passes(leg: Leg, old: State, new: State, cycle: Cycle) -> bool:
    """Whether the curve passes through a known cycle between two states of a leg."""
    speed = cycle.speed / leg.shooting.reference
    span = new.x[-1] - old.x[-1]
    if span == 0 or not -1e-9 <= (speed - old.x[-1]) / span <= 1 + 1e-9:
        return False
    guess = old.x + (new.x - old.x) * (speed - old.x[-1]) / span
    if abs(guess[-2] - np.log(cycle.period)) > 0.1:
        return False
    guess[-1] = speed
    try:
        q, _ = correct(leg.shooting, guess, np.eye(guess.size)[-1], leg.walk.options)
        return same(cycle_at(leg.frame, leg.shooting, q), cycle)
    except ConvergenceError:
        return False


def same(one: Cycle, other: Cycle) -> bool:
    """Whether two cycles at one speed are one, or mirror images of each other."""
    a, b = (
        np.array([c.amplitude, abs(c.first_harmonic), c.period * other.amplitude / other.period])
        for c in (one, other)
    )
    return bool(np.all(np.abs(a - b) < _SAME * other.amplitude))


def _told(strand: Strand, options: CycleOptions) -> str:
    """The reason a strand ended, with the speed and amplitude there."""
    cycle = strand.places[-1].cycle
    ratio = cycle.speed_ratio if np.isfinite(cycle.speed_ratio) else cycle.speed
    reason = strand.stop or f"{options.max_states} cycles were followed"
    return f"{reason} (at {ratio:.6g}, amplitude {np.degrees(cycle.amplitude):.4g} deg)"


def between(one: Place, other: Place) -> Place | None:
    """A cycle half-way between two neighbours of a strand, None where it cannot be found."""
    if one.leg is not other.leg:
        return None
    try:
        state = one.leg.walk.between(one.state, other.state, 0.5)
    except ConvergenceError:
        return None
    return replace(_place(one.leg, state))
