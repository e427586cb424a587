"""How much friction, for a gap, is proved to keep a hinge from oscillating at a speed.

The condition of the theory is scale-free: a loop of friction ΔV and gap ΔH is harmless where a
multiplier with Σ|c| < ΔV/ΔH satisfies it. The least Σ|c| is a linear program, solved with
cutting planes as in `search`; what is claimed is the Σ|c| of a multiplier that `checker` accepts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aeroflutter.guarantees.absence.certificate import Certificate, Loop, Piece
from aeroflutter.guarantees.absence.interval import load_checker
from aeroflutter.guarantees.absence.law import model_of
from aeroflutter.guarantees.absence.program import minimum
from aeroflutter.guarantees.absence.search import (
    Multipliers,
    Points,
    Real,
    choices,
    longest_time,
    summits,
    tops,
)
from aeroflutter.model.lure import LureFamily, LureSystem

__all__ = ["Enough", "Friction"]

_REACH = 30.0  # the frequency up to which the condition is sampled
_BEYOND = 1.1  # times Σ|c|/λ, from where λ alone decides
_ASKED = 2e-2  # F <= -that λ
_MORE = 3.0  # times that is asked for where the checker refuses
_TRIES = 5
_ROUNDS = 60
_OPTIMAL = 2e-3  # a price above one by less gains next to nothing
_WORTH_KEEPING = 0.8
_WORST = 120  # violated rows added at a time
_KEPT = 300  # rows kept, the tightest
_RAW = 5  # rounds after which solutions are averaged: corners of the program leap about
_SHARE = 0.5  # of the last solution in the average
_NEGLIGIBLE = 1e-9  # a coefficient of this size is none
_ROOM = 1e-9  # of the ratio: what is claimed lies above Σ|c|


@dataclass(frozen=True, kw_only=True)
class Enough:
    """Friction over gap that is enough at a speed.

    Attributes
    ----------
    speed
        U*.
    ratio
        ΔV/ΔH from which on nothing oscillates, whatever the start and the steady load; zero where
        any friction is enough, infinite where none was found to be.
    certificate
        The proof for a loop of gap 1 and that friction; None where there is none.
    certified
        Whether the checker has accepted it.
    """

    speed: float
    ratio: float
    certificate: Certificate | None
    certified: bool


class Friction:
    """The search at one speed after another, each beginning with what the last one used.

    Parameters
    ----------
    family
        A section at every speed, or one system.
    reach
        Highest frequency looked at, which limits Σ|c|/λ: less is faster and proves less.

    Raises
    ------
    Uncovered
        If the proof does not cover the model.
    """

    def __init__(self, family: LureFamily, reach: float = _REACH) -> None:
        self.family, self.model = family, model_of(family)
        self.checker = load_checker()
        self._sampled = Multipliers(Loop(delta_v=1.0, delta_h=1.0))
        self._sampled.reach = reach
        self._omegas = self._times = np.empty(0)  # of the last speed, by its longest time

    def at(self, speed: float) -> Enough:
        """The least friction over gap for which a proof was found."""
        system = self.family.at(speed)
        if np.linalg.eigvals(system.closed(1.0)).real.max() >= 0.0:
            return _none(speed)
        if self._sampled.passive([system], 0.0):
            harmless = self._claimed(Piece(low=speed, high=speed), 0.0)
            if harmless is not None:
                return harmless
        asked = _ASKED
        for _ in range(_TRIES):
            piece = self._least(system, speed, asked)
            if piece is None:
                return _none(speed)
            total = sum(abs(c) for _, c in piece.terms)
            found = self._claimed(piece, total * (1.0 + _ROOM))
            if found is not None:
                return found
            asked *= _MORE
        return _none(speed)

    def _claimed(self, piece: Piece, ratio: float) -> Enough | None:
        """What the piece proves; None where the checker refuses it."""
        # Where any friction will do the proof is spelt for some: the terms, and so Σ|c|, vanish.
        loop = Loop(delta_v=ratio or 1.0, delta_h=1.0)
        claim = Certificate(model=self.model, spring=loop, pieces=(piece,))
        if self.checker is not None:
            try:
                self.checker.check(claim)
            except self.checker.Refused as refused:
                if refused.omega is not None:
                    self._sampled.look_at(refused.omega)
                return None
        return Enough(
            speed=piece.high,
            ratio=ratio,
            certificate=claim,
            certified=self.checker is not None,
        )

    def _least(self, system: LureSystem, speed: float, asked: float) -> Piece | None:
        """The multiplier of least Σ|c| with F <= -asked λ, as sampled."""
        spring, grid = self._sampled.spring, self._sampled.points([system])
        longest = longest_time([system], spring)
        candidates, times = choices(longest)
        omegas = grid.omega[grid.nearest(self._sampled.seen)]
        if self._times.size:
            times = self._times * longest
            omegas = np.union1d(self._omegas / longest, self._sampled.seen)
        lam, terms = 0.0, dict[float, float]()
        for i in range(_ROUNDS):
            program = _solved(Points([system], spring, omegas), times, asked, self._sampled.reach)
            if program is None:
                return None
            share = 1.0 if i < _RAW else _SHARE
            lam = share * program.lam + (1.0 - share) * lam
            terms = _mixed(program.terms, terms, share)
            peaks, heights = summits(grid.omega, grid.condition(lam, tuple(terms.items())))
            price = program.price(candidates)
            if heights.max() < 0.0 and price.max() < 1.0 + _OPTIMAL:
                self._omegas, self._times = omegas * longest, times / longest
                return Piece(low=speed, high=speed, lam=lam, terms=tuple(sorted(terms.items())))
            worst = np.argsort(-heights)[:_WORST]
            worst = worst[heights[worst] > -0.9 * asked * lam]
            omegas = np.union1d(program.tight, peaks[worst])
            if program.dual.size:  # else no term is needed at these frequencies, and all may be
                worth = program.price(times) > _WORTH_KEEPING
                helpful = candidates[tops(price) & (price > 1.0 + _OPTIMAL)]
                times = np.union1d(times[worth], helpful)
        return None


def _mixed(
    new: tuple[tuple[float, float], ...], old: dict[float, float], share: float
) -> dict[float, float]:
    """Terms of share new + (1 - share) old: what two multipliers satisfy, so does their mean."""
    latest = dict(new)
    both = {
        t: share * latest.get(t, 0.0) + (1.0 - share) * old.get(t, 0.0) for t in {*latest, *old}
    }
    return {t: c for t, c in both.items() if abs(c) > _NEGLIGIBLE}


@dataclass(frozen=True, kw_only=True, eq=False)
class _Program:
    """The solution of the linear program with some rows and columns.

    Attributes
    ----------
    lam, terms
        As in `Piece`.
    tight
        Frequencies whose rows are nearly met with equality.
    active, dual
        Those that are met with equality, and what they are worth.
    cost
        What one unit of |c| costs.
    """

    lam: float
    terms: tuple[tuple[float, float], ...]
    tight: Real
    active: Points
    dual: Real
    cost: float

    def price(self, times: Real) -> Real:
        """What a term at each time would gain, over what it costs; above one it helps."""
        return np.asarray(np.abs(self.dual @ self.active.kernel(slice(None), times)) / self.cost)


def _solved(points: Points, times: Real, asked: float, reach: float) -> _Program | None:
    """min Σ|c| with p + (q + asked) λ + Σ c k <= 0 at the points and Σ|c| <= reach λ."""
    kernel, count = points.kernel(slice(None), times), times.size
    table = np.column_stack((points.q + asked, kernel, -kernel))
    found = minimum(
        np.r_[0.0, np.ones(2 * count)],
        np.vstack((table, np.r_[-reach / _BEYOND, np.ones(2 * count)])),
        np.r_[-points.p, 0.0],
    )
    if found is None:
        return None
    c = found.x[1 : 1 + count] - found.x[1 + count :]
    dual, nearest = found.worth[:-1], np.argsort(found.slack[:-1])
    active = dual > 0.0
    return _Program(
        lam=float(found.x[0]),
        terms=tuple((float(t), float(one)) for t, one in zip(times, c, strict=True) if one),
        tight=points.omega[nearest[:_KEPT]],
        active=points.of(active),
        dual=dual[active],
        cost=1.0 + float(found.worth[-1]),
    )


def _none(speed: float) -> Enough:
    return Enough(speed=speed, ratio=float("inf"), certificate=None, certified=False)
