"""Every limit cycle at one speed, or of one system that does not depend on speed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from aeroflutter.analysis import Result, analysis
from aeroflutter.errors import InputError
from aeroflutter.model.family import FixedModel, Matrices
from aeroflutter.model.lure import AnyFamily, FixedFamily, as_system
from aeroflutter.model.system import System
from aeroflutter.orbits.cycles.follow import LARGEST
from aeroflutter.orbits.cycles.options import CycleOptions
from aeroflutter.orbits.cycles.result import Cycle, LimitCycles
from aeroflutter.orbits.cycles.search import Search
from aeroflutter.springs import Springs

__all__ = ["CyclesAt", "cycles_at"]

_GAINS = (0.2, 5.0)  # over which the cycles of one system are followed
_FAR = 2000.0  # amplitude followed, in units of the spring's scale: near U*_L cycles are large


@dataclass(frozen=True, kw_only=True, eq=False)
class CyclesAt(Result):
    """The limit cycles at one speed.

    Attributes
    ----------
    speed, speed_ratio
        U* and U*/U*_L (NaN without a flutter speed).
    cycles
        Every cycle found there, by amplitude; of a pair of mirror images one.
    branch
        The families that were followed to find them.
    """

    speed: float
    speed_ratio: float
    cycles: tuple[Cycle, ...]
    branch: LimitCycles


@analysis(speed="speed")
def cycles_at(
    family: AnyFamily,
    spring: Springs,
    speed: float,
    options: CycleOptions | None = None,
    watch: Callable[[Cycle], None] = lambda cycle: None,
) -> CyclesAt:
    """Every limit cycle at one speed, stable or not.

    All families that lead through that speed are followed, so unstable cycles are found however
    far they are from anything a simulation would show.

    Parameters
    ----------
    family, spring
        As for `limit_cycles`. A family that does not depend on speed is closed with a gain from
        0.2 to 5 instead, and its cycles are those at gain 1.
    speed
        U*; its value does not matter where the family does not depend on it.
    options
        Where to look; the range of speeds is widened to contain `speed`.
    watch
        Called with every cycle found on the way.

    Raises
    ------
    InputError
        If the spring is not piecewise linear, or the speed outside what the family covers.

    Examples
    --------
    >>> from aeroflutter import Hysteresis, SectionFamily, TypicalSection
    >>> section = SectionFamily(TypicalSection(omega_bar=0.8))
    >>> found = cycles_at(section, Hysteresis(1.0, 0.2), 3.9)
    >>> [(round(cycle.amplitude, 6), cycle.stable) for cycle in found.cycles]
    [(0.559484, False), (1.283152, True)]
    """
    options = options or CycleOptions()
    fixed, asked = isinstance(family, FixedFamily | FixedModel), speed
    if isinstance(family, FixedFamily | FixedModel):
        family, speed = _GainFamily(as_system(family.system)), 1.0
    low, high = family.search_range
    if not low <= speed <= high:
        raise InputError(f"speed: must lie between {low:g} and {high:g}, not {speed!r}")
    search = Search(family, spring, options, watch)
    ratio = speed / search.frame.reference
    spans = _GAINS if fixed else options.speed_ratio_range
    unit = search.frame.reference if fixed else 1.0
    span = min(spans[0] / unit, 0.98 * ratio), max(spans[1] / unit, 1.02 * ratio)
    search.options = replace(options, speed_ratio_range=span, largest=max(options.largest, _FAR))
    search.run(speed)
    found = search.result()
    if fixed:  # what is a speed of the search is a gain, of which nobody has asked
        own = tuple(
            replace(cycle, speed=asked, speed_ratio=float("nan")) for cycle in search.at(speed)
        )
        branch = replace(found, onset=None, stable_onset=None)
        return CyclesAt(speed=asked, speed_ratio=float("nan"), cycles=own, branch=branch)
    return CyclesAt(
        speed=speed,
        speed_ratio=speed / search.frame.flutter if search.frame.flutter else float("nan"),
        cycles=search.at(speed),
        branch=replace(found, notes=(*found.notes, *_too_large(search, speed))),
    )


def _too_large(search: Search, speed: float) -> Iterator[str]:
    """What is not known at the speed: families grow without end towards the reference speed."""
    for family in search.families:
        for strand in family.strands:
            last = strand.end.cycle.speed
            towards = (speed - last) * (search.frame.reference - speed) >= 0.0
            if strand.stop.startswith(LARGEST) and towards:
                yield (
                    f"family {family.facts.number} was followed no further than to "
                    f"{search.options.largest:g} times the spring's scale: at the speed asked for "
                    "its cycle is larger, if it has one"
                )


@dataclass(frozen=True, eq=False)
class _GainFamily:
    """x' = A x - gain B F(C x) + d: a family that passes through a fixed system at gain 1."""

    system: System

    @property
    def names(self) -> tuple[str, ...]:
        return self.system.names

    @property
    def units(self) -> tuple[str, ...]:
        return self.system.units

    @property
    def state_names(self) -> tuple[str, ...]:
        return self.system.state_names

    @property
    def search_range(self) -> tuple[float, float]:
        return _GAINS

    @property
    def scale(self) -> None:
        return None

    def at(self, speed: float) -> System:
        return replace(self.system, B=speed * self.system.B)

    def stack(self, speeds: ArrayLike) -> Matrices:
        gain = np.asarray(speeds, dtype=float)
        A, B, C, d = (
            np.broadcast_to(part, (*gain.shape, *part.shape))
            for part in (self.system.A, self.system.B, self.system.C, self.system.load)
        )
        return A, gain[..., None, None] * B, C, d

    def derivative(self, speeds: ArrayLike) -> Matrices:
        A, _, C, d = (np.zeros(part.shape) for part in self.stack(speeds))
        return A, np.broadcast_to(self.system.B, (*np.shape(speeds), *self.system.B.shape)), C, d
