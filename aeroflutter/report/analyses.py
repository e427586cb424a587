"""The analyses of a report: each is tried, and one that does not apply leaves a note instead."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from aeroflutter.errors import ConvergenceError, InputError
from aeroflutter.guarantees import Guarantees, guarantees
from aeroflutter.guarantees.absence import Absence, Uncovered, absence
from aeroflutter.linear.rootlocus import RootLocus, root_locus
from aeroflutter.model.lure import AnyFamily, as_lure
from aeroflutter.motion.response import Initial
from aeroflutter.orbits.cycles import LimitCycles, limit_cycles
from aeroflutter.orbits.describing import DescribingCurve, describing_curve
from aeroflutter.orbits.harmonic import HarmonicBranch, HarmonicOptions, harmonic_families
from aeroflutter.results.unit import start_unit, told_of
from aeroflutter.springs import Linear, Springs, each, simplify, straight
from aeroflutter.studies.cases import CaseCells
from aeroflutter.studies.maps import (
    Axis,
    Cells,
    Executor,
    FlutterMap,
    Grid,
    MapOptions,
    SpeedPitch,
    flutter_map,
)
from aeroflutter.studies.maps.engines import MARCH
from aeroflutter.studies.maps.grid import ratios_around, round_values

if TYPE_CHECKING:
    from aeroflutter.case import Case

__all__ = ["MOST_CELLS", "Analyses", "ReportOptions", "analyse", "period"]

Array = NDArray[np.float64]
Result = TypeVar("Result")

MOST_CELLS = 1200  # whose traces one page holds
COLUMNS, ROWS = 41, 15  # of the map where nothing else is asked
PATIENCE = 1000.0  # periods after which a cell of a smooth spring stays undecided
PROVING = 10.0  # s of the processor for each half of the search for a proof
SEVERAL = HarmonicOptions(tolerance=3e-4, max_harmonics=41, max_step=0.1)  # minutes, else
FASTEST = 20.0  # U* up to which the map goes where nothing flutters


@dataclass(frozen=True, kw_only=True)
class ReportOptions:
    """What the map and its traces cover.

    Parameters
    ----------
    speed_ratios : array (m,), optional
        Speeds of the map over U*_L, ascending; by default from below the onset of limit cycles to
        above flutter.
    speeds : array (m,), optional
        Speeds U* instead, for sections without flutter.
    pitches_deg : array (m,), optional
        Initial pitches of the map in degrees, ascending; by default up to twice the case's own.
        Of a model from a file, displacements of its first spring, in metres if that is in metres.
    periods : float
        Length of a trace, in periods of linear flutter; of uncoupled pitch where nothing flutters.

    Raises
    ------
    InputError
        If both kinds of speed are given, the map has too many cells or no trace a length.
    """

    speed_ratios: Array | None = None
    speeds: Array | None = None
    pitches_deg: Array | None = None
    periods: float = 12.0

    def __post_init__(self) -> None:
        problems = []
        if self.speeds is not None and self.speed_ratios is not None:
            problems.append("speeds: excludes speed_ratios; give one of the two")
        if not 1.0 <= self.periods <= 100.0:
            problems.append(f"periods: must lie between 1 and 100, not {self.periods!r}")
        columns = self.speeds if self.speed_ratios is None else self.speed_ratios
        cells = _count(columns, COLUMNS) * _count(self.pitches_deg, ROWS)
        if cells > MOST_CELLS:
            problems.append(
                f"map: {cells} cells are more than the {MOST_CELLS} whose traces a page holds; "
                "take fewer speeds or pitches"
            )
        if problems:
            raise InputError(problems)


def _count(values: Array | None, default: int) -> int:
    return default if values is None else int(np.size(values))


@dataclass(frozen=True, kw_only=True, eq=False)
class Analyses:
    """Everything that a report shows of a case.

    Attributes
    ----------
    case : Case
    options : ReportOptions
    locus : RootLocus
    curve, guaranteed
        Describing function, and what is proved of it; None where it has none.
    branches
        Harmonic balance, family by family; empty where it found none.
    cycles
        Exact cycles; None where the spring is not piecewise linear.
    free
        What is proved free of oscillation; None where nothing is.
    map : FlutterMap
        None for a model from a file, which has no pitch for motions to start from.
    notes
        Why something is missing, and what the analyses themselves remark.
    """

    case: Case
    options: ReportOptions
    locus: RootLocus
    curve: DescribingCurve | None
    guaranteed: Guarantees | None
    branches: tuple[HarmonicBranch, ...]
    cycles: LimitCycles | None
    free: Absence | None
    map: FlutterMap | None
    notes: tuple[str, ...]

    @cached_property
    def loop(self) -> tuple[AnyFamily, Springs]:
        """What every motion of the page is one of."""
        return self.case.loop()

    @property
    def flutter(self) -> float | None:
        """U*_L, or None."""
        return None if self.locus.flutter is None else self.locus.flutter.speed

    @property
    def unit(self) -> float:
        """U* of one unit of the page: of 1 m/s where there are SI data, else U*_L, or 1."""
        scale = self.case.scale
        return (self.flutter or 1.0) if scale is None else scale.speed(1.0)


def analyse(
    case: Case,
    options: ReportOptions | None = None,
    *,
    executor: Executor | None = None,
    progress: Callable[[str], None] = lambda step: None,
) -> Analyses:
    """Run every analysis of a report.

    Parameters
    ----------
    case : Case
    options : ReportOptions, optional
    executor : Executor, optional
        Who computes the map.
    progress : callable, optional
        Called with the name of each step before it begins.

    Raises
    ------
    InputError
        If the map that is asked for cannot be: speed ratios without a flutter speed, say, or
        motions of a section that start from a state.
    """
    if case.imported is None and hasattr(case.initial, "state"):
        raise InputError("initial.state: leaves no room for a pitch; give a motion instead")
    with told_of(case):
        return _analysed(case, options or ReportOptions(), executor, progress)


def _analysed(
    case: Case,
    options: ReportOptions,
    executor: Executor | None,
    progress: Callable[[str], None],
) -> Analyses:
    (family, spring), notes = case.loop(), list[str]()
    progress("root locus")
    locus = root_locus(family)
    if locus.flutter is None:
        low, high = locus.searched
        name = "U*" if case.imported is None else "V"
        notes.append(
            f"There is no linear flutter between {name} = {low:.4g} and {high:.4g}: "
            f"speeds on this page are {name}, not ratios."
        )
    found = _limit_cycles(family, spring, notes, progress)
    progress("where nothing can oscillate")
    free = _free(family, spring, notes)
    cells = None
    if not case.one_speed:
        progress("flutter map")
        cells = _mapped(case, options, locus, found.onset, executor)
    return Analyses(
        case=case,
        options=options,
        locus=locus,
        **found._asdict(),
        free=free,
        map=cells,
        notes=tuple(dict.fromkeys(notes)),
    )


def _mapped(
    case: Case,
    options: ReportOptions,
    locus: RootLocus,
    onset: float | None,
    executor: Executor | None,
) -> FlutterMap:
    """The flutter map of a section, or of a model by its first spring."""
    grid = _grid(case, options, locus, onset)
    cells: Cells
    if case.imported is None:
        unit = 1.0 if locus.flutter is None or options.speeds is not None else locus.flutter.speed
        initial = Initial(**{**case.initial._asdict(), "alpha": 0.0})
        cells = SpeedPitch(*case.loop(), grid, unit, initial)
    else:
        cells = CaseCells(case.text, case.source, grid)
    return flutter_map(cells, _march(case, period(locus, FASTEST)), executor=executor)


class _Found(NamedTuple):
    """What the methods found of limit cycles; nothing, for a linear spring."""

    curve: DescribingCurve | None = None
    guaranteed: Guarantees | None = None
    branches: tuple[HarmonicBranch, ...] = ()
    cycles: LimitCycles | None = None

    @property
    def onset(self) -> float | None:
        """The lowest speed U* of a cycle, by the best method that found one."""
        if self.cycles is not None and self.cycles.onset is not None:
            return self.cycles.onset.cycle.speed
        if self.branches:
            return min(branch.onset.cycle.speed for branch in self.branches)
        if self.curve is not None and self.curve.onset is not None:
            return self.curve.onset.speed
        return None


def _limit_cycles(
    family: AnyFamily, spring: Springs, notes: list[str], progress: Callable[[str], None]
) -> _Found:
    """Limit cycles by all three methods."""
    if all(isinstance(simplify(one), Linear) for one in each(spring)):
        notes.append("The spring is linear: it has no limit cycles.")
        return _Found()
    progress("describing function")
    curve = _tried("Describing function", lambda: describing_curve(family, spring), notes)
    guaranteed = None
    if curve is not None and curve.amplitude.size:
        guaranteed = _tried("Proofs", lambda: guarantees(family, spring, curve), notes)
    progress("harmonic balance")
    settings = None if len(each(spring)) == 1 else SEVERAL
    branches = _tried(
        "Harmonic balance", lambda: harmonic_families(family, spring, settings), notes
    )
    progress("exact cycles")
    cycles = _tried("Exact cycles", lambda: limit_cycles(family, spring), notes)
    for name, found in (("Describing function", curve), ("Exact cycles", cycles)):
        notes += [] if found is None else [f"{name}: {note}." for note in found.notes]
    return _Found(curve, guaranteed, branches or (), cycles)


def _free(family: AnyFamily, spring: Springs, notes: list[str]) -> Absence | None:
    """What is proved free of oscillation, looked for briefly."""
    try:
        if len(each(spring)) > 1:
            raise Uncovered("proofs over a range of speeds are of one spring")
        free = absence(as_lure(family), each(spring)[0], seconds=PROVING)
    except Uncovered as why:
        notes.append(f"Proved free: nothing, {why}.")
        return None
    notes += [f"Proved free: {note}." for note in free.notes]
    return None if free.certificate is None else free


def _tried(name: str, analysis: Callable[[], Result], notes: list[str]) -> Result | None:
    """The result of an analysis, or None and a note why there is none."""
    try:
        return analysis()
    except (InputError, ConvergenceError) as error:
        notes.append(f"{name}: {'; '.join(str(error).splitlines())}.")
        return None


def _grid(case: Case, options: ReportOptions, locus: RootLocus, onset: float | None) -> Grid:
    pitches = Axis("initial.alpha_deg", _pitches(case, options, ROWS))
    return Grid(_flow(options, locus, onset, COLUMNS), pitches)


def _straight(case: Case) -> bool:
    """Whether the exact engine takes the spring."""
    return all(map(straight, case.loop_springs))


def _march(case: Case, longest: float) -> MapOptions:
    if _straight(case):
        return MapOptions()
    return MapOptions(march=replace(MARCH, duration=PATIENCE * longest))


def period(locus: RootLocus, speed: float) -> float:
    """Period of linear flutter, or of the uncoupled pitch where nothing flutters, τ."""
    return float(2.0 * np.pi * (speed if locus.flutter is None else 1.0 / locus.flutter.k))


def _flow(options: ReportOptions, locus: RootLocus, onset: float | None, columns: int) -> Axis:
    """Speeds of the map: from below the onset to above flutter, if nothing else is asked."""
    if options.speeds is not None:
        return Axis("speed", options.speeds)
    if options.speed_ratios is not None:
        if locus.flutter is None:
            raise InputError(
                "speed_ratios: the section has no linear flutter speed to refer to; give speeds"
            )
        return Axis("speed_ratio", options.speed_ratios)
    if locus.flutter is None:
        low, high = locus.searched
        low, high = (
            (low, min(high, FASTEST)) if onset is None else (0.8 * onset, min(2.0 * onset, high))
        )
        return Axis("speed", round_values(low, high, columns))
    if onset is None:
        return Axis("speed_ratio", round_values(0.9, 1.1, columns))
    return Axis("speed_ratio", ratios_around(onset / locus.flutter.speed, columns))


def _pitches(case: Case, options: ReportOptions, rows: int) -> Array:
    """Where motions start, as told: up to twice the case's own; on both sides if they differ."""
    if options.pitches_deg is not None:
        return options.pitches_deg
    top = start_unit().factor * (2.0 * abs(case.initial.alpha) or 6.0 * case.spring.scale)
    if all(one.odd for one in case.loop_springs):
        return np.linspace(top / rows, top, rows)
    return np.linspace(-top, top, rows + 1)  # an even number: none of them zero
