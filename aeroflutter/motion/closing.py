"""Attracting cycles: closing a near return, and whether the cycle attracts.

A point z = (x, h) on the section of maxima of the first output. The return map's derivative there
is the monodromy matrix with the direction of the flow projected out along the section.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from aeroflutter.motion import _kernel_cycle as kernel
from aeroflutter.motion._kernel_cycle import ATTRACTS, INDIFFERENT, NOTHING, UNPREPARED
from aeroflutter.motion._kernel_ends import MOST_LOOPS, Cycles
from aeroflutter.motion._kernel_flow import DONE, FULL, NOWHERE, PLACE, march
from aeroflutter.motion.march import FOREVER, March, stand, workspace
from aeroflutter.springs._kernel_columns import CEILING, FLOOR, HELD

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from aeroflutter.motion.flow import Flow, Point

    Array = NDArray[np.float64]
    Complex = NDArray[np.complex128]

__all__ = ["Closing", "approach", "norm", "section_map"]

RETURNS = 1e-7  # relative distance at which a part of a period is one
CIRCLE = 1e-7  # distance of multipliers from the unit circle that is not told from zero
CONTINUUM = 1e-5  # distance of a multiplier from one in a continuum of cycles
ROWS = 64  # logs of one period, emptied as often as needed


class Extent(NamedTuple):
    """What y does over one period from a maximum.

    Attributes
    ----------
    least, most
        Its smallest and largest value.
    maxima
        How many there are.
    inside
        Whether there is a slider and none ever meets a stop.
    """

    least: float
    most: float
    maxima: int
    inside: bool


class Closing:
    """Newton's method on one flow, with its work space."""

    def __init__(self, flow: Flow) -> None:
        k = flow.n + flow.m
        self.flow = flow
        self.probe = workspace(flow, np.zeros((k, k)))
        self.room = kernel.Room(
            np.zeros((k, k)), np.zeros(k), np.zeros(k), np.zeros((k + 1, k + 1)), np.zeros(k + 1),
            np.zeros(k + 1), np.zeros(k + 1, dtype=np.int64), *(np.zeros(k) for _ in range(4)),
        )  # fmt: skip
        self._round: March | None = None

    def find(
        self, point: Array, period: float, lag: int, size: Array, span: float, cycles: Cycles,
        place: int, most: int = MOST_LOOPS,
    ) -> int:  # fmt: skip
        """Close a near return into a cycle; enter what it measures at a place of `cycles`.

        Parameters
        ----------
        point
            (x, h) of the return, at a maximum of y, (n+m,).
        period, lag
            Time and number of maxima since the earlier return that it resembles.
        size
            Scale of each entry of `point`, (n+m,).
        span
            Height of the last loop.
        most
            Maxima that a cycle may have.

        Returns
        -------
        int
            `ATTRACTS` (`norm` then says how), `INDIFFERENT` (a multiplier on the unit circle), or
            `NOTHING`.
        """
        z, unit = point.copy(), np.maximum(size, 1e-14 * np.max(size))
        closed, period = self._smallest(z, period, lag, unit)
        if not closed:
            return NOTHING
        extent = self._extent(z, period)
        if not (extent.most - extent.least > 1e-6 * span and extent.maxima <= most):
            return NOTHING
        # Of the return map: the direction of the motion is not in it, and where a jump of F is at
        # the section itself, it does not matter on which side of the section it counts.
        Q = section_map(self.room.normal, self.room.monodromy, self.room.f, unit)
        if not np.all(np.isfinite(Q)):
            return NOTHING
        values = eigenvalues(Q)
        sizes, free = np.abs(values), False
        if extent.inside:
            one = np.abs(values - 1.0)
            free = bool(np.min(one) < CONTINUUM)
            sizes[np.argmin(one)] *= not free
        radius = float(np.max(sizes))
        if not radius < 1.0 + CIRCLE:
            return NOTHING
        cycles.Q[place], cycles.z[place], cycles.size[place] = Q, z, unit
        cycles.loops[place], cycles.free[place], cycles.period[place] = extent.maxima, free, period
        cycles.amplitude[place] = 0.5 * (extent.most - extent.least)
        cycles.bias[place], cycles.radius[place] = 0.5 * (extent.most + extent.least), radius
        if not radius < 1.0 - CIRCLE:
            return INDIFFERENT
        return ATTRACTS

    def _smallest(self, z: Array, period: float, lag: int, unit: Array) -> tuple[bool, float]:
        """Close a return, and the smallest part of its period that is one."""
        closed, period = self._close(z, period, unit)
        for part in range(1, lag if closed else 0):
            if lag % part == 0 and self._comes_back(z, period * part / lag, unit):
                return self._close(z, period * part / lag, unit)
        return closed, period

    def _close(self, z: Array, period: float, unit: Array) -> tuple[bool, float]:
        start, status = z.copy(), UNPREPARED
        while status == UNPREPARED:
            z[:] = start
            status, found = kernel.close(self.flow.arrays, self.probe, self.room, z, period, unit)
            if status == UNPREPARED:
                self.flow.prepare(np.array([self.probe.memo[PLACE]]))
        return status == ATTRACTS, found

    def carried(self, point: Point, duration: float) -> Array | None:
        """d x/d x over a time from a point, (n, n); None if the motion does not go on so long."""
        n, probe, flow = self.flow.n, self.probe, self.flow
        stand(probe, point)
        probe.tangents[:] = 0.0
        probe.tangents[np.arange(n), np.arange(n)] = 1.0
        none = probe.none
        status = march(
            flow.arrays, probe, point.time + duration, FOREVER, NOWHERE, none, none, none
        )
        return probe.tangents[:n, :n].copy() if status == DONE else None

    def _comes_back(self, z: Array, time: float, size: Array) -> bool:
        """Whether z comes back to itself after a time."""
        n, flow = self.flow.n, self.flow
        march = March(flow, flow.begin(z[:n], z[n:]))
        if march.run(time) != DONE:
            return False
        point = march.point()
        end = np.append(point.x, point.memory)
        return bool(np.all(np.abs(end - z) <= RETURNS * size))

    def _extent(self, z: Array, period: float) -> Extent:
        n, flow = self.flow.n, self.flow
        start = flow.begin(z[:n], z[n:])
        march = self._round = self._round or March(flow, start, events=ROWS, turns=ROWS)
        march.stand(start)
        first = flow.arrays.laws[:, 0]
        slides = first[:, HELD] != 0.0
        low, high = first[:, FLOOR], first[:, CEILING]
        inside = bool(np.any(slides) and np.all(((low < z[n:]) & (z[n:] < high))[slides]))
        least = most = float(flow.C[0] @ start.x)
        maxima, status = 1, FULL
        while status == FULL:
            status = march.run(period)
            turns, events = march.turns(), march.events()
            march.empty()
            least = min(least, float(np.min(turns[:, 1], initial=least)))
            most = max(most, float(np.max(turns[:, 1], initial=most)))
            between = (turns[:, 0] > 1e-9 * period) & (turns[:, 0] < (1.0 - 1e-9) * period)
            maxima += int(np.sum(between & (turns[:, 2] > 0.0)))
            spring = events[:, 5].astype(np.int64)
            held = events[:, 3] - events[:, 4]
            clear = (low[spring] < held) & (held < high[spring])
            inside = inside and bool(np.all(clear | ~slides[spring]))
        return Extent(least, most, maxima, inside)


