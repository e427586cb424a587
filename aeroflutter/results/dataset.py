"""Results as labelled xarray Datasets with units, long names and provenance.

The conventions live in one table, :data:`VARIABLES`. Files speak degrees, so angles are converted
here, once, and their names end in ``_deg``.
"""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Mapping, Sequence
from importlib import metadata, resources
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from aeroflutter.linear.rootlocus import RootLocus
from aeroflutter.motion.response import STATES
from aeroflutter.orbits.describing.result import DescribingCurve
from aeroflutter.studies.maps.engines import FAILED
from aeroflutter.studies.maps.flutter_map import CELLS, EDGES, LABELS, FlutterMap
from aeroflutter.studies.maps.sweep import SweepResult

if TYPE_CHECKING:
    from aeroflutter.case import Case

# name: (units, long name); "1" is dimensionless in the CF conventions
VARIABLES: dict[str, tuple[str, str]] = {
    "speed": ("1", "airspeed U* = V/(b omega_alpha)"),
    "speed_ratio": ("1", "airspeed over the linear flutter speed, U*/U*_L"),
    "velocity": ("m s-1", "airspeed V"),
    "root": ("1", "root p of det B(p), per unit of tau = V t/b"),
    "part": ("1", "real and imaginary part"),
    "mode": ("1", "number of the mode"),
    "k": ("1", "reduced frequency omega b/V"),
    "amplitude_deg": ("degree", "pitch amplitude, half peak to peak"),
    "bias_deg": ("degree", "midrange of pitch"),
    "first_harmonic_deg": ("degree", "amplitude of the first harmonic of pitch"),
    "n_p": ("1", "describing function, in phase with pitch"),
    "n_q": ("1", "describing function, in quadrature with pitch"),
    "stable": ("1", "1 where the cycle is stable"),
    "family": ("1", "number of the family of cycles"),
    "distortion": ("1", "predicted harmonics 2-9 of pitch over the first"),
    "in_thesis_range": ("1", "1 where the thesis's describing function applies"),
    "time": ("1", "nondimensional time tau = V t/b"),
    "pitch_deg": ("degree", "pitch, nose up"),
    "heave": ("1", "heave over the semi-chord, positive down"),
    "moment_deg": ("degree", "restoring moment of the spring over its unit stiffness"),
    "memory_deg": ("degree", "memory of the spring"),
    "period": ("1", "period in tau"),
    "alpha_deg": ("degree", "initial pitch"),
    "state": ("1", "end state"),
    "rest_deg": ("degree", "pitch at which a damped motion comes to rest"),
    "decided_at": ("1", "nondimensional time tau after which the end state was certain"),
    "attractor": ("1", "number of the attractor: cells with one number end on the same"),
    "boundary_x": ("1", "refined boundary between a cell and the next along the first axis"),
    "boundary_y": ("1", "refined boundary between a cell and the next along the second axis"),
    "sample": ("1", "number of the section in the sample"),
    "valid": ("1", "whether the values make a section"),
    "flutter_speed": ("1", "linear flutter speed U*_L"),
    "flutter_k": ("1", "reduced frequency at the linear flutter speed"),
    "onset_speed": ("1", "lowest airspeed U* of a limit cycle by describing functions"),
    "onset_speed_ratio": ("1", "the same over the linear flutter speed"),
    "onset_amplitude_deg": ("degree", "pitch amplitude of that limit cycle"),
    "marched_at": ("1", "airspeed U* at which the end state was sought"),
}


@functools.singledispatch
def to_dataset(result: object, *, case: Case | None = None) -> xr.Dataset:
    """The result of an analysis as an xarray Dataset.

    Parameters
    ----------
    result : object
        A result object of any analysis.
    case : Case, optional
        Its text and hash are recorded as provenance.

    Raises
    ------
    TypeError
        If the object is not the result of an analysis.
    """
    subject = "" if case is None else f" of {case.title}"
    raise TypeError(f"{type(result).__name__}{subject} is not a result of an analysis")


@to_dataset.register(RootLocus)
def _(result: RootLocus, *, case: Case | None = None) -> xr.Dataset:
    attributes: dict[str, Any] = {"stiffness": result.stiffness}
    if result.flutter is not None:
        attributes |= {"flutter_speed": result.flutter.speed, "flutter_k": result.flutter.k}
    if result.divergence is not None:
        attributes["divergence_speed"] = result.divergence
    return labelled(
        {"root": (("speed", "mode", "part"), split_complex(result.roots))},
        {
            "speed": result.speeds,
            "mode": np.arange(1, result.roots.shape[1] + 1),
            "part": ["re", "im"],
        },
        attributes,
        case,
    )


