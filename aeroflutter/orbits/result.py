"""What is said of cycles, whichever method found them: one set of types, one way to an onset.

The method of a cycle is "describing" (a sinusoid), "harmonic" (harmonic balance) or "exact".
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import KW_ONLY, dataclass, field
from functools import cached_property
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from aeroflutter.motion.swings import Swing
from aeroflutter.orbits.spectrum import FOLD

__all__ = [
    "Bifurcation",
    "Branch",
    "Cycle",
    "Onset",
    "Place",
    "Spot",
    "bifurcations",
    "lowest",
    "onset",
    "stable_beside",
    "stable_onset",
]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

Swings = Callable[[], tuple[tuple[Swing, ...], tuple[Swing, ...]]]

_NOWHERE = float("nan")
EDGE, GRAZING, CORNER = "edge", "grazing", "corner"


def _nothing() -> Complex:
    return np.empty(0, dtype=complex)


def _no_outputs() -> Complex:
    return np.empty((0, 0), dtype=complex)


def _unmeasured() -> tuple[tuple[Swing, ...], tuple[Swing, ...]]:
    return (), ()


@dataclass(frozen=True, eq=False)
class Cycle:
    """A periodic motion of y at one speed, stable or not; harmonics, frequency and speed say which.

    Attributes
    ----------
    Y
        Harmonics 0 … H of y = Re Σ Y_k e^(jkωτ), (H+1,), radians. The first alone for a
        describing function; exact cycles carry a few, from where their state is.
    outputs
        The same of every spring's coordinate, (m, H+1), where there are several springs; else
        empty.
    omega
        Reduced frequency k.
    speed
        U*.
    speed_ratio
        U*/U*_L (NaN without a flutter speed).
    amplitude, bias
        Half the peak-to-peak and midrange of y over a period, radians.
    multipliers
        Floquet multipliers of the whole period, (n,), the trivial one first; none where they
        were not computed.
    stable
        Whether all but the trivial one (and the one along a continuum of bias) are inside the
        unit circle; for a describing function by its quasi-static rules.
    symmetric
        Whether the second half of the period mirrors the first.
    continuum
        Whether it is one of a continuum that differs in bias only; another multiplier is then one.
    family
        Number of its family; 0 outside of one.
    method
        "describing", "harmonic" or "exact".
    state, memory
        A point on an exact cycle, (n,), and the spring's memory there; of several springs (m,).
    closure
        Largest difference between that point and where the exact flow brings it after one period,
        in units of each state's own size.
    switches
        Number of switches of the springs a period.
    swings
        Measures how far coordinates and springs move, when it is asked.
    """

    Y: Complex
    omega: float
    speed: float
    _: KW_ONLY
    speed_ratio: float = _NOWHERE
    amplitude: float = _NOWHERE
    bias: float = _NOWHERE
    multipliers: Complex = field(default_factory=_nothing)
    stable: bool = False
    symmetric: bool = False
    continuum: bool = False
    family: int = 0
    method: str = "harmonic"
    state: Array = field(default_factory=lambda: np.empty(0))
    memory: Any = _NOWHERE
    closure: float = _NOWHERE
    switches: int = 0
    outputs: Complex = field(default_factory=_no_outputs)
    swings: Swings = field(default=_unmeasured, repr=False)

    @property
    def motions(self) -> Complex:
        """Harmonics of every spring's coordinate, (m, H+1)."""
        return self.outputs if self.outputs.size else self.Y[None]

    @cached_property
    def _swings(self) -> tuple[tuple[Swing, ...], tuple[Swing, ...]]:
        return self.swings()

    @property
    def coordinates(self) -> tuple[Swing, ...]:
        """How far every named coordinate moves."""
        return self._swings[0]

    @property
    def springs(self) -> tuple[Swing, ...]:
        """How far every spring moves."""
        return self._swings[1]

    @property
    def first_harmonic(self) -> float:
        """Amplitude of the first harmonic, radians."""
        return float(abs(self.Y[1]))

    @property
    def period(self) -> float:
        """Period of the whole motion, τ."""
        return float(2 * np.pi / self.omega)

    @property
    def k(self) -> float:
        """Reduced frequency."""
        return self.omega


@dataclass(frozen=True, kw_only=True, eq=False)
class Bifurcation:
    """A place on a branch where something happens, and the cycle there.

    Attributes
    ----------
    kind
        "fold", "corner" (an extremum of the speed, or a turn of the curve, where the equations
        have a kink), "symmetry-breaking", "period-doubling", "neimark-sacker", or "grazing"
        (the sequence of switches changes).
    cycle
        The cycle there.
    stable_beside
        Whether the cycles just before and after it along the branch are stable.
    index
        Position among the branch's cycles before which it lies.
    """

    kind: str
    cycle: Cycle
    stable_beside: tuple[bool, bool]
    index: int = 0

    @property
    def speed(self) -> float:
        """U* of the cycle."""
        return self.cycle.speed

    @property
    def speed_ratio(self) -> float:
        """U*/U*_L of the cycle."""
        return self.cycle.speed_ratio

    @property
    def amplitude(self) -> float:
        """Amplitude of the cycle, radians."""
        return self.cycle.amplitude

    @property
    def bias(self) -> float:
        """Midrange of the cycle, radians."""
        return self.cycle.bias

    @property
    def k(self) -> float:
        """Reduced frequency of the cycle."""
        return self.cycle.omega

    @property
    def family(self) -> int:
        """Number of the cycle's family."""
        return self.cycle.family


