"""Search of the multiplier that proves absence: a linear program with cutting planes.

Unknown are λ and the c of the terms. At every frequency and speed the condition of the theory,

    w Im H/ω + λ (Re H - 1) + Σ c k(ω, t) <= -m,        w = 1,

is a row, every time t a column; m, the margin, is made as large as it gets. Rows are added where
the solution violates the condition, columns where the dual says that one would help. What is found
here proves nothing: the condition is only sampled. `checker` proves.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from copy import copy
from dataclasses import dataclass, replace
from time import thread_time

import numpy as np
from numpy.typing import NDArray

from aeroflutter.guarantees.absence.certificate import Loop, Static
from aeroflutter.guarantees.absence.program import minimum
from aeroflutter.model.lure import LureSystem

__all__ = ["Found", "Multipliers", "Points", "choices", "longest_time", "summits", "tops"]

Real = NDArray[np.float64]
Index = NDArray[np.intp]

_PERIODS = 2.0  # of the slowest mode: the longest t tried
_TIMES, _FINE_TIMES = 120, 4000
_ROWS = 150
_STEP = 0.09  # step in ω over √ω, times the longest t: F errs alike between all points
_HEADROOM = 1e-7  # Σ|c| stays below ΔV/ΔH by this
_LARGEST = 1e3  # Σ c of a static law, whose multipliers form a cone
_ROUNDS = 40
_KEPT = 3  # rows kept for each one that counts, the tightest; a hundred at least
_MOST = 20.0  # Σ|c| looked for, however large ΔV/ΔH
_RAW, _SHARE = 3, 0.5  # rounds after which solutions are averaged, as corners leap about, and how
_NEGLIGIBLE = 1e-9  # a coefficient of this size is none
_WORST = 120  # violated rows added at a time
_WORTH_KEEPING = 0.8  # price of a column that stays in the program
_FARTHEST = 300.0  # frequency looked at
_FAR = 0.5  # of the margin, asked for at high frequencies: more, and ripples bind everywhere
_GOOD = 0.5  # of the margin of the program, kept between its rows
_EASIER = 0.7  # times that, with every round
_SOUND = 1e8  # condition of the eigenvectors up to which partial fractions serve
_HELPS = 1e-3  # a column whose price is above its cost by this is worth having
_COLUMNS = 150  # columns added at a time, those of the highest prices


@dataclass(frozen=True, kw_only=True)
class Found:
    """A multiplier and the margin it leaves, as sampled.

    Attributes
    ----------
    margin
        The smallest -F over the frequencies and speeds; not positive where none was found.
    bound
        The margin of the last program: what could be hoped for.
    lam, terms
        As in `Piece`.
    """

    margin: float
    bound: float
    lam: float
    terms: tuple[tuple[float, float], ...]

    def towards(self, lam: float, terms: Iterable[tuple[float, float]], share: float) -> Found:
        """A mean with another multiplier: it satisfies what both do."""
        old, new = dict(self.terms), dict(terms)
        mixed = {t: share * new.get(t, 0.0) + (1.0 - share) * old.get(t, 0.0) for t in {*new, *old}}
        kept = sorted((t, c) for t, c in mixed.items() if abs(c) > _NEGLIGIBLE)
        return replace(self, lam=share * lam + (1.0 - share) * self.lam, terms=tuple(kept))


_NONE = Found(margin=-np.inf, bound=np.inf, lam=0.0, terms=())


class Unsolved(Exception):
    """The linear program has no answer in double precision."""


class Multipliers:
    """The search at one speed after another, each beginning with what the last one used.

    Parameters
    ----------
    spring
        The law.

    Attributes
    ----------
    deadline
        Processor time of this thread after which a search takes what it has.
    """

    def __init__(self, spring: Loop | Static) -> None:
        self.spring = spring
        self.deadline = np.inf
        self.times = np.empty(0)
        self.omegas = np.empty(0)
        self.seen = np.empty(0)
        self.reach = 5.0

    def look_at(self, omega: float) -> None:
        """Take the condition at a frequency into account from now on."""
        self.seen = np.r_[self.seen, omega]
        self.omegas = np.r_[self.omegas, omega]

    def best(self, systems: Sequence[LureSystem], good: float = _GOOD) -> Found:
        """The multiplier with the largest margin at all of some speeds at once.

        Parameters
        ----------
        systems
            The section at each speed, all Hurwitz with the stiffest slope.
        good
            What part of the margin of the program, which knows some frequencies only, is enough.
        """
        longest, found = longest_time(systems, self.spring), _NONE
        while True:
            try:
                found = self._at(self.points(systems), longest, good, found)
            except Unsolved:
                return replace(_NONE, bound=-np.inf)
            needed = 1.1 * sum(abs(c) for _, c in found.terms) / max(found.lam, 1e-9)
            if not (found.margin > 0.0 and self.reach < needed < _FARTHEST) or self.late:
                return found
            self.reach = 1.5 * needed

    @property
    def late(self) -> bool:
        """Whether the deadline has passed."""
        return thread_time() > self.deadline

    def _at(self, points: Points, longest: float, good: float, known: Found) -> Found:
        """The best multiplier on a set of points; one of fewer points if it is good on all."""
        candidates, times = choices(longest)
        if isinstance(self.spring, Static):
            candidates, times = (np.r_[-one[::-1], one] for one in (candidates, times))
        rows, times = points.nearest(self.omegas), np.union1d(self.times, times)
        if known.terms:
            F = points.excess(known.lam, known.terms)
            known = replace(known, margin=-float(F.max()))
            if known.margin > good * max(known.bound, 0.0):
                return known
            rows = np.union1d(rows, points.peaks(F, -known.bound))
            times = np.union1d(times, [t for t, _ in known.terms])
        best = mean = _NONE
        for i in range(_ROUNDS):
            program = _Program(self.spring, points, rows, times)
            mean = mean.towards(program.lam, program.terms, 1.0 if i < _RAW else _SHARE)
            F = points.excess(mean.lam, mean.terms)
            mean = replace(mean, margin=-float(F.max()))
            best = max(best, mean, key=lambda one: one.margin)
            more = points.peaks(F, -program.margin + 1e-3 * abs(program.margin))
            price = program.price(candidates)
            helpful = np.flatnonzero(tops(price) & (price > 1.0 + _HELPS))
            columns = candidates[helpful[np.argsort(-price[helpful])[:_COLUMNS]]]
            enough = good * _EASIER**i * max(program.margin, 0.0)
            if best.margin > enough or not (more.size or columns.size):
                break
            if self.late:
                break
            if program.ceiling(price) <= 0.0:
                break  # no choice of times meets the rows there are
            times = times[program.price(times) > _WORTH_KEEPING]
            rows, times = np.union1d(program.tight, more), np.union1d(times, columns)
        self.times = np.array([t for t, _ in program.terms])
        self.omegas = np.union1d(points.omega[program.active], self.seen)
        return replace(best, bound=program.margin)

    def passive(self, systems: Sequence[LureSystem], lam: float) -> bool:
        """Whether the condition holds without terms, as sampled."""
        points = self.points(systems, delays=False)
        return bool((points.p + lam * points.q).max() < 0.0)

    def points(self, systems: Sequence[LureSystem], *, delays: bool = True) -> Points:
        """Frequencies up to where λ alone decides, dense enough for the longest time.

        Without delays what varies is the response alone, around its resonances.
        """
        longest = longest_time(systems, self.spring) if delays else 0.0
        roots = np.concatenate([np.linalg.eigvals(_stiff(one, self.spring)) for one in systems])
        roots = roots[roots.imag > 0.0]
        widths = np.sinh(np.linspace(-6.0, 6.0, 100 if delays else 1000))
        around = roots.imag[:, None] + roots.real[:, None] * widths
        end = max(6.0 * roots.imag.max(initial=0.1), self.reach)
        step = _STEP / longest / 2.0 if delays else end**0.5
        roots_of = np.arange(1, int(end**0.5 / step) + 2) * step
        omega = np.concatenate(
            (
                self.seen,
                roots_of**2,
                np.abs(around.ravel()),
                end * np.geomspace(1e-7, 1.0, 300 if delays else 3000),
                end * np.geomspace(1.0, 1e3, 60),
            )
        )
        return Points(systems, self.spring, np.unique(omega[omega > 0.0]))


class Points:
    """The condition at many frequencies of several systems, one after the other."""

    def __init__(self, systems: Sequence[LureSystem], spring: Loop | Static, omega: Real) -> None:
        low, high = _slopes(spring)
        H = [(high - low) * _response(system, high, omega) for system in systems]
        response = np.concatenate(H)
        self.omega = np.tile(omega, len(systems))
        self.size = omega.size
        self.p, self.q = response.imag / self.omega, response.real - 1.0
        fastest = np.abs(np.linalg.eigvals(_stiff(systems[0], spring)).imag).max()
        self.g = 1.0 / (1.0 + self.omega / (fastest or 1.0))
        self.loop = isinstance(spring, Loop)

    def of(self, chosen: NDArray[np.bool_]) -> Points:
        """Some of them, of one system."""
        part = copy(self)
        part.omega, part.p, part.q = self.omega[chosen], self.p[chosen], self.q[chosen]
        part.size = part.omega.size
        return part

    def kernel(self, at: Index | slice, times: Real) -> Real:
        """Columns k(ω, t) at some of the points, shape (points, times)."""
        K, L = self._sines(self.omega[at][:, None], times)
        if self.loop:
            return -K
        return K * self.p[at][:, None] + L * self.q[at][:, None]

    def _sines(self, omega: Real, times: Real) -> tuple[Real, Real]:
        """sin(ωt)/ω and, of a static law, (1 - cos ωt)/ω²."""
        K = np.sin(omega * times) / omega
        return K, K if self.loop else 2.0 * (np.sin(0.5 * omega * times) / omega) ** 2

    def condition(self, lam: float, terms: Sequence[tuple[float, float]]) -> Real:
        """F at every point."""
        K, L = np.zeros(self.size), np.zeros(self.size)  # the same for every system
        for t, c in terms:
            one, other = self._sines(self.omega[: self.size], np.array(t))
            K += c * one
            L += c * other
        count = self.omega.size // self.size
        if self.loop:
            return self.p + lam * self.q - np.tile(K, count)
        return (1.0 + np.tile(K, count)) * self.p + (lam + np.tile(L, count)) * self.q

    def excess(self, lam: float, terms: Sequence[tuple[float, float]]) -> Real:
        """F over the margin asked for, at every point."""
        return self.condition(lam, terms) / self.g

    def peaks(self, F: Real, above: float) -> Index:
        """Points of the local maxima of F above a level."""
        folded = F.reshape(-1, self.size)
        highest = np.array([tops(one) for one in folded]).ravel()
        found = np.flatnonzero(highest & (above < F))
        return found[np.argsort(-F[found])[:_WORST]]

    def nearest(self, omegas: Real) -> Index:
        """Points to begin with: some of all, and those nearest to given frequencies."""
        count = self.omega.size // self.size
        own = self.omega[: self.size]
        chosen = np.linspace(0, self.size - 1, _ROWS).astype(np.intp)
        chosen = np.union1d(chosen, np.searchsorted(own, omegas[omegas <= own[-1]]))
        return np.concatenate([chosen + k * self.size for k in range(count)])


class _Program:
    """The linear program with some rows and columns, solved."""

    def __init__(self, spring: Loop | Static, points: Points, rows: Index, times: Real) -> None:
        loop = isinstance(spring, Loop)
        kernel = points.kernel(rows, times)
        both = np.hstack((kernel, -kernel)) if loop else kernel
        limit = _LARGEST
        if isinstance(spring, Loop):
            limit = min(_MOST, spring.delta_v / spring.delta_h) * (1.0 - _HEADROOM)
        table = np.column_stack((points.g[rows], points.q[rows], both))
        budget = np.r_[0.0, 0.0 if loop else 1.0, np.ones(both.shape[1])]
        at_infinity = np.r_[_FAR, -1.0, np.zeros(both.shape[1])]
        found = minimum(
            np.r_[-1.0, np.zeros(1 + both.shape[1])],
            np.vstack((table, at_infinity, budget)),
            np.r_[-points.p[rows], 0.0, limit],
            free=1,
        )
        if found is None:
            raise Unsolved
        self.margin, self.lam, c = float(found.x[0]), float(found.x[1]), found.x[2:]
        if loop:
            c = c[: times.size] - c[times.size :]
        self.terms = tuple((float(t), float(one)) for t, one in zip(times, c, strict=True) if one)
        dual = found.worth
        count = max(100, _KEPT * int((dual[:-2] > 0.0).sum()))
        self.tight = rows[np.argsort(found.slack[:-2])[:count]]
        self.active = rows[dual[:-2] > 0.0]
        self._dual = dual[:-2][dual[:-2] > 0.0]
        self._limit, self._cost = limit, max(float(dual[-1]), 1e-300)
        self._points, self._loop = points, loop

    def ceiling(self, price: Real) -> float:
        """Bound, by duality, of the margin that any times can reach on the rows of the program."""
        return self.margin + self._limit * self._cost * max(float(price.max()) - 1.0, 0.0)

    def price(self, times: Real) -> Real:
        """What a term at each time would gain, over what it costs; above one it helps."""
        gain = -self._dual @ self._points.kernel(self.active, times)
        return np.asarray(np.abs(gain) if self._loop else gain) / self._cost


def _response(system: LureSystem, slope: float, omega: Real) -> NDArray[np.complex128]:
    """c (jωI - A + slope b c)^-1 b by partial fractions, or from 1/G where they are no good."""
    poles, vectors = np.linalg.eig(system.closed(slope))
    if not np.linalg.cond(vectors) < _SOUND:
        return np.asarray(1.0 / (system.inverse_transfer(1j * omega) + slope))
    residues = (system.c @ vectors) * np.linalg.solve(vectors, system.b)
    return np.asarray((residues / (1j * omega[:, None] - poles)).sum(axis=1))


def tops(values: Real) -> NDArray[np.bool_]:
    """Which values are local maxima."""
    before, after = np.r_[-np.inf, values[:-1]], np.r_[values[1:], -np.inf]
    return np.asarray((values > before) & (values >= after))


def choices(longest: float) -> tuple[Real, Real]:
    """Times to choose from, and some of them to begin with."""
    candidates = np.linspace(0.0, longest, _FINE_TIMES + 1)[1:]
    return candidates, candidates[:: _FINE_TIMES // _TIMES]


def summits(omega: Real, F: Real) -> tuple[Real, Real]:
    """Local maxima between samples, by parabolas through three of them, and both ends: ω, F."""
    at = np.flatnonzero(tops(F)[1:-1]) + 1
    x, y = omega[at + np.array([[-1], [0], [1]])], F[at + np.array([[-1], [0], [1]])]
    left, right = (y[1] - y[0]) / (x[1] - x[0]), (y[2] - y[1]) / (x[2] - x[1])
    bend = np.minimum((right - left) / (x[2] - x[0]), -1e-300)
    slope = (left * (x[2] - x[1]) + right * (x[1] - x[0])) / (x[2] - x[0])
    move = np.clip(-0.5 * slope / bend, x[0] - x[1], x[2] - x[1])
    most = 0.25 * (y[1] - y.min(axis=0))  # of a parabola; more where points nearly coincide
    rise = np.clip(move * (slope + move * bend), 0.0, most)
    ends = [0, -1]
    return np.r_[omega[ends], x[1] + move], np.r_[F[ends], y[1] + rise]


def _slopes(spring: Loop | Static) -> tuple[float, float]:
    return (0.0, 1.0) if isinstance(spring, Loop) else (spring.low, spring.high)


def _stiff(system: LureSystem, spring: Loop | Static) -> Real:
    return np.asarray(system.closed(_slopes(spring)[1]).real)


def longest_time(systems: Sequence[LureSystem], spring: Loop | Static) -> float:
    """The longest time tried."""
    roots = np.concatenate([np.linalg.eigvals(_stiff(one, spring)) for one in systems])
    swinging = np.abs(roots.imag[np.abs(roots.imag) > 1e-3 * np.abs(roots.real)])
    slowest = swinging.min() if swinging.size else np.abs(roots).min()
    return float(_PERIODS * 2.0 * np.pi / slowest)
