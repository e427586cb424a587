"""The loop at one speed, as an engineer looks at it before trusting a describing function."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aeroflutter.analysis import Result, analysis
from aeroflutter.errors import ConvergenceError, InputError
from aeroflutter.guarantees.looptest_several import loop_test_among
from aeroflutter.guarantees.section import cut
from aeroflutter.guarantees.verdict import Guarantees, guarantees_at
from aeroflutter.model.lure import AnyFamily, LureFamily, as_lure
from aeroflutter.orbits.describing import DescribingCurve, DescribingOptions, describing_curve
from aeroflutter.orbits.harmonic import Cycle, HarmonicOptions, sinusoid, solve_cycle
from aeroflutter.orbits.harmonic.moment import answer
from aeroflutter.springs import Spring, Springs, each, simplify

__all__ = ["LoopCycle", "LoopTest", "LoopTestOptions", "loop_test"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, kw_only=True)
class LoopTestOptions:
    """What to show.

    Parameters
    ----------
    harmonics
        Highest harmonic looked at.
    spoils
        Predicted harmonic over the amplitude from which it counts as spoiling the describing
        function.
    points
        Points of the frequency response and of the locus -1/N.
    """

    harmonics: int = 9
    spoils: float = 0.01
    points: int = 800

    def __post_init__(self) -> None:
        problems = []
        if not self.harmonics >= 2:
            problems.append(f"harmonics: must be at least 2, not {self.harmonics!r}")
        if not (np.isfinite(self.spoils) and self.spoils > 0):
            problems.append(f"spoils: must be positive and finite, not {self.spoils!r}")
        if not self.points >= 2:
            problems.append(f"points: must be at least 2, not {self.points!r}")
        if problems:
            raise InputError(problems)


@dataclass(frozen=True, kw_only=True, eq=False)
class LoopCycle:
    """A cycle of the describing function at the speed, and what its harmonics do.

    Attributes
    ----------
    amplitude, bias, k
        Radians and reduced frequency.
    N
        Describing function.
    orders
        Harmonics 2 … n, (m,).
    answers
        The spring's answer to the sinusoid at each, ``|F_k|`` over the amplitude, (m,).
    gains
        What the loop makes of it, ``1/|1/G(jkω) + s|`` with the mean slope s, (m,).
    predicted
        Their product: harmonics of the motion over its amplitude, (m,).
    spoiling
        Which of them count as spoiling, (m,).
    guarantee
        One-point `Guarantees`.
    """

    amplitude: float
    bias: float
    k: float
    N: complex
    orders: NDArray[np.intp]
    answers: Real
    gains: Real
    predicted: Real
    spoiling: NDArray[np.bool_]
    guarantee: Guarantees


@dataclass(frozen=True, kw_only=True, eq=False)
class LoopTest(Result):
    """Frequency response of the loop at one speed, beside the verdict.

    Attributes
    ----------
    speed, speed_ratio
        U* and U*/U*_L (NaN without a flutter speed).
    frequency, G
        Reduced frequencies and G there, (n,).
    amplitude, locus
        Amplitudes (radians) and -1/N(a), (n,); infinite where N = 0.
    cycles
        Cycles of the describing function at this speed.
    spoils
        The limit of the options.
    """

    speed: float
    speed_ratio: float
    frequency: Real
    G: Complex
    amplitude: Real
    locus: Complex
    cycles: tuple[LoopCycle, ...]
    spoils: float


@analysis(speed="speed")
def loop_test(
    family: AnyFamily,
    spring: Springs,
    speed: float,
    options: LoopTestOptions | None = None,
    curve: DescribingCurve | None = None,
    which: int = 0,
) -> LoopTest:
    """Frequency response, locus of -1/N, cycles, their harmonics, and the verdict.

    Parameters
    ----------
    speed : float
        U*.
    curve : DescribingCurve, optional
        If it is known already.
    which : int
        Place of the spring whose loop it is, of several.

    Raises
    ------
    InputError
        If the speed is not positive and finite.
    """
    options = options or LoopTestOptions()
    if not (np.isfinite(speed) and speed > 0):
        raise InputError(f"speed: must be positive and finite, not {speed!r}")
    if len(each(spring)) > 1:
        return loop_test_among(family, each(spring), which, speed, options, curve)
    return _alone(as_lure(family), simplify(each(spring)[0]), speed, options, curve)


def _alone(
    family: LureFamily,
    spring: Spring,
    speed: float,
    options: LoopTestOptions,
    curve: DescribingCurve | None,
) -> LoopTest:
    curve = curve or describing_curve(family, spring, DescribingOptions(points=100))
    found = _cycles_at(family, spring, curve, speed)
    cycles = tuple(
        _cycle(family, spring, cycle, options, float(curve.slope[near])) for cycle, near in found
    )
    centre = cycles[0].k if cycles else _typical(curve, family, speed)
    frequency = np.geomspace(centre / 10, 3.0 * options.harmonics * centre, options.points)
    bias = cycles[0].bias if cycles else float(np.mean(spring.span()))
    amplitude = np.geomspace(*curve.amplitude_range, options.points)
    with np.errstate(divide="ignore", invalid="ignore"):
        locus = -1.0 / spring.describing(amplitude, np.full(amplitude.shape, bias)).N
        G = np.asarray(1.0 / family.at(speed).inverse_transfer(1j * frequency), dtype=complex)
    return LoopTest(
        speed=speed,
        speed_ratio=speed / curve.flutter_speed if curve.flutter_speed else float("nan"),
        frequency=frequency,
        G=G,
        amplitude=amplitude,
        locus=locus,
        cycles=cycles,
        spoils=options.spoils,
    )


def _typical(curve: DescribingCurve, family: LureFamily, speed: float) -> float:
    """A frequency to look at where there is no cycle."""
    if curve.k.size:
        return float(np.median(curve.k))
    roots = np.linalg.eigvals(family.at(speed).closed(1.0))
    return float(max(np.max(np.abs(roots.imag)), 1e-3))


def _cycles_at(
    family: LureFamily, spring: Spring, curve: DescribingCurve, speed: float
) -> list[tuple[Cycle, int]]:
    """Every cycle of the describing function at the speed, and the nearest point of the curve."""
    found: list[tuple[Cycle, int]] = []
    one = HarmonicOptions(harmonics=1)
    for number in np.unique(curve.family):
        mine = np.flatnonzero(curve.family == number)
        biased = bool(np.any(np.abs(curve.bias[mine]) > 1e-9 * spring.scale))
        above = curve.speed[mine] > speed
        for j in np.flatnonzero(above[:-1] != above[1:]):
            i, n = mine[j], mine[j + 1]
            t = (speed - curve.speed[i]) / (curve.speed[n] - curve.speed[i])
            A, B, k = (
                float((1 - t) * v[i] + t * v[n]) for v in (curve.amplitude, curve.bias, curve.k)
            )
            guess = sinusoid(A, B, k, speed)
            symmetric = spring.odd and not biased
            try:
                cycle = solve_cycle(family, spring, guess, options=one, symmetric=symmetric)
            except ConvergenceError:
                continue
            found.append((cycle, int(i if t < 0.5 else n)))
    return sorted(found, key=lambda entry: entry[0].first_harmonic)


def _cycle(
    family: LureFamily,
    spring: Spring,
    cycle: Cycle,
    options: LoopTestOptions,
    slope: float,
) -> LoopCycle:
    amplitude, bias, k = cycle.first_harmonic, float(cycle.Y[0].real), cycle.omega
    orders = np.arange(2, options.harmonics + 1)
    given = answer(spring, np.array([bias, -1j * amplitude]))
    F = given.moment(options.harmonics + 1)[2:]
    Z = family.at(cycle.speed).inverse_transfer(1j * k * orders)
    answers, gains = np.abs(F) / amplitude, 1 / np.abs(Z + given.slope(1)[0])
    predicted = answers * gains
    names = ("amplitude", "bias", "speed", "omega")
    point = dict(zip(names, np.array([[amplitude], [bias], [cycle.speed], [k]]), strict=True))
    guarantee = guarantees_at(family, spring, **point, distortion=np.linalg.norm(predicted))
    cut(family, spring, guarantee, **point, slope=np.array([slope]))
    return LoopCycle(
        amplitude=amplitude,
        bias=bias,
        k=k,
        N=complex(spring.describing(amplitude, bias).N),
        orders=orders,
        answers=answers,
        gains=gains,
        predicted=predicted,
        spoiling=predicted > options.spoils,
        guarantee=guarantee,
    )
