"""What results know of cycles: describing functions and proofs, harmonic balance, exact cycles."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.results.fields import FIELDS, Field
from aeroflutter.results.plain import plain
from aeroflutter.results.schema import (
    Entry,
    Many,
    One,
    Value,
    View,
    bulk,
    in_files,
    layout,
    record,
    rows,
    within,
)  # fmt: skip
from aeroflutter.results.swings import SWINGS, swing_lists
from aeroflutter.results.unit import told

if TYPE_CHECKING:
    from aeroflutter.guarantees import Guarantees
    from aeroflutter.guarantees.looptest import LoopTest
    from aeroflutter.orbits.describing import DescribingCurve
    from aeroflutter.orbits.harmonic import HarmonicBranch, HarmonicOnset
    from aeroflutter.springs import Spring

__all__ = ["LAYOUTS", "Branches", "Proved", "guarantee_fields", "spring_record"]

# Describing functions: the curve, the same with what is proved of it, the loop at one speed

DF_ONSET = layout(
    "speed speed_ratio amplitude bias k kind stable stable_below=beside.0 stable_above=beside.1",
    "family",
)
DF_FAMILY = layout(
    Value("family", "number", label="number"),
    "biased mirror_of",
    Value("ends", dims=("end",)),
    "closed",
    One("onset", layout=DF_ONSET),
    One("stable_onset", layout=DF_ONSET),
    Many("folds", layout=DF_ONSET, dim="fold", prefix="family_fold_"),
)
DF_POINT = layout(
    "amplitude bias speed speed_ratio k n_p n_q stable family distortion in_thesis_range",
    "rules_agree",
    *swing_lists(lambda one: one._of.swings(one._at)[0], lambda one: one._of.swings(one._at)[1]),
)
DF_REST: tuple[str | Entry, ...] = (
    One("onset", layout=DF_ONSET),
    One("stable_onset", layout=DF_ONSET),
    Many("families", layout=DF_FAMILY, dim="number", prefix="family_"),
    "amplitude_range speed_range notes",
)
DESCRIBING = layout(
    "flutter_speed",
    Many("branch", lambda one: rows(one, one.speed.size), layout=DF_POINT, dim="point"),
    *DF_REST,
)


def _band(name: str, of: str | Any) -> Entry:
    return Value(f"guarantee_{name}", of, key=name, label=f"guarantee_{name}")


GUARANTEE = layout(
    Value("guaranteed", label="guaranteed"),
    "reason method",
    _band("speed", "speed"),
    _band("speed_ratio", lambda one: one.speed / one.unit),
    _band("k", "omega"),
    _band("amplitude", "amplitude"),
    Value("exists_at_speed", label="exists_at_speed"),
    _band("harmonics", lambda one: one.rest if one.guaranteed else np.nan),
    Value("contraction_ratio", "ratio", label="contraction_ratio"),
    Value("expected_error", label="expected_error"),
    Value("doubtful", label="doubtful"),
)


@dataclass(frozen=True, kw_only=True, eq=False)
class Proved:
    """A describing function's curve with what is proved of every point.

    Attributes
    ----------
    curve
        The curve.
    guarantees
        Of its points.
    """

    curve: DescribingCurve
    guarantees: Guarantees

    @property
    def points(self) -> list[View]:
        """Its points, the guarantee of each in `guarantee`."""
        unit = self.curve.flutter_speed or np.nan
        return [
            View(self.curve, i, guarantee=View(self.guarantees, i, unit=unit))
            for i in range(self.curve.speed.size)
        ]


def guarantee_fields(found: Guarantees, i: int, unit: float | None = None) -> dict[str, Any]:
    """Point `i` of guarantees: its bands, or the reason why there are none.

    Parameters
    ----------
    unit
        Linear flutter speed U*_L, for `speed_ratio`.
    """
    fields: dict[str, Any] = plain(record(View(found, i, unit=unit or np.nan), GUARANTEE))
    return fields


DF_PROVED = layout(*DF_POINT.entries, One("guarantee", layout=GUARANTEE))
PROVED = layout(
    "flutter_speed=curve.flutter_speed",
    Many("branch", "points", layout=DF_PROVED, dim="point"),
    One("", "curve", layout=layout(*DF_REST)),
)


def _loop_cycles(one: LoopTest) -> list[View]:
    """The cycles of a loop test, with their harmonics and guarantees as records."""
    unit = one.speed / one.speed_ratio
    return [
        View(
            cycle,
            rows=rows(cycle, cycle.orders.size),
            guarantee=View(cycle.guarantee, 0, unit=unit),
        )
        for cycle in one.cycles
    ]


LOOP_HARMONIC = layout(
    Value("order", "orders", label=None),
    "answer=answers gain=gains predicted spoils=spoiling",
)
LOOP_CYCLE = layout(
    "amplitude bias",
    Value("k", label="cycle_k"),
    "describing_function=N",
    Many("harmonics", "rows", layout=LOOP_HARMONIC, dim="order"),
    One("guarantee", layout=GUARANTEE),
)
LOOP = layout(
    "speed speed_ratio",
    Many("cycles", _loop_cycles, layout=LOOP_CYCLE, dim="cycle"),
    Value("k", "frequency", key="frequency", dims=("k",)),
    "response=G",
    Value("amplitude", key="locus_amplitude", label=None),
    Value("locus_amplitude", lambda one: told(one.amplitude), key=None),
    "locus",
    Value("order", lambda one: next((c.orders for c in one.cycles), np.arange(0)), key=None),
    frame=("cycle",),
)

# Harmonic balance


@dataclass(frozen=True, eq=False)
class Branches:
    """Families of the harmonic balance, numbered from 1.

    Attributes
    ----------
    branches
        One a family.
    """

    branches: tuple[HarmonicBranch, ...]

    @property
    def flutter_speed(self) -> float | None:
        """U*_L, or None."""
        return self.branches[0].flutter_speed

    @property
    def families(self) -> list[View]:
        """The families by their numbers."""
        return [View(branch, family=n) for n, branch in enumerate(self.branches, 1)]

    @property
    def points(self) -> list[View]:
        """The cycles of all families, harmonics up to the highest of all."""
        top = max(branch.harmonics for branch in self.branches)
        return [
            View(branch, i, family=n, symmetric=branch.symmetric, harmonics=branch.harmonics,
                 top=top)
            for n, branch in enumerate(self.branches, 1)
            for i in range(branch.speed.size)
        ]  # fmt: skip

    @property
    def bifurcations(self) -> list[View]:
        """The bifurcations of all families."""
        numbered = enumerate(self.branches, 1)
        return [View(event, family=n) for n, branch in numbered for event in branch.bifurcations]

    @property
    def onset(self) -> HarmonicOnset:
        """The lowest cycle of all."""
        return min((one.onset for one in self.branches), key=lambda onset: onset.cycle.speed)

    @property
    def stable_onset(self) -> HarmonicOnset | None:
        """The lowest stable one."""
        found = [one.stable_onset for one in self.branches if one.stable_onset is not None]
        return min(found, key=lambda onset: onset.cycle.speed, default=None)


HB_ONSET = layout("speed=cycle.speed speed_ratio amplitude kind stable")
HB_POINT = layout(
    "family amplitude bias first_harmonic speed speed_ratio k=omega period stable",
    "stability_certain=certain multipliers multiplier_error symmetric harmonics truncation",
    *bulk("margin"),
    Value(
        "pitch_harmonic",
        lambda one: np.pad(one.cycles.Y, (0, one.top + 1 - one.cycles.Y.size)),
        key=None,
    ),
    *swing_lists(lambda one: one.cycles.coordinates, lambda one: one.cycles.springs),
)
HB_EVENT = layout("kind speed=cycle.speed speed_ratio amplitude bias family")
HB_FAMILY = layout(
    Value("family", label="number"),
    "symmetric harmonics converged closed",
    Value("ends", "stops", dims=("end",)),
    One("onset", layout=HB_ONSET),
    One("stable_onset", layout=HB_ONSET),
)
HARMONIC = layout(
    "flutter_speed",
    Many("branch", "points", layout=HB_POINT, dim="point"),
    Many("bifurcations", layout=HB_EVENT, dim="event", prefix="bifurcation_"),
    One("onset", layout=HB_ONSET),
    One("stable_onset", layout=HB_ONSET),
    Many("families", layout=HB_FAMILY, dim="number", prefix="family_"),
    Value("harmonic", lambda one: np.arange(one.points[0].top + 1), key=None),
)

# Exact cycles

CYCLE = layout(
    "family amplitude bias first_harmonic speed speed_ratio k period stable multipliers",
    "symmetric continuum closure switches",
    *bulk("memory start=state"),
)
CYCLE_POINT = layout(*CYCLE.entries, *SWINGS)
CYCLE_EVENT = layout(
    "kind",
    One("", "cycle", layout=CYCLE),
    "stable_before=stable_beside.0 stable_after=stable_beside.1",
)
CYCLE_ONSET = layout(
    *within("cycle", "speed speed_ratio amplitude bias period"),
    "kind stable family=cycle.family",
)
CYCLE_FAMILY = layout(
    Value("family", "number", label="number"),
    Value("origin", label="origin"),
    "parent symmetric closed",
    Value("ends", "stopped", label=None),
    Value("begins", "stopped.0", key=None, label="begins"),
    Value("ends", "stopped.1", key=None, label="ends"),
    Value("cycles", lambda one: len(one.cycles)),
    One("onset", layout=CYCLE_ONSET),
    One("stable_onset", layout=CYCLE_ONSET),
)
LIMIT_REST: tuple[str | Entry, ...] = (
    Many("bifurcations", layout=CYCLE_EVENT, dim="event", prefix="bifurcation_"),
    One("onset", layout=CYCLE_ONSET),
    One("stable_onset", layout=CYCLE_ONSET),
    Many("families", layout=CYCLE_FAMILY, dim="number", prefix="family_"),
    Value("mirrored", "odd", label="odd"),
    "speed_range notes",
)
LIMIT_CYCLES = layout(
    "flutter_speed", Many("branch", "cycles", layout=CYCLE_POINT, dim="point"), *LIMIT_REST
)
CYCLES_AT = layout(
    "flutter_speed=branch.flutter_speed",
    Many("branch", "cycles", layout=CYCLE_POINT, dim="point"),
    One("", "branch", layout=layout(*LIMIT_REST)),
    Value("speed", label="at_speed"),
    Value("speed_ratio", label="at_speed_ratio"),
    Many("cycles", layout=CYCLE_POINT, dim="point", label=None),
)


def spring_record(spring: Spring | None) -> dict[str, Any] | None:
    """A spring as a case file writes it."""
    if spring is None:
        return None
    found: dict[str, Any] = {"kind": spring.kind}
    for entry in fields(spring):  # type: ignore[arg-type]
        name = {"moments": "moment"}.get(entry.name, entry.name)
        field = FIELDS.get(name, Field(""))
        found[name + field.kind.told.suffix] = in_files(getattr(spring, entry.name), field)
    return found


def _half_height(spring: Spring | None) -> float | None:
    height = getattr(spring, "delta_v", None)
    return None if height is None else height / 2


def _width(spring: Spring | None) -> float | None:
    width: float | None = getattr(spring, "delta_h", getattr(spring, "gap", None))
    return width


def _trials(one: Any) -> list[View]:
    """Every value that was tried, by the name of what varies; factors of size are none."""
    if one.vary == "size":
        return []
    return [View(None, varied=value, amplitude=size) for value, size in one.trials]


TRIAL = layout("varied amplitude")
TOLERANCE = layout(
    Value("speed_ratio", label="tolerance_speed_ratio"),
    Value("speed", label="tolerance_speed"),
    Value("amplitude", label="tolerance_amplitude"),
    Value("unlimited", lambda one: one.spring is None),
    Value("factor", label="tolerance_factor"),
    Value("spring", lambda one: spring_record(one.spring), label=None),
    Value("tolerance_spring", lambda one: repr(one.spring), key=None),
    One("worst", layout=layout("amplitude bias speed_ratio speed period")),
    Value("vary", label="vary"),
    Value("friction", lambda one: _half_height(one.spring), label="friction"),
    Value("gap", lambda one: _width(one.spring), label="gap"),
    Many("trials", lambda one: _trials(one), layout=TRIAL, dim="trial", prefix="trial_"),
    Value("notes", label="tolerance_notes"),
    One("", "branch", key=None, layout=LIMIT_CYCLES),
)

LAYOUTS = {
    "DescribingCurve": DESCRIBING,
    "Proved": PROVED,
    "LoopTest": LOOP,
    "Branches": HARMONIC,
    "LimitCycles": LIMIT_CYCLES,
    "CyclesAt": CYCLES_AT,
    "Tolerance": TOLERANCE,
}
