"""Every family of limit cycles that the seeds lead to."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aeroflutter.analysis import analysis
from aeroflutter.errors import ConvergenceError, InputError
from aeroflutter.linear.rootlocus import flutter_point
from aeroflutter.model.absorbed import reduced
from aeroflutter.model.family import FixedModel
from aeroflutter.model.lure import AnyFamily, FixedFamily, as_lure
from aeroflutter.orbits.cycles.assemble import Family, assemble
from aeroflutter.orbits.cycles.centre import centre
from aeroflutter.orbits.cycles.follow import (
    BACK,
    FAILURES,
    NOT_ENTERED,
    Place,
    Strand,
    crossing,
    follow,
    level,
    meeting,
    same,
)
from aeroflutter.orbits.cycles.loop import Loop
from aeroflutter.orbits.cycles.measure import Frame, cycle_at
from aeroflutter.orbits.cycles.options import CycleOptions
from aeroflutter.orbits.cycles.result import Cycle, LimitCycles
from aeroflutter.orbits.cycles.seeds import (
    converged,
    end_seeds,
    mirrors,
    point_of,
    sinusoid,
    starts,
)
from aeroflutter.orbits.cycles.shooting import Shooting
from aeroflutter.orbits.cycles.spectrum import critical_vector
from aeroflutter.orbits.describing import DescribingCurve, DescribingOptions, describing_curve
from aeroflutter.orbits.result import lowest
from aeroflutter.springs import (
    Linear,
    Springs,
    each,
    simplify,
)

__all__ = ["Search", "Seed", "limit_cycles"]

Array = NDArray[np.float64]
Watch = Callable[[Cycle], None]

_DF_POINTS = 16  # cycles of each describing-function family that are tried as seeds
_LINEAR = 1e-12  # distortion that is round-off
_ASIDE = 1e-3  # step onto a branch, in sizes of the cycle
_TRIES = 4  # cycles of a strand from which its other side is tried
_NEAR = 0.02  # relative difference within which a family ends at a bifurcation
_SPEEDS = 60  # at which the exact engine looks for cycles
_NEUTRAL = 3e-3  # of U*/U*_L about one, where it does not
_FEW = 4  # speeds, and motions at each, for smooth springs
_THERE = 4  # times as many motions at a speed that is asked for


@analysis()
def limit_cycles(
    family: AnyFamily,
    spring: Springs,
    options: CycleOptions | None = None,
    watch: Watch = lambda cycle: None,
) -> LimitCycles:
    """Every limit cycle of a loop with piecewise-linear springs, against speed.

    Parameters
    ----------
    family
        The linear system at every speed.
    spring
        The restoring moment: table, bilinear, freeplay or hysteresis; degenerate laws are
        simplified first. Of several springs a sequence, one an output.
    options
        Where to look, and how closely.
    watch
        Called with every cycle found.

    Raises
    ------
    InputError
        If the spring is not piecewise linear, or the system does not depend on speed.

    Examples
    --------
    >>> from aeroflutter import Hysteresis, SectionFamily, TypicalSection
    >>> section = SectionFamily(TypicalSection(omega_bar=0.8))
    >>> result = limit_cycles(section, Hysteresis(1.0, 0.2))
    >>> round(result.onset.cycle.speed_ratio, 8), result.onset.kind
    (0.92151328, 'fold')
    """
    if isinstance(family, FixedFamily | FixedModel):
        raise InputError(
            "family: does not depend on speed, so there is no branch over it; use cycles_at"
        )
    search = Search(family, spring, options, watch)
    search.run()
    return search.result()


@dataclass(frozen=True)
class Seed:
    """A guess of a cycle."""

    z: Array
    period: float
    speed: float
    symmetric: bool
    origin: str


class Search:
    """A search for families, one seed after the other."""

    def __init__(
        self,
        family: AnyFamily,
        spring: Springs,
        options: CycleOptions | None = None,
        watch: Watch = lambda cycle: None,
    ) -> None:
        self.options = options or CycleOptions()
        self.watch = watch
        self.families: list[Family] = []
        self.notes: list[str] = []
        self._seeds = self._astray = 0
        self._rng = np.random.default_rng(0)  # one search is like another
        self._entered: set[tuple[float, float]] = set()
        pieces = [simplify(one) for one in each(spring)]
        family, simple = reduced(family, pieces)
        self.kept = [i for i, one in enumerate(pieces) if any(one is left for left in simple)]
        point = flutter_point(family)
        about = centre(family, simple)
        self.family = family
        flutter = None if point is None else point.speed
        self.frame = Frame(
            loop=Loop(family, about.springs),
            centre=about,
            flutter=flutter,
            reference=flutter or family.search_range[1],
            period=np.inf if point is None else 2 * np.pi / point.k,
        )

    @property
    def largest(self) -> float:
        """Largest amplitude followed, in the unit of the first spring."""
        return self.options.largest * self.frame.loop.spring.scale

    @property
    def _linear(self) -> bool:
        return all(isinstance(one, Linear) for one in self.frame.loop.springs)

    def run(self, speed: float | None = None) -> None:
        """Follow every family that a seed leads to, then what branches from them.

        Parameters
        ----------
        speed
            Speed U* at which the exact engine is to look for cycles as well.
        """
        if self._linear:
            self.notes.append("the spring is linear: it has no limit cycles")
            return
        for seed in self._describing_seeds():
            self.try_seed(seed)
        if self.options.simulations:
            for seed in self._simulated_seeds(speed):
                self.try_seed(seed)
        self._branch()

    def at(self, speed: float) -> tuple[Cycle, ...]:
        """The cycles of all families at one speed U*, by amplitude."""
        ratio = speed / self.frame.reference
        found: list[Cycle] = []
        for family in self.families:
            for one, other in family.steps():
                hit = meeting(one.leg, one.state, other.state, ratio)
                if hit is not None and not any(same(hit[1], cycle) for cycle in found):
                    found.append(replace(hit[1], family=family.facts.number))
        return tuple(sorted(found, key=lambda cycle: cycle.amplitude))

    def result(self) -> LimitCycles:
        """What was found."""
        facts = [family.facts for family in self.families]
        low, high = self.options.limits(self.frame)
        return LimitCycles(
            families=tuple(facts),
            flutter_speed=self.frame.flutter,
            onset=lowest([one.onset for one in facts]),
            stable_onset=lowest([one.stable_onset for one in facts]),
            speed_range=(low * self.frame.reference, high * self.frame.reference),
            odd=self.frame.centre.odd,
            notes=(*self.notes, *self._remarks(), *self._empty()),
        )

    def _remarks(self) -> Iterator[str]:
        if self._astray:
            yield (
                f"{self._astray} of {self._seeds} starts led to what does not close to ten digits, "
                "which is left out"
            )
        for family in self.families:
            yield from _broken_off(family)
            if family.left_out:
                yield _left_out(family)

    def _empty(self) -> list[str]:
        if self.families or self._linear:
            return []
        return [f"no limit cycle was found: {self._seeds} starts led to none"]

    # --- seeds ---------------------------------------------------------------------------------

    def _describing_seeds(self) -> Iterator[Seed]:
        loop = self.frame.loop
        if len(loop.springs) > 1:
            yield from self._joint_seeds()
            return
        for point in describing_points(self.frame, self.options):
            amplitude, bias, speed, k = point
            z = sinusoid(loop, amplitude, bias, speed, k)
            symmetric = self.frame.centre.odd and bias == 0.0
            yield Seed(z, 2 * np.pi / k, speed, symmetric, "describing function")

    def _joint_seeds(self) -> Iterator[Seed]:
        """Cycles of the sinusoids of all springs, the least distorted of each family first."""
        from aeroflutter.orbits.describing.several import joint_families

        loop = self.frame.loop
        settings = DescribingOptions(speed_ratio_range=self.options.speed_ratio_range)
        for one in joint_families(loop.family, loop.springs, settings, self.options.largest):
            states = one.curve.states[:: max(1, len(one.curve.states) // _DF_POINTS)]
            for state in sorted(states, key=lambda state: one.balance.truncation(state.x)):
                cycle = one.balance.unpack(state.x)
                z = point_of(loop, cycle.motions, cycle.omega, cycle.speed)
                symmetric = self.frame.centre.odd and one.balance.symmetric
                yield Seed(z, cycle.period, cycle.speed, symmetric, "describing function")

    def _simulated_seeds(self, speed: float | None) -> Iterator[Seed]:
        """Where motions end that start anywhere, at speeds all over the range.

        The outer branch is neutral at the flutter speed itself: nothing settles there.
        """
        low, high = self.options.limits(self.frame)
        count, speeds = self.options.simulations, _SPEEDS
        if self.frame.loop.smooth:  # no certain end states: a motion takes much longer
            count, speeds = min(count, _FEW), _FEW
        if speed is not None:
            yield from self.simulated(speed, _THERE * count)
        for ratio in np.linspace(low, high, speeds):
            if self.frame.flutter is None or abs(ratio - 1.0) > _NEUTRAL:
                yield from self.simulated(float(ratio * self.frame.reference), count)

    def simulated(self, speed: float, count: int) -> Iterator[Seed]:
        """The attracting cycles at a speed that so many motions end on."""
        states = starts(self.frame, speed, count, self._rng)
        for z, period in end_seeds(self.frame, speed, states):
            try:
                about = mirrors(self.frame, z, period, speed) if self.frame.centre.odd else None
            except ConvergenceError:  # it switches more often than can be followed
                self._seeds, self._astray = self._seeds + 1, self._astray + 1
                continue
            yield Seed(
                z if about is None else about, period, speed, about is not None, "simulation"
            )

    # --- following -----------------------------------------------------------------------------

    def try_seed(self, seed: Seed) -> None:
        """Follow the family of a seed both ways, unless it is known or there is none."""
        self._seeds += 1
        try:
            shooting, q = converged(self.frame, seed.z, seed.period, seed.speed, seed.symmetric)
            cycle = cycle_at(self.frame, shooting, q)
            if cycle.amplitude > self.largest or self.known(cycle):
                return
            halves = self._halves(shooting.symmetric)
            ahead = follow(
                self.frame, shooting, q, None, self.options, halves=halves, watch=self.watch
            )
        except ConvergenceError:
            return  # a guess that leads nowhere
        behind = None if ahead.closed else self._behind(ahead, halves)
        ratio = ahead.places[0].cycle.speed / self.frame.reference
        self._add(f"{seed.origin} at {ratio:.6g}", None, ahead, behind)

    def _halves(self, symmetric: bool) -> tuple[float, ...]:
        """Where a family found by itself may end: it may have branched from any other."""
        if symmetric:
            return ()
        return (1.0, -1.0) if self.frame.centre.odd else (1.0,)

    def _behind(self, ahead: Strand, halves: tuple[float, ...]) -> Strand:
        """The strand on the other side of the first cycle, or of one soon after it."""
        reason = ""
        for i, start in enumerate(ahead.places[:_TRIES]):
            leg, back = start.leg, -start.state.tangent
            try:
                strand = follow(
                    self.frame,
                    leg.shooting,
                    start.state.x,
                    back,
                    self.options,
                    halves=halves,
                    watch=self.watch,
                )
            except ConvergenceError as error:
                reason = reason or f"{NOT_ENTERED}: {error}"
                continue
            del ahead.places[:i]
            return strand
        return Strand([ahead.places[0]], reason)

    def _add(self, origin: str, parent: int | None, ahead: Strand, behind: Strand | None) -> None:
        number = len(self.families) + 1
        family = self._assembled(number, origin, parent, ahead, behind)
        if family.facts.cycles:
            self.families.append(family)
        else:
            self._astray += 1

    def _assembled(
        self,
        number: int,
        origin: str,
        parent: int | None,
        ahead: Strand,
        behind: Strand | None = None,
    ) -> Family:
        points = self.options.points if parent is None else max(2, self.options.points // 4)
        return assemble(number, origin, parent, ahead, behind, points)

    def known(self, cycle: Cycle) -> bool:
        """Whether a cycle lies on a family that has been followed."""
        return any(
            crossing(one.leg, one.state, other.state, cycle) or level(one, other, cycle)
            for family in self.families
            for one, other in family.steps()
        )

    # --- branch switching ----------------------------------------------------------------------

    def _branch(self) -> None:
        for family in list(self.families):
            self._rejoin(family)
        done = 0
        for _ in range(self.options.depth):
            fresh, done = self.families[done:], len(self.families)
            for family in fresh:
                for place in family.marked("symmetry-breaking", "period-doubling"):
                    if _key(place) not in self._entered:
                        self._switch(family, place)

    def _rejoin(self, family: Family) -> None:
        """Join a family that was found by itself to the bifurcations where it ends."""
        parent = None
        for strand in family.strands:
            mark = self._nearest(strand.end) if BACK in strand.stop else None
            if mark is not None:
                parent = mark.cycle.family
                self._join(strand, mark)
        if parent is not None:
            facts = family.facts
            again = self._assembled(facts.number, facts.origin, parent, *family.strands)
            self.families[facts.number - 1] = again

    def _join(self, strand: Strand, mark: Place) -> None:
        self._entered.add(_key(mark))
        strand.places.append(replace(mark, at=strand.end.at + _ASIDE, kind=""))

    def _switch(self, family: Family, place: Place) -> None:
        """Follow what branches off where an eigenvalue passes -1."""
        leg = place.leg
        doubled = not leg.shooting.symmetric
        vector = critical_vector(leg.shooting.shot(place.state.x), leg.spectra.sizes)
        along = np.append(vector, [0.0, 0.0])
        q = place.state.x + _ASIDE * np.sqrt(vector.size) * along
        if doubled:
            q[-2] += np.log(2.0)
        shooting = Shooting(self.frame.loop, False, self.frame.reference)
        halves = (1.0 if doubled else -1.0,)
        ratio = place.cycle.speed / self.frame.reference
        name = f"{place.kind} of family {family.facts.number} at {ratio:.8g}"
        try:
            strand = follow(
                self.frame, shooting, q, along, self.options, halves=halves, watch=self.watch
            )
        except ConvergenceError as error:
            self.notes.append(f"the branch at the {name} could not be entered: {error.reason}")
            return
        if self.known(strand.middle.cycle):
            return
        strand.places.insert(0, replace(place, at=-_ASIDE, kind=""))
        if BACK in strand.stop:
            mark = self._nearest(strand.end)
            if mark is not None:
                self._join(strand, mark)
        self._add(name, family.facts.number, strand, None)

    def _nearest(self, end: Place) -> Place | None:
        """The bifurcation at which a family that comes back ends, if it is known."""
        marks = [
            place
            for family in self.families
            for place in family.marked("symmetry-breaking", "period-doubling")
        ]
        here = end.cycle

        def distance(place: Place) -> float:
            there = place.cycle
            ratio = there.amplitude / here.amplitude
            return float(np.hypot(there.speed / here.speed - 1.0, np.log(ratio)))

        best = min(marks, key=distance, default=None)
        return best if best is not None and distance(best) < _NEAR else None


def _broken_off(family: Family) -> Iterator[str]:
    """What there is to say of ends that are none of the curve's own."""
    facts = family.facts
    for stop in facts.stopped:
        if any(reason in stop for reason in FAILURES):
            yield (
                f"family {facts.number} could not be followed further: {stop}; its "
                f"{len(facts.cycles)} cycles up to there are kept"
            )


