"""One leg of a family of cycles: a walk from one starting place, in units of one size.

The walk comes from the pseudo-arclength continuation. Its test functions locate folds and changes
of stability; changes of the switching sequence have no test function that a sequence-free map could
offer and are bisected. Where the memory meets a stop the map has a kink and the curve a corner,
which may turn by more than a right angle; `turned` finds the way on.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aeroflutter.errors import ConvergenceError
from aeroflutter.orbits.continuation import (
    ContinuationOptions,
    Event,
    State,
    Walk,
    correct,
    tangent_at,
)
from aeroflutter.orbits.cycles.measure import Frame, anchored, cycle_at, sizes_of, trace_of
from aeroflutter.orbits.cycles.options import CycleOptions
from aeroflutter.orbits.cycles.result import Cycle
from aeroflutter.orbits.cycles.shooting import Shooting
from aeroflutter.orbits.cycles.spectrum import Spectra
from aeroflutter.orbits.spectrum import FOLD, bifurcation, test_functions
from aeroflutter.springs import Hysteresis

__all__ = ["STALLED", "Leg", "changes", "located", "start_leg", "turned"]

Array = NDArray[np.float64]
Switches = tuple[tuple[int, ...], ...]

_STOP = -1  # among kinds of switches
STALLED = "Newton's method fails at any step"

_PERIOD, _SPEED = 0.3, 0.3  # sizes of ln T and of U/U_ref in the arclength
_SLOPE = 0.3  # a start is flat below this fraction of a sinusoid's steepest slope
_LOCATE = 1e-11  # U/U_ref to which a change of sequence is located
_HALVED = 1e-14  # of the step: at a corner Newton's method may not come between its sides
_TOGETHER = 1e-8  # U/U_ref within which changes of sequence are one
_CHANGES = 12  # changes of sequence within one step
_TRIES = 4  # times as often one is looked for
_SMALLEST = 1e-9  # step
_SETTLED = 1e-15  # Newton update that is round-off: a multiplier of 1e4 may magnify it
_REACHES = (1e-7, 1e-6, 1e-5, 1e-4)  # how far beyond a corner its other side is looked at
_FURTHER = 1e2  # times that is the first step beyond it
_MET = 1e-6  # of what a cycle differed from one of half its period: it is one
_AT_STOP = 1e-9  # of the spring's size: a memory this near to a stop is on it


@dataclass(eq=False)
class Leg:
    """A walk with what it needs.

    Attributes
    ----------
    frame, shooting, walk
        The search, the equations and the walk along their solutions.
    spectra
        Eigenvalues along it, with the sizes of z at its start.
    offset
        Distance along the strand at which it starts.
    halves
        Signs s for which it may end where z(T/2) = s z: on the family from which it branched.
    """

    frame: Frame
    shooting: Shooting
    spectra: Spectra
    walk: Walk
    offset: float
    halves: tuple[float, ...]

    def cycle(self, state: State) -> Cycle:
        """The cycle at a state of the walk."""
        return cycle_at(self.frame, self.shooting, state.x, self.spectra)

    def switches(self, x: Array) -> Switches:
        """Its switching sequence over the (half) period, led by the stop that it starts on."""
        return self._stop(x) + self.shooting.shot(x).passage.switches

    def _stop(self, x: Array) -> Switches:
        loop = self.frame.loop
        found: list[tuple[int, ...]] = []
        for place, i in enumerate(loop.held):
            spring, memory = loop.springs[i], x[loop.n + place]
            if not isinstance(spring, Hysteresis):
                continue
            slack = _AT_STOP * spring.scale
            above = memory > spring.h_high - slack
            if above or memory < spring.h_low + slack:
                found.append((_STOP - int(i), int(above)))
        return tuple(found)

    def comes_back(self, old: Array, new: Array) -> bool:
        """Whether the curve passes a cycle of half the period between two points.

        What the cycles differ from one by vanishes there, and goes on with the other sign or, where
        the walk steps over to the curve of those cycles, not at all.
        """
        for sign in self.halves:
            before, after = self._unlike(old, sign), self._unlike(new, sign)
            if before @ after < 0.0 or np.linalg.norm(after) < _MET * np.linalg.norm(before):
                return True
        return False

    def _unlike(self, x: Array, sign: float) -> Array:
        """z(T/2) - sign z, in sizes, (m,)."""
        z, period, _ = self.shooting.unpack(x)
        half = self.shooting.flow(x).passage(z, period / 2).end
        return np.asarray((half - sign * z) / self.spectra.sizes)

    def flat(self, x: Array, cycle: Cycle) -> bool:
        """Whether the start has become a bad place to start from."""
        phase = self.shooting.jacobian(x)[-1, :-2] @ self.shooting.shot(x).rate
        by = self.shooting.phase
        size = cycle.amplitude
        if by.lead:  # of the spring that tells
            size = float(np.abs(cycle.outputs[by.lead, 1:]).max())
        return bool(abs(phase) < _SLOPE * size * cycle.k ** (1 if by.memory or by.falls else 2))


def start_leg(
    frame: Frame,
    shooting: Shooting,
    q: Array,
    along: Array | None,
    options: CycleOptions,
    *,
    offset: float = 0.0,
    halves: tuple[float, ...] = (),
    step: float | None = None,
) -> Leg:
    """A walk from the best starting place of the cycle near q.

    Parameters
    ----------
    along
        Direction in which to leave; None to choose one.
    offset
        Distance walked before.
    halves
        Signs s for which the family may end where z(T/2) = s z: on the one from which it branched.
    step
        First step, if not that of the options.

    Raises
    ------
    ConvergenceError
        If there is no cycle near q.
    """
    shooting, q, along = anchored(shooting, q, along)
    sizes = sizes_of(shooting, trace_of(shooting, q))
    m = sizes.size
    low, high = np.full(m + 2, -np.inf), np.full(m + 2, np.inf)
    low[-1], high[-1] = options.limits(frame)
    high[-2] = np.log(options.longest_period(frame))
    settings = ContinuationOptions(
        step=min(step or options.step, options.max_step),
        max_step=options.max_step,
        min_step=_SMALLEST,
        max_states=options.max_states,
        low=low,
        high=high,
        scale=np.concatenate((np.sqrt(m) * sizes, [_PERIOD, _SPEED])),
        folds={FOLD: m + 1},
        locate=1e-12,
        settled=_SETTLED,
    )
    spectra = Spectra(shooting, sizes)
    walk = Walk(shooting, q, along, settings, test_functions(spectra))
    return Leg(frame, shooting, spectra, walk, offset, halves)


def located(leg: Leg, events: list[Event]) -> list[tuple[str, State]]:
    """The events of a step that mean something, by what they are called."""
    named = [
        (_kind(leg, event), State(event.x, event.tangent, event.arclength)) for event in events
    ]
    return [(kind, state) for kind, state in named if kind]


def _kind(leg: Leg, event: Event) -> str:
    if event.jump:
        return "corner" if event.name == FOLD else ""
    return bifurcation(event.name, leg.spectra(event.x))


def changes(leg: Leg, old: State, new: State) -> list[State]:
    """Every change of the switching sequence between two states, by bisection."""
    found: list[State] = []
    state, last = old, leg.switches(new.x)
    for _ in range(_TRIES * _CHANGES):  # beside a corner round-off may change it back and forth
        if leg.switches(state.x) == last or len(found) == _CHANGES:
            break
        before, state = _change(leg, state, new)
        if found and abs(state.x[-1] - found[-1].x[-1]) < _TOGETHER:
            found.pop()  # several switches at once
        at = min(state, before, key=lambda side: _left(leg, side))
        found.append(_next_to(leg, at, old))
    return found


def _next_to(leg: Leg, state: State, old: State) -> State:
    """A state with its arclength measured straight from another one."""
    chord = float(np.linalg.norm((state.x - old.x) / leg.walk.scale))
    return replace(state, arclength=old.arclength + chord)


def _left(leg: Leg, state: State) -> float:
    """What is left of the residual: on one side of a kink Newton's method may stop short."""
    return float(np.max(np.abs(leg.shooting.residual(state.x)[:-1] / leg.spectra.sizes)))


