"""Verdicts on chaos as Datasets; importing this module teaches `to_dataset` about them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.motion.chaos import ChaosResult, ChaosScan
from aeroflutter.motion.chaos.verdict import VERDICTS
from aeroflutter.results.dataset import labelled, to_dataset

if TYPE_CHECKING:
    import xarray as xr

    from aeroflutter.case import Case

__all__ = ["to_dataset"]

_NAMES = {
    "lyapunov": ("1", "Lyapunov exponent per unit of tau"),
    "lyapunov_error": ("1", "stated error of the Lyapunov exponent"),
    "statistical_error": ("1", "half-width of the 95 % interval of the mean over blocks"),
    "drift": ("1", "exponent of the second half of the run minus that of the first"),
    "resolution": ("1", "ln m / T: growth in proportion to time looks that unstable"),
    "running": ("1", "finite-time Lyapunov exponent up to running_time"),
    "running_time": ("1", "length of the run in tau"),
    "blocks": ("1", "Lyapunov exponent of one block of the run"),
    "peak_deg": ("degree", "maximum of pitch"),
    "trough_deg": ("degree", "lowest minimum of pitch since the maximum before"),
    "peak_time": ("1", "nondimensional time tau of the maximum"),
    "peak_memory_deg": ("degree", "memory of the spring at the maximum"),
    "peak_states": ("1", "states at the maximum, rad and tau"),
    "verdict": ("1", "kind of motion"),
    "loops": ("1", "maxima of pitch in one period, 0 if not periodic"),
    "dimension": ("1", "Kaplan-Yorke dimension"),
    "multiplier": ("1", "largest modulus of the Floquet multipliers"),
}


@to_dataset.register(ChaosResult)
def _(result: ChaosResult, *, case: Case | None = None) -> xr.Dataset:
    found = result.exponents
    variables: dict[str, Any] = {
        "lyapunov": ("exponent", found.values),
        "lyapunov_error": ("exponent", found.error),
        "statistical_error": ("exponent", found.statistical),
        "drift": ("exponent", found.drift),
        "running": (("running_time", "exponent"), found.running),
        "blocks": (("block", "exponent"), found.blocks),
        "peak_deg": ("maximum", np.degrees(result.section.pitch)),
        "peak_time": ("maximum", result.section.time),
        "peak_states": (("maximum", "state_name"), result.section.states),
        "peak_memory_deg": ("maximum", np.degrees(result.memory)),
        "trough_deg": ("maximum", np.degrees(result.troughs)),
    }
    coordinates = {
        "exponent": np.arange(1, found.values.size + 1),
        "running_time": found.time,
        "state_name": list(result.section.state_names),
    }
    attributes = {
        "verdict": result.verdict,
        "reason": result.reason,
        "engine": result.engine,
        "loops": result.loops,
        "period": result.period,
        "multiplier": result.multiplier,
        "dimension": found.dimension,
        "resolution": found.resolution,
        "amplitude_deg": float(np.degrees(result.amplitude)),
        "bias_deg": float(np.degrees(result.bias)),
        "transient": result.transient,
    }
    return _described(labelled(variables, coordinates, attributes, case))


@to_dataset.register(ChaosScan)
def _(result: ChaosScan, *, case: Case | None = None) -> xr.Dataset:
    peaks = [np.degrees(one.peaks()) for one in result.results]
    most = max((row.size for row in peaks), default=0)
    padded = np.array([np.pad(row, (0, most - row.size), constant_values=np.nan) for row in peaks])
    codes = np.array([VERDICTS.index(one.verdict) for one in result.results], dtype=np.int8)
    variables: dict[str, Any] = {
        "lyapunov": (("value", "exponent"), result.exponents),
        "lyapunov_error": (("value", "exponent"), result.errors),
        "verdict": ("value", codes),
        "peak_deg": (("value", "peak"), padded.reshape(len(peaks), most)),
    }
    for name in ("loops", "period", "multiplier"):
        variables[name] = "value", [getattr(one, name) for one in result.results]
    for name in ("amplitude", "bias"):
        angles = np.array([getattr(one, name) for one in result.results])
        variables[f"{name}_deg"] = "value", np.degrees(angles)
    variables["dimension"] = "value", [one.exponents.dimension for one in result.results]
    coordinates = {
        "value": result.values,
        "exponent": np.arange(1, result.exponents.shape[1] + 1),
    }
    dataset = _described(labelled(variables, coordinates, {}, case))
    dataset["verdict"].attrs |= {
        "flag_values": np.arange(len(VERDICTS), dtype=np.int8),
        "flag_meanings": " ".join(VERDICTS),
    }
    return dataset


def _described(dataset: xr.Dataset) -> xr.Dataset:
    for name, (units, long_name) in _NAMES.items():
        if name in dataset.variables:
            dataset[name].attrs |= {"units": units, "long_name": long_name}
    return dataset
