"""Amplitude curves of several springs by describing functions: a sinusoid in every coordinate.

With one spring the describing function has equations of its own (`balance`); with several it is
the harmonic balance of mean and first harmonic, each spring with its amplitude, phase and bias.
Where it starts from is found on a grid of all amplitudes: at each, every spring is the linear one
of its describing function, and wherever a mode of that system is neutral, its shape is to have
those very amplitudes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from aeroflutter.errors import ConvergenceError, InputError
from aeroflutter.linear.rootlocus import flutter_speed
from aeroflutter.model.family import Family, FixedModel
from aeroflutter.model.lure import AnyFamily, FixedFamily, as_family
from aeroflutter.orbits.continuation import ContinuationOptions, correct
from aeroflutter.orbits.describing.options import DescribingOptions
from aeroflutter.orbits.describing.scan import candidates
from aeroflutter.orbits.harmonic.balance import AMPLITUDE, FREQUENCY, SPEED, Balance
from aeroflutter.orbits.harmonic.walk import Curve, follow
from aeroflutter.orbits.result import (
    Cycle,
)
from aeroflutter.springs import Spring, simplify

if TYPE_CHECKING:
    from aeroflutter.orbits.harmonic.options import HarmonicOptions

__all__ = ["NEWTON", "JointFamily", "joint_families", "joint_starts"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Index = NDArray[np.intp]

_SIZES = (0.1, 50.0)  # amplitudes of the grid, in units of each spring's own size
_POINTS = {1: 24, 2: 12, 3: 7}  # of the grid in each direction, by the number of coordinates
_FEW = 4  # of more coordinates than that
_LEAP = 2.0  # steps of the grid by which a mode's shape may miss
NEWTON = ContinuationOptions(tolerance=1e-11, max_newton=25)
_STRIDE = 0.1  # of a walk, in ln amplitude
_STATES = 1500
_SPAN = 0.3  # size of ln U and ln k in the arclength
_SAME = 1e-6  # distance below which two cycles are one
_ASIDE = 0.02  # step onto a branch that breaks the symmetry


@dataclass(frozen=True, eq=False)
class JointFamily:
    """A family of sinusoids in several coordinates.

    Attributes
    ----------
    balance
        Its equations.
    curve
        Its states, in order.
    """

    balance: Balance
    curve: Curve

    def contains(self, cycle: Cycle) -> bool:
        """Whether a cycle lies on it."""
        states = self.curve.states
        if not states:
            return False
        try:
            x, _ = correct(self.balance, *self._held(self.balance.pack(cycle)), NEWTON)
        except ConvergenceError:
            return False
        at = np.array([state.x for state in states])
        near = states[int(np.argmin(np.linalg.norm(at - x, axis=1)))]
        normal = near.tangent
        guess = near.x + normal * float(normal @ (x - near.x)) / float(normal @ normal)
        try:
            found, _ = correct(self.balance, guess, normal, NEWTON)
        except ConvergenceError:
            return False
        return bool(np.max(np.abs(found - x)) < _SAME)

    @staticmethod
    def _held(x: Array) -> tuple[Array, Array]:
        return x, np.eye(x.size)[AMPLITUDE]


def joint_families(
    family: AnyFamily,
    springs: Sequence[Spring],
    options: DescribingOptions,
    largest: float = 100.0,
) -> list[JointFamily]:
    """Every family of sinusoids that the grid leads to, by ascending lowest speed.

    Parameters
    ----------
    family, springs
        The loop; one spring an output, simplified.
    options
        Range of speeds.
    largest
        Largest amplitude followed, in units of a spring's own size.

    Raises
    ------
    InputError
        If the family does not depend on speed.
    """
    whole = as_family(family)
    if isinstance(family, FixedFamily | FixedModel):
        raise InputError("family: does not depend on speed, so there is no curve over it")
    flutter = flutter_speed(whole)
    low, high = options.speeds(whole, flutter)
    speeds = np.geomspace(low, high, max(8, options.scan_speeds // 2))
    odd = all(spring.odd for spring in springs)
    found: list[JointFamily] = []
    for guess in _guesses(whole, springs, speeds):
        _enter(found, whole, springs, guess, symmetric=odd, speeds=(low, high), largest=largest)
    if odd:
        for one in found:
            for start in _biased(one):
                _enter(
                    found, whole, springs, start, symmetric=False, speeds=(low, high),
                    largest=largest,
                )  # fmt: skip
    return sorted(found, key=lambda one: min(state.x[SPEED] for state in one.curve.states))


def _enter(
    found: list[JointFamily],
    family: Family,
    springs: Sequence[Spring],
    guess: Cycle,
    *,
    symmetric: bool,
    speeds: tuple[float, float],
    largest: float,
) -> None:
    """Follow the family of a guess, unless it is known or there is none."""
    balance = Balance(family, springs, 1, symmetric, _lead(family, springs, guess))
    try:
        with np.errstate(over="ignore", invalid="ignore"):
            x, _ = correct(balance, balance.pack(guess), np.eye(balance.unknowns)[0], NEWTON)
            cycle = balance.unpack(x)
            if not speeds[0] <= cycle.speed <= speeds[1] or balance.straight(x):
                return
            if not symmetric and _mirrors(cycle) and all(one.odd for one in springs):
                return
            if any(one.contains(cycle) for one in found if one.balance.symmetric == symmetric):
                return
            curve = follow(balance, x, _walking(balance, x, speeds, largest), {}, np.inf)
    except ConvergenceError:
        return
    if len(curve.states) > 1:
        found.append(JointFamily(balance, curve))


def _mirrors(cycle: Cycle) -> bool:
    """Whether the means of all coordinates are round-off."""
    Y = np.abs(cycle.motions)
    return bool(np.all(Y[:, 0] <= 1e-6 * Y[:, 1:].max(axis=1)))


def _walking(
    balance: Balance, x: Array, speeds: tuple[float, float], largest: float
) -> ContinuationOptions:
    n = balance.unknowns
    low, high, scale = np.full(n, -np.inf), np.full(n, np.inf), np.ones(n)
    size = balance.spring.scale
    low[AMPLITUDE] = min(np.log(1e-2 * size), x[AMPLITUDE] - 0.1)
    high[AMPLITUDE] = max(np.log(largest * size), x[AMPLITUDE] + 0.1)
    low[SPEED], high[SPEED] = np.log(speeds)
    scale[SPEED] = scale[FREQUENCY] = _SPAN
    return ContinuationOptions(
        step=0.02, max_step=_STRIDE, tolerance=1e-9, max_states=_STATES, low=low, high=high,
        scale=scale, folds={"fold": SPEED % n}, locate=1e-10,
    )  # fmt: skip


def _biased(one: JointFamily) -> Iterator[Cycle]:
    """Guesses where a symmetric family loses its symmetry: the means' own balance is singular."""
    balance = one.balance
    general = Balance(balance.family, balance.springs, 1, False, balance.lead)
    means = np.flatnonzero(general.orders[general.rest] == 0)

    def singular(x: Array) -> tuple[float, Array]:
        y = general.pack(balance.unpack(x))
        rows = np.flatnonzero(general.orders == 0)
        block = general.jacobian(y)[np.ix_(rows, 1 + means)]
        return float(np.linalg.det(block)), np.linalg.svd(block)[2][-1]

    values = [singular(state.x) for state in one.curve.states]
    for (first, _), (second, vector), state in zip(
        values[:-1], values[1:], one.curve.states[1:], strict=True
    ):
        if first * second < 0:
            y = general.pack(balance.unpack(state.x))
            y[1 + means] += _ASIDE * vector
            yield general.unpack(y)


