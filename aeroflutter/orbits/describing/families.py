"""Families of cycles: every curve on which the scanned cycles lie, followed to its ends."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aeroflutter.errors import ConvergenceError
from aeroflutter.orbits.continuation import Branch, ContinuationOptions, Event, State, Test, trace
from aeroflutter.orbits.describing.balance import (
    AMPLITUDE,
    BIAS,
    FREQUENCY,
    LEAST,
    LIMIT,
    SPEED,
    Balance,
)
from aeroflutter.orbits.describing.scan import distinct, scan

__all__ = ["Domain", "Family", "find_families"]

Array = NDArray[np.float64]

_SCALE = np.array([1.0, 1.0, 0.3, 1.0])  # the speed varies less than the other unknowns
_WIDEST = 50.0  # bias in scales, beyond which a family is not followed
_UPRIGHT = 10.0  # times as fast as amplitude and speed: so a bias grows at a pitchfork
_NARROW, _WIDE = -12.0, 12.0  # ln of the frequency over the seed's, likewise
_SAME = 1e-6
_ROUNDS = 4
_LOOKS = 8  # places at which a curve is compared with others
_NAMES = ("amplitude", "bias", "speed", "k")


@dataclass(frozen=True, eq=False)
class Domain:
    """Amplitudes (radians) and a grid of speeds U*, in which to look."""

    amplitudes: tuple[float, float]
    speeds: Array


@dataclass(frozen=True, eq=False)
class Family:
    """One curve of cycles and the equations that it solves.

    Attributes
    ----------
    balance
        Its equations, with or without bias.
    branch
        Its curve in the unknowns (ln A, B/scale, ln U, ln k), with events named "fold" (of the
        speed), "turn" (of the amplitude) and "corner" (kink of the describing function).
    """

    balance: Balance
    branch: Branch

    def nodes(self) -> tuple[Array, Array, Array]:
        """Arclength (m,), points and tangents (m, 4) of states and events, in order."""
        places: list[State | Event] = [*self.branch.states, *self.branch.events]
        arclength = np.array([place.arclength for place in places])
        order = np.argsort(arclength, kind="stable")
        order = order[np.concatenate(([True], np.diff(arclength[order]) > 1e-12))]
        x = np.array([place.x for place in places])
        tangent = np.array([place.tangent for place in places])
        return arclength[order], x[order], tangent[order]

    def lowest(self) -> float:
        """ln of the lowest speed."""
        return float(self.nodes()[1][:, SPEED].min())

    def ends(self) -> tuple[str, str]:
        """Why the curve ends, in words."""
        x = self.branch.x
        return (
            _in_words(self.balance, self.branch.stops[0], x[0]),
            _in_words(self.balance, self.branch.stops[1], x[-1]),
        )

    def guess(self, arclength: Array) -> tuple[Array, Array]:
        """Points and directions (m, 4) at arclengths, by cubic interpolation of the nodes."""
        at, x, tangent = self.nodes()
        i = np.clip(np.searchsorted(at, arclength, side="right") - 1, 0, len(at) - 2)
        length = (at[i + 1] - at[i])[:, None]
        t = (arclength - at[i])[:, None] / length
        chord = x[i + 1] - x[i]
        bulge = (1 - t) * (length * tangent[i] - chord) + t * (chord - length * tangent[i + 1])
        return (1 - t) * x[i] + t * x[i + 1] + t * (1 - t) * bulge, chord / length

    def points(self, arclength: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Cycles near arclengths (m, 4), and which of them converged."""
        guess, direction = self.guess(arclength)
        return self.balance.solve(guess, direction / _SCALE**2)

    def stations(self, count: int) -> tuple[Array, Array]:
        """Arclengths (m,) and cycles (m, 4): `count` evenly spaced ones, all events, both ends."""
        at, x, _ = self.nodes()
        inner = np.searchsorted(at, self._event_places())
        marked = np.unique([0, *np.minimum(inner, len(at) - 1), len(at) - 1])
        even = np.linspace(at[0], at[-1], count + 2)[1:-1]
        y, converged = self.points(even)
        arclength = np.concatenate((even[converged], at[marked]))
        order = np.unique(arclength, return_index=True)[1]
        return arclength[order], np.concatenate((y[converged], x[marked]))[order]

    def _event_places(self) -> list[float]:
        first, last = self.branch.states[0].arclength, self.branch.states[-1].arclength
        return [e.arclength for e in self.branch.events if first < e.arclength < last]

    def located(self, log_amplitudes: Array) -> tuple[Array, Array]:
        """Every member at the given ln A, (cycles, 4), and about where it is (cycles,)."""
        at, x, _ = self.nodes()
        a = x[:, AMPLITUDE]
        wanted = np.asarray(log_amplitudes)[None, :]
        i, j = np.nonzero((a[:-1, None] - wanted) * (a[1:, None] - wanted) <= 0)
        rise = a[i + 1] - a[i]
        t = np.where(rise == 0, 0.5, (wanted[0, j] - a[i]) / np.where(rise == 0, 1.0, rise))
        place = at[i] + t * (at[i + 1] - at[i])
        guess, _ = self.guess(place)
        guess[:, AMPLITUDE] = wanted[0, j]
        found, converged = self.balance.solve(guess, np.eye(4)[AMPLITUDE])
        left = np.flatnonzero(~converged)
        if left.size:  # beside a corner the cubic bulges, and the chord does not
            chord = (1 - t[left, None]) * x[i[left]] + t[left, None] * x[i[left] + 1]
            chord[:, AMPLITUDE] = wanted[0, j[left]]
            guess[left] = chord
            found[left], converged[left] = self.balance.solve(chord, np.eye(4)[AMPLITUDE])
        near = np.max(np.abs(found - guess) / _SCALE, axis=1, initial=0.0) < 0.3
        keep = distinct(found, converged & near)
        return found[keep], place[keep]

    def contains(self, y: Array) -> NDArray[np.bool_]:
        """Which cycles (m, 4) are members."""
        members = self.located(np.unique(y[:, AMPLITUDE]))[0]
        if len(members) == 0:
            return np.zeros(len(y), dtype=bool)
        apart = np.max(np.abs(y[:, None] - members[None]), axis=2)
        return np.asarray(np.min(apart, axis=1) < _SAME)