@to_dataset.register(DescribingCurve)
def _(result: DescribingCurve, *, case: Case | None = None) -> xr.Dataset:
    variables: dict[str, Any] = {
        "amplitude_deg": np.degrees(result.amplitude),
        "bias_deg": np.degrees(result.bias),
    }
    names = ("speed", "speed_ratio", "k", "n_p", "n_q", "distortion", "family")
    variables |= {name: getattr(result, name) for name in names}
    variables |= {
        name: getattr(result, name).astype(np.int8) for name in ("stable", "in_thesis_range")
    }
    attributes: dict[str, Any] = {"notes": "; ".join(result.notes)}
    if result.flutter_speed is not None:
        attributes["flutter_speed"] = result.flutter_speed
    if result.onset is not None:
        attributes |= {
            "onset_speed": result.onset.speed,
            "onset_speed_ratio": result.onset.speed_ratio,
            "onset_amplitude_deg": float(np.degrees(result.onset.amplitude)),
            "onset_kind": result.onset.kind,
        }
    return labelled(
        {name: ("point", values) for name, values in variables.items()}, {}, attributes, case
    )


@to_dataset.register(FlutterMap)
def _(result: FlutterMap, *, case: Case | None = None) -> xr.Dataset:
    x, y = result.grid.x, result.grid.y
    names = [v.name for v in (*CELLS, *EDGES, *LABELS)]
    variables = {
        name: ((x.name, y.name), getattr(result, name))
        for name in names
        if getattr(result, name) is not None
    }
    attributes = {"cpu_seconds": result.cpu_seconds, **_failures(result.failures)}
    dataset = labelled(variables, {x.name: x.values, y.name: y.values}, attributes, case)
    dataset["state"].attrs |= _flags({FAILED: "failed", **dict(enumerate(STATES))})
    for edge, axis in (("boundary_x", x), ("boundary_y", y)):
        dataset[axis.name].attrs = _quantity(axis.key) | dataset[axis.name].attrs
        if edge in dataset:
            dataset[edge].attrs["units"] = dataset[axis.name].attrs["units"]
    return dataset


@to_dataset.register(SweepResult)
def _(result: SweepResult, *, case: Case | None = None) -> xr.Dataset:
    varied = {"varied_" + name.replace(".", "_"): name for name in result.samples}
    variables = {name: ("sample", result.samples[key]) for name, key in varied.items()}
    variables |= {name: ("sample", values) for name, values in result.values.items()}
    attributes = {"cpu_seconds": result.cpu_seconds, **_failures(result.failures)}
    coordinates = {"sample": np.arange(1, result.number + 1)}
    dataset = labelled(variables, coordinates, attributes, case)
    for name, key in varied.items():
        dataset[name].attrs = _quantity(key)
    dataset["state"].attrs |= _flags({FAILED: "not_marched", **dict(enumerate(STATES))})
    dataset["valid"].attrs |= _flags({FAILED: "failed", 0: "no_such_section", 1: "valid"})
    return dataset


def _quantity(key: str) -> dict[str, str]:
    """Attributes of a key of a case."""
    units = "degree" if key.endswith("_deg") else "1"
    return {"units": units, "long_name": key, "key": key}


def _flags(meanings: Mapping[int, str]) -> dict[str, Any]:
    """CF attributes of a variable of codes."""
    return {
        "flag_values": np.array(list(meanings), dtype=np.int8),
        "flag_meanings": " ".join(meanings.values()),
    }


def _failures(failures: Sequence[Mapping[str, str]]) -> dict[str, Any]:
    """Attribute that lists the blocks that could not be computed, if there are any."""
    if not failures:
        return {}
    return {"failed_blocks": [f"{failure['block']}: {failure['reason']}" for failure in failures]}


def labelled(
    variables: Mapping[str, Any],
    coordinates: Mapping[str, Any],
    attributes: Mapping[str, Any],
    case: Case | None,
) -> xr.Dataset:
    """A Dataset whose variables carry the units and long names of :data:`VARIABLES`."""
    dataset = xr.Dataset(variables, coordinates, {**attributes, **provenance(case)})
    for name in dataset.variables:
        if name in VARIABLES:
            units, long_name = VARIABLES[str(name)]
            dataset[name].attrs |= {"units": units, "long_name": long_name}
    return dataset


def split_complex(values: np.ndarray) -> np.ndarray:
    """Real and imaginary part along a new last axis: NetCDF has no complex numbers."""
    return np.stack([values.real, values.imag], axis=-1)


def provenance(case: Case | None = None) -> dict[str, str]:
    """What a reader needs to compute the result again."""
    names = ("aeroflutter", "numpy", "scipy")
    versions = ", ".join(f"{name} {metadata.version(name)}" for name in names)
    found = {"Conventions": "CF-1.11", "source": versions, "generated_code_sha256": _code_hash()}
    if case is not None:
        found |= {"title": case.title, "case": case.text}
    return found


@functools.cache
def _code_hash() -> str:
    """Hash of the generated modules, in the order of their names."""
    digest = hashlib.sha256()
    files = resources.files("aeroflutter.generated").iterdir()
    for file in sorted(files, key=lambda entry: entry.name):
        if file.name.endswith(".py"):
            digest.update(file.name.encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()
