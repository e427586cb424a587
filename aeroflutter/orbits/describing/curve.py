"""The amplitude curve: every family of cycles, its points, its onset."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aeroflutter.analysis import analysis
from aeroflutter.errors import InputError
from aeroflutter.linear.rootlocus import RootLocusOptions, flutter_point
from aeroflutter.model.absorbed import reduced
from aeroflutter.model.lure import (
    AnyFamily,
    FixedFamily,
    LureFamily,
    as_family,
    as_lure,
)
from aeroflutter.motion.swings import Swing
from aeroflutter.orbits.describing.balance import AMPLITUDE, Balance
from aeroflutter.orbits.describing.coalescence import Coalescence, reversible
from aeroflutter.orbits.describing.distortion import harmonics
from aeroflutter.orbits.describing.families import Domain, Family, find_families
from aeroflutter.orbits.describing.onset import family_facts
from aeroflutter.orbits.describing.options import DescribingOptions
from aeroflutter.orbits.describing.result import CycleFamily, DescribingCurve
from aeroflutter.orbits.describing.stability import stability
from aeroflutter.orbits.result import Bifurcation, Cycle, lowest
from aeroflutter.springs import Linear, Spring, Springs, each, simplify

__all__ = ["describing_at", "describing_curve"]

Array = NDArray[np.float64]
Place = TypeVar("Place", bound=Bifurcation)

_STATIONS = 100  # cycles along a family from which its onset is told where no curve is returned


@analysis()
def describing_curve(
    family: AnyFamily, spring: Springs, options: DescribingOptions | None = None
) -> DescribingCurve:
    """The complete amplitude-against-speed curve of a loop, by the describing function.

    Parameters
    ----------
    family
        The linear system at every speed.
    spring
        The restoring moment; degenerate laws are simplified first. Of several springs a sequence,
        one an output: then every spring has an amplitude, a phase and a bias, `amplitude` and
        `bias` are those of the first, and nothing is proved.
    options
        Ranges of amplitude and speed, and density.

    Returns
    -------
    DescribingCurve
        Points along every family, by ascending amplitude at its start.

    Raises
    ------
    InputError
        If the system does not depend on speed (`describing_intersections` is for that), or no
        speed lies in the ranges.

    Examples
    --------
    >>> from aeroflutter.model.lure import SectionFamily
    >>> from aeroflutter.model.section import TypicalSection
    >>> from aeroflutter.springs import Hysteresis
    >>> section = SectionFamily(TypicalSection(omega_bar=0.8))
    >>> round(describing_curve(section, Hysteresis(1.0, 0.2)).onset.speed_ratio, 3)
    0.921
    """
    options = options or DescribingOptions()
    family, springs = reduced(family, each(spring))
    if len(springs) > 1:
        from aeroflutter.orbits.describing.several_curve import joint_curve

        return joint_curve(family, springs, options)
    search = _Search(as_lure(family), springs[0], options)
    return search.result([_ascending(search.add(one, options.points)) for one in search.families])


@analysis()
def describing_at(
    family: AnyFamily,
    spring: Springs,
    amplitudes: ArrayLike,
    options: DescribingOptions | None = None,
) -> DescribingCurve:
    """Every cycle of exactly the given amplitudes, with the families and onset of the curve.

    Parameters
    ----------
    amplitudes
        Radians, shape (m,); the range of amplitudes is widened to contain them.

    Raises
    ------
    InputError
        As `describing_curve`, or if an amplitude is not finite and positive.
    """
    wanted = np.unique(np.asarray(amplitudes, dtype=float))
    if wanted.size == 0 or not np.all(np.isfinite(wanted) & (wanted > 0)):
        raise InputError("amplitudes: must be finite positive numbers, at least one")
    options = options or DescribingOptions()
    family, springs = reduced(family, each(spring))
    if len(springs) > 1:
        from aeroflutter.orbits.describing.several_curve import joint_curve

        return joint_curve(family, springs, options, wanted)
    low, high = options.amplitudes(simplify(springs[0]))
    low, high = min(low, float(wanted[0])), max(high, float(wanted[-1]))
    search = _Search(
        as_lure(family), springs[0], replace(options, amplitude_range=(low, high)), wanted
    )
    for one in search.families:
        search.add(one, _STATIONS)
    return search.result([one.located(np.log(wanted))[0] for one in search.families])


class _Search:
    """Families of a loop and spring, and how their points become a result."""

    def __init__(
        self,
        family: LureFamily,
        spring: Spring,
        options: DescribingOptions,
        extra: Array | None = None,
    ) -> None:
        if isinstance(family, FixedFamily):
            raise InputError(
                "family: does not depend on speed, so there is no curve over it; "
                "use describing_intersections"
            )
        self.family, self.spring, self.options = family, simplify(spring), options
        point = flutter_point(family, RootLocusOptions(stiffness=options.stiffness))
        self.flutter = None if point is None else point.speed
        self.speeds = options.speeds(family, self.flutter)
        self.range = options.amplitudes(self.spring)
        self.notes: list[str] = []
        self.numbered: list[CycleFamily] = []
        self.families: list[Family] = []
        for balance in self._balances():
            low = self.range[0]
            if balance.biased and options.amplitude_range is None:
                low = min(low, 0.01 * self.spring.scale)
            domain = Domain((low, self.range[1]), self._grid())
            new, lost = find_families(balance, domain, options.scan_amplitudes, extra)
            self.families += new
            self.notes += [f"a family could not be followed from {line}" for line in lost]
        self.families.sort(key=lambda one: one.lowest())
        if not self.families:
            low, high = self.speeds
            self.notes.append(f"no limit cycle of any amplitude between U* = {low:g} and {high:g}")

    def _grid(self) -> Array:
        return np.geomspace(*self.speeds, self.options.scan_speeds)

    def _balances(self) -> list[Balance]:
        """The systems of equations whose families make up the curve."""
        kind = Balance
        if reversible(self.family, self._grid()):
            sample = self.spring.describing(np.geomspace(*self.range, 64), 0.0)
            if np.any(sample.n_q):
                self.notes.append(
                    "the linear system has no damping, so a spring that dissipates has no cycles"
                )
                return []
            kind = Coalescence
            self.notes.append(
                "the linear system has no damping: the curve is where two frequencies coalesce, "
                "and cycles below it neither grow nor decay"
            )
        biased = kind(self.family, self.spring, True)
        return [kind(self.family, self.spring, False), biased] if self.spring.odd else [biased]

    def add(self, family: Family, count: int) -> Array:
        """Number a family, gather its facts, and return `count` cycles on it."""
        facts, y = family_facts(family, len(self.numbered) + 1, self.flutter, count)
        self.numbered.append(facts)
        return y

    def result(self, found: list[Array]) -> DescribingCurve:
        """Points of numbered families, with the mirror images of biased ones of odd springs."""
        parts = [
            self._points(family, facts.number, y)
            for family, facts, y in zip(self.families, self.numbered, found, strict=True)
        ]
        for original, part in list(zip(self.numbered, parts, strict=True)):
            if original.biased and self.spring.odd:
                number = len(self.numbered) + 1
                self.numbered.append(_mirrored(original, number))
                own = np.full_like(part["family"], number)
                parts.append(part | {"bias": -part["bias"], "family": own})
        if not parts:
            parts = [self._points(None, 0, np.empty((0, 4)))]
        isolated = not isinstance(self.spring, Linear)
        if self.families and not isolated:
            self.notes.append(
                "the spring is linear: at the flutter speed there are cycles of any amplitude, and "
                "no onset of limit cycles"
            )
        arrays = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
        return DescribingCurve(
            **arrays,
            families=tuple(self.numbered),
            flutter_speed=self.flutter,
            onset=lowest(one.onset for one in self.numbered if isolated),
            stable_onset=lowest(one.stable_onset for one in self.numbered if isolated),
            amplitude_range=self.range,
            speed_range=self.speeds,
            notes=tuple(self.notes),
            swings=partial(_swings, self.family, arrays),
        )

    def _points(self, family: Family | None, number: int, y: Array) -> dict[str, Array]:
        balance = family.balance if family else Balance(self.family, self.spring, True)
        A, B, U, k = balance.unpack(y)
        d = self.spring.describing(A, B)
        rules = stability(balance, y, d)
        ratios = harmonics(balance, y, d, self.options.harmonics, self.options.samples)
        low, high = self.spring.span()
        room = 1e-12 * self.spring.scale
        return {
            "amplitude": A,
            "bias": B,
            "speed": U,
            "speed_ratio": U / self.flutter if self.flutter else np.full_like(U, np.nan),
            "k": k,
            "n_p": d.n_p,
            "n_q": d.n_q,
            "family": np.full(A.shape, number),
            "stable": rules.stable,
            "drift": rules.drift,
            "slope": rules.slope,
            "others": rules.others,
            "bias_stable": rules.bias_stable,
            "rules_agree": rules.rules_agree,
            "harmonics": ratios,
            "distortion": np.linalg.norm(ratios, axis=1),
            "in_thesis_range": (low - room > B - A) & (high + room < B + A),
        }


def _swings(
    family: LureFamily, arrays: dict[str, Array], i: int
) -> tuple[tuple[Swing, ...], tuple[Swing, ...]]:
    """How far coordinates and the spring move at point i."""
    from aeroflutter.orbits.harmonic.swings import harmonic_swings

    A, B, k, speed = (float(arrays[name][i]) for name in ("amplitude", "bias", "k", "speed"))
    return harmonic_swings(as_family(family), Cycle(np.array([B, -1j * A]), k, speed))


def _ascending(y: Array) -> Array:
    return y[::-1] if y[-1, AMPLITUDE] < y[0, AMPLITUDE] else y


def _mirrored(family: CycleFamily, number: int) -> CycleFamily:
    def turn(cycle: Cycle) -> Cycle:
        Y = cycle.Y * np.where(np.arange(cycle.Y.size) % 2, 1.0, -1.0)
        return replace(cycle, Y=Y, bias=-cycle.bias, family=number)

    def flip(at: Place) -> Place:
        return replace(at, cycle=turn(at.cycle))

    return replace(
        family,
        number=number,
        mirror_of=family.number,
        cycles=tuple(turn(cycle) for cycle in family.cycles),
        onset=flip(family.onset),
        stable_onset=flip(family.stable_onset) if family.stable_onset else None,
        bifurcations=tuple(flip(fold) for fold in family.bifurcations),
    )
