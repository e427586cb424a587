"""What `aeroflutter lco --plot` draws over the branch: describing function, simulation, points."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from aeroflutter.cli.airspeed import axis_of_speeds
from aeroflutter.errors import InputError
from aeroflutter.files import read_bytes
from aeroflutter.results.unit import native

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from aeroflutter.case import Case
    from aeroflutter.model.section import Scale
    from aeroflutter.plots.cycles import Overlay

__all__ = ["overlays", "read_points"]

_PITCHES = (0.6, 12.0)  # initial pitch of the simulations, in units of the spring's scale
_MOTIONS = 8


def overlays(
    case: Case, *, plot: bool, df: bool, simulate: str | None, points_csv: Path | None
) -> Callable[[], list[Overlay]]:
    """What to draw, checked now and computed when it is called.

    Raises
    ------
    InputError
        If nothing is drawn, a range is malformed or the file cannot be used.
    """
    if not plot and (df or simulate is not None or points_csv is not None):
        raise InputError("--df, --simulate, --points-csv: only add to a figure; give --plot FILE")
    ready = [] if points_csv is None else [read_points(points_csv, _flutter(case), case.scale)]
    speeds = None if simulate is None else axis_of_speeds("--simulate", simulate, case)

    def compute() -> list[Overlay]:
        found = [_describing(case)] if df else []
        if speeds is not None:
            found += _simulated(case, speeds)
        return found + ready

    return compute


def read_points(path: Path, flutter: float | None, scale: Scale | None = None) -> Overlay:
    """Points of a CSV file: `amplitude_deg`, and `speed_ratio`, `speed` or `velocity_m_s`.

    Parameters
    ----------
    path
        The file; its first line names the columns, others are ignored.
    flutter
        U*_L, to turn speed ratios into speeds.
    scale
        To turn velocities into speeds.

    Raises
    ------
    InputError
        If the file is not there, lacks a column, or holds something that is not a number.
    """
    import numpy as np

    from aeroflutter.plots.cycles import Overlay

    try:
        text = read_bytes(path, f"--points-csv {path}").decode("utf-8-sig")
        rows = list(csv.DictReader(io.StringIO(text, newline=""), skipinitialspace=True))
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"--points-csv {path}: cannot be read: {error}") from None
    if not rows:
        raise InputError(f"--points-csv {path}: has no rows under its heading")
    names = ("velocity_m_s", "speed") if scale is not None else ("speed",)
    name = next((one for one in names if one in rows[0]), "speed_ratio")
    missing = [column for column in (name, "amplitude_deg") if column not in rows[0]]
    if missing:
        raise InputError(
            f"--points-csv {path}: lacks the column {' and '.join(missing)}; its first line must "
            "name amplitude_deg and speed_ratio or speed, or velocity_m_s where there are SI data"
        )
    try:
        speed = np.array([float(row[name]) for row in rows])
        amplitude = np.array([float(row["amplitude_deg"]) for row in rows])
    except (TypeError, ValueError) as error:
        raise InputError(f"--points-csv {path}: {error}") from None
    if name == "speed_ratio":
        if flutter is None:
            raise InputError(
                f"--points-csv {path}: speed_ratio has nothing to refer to, there is no linear "
                "flutter speed; give the column speed"
            )
        speed = speed * flutter
    elif name == "velocity_m_s" and scale is not None:
        speed = speed * scale.speed(1.0)
    from aeroflutter.plots.style import literal

    return Overlay(literal(path.stem), "points", speed, native(amplitude))


def _flutter(case: Case) -> float | None:
    from aeroflutter.linear.rootlocus import flutter_speed

    return flutter_speed(case.loop()[0])


def _describing(case: Case) -> Overlay:
    from aeroflutter.orbits.describing import describing_curve
    from aeroflutter.plots.cycles import Overlay

    curve = describing_curve(*case.loop())
    return Overlay(
        "describing function", "curve", curve.speed, curve.amplitude, curve.stable, curve.family
    )


def _simulated(case: Case, speeds: NDArray[np.float64]) -> list[Overlay]:
    """How motions from several initial pitches end at each speed, by the exact engine."""
    import numpy as np

    from aeroflutter.model.lure import as_family
    from aeroflutter.motion.endstates import EndOptions, end_states
    from aeroflutter.motion.flow import Flow
    from aeroflutter.plots.cycles import Overlay
    from aeroflutter.springs import each
    from aeroflutter.verdicts import STATES

    family, springs = case.loop()[0], each(case.loop()[1])
    C = as_family(family).stack(as_family(family).search_range[1])[2]
    sizes = np.geomspace(*_PITCHES, _MOTIONS)[:, None]
    scales = np.array([one.scale for one in springs])
    y = 0.5 * np.array([sum(one.span()) for one in springs]) + scales * sizes
    found: dict[str, list[tuple[float, float]]] = {"lco": [], "aperiodic": []}
    for speed in speeds:
        flow = Flow(family.at(float(speed)), springs)
        memory = np.column_stack(
            [one.initial_memory(at) for one, at in zip(flow.springs, y.T, strict=True)]
        )
        ends = end_states(
            flow, y @ np.linalg.pinv(C).T, memory, EndOptions(patience=10), share=True
        )
        for state, amplitude in zip(ends.state, ends.amplitude, strict=True):
            if STATES[state] in found:
                found[STATES[state]].append((float(speed), float(amplitude)))
    names = {"lco": "simulated", "aperiodic": "simulated, aperiodic"}
    return [
        Overlay(names[state], "points", *np.unique(pairs, axis=0).T)
        for state, pairs in found.items()
        if pairs
    ]
