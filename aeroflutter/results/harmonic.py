"""Branches of the harmonic balance and loop tests as Datasets."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.guarantees.looptest import LoopTest
from aeroflutter.orbits.harmonic import HarmonicBranch
from aeroflutter.results.dataset import labelled, split_complex, to_dataset

if TYPE_CHECKING:
    import xarray as xr

    from aeroflutter.case import Case

__all__ = ["branches_to_dataset", "loop_to_dataset", "to_dataset"]

_ANGLES = ("amplitude", "bias", "first_harmonic")
_PLAIN = ("speed", "speed_ratio", "period", "truncation", "margin", "multiplier_error")

_NAMES = {
    "multipliers": ("1", "Floquet multipliers of the period, the trivial one first"),
    "multiplier_error": ("1", "estimated error of the multipliers"),
    "truncation": ("1", "estimate of the harmonics left out over the amplitude"),
    "margin": ("1", "distance from a change of the sequence of switches, over the amplitude"),
    "stability_certain": ("1", "1 where the multipliers are clear of the unit circle"),
    "pitch_harmonic_deg": ("degree", "Y_k of pitch = Re sum of Y_k exp(j k omega tau)"),
    "bifurcation_kind": ("1", "kind of bifurcation"),
    "bifurcation_speed": ("1", "airspeed U* of the bifurcation"),
    "bifurcation_amplitude_deg": ("degree", "pitch amplitude at the bifurcation"),
    "bifurcation_family": ("1", "number of the family of the bifurcation"),
    "response": ("1", "G(jk), pitch per moment"),
    "locus": ("1", "-1/N"),
    "predicted": ("1", "predicted harmonic of pitch over the first"),
    "spoils": ("1", "1 where the harmonic spoils the describing function"),
}


def branches_to_dataset(
    branches: Sequence[HarmonicBranch], *, case: Case | None = None
) -> xr.Dataset:
    """All points of all branches along one dimension, with the number of their family."""
    sizes = [branch.speed.size for branch in branches]
    top = max(branch.harmonics for branch in branches)
    events = [(n, event) for n, branch in enumerate(branches, 1) for event in branch.bifurcations]
    variables: dict[str, Any] = {
        f"{name}_deg": ("point", np.degrees(_joined(branches, name))) for name in _ANGLES
    }
    variables |= {name: ("point", _joined(branches, name)) for name in _PLAIN}
    variables |= {
        "k": ("point", _joined(branches, "omega")),
        "family": ("point", np.repeat(np.arange(1, len(branches) + 1), sizes)),
        "stable": ("point", _joined(branches, "stable").astype(np.int8)),
        "stability_certain": ("point", _joined(branches, "certain").astype(np.int8)),
        "multipliers": (
            ("point", "multiplier", "part"),
            split_complex(_joined(branches, "multipliers")),
        ),
        "pitch_harmonic_deg": (
            ("point", "harmonic", "part"),
            np.degrees(split_complex(_harmonics(branches, top))),
        ),
        "bifurcation_kind": ("event", [event.kind for _, event in events]),
        "bifurcation_speed": ("event", [event.cycle.speed for _, event in events]),
        "bifurcation_amplitude_deg": ("event", [np.degrees(e.amplitude) for _, e in events]),
        "bifurcation_family": ("event", [n for n, _ in events]),
    }
    flutter = branches[0].flutter_speed
    attributes = {} if flutter is None else {"flutter_speed": flutter}
    coordinates = {"harmonic": np.arange(top + 1), "part": ["re", "im"]}
    return _described(labelled(variables, coordinates, attributes, case))


def _joined(branches: Sequence[HarmonicBranch], name: str) -> np.ndarray:
    return np.concatenate([getattr(branch, name) for branch in branches])


def _harmonics(branches: Sequence[HarmonicBranch], top: int) -> np.ndarray:
    rows = [cycle.Y for branch in branches for cycle in branch.cycles]
    return np.array([np.pad(Y, (0, top + 1 - Y.size)) for Y in rows])


def _described(dataset: xr.Dataset) -> xr.Dataset:
    for name, (units, long_name) in _NAMES.items():
        if name in dataset:
            dataset[name].attrs |= {"units": units, "long_name": long_name}
    return dataset


@to_dataset.register(HarmonicBranch)
def _(result: HarmonicBranch, *, case: Case | None = None) -> xr.Dataset:
    return branches_to_dataset((result,), case=case)


@to_dataset.register(LoopTest)
def loop_to_dataset(result: LoopTest, *, case: Case | None = None) -> xr.Dataset:
    """Frequency response, locus of -1/N, and the cycles' harmonics."""
    orders = result.cycles[0].orders if result.cycles else np.empty(0, dtype=int)
    shape = len(result.cycles), orders.size
    variables = {
        "response": (("k", "part"), split_complex(result.G)),
        "locus": (("locus_amplitude", "part"), split_complex(result.locus)),
        "amplitude_deg": ("cycle", [np.degrees(one.amplitude) for one in result.cycles]),
        "bias_deg": ("cycle", [np.degrees(one.bias) for one in result.cycles]),
        "cycle_k": ("cycle", [one.k for one in result.cycles]),
        "predicted": (
            ("cycle", "order"),
            np.array([one.predicted for one in result.cycles]).reshape(shape),
        ),
        "spoils": (
            ("cycle", "order"),
            np.array([one.spoiling for one in result.cycles]).reshape(shape).astype(np.int8),
        ),
    }
    coordinates = {
        "k": result.frequency,
        "locus_amplitude": np.degrees(result.amplitude),
        "order": orders,
        "part": ["re", "im"],
    }
    attributes = {"speed": result.speed, "speed_ratio": result.speed_ratio}
    return _described(labelled(variables, coordinates, attributes, case))
