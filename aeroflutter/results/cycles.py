"""Exact limit cycles as Datasets; importing this module teaches `to_dataset` about them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.orbits.cycles import Cycle, CycleOnset, CyclesAt, LimitCycles, Tolerance
from aeroflutter.results.dataset import labelled, split_complex, to_dataset

if TYPE_CHECKING:
    import xarray as xr

    from aeroflutter.case import Case

__all__ = ["to_dataset"]

_ANGLES = ("amplitude", "bias", "first_harmonic", "memory")
_PLAIN = ("speed", "speed_ratio", "period", "k", "closure", "switches", "family")
_FLAGS = ("stable", "symmetric", "continuum")

_NAMES = {
    "multipliers": ("1", "Floquet multipliers of the period, the trivial one first"),
    "symmetric": ("1", "1 where the second half of the period mirrors the first"),
    "continuum": ("1", "1 where the cycle is one of a continuum that differs in bias only"),
    "closure": ("1", "what the exact flow misses after one period, over each state's own size"),
    "switches": ("1", "switches of the spring a period"),
    "start": ("1", "a point of the cycle, rad and tau"),
    "bifurcation_kind": ("1", "kind of bifurcation"),
    "bifurcation_speed": ("1", "airspeed U* of the bifurcation"),
    "bifurcation_speed_ratio": ("1", "the same over the linear flutter speed"),
    "bifurcation_amplitude_deg": ("degree", "pitch amplitude at the bifurcation"),
    "bifurcation_period": ("1", "period in tau at the bifurcation"),
    "bifurcation_family": ("1", "number of the family of the bifurcation"),
    "origin": ("1", "where the family was found"),
    "begins": ("1", "why the family ends at its first cycle"),
    "ends": ("1", "why the family ends at its last cycle"),
}


@to_dataset.register(LimitCycles)
def _(result: LimitCycles, *, case: Case | None = None) -> xr.Dataset:
    cycles = [event.cycle for event in result.bifurcations]
    events = {
        "kind": [event.kind for event in result.bifurcations],
        "speed": [cycle.speed for cycle in cycles],
        "speed_ratio": [cycle.speed_ratio for cycle in cycles],
        "amplitude_deg": np.degrees([cycle.amplitude for cycle in cycles]),
        "period": [cycle.period for cycle in cycles],
        "family": [cycle.family for cycle in cycles],
    }
    variables = _cycles(result.cycles)
    variables |= {f"bifurcation_{name}": ("event", values) for name, values in events.items()}
    variables |= {
        "origin": ("number", [one.origin for one in result.families]),
        "begins": ("number", [one.stopped[0] for one in result.families]),
        "ends": ("number", [one.stopped[1] for one in result.families]),
    }
    coordinates = {"part": ["re", "im"], "number": [one.number for one in result.families]}
    return _described(labelled(variables, coordinates, _facts(result), case))


@to_dataset.register(CyclesAt)
def _(result: CyclesAt, *, case: Case | None = None) -> xr.Dataset:
    facts = {"at_speed": result.speed, "at_speed_ratio": result.speed_ratio}
    facts |= _facts(result.branch)
    return _described(labelled(_cycles(result.cycles), {"part": ["re", "im"]}, facts, case))


@to_dataset.register(Tolerance)
def _(result: Tolerance, *, case: Case | None = None) -> xr.Dataset:
    facts = {
        "tolerance_amplitude_deg": float(np.degrees(result.amplitude)),
        "tolerance_speed_ratio": result.speed_ratio,
        "tolerance_factor": result.factor,
        "tolerance_spring": repr(result.spring),
    }
    return to_dataset(result.branch, case=case).assign_attrs(facts)


def _cycles(cycles: Sequence[Cycle]) -> dict[str, Any]:
    variables: dict[str, Any] = {
        f"{name}_deg": ("point", np.degrees([getattr(one, name) for one in cycles]))
        for name in _ANGLES
    }
    variables |= {
        name: ("point", np.array([getattr(one, name) for one in cycles])) for name in _PLAIN
    }
    variables |= {
        name: ("point", np.array([getattr(one, name) for one in cycles], dtype=np.int8))
        for name in _FLAGS
    }
    n = cycles[0].state.size if cycles else 0
    multipliers = np.array([one.multipliers for one in cycles], dtype=complex).reshape(-1, n)
    variables["multipliers"] = ("point", "multiplier", "part"), split_complex(multipliers)
    variables["start"] = ("point", "state"), np.array([one.state for one in cycles]).reshape(-1, n)
    return variables


def _facts(result: LimitCycles) -> dict[str, Any]:
    facts: dict[str, Any] = {"notes": "; ".join(result.notes), "odd": int(result.odd)}
    if result.flutter_speed is not None:
        facts["flutter_speed"] = result.flutter_speed
    for name, onset in (("onset", result.onset), ("stable_onset", result.stable_onset)):
        facts |= {} if onset is None else _onset(name, onset)
    return facts


def _onset(name: str, onset: CycleOnset) -> dict[str, Any]:
    return {
        f"{name}_speed": onset.cycle.speed,
        f"{name}_speed_ratio": onset.cycle.speed_ratio,
        f"{name}_amplitude_deg": float(np.degrees(onset.cycle.amplitude)),
        f"{name}_kind": onset.kind,
    }


def _described(dataset: xr.Dataset) -> xr.Dataset:
    for name, (units, long_name) in _NAMES.items():
        if name in dataset:
            dataset[name].attrs |= {"units": units, "long_name": long_name}
    return dataset