def _left_out(family: Family) -> str:
    cycles = family.left_out
    largest = max(float(np.abs(cycle.multipliers).max()) for cycle in cycles)
    return (
        f"{len(cycles)} cycles of family {family.facts.number} were left out: at a kink, or with "
        f"multipliers up to {largest:.2g}, they do not close to ten digits"
    )


def _key(place: Place) -> tuple[float, float]:
    return place.cycle.speed, place.cycle.amplitude


def describing_points(frame: Frame, options: CycleOptions) -> list[tuple[float, ...]]:
    """Cycles by the describing function, (amplitude, bias, speed, k): the least distorted first.

    Those without any distortion are cycles of a linear system: Newton's method leads from them
    to whatever round-off makes of it.
    """
    curve = _describing(frame, options)
    order = np.argsort(np.nan_to_num(curve.distortion, nan=np.inf), kind="stable")
    mirrored = {one.number for one in curve.families if one.mirror_of is not None}
    return [
        (curve.amplitude[i], curve.bias[i], curve.speed[i], curve.k[i])
        for i in order
        if curve.family[i] not in mirrored and not curve.distortion[i] < _LINEAR
    ]


def _describing(frame: Frame, options: CycleOptions) -> DescribingCurve:
    scale = frame.loop.spring.scale
    settings = DescribingOptions(
        points=_DF_POINTS,
        speed_ratio_range=options.speed_ratio_range,
        amplitude_range=(1e-2 * scale, options.largest * scale),
        scan_amplitudes=8,
        scan_speeds=60,
    )
    return describing_curve(as_lure(frame.loop.family), frame.loop.spring, settings)
