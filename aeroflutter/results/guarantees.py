"""A describing function's curve with its guarantees as a Dataset."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.guarantees import Guarantees
from aeroflutter.orbits.describing import DescribingCurve
from aeroflutter.results.dataset import to_dataset

if TYPE_CHECKING:
    import xarray as xr

    from aeroflutter.case import Case

__all__ = ["describing_to_dataset"]

_NAMES = {
    "guaranteed": ("1", "1 where a cycle of this first harmonic is proved to lie in the bands"),
    "guarantee_speed": ("1", "band of airspeed U* that contains a cycle of this first harmonic"),
    "guarantee_k": ("1", "band of its reduced frequency"),
    "guarantee_amplitude_deg": ("degree", "band of the first harmonic of cycles at this airspeed"),
    "exists_at_speed": ("1", "1 where a cycle is proved to exist at this airspeed in that band"),
    "contraction_ratio": ("1", "contraction ratio of the higher harmonics"),
    "expected_error": ("1", "relative error of U* not exceeded by 95 % of like distortions"),
    "doubtful": ("1", "1 without guarantee where U* is likely off by more than one per cent"),
    "guarantee_reason": ("1", "why there is no guarantee"),
}


def describing_to_dataset(
    result: DescribingCurve, found: Guarantees, *, case: Case | None = None
) -> xr.Dataset:
    """The curve with the guarantee of every point."""
    band = ("point", "band")
    variables: dict[str, Any] = {
        "guaranteed": ("point", found.guaranteed.astype(np.int8)),
        "guarantee_speed": (band, found.speed),
        "guarantee_k": (band, found.omega),
        "guarantee_amplitude_deg": (band, np.degrees(found.amplitude)),
        "exists_at_speed": ("point", found.exists_at_speed.astype(np.int8)),
        "contraction_ratio": ("point", found.ratio),
        "expected_error": ("point", found.expected_error),
        "doubtful": ("point", found.doubtful.astype(np.int8)),
        "guarantee_reason": ("point", np.array(found.reason, dtype=object)),
    }
    dataset = to_dataset(result, case=case).assign(variables)
    dataset = dataset.assign_coords(band=["low", "high"])
    for name, (units, long_name) in _NAMES.items():
        dataset[name].attrs |= {"units": units, "long_name": long_name}
    return dataset
