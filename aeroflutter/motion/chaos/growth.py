"""A motion followed with its tangents: what both engines give."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from aeroflutter.motion.spectra import PoincareSection

    Array = NDArray[np.float64]

__all__ = ["Engine", "Growth", "Landing", "first_tangents"]


@dataclass(frozen=True, kw_only=True)
class Growth:
    """A stretch of motion and the growth of its tangents.

    Attributes
    ----------
    section
        Time, y and states at the maxima of y, m of them.
    memory, troughs
        Memory there, of several springs (m, springs), and the lowest minimum of y since the
        maximum before, (m,).
    time, logs
        When tangents were made orthonormal again and the logarithms of their growth, (r,), (r, k).
    final_state, final_memory
        Where the stretch ends, (n,).
    """

    section: PoincareSection
    memory: Array = field(repr=False)
    troughs: Array = field(repr=False)
    time: Array = field(repr=False)
    logs: Array = field(repr=False)
    final_state: Array = field(repr=False)
    final_memory: Any


@dataclass(frozen=True, kw_only=True)
class Landing:
    """How a motion ends, as far as an engine can tell.

    Attributes
    ----------
    state, reason
        One of the five end states, and what decided it.
    loops, period, multiplier
        Of a limit cycle: maxima a period, T, largest modulus of its Floquet multipliers.
    rest
        y at rest, for a damped motion.
    state_vector, memory
        A point of the cycle, or where the march stopped.
    """

    state: str
    reason: str
    loops: int
    period: float
    multiplier: float
    rest: float
    state_vector: Array = field(repr=False)
    memory: Any


class Engine(Protocol):
    """What follows a motion with its tangents. Obligations:

    1. ``land`` says how the motion from a state ends, and hands back a state on its attractor.
    2. ``grow`` follows it over `transient` maxima unseen, then over `count`; it stops early where
       there are no more maxima, and what was found until then is returned.
    3. ``closed`` is the system linearised where a motion comes to rest or leaves, (n, n).
    """

    @property
    def name(self) -> str: ...

    @property
    def default_cycles(self) -> int: ...

    def land(self, state: Array, memory: Any) -> Landing: ...

    def grow(self, landing: Landing, count: int, transient: int, exponents: int) -> Growth: ...

    def closed(self, landing: Landing) -> Array: ...


def first_tangents(rows: int, columns: int) -> Array:
    """Directions in general position, the same in every run, (rows, columns)."""
    return np.random.default_rng(0).standard_normal((rows, columns))
