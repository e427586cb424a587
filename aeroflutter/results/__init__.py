"""Results as labelled Datasets, DataFrames and plain values, by one table of fields.

Examples
--------
>>> from aeroflutter import load_case
>>> from aeroflutter.linear.rootlocus import root_locus
>>> from aeroflutter.results import to_dataset, to_json
>>> found = root_locus(load_case("run14").family())
>>> round(to_json(found)["flutter"]["speed"], 4)
4.1145
>>> to_dataset(found)["root"].dims
('speed', 'mode', 'part')
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from aeroflutter.results.plain import plain

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from aeroflutter.case import Case

__all__ = ["to_dataframe", "to_dataset", "to_json"]


def to_json(result: object, *, case: Case | None = None) -> dict[str, Any]:
    """The result of an analysis in JSON's types: complex as [re, im], NaN as None.

    Parameters
    ----------
    result : object
        A result object of any analysis; several branches of the harmonic balance as a tuple.
    case : Case, optional
        Its scale gives SI units; by default the case that the result was computed of, if any.

    Raises
    ------
    InputError
        If the object is not the result of an analysis.
    """
    found: dict[str, Any] = plain(fields_of(result, case))
    return found


def fields_of(result: object, case: Case | None = None) -> dict[str, Any]:
    """The same before it is made plain: arrays, complex numbers and NaN are left."""
    from aeroflutter.results.layouts import layout_of
    from aeroflutter.results.schema import record
    from aeroflutter.results.unit import told_of

    case, speed = context_of(result, case)
    with told_of(case):
        found = record(*layout_of(result), None if case is None else case.scale, speed)
    return found if case is None else {**found, **case.own_units}


def context_of(result: object, case: Case | None = None) -> tuple[Case | None, float | None]:
    """The case and the U* that a result belongs to, where it knows them or the case is given."""
    known = getattr(result, "context", {})
    return case if case is not None else known.get("case"), known.get("speed")


def to_dataset(result: object, *, case: Case | None = None) -> xr.Dataset:
    """See `aeroflutter.results.dataset.to_dataset`."""
    from aeroflutter.results import dataset

    return dataset.to_dataset(result, case=case)


def to_dataframe(result: object, *, case: Case | None = None) -> pd.DataFrame:
    """See `aeroflutter.results.dataset.to_dataframe`."""
    from aeroflutter.results import dataset

    return dataset.to_dataframe(result, case=case)
