"""How far each coordinate and each spring moves, whichever of them a march has its eye on."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeroflutter.model.coordinates import named_rows
from aeroflutter.model.lure import AnySystem, as_system

if TYPE_CHECKING:
    from aeroflutter.motion.flow import Flow

Array = NDArray[np.float64]

__all__ = [
    "Lap",
    "Swing",
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


class Lap(NamedTuple):
    """A cycle once round: coordinates as polynomials in the time of each step.

    Attributes
    ----------
    period
        Of the cycle.
    starts, lengths
        Of each step, (i,) twice.
    y
        Coefficients of the powers of the part of a step gone by, (i, WIDTH, r).
    place
        Which of them each row asked for is, (q,).
    """

    period: float
    starts: Array
    lengths: Array
    y: Array
    place: list[int]

    @classmethod
    def of(cls, flow: Flow, z: Array, period: float, rows: Array | None = None) -> Lap:
        """Of the cycle through z = (x, every memory): rows @ x, by default `rows_of`."""
        from aeroflutter.motion.march import March

        rows = rows_of(flow.system) if rows is None else rows
        alike: dict[bytes, int] = {}  # a coordinate and the spring in it move alike to the last bit
        place = [alike.setdefault(row.tobytes(), len(alike)) for row in rows]
        distinct = rows[[place.index(i) for i in range(len(alike))]]
        march = March(flow, flow.begin(z[: flow.n], z[flow.n :]))
        return cls(period, *march.through(period, distinct), place)

    def extremes(self) -> tuple[Array, Array]:
        """Lowest and highest of each row, (q,) twice.

        A step in which one may turn is looked at between nodes, and Newton's method finds the
        turns to round-off.
        """
        y, order = self.y, np.arange(self.y.shape[1])
        ends = np.concatenate((y[:, 0], np.sum(y, axis=1)))
        low, high = ends.min(axis=0), ends.max(axis=0)
        step, row = np.nonzero(np.abs(y[:, 1]) <= order[2:] @ np.abs(y[:, 2:]))
        turning = y[step, :, row]
        slopes, bends = turning[:, 1:] * order[1:], turning[:, 2:] * (order[2:] * order[1:-1])
        rates = slopes @ _nodes(order.size)[:-1]
        which, node = np.nonzero(rates[:, :-1] * rates[:, 1:] < 0.0)
        first, last = rates[which, node], rates[which, node + 1]
        turning, slopes, bends = turning[which], slopes[which], bends[which]
        least = node / (_NODES - 1)
        s = least + first / (first - last) / (_NODES - 1)
        with np.errstate(divide="ignore", invalid="ignore"):
            for _ in range(_NEWTON):
                powers = _powers(s, order.size)
                rate = np.einsum("ij,ij->i", slopes, powers[:, :-1])
                change = rate / np.einsum("ij,ij->i", bends, powers[:, :-2])
                s = np.minimum(np.maximum(s - change, least), least + 1.0 / (_NODES - 1))
        turned = np.einsum("ij,ij->i", turning, _powers(s, order.size))
        np.fmin.at(low, row[which], turned)
        np.fmax.at(high, row[which], turned)
        return low[self.place], high[self.place]

    def fundamental(self, row: int) -> float:
        """Amplitude of the fundamental of a row.

        It is analytic within a step, so Gauss's rule on each step is exact to round-off.
        """
        y = self.y[..., self.place[row]]
        nodes, weights, powers = _gauss_rule(y.shape[1])
        angles = 2.0 * np.pi / self.period * (self.starts[:, None] + self.lengths[:, None] * nodes)
        parts = weights * self.lengths[:, None] * (y @ powers) * np.exp(1j * angles)
        return float(2.0 / self.period * abs(np.sum(parts)))


def _powers(s: Array, count: int) -> Array:
    """Powers of each of some places, (k, count)."""
    powers = np.repeat(s, count).reshape(-1, count)
    powers[:, 0] = 1.0
    return np.asarray(np.multiply.accumulate(powers, axis=1))


@cache
def _nodes(count: int) -> Array:
    """Powers of the nodes of a step, (count, _NODES)."""
    return np.asarray(np.linspace(0.0, 1.0, _NODES) ** np.arange(count)[:, None])


@cache
def _gauss_rule(count: int) -> tuple[Array, Array, Array]:
    """Nodes and weights of Gauss's rule on [0, 1], exact to twice the degree of a step, and powers.

    Returns
    -------
    nodes, weights, powers
        (count,) twice, and (count, count) by power and node.
    """
    nodes, weights = np.polynomial.legendre.leggauss(count)
    nodes = 0.5 * (nodes + 1.0)
    return nodes, 0.5 * weights, nodes ** np.arange(count)[:, None]


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
