"""Responses and sweeps as Datasets; importing this module teaches `to_dataset` about them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.motion.response import STATES, Response
from aeroflutter.motion.sweeps import Sweep
from aeroflutter.results.dataset import labelled, to_dataset

if TYPE_CHECKING:
    import xarray as xr

    from aeroflutter.case import Case

__all__ = ["to_dataset"]


@to_dataset.register(Response)
def _(result: Response, *, case: Case | None = None) -> xr.Dataset:
    dataset = labelled(
        {
            "pitch_deg": ("time", np.degrees(result.pitch)),
            "heave": ("time", result.heave),
            "moment_deg": ("time", np.degrees(result.moment)),
            "memory_deg": ("time", np.degrees(result.memory)),
            "states": (("time", "state_name"), result.states),
            "events": (("event", "event_part"), result.events),
        },
        {
            "time": result.time,
            "state_name": list(result.state_names),
            "event_part": ["time", "kind"],
        },
        {"end_state": result.state, "reason": result.reason, "engine": result.engine}
        | _numbers(result)
        | _plain(result.extras),
        case,
    )
    dataset["states"].attrs |= {"units": "1", "long_name": "states of the system, rad and tau"}
    dataset["events"].attrs |= {"units": "1", "long_name": "time and kind of events of the run"}
    return dataset


@to_dataset.register(Sweep)
def _(result: Sweep, *, case: Case | None = None) -> xr.Dataset:
    codes = np.array([STATES.index(state) for state in result.state], dtype=np.int8)
    angles = ("amplitude", "bias", "first_harmonic", "rest")
    dataset = labelled(
        {f"{name}_deg": ("visit", np.degrees(getattr(result, name))) for name in angles}
        | {
            "period": ("visit", result.period),
            "end_state": ("visit", codes),
            "reason": ("visit", list(result.reason)),
            "jump_before": ("jump", [jump.before for jump in result.jumps]),
            "jump_after": ("jump", [jump.after for jump in result.jumps]),
        },
        {"speed": ("visit", result.speeds)},
        {"direction": "up" if result.upward else "down"},
        case,
    )
    dataset["rest_deg"].attrs |= {"units": "degree", "long_name": "pitch at rest"}
    dataset["end_state"].attrs |= {
        "long_name": "end state",
        "flag_values": np.arange(len(STATES), dtype=np.int8),
        "flag_meanings": " ".join(STATES),
    }
    return dataset


def _numbers(result: Response) -> dict[str, float]:
    """Scalars of a response, angles in degrees."""
    found = {"duration": result.duration, "period": result.period}
    for name in ("amplitude", "bias", "first_harmonic", "rest"):
        found[f"{name}_deg"] = float(np.degrees(getattr(result, name)))
    return found


def _plain(extras: Any) -> dict[str, Any]:
    """What of an engine's extras a NetCDF attribute can hold."""
    return {key: value for key, value in extras.items() if isinstance(value, (str, int, float))}
