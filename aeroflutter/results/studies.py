"""What maps and sweeps hold: their axes and samples are keys of a case, so each has its own layout.

Their arrays are in the units of files already, and what is in every cell is for Datasets only: one
line of JSON counts the cells.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.results.fields import FIELDS, Field, Kind
from aeroflutter.results.schema import Layout, Value, layout
from aeroflutter.results.unit import start_unit, told
from aeroflutter.verdicts import STATES

if TYPE_CHECKING:
    from aeroflutter.studies.maps import Axis, FlutterMap
    from aeroflutter.studies.maps.sweep import SweepResult

__all__ = ["MADE"]

ENDS = dict(enumerate(STATES))
CELL = (
    *("state", "amplitude_deg", "bias_deg", "period", "rest_deg", "decided_at"),
    *("boundary_x", "boundary_y", "attractor"),
)
DISTRIBUTIONS = ("flutter_speed", "onset_speed", "onset_speed_ratio", "amplitude_deg")
IN_SI = ("flutter_velocity_m_s", "flutter_frequency_hz", "onset_velocity_m_s")
_SI = ("_m_s", "_hz")
SPREAD = ("number", "quantiles")
METHODS = {"describing": "describing function", "exact": "exact", "none": "none"}


def in_files(name: str) -> Field:
    """What a name of a study means, the values being in degrees already where they are angles."""
    field = FIELDS.get(name) or FIELDS[name.removesuffix("_deg")]
    return replace(
        field,
        kind=replace(field.kind.told, suffix="", factor=1.0, coordinate=None),
        more=field.more,
    )


def called(name: str) -> str:
    """A name of a study as files write it: without degrees of what is no angle."""
    bare = name.removesuffix("_deg")
    if name == bare or bare not in FIELDS:
        return name
    return bare + FIELDS[bare].kind.told.suffix


def spoken(name: str, values: Any) -> Any:
    """Values of a study, which keeps all as if they were angles, in the unit that is told."""
    return values if called(name) == name else told(np.radians(values))


def of_sample(name: str) -> Field:
    """The same of a sample, in which every section has its own scale: no companion by one scale."""
    field = in_files(name)
    return replace(field, kind=replace(field.kind, si=None))


def key(name: str) -> Field:
    """What a key of a case means."""
    angle = name.endswith("_deg") and (name != "initial.alpha_deg" or start_unit().suffix)
    own = {"initial.alpha_deg": start_unit().cf}.get(name, "1")
    return Field(name, Kind("degree" if angle else own), more={"key": name})


def map_layout(found: FlutterMap) -> Layout:
    """The cells of a map along its axes, and how many end in what state."""
    axes = found.grid.x, found.grid.y
    dims = tuple(called(axis.name) for axis in axes)
    meanings = {name: in_files(name) for name in CELL}
    meanings["state"] = replace(meanings["state"], codes={-1: "failed", **ENDS})
    for name, axis in zip(("boundary_x", "boundary_y"), axes, strict=True):
        units = _axis(axis).kind.units
        meanings[name] = replace(meanings[name], kind=replace(meanings[name].kind, units=units))
    cells = (
        cell(called(name), spoken(name, getattr(found, name)), dims, meaning)
        for name, meaning in meanings.items()
    )
    return layout(
        known("cells", found.grid.cells),
        *(known(state, found.count(state)) for state in (*STATES, "failed")),
        known("attractors", int(found.attractor.max(initial=0))),
        *(
            known(name, {"key": axis.key, "values": axis.values}, label=None)
            for name, axis in zip("xy", axes, strict=True)
        ),
        *_cost(found),
        *cells,
        *(
            cell(dim, axis.values, (dim,), _axis(axis))
            for dim, axis in zip(dims, axes, strict=True)
        ),
        frame=dims,
    )


def _axis(axis: Axis) -> Field:
    """What an axis is, by the table if that has its name."""
    own = key(axis.key)
    if axis.name not in FIELDS and axis.name.removesuffix("_deg") not in FIELDS:
        return own
    return replace(in_files(axis.name), more=own.more)


def sweep_layout(found: SweepResult) -> Layout:
    """The results of every section of a sample, and their distributions."""
    has_si = bool(found.of("flutter_velocity_m_s").size)
    kept = {
        name: values for name, values in found.values.items() if has_si or not name.endswith(_SI)
    }
    meanings = {name: of_sample(name) for name in kept}
    meanings["state"] = replace(meanings["state"], codes={-1: "not_marched", **ENDS})
    words = {-1: "failed", 0: "no_such_section", 1: "valid"}
    meanings["valid"] = replace(meanings["valid"], codes=words)
    valid, sample = found.values["valid"], ("sample",)
    return layout(
        known("samples", found.number),
        known("invalid", int((valid == 0).sum())),
        known("failed", int((valid < 0).sum())),
        *(
            known(called(name), distribution(found, name), label=None)
            for name in (*DISTRIBUTIONS, *(IN_SI if has_si else ()))
        ),
        known("onset_method", METHODS[found.onset_method]),
        known("states", {state: found.count(state) for state in STATES}, label=None),
        known(
            "values",
            {**found.samples, **{called(name): spoken(name, one) for name, one in kept.items()}},
            label=None,
        ),
        *_cost(found),
        cell("sample", np.arange(1, found.number + 1), sample, FIELDS["sample"]),
        *(
            cell("varied_" + name.replace(".", "_"), values, sample, key(name))
            for name, values in found.samples.items()
        ),
        *(
            cell(called(name), spoken(name, kept[name]), sample, meaning)
            for name, meaning in meanings.items()
        ),
        frame=sample,
    )


def distribution(found: SweepResult, name: str) -> dict[str, Any]:
    """The distribution of a result, in the unit that is told."""
    row = found.distribution(name)
    told_row = {key: spoken(name, one) for key, one in row.items() if key not in SPREAD}
    if "quantiles" in row:
        told_row["quantiles"] = {q: spoken(name, one) for q, one in row["quantiles"].items()}
    return {"number": row["number"], **told_row}


def known(name: str, value: Any, **settings: Any) -> Value:
    """A fact of this very result; what it is, its name says."""
    return Value(name, lambda _: value, meaning=Field(""), **settings)


def cell(label: str, values: Any, dims: tuple[str, ...], meaning: Field) -> Value:
    """An array of this very result, for Datasets and DataFrames."""
    return Value("", lambda _: values, key=None, label=label, dims=dims, meaning=meaning)


def _cost(found: FlutterMap | SweepResult) -> tuple[Value, Value, Value]:
    """What a study took, and what of it could not be computed."""
    failed = [f"{failure['block']}: {failure['reason']}" for failure in found.failures]
    return (
        known("cpu_seconds", found.cpu_seconds),
        known("failures", list(found.failures), label=None),
        known("failed_blocks", failed or None, key=None),
    )


MADE: dict[str, Callable[[Any], Layout]] = {
    "FlutterMap": map_layout,
    "SweepResult": sweep_layout,
}
