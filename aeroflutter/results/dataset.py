"""Results as labelled xarray Datasets with units, long names and provenance, and as DataFrames.

What there is to encode stands in the layouts, its names and units in the table of fields. Files
speak degrees, so names of angles end in ``_deg``; of a section in SI units velocities, frequencies
and times stand beside.
"""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Mapping
from importlib import metadata, resources
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from aeroflutter.results import context_of
from aeroflutter.results.fields import FIELDS, TEXT, Field
from aeroflutter.results.layouts import layout_of
from aeroflutter.results.schema import Above, columns
from aeroflutter.results.unit import told_of

if TYPE_CHECKING:
    import pandas as pd

    from aeroflutter.case import Case
    from aeroflutter.results.schema import Layout

__all__ = ["VARIABLES", "provenance", "to_dataframe", "to_dataset"]

# name: (units, long name); "1" is dimensionless in the CF conventions
VARIABLES: dict[str, tuple[str, str]] = {
    name + field.kind.suffix: (field.kind.units, field.long_name) for name, field in FIELDS.items()
}
PARTS = {"part": ["re", "im"], "band": ["low", "high"], "side": ["before", "after"]}


def to_dataset(result: object, *, case: Case | None = None) -> xr.Dataset:
    """The result of an analysis as an xarray Dataset.

    Parameters
    ----------
    result : object
        A result object of any analysis; several branches of the harmonic balance as a tuple.
    case : Case, optional
        Its text and hash are recorded as provenance, and its scale gives SI units.

    Raises
    ------
    InputError
        If the object is not the result of an analysis.

    Notes
    -----
    Angles are in degrees; what is in m or semichords is told as it is. Complex numbers have a
    dimension `part`, since NetCDF knows none.
    Where a number does not exist stands NaN, or -1 among whole numbers and flags.
    """
    case, speed = context_of(result, case)
    with told_of(case):
        return encoded(*layout_of(result), case, speed)


def to_dataframe(result: object, *, case: Case | None = None) -> pd.DataFrame:
    """The main table of a result as a pandas DataFrame, one point of its curve a row, say.

    Columns have the names and the numbers of `to_dataset`; what has further dimensions is in
    columns numbered from 1, its real and imaginary parts in columns `…_re` and `…_im`. Facts and
    units are in `attrs`.

    Parameters
    ----------
    result : object
        A result object of any analysis; several branches of the harmonic balance as a tuple.
    case : Case, optional
        Its text and hash are recorded as provenance, and its scale gives SI units.

    Raises
    ------
    InputError
        If the object is not the result of an analysis.
    """
    case, speed = context_of(result, case)
    with told_of(case):
        found, layout = layout_of(result)
        dataset = encoded(found, layout, case, speed)
    main = [name for name in layout.frame if name in dataset.dims]
    chosen = [name for name, one in dataset.variables.items() if {*main} & {*one.dims}]
    spread = {
        name: part for label in chosen for name, part in _spread(dataset[label], main).items()
    }
    frame = xr.Dataset(spread).to_dataframe(dim_order=main)
    units = {name: part.attrs.get("units", "") for name, part in spread.items()}
    frame.attrs = {**dataset.attrs, "units": units}
    return frame


def _spread(variable: xr.DataArray, main: list[str]) -> dict[str, xr.DataArray]:
    """A variable as several that have no dimensions but the main ones."""
    parts = {str(variable.name): variable}
    for dim in [dim for dim in variable.dims if dim not in main]:
        names = PARTS.get(str(dim)) or range(1, variable.sizes[dim] + 1)
        parts = {
            f"{name}_{word}": part.isel({dim: place}).drop_vars(str(dim), errors="ignore")
            for name, part in parts.items()
            for place, word in enumerate(names)
        }
    return parts


def encoded(
    result: Any, layout: Layout, case: Case | None = None, speed: float | None = None
) -> xr.Dataset:
    """What a layout reads of an object, as a Dataset."""
    variables: dict[str, Any] = {}
    attributes: dict[str, Any] = {}
    scale = None if case is None else case.scale
    for column in columns(layout, scale):
        value = column.read(result, Above(speed, scale))
        if _absent(value, bool(column.derived)):
            continue
        if column.field.dims:
            variables[column.label] = _variable(value, column.field)
        else:
            attributes |= _attribute(column.label, value, column.field)
    dims = {dim for variable in variables.values() for dim in variable[0]}
    parts = {
        dim: (dim, words, FIELDS[dim].attributes) for dim, words in PARTS.items() if dim in dims
    }
    own = {} if case is None else case.own_units
    dataset = xr.Dataset({**variables, **parts}, attrs={**attributes, **own, **provenance(case)})
    dataset = dataset.set_coords([name for name in layout.coordinates if name in dataset])
    return dataset if case is None else _spoken(dataset, case.model().names[0])