@dataclass(frozen=True, kw_only=True, eq=False)
class Onset(Bifurcation):
    """The lowest cycle, or lowest stable cycle; `kind` is "edge" where the branch just ends.

    Attributes
    ----------
    stable
        Whether there are stable cycles beside it; None where stability was not computed.
    beside
        Stability of the cycles just below and just above it in amplitude.
    """

    stable: bool | None
    beside: tuple[bool, bool] = (False, False)


@dataclass(frozen=True, kw_only=True, eq=False)
class Branch:
    """One family of cycles, in the order in which it was followed.

    Attributes
    ----------
    number
        From 1; 0 for a branch from a start of the user's.
    cycles
        Its cycles.
    bifurcations
        What was located on it, in order.
    ends
        Why it ends, at its first and at its last cycle.
    closed
        Whether it is a closed loop.
    onset, stable_onset
        Its lowest cycle, and its lowest stable one (None if there is none).
    symmetric
        Whether its cycles mirror themselves after half a period.
    origin
        Where its first cycle came from.
    parent
        Number of the family that it bifurcates from; None if it was found by itself.
    mirror_of
        For the mirror image of a family of an odd loop, the number of the original.
    """

    number: int
    cycles: tuple[Cycle, ...]
    bifurcations: tuple[Bifurcation, ...]
    ends: tuple[str, str]
    closed: bool
    onset: Onset
    stable_onset: Onset | None
    symmetric: bool
    origin: str = ""
    parent: int | None = None
    mirror_of: int | None = None

    @property
    def stopped(self) -> tuple[str, str]:
        """Why it ends, at its first and at its last cycle."""
        return self.ends

    @property
    def biased(self) -> bool:
        """Whether its cycles do not mirror themselves: their mean is free."""
        return not self.symmetric

    @property
    def folds(self) -> tuple[Bifurcation, ...]:
        """Where the speed turns, smoothly or at a corner."""
        return tuple(one for one in self.bifurcations if one.kind in (FOLD, CORNER))

    @property
    def stops(self) -> tuple[str, str]:
        """Why it ends, at its first and at its last cycle."""
        return self.ends


class Place(Protocol):
    """A cycle in the order of a branch, and what happens there: nothing where `kind` is empty."""

    @property
    def cycle(self) -> Cycle: ...

    @property
    def kind(self) -> str: ...


class Spot(NamedTuple):
    """A place with nothing else to it."""

    cycle: Cycle
    kind: str = ""


def stable_beside(places: Sequence[Place], i: int) -> tuple[bool, bool]:
    """Stability of the nearest plain cycles before and after a place; False where is none."""
    before = (place.cycle.stable for place in reversed(places[:i]) if not place.kind)
    after = (place.cycle.stable for place in places[i + 1 :] if not place.kind)
    return next(before, False), next(after, False)


def bifurcations(places: Sequence[Place], kept: Sequence[bool]) -> tuple[Bifurcation, ...]:
    """What happens along a branch of whose places some are `kept` as its cycles."""
    before = np.cumsum([0, *kept])
    return tuple(
        Bifurcation(
            kind=place.kind,
            cycle=place.cycle,
            stable_beside=stable_beside(places, i),
            index=int(before[i]),
        )
        for i, place in enumerate(places)
        if place.kind
    )


def onset(places: Sequence[Place], among: Iterable[int] | None = None) -> Onset:
    """The place of lowest speed.

    Parameters
    ----------
    places
        A whole branch in order; what happens on it stands between plain cycles.
    among
        Indices to choose from; all by default.
    """
    i = min(range(len(places)) if among is None else among, key=lambda i: places[i].cycle.speed)
    place, sides = places[i], stable_beside(places, i)
    smaller, larger = sides if _rises(places, i) else sides[::-1]
    return Onset(
        kind=_kind(places, i),
        cycle=place.cycle,
        stable_beside=sides,
        index=i,
        stable=any(sides) or (not place.kind and place.cycle.stable),
        beside=(smaller, larger),
    )


def stable_onset(places: Sequence[Place]) -> Onset | None:
    """The lowest of the stable cycles and of what happens beside them; None if there is none."""
    among: set[int] = set()
    for i, place in enumerate(places):
        if not place.kind and place.cycle.stable:
            among.add(i)
            among.update(j for j in (i - 1, i + 1) if 0 <= j < len(places) and places[j].kind)
    return onset(places, sorted(among)) if among else None


def lowest(onsets: Iterable[Onset | None]) -> Onset | None:
    """The onset at the lowest speed."""
    present = [one for one in onsets if one is not None]
    return min(present, key=lambda one: one.cycle.speed, default=None)


def _kind(places: Sequence[Place], i: int) -> str:
    kind = places[i].kind or EDGE
    if kind != GRAZING:
        return kind
    if i in (0, len(places) - 1):
        return EDGE
    speeds = [place.cycle.speed for place in places[i - 1 : i + 2]]
    return CORNER if speeds[1] <= min(speeds[0], speeds[2]) else GRAZING


def _rises(places: Sequence[Place], i: int) -> bool:
    """Whether the amplitude grows along the branch at a place."""
    around = places[max(i - 1, 0) : i + 2]
    return around[-1].cycle.amplitude >= around[0].cycle.amplitude
