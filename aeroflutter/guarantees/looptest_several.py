"""The loop of one of several springs at one speed, the others being what sinusoids make of them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from aeroflutter.errors import ConvergenceError, InputError
from aeroflutter.guarantees.verdict import guarantees_at
from aeroflutter.model.lure import AnyFamily, as_family
from aeroflutter.model.system import transfer
from aeroflutter.orbits.describing import DescribingCurve, DescribingOptions, describing_curve
from aeroflutter.orbits.harmonic import HarmonicOptions, solve_cycle
from aeroflutter.orbits.harmonic.moment import answer
from aeroflutter.orbits.result import Cycle
from aeroflutter.springs import Spring, simplify

if TYPE_CHECKING:
    from aeroflutter.guarantees.looptest import LoopCycle, LoopTest, LoopTestOptions

__all__ = ["loop_test_among"]

Complex = NDArray[np.complex128]


def loop_test_among(
    family: AnyFamily,
    springs: Sequence[Spring],
    which: int,
    speed: float,
    options: LoopTestOptions,
    curve: DescribingCurve | None = None,
) -> LoopTest:
    """Frequency response that one spring sees, and the cycles of all; see `loop_test`.

    With every other spring replaced by its describing function on the first cycle (of unit slope
    where there is none), G is that of this spring alone. Harmonics are those of the whole loop:
    every spring answers to its sinusoid, and (G⁻¹ + S) Y_k = -F_k, S being the mean slopes.

    Parameters
    ----------
    which
        Place of the spring.
    """
    from aeroflutter.guarantees.looptest import LoopTest

    whole, simple = as_family(family), [simplify(one) for one in springs]
    if not 0 <= which < len(simple):
        raise InputError(f"which: there are springs 0 to {len(simple) - 1}, not {which!r}")
    curve = curve or describing_curve(family, simple, DescribingOptions(points=100))
    found = _cycles_at(whole, simple, which, curve, speed)
    cycles = tuple(_cycle(whole, simple, which, one, options) for one in found)
    A, B, C, _ = whole.stack(speed)
    gains = _gains(simple, found[0]) if found else np.ones(len(simple), dtype=complex)
    gains[which] = 0.0
    closed = A - (B * gains) @ C
    centre = found[0].omega if found else float(np.max(np.abs(np.linalg.eigvals(closed).imag)))
    frequency = np.geomspace(centre / 10, 3.0 * options.harmonics * centre, options.points)
    G = transfer(closed, B[:, [which]], C[[which]], 1j * frequency)[:, 0, 0]
    spring = simple[which]
    bias = cycles[0].bias if cycles else float(np.mean(spring.span()))
    amplitude = np.geomspace(1e-2 * spring.scale, 1e2 * spring.scale, options.points)
    with np.errstate(divide="ignore", invalid="ignore"):
        locus = -1.0 / spring.describing(amplitude, np.full(amplitude.shape, bias)).N
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


def _cycles_at(
    family: AnyFamily,
    springs: Sequence[Spring],
    which: int,
    curve: DescribingCurve,
    speed: float,
) -> list[Cycle]:
    """Cycles of the describing functions at the speed, by the amplitude of one spring."""
    found: list[Cycle] = []
    for branch in curve.families:
        for one, other in pairwise(branch.cycles):
            if (one.speed > speed) is (other.speed > speed):
                continue
            t = (speed - one.speed) / (other.speed - one.speed)
            Y = (1 - t) * one.motions + t * other.motions
            omega = (1 - t) * one.omega + t * other.omega
            guess = Cycle(Y[0], omega, speed, method="describing", outputs=Y)
            try:
                cycle = solve_cycle(
                    family, springs, guess, options=HarmonicOptions(harmonics=1),
                    symmetric=bool(one.symmetric),
                )  # fmt: skip
            except ConvergenceError:
                continue
            found.append(cycle)
    return sorted(found, key=lambda cycle: float(np.abs(cycle.motions[which, 1])))


def _gains(springs: Sequence[Spring], cycle: Cycle) -> Complex:
    """Describing functions of the springs on a cycle, (m,)."""
    pairs = zip(springs, cycle.motions, strict=True)
    return np.array(
        [complex(one.describing(abs(Y[1]), float(Y[0].real)).N) for one, Y in pairs], dtype=complex
    )


def _cycle(
    family: AnyFamily,
    springs: Sequence[Spring],
    which: int,
    cycle: Cycle,
    options: LoopTestOptions,
) -> LoopCycle:
    from aeroflutter.guarantees.looptest import LoopCycle

    orders = np.arange(2, options.harmonics + 1)
    amplitudes, k = np.abs(cycle.motions[:, 1]), cycle.omega
    F, slopes = np.empty((orders.size, len(springs)), dtype=complex), np.empty(len(springs))
    for i, (one, Y) in enumerate(zip(springs, cycle.motions, strict=True)):
        given = answer(one, np.array([Y[0].real, -1j * amplitudes[i]]))  # B + A sin θ
        turn = np.exp(1j * orders * (np.angle(Y[1]) + 0.5 * np.pi))
        F[:, i], slopes[i] = turn * given.moment(options.harmonics + 1)[2:], given.slope(1)[0].real
    Z = as_family(family).at(cycle.speed).inverse_transfer(1j * k * orders)
    motion = np.abs(np.linalg.solve(Z + np.diag(slopes), F[..., None])[..., which, 0])
    amplitude = float(amplitudes[which])
    answers, predicted = np.abs(F[:, which]) / amplitude, motion / amplitude
    bias = float(cycle.motions[which, 0].real)
    names = ("amplitude", "bias", "speed", "omega")
    point = dict(zip(names, np.array([[amplitude], [bias], [cycle.speed], [k]]), strict=True))
    return LoopCycle(
        amplitude=amplitude,
        bias=bias,
        k=k,
        N=complex(_gains(springs, cycle)[which]),
        orders=orders,
        answers=answers,
        gains=np.divide(predicted, answers, out=np.full(orders.size, np.nan), where=answers > 0),
        predicted=predicted,
        spoiling=predicted > options.spoils,
        guarantee=guarantees_at(family, springs, **point, distortion=np.linalg.norm(predicted)),
    )