def norm(cycles: Cycles, place: int) -> None:
    """Enter the norm in which the return map of a cycle contracts, and what decays slowest."""
    Q = cycles.Q[place]
    cycles.rho[place] = 1.0
    if not cycles.free[place]:
        cycles.rho[place], cycles.P[place], cycles.slow[place] = approach(
            Q, float(cycles.radius[place])
        )


def approach(Q: Array, radius: float) -> tuple[float, Array, Array]:
    """ρ and P of `contraction`, and the rows of the coordinate of Q that decays slowest."""
    rho, P = contraction(Q, radius)
    spectrum = Spectrum.of(Q)
    return rho, P, spectrum.rows(int(np.argmax(np.abs(spectrum.values))), P)


def eigenvalues(Q: Array) -> Complex:
    """Of a matrix that is small: LAPACK, without what numpy and scipy put around it."""
    from scipy.linalg.lapack import dgeev

    real, imaginary, *_ = dgeev(Q, compute_vl=0, compute_vr=0)
    return np.asarray(real + 1j * imaginary)


def section_map(normal: Array, monodromy: Array, f: Array, size: Array) -> Array:
    """Derivative of the return map on a section of this normal, in units of `size`, (k, k)."""
    along = (normal @ monodromy) / (normal @ f)
    return np.asarray((monodromy - np.outer(f, along)) * size / size[:, None])


class Spectrum(NamedTuple):
    """Eigenvalues of a matrix, (k,), with left and right eigenvectors as LAPACK keeps them."""

    values: Complex
    left: Array
    right: Array

    @classmethod
    def of(cls, Q: Array) -> Spectrum:
        """As `eigenvalues`."""
        from scipy.linalg.lapack import dgeev

        real, imaginary, left, right, _ = dgeev(Q)
        return cls(real + 1j * imaginary, left, right)

    def rows(self, place: int, P: Array) -> Array:
        """Rows whose products with d are one coordinate of d, in lengths of norm P, (2, k).

        Its real and its imaginary part.
        """
        value = complex(self.values[place])
        left, right = self._of(self.left, place).conj(), self._of(self.right, place)
        length, product = float(np.vdot(right, P @ right).real), left @ right
        pair = 2.0 if abs(value.imag) > 1e-9 * abs(value) else 1.0
        factor = pair * max(length, 0.0) ** 0.5 / product if product != 0.0 else 0.0
        row = factor * left
        return np.array([row.real, row.imag])

    def _of(self, vectors: Array, place: int) -> Complex:
        """One vector: of a pair the columns are the real and the imaginary part of the first."""
        imaginary = float(self.values[place].imag)
        if imaginary == 0.0:
            return vectors[:, place].astype(complex)
        first = place if imaginary > 0.0 else place - 1
        turn = 1j if imaginary > 0.0 else -1j
        return np.asarray(vectors[:, first] + turn * vectors[:, first + 1])


def contraction(Q: Array, radius: float) -> tuple[float, Array]:
    """Norm in which a linear map Q of this spectral radius contracts by ρ, between it and 1.

    Returns
    -------
    ρ, and P with Qᵀ P Q <= ρ² P: Σ (Q/ρ)ᵀᵏ (Q/ρ)ᵏ, summed by doubling.
    """
    rho, P = 0.5 * (1.0 + radius), np.eye(Q.shape[0])
    power: Array = Q / rho
    due = int(np.log2(1.0 + np.log(1e-12) / np.log(max(radius / rho, 1e-12))))
    for doubling in range(40):
        P += power.T @ P @ power
        power = power @ power
        if doubling >= due and max(power.max(), -power.min()) < 1e-12:
            break
    return rho, P