def _spoken(dataset: xr.Dataset, coordinate: str) -> xr.Dataset:
    """The dataset in the words of the coordinate that the first spring is in, if not pitch."""
    if coordinate == "pitch":
        return dataset
    for label, variable in dataset.variables.items():
        words = variable.attrs.get("long_name", "")
        if "pitch" in words and not str(label).startswith("alpha"):
            words = words.replace("pitch, nose up", coordinate)
            variable.attrs["long_name"] = words.replace("pitch", coordinate)
    return dataset.rename(
        {str(name): str(name).replace("pitch", coordinate) for name in dataset.variables
         if str(name).startswith("pitch")}
    )  # fmt: skip


def _absent(value: Any, derived: bool) -> bool:
    """Whether there is nothing to show; in SI units, no more than at any of the places."""
    if derived and isinstance(value, list):
        return all(_absent(one, derived) for one in value)
    return value is None


def _variable(value: Any, field: Field) -> tuple[tuple[str, ...], np.ndarray, dict[str, Any]]:
    """Dimensions, values in the units of files, and attributes."""
    values = _filled(value, field)
    if field.codes and values.dtype.kind == "U":
        places = {word: place for place, word in field.codes.items()}
        codes = [places.get(word, -1) for word in values.ravel().tolist()]
        values = np.array(codes, dtype=np.int8).reshape(values.shape)
    if values.dtype == bool:
        values = values.astype(np.int8)
    factor = field.kind.told.factor
    if factor != 1.0:
        values = values * factor
    if np.iscomplexobj(values):  # NetCDF has no complex numbers
        values = np.stack([values.real, values.imag], axis=-1)
        return (*field.dims, "part"), values, field.attributes
    return field.dims, values, field.attributes


def _filled(value: Any, field: Field) -> np.ndarray:
    """Nested lists or an array as an array, what is missing in it filled up."""
    if isinstance(value, np.ndarray) and value.ndim == len(field.dims):
        return value
    kind = field.kind
    sizes = [len(PARTS.get(dim, ())) for dim in field.dims]
    _measure(value, 0, sizes)
    filled = np.full(sizes, kind.missing, dtype=object if kind is TEXT else kind.dtype)
    _fill(filled, value)
    return filled.astype(str) if kind is TEXT else filled


def _measure(value: Any, level: int, sizes: list[int]) -> None:
    """Widen the sizes of the dimensions to those of the nested lists, from a level on."""
    if value is None or level == len(sizes):
        return
    if isinstance(value, np.ndarray):
        for k, size in enumerate(value.shape):
            sizes[level + k] = max(sizes[level + k], size)
        return
    sizes[level] = max(sizes[level], len(value))
    for one in value:
        _measure(one, level + 1, sizes)


def _fill(target: np.ndarray, value: Any) -> None:
    """Put nested lists, or arrays within them, where they belong."""
    if isinstance(value, np.ndarray):
        target[tuple(slice(size) for size in value.shape)] = value
    elif value is not None:
        for place, one in enumerate(value):
            if target.ndim > 1:
                _fill(target[place], one)
            elif isinstance(one, tuple | list):  # sentences
                target[place] = "; ".join(map(str, one))
            elif one is not None:
                target[place] = one


def _attribute(label: str, value: Any, field: Field) -> dict[str, Any]:
    """A fact as an attribute that NetCDF can hold."""
    if isinstance(value, Mapping):  # what only one engine knows
        return {k: one for k, one in value.items() if isinstance(one, (str, int, float))}
    if isinstance(value, str):
        return {label: value}
    if field.kind is TEXT:
        return {label: "; ".join(value)}
    if isinstance(value, list):
        return {label: value}
    factor = field.kind.told.factor
    found = np.asarray(value) * factor if factor != 1.0 else value
    found = np.asarray(found)
    if found.dtype == bool:
        found = found.astype(np.int8)
    return {label: found if found.ndim else found.item()}


def side_by_side(parts: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """Datasets in one, all their names with a suffix: NetCDF has no list of Datasets."""
    renamed = [
        part.rename({name: f"{name}_{suffix}" for name in {*part.variables, *part.sizes}})
        for suffix, part in parts.items()
    ]
    return xr.merge(renamed, combine_attrs="drop_conflicts")


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
