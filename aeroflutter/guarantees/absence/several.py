"""Whether nothing can oscillate with several springs at one speed: a search, and a checker of two.

For every spring a weight w, a λ and terms, such that at every frequency the Hermitian part of

    diag(w/jω + λ + Σ z (1 - e^(jωt) + jωt)/ω²)(H - I) - diag(Σ c sin(ωt)/ω)

is negative; z ≥ 0 belong to springs without memory, c to loops (docs/theory/absence.md). A
Hermitian matrix is negative where ζ* M ζ is for every ζ, and that is linear in the unknowns: a
linear program whose rows are frequencies with directions, the worst of which are added. What is
found is sampled; of two springs `joint_checker` proves it, of more nothing is certified.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aeroflutter.guarantees.absence.certificate import Joint, Loop, Static
from aeroflutter.guarantees.absence.law import law_of, slopes_of
from aeroflutter.guarantees.absence.search import tops
from aeroflutter.model.lure import AnyFamily, as_family
from aeroflutter.model.system import System
from aeroflutter.springs import Spring

__all__ = ["Several", "several_at", "several_highest"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Terms = dict[float, float]

_REACH = 20.0  # highest frequency that may matter, over the fastest root where that is faster
_BEYOND = 1.1
_ASKED = 2e-2  # ζ* M ζ <= -that Σ λ |ζ|²
_PERIODS, _TIMES, _BEGUN = 2.0, 1200, 60  # of the slowest root; times, and how many to begin with
_STEP = 0.09  # step in ω over √ω, times the longest time
_FIRST = 120  # frequencies to begin with
_ROUNDS, _RAW, _SHARE = 60, 5, 0.5
_KEPT, _WORST = 400, 60
_OPTIMAL = 2e-3
_FREE = 1e-6  # cost of what costs no friction, so that the program has one answer
_MISSED = 1e4  # cost of a row that is missed: there may be no answer with the first few times
_NEGLIGIBLE = 1e-9
_LEAST = 1e-2  # λ of a spring without memory, over what it may be at most
_TRIES = 4  # of the search, looking where the checker refuses
_CHECKED = 2  # springs of which there is a checker
_RESOLVED = 1.01e-2  # of the highest speed
_SHARES = (0.99, 0.98, 0.96, 0.92, 0.85, 0.7, 0.5, 0.3, 0.1)  # of that, asked about in this order
_SMALL = 1e-3


@dataclass(frozen=True, kw_only=True)
class Several:
    """What a search found at one speed.

    Attributes
    ----------
    needed
        Largest share of the friction of a loop that the multiplier uses; nothing oscillates where
        it is below one. Zero without loops; infinite where no multiplier was found.
    w, lam
        Weights and λ of the springs, (m,).
    terms
        Pairs (t, c or z) of each.
    certificate
        The claim; None where there is none, or more than two springs.
    certified
        Whether the checker has accepted it; else it has only been sampled.
    """

    needed: float
    w: tuple[float, ...] = ()
    lam: tuple[float, ...] = ()
    terms: tuple[tuple[tuple[float, float], ...], ...] = ()
    certificate: Joint | None = None
    certified: bool = False

    @property
    def holds(self) -> bool:
        """Whether nothing oscillates, as far as samples go."""
        return self.needed < 1.0


def several_at(system: System, springs: Sequence[Spring]) -> Several:
    """Whether no motion of a system with several springs can go on oscillating.

    Parameters
    ----------
    system
        The system at one speed, one output a spring.
    springs
        Loops with friction, and laws without memory whose slopes are bounded.

    Returns
    -------
    Several
        For every start, starting memory and steady load, of motions that stay bounded.

    Raises
    ------
    Uncovered
        If the slopes of a spring have no bound.

    Examples
    --------
    >>> from aeroflutter import Bilinear, Hysteresis, TypicalSection
    >>> from aeroflutter.model.family import SectionModel
    >>> section = SectionModel(TypicalSection(omega_bar=0.8), springs=("pitch", "heave"))
    >>> half = Bilinear(0.0, 0.5, -0.05, 0.1)  # half the slope inside a gap
    >>> several_at(section.at(3.0), [Hysteresis(1.0, 0.2), half]).certified
    True
    """
    laws = [law_of(one) for one in springs]
    problem = _Problem(system, laws)
    if problem.growth >= 0.0 or problem.weights is None:
        return Several(needed=float("inf"))
    for _ in range(_TRIES):
        found = problem.solved()
        if not found.holds or len(laws) != _CHECKED:
            return found
        claim = _claim(system, laws, found)
        certified, omega = _judged(claim)
        if certified or omega is None:
            return replace(found, certificate=claim, certified=certified)
        problem.look_at(omega)
    return replace(found, needed=float("inf"))


def several_highest(
    family: AnyFamily, springs: Sequence[Spring], top: float
) -> tuple[float, Several] | None:
    """The highest speed below `top` at which nothing is found to oscillate, to a hundredth of it.

    Each speed is asked about by itself: of those below it nothing is said.
    """
    family, best, high = as_family(family), None, top
    for share in _SHARES:
        low = share * top
        found = several_at(family.at(low), springs)
        if found.holds:
            best = low, found
            break
        high = low
    while best is not None and high - best[0] > _RESOLVED * top:
        middle = 0.5 * (best[0] + high)
        found = several_at(family.at(middle), springs)
        best, high = ((middle, found), high) if found.holds else (best, middle)
    return best


def _claim(system: System, laws: Sequence[Loop | Static], found: Several) -> Joint:
    A, B, C = (tuple(map(tuple, M.tolist())) for M in (system.A, system.B, system.C))
    return Joint(A=A, B=B, C=C, springs=tuple(laws), w=found.w, lam=found.lam, terms=found.terms)


def _judged(claim: Joint) -> tuple[bool, float | None]:
    """Whether the checker accepts a claim, and where else the search should look."""
    try:
        from aeroflutter.guarantees.absence.checker import Refused
        from aeroflutter.guarantees.absence.joint_checker import check_joint
    except ImportError:
        return False, None
    try:
        check_joint(claim)
    except Refused as refused:
        return False, refused.omega if refused.omega is not None else np.nan
    return True, None


class _Problem:
    """The condition at many frequencies."""

    def __init__(self, system: System, laws: Sequence[Loop | Static]) -> None:
        self.m = len(laws)
        p, q = np.array([slopes_of(law) for law in laws]).T
        closed = np.asarray(system.closed(q).real)
        self.roots = np.linalg.eigvals(closed)
        self.growth = float(self.roots.real.max())
        swinging = self.roots.imag[self.roots.imag > 1e-3 * np.abs(self.roots.real)]
        ends = swinging if swinging.size else np.abs(self.roots)
        longest = float(_PERIODS * 2.0 * np.pi / ends.min())
        self.reach = max(_REACH, 6.0 * float(ends.max()))
        self.times = np.linspace(0.0, longest, _TIMES + 1)[1:]
        B = system.B * (q - p)
        self.closed, self.B, self.C = closed, B, system.C
        self._see(self._frequencies(longest, swinging))
        cross = np.abs(self.X * (1.0 - np.eye(self.m))).max(axis=(0, 2))
        # Along ω → ∞ only λ keeps the form negative: some of it, small against what it may cost.
        self.least = _LEAST / float(ends.max()) / (1.0 + cross**2)
        self.loops = [i for i, law in enumerate(laws) if isinstance(law, Loop)]
        self.static = [i for i in range(self.m) if i not in self.loops]
        # δ/D of every loop: what a unit of its c takes of its friction
        self.cost = np.array([law.delta_h / law.delta_v for law in laws if isinstance(law, Loop)])
        self.weights = _balanced(-system.C @ np.linalg.solve(closed, B), self.loops)

    def _see(self, omega: Real) -> None:
        """The response at these frequencies."""
        self.omega = omega
        resolvent = 1j * omega[:, None, None] * np.eye(len(self.closed)) - self.closed
        H = self.C @ np.linalg.solve(resolvent, self.B.astype(complex))
        self.X: Complex = np.asarray(H - np.eye(self.m), dtype=np.complex128)

    def look_at(self, omega: float) -> None:
        """Take more frequencies into account: around one, or everywhere where it is NaN."""
        near = omega + (self.omega[1] - self.omega[0]) * np.linspace(-1.0, 1.0, 9)
        between = 0.5 * (self.omega[1:] + self.omega[:-1]) if np.isnan(omega) else near
        self._see(np.unique(np.r_[self.omega, between[between > 0.0]]))

    def _frequencies(self, longest: float, swinging: Real) -> Real:
        steps = np.arange(1, int(2.0 * longest * self.reach**0.5 / _STEP) + 2)
        around = np.sinh(np.linspace(-6.0, 6.0, 200))
        near = [np.abs(r.imag + r.real * around) for r in self.roots if r.imag in swinging]
        even = (steps * (0.5 * _STEP / longest)) ** 2
        omega = np.concatenate([even, np.geomspace(1e-5, 100.0, 500) * self.reach, *near])
        return np.unique(omega[omega > 1e-6])

    def solved(self) -> Several:
        """The least share of friction, by cutting planes."""
        rows = np.repeat(np.linspace(0, self.omega.size - 1, _FIRST).astype(np.intp), self.m + 1)
        mixed = np.exp(1j * np.arange(self.m)) / np.sqrt(self.m)
        zeta = np.tile(np.vstack((np.eye(self.m), mixed)), (_FIRST, 1))
        begun = self.times[:: _TIMES // _BEGUN]
        times = [begun if i in self.loops else np.r_[-begun[::-1], begun] for i in range(self.m)]
        mean = None
        for i in range(_ROUNDS):
            program = _Program(self, rows, zeta, times)
            if program.x is None:
                break
            mean = program.found() if i < _RAW or mean is None else mean.towards(program.found())
            values, vectors = np.linalg.eigh(self.matrices(mean))
            top = values[:, -1]
            prices = [program.price(j) for j in range(self.m)]
            if top.max() < 0.0 and all(price.max() < 1.0 + _OPTIMAL for price in prices):
                return self._result(mean)
            worst = np.flatnonzero(tops(top) & (top > -_SMALL * _ASKED))
            worst = worst[np.argsort(-top[worst])[:_WORST]]
            kept = program.tight
            rows, zeta = np.r_[rows[kept], worst], np.vstack((zeta[kept], vectors[worst, :, -1]))
            helpful = [tops(price) & (price > 1.0 + _OPTIMAL) for price in prices]
            if program.missed > 0.0 and not any(one.any() for one in helpful):
                break  # no choice of times meets the rows there are
            times = [
                np.union1d(old, self.choices(j)[one])
                for j, (old, one) in enumerate(zip(times, helpful, strict=True))
            ]
        return Several(needed=float("inf"))

    def choices(self, i: int) -> Real:
        """Times that a spring may use."""
        return self.times if i in self.loops else np.r_[-self.times[::-1], self.times]

    def kernel(self, i: int, rows: NDArray[np.intp], zeta: Complex, times: Real) -> Real:
        """What a term of each time of a spring adds to ζ* M ζ, (rows, times)."""
        omega = self.omega[rows][:, None]
        if i in self.loops:
            return -(np.abs(zeta[:, i : i + 1]) ** 2) * np.sin(omega * times) / omega
        along = np.conj(zeta[:, i]) * np.einsum("kj,kj->k", self.X[rows, i], zeta)
        return np.asarray((along[:, None] * _delayed(omega * times)).real / omega**2)

    def matrices(self, mean: _Mean) -> Complex:
        """The Hermitian part at every frequency, (k, m, m)."""
        assert self.weights is not None
        D: Complex = np.asarray(self.weights / (1j * self.omega[:, None]) + mean.lam)
        for i in self.static:
            for t, z in mean.terms[i].items():
                D[:, i] += z * _delayed(self.omega * t) / self.omega**2
        M = D[:, :, None] * self.X
        M = 0.5 * (M + np.conj(np.swapaxes(M, 1, 2)))
        for i in self.loops:
            for t, c in mean.terms[i].items():
                M[:, i, i] -= c * np.sin(self.omega * t) / self.omega
        return np.asarray(M)

    def _result(self, mean: _Mean) -> Several:
        assert self.weights is not None
        shares = [
            cost * sum(map(abs, mean.terms[i].values())) / self.weights[i]
            for i, cost in zip(self.loops, self.cost, strict=True)
        ]
        return Several(
            needed=float(max(shares, default=0.0)),
            w=tuple(map(float, self.weights)),
            lam=tuple(map(float, mean.lam)),
            terms=tuple(tuple(sorted(one.items())) for one in mean.terms),
        )


@dataclass(frozen=True)
class _Mean:
    """A multiplier: λ of each spring and its terms."""

    lam: Real
    terms: list[Terms]

    def towards(self, other: _Mean) -> _Mean:
        """The mean with another one: it satisfies what both do."""
        mixed = [
            {t: _SHARE * new.get(t, 0.0) + (1.0 - _SHARE) * old.get(t, 0.0) for t in {*new, *old}}
            for new, old in zip(other.terms, self.terms, strict=True)
        ]
        kept = [{t: c for t, c in one.items() if abs(c) > _NEGLIGIBLE} for one in mixed]
        return _Mean(_SHARE * other.lam + (1.0 - _SHARE) * self.lam, kept)


class _Program:
    """The linear program with some rows and times, solved; `x` is None where it has no answer.

    Unknown are the largest share s of friction, every λ, the terms, those of loops twice, and by
    how much rows are missed.
    """

    def __init__(
        self, problem: _Problem, rows: NDArray[np.intp], zeta: Complex, times: list[Real]
    ) -> None:
        from scipy.optimize import linprog

        m, weights = problem.m, problem.weights
        assert weights is not None
        self.problem, self.times, self.rows, self.zeta = problem, times, rows, zeta
        along = np.conj(zeta) * np.einsum("kij,kj->ki", problem.X[rows], zeta)
        kernels = [problem.kernel(i, rows, zeta, times[i]) for i in range(m)]
        signed = [np.hstack((K, -K)) if i in problem.loops else K for i, K in enumerate(kernels)]
        self.starts = 1 + m + np.cumsum([0, *(K.shape[1] for K in signed)])
        table = np.column_stack(
            (np.zeros(rows.size), along.real + _ASKED * np.abs(zeta) ** 2, *signed)
        )
        table = np.column_stack((table, -np.ones(rows.size)))  # by how much rows are missed
        limits = np.zeros((2 * len(problem.loops), self.starts[-1] + 1))
        for k, i in enumerate(problem.loops):
            part = slice(self.starts[i], self.starts[i + 1])
            limits[2 * k, part], limits[2 * k, 0] = problem.cost[k] / weights[i], -1.0
            limits[2 * k + 1, part], limits[2 * k + 1, 1 + i] = 1.0, -problem.reach / _BEYOND
        answer = linprog(  # not by the dual (`program`): near the edge that loses multipliers
            np.r_[1.0, np.full(self.starts[-1] - 1, _FREE), _MISSED],
            np.vstack((table, limits)),
            np.r_[-(along.imag / problem.omega[rows][:, None]) @ weights, np.zeros(len(limits))],
            bounds=[
                (one, None) for one in np.r_[0.0, problem.least, np.zeros(table.shape[1] - 1 - m)]
            ],
            method="highs-ds",
        )
        self.x = answer.x if answer.status == 0 else None
        self.missed = 0.0
        if self.x is not None:
            self.missed = float(self.x[-1])
            worth = -answer.ineqlin.marginals
            self.dual = worth[: rows.size]
            self.budget = (
                _FREE
                + worth[rows.size :]
                @ np.array([limits[:, self.starts[i]] for i in range(m)]).reshape(m, -1).T
            )
            self.tight = np.argsort(answer.ineqlin.residual[: rows.size])[:_KEPT]

    def found(self) -> _Mean:
        """The multiplier of the solution."""
        assert self.x is not None
        terms = []
        for i, times in enumerate(self.times):
            c = self.x[self.starts[i] : self.starts[i + 1]]
            if i in self.problem.loops:
                c = c[: times.size] - c[times.size :]
            terms.append({float(t): float(one) for t, one in zip(times, c, strict=True) if one})
        return _Mean(self.x[1 : 1 + self.problem.m].copy(), terms)

    def price(self, i: int) -> Real:
        """What a term of a spring at each time would gain, over what it costs."""
        at = self.dual > 0.0
        K = self.problem.kernel(i, self.rows[at], self.zeta[at], self.problem.choices(i))
        gain = -self.dual[at] @ K
        gain = np.abs(gain) if i in self.problem.loops else gain
        return np.asarray(gain / max(float(self.budget[i]), _FREE))


def _balanced(H0: Real, loops: Sequence[int]) -> Real | None:
    """Weights with w_i H_ij(0) = w_j H_ji(0), positive for loops; None where there are none.

    Without that the steady parts of the motions exchange energy without a bound, and the
    condition fails as ω → 0.
    """
    m = len(H0)
    scale = np.abs(H0).max() * 1e-12
    rows = [
        [H0[i, j] * (k == i) - H0[j, i] * (k == j) for k in range(m)]
        for i in range(m)
        for j in range(i)
    ]
    table = np.where(np.abs(rows) > scale, rows, 0.0).reshape(-1, m)
    _, sizes, vectors = np.linalg.svd(np.vstack((table, np.zeros((1, m)))))
    null = vectors[np.sum(sizes > scale) :]
    if not len(null):
        return None
    chosen = list(loops) or list(range(m))
    weights = np.linalg.lstsq(null[:, chosen].T, np.ones(len(chosen)))[0] @ null
    if loops and not (weights[chosen] > 1e-9).all():
        return None
    return np.asarray(weights)


def _delayed(x: Real) -> Complex:
    """1 - e^(jx) + jx."""
    series = 0.5 * x**2 + 1j * x**3 / 6.0
    return np.where(np.abs(x) < _SMALL, series, 1.0 - np.exp(1j * x) + 1j * x)
