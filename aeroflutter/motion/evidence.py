"""What a bounded motion that settles on nothing shows: whether its envelope still changes, and how.

A motion is called aperiodic on evidence alone: its envelope is stationary, its returns are broad,
and its neighbours part (a positive Lyapunov exponent, beyond its error) or, over many more cycles,
neither part nor approach each other (a torus). A motion whose envelope still changes is settling,
however long it takes, and the rate of the change is part of the verdict.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from aeroflutter.motion.exponents import Exponents
    from aeroflutter.springs import Spring

    Array = NDArray[np.float64]

__all__ = ["Change", "Envelope", "growth_at", "lossless", "larger", "smaller"]

GROUP = 25  # loops whose extremes are one point of the envelope
POINTS = 16  # at most, to which the envelope is coarsened; a change is that over its last half
SURE = 3.0  # standard errors
ROUND_OFF = 1e-9  # change of an envelope, relative, that is none
PARTING = 0.05  # the same that a chaotic motion may make up for
FLAT = 0.02  # the same of a torus
BROAD = 1e-3  # distance of a return from the nearest of those before it, over the height of a loop
LOSSLESS = 1e-10  # sum of the exponents over the largest root, where nothing is damped
SLOWER = 0.9  # change of a height that comes to a halt over that just before
LONGEST = 200  # loops of a cycle that is looked for where a motion seems to have none
PATIENT = 8  # times as many cycles before a torus is believed
SIZES = np.geomspace(1.0, 1e4, 65)  # at which a describing function is asked, over the motion's own


def lossless(matrices: Array) -> bool:
    """Whether neighbours fill as much room as ever on every piece: the sum of exponents is zero.

    Parameters
    ----------
    matrices
        Closed matrices of the pieces, (k, n, n).
    """
    largest = np.abs(np.linalg.eigvals(matrices)).max()
    return bool(np.all(np.abs(np.trace(matrices, axis1=1, axis2=2)) <= LOSSLESS * largest))


def growth_at(loop: Any, spring: Spring, sizes: Array, bias: float) -> Array:
    """Growth of oscillations of some sizes by the describing function, Re p of the quickest, (k,).

    Parameters
    ----------
    loop
        The linear part: A, b and c.
    spring, sizes, bias
        The law, amplitudes, (k,), and the middle of all of them.
    """
    N = spring.describing(sizes, bias).N[:, None, None]
    values = np.linalg.eigvals(loop.A - N * np.outer(loop.b, loop.c))
    return np.asarray(np.max(np.where(values.imag > 0.0, values.real, -np.inf), axis=1))


def larger(size: float) -> Array:
    """Sizes from one up to where a law of finite size is straight."""
    return size * SIZES


def smaller(size: float) -> Array:
    """Sizes from one down to nothing."""
    return size / SIZES


class Change(NamedTuple):
    """Relative change of a size over the last half of a motion, and its error.

    Attributes
    ----------
    total, error
        Logarithm of the size after over that before, along the line that fits best.
    loops
        Loops that it took.
    """

    total: float
    error: float
    loops: int

    @property
    def moving(self) -> bool:
        """Whether the size changes for certain."""
        return bool(abs(self.total) > self.error)

    @property
    def rate(self) -> float:
        """Relative change a hundred loops."""
        return float(np.expm1(100.0 * self.total / self.loops)) if self.loops else float("nan")

    def within(self, most: float) -> bool:
        """Whether a change of more than that is excluded."""
        return bool(abs(self.total) + self.error <= most)


@dataclass
class Envelope:
    """Extremes of a motion, and how near it came to its own past, in groups of `GROUP` loops."""

    low: list[float] = field(default_factory=list)
    high: list[float] = field(default_factory=list)
    miss: list[float] = field(default_factory=list)

    def add(self, peaks: Array, troughs: Array, misses: Array) -> None:
        """Enter loops: maxima, the minimum before each, and `miss` of each (see `BROAD`)."""
        whole = peaks.size // GROUP * GROUP
        low, high, miss = (part[:whole].reshape(-1, GROUP) for part in (troughs, peaks, misses))
        self.low.extend(low.min(axis=1).tolist())
        self.high.extend(high.max(axis=1).tolist())
        self.miss.extend(miss.max(axis=1).tolist())

    @property
    def loops(self) -> int:
        """How many there are."""
        return GROUP * len(self.low)

    def last(self) -> tuple[float, float]:
        """Extremes over the last half."""
        half = len(self.low) // 2
        return min(self.low[half:]), max(self.high[half:])

    def sizes(self) -> Array:
        """Heights of the last half, oldest first, coarsened."""
        coarse = self._coarse(np.array(self.high), np.maximum) - self._coarse(
            np.array(self.low), np.minimum
        )
        return coarse[coarse.size // 2 :]

    def change(self) -> Change:
        """Change of the height."""
        return self._fitted(self.sizes())

    def stationary(self, broad: bool = True) -> bool:
        """Whether neither the height nor how near the motion comes to its past still changes."""
        coarse = self._coarse(np.array(self.miss), np.maximum)
        last = coarse[coarse.size // 2 :]
        wide = not broad or bool(np.max(last, initial=0.0) >= BROAD)
        return wide and self.change().within(FLAT) and not self._fitted(last).moving

    def chaotic(self, exponents: Exponents) -> bool:
        """Whether this is the envelope of a motion whose neighbours part, with these exponents."""
        value, error = float(exponents.values[0]), float(exponents.error[0])
        change = self.change()
        still = abs(change.total) <= change.error + PARTING
        last = self.miss[len(self.miss) // 2 :]
        return bool(value > error and still and max(last, default=0.0) >= BROAD)

    @property
    def flat(self) -> bool:
        """Whether the height changes by no more than a chaotic motion may make up for."""
        return self.change().within(PARTING)

    def goes_on(self) -> int:
        """+1 if every part of the last half was larger than the one before, -1 if smaller, or 0."""
        steps = np.sign(np.diff(self.sizes()))
        alike = steps.size >= 3 and bool(np.all(steps == steps[0]))
        return int(steps[0]) if alike else 0

    def halts(self) -> bool:
        """Whether returns are near each other, and the height changes ever more slowly."""
        logs = np.log(np.maximum(self.sizes(), 1e-300))
        last = self.miss[len(self.miss) // 2 :]
        if logs.size < 4 or max(last, default=1.0) >= BROAD:
            return False
        half = logs.size // 2
        return bool(abs(logs[-1] - logs[half]) < SLOWER * abs(logs[half - 1] - logs[0]))

    def retreats(self) -> bool:
        """Whether the height has fallen from every part of the last half to the next."""
        sizes = self.sizes()
        return bool(sizes.size >= 4 and np.all(sizes[1:] <= 0.95 * sizes[:-1]))

    def _coarse(self, values: Array, most: np.ufunc) -> Array:
        """The same in fewer and larger groups, the last ones whole."""
        size = -(-values.size // POINTS)
        used = values[values.size % size :]
        return np.asarray(most.reduce(used.reshape(-1, size), axis=1))

    def _fitted(self, sizes: Array) -> Change:
        """The line that fits the logarithms of sizes best."""
        count = sizes.size
        loops = GROUP * (len(self.low) // 2) * max(count - 1, 0) // max(count, 1)
        if count < 4:
            return Change(0.0, np.inf, loops)
        logs = np.log(np.maximum(sizes, 1e-300))
        at = np.linspace(-0.5, 0.5, count)
        spread = float(at @ at)
        total = float(at @ logs) / spread
        left = logs - logs.mean() - total * at
        error = SURE * float(np.sqrt(left @ left / (count - 2) / spread))
        return Change(total, error + ROUND_OFF, loops)
