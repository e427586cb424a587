"""How far each coordinate and each spring moves, whichever of them a march has its eye on."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeroflutter.model.coordinates import named_rows
from aeroflutter.model.lure import AnySystem, as_system

if TYPE_CHECKING:
    from aeroflutter.motion.flow import Flow

Array = NDArray[np.float64]

__all__ = [
    "Swing",
    "cycle_extremes",
    "extremes",
    "rest_extremes",
    "rows_of",
    "swings_of",
    "unknown",
]

_NODES = 17  # a step, within which even the fastest mode hardly turns twice
_NEWTON = 3  # steps, from a guess between two nodes


class Swing(NamedTuple):
    """What is said of the motion of a coordinate, or of a spring by the coordinate it is in.

    Attributes
    ----------
    name, unit
        Of the coordinate; "rad", "semichord" or what a model from elsewhere says.
    amplitude, bias
        Half the peak-to-peak and midrange over a steady period; 0 and where it rests for a motion
        that has come to rest; NaN where they are not known.
    """

    name: str
    unit: str
    amplitude: float
    bias: float


def swings_of(system: AnySystem, low: Array, high: Array) -> tuple[list[Swing], list[Swing]]:
    """Swings of all coordinates and of all springs from the extremes of the rows of `rows_of`."""
    whole = as_system(system)
    rows = named_rows(whole)
    named = [(one.name, one.unit) for one in rows] + list(
        zip(whole.names, whole.units, strict=True)
    )
    made = [
        Swing(name, unit, float(0.5 * (top - bottom)), float(0.5 * (top + bottom)))
        for (name, unit), bottom, top in zip(named, low, high, strict=True)
    ]
    return made[: len(rows)], made[len(rows) :]


def rows_of(system: AnySystem) -> Array:
    """Rows (q, n) of all coordinates, then of all springs."""
    whole = as_system(system)
    return np.array([*(one.row for one in named_rows(whole)), *whole.C])


def cycle_extremes(
    flow: Flow, z: Array, period: float, rows: Array | None = None
) -> tuple[Array, Array]:
    """Lowest and highest of rows @ x, by default `rows_of`, on the cycle of z = (x, every memory).

    Each is a polynomial within a step: its turns are looked for between nodes, and Newton's method
    finds them to round-off.
    """
    from aeroflutter.motion.march import March

    march = March(flow, flow.begin(z[: flow.n], z[flow.n :]))
    rows = rows_of(flow.system) if rows is None else rows
    alike: dict[bytes, int] = {}  # a coordinate and the spring in it move alike to the last bit
    place = [alike.setdefault(row.tobytes(), len(alike)) for row in rows]
    _, _, y = march.through(period, rows[[place.index(i) for i in range(len(alike))]])
    order = np.arange(y.shape[1])
    nodes = np.linspace(0.0, 1.0, _NODES)[:, None] ** order
    values, rates = nodes @ y, (nodes[:, :-1] * order[1:]) @ y[:, 1:]
    low, high = values.min(axis=(0, 1)), values.max(axis=(0, 1))
    step, node, row = np.nonzero(rates[:, :-1] * rates[:, 1:] < 0.0)
    first, last = rates[step, node, row], rates[step, node + 1, row]
    turning = y[step, :, row]
    slopes, bends = turning[:, 1:] * order[1:], turning[:, 2:] * (order[2:] * order[1:-1])
    s = (node + first / (first - last)) / (_NODES - 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        for _ in range(_NEWTON):
            powers = s[:, None] ** order
            rate, bend = np.sum(slopes * powers[:, :-1], 1), np.sum(bends * powers[:, :-2], 1)
            s = np.clip(s - rate / bend, node / (_NODES - 1), (node + 1) / (_NODES - 1))
    turned = np.sum(turning * s[:, None] ** order, axis=1)
    np.fmin.at(low, row, turned)
    np.fmax.at(high, row, turned)
    return low[place], high[place]


def extremes(states: Array, rates: Array, dt: float, rows: Array) -> tuple[Array, Array]:
    """Extremes of rows @ x between uniform samples (k, n) of x and x', by cubics through them."""
    y, slope = states @ rows.T, dt * (rates @ rows.T)
    low, high = y.min(axis=0), y.max(axis=0)
    turning = np.argwhere(slope[:-1] * slope[1:] < 0.0)
    if turning.size:
        i, j = turning.T
        values = _turn(y[i, j], y[i + 1, j], slope[i, j], slope[i + 1, j])
        np.minimum.at(low, j, values)
        np.maximum.at(high, j, values)
    return low, high


def _turn(start: Array, end: Array, first: Array, last: Array) -> Array:
    """Where the cubic of these ends and slopes over [0, 1] turns, slopes being of either sign."""
    rise = end - start
    a, b = 3.0 * (first + last - 2.0 * rise), 2.0 * (3.0 * rise - 2.0 * first - last)
    # of a s² + b s + first = 0 the root in [0, 1]: the one at which the slope takes the last sign
    root = np.sqrt(np.maximum(b * b - 4.0 * a * first, 0.0))
    s = np.clip(-2.0 * first / (b + np.copysign(root, last - first)), 0.0, 1.0)
    return np.asarray(start + s * (first + s * (0.5 * b + s * a / 3.0)))


def rest_extremes(flow: Flow, state: Array, memory: Array, rest: float) -> tuple[Array, Array]:
    """Where each of `rows_of` rests, once a motion will never switch again, twice.

    Of a state that neither the equations nor `rest`, y of the first output there, fix (a free
    coordinate), the value at which the march stopped is kept.
    """
    point = flow.begin(state, memory)
    generator = flow.arrays.generator[flow.table(point.modes)]
    inputs = flow.entries(point)[flow.n :]
    rows = np.vstack((generator[:, : flow.n], flow.C[0]))
    wanted = np.append(-generator[:, flow.n :] @ inputs, rest)
    x = state + np.linalg.lstsq(rows, wanted - rows @ state, rcond=None)[0]
    y = rows_of(flow.system) @ x
    return y, y


def unknown(system: AnySystem) -> tuple[Array, Array]:
    """Of a motion that is not measured."""
    nothing = np.full(len(rows_of(system)), np.nan)
    return nothing, nothing
