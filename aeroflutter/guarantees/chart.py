"""Friction over gap that a hinge needs against speed: proved to be enough, and exactly.

A loop is scale-free, so what counts is ΔV/ΔH. The proved curve is a linear program a speed. The
exact one is where the lowest limit cycle reaches the speed: families found by whole searches at a
few ratios are followed from ratio to ratio.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aeroflutter.analysis import Result, analysis
from aeroflutter.errors import InputError
from aeroflutter.guarantees.absence.friction import Enough, Friction
from aeroflutter.linear.rootlocus import flutter_speed
from aeroflutter.model.lure import FixedFamily, LureFamily
from aeroflutter.orbits.cycles import CycleOptions, LimitCycles, family_near, limit_cycles
from aeroflutter.springs import Freeplay, Hysteresis, Spring

__all__ = ["Chart", "friction_chart"]

Array = NDArray[np.float64]

_SEARCH = CycleOptions(points=6, simulations=20, depth=0)
_SEARCHES = 5  # ratios at which all families are looked for
_RESOLVED = 1e-7  # of the speed
_STEPS = 12  # of the secant method
_LARGEST_STEP = 0.15  # in ln(ratio), that a family is followed at a time
_FIRST_STEP = 0.02
_ALIKE = 1e-5  # relative difference of ratios of one family


@dataclass(frozen=True, kw_only=True, eq=False)
class Chart(Result):
    """Friction over gap needed against speed.

    Attributes
    ----------
    flutter_speed
        U*_L; None without flutter.
    own
        ΔV/ΔH of the case.
    points
        The proved ratio at each speed, with its certificate.
    exact_ratios
        The ratio above which no limit cycle was found at or below each speed, (m,): zero where
        none is with any friction, NaN where the families could not be followed, infinite at and
        above flutter.
    notes
        What a reader should know.
    """

    flutter_speed: float | None
    own: float
    points: tuple[Enough, ...]
    exact_ratios: Array
    notes: tuple[str, ...]

    @property
    def speeds(self) -> Array:
        """U*, (m,)."""
        return np.array([one.speed for one in self.points])

    @property
    def speed_ratios(self) -> Array:
        """U*/U*_L, (m,)."""
        return self.speeds / (self.flutter_speed or np.nan)

    @property
    def proved_ratios(self) -> Array:
        """ΔV/ΔH from which on nothing oscillates at each speed, infinite where none is proved."""
        return np.array([one.ratio for one in self.points])

    @property
    def certified(self) -> bool:
        """Whether the checker has accepted every ratio that is called proved."""
        return all(one.certified for one in self.points if np.isfinite(one.ratio))


@analysis(speed="speeds")
def friction_chart(
    family: LureFamily,
    spring: Spring,
    speeds: ArrayLike,
    watch: Callable[[], None] = lambda: None,
) -> Chart:
    """How much friction, for its gap, a hinge needs at each of some speeds.

    Parameters
    ----------
    family
        A section at every speed.
    spring
        A loop or freeplay; its gap and its offsets count.
    speeds
        U*, (m,).
    watch
        Called when a speed is done.

    Raises
    ------
    InputError
        If the spring has no gap, or the family does not depend on speed.
    Uncovered
        If the proof does not cover the model.
    """
    loop = _loop(spring)
    if isinstance(family, FixedFamily):
        raise InputError("family: does not depend on speed; a chart is over speeds")
    enough, points = Friction(family), []
    for speed in np.sort(np.asarray(speeds, dtype=float)):
        points.append(enough.at(float(speed)))
        watch()
    flutter = flutter_speed(family)
    folds = _Folds(family, loop)
    exact = folds.ratios(points, np.inf if flutter is None else flutter)
    notes = []
    if any(np.isinf(one.ratio) and one.speed < (flutter or np.inf) for one in points):
        notes.append("no friction was proved to be enough at some speeds below flutter")
    if not all(one.certified for one in points if np.isfinite(one.ratio)):
        notes.append("not certified: that takes python-flint (pip install aeroflutter[certify])")
    if np.isnan(exact).any():
        notes.append("the families of limit cycles could not be followed to some speeds")
    own = loop.delta_v / loop.delta_h
    return Chart(
        flutter_speed=flutter,
        own=own,
        points=tuple(points),
        exact_ratios=exact,
        notes=tuple(notes),
    )


def _loop(spring: Spring) -> Hysteresis:
    if isinstance(spring, Freeplay):
        return Hysteresis(0.0, spring.gap, 0.0, spring.centre)
    if not isinstance(spring, Hysteresis) or not spring.delta_h > 0.0:
        raise InputError("spring.kind: friction over gap is of a loop with delta_h_deg > 0")
    return spring


class _Folds:
    """The speed of the lowest cycle as a function of friction over gap, and its inverse."""

    def __init__(self, family: LureFamily, loop: Hysteresis) -> None:
        self.family, self.loop = family, loop

    def spring(self, ratio: float) -> Hysteresis:
        return replace(self.loop, delta_v=ratio * self.loop.delta_h)

    def searched(self, ratio: float) -> LimitCycles:
        return limit_cycles(self.family, self.spring(ratio), _SEARCH)

    def ratios(self, points: Sequence[Enough], flutter: float) -> Array:
        """The exact ratio at every point.

        All families are looked for at proved ratios of some points; between two of them the
        family is followed down from the upper one, and up from the lower one if it is another.
        """
        found = np.array([np.inf if one.speed >= flutter else np.nan for one in points])
        found[[one.ratio == 0.0 for one in points]] = 0.0
        asked = [i for i, one in enumerate(points) if 0.0 < one.ratio < np.inf]
        if not asked:
            return found
        places = sorted({asked[int(k)] for k in np.linspace(0, len(asked) - 1, _SEARCHES).round()})
        nodes = {k: self._at(self.searched(points[k].ratio), points[k], None) for k in places}
        self._walk(nodes[places[-1]], points, range(places[-1], len(points)), found)
        for low, high in zip([0, *places], places, strict=False):
            reached = self._walk(nodes[high], points, range(high, low - 1, -1), found)
            below = nodes.get(low)
            if low != high and below is not None and not _same(reached, below):
                self._walk(below, points, range(low, high + 1), found)
        return found

    def _walk(
        self, hit: _Hit | None, points: Sequence[Enough], way: Sequence[int], found: Array
    ) -> _Hit | None:
        """Follow a family over speeds; where it needs more friction than is known, that counts."""
        for i in way:
            if 0.0 < points[i].ratio < np.inf and hit is not None:
                hit = self._at(hit.cycles, points[i], hit) or self._at(
                    self.searched(points[i].ratio), points[i], None
                )
                if hit is not None:
                    found[i] = np.fmax(found[i], hit.ratio)
        return hit

    def _at(self, known: LimitCycles, point: Enough, last: _Hit | None) -> _Hit | None:
        """The ratio at which the lowest cycle of a family reaches a speed, by secants in ln."""
        if known.onset is None:
            return None
        x = np.log(point.ratio if last is None else last.ratio)
        slope = None if last is None else last.slope
        y = known.onset.cycle.speed - point.speed
        for _ in range(_STEPS):
            if abs(y) < _RESOLVED * point.speed:
                return _Hit(known, float(np.exp(x)), slope)
            step = -y / slope if slope else -float(np.sign(y)) * _FIRST_STEP
            step = float(np.clip(step, -_LARGEST_STEP, _LARGEST_STEP))
            near = family_near(self.family, self.spring(float(np.exp(x + step))), known)
            if near.onset is None:
                return None
            there = near.onset.cycle.speed - point.speed
            slope = (there - y) / step if there != y else slope
            x, y, known = x + step, there, near
        return None


@dataclass(frozen=True, eq=False)
class _Hit:
    """A family at the ratio at which its lowest cycle has a speed; dU/d ln(ratio) there."""

    cycles: LimitCycles
    ratio: float
    slope: float | None


def _same(one: _Hit | None, other: _Hit) -> bool:
    return one is not None and abs(one.ratio / other.ratio - 1.0) < _ALIKE
