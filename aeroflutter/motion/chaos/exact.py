"""Tangents of piecewise-linear springs, carried by the exact engine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from aeroflutter.motion.chaos import _kernel_tangent as kernel
from aeroflutter.motion.chaos.growth import Growth, Landing, first_tangents
from aeroflutter.motion.endstates import end_state
from aeroflutter.motion.prepared import Prepared
from aeroflutter.motion.settling import branch
from aeroflutter.motion.spectra import PoincareSection

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from aeroflutter.model.lure import LureSystem
    from aeroflutter.springs import Spring

    Array = NDArray[np.float64]

__all__ = ["ExactEngine"]

SIZING = 64  # maxima from which the size of each state is taken


@dataclass(frozen=True)
class ExactEngine:
    """Matrix exponentials between switches; see `growth.Engine`."""

    prepared: Prepared
    name: str = "exact"
    default_cycles: int = 20_000

    @classmethod
    def of(cls, system: LureSystem, spring: Spring) -> ExactEngine:
        """The engine of one system with one spring."""
        return cls(Prepared.of(system, spring))

    def land(self, state: Array, memory: float) -> Landing:
        """End state, proved or found by Newton; for a limit cycle, a point that is on it."""
        end = end_state(self.prepared, state, memory)
        point, held = end.final_state, end.final_memory
        if end.cycle is not None:
            point, held = end.cycle.z[0, :-1], float(end.cycle.z[0, -1])
        return Landing(
            state=end.state, reason=end.reason, loops=end.loops, period=end.period,
            multiplier=end.multiplier, rest=end.rest, state_vector=point, memory=held,
        )  # fmt: skip

    def slope(self, landing: Landing) -> float:
        """Slope of the branch on which the motion is."""
        pitch = float(self.prepared.system.c @ landing.state_vector)
        return branch(self.prepared.spring, pitch, landing.memory)[0]

    def grow(self, landing: Landing, count: int, transient: int, exponents: int) -> Growth:
        """Follow the motion with `exponents` tangents over `count` maxima."""
        n = self.prepared.system.order
        march = _March(
            prepared=self.prepared, state=landing.state_vector.copy(), memory=landing.memory,
            tangents=np.zeros((n + 1, exponents)), unit=np.ones(n + 1), reach=np.zeros(n),
        )  # fmt: skip
        march.over(SIZING)
        march.unit = self._unit(march.reach)
        march.tangents[:n] = march.unit[:n, None] * first_tangents(n, exponents)
        march.over(transient)
        points, times, troughs, logs = march.over(count)
        section = PoincareSection(
            time=times,
            pitch=points[:, :n] @ self.prepared.system.c,
            states=points[:, :n],
            state_names=self.prepared.system.state_names,
        )
        return Growth(
            section=section, memory=points[:, n], troughs=troughs, time=times, logs=logs,
            final_state=march.state, final_memory=march.memory,
        )  # fmt: skip

    def _unit(self, reach: Array) -> Array:
        """What counts as one of each (x, h): the size of each state, and that of y for h."""
        largest = float(reach.max()) or 1.0
        pitch = float(np.abs(self.prepared.system.c) @ reach) or largest
        return np.append(np.where(reach > 0.0, reach, largest), pitch)


@dataclass
class _March:
    """Where the kernel stands between two calls."""

    prepared: Prepared
    state: Array
    memory: float
    tangents: Array
    unit: Array
    reach: Array
    mode: int = -1
    trend: int = 0

    def over(self, count: int) -> tuple[Array, Array, Array, Array]:
        """Points, times, troughs and logarithms of the growth at the next maxima."""
        m, k = self.tangents.shape
        points, times = np.empty((count, m)), np.empty(count)
        troughs, logs = np.empty(count), np.empty((count, k))
        _, found, self.memory, self.mode, self.trend = kernel.returns(
            self.prepared.tables, self.prepared.law, self.state, self.memory, self.mode,
            self.trend, self.tangents, self.unit, self.reach, points, times, troughs, logs,
        )  # fmt: skip
        return points[:found], times[:found], troughs[:found], logs[:found]
