"""Over which speeds nothing can oscillate: pieces of an interval, each with its multiplier."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from time import thread_time
from types import ModuleType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aeroflutter.guarantees.absence.certificate import Certificate, Piece
from aeroflutter.guarantees.absence.law import (
    Uncovered,
    law_of,
    model_of,
    only_bounded,
    slopes_of,
)
from aeroflutter.guarantees.absence.search import Multipliers
from aeroflutter.model.lure import LureFamily
from aeroflutter.springs import Spring

__all__ = ["Absence", "absence", "absence_at", "highest_sampled"]

_SAMPLES = 400  # speeds at which the linear section is looked at
_RESOLVED = 1e-4  # of the highest speed
_BUDGET = 60.0  # seconds of the processor for each half of the search: hard cases take hours
_BACK_OFF = (0.0, 1e-5, 1e-4, 1e-3, 1e-2)  # of a speed that the checker does not grant
_DOWN_TO = (0.0, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1)  # of the first piece's upper end
_STARTS = (0.02, 0.04, 0.08, 0.16, 0.32, 0.5, 0.7)  # of the stable range
_MOST_BOXES = 300_000  # a piece that takes more is made smaller
_TRIES = 5  # cutting planes from the checker
_NARROWEST = 1e-3  # a piece of this relative width is not halved again


@dataclass(frozen=True, kw_only=True, eq=False)
class Absence:
    """Where nothing oscillates.

    Attributes
    ----------
    low, high
        Every speed U > 0 with low ≤ U ≤ high; both NaN where nothing is proved.
    certified
        Whether the checker has proved it; else the condition has only been sampled.
    certificate
        The proof; None where there is none.
    stable_below
        Speed below which the section with the stiffest slope is stable: no proof reaches further.
    boxes
        What the checker had to look at.
    notes
        What a reader should know.
    """

    low: float
    high: float
    certified: bool
    certificate: Certificate | None
    stable_below: float
    boxes: int
    notes: tuple[str, ...]


def absence(
    family: LureFamily, spring: Spring, *, terms: bool = True, seconds: float = _BUDGET
) -> Absence:
    """The longest interval of speeds found for which no motion can go on oscillating.

    Parameters
    ----------
    family
        A section at every speed.
    spring
        A hysteresis loop, or a law without memory whose slopes are bounded.
    terms
        Whether multipliers with terms are looked for as well, in seconds to minutes. The rest is
        exact and takes a fraction of a second; it depends on no size of the spring.
    seconds
        Processor time after which each half of that search takes what it has.

    Returns
    -------
    Absence
        For every start, starting memory and steady load.

    Raises
    ------
    Uncovered
        If the spring or the model is none that the proof covers; the message says which.

    References
    ----------
    docs/theory/absence.md: the theorem, its proof and its relatives.

    Examples
    --------
    >>> from aeroflutter import Hysteresis, SectionFamily, TypicalSection
    >>> free = absence(SectionFamily(TypicalSection(omega_bar=0.8)), Hysteresis(1.0, 0.2))
    >>> free.high > 0.921 * 4.11454
    True
    """
    prover = _Prover(family, spring, seconds)
    stable = prover.stable_below()
    pieces = prover.first(stable)
    if terms:
        low = pieces[-1].high if pieces else prover.start(stable)
        if low is not None:
            pieces += prover.above(low, stable)
    return prover.result(pieces, stable)


def absence_at(
    family: LureFamily, spring: Spring, speed: float, seconds: float = _BUDGET
) -> Absence:
    """Whether no motion can go on oscillating at one speed; as `absence`.

    The search ends after so many seconds of the processor with what it has.
    """
    prover = _Prover(family, spring, seconds)
    stable = bool(prover.growth([speed])[0] < 0.0)
    piece = prover.piece(speed, speed) if stable else None
    return prover.result([] if piece is None else [piece], float("nan"))


def highest_sampled(
    family: LureFamily, spring: Spring, resolved: float = 1e-3, seconds: float = _BUDGET
) -> float:
    """The highest speed at which the search finds a multiplier: about where a proof would end.

    Parameters
    ----------
    family, spring
        As for `absence`.
    resolved
        How closely the speed is located, of the stable range.
    seconds
        Processor time after which the search takes what it has.

    Returns
    -------
    float
        U*; zero where nothing is found. It is sampled and proves nothing.

    Raises
    ------
    Uncovered
        As `absence`.
    """
    prover = _Prover(family, spring, seconds)
    stable = prover.stable_below()
    pieces = prover.first(stable)
    low = pieces[-1].high if pieces else prover.start(stable)
    return 0.0 if low is None else prover.top(low, stable, resolved)


def load_checker() -> ModuleType | None:
    """The checker; None where python-flint is missing."""
    try:
        from aeroflutter.guarantees.absence import checker
    except ImportError:
        return None
    return checker


class _Prover:
    """The search and the checker, working on one case."""

    def __init__(self, family: LureFamily, spring: Spring, seconds: float = _BUDGET) -> None:
        self.seconds = seconds
        self.family, self.spring = family, spring
        self.law, self.model = law_of(spring), model_of(family)
        self.multipliers = Multipliers(self.law)
        self.multipliers.deadline = thread_time() + seconds
        self.boxes = 0
        self.given_up = np.nan  # speed below which a search that took too long might have got
        self.checker = load_checker()

    def result(self, pieces: Sequence[Piece], stable: float) -> Absence:
        notes = []
        if self.checker is None:
            notes.append(
                "not certified: that takes python-flint (pip install aeroflutter[certify])"
            )
        if np.isfinite(self.given_up):
            notes.append(
                f"the search ended after {self.seconds:.0f} s of the processor: a proof may exist "
                f"up to the speed {self.given_up:.6g}"
            )
        if only_bounded(self.spring):
            notes.append("said of motions that stay bounded: the spring is softer far out")
        certificate = None
        if pieces:
            certificate = Certificate(model=self.model, spring=self.law, pieces=tuple(pieces))
        low, high = certificate.speeds if certificate else (float("nan"), float("nan"))
        return Absence(
            low=low,
            high=high,
            certified=bool(pieces) and self.checker is not None,
            certificate=certificate,
            stable_below=stable,
            boxes=self.boxes,
            notes=tuple(notes),
        )

    def refused(self, piece: Piece) -> Exception | None:
        """Why the checker refuses a piece; None where it does not, or is not there."""
        if self.checker is None:
            return None
        try:
            claim = Certificate(model=self.model, spring=self.law, pieces=(piece,))
            self.boxes += self.checker.check(claim, _MOST_BOXES).boxes
        except self.checker.Refused as refused:
            return refused
        return None

    def growth(self, speeds: ArrayLike) -> NDArray[np.float64]:
        """Largest real part of the roots with the stiffest slope, at every speed."""
        A, b = self.family.stack(np.asarray(speeds))
        closed = A - slopes_of(self.law)[1] * b[..., :, None] * self.family.c
        return np.asarray(np.linalg.eigvals(closed).real.max(axis=-1))

    def stable_below(self) -> float:
        """The lowest speed at which the section with the stiffest slope is not damped."""
        growth, (low, high) = self.growth, self.family.search_range
        if not low > 0.0:
            raise Uncovered("the model has no range of speeds; `absence_at` is for one")
        speeds = np.geomspace(low, high, _SAMPLES)
        grows = growth(speeds) >= 0.0
        if not grows.any():
            return float(speeds[-1])
        first = int(grows.argmax())
        if first == 0:
            return 0.0
        low, high = speeds[first - 1], speeds[first]
        while high - low > 1e-9 * high:
            middle = 0.5 * (low + high)
            low, high = (low, middle) if growth([middle])[0] >= 0.0 else (middle, high)
        return float(low)

    def first(self, stable: float) -> list[Piece]:
        """The piece without terms: the loop only ever takes energy out."""
        p, q = slopes_of(self.law)
        lam = 0.0 if p < q else 1.0
        low, high = 0.0, stable
        if stable <= 0.0:
            return []
        for _ in range(40):
            middle = 0.5 * (low + high)
            passive = self.multipliers.passive([self.family.at(middle)], lam)
            low, high = (middle, high) if passive else (low, middle)
        if p == q:
            low = stable
        for back in _BACK_OFF:
            for share in _DOWN_TO:
                piece = Piece(low=share * low, high=(1.0 - back) * low, lam=lam)
                if self.refused(piece) is None:
                    return [piece]
        return []

    def start(self, stable: float) -> float | None:
        """A low speed that is proved with terms, where none is without; None where none is."""
        speeds = (share * stable for share in _STARTS)
        return next((one for one in speeds if one > 0.0 and self.piece(one, one)), None)

    def above(self, low: float, stable: float) -> list[Piece]:
        """Pieces from a speed that is proved to the highest that can be."""
        top = self.top(low, stable)
        for back in (0.5, 1.0, 2.0, 5.0, 20.0):
            high = top * (1.0 - back * _RESOLVED)
            if high <= low:
                break
            pieces = self._between(low, high)
            if pieces and pieces[-1].high == high:
                return pieces
        return []

    def top(self, low: float, high: float, resolved: float = _RESOLVED) -> float:
        """The highest speed at which the program finds a multiplier, by false position."""

        def margin(speed: float) -> float:
            found = self.multipliers.best([self.family.at(speed)], good=0.0)
            return found.bound if found.margin > 0.0 else min(found.bound, -1e-300)

        high *= 1.0 - _RESOLVED  # closer to flutter the program is badly scaled
        ends = [low, high]
        first = margin(low)
        values = [first, -abs(first)]  # close to flutter the program is hard, so it is not asked
        step = 0
        self.multipliers.deadline = thread_time() + self.seconds
        while ends[1] - ends[0] > resolved * high:
            if self.multipliers.late:
                self.given_up = ends[1]
                break
            share = 0.5 if step % 3 == 2 else values[0] / (values[0] - values[1])
            middle = ends[0] + min(max(share, 0.05), 0.95) * (ends[1] - ends[0])
            value = margin(middle)
            side = int(value <= 0.0)
            ends[side], values[side] = middle, value
            step += 1
        self.multipliers.deadline = thread_time() + self.seconds
        return ends[0]

    def _between(self, low: float, high: float) -> list[Piece]:
        """Pieces that cover an interval of speeds, or as much of its lower part as can be."""
        piece = self.piece(low, high)
        if piece is not None:
            return [piece]
        if high < low * (1.0 + _NARROWEST):
            return []
        middle = float(np.sqrt(low * high))
        upper = self._between(middle, high)
        if not upper or upper[-1].high != high:
            return []
        return self._between(low, middle) + upper

    def piece(self, low: float, high: float) -> Piece | None:
        """One multiplier for an interval of speeds, or for one speed."""
        speeds = sorted({low, 0.5 * (low + high), high})
        systems = [self.family.at(speed) for speed in speeds]
        for _ in range(_TRIES):
            found = self.multipliers.best(systems)
            if not found.margin > 0.0:
                return None
            piece = Piece(low=low, high=high, lam=found.lam, terms=found.terms)
            refused = self.refused(piece)
            if refused is None:
                return piece
            omega = getattr(refused, "omega", None)
            if omega is None:
                return None
            self.multipliers.look_at(omega)
        return None
