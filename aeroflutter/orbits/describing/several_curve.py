"""The amplitude curve of several springs: points, folds, onset and stability of its families."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from aeroflutter.errors import ConvergenceError
from aeroflutter.linear.rootlocus import flutter_speed
from aeroflutter.model.lure import AnyFamily, as_family
from aeroflutter.motion.swings import Swing
from aeroflutter.orbits.continuation import correct
from aeroflutter.orbits.describing.options import DescribingOptions
from aeroflutter.orbits.describing.result import DescribingCurve
from aeroflutter.orbits.describing.several import NEWTON, JointFamily, joint_families
from aeroflutter.orbits.describing.stability import growing_others
from aeroflutter.orbits.harmonic.balance import SPEED, Balance
from aeroflutter.orbits.harmonic.swings import harmonic_swings
from aeroflutter.orbits.result import (
    CORNER,
    Branch,
    Cycle,
    Spot,
    lowest,
    onset,
    stable_onset,
)
from aeroflutter.orbits.spectrum import FOLD
from aeroflutter.springs import Spring, simplify

__all__ = ["Rules", "joint_curve", "rules"]

Array = NDArray[np.float64]


def joint_curve(
    family: AnyFamily,
    springs: Sequence[Spring],
    options: DescribingOptions,
    amplitudes: Array | None = None,
) -> DescribingCurve:
    """The amplitude curve of several springs; see `describing_curve`.

    Parameters
    ----------
    amplitudes
        Of the first spring, ascending: then only the cycles of exactly these are returned.
    """
    simple = [simplify(spring) for spring in springs]
    whole = as_family(family)
    found = joint_families(family, simple, options)
    flutter = flutter_speed(whole)
    branches, points = [], []
    for number, one in enumerate(found, 1):
        states = _filled(one, options.points if amplitudes is None else 2)
        cycles = [_cycle(one, x, number, flutter) for x in states]
        branches.append(_branch(one, number, cycles, states, flutter))
        if amplitudes is not None:
            states = [x for A in amplitudes for x in _of_amplitude(one, float(A))]
            cycles = [_cycle(one, x, number, flutter) for x in states]
        points += [(one, x, cycle) for x, cycle in zip(states, cycles, strict=True)]
    low, high = options.speeds(whole, flutter)
    notes = [] if found else [f"no limit cycle between U* = {low:g} and {high:g}"]
    size = simple[0].scale
    return DescribingCurve(
        **_arrays(points, options),
        families=tuple(branches),
        flutter_speed=flutter,
        onset=lowest(one.onset for one in branches),
        stable_onset=lowest(one.stable_onset for one in branches),
        amplitude_range=options.amplitude_range or (0.01 * size, 100.0 * size),
        speed_range=(low, high),
        notes=tuple(notes),
        swings=partial(_swing, [cycle for _, _, cycle in points]),
    )


def _swing(cycles: Sequence[Cycle], i: int) -> tuple[tuple[Swing, ...], tuple[Swing, ...]]:
    return cycles[i].coordinates, cycles[i].springs


def _filled(one: JointFamily, count: int) -> list[Array]:
    """Unknowns of at least so many cycles along a family, more put where they are far apart."""
    points = [state.x for state in one.curve.states]
    while len(points) < count:
        gaps = [float(np.linalg.norm(b - a)) for a, b in pairwise(points)]
        wide = sorted(np.argsort(gaps)[::-1][: count - len(points)].tolist(), reverse=True)
        before = len(points)
        for i in wide:
            chord = points[i + 1] - points[i]
            with suppress(ConvergenceError):
                x, _ = correct(one.balance, points[i] + 0.5 * chord, chord, NEWTON)
                points.insert(i + 1, x)
        if len(points) == before:
            break
    return points


def _of_amplitude(one: JointFamily, amplitude: float) -> Iterator[Array]:
    """Unknowns of the cycles with an amplitude of the first spring."""

    def over(x: Array) -> float:
        return float(np.log(one.balance.unpack(x).first_harmonic / amplitude))

    states = [state.x for state in one.curve.states]
    values = [over(x) for x in states]
    for (a, b), (u, v) in zip(pairwise(states), pairwise(values), strict=True):
        if u * v < 0.0:
            at: dict[float, Array] = {0.0: a, 1.0: b}

            def value(t: float, a: Array = a, b: Array = b, at: dict[float, Array] = at) -> float:
                if t not in at:
                    at[t] = correct(one.balance, a + t * (b - a), b - a, NEWTON)[0]
                return over(at[t])

            yield at[float(brentq(value, 0.0, 1.0, xtol=1e-14))]


def _cycle(one: JointFamily, x: Array, number: int, flutter: float | None) -> Cycle:
    """A sinusoid of every spring as a cycle."""
    plain = one.balance.unpack(x)
    return replace(
        plain,
        speed_ratio=plain.speed / (flutter or np.nan),
        amplitude=plain.first_harmonic,
        bias=float(plain.Y[0].real),
        stable=rules(one.balance, x).stable,
        symmetric=one.balance.symmetric,
        family=number,
        method="describing",
        swings=partial(harmonic_swings, one.balance.family, plain),
    )


def _branch(
    one: JointFamily, number: int, cycles: list[Cycle], states: list[Array], flutter: float | None
) -> Branch:
    """What is known of a family."""
    at = np.array([state.x for state in one.curve.states])
    places: list[Spot] = [Spot(cycle) for cycle in cycles]
    where = [_nearest(np.array(states), event.x) for event in one.curve.events]
    turns = [
        (i, Spot(_cycle(one, event.x, number, flutter), CORNER if event.jump else FOLD))
        for i, event in zip(where, one.curve.events, strict=True)
        if event.name == FOLD and np.any(np.abs(np.diff(at[:, SPEED])) > 1e-9)
    ]
    for i, spot in sorted(turns, key=lambda entry: -entry[0]):
        places.insert(i + 1, spot)
    return Branch(
        number=number,
        cycles=tuple(cycles),
        bifurcations=tuple(onset(places, [i]) for i, place in enumerate(places) if place.kind),
        ends=one.curve.stops,
        closed=one.curve.closed,
        onset=onset(places),
        stable_onset=stable_onset(places),
        symmetric=one.balance.symmetric,
        origin="describing function",
    )


def _nearest(points: Array, x: Array) -> int:
    """The first of two neighbours between which a point lies."""
    reach = np.linalg.norm(points - x, axis=1)
    return int(np.argmin(reach[:-1] + reach[1:])) if len(points) > 1 else 0


class Rules(NamedTuple):
    """What quasi-static rules say of a cycle; see `stability.Stability`."""

    drift: float
    others: int
    bias_stable: bool

    @property
    def stable(self) -> bool:
        """Whether they all call it stable."""
        return self.drift < 0.0 and self.others == 0 and self.bias_stable


def rules(balance: Balance, x: Array) -> Rules:
    """Whether the sinusoids of all springs return after a small push, by quasi-static rules.

    Amplitudes and phases drift as (Z'(jω) σ + Z(jω)) δY + δF = 0, the means following; of the
    rates σ one is zero, for time may be shifted, and the next decides.
    """
    cycle, J, M = balance.unpack(x), *balance.linearised(x)
    G = len(balance.channels)
    slow, fast = np.arange(J.shape[0] - 2 * G), np.arange(J.shape[0] - 2 * G, J.shape[0])
    bias_stable = True
    K = J[np.ix_(fast, fast)]
    if slow.size:
        static = J[np.ix_(slow, slow)]
        bias_stable = bool(np.linalg.det(static) >= -1e-9)
        if abs(np.linalg.det(static)) > 1e-9:
            K = K - J[np.ix_(fast, slow)] @ np.linalg.solve(static, J[np.ix_(slow, fast)])
    sigma = np.linalg.eigvals(-np.linalg.solve(M, K))
    drift = complex(sigma[np.argsort(np.abs(sigma))[1]])
    N = np.array(
        [
            complex(spring.describing(abs(Y[1]), Y[0].real).N)
            for spring, Y in zip(balance.springs, cycle.motions, strict=True)
        ]
    )
    A, B, C, _ = balance.family.stack(cycle.speed)
    roots = np.linalg.eigvals(A - (B * N) @ C).astype(complex)
    others = int(growing_others(roots[None], np.array([cycle.omega]), 1)[0])
    return Rules(drift.real, others, bias_stable)


def _slopes(family: NDArray[np.int64], speed: Array, amplitude: Array) -> Array:
    """dU/dA along each family by differences; NaN where the amplitude stands still."""
    slopes = np.full(speed.size, np.nan)
    for number in np.unique(family):
        own = family == number
        if np.count_nonzero(own) > 1:
            rise, run = np.gradient(speed[own]), np.gradient(amplitude[own])
            slopes[own] = np.divide(rise, run, out=np.full(run.size, np.nan), where=run != 0.0)
    return slopes


def _arrays(
    points: Sequence[tuple[JointFamily, Array, Cycle]], options: DescribingOptions
) -> dict[str, Any]:
    """The columns of a `DescribingCurve`."""
    cycles = [cycle for _, _, cycle in points]
    told = [rules(one.balance, x) for one, x, _ in points]
    parts = [one.balance.predicted(x, options.harmonics) for one, x, _ in points]
    harmonics = np.zeros((len(points), options.harmonics - 1), dtype=complex)
    distortion = np.zeros(len(points))
    for i, ((one, _, cycle), (ks, left)) in enumerate(zip(points, parts, strict=True)):
        firsts = np.abs(cycle.motions[[part.springs[0] for part in one.balance.channels], 1])
        harmonics[i, ks - 2] = left[:, 0] / firsts[0]
        distortion[i] = float(np.max(np.linalg.norm(left, axis=0) / firsts))
    amplitude = np.array([cycle.amplitude for cycle in cycles])
    bias = np.array([cycle.bias for cycle in cycles])
    speed = np.array([cycle.speed for cycle in cycles])
    gains = [one.balance.springs[0].describing(c.amplitude, c.bias) for one, _, c in points]
    family = np.array([cycle.family for cycle in cycles], dtype=np.int64)
    stable = np.array([cycle.stable for cycle in cycles], dtype=bool)
    spans = [one.balance.springs[0].span() for one, _, _ in points]
    return {
        "amplitude": amplitude,
        "bias": bias,
        "speed": speed,
        "speed_ratio": np.array([cycle.speed_ratio for cycle in cycles]),
        "k": np.array([cycle.omega for cycle in cycles]),
        "n_p": np.array([float(d.n_p) for d in gains]),
        "n_q": np.array([float(d.n_q) for d in gains]),
        "family": family,
        "stable": stable,
        "drift": np.array([one.drift for one in told]),
        "slope": _slopes(family, speed, amplitude),
        "others": np.array([one.others for one in told], dtype=np.int64),
        "bias_stable": np.array([one.bias_stable for one in told], dtype=bool),
        "rules_agree": np.ones(len(points), dtype=bool),
        "harmonics": harmonics,
        "distortion": distortion,
        "in_thesis_range": np.array(
            [
                low >= b - a and high <= b + a
                for (low, high), a, b in zip(spans, amplitude, bias, strict=True)
            ],
            dtype=bool,
        ),
    }