def _lead(family: Family, springs: Sequence[Spring], cycle: Cycle) -> int:
    from aeroflutter.orbits.harmonic.branch import leading

    return leading(family, springs, cycle)


# --- the grid -------------------------------------------------------------------------------------


def _guesses(family: Family, springs: Sequence[Spring], speeds: Array) -> Iterator[Cycle]:
    """Sinusoids of nearly the amplitudes with which the springs were replaced."""
    balance = Balance(family, springs, 1, True)
    channels = balance.channels
    G = len(channels)
    sizes = np.array([springs[channel.springs[0]].scale for channel in channels])
    grid = np.geomspace(*_SIZES, _POINTS.get(G, _FEW))
    step = float(np.log(grid[1] / grid[0]))
    A, B, C, _ = family.stack(speeds)
    for point in product(range(grid.size), repeat=G):
        amplitudes = grid[list(point)] * sizes
        N = _gains(springs, channels, amplitudes)
        feedback = (B * N) @ C
        roots = np.linalg.eigvals(A - feedback).astype(complex)
        successor = np.append(np.arange(1, speeds.size), -1)
        for i, j, t, k in candidates(roots, successor):
            for row in range(i.size):
                speed = float(speeds[i[row]] ** (1 - t[row]) * speeds[j[row]] ** t[row])
                shape = _shape(family, balance, N, speed, float(k[row]))
                unit = _unit(np.log(np.abs(shape) / amplitudes), np.array(point), grid.size, step)
                if unit is not None:
                    yield _sinusoids(balance, springs, shape / unit, speed, float(k[row]))