def find_families(
    balance: Balance, domain: Domain, count: int, extra: Array | None = None
) -> tuple[list[Family], list[str]]:
    """Every family of cycles in a domain.

    Cycles are scanned at `count` amplitudes, and at the `extra` ones, and every family through
    one of them is followed. Then they are scanned at amplitudes in between, until nothing new
    turns up.

    Returns
    -------
    families, lost
        The families, and one line for each cycle whose family could not be followed.
    """
    families: list[Family] = []
    lost: list[str] = []
    for k in range(_ROUNDS):
        shift = (0.5, 0.0, 0.25, 0.75)[k]
        amplitudes = spread(balance, domain, max(2, count // (1 if k == 0 else 2)), shift)
        if k == 0 and extra is not None:
            amplitudes = np.union1d(amplitudes, extra)
        new = _follow_all(balance, domain, scan(balance, amplitudes, domain.speeds), families)
        lost += new[1]
        families += new[0]
        if k > 0 and not new[0]:
            break
    kept = list(families)
    for family in families:
        others = [other for other in kept if other is not family]
        if others and _known(family, others):
            kept = others
    return kept, lost


def spread(balance: Balance, domain: Domain, count: int, shift: float) -> Array:
    """Amplitudes inside the domain, spread by how much the describing function changes."""
    low, high = domain.amplitudes
    fine = np.geomspace(low, high, 400)
    N = balance.spring.describing(fine, np.mean(balance.spring.span())).N
    change = np.abs(np.diff(N))
    size = max(float(change.sum()), 1e-300)
    weight = np.cumsum(np.concatenate(([0.0], change / size + 1.0 / change.size)))
    quantiles = (np.arange(count) + 0.5 + 0.49 * (2 * shift - 1)) / count * weight[-1]
    return np.exp(np.interp(quantiles, weight, np.log(fine)))


def _follow_all(
    balance: Balance, domain: Domain, seeds: Array, known: list[Family]
) -> tuple[list[Family], list[str]]:
    """Families through the seeds that no known family contains."""
    found: list[Family] = []
    lost: list[str] = []
    left = seeds
    for family in known:
        left = left[~family.contains(left)] if len(left) else left
    while len(left):
        seed, left = left[0], left[1:]
        try:
            family = _follow(balance, domain, seed)
        except ConvergenceError as error:
            A, B, U, k = balance.unpack(seed)
            lost.append(f"amplitude {A:.6g}, bias {B:.6g}, speed {U:.6g}, k {k:.6g}: {error}")
            continue
        found.append(family)
        left = left[~family.contains(left)] if len(left) else left
    return found, lost


def _known(family: Family, others: list[Family]) -> bool:
    """Whether all of a curve is of others, which a walk found again beside a corner."""
    x = family.nodes()[1]
    some = x[:: max(1, len(x) // _LOOKS)]
    member = np.zeros(len(some), dtype=bool)
    for other in others:
        member |= other.contains(some)
    return bool(np.all(member))


def _follow(balance: Balance, domain: Domain, seed: Array) -> Family:
    (low_A, high_A), speeds = domain.amplitudes, domain.speeds
    low = [np.log(low_A), -_WIDEST, np.log(speeds[0]), seed[FREQUENCY] + _NARROW]
    high = [np.log(high_A), _WIDEST, np.log(speeds[-1]), seed[FREQUENCY] + _WIDE]
    if balance.divided:
        low[BIAS] = LEAST  # the other half is the mirror image
    options = ContinuationOptions(
        step=0.05,
        max_step=0.4,
        max_turn=0.4,
        farthest=0.8,
        tolerance=1e-7,
        locate=1e-9,
        low=low,
        high=high,
        scale=_SCALE,
        folds={"fold": SPEED, "turn": AMPLITUDE},
    )
    kinks = {f"corner {i + 1}": _corner(balance, i) for i in _corners(balance)}
    return Family(balance, _polished(balance, trace(_Curve(balance), seed, options, None, kinks)))


def _polished(balance: Balance, branch: Branch) -> Branch:
    """The branch with its ends and events solved for once more, at their own amplitude or speed,
    or at their bias where that alone changes.

    Across a kink the walk's Newton iteration has the slope of one side only and stops early;
    at fixed amplitude the kink does not matter.
    """
    places: list[State | Event] = [branch.states[0], branch.states[-1], *branch.events]
    x = np.array([place.x for place in places])
    tangent = np.array([place.tangent for place in places]) / _SCALE
    size = np.abs(tangent)
    axis = np.where(size[:, AMPLITUDE] >= size[:, SPEED], AMPLITUDE, SPEED)
    axis[size[:, BIAS] > _UPRIGHT * np.max(size[:, [AMPLITUDE, SPEED]], axis=1)] = BIAS
    better, converged = balance.solve(x, np.eye(4)[axis])
    kept = np.where(converged[:, None], better, x)
    first, last, *events = (replace(p, x=y) for p, y in zip(places, kept, strict=True))
    states = (first, *branch.states[1:-1], last)
    return replace(branch, states=states, events=tuple(events))  # type: ignore[arg-type]


def _corners(balance: Balance) -> list[int]:
    """Indices of the corners, each once: without bias some coincide."""
    corners = balance.spring.corners()
    if balance.biased:
        return list(range(len(corners)))
    _, first = np.unique(corners, return_index=True)
    return [int(i) for i in first]


def _in_words(balance: Balance, stop: str, y: Array) -> str:
    if balance.divided and stop.startswith(f"unknown {BIAS} ") and y[BIAS] < _WIDEST:
        return "the bias dies out, where the family meets one of symmetric cycles"
    values = dict(zip(_NAMES, balance.unpack(y), strict=True))
    for i, (name, value) in enumerate(values.items()):
        if stop.startswith(f"unknown {i} "):
            return f"{name} {float(value):.6g} is the end of its range"
    return stop


class _Curve:
    """The balance of a single cycle, for the continuation."""

    def __init__(self, balance: Balance) -> None:
        self.balance = balance
        self._y, self._values = b"", (np.empty(3), np.empty((3, 4)))

    def residual(self, y: Array) -> Array:
        return self._evaluate(y)[0]

    def jacobian(self, y: Array) -> Array:
        return self._evaluate(y)[1]

    def _evaluate(self, y: Array) -> tuple[Array, Array]:
        if y.tobytes() != self._y:
            if not np.max(np.abs(y)) < LIMIT:
                raise ConvergenceError("the unknowns grew out of range")
            try:
                residual, jacobian = self.balance.evaluate(y[None, :])
            except np.linalg.LinAlgError:
                raise ConvergenceError("the loop has no transfer function here") from None
            self._y, self._values = y.tobytes(), (residual[0], jacobian[0])
        return self._values


def _corner(balance: Balance, index: int) -> Test:
    """Test function of one kink of the describing function."""

    def above(x: Array, _: Array) -> float:
        A, B = balance.unpack(x)[:2]
        return float(A - balance.spring.corners(B)[index]) / balance.spring.scale

    return above
