"""How large a gap, or how little friction, keeps the limit cycles small enough.

A piecewise-linear spring is scale-free: with all its lengths multiplied by one factor, so are all
its cycles, at the same speeds. One branch therefore says how large the whole spring may be.
Friction alone changes the shape of the loop, so the least of it is found by bisection, a branch a
trial.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from aeroflutter.analysis import Result, analysis
from aeroflutter.errors import ConvergenceError, InputError
from aeroflutter.model.family import FixedModel
from aeroflutter.model.lure import AnyFamily, FixedFamily
from aeroflutter.orbits.cycles.assemble import Family
from aeroflutter.orbits.cycles.follow import Place, between
from aeroflutter.orbits.cycles.options import CycleOptions
from aeroflutter.orbits.cycles.result import Cycle, LimitCycles
from aeroflutter.orbits.cycles.search import Search
from aeroflutter.springs import Freeplay, Hysteresis, Linear, Spring, Springs, each, simplify
from aeroflutter.studies.tolerance_several import tolerance_among

__all__ = ["Tolerance", "largest_gap", "least_friction", "tolerance"]

_FAR = 2000.0  # amplitude followed, in units of the spring's scale
_FRICTIONS = (1e-2, 1e2)  # ΔV/ΔH searched
_PER_DECADE = 4
_RELATIVE = 1e-4  # of the friction
_NARROW = 2e-3  # U*/U*_L: narrower gaps between stable cycles are not mentioned


@dataclass(frozen=True, kw_only=True, eq=False)
class Tolerance(Result):
    """What keeps every stable limit cycle below an amplitude up to a speed.

    Attributes
    ----------
    spring
        The spring that is just tolerable; None if any is, however large (`unlimited`).
    factor
        Its size over that of the spring given; infinite if any is tolerable.
    worst
        The largest stable cycle of the spring given, up to the speed; None if there is none.
    amplitude, speed
        What was asked for: largest amplitude, rad, and highest speed U*.
    speed_ratio
        The same over U*_L.
    branch
        The cycles that it rests on.
    notes
        What a reader should know.
    vary
        What was varied: "size", "friction" or "gap".
    trials
        Values of ΔV or ΔH that were tried, rad, with the largest stable amplitude up to the speed
        (0 where there is none, infinite where they grow without bound), rad; ascending. With
        "size" of one of several springs, factors.
    which
        Place of the spring that varies among several; None where it is the only one.
    """

    spring: Spring | None
    factor: float
    worst: Cycle | None
    amplitude: float
    speed: float
    speed_ratio: float
    branch: LimitCycles
    notes: tuple[str, ...]
    vary: str = "size"
    trials: tuple[tuple[float, float], ...] = ()
    which: int | None = None

    @property
    def varied(self) -> float:
        """What varied, of the answer: its factor, its gap, or twice its friction (rad)."""
        if self.vary == "size" or self.spring is None:
            return self.factor
        names = ("delta_h", "gap") if self.vary == "gap" else ("delta_v", "friction")
        name = next(one for one in names if hasattr(self.spring, one))
        return (2.0 if name == "friction" else 1.0) * float(getattr(self.spring, name))

    @property
    def unlimited(self) -> bool:
        """Whether any size or gap is tolerable."""
        return (
            self.worst is None
            and self.which is None
            and (self.vary == "size" or self.spring is None)
        )


@analysis(speed="speed_ratio", relative=True)
def tolerance(
    family: AnyFamily,
    spring: Springs,
    speed_ratio: float,
    amplitude: float,
    options: CycleOptions | None = None,
    which: int = 0,
) -> Tolerance:
    """The largest spring of a shape that keeps every stable cycle below an amplitude.

    Parameters
    ----------
    family, spring
        As for `limit_cycles`; what counts of the spring is its shape. Of several springs the
        others stay as they are, and every size that is tried takes a branch of its own.
    speed_ratio
        Highest speed over U*_L.
    amplitude
        Largest amplitude allowed, half peak-to-peak, rad.
    options
        Where to look; the upper end of the range of speeds is `speed_ratio`.
    which
        Place of the spring that varies, of several.

    Raises
    ------
    InputError
        If a number is not positive, or there is no flutter speed to refer to.
    ConvergenceError
        If stable cycles grow without bound below the speed.

    Examples
    --------
    >>> import numpy as np
    >>> from aeroflutter import Hysteresis, SectionFamily, TypicalSection
    >>> section = SectionFamily(TypicalSection(omega_bar=0.8))
    >>> answer = tolerance(section, Hysteresis(1.0, 0.2), 0.95, np.radians(2.0))
    >>> round(float(np.degrees(answer.spring.delta_h)), 6)
    0.297792
    """
    _check(speed_ratio, amplitude)
    if len(each(spring)) > 1:
        return tolerance_among("size", family, each(spring), which, speed_ratio, amplitude, options)
    (spring,) = each(spring)
    search = search_up_to(family, spring, speed_ratio, options)
    speed = speed_ratio * search.frame.reference
    worst = largest_stable(search, speed)
    branch = search.result()
    factor = float("inf") if worst is None else amplitude / worst.amplitude
    return Tolerance(
        spring=None if worst is None else spring.scaled(factor),
        factor=factor,
        worst=worst,
        amplitude=amplitude,
        speed=speed,
        speed_ratio=speed_ratio,
        branch=branch,
        notes=(*branch.notes, *uncovered(branch, speed_ratio)),
    )


@analysis(speed="speed_ratio", relative=True)
def least_friction(
    family: AnyFamily,
    spring: Springs,
    speed_ratio: float,
    amplitude: float,
    options: CycleOptions | None = None,
    which: int = 0,
) -> Tolerance:
    """The least friction ΔV that keeps every stable cycle below an amplitude, at the given gap ΔH.

    Every larger friction that was tried, up to a hundred times the gap, is tolerable as well.

    Parameters
    ----------
    family, spring, speed_ratio, amplitude, options, which
        As for `tolerance`; the spring is a hysteresis loop with a gap.

    Returns
    -------
    Tolerance
        Its `factor` is the least ΔV over the one given.

    Raises
    ------
    InputError
        If the spring is not a hysteresis loop with a gap, or a number is not positive.
    ConvergenceError
        If no friction up to a hundred times the gap is enough, or stable cycles grow without bound.
    """
    _check(speed_ratio, amplitude)
    if len(each(spring)) > 1:
        return tolerance_among(
            "friction", family, each(spring), which, speed_ratio, amplitude, options
        )
    (spring,) = each(spring)
    if not isinstance(spring, Hysteresis) or not spring.delta_h > 0.0:
        raise InputError("spring.kind: friction belongs to a hysteresis loop with delta_h_deg > 0")

    loops = _Loops("friction", family, spring, speed_ratio, amplitude, options)
    good, bad = loops.bracket()
    if good is None:
        raise ConvergenceError(
            f"no friction is enough: with delta_v = {_FRICTIONS[1]:g} delta_h there still is a "
            "stable limit cycle above the amplitude"
        )
    return loops.answer(0.0 if bad is None else loops.bisected(good, bad))


@analysis(speed="speed_ratio", relative=True)
def largest_gap(
    family: AnyFamily,
    spring: Springs,
    speed_ratio: float,
    amplitude: float,
    options: CycleOptions | None = None,
    which: int = 0,
) -> Tolerance:
    """The largest gap ΔH that keeps every stable cycle below an amplitude, at the given friction.

    Every smaller gap that was tried, down to a hundredth of ΔV, is tolerable as well. Without
    friction the loop is freeplay, whose cycles grow as the gap does.

    Parameters
    ----------
    family, spring, speed_ratio, amplitude, options, which
        As for `tolerance`; the spring is a hysteresis loop, or freeplay.

    Returns
    -------
    Tolerance
        Its `factor` is the largest ΔH over the one given; its spring is None where any gap up to
        a hundred times ΔV is tolerable.

    Raises
    ------
    InputError
        If the spring has no gap to vary, or a number is not positive.
    ConvergenceError
        If even a gap of a hundredth of ΔV is too large, or stable cycles grow without bound.
    """
    _check(speed_ratio, amplitude)
    if len(each(spring)) > 1:
        return tolerance_among("gap", family, each(spring), which, speed_ratio, amplitude, options)
    (spring,) = each(spring)
    if not isinstance(spring, Hysteresis) or not spring.delta_v > 0.0:
        if isinstance(simplify(spring), Freeplay):
            return replace(tolerance(family, spring, speed_ratio, amplitude, options), vary="gap")
        raise InputError("spring.kind: a gap belongs to freeplay or to a hysteresis loop")
    loops = _Loops("gap", family, spring, speed_ratio, amplitude, options)
    good, bad = loops.bracket()
    if good is None:
        raise ConvergenceError(
            f"no gap is small enough: with delta_h = delta_v / {_FRICTIONS[1]:g} there still is a "
            "stable limit cycle above the amplitude"
        )
    if bad is not None:
        return loops.answer(loops.bisected(good, bad))
    note = f"no gap up to {1.0 / _FRICTIONS[0]:g} delta_v is too large; larger ones were not tried"
    found = loops.answer(good)
    return replace(found, spring=None, factor=float("inf"), notes=(*found.notes, note))


class _Loops:
    """Loops of one friction or of one gap, by the ratio ΔV/ΔH of the two."""

    def __init__(
        self,
        vary: str,
        family: AnyFamily,
        spring: Hysteresis,
        speed_ratio: float,
        amplitude: float,
        options: CycleOptions | None,
    ) -> None:
        self.vary, self.family, self.spring = vary, family, spring
        self.speed_ratio, self.amplitude, self.options = speed_ratio, amplitude, options
        self.ratios: list[float] = []
        self.tried: dict[float, float] = {}

    def at(self, ratio: float) -> Hysteresis:
        """The loop of a ratio."""
        if self.vary == "friction":
            return replace(self.spring, delta_v=ratio * self.spring.delta_h)
        return replace(self.spring, delta_h=self.spring.delta_v / ratio)

    def varied(self, loop: Hysteresis) -> float:
        """What varies."""
        return loop.delta_v if self.vary == "friction" else loop.delta_h

    def too_large(self, ratio: float) -> bool:
        """Whether a stable cycle up to the speed is larger than the amplitude."""
        coarse = replace(
            self.options or CycleOptions(), points=2
        )  # maxima are located all the same
        search = search_up_to(self.family, self.at(ratio), self.speed_ratio, coarse)
        worst = largest_stable(search, self.speed_ratio * search.frame.reference)
        self.ratios.append(ratio)
        self.tried[self.varied(self.at(ratio))] = 0.0 if worst is None else worst.amplitude
        return worst is not None and worst.amplitude > self.amplitude

    def bracket(self) -> tuple[float | None, float | None]:
        """The least ratio of a grid down to which all are good, and the next one, which is not."""
        decades = np.log10(_FRICTIONS[1] / _FRICTIONS[0])
        ratios = np.geomspace(*_FRICTIONS, int(_PER_DECADE * decades) + 1)[::-1]
        good = None
        for ratio in map(float, ratios):
            if self.too_large(ratio):
                return good, ratio
            good = ratio
        return good, None

    def bisected(self, good: float, bad: float) -> float:
        """The least ratio that is good, between one that is and one that is not."""

        def excess(exponent: float) -> float:
            self.too_large(ratio := float(np.exp(exponent)))
            return self._excess(ratio)

        ends = {np.log(one): self._excess(one) for one in (bad, good)}
        brentq(lambda x: ends.get(x) or excess(x), *ends, xtol=0.5 * _RELATIVE, rtol=1e-12)
        return min(one for one in self.ratios if bad < one <= good and self._excess(one) <= 0.0)

    def _excess(self, ratio: float) -> float:
        """ln of the largest amplitude over the one allowed; far below zero where there is none."""
        size = self.tried[self.varied(self.at(ratio))]
        return float(np.log(max(size, 1e-3 * self.amplitude) / self.amplitude))

    def answer(self, ratio: float) -> Tolerance:
        """The loop of a ratio, its cycles, and how it was come to."""
        found = self.at(ratio)
        search = search_up_to(self.family, found, self.speed_ratio, self.options)
        speed = self.speed_ratio * search.frame.reference
        branch, worst, given = (
            search.result(),
            largest_stable(search, speed),
            self.varied(self.spring),
        )
        return Tolerance(
            spring=found,
            factor=self.varied(found) / given if given else float("nan"),
            worst=worst,
            amplitude=self.amplitude,
            speed=speed,
            speed_ratio=self.speed_ratio,
            branch=branch,
            notes=(*branch.notes, *uncovered(branch, self.speed_ratio)),
            vary=self.vary,
            trials=tuple(sorted(self.tried.items())),
        )


def _check(speed_ratio: float, amplitude: float) -> None:
    problems = [
        f"{name}: must be a positive number, not {value!r}"
        for name, value in (("speed_ratio", speed_ratio), ("amplitude", amplitude))
        if not (np.isfinite(value) and value > 0.0)
    ]
    if problems:
        raise InputError(problems)


def search_up_to(
    family: AnyFamily, spring: Springs, speed_ratio: float, options: CycleOptions | None
) -> Search:
    """A finished search that covers the speed."""
    options = options or CycleOptions()
    if all(isinstance(simplify(one), Linear) for one in each(spring)):
        raise InputError("spring.kind: the spring is linear and has no limit cycles to keep small")
    if isinstance(family, FixedFamily | FixedModel):
        raise InputError("family: does not depend on speed; a tolerance is one up to a speed")
    low, high = options.speed_ratio_range
    search = Search(
        family,
        spring,
        replace(
            options,
            speed_ratio_range=(min(low, 0.98 * speed_ratio), max(high, 1.02 * speed_ratio)),
            largest=max(options.largest, _FAR),
        ),
    )
    if search.frame.flutter is None:
        raise InputError("speed_ratio: the section has no linear flutter speed to refer to")
    search.run(speed_ratio * search.frame.reference)
    return search


def largest_stable(search: Search, speed: float) -> Cycle | None:
    """The largest stable cycle up to a speed U*."""
    cycles = [cycle for family in search.families for cycle in family.facts.cycles]
    cycles += search.at(speed)
    worst = _largest(cycles, speed)
    tops = [top for family in search.families for top in _tops(family, speed)]
    for top in sorted(tops, key=lambda top: -top.most):
        if worst is None or top.most > worst.amplitude:
            worst = _largest([*top.located(), *([] if worst is None else [worst])], speed)
    if worst is not None and worst.amplitude > 0.9 * search.largest:
        raise ConvergenceError(
            f"stable limit cycles grow beyond {search.largest / search.frame.loop.spring.scale:g} "
            f"times the spring's scale at U*/U*_L = {worst.speed_ratio:.6g}: no size is tolerable",
            search.result(),
        )
    return worst


def _largest(cycles: Iterable[Cycle], speed: float) -> Cycle | None:
    """The largest of the stable cycles up to a speed U*."""
    candidates = [cycle for cycle in cycles if cycle.stable and cycle.speed <= speed * (1 + 1e-12)]
    return max(candidates, key=lambda cycle: cycle.amplitude, default=None)


class _Top(NamedTuple):
    """A cycle that is larger than its neighbours on a walk, between them.

    Attributes
    ----------
    places
        The three of them.
    most
        More than the amplitude between them: as far above the middle one as the others are below.
    """

    places: tuple[Place, Place, Place]
    most: float

    def located(self) -> list[Cycle]:
        """The largest cycles on its two sides."""
        before, top, after = self.places
        found = [_top(*pair) for pair in ((before, top), (top, after))]
        return [cycle for cycle in found if cycle is not None]


def _tops(family: Family, speed: float) -> Iterator[_Top]:
    """Local maxima of the amplitude along a family up to a speed U*, between places of its walk."""
    for strand in family.strands:
        for three in zip(strand.places, strand.places[1:], strand.places[2:], strict=False):
            left, most, right = (place.cycle.amplitude for place in three)
            reaches = min(place.cycle.speed for place in three) <= speed
            if reaches and three[1].cycle.stable and most >= max(left, right):
                yield _Top(three, 2.0 * most - min(left, right))


def _top(one: Place, other: Place) -> Cycle | None:
    """The largest cycle between two neighbours, None where they belong to different legs."""
    at = {}

    def smallness(fraction: float) -> float:
        place = between(one, other, fraction)
        if place is None:
            return 0.0
        at[fraction] = place.cycle
        return -place.cycle.amplitude

    best = minimize_scalar(smallness, bounds=(0.0, 1.0), method="bounded", options={"xatol": 1e-6})
    return at.get(best.x)


def uncovered(branch: LimitCycles, speed_ratio: float) -> list[str]:
    """Warnings of speeds at which there are cycles, but none of those found is stable."""
    if branch.stable_onset is None:
        return []
    covered = sorted(
        (min(pair), max(pair))
        for family in branch.families
        for one, other in zip(family.cycles, family.cycles[1:], strict=False)
        if one.stable and other.stable
        for pair in [(one.speed_ratio, other.speed_ratio)]
    )
    notes, reached = [], branch.stable_onset.cycle.speed_ratio
    for low, high in [*covered, (speed_ratio, speed_ratio)]:
        if reached + _NARROW < min(low, speed_ratio):
            notes.append(
                f"no stable limit cycle was found from U*/U*_L = {reached:.4f} to "
                f"{min(low, speed_ratio):.4f}: motion there may be aperiodic; `aeroflutter map` "
                "shows how large"
            )
        reached = max(reached, high)
    return notes