def _change(leg: Leg, state: State, beyond: State) -> tuple[State, State]:
    """The first place after a state with another sequence than there: just before, just after.

    The curve is interpolated between the two sides as they close in, so that soon a state is
    found at the first attempt.
    """
    here, left = leg.switches(state.x), 1.0
    while left > 1e-7 or (left > _HALVED and abs(beyond.x[-1] - state.x[-1]) > _LOCATE):
        try:
            between = leg.walk.between(state, _next_to(leg, beyond, state), 0.5)
        except ConvergenceError:  # two switches coincide to round-off just there
            break
        if any(np.array_equal(between.x, side.x) for side in (state, beyond)):
            break
        left *= 0.5
        if leg.switches(between.x) == here:
            state = between
        else:
            beyond = between
    return state, beyond


def turned(leg: Leg, last: State, here: Switches) -> tuple[Array, Array] | None:
    """A start q and a direction beyond a sharp corner at a state, None if there is none.

    Around the corner the map is linear in every wedge of one sequence of switches. The curve leaves
    it along the null vector of some wedge's Jacobian that points into that very wedge, even more
    than a right angle off. Wedges are looked for along the curve and along one another's null
    vectors.

    Parameters
    ----------
    here
        The sequence on the way to the corner, which the state may have passed by round-off.
    """
    for reach in _REACHES:
        known, ahead = {here}, [last.tangent, -last.tangent]
        while ahead:
            probe = last.x + reach * ahead.pop(0)
            try:
                wedge = leg.switches(probe)
                if wedge in known:
                    continue
                known.add(wedge)
                null = tangent_at(leg.shooting, probe, None, leg.walk.scale)
            except ConvergenceError:
                continue
            for direction in (null, -null):
                found = _beyond(leg, last.x + _FURTHER * reach * direction, direction)
                if found is not None and leg.switches(found) != here:
                    return found, direction
            ahead += [null, -null]
    return None


def _beyond(leg: Leg, guess: Array, direction: Array) -> Array | None:
    try:
        return correct(leg.shooting, guess, direction / leg.walk.scale**2, leg.walk.options)[0]
    except ConvergenceError:
        return None
