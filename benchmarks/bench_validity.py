"""Guarantees of the describing function against the true cycles of random sections and springs.

    python -m benchmarks.bench_validity [CASES]

CASES (1000) static and as many hysteresis springs close random sections. Near a random cycle of the
describing function the true cycle is found: exactly, by shooting, where the spring is piecewise
linear; by harmonic balance to 1e-7 of the amplitude where it is cubic or shooting does not
converge. The band of the describing function at the true cycle's first harmonic must contain its
speed and frequency: any band that does not is a counterexample, printed with all that it takes to
repeat it. Points without a guarantee calibrate the distortion as its stand-in.
"""

from __future__ import annotations

import json
import sys
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from aeroflutter.errors import ConvergenceError, InputError
from aeroflutter.guarantees import Guarantees, doubtful, expected_error, guarantees_at
from aeroflutter.model.lure import SectionFamily, inverse_transfer
from aeroflutter.model.section import TypicalSection
from aeroflutter.orbits.cycles import cycle_near
from aeroflutter.orbits.harmonic import Cycle, HarmonicOptions, sinusoid, solve_cycle
from aeroflutter.springs import Bilinear, Cubic, Freeplay, Hysteresis, Spring, Table
from benchmarks import Measurement

LINEAR = 1e-10  # distortion below which the spring is linear at the amplitude
BAD = 0.01  # relative error of the speed that a doubtful describing function may have