def _unit(logs: Array, point: Index, count: int, step: float) -> float | None:
    """Size of a mode whose shape has the amplitudes of a point of the grid; None if it has not.

    Parameters
    ----------
    logs
        ln of the mode's motion over the grid's amplitudes.
    point, count, step
        Place in the grid, its length and spacing. At its ends a spring is all but linear: any
        amplitude beyond will do.
    """
    inside = (point > 0) & (point < count - 1)
    middle = float(np.mean(logs[inside] if np.any(inside) else logs))
    over, room = logs - middle, _LEAP * step
    fits = np.where(point == count - 1, over > -room, np.where(point == 0, over < room, True))
    fits &= ~inside | (np.abs(over) < room)
    return float(np.exp(middle)) if np.all(fits) else None


def _gains(springs: Sequence[Spring], channels: Sequence[object], amplitudes: Array) -> Complex:
    """Describing function of every spring at the amplitude of its coordinate, unbiased, (m,)."""
    N = np.empty(len(springs), dtype=complex)
    for channel, amplitude in zip(channels, amplitudes, strict=True):
        for i in channel.springs:  # type: ignore[attr-defined]
            low, high = springs[i].span()
            bias = 0.0 if springs[i].odd else 0.5 * (low + high)
            N[i] = complex(springs[i].describing(amplitude, bias).N)
    return N if np.any(N.imag) else N.real


def _shape(family: Family, balance: Balance, N: Complex, speed: float, k: float) -> Complex:
    """Motion of every channel in the mode nearest to j k, (G,)."""
    A, B, C, _ = family.stack(speed)
    values, vectors = np.linalg.eig(A - (B * N) @ C)
    mode = vectors[:, int(np.argmin(np.abs(values - 1j * k)))]
    return np.asarray(C[[channel.springs[0] for channel in balance.channels]] @ mode)


def _sinusoids(
    balance: Balance, springs: Sequence[Spring], shape: Complex, speed: float, k: float
) -> Cycle:
    """The cycle of these first harmonics, its means in the middle of each spring."""
    Y = np.zeros((len(springs), 2), dtype=complex)
    for channel, value in zip(balance.channels, shape, strict=True):
        low, high = springs[channel.springs[0]].span()
        odd = all(springs[i].odd for i in channel.springs)
        Y[list(channel.springs)] = 0.0 if odd else 0.5 * (low + high), value
    return Cycle(Y[0], k, speed, outputs=Y)


# --- where the harmonic balance starts ----------------------------------------------------


def joint_starts(
    family: AnyFamily, springs: Sequence[Spring], options: HarmonicOptions
) -> tuple[list[tuple[int, bool, Cycle]], list[str]]:
    """Of each family of sinusoids one cycle that is like the true one: number, symmetry, cycle."""
    simple = [simplify(spring) for spring in springs]
    settings = DescribingOptions(speed_ratio_range=options.speed_ratio_range)
    found = joint_families(family, simple, settings, options.largest)
    starts = []
    for number, one in enumerate(found, 1):
        symmetric = one.balance.symmetric
        if options.symmetric is not None:
            symmetric = options.symmetric and symmetric
        best = min(one.curve.states, key=lambda state: one.balance.truncation(state.x))
        starts.append((number, symmetric, one.balance.unpack(best.x)))
    notes = [] if found else ["no sinusoids balance in the range of speeds"]
    return starts, notes