@dataclass(frozen=True, kw_only=True)
class Draw:
    """A random section and spring, and a cycle of the describing function."""

    section: TypicalSection
    spring: Spring
    amplitude: float
    speed: float
    omega: float
    distortion: float

    @property
    def family(self) -> SectionFamily:
        return SectionFamily(self.section)


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What the guarantee says of a draw, and what is true."""

    guaranteed: bool
    method: str
    reason: str
    inside: bool
    width: float
    position: float
    error: float
    distortion: float
    exact: bool
    draw: Draw


def random_section(rng: np.random.Generator) -> TypicalSection:
    r_alpha = rng.uniform(0.35, 0.7)
    return TypicalSection(
        mu=float(np.exp(rng.uniform(np.log(10), np.log(300)))),
        a_h=-0.5 if rng.random() < 0.5 else float(rng.uniform(-0.5, -0.1)),
        x_alpha=float(rng.uniform(0.05, 0.6) * r_alpha),
        r_alpha=float(r_alpha),
        omega_bar=float(np.exp(rng.uniform(np.log(0.1), np.log(1.2)))),
        zeta_alpha=float(rng.choice([0.0, rng.uniform(0, 0.05)])),
        zeta_xi=float(rng.choice([0.0, rng.uniform(0, 0.05)])),
    )


def static_spring(rng: np.random.Generator) -> Spring:
    kind = rng.integers(4)
    if kind == 0:
        return Freeplay(1.0)
    if kind == 1:
        m_f = float(rng.uniform(0.0, 0.9))
        return Bilinear(-0.5 * m_f, m_f, -0.5, 1.0)
    if kind == 2:
        return Cubic(1.0, float(rng.choice([-0.05, 1.0]) * rng.uniform(0.3, 1.0)))
    half = np.cumsum(rng.uniform(0.2, 0.6, size=3))
    moments = np.cumsum(np.diff(half, prepend=0.0) * rng.uniform(0.0, 1.6, size=3))
    half, moments = np.append(half, half[-1] + 1.0), np.append(moments, moments[-1] + 1.0)
    return Table(
        tuple(np.concatenate((-half[::-1], half))), tuple(np.concatenate((-moments[::-1], moments)))
    )


def hysteresis(rng: np.random.Generator) -> Spring:
    share = float(np.exp(rng.uniform(np.log(0.05), np.log(20.0))))
    return Hysteresis(2.0 / (1 + share), 2.0 * share / (1 + share))


def draw(rng: np.random.Generator, spring: Spring) -> Draw | None:
    """A random cycle of the describing function, or None if there is none at the amplitude."""
    section = random_section(rng)
    family = SectionFamily(section)
    low = spring.delta_v / 2 if isinstance(spring, Hysteresis) else 0.3 * spring.scale
    amplitude = float(low + spring.scale * np.exp(rng.uniform(np.log(0.05), np.log(20.0))))
    N = complex(spring.describing(amplitude).N)
    found = crossings(family, N)
    if not found:
        return None
    speed, omega = found[rng.integers(len(found))]
    return described(section, spring, amplitude, omega, speed)


def described(
    section: TypicalSection, spring: Spring, amplitude: float, omega: float, speed: float
) -> Draw | None:
    """The cycle of the describing function of this amplitude, or None where Newton fails."""
    family = SectionFamily(section)
    try:
        cycle = solve_cycle(
            family, spring, sinusoid(amplitude, 0.0, omega, speed), hold="amplitude",
            options=HarmonicOptions(harmonics=1), symmetric=True,
        )  # fmt: skip
    except ConvergenceError:
        return None
    apart = distortion(family, spring, cycle)
    if apart < LINEAR:
        return None
    return Draw(
        section=section,
        spring=spring,
        amplitude=amplitude,
        speed=cycle.speed,
        omega=cycle.omega,
        distortion=apart,
    )


def crossings(family: SectionFamily, N: complex) -> list[tuple[float, float]]:
    """Guesses of (speed, frequency) where a root of A - N b c crosses the imaginary axis."""
    low, high = family.search_range
    speeds = np.geomspace(low, 0.3 * high, 300)
    A, b = family.stack(speeds)
    roots = np.linalg.eigvals(A - N * b[:, :, None] * family.c)
    found = []
    for i in range(speeds.size - 1):
        for root in roots[i][roots[i].imag > 1e-3]:
            near = roots[i + 1][np.argmin(np.abs(roots[i + 1] - root))]
            if root.real < 0 <= near.real or near.real < 0 <= root.real:
                t = root.real / (root.real - near.real)
                found.append((float((1 - t) * speeds[i] + t * speeds[i + 1]), float(near.imag)))
    return found


def distortion(family: SectionFamily, spring: Spring, cycle: Cycle) -> float:
    """Harmonics 2 … 9 of the motion over its amplitude, as the DF predicts them."""
    from aeroflutter.orbits.harmonic.moment import answer

    orders = np.arange(2, 10)
    given = answer(spring, cycle.Y)
    F = given.moment(10)[2:]
    A, b = family.stack(cycle.speed)
    Z = inverse_transfer(A, b, family.c, 1j * cycle.omega * orders)
    return float(np.linalg.norm(F / (Z + given.slope(1)[0])) / cycle.first_harmonic)


def truth(one: Draw) -> tuple[float, float, float, bool]:
    """First harmonic, speed and frequency of the true cycle near a draw; whether it is exact."""
    cycle = sinusoid(one.amplitude, 0.0, one.omega, one.speed)
    for harmonics in (1, 3, 5, 7, 11, 21):
        cycle = solve_cycle(
            one.family, one.spring, cycle, hold="amplitude", symmetric=True,
            options=HarmonicOptions(harmonics=harmonics),
        )  # fmt: skip
    rough = HarmonicOptions(tolerance=1e-5, max_harmonics=101)
    cycle = solve_cycle(
        one.family, one.spring, cycle, hold="amplitude", symmetric=True, options=rough
    )
    if not isinstance(one.spring, Cubic):
        try:
            exact = cycle_near(one.family, one.spring, cycle.Y, cycle.omega, cycle.speed)
        except ConvergenceError:
            pass  # a fold, or Newton's method led elsewhere
        else:
            if exact.symmetric and abs(exact.period * cycle.omega / (2 * np.pi) - 1) < 1e-3:
                return exact.first_harmonic, exact.speed, exact.k, True
    fine = HarmonicOptions(tolerance=1e-7, max_harmonics=301)
    try:
        cycle = solve_cycle(
            one.family, one.spring, cycle, hold="amplitude", symmetric=True, options=fine
        )
    except ConvergenceError as error:
        if not isinstance(error.partial, Cycle):
            raise
        cycle = error.partial  # of 301 harmonics
    return cycle.first_harmonic, cycle.speed, cycle.omega, False


def judge(one: Draw) -> Outcome | None:
    """None where the true cycle is not known."""
    try:
        amplitude, speed, omega, exact = truth(one)
    except ConvergenceError:
        found = verdict(one)
        if found.guaranteed[0]:
            print(f"guaranteed, but no cycle was found: {one}")
        return None
    # the describing function of exactly the true cycle's first harmonic
    at = described(one.section, one.spring, amplitude, one.omega, one.speed)
    if at is None or abs(at.speed / one.speed - 1) > 0.01:
        return None
    found = verdict(at)
    (low, high), (slow, fast) = found.speed[0], found.omega[0]
    return Outcome(
        guaranteed=bool(found.guaranteed[0]),
        method=found.method[0],
        reason=found.reason[0].split(" (")[0],
        inside=bool(low <= speed <= high and slow <= omega <= fast),
        width=float((high - low) / at.speed),
        position=2 * abs(speed - 0.5 * (low + high)) / (high - low),
        error=abs(speed - at.speed) / speed,
        distortion=at.distortion,
        exact=exact,
        draw=at,
    )


def verdict(one: Draw) -> Guarantees:
    return guarantees_at(
        one.family, one.spring, amplitude=one.amplitude, bias=0.0, speed=one.speed,
        omega=one.omega, distortion=one.distortion,
    )  # fmt: skip


def study(kind: str, count: int, seed: int) -> list[Outcome]:
    """Outcomes of `count` random cycles whose true cycle is known."""
    rng = np.random.default_rng(seed)
    make = {"static": static_spring, "hysteresis": hysteresis}[kind]
    outcomes: list[Outcome] = []
    tried = lost = 0
    while len(outcomes) < count:
        tried += 1
        try:
            one = draw(rng, make(rng))
        except InputError:
            continue
        if one is None:
            continue
        outcome = judge(one)
        lost += outcome is None
        if outcome:
            outcomes.append(outcome)
            if len(outcomes) % 100 == 0:
                print(f"{kind}: {len(outcomes)} of {count}", file=sys.stderr, flush=True)
    print(f"{kind}: {count} true cycles, {sum(o.exact for o in outcomes)} of them by shooting;")
    print(f"  {tried} draws, {lost} with a describing function whose true cycle was not found")
    return outcomes


def report(outcomes: list[Outcome]) -> dict[str, float]:
    proved = [one for one in outcomes if one.guaranteed]
    wrong = [one for one in proved if not one.inside]
    for one in wrong:
        print(f"COUNTEREXAMPLE: {one}")
    widths = np.array([one.width for one in proved])
    errors = np.array([one.error for one in proved])
    methods = {m: sum(one.method == m for one in proved) for m in {one.method for one in proved}}
    print(f"  guaranteed {len(proved)} of {len(outcomes)} {methods}, outside {len(wrong)}")
    print(f"  width of speed bands: quartiles {np.quantile(widths, [0.25, 0.5, 0.75])}")
    ratio = 0.5 * widths / np.maximum(errors, 1e-12)
    print(f"  half width over true error: quartiles {np.quantile(ratio, [0.25, 0.5, 0.75])}")
    outermost = max(one.position for one in proved)
    print(
        f"  outermost true cycle at {outermost:.3f} of the way from the band's middle to its edge"
    )
    left = [one for one in outcomes if not one.guaranteed]
    print(f"  without guarantee: {dict(Counter(one.reason for one in left))}")
    for word, some in (("with", proved), ("without", left)):
        worst = max((one.error for one in some), default=0.0)
        print(f"  largest error of the speed {word} guarantee: {worst:.2g}")
    return {
        "cases": len(outcomes),
        "guaranteed": len(proved),
        "outside": len(wrong),
        "median_width": float(np.median(widths)),
    }


def calibrate(outcomes: list[Outcome]) -> tuple[float, float]:
    """c and γ of error < c d^γ for 95 % of cycles, by quantile regression in logarithms."""
    d = np.log([max(one.distortion, 1e-9) for one in outcomes])
    e = np.log([max(one.error, 1e-12) for one in outcomes])
    keep = (d > np.log(1e-4)) & (e > np.log(1e-10))
    exponents = np.linspace(0.8, 2.6, 181)
    loss = [_pinball(e[keep] - g * d[keep]) for g in exponents]
    gamma = float(exponents[int(np.argmin(loss))])
    return float(np.exp(np.quantile(e[keep] - gamma * d[keep], 0.95))), gamma


def _pinball(residual: np.ndarray, q: float = 0.95) -> float:
    shifted = residual - np.quantile(residual, q)
    return float(np.mean(np.where(shifted > 0, q * shifted, (q - 1) * shifted)))


def threshold(outcomes: list[Outcome]) -> float:
    """Distortion at which misses and false alarms are equally frequent."""
    d = np.array([one.distortion for one in outcomes])
    bad = np.array([one.error > BAD for one in outcomes])
    tried = np.geomspace(1e-3, 1.0, 601)
    apart = [abs(np.mean(d[bad] <= t) - np.mean(d[~bad] > t)) for t in tried]
    return float(tried[int(np.argmin(apart))])


def alarms(outcomes: list[Outcome]) -> dict[str, float]:
    """How the stand-in does on points without a guarantee."""
    d = np.array([one.distortion for one in outcomes])
    error = np.array([one.error for one in outcomes])
    bad, said = error > BAD, doubtful(d)
    rates = {
        "points": len(outcomes),
        "off by more than 1 %": int(bad.sum()),
        "miss_rate": float(np.mean(~said[bad])),
        "false_alarm_rate": float(np.mean(said[~bad])),
        "within_expected_error": float(np.mean(error < expected_error(d))),
    }
    print("stand-in on points without a guarantee:", json.dumps(rates))
    return rates


def measure() -> Iterator[Measurement]:
    """A small study, for the time a case takes."""
    start = time.process_time()
    outcomes = study("static", 20, 1) + study("hysteresis", 20, 2)
    yield Measurement("CPU time of a case of the study", (time.process_time() - start) / 40)
    outside = sum(one.guaranteed and not one.inside for one in outcomes)
    yield Measurement("true cycles outside their bands", outside, "of 40", 0)


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    everything: list[Outcome] = []
    for seed, kind in enumerate(("static", "hysteresis"), 1):
        start = time.perf_counter()
        outcomes = study(kind, count, seed)
        report(outcomes)
        print(f"  {time.perf_counter() - start:.0f} s")
        everything += outcomes
    left = [one for one in everything if not one.guaranteed]
    c, gamma = calibrate(left[::2])
    print(f"calibration on every other case: error < {c:.3g} d^{gamma:.2f} for 95 %")
    print(f"misses and false alarms balance at a distortion of {threshold(left[::2]):.3g}")
    alarms(left[1::2])


if __name__ == "__main__":
    main()
