"""Guarantees of the describing function: the lemmas of their proofs, and the true cycles."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from aeroflutter.errors import ConvergenceError, InputError
from aeroflutter.guarantees import Guarantees, cut, guarantees, guarantees_at
from aeroflutter.guarantees.bounds import mean_square_bounds, supremum_bounds
from aeroflutter.guarantees.law import Law, law_of
from aeroflutter.guarantees.loop import highest_harmonic, sample_loop
from aeroflutter.guarantees.looptest import LoopTestOptions, loop_test
from aeroflutter.model.lure import SectionFamily
from aeroflutter.model.section import TypicalSection
from aeroflutter.orbits.cycles import cycle_near
from aeroflutter.orbits.describing import (
    DescribingCurve,
    DescribingOptions,
    describing_at,
    describing_curve,
)
from aeroflutter.orbits.harmonic import Cycle, HarmonicOptions, sinusoid, solve_cycle
from aeroflutter.orbits.harmonic.moment import answer, waveform
from aeroflutter.results.cycles import guarantee_fields
from aeroflutter.springs import Bilinear, Cubic, Freeplay, Hysteresis, Linear, Spring, Table

SECTION = {name: SectionFamily(TypicalSection(omega_bar=name)) for name in (0.2, 0.8)}
ODD = [
    Freeplay(1.0),
    Bilinear(-0.1, 0.2, -0.5, 1.0),
    Table((-2.0, -0.5, 0.5, 2.0), (-2.0, -0.8, 0.8, 2.0)),
    Cubic(1.0, 0.5),
    Cubic(1.0, -0.05),
    Hysteresis(1.0, 0.2),
    Hysteresis(0.3, 1.0),
]
seeds = st.integers(0, 2**32 - 1)


def name(value: object) -> str:
    return type(value).__name__ if isinstance(value, Spring) else str(value)


@cache
def curve(omega_bar: float, spring: Spring, points: int = 16) -> DescribingCurve:
    return describing_curve(SECTION[omega_bar], spring, DescribingOptions(points=points))


@cache
def verdict(omega_bar: float, spring: Spring, points: int = 16) -> Guarantees:
    return guarantees(SECTION[omega_bar], spring, curve(omega_bar, spring, points))


def odd_motion(
    rng: np.random.Generator, amplitude: float, share: float, top: int = 9
) -> np.ndarray:
    """A half-wave symmetric motion with first harmonic a sin θ."""
    Y = np.zeros(top + 1, dtype=complex)
    ks = np.arange(3, top + 1, 2)
    Y[ks] = (rng.normal(size=ks.size) + 1j * rng.normal(size=ks.size)) / ks**2
    Y *= share * amplitude / max(np.abs(Y).sum(), 1e-300)
    Y[1] = -1j * amplitude
    return Y


def memory(spring: Hysteresis, y: np.ndarray) -> np.ndarray:
    """The half-wave symmetric memory under samples of a half-wave symmetric motion."""
    half, h = y.size // 2, 0.0
    values = np.empty(half)
    for _ in range(2):  # the first half period, from zero, gives what to start from
        for i in range(half):
            h = float(spring.advance(h, y[i]))
            values[i] = h
        h = -h
    return values


# --- lemmas ---------------------------------------------------------------------------------------


@given(seeds, st.floats(0.05, 1.0), st.floats(0.05, 1.0), st.floats(0.1, 3.0), st.floats(0.0, 0.5))
def test_memory_is_lipschitz_in_the_supremum_norm(
    seed: int, delta_v: float, delta_h: float, amplitude: float, share: float
) -> None:
    """|h[y] - h[y']| never exceeds the largest |y - y'|: the lemma behind the second bound."""
    rng, spring = np.random.default_rng(seed), Hysteresis(delta_v, delta_h)
    y, other = (waveform(odd_motion(rng, amplitude, share), 128) for _ in range(2))
    distance = np.max(np.abs(y - other))
    assert np.max(np.abs(memory(spring, y) - memory(spring, other))) <= distance + 1e-12


@pytest.mark.parametrize("spring", ODD, ids=name)
def test_harmonics_of_the_answer_stay_below_their_bound(spring: Spring) -> None:
    """|F_k| <= V/(π k²) with V the total variation of dF/dθ, for k >= 5 (a cubic has none)."""
    law = law_of(SECTION[0.2], spring)
    amplitude = np.array([0.6, 1.0, 2.0, 10.0])
    F = law.harmonics(amplitude, 99)
    ks = 2 * np.arange(F.shape[1]) + 1
    bound = law.variation(amplitude)[:, None] / (np.pi * ks**2)
    assert np.all(np.abs(F[:, 2:]) <= bound[:, 2:] + 1e-12)


@pytest.mark.parametrize("omega_bar", [0.2, 0.8])
def test_the_loop_stays_below_its_tail_bound(omega_bar: float) -> None:
    family = SECTION[omega_bar]
    speed, omega = np.array([2.0, 5.0]), np.array([0.3, 0.06])
    loop = sample_loop(family, speed, omega, highest_harmonic(family, speed, omega))
    first = int(loop.ks[-1]) + 2
    ks = np.concatenate((np.arange(first, first + 200, 2), [10 * first + 1, 100 * first + 1]))
    for i in range(2):
        G = np.abs(1 / family.at(speed[i]).inverse_transfer(1j * omega[i] * ks))
        assert np.all(loop.tail[i] * (first / ks) ** loop.decay >= G)
        inside = family.at(speed[i]).inverse_transfer(1j * omega[i] * loop.ks)
        assert np.max(np.abs(loop.Z[i] / inside - 1)) < 1e-9


@given(seeds, st.sampled_from(ODD), st.floats(0.3, 5.0), st.floats(0.0, 0.4))
def test_first_harmonics_in_bulk_are_those_of_the_harmonic_balance(
    seed: int, spring: Spring, amplitude: float, share: float
) -> None:
    law = law_of(SECTION[0.2], spring)
    Y = odd_motion(np.random.default_rng(seed), amplitude, share)
    expected = answer(law.spring, Y).moment(2)[1]
    assert abs(law.first_harmonic(Y[None])[0] - expected) < 1e-11 * (1 + abs(expected))


@given(seeds, st.sampled_from(ODD), st.floats(0.6, 6.0), st.floats(0.01, 0.2))
def test_the_answer_differs_only_on_the_active_stretch(
    seed: int, spring: Spring, amplitude: float, share: float
) -> None:
    """u = s y - F of two motions within `reach` of a sin θ is the same on the rest of a period."""
    law = law_of(SECTION[0.2], spring)
    assume(np.isfinite(law.bound))
    rng, samples = np.random.default_rng(seed), 1024
    motions = [waveform(odd_motion(rng, amplitude, share), samples) for _ in range(2)]
    reach = np.array([share * amplitude])
    u = [bounded_part(law, y) for y in motions]
    differs = np.abs(u[0] - u[1]) > 1e-9 * amplitude
    width = law.active(np.array([amplitude]), reach)[0]
    assert differs.sum() <= width / np.pi * differs.size + 2
    assert np.max(np.abs(u[0] - u[1])) <= law.lipschitz * np.max(
        np.abs(motions[0] - motions[1])
    ) + (1e-9 * amplitude)


def bounded_part(law: Law, y: np.ndarray) -> np.ndarray:
    """Half a period of u."""
    if isinstance(law.spring, Hysteresis):
        return memory(law.spring, y)
    half = y[: y.size // 2]
    return law.stiffness * half - law.spring.moment(half)


# --- the theorem, at the true cycles --------------------------------------------------------------


def true_cycle(
    family: SectionFamily, spring: Spring, amplitude: float, k: float, U: float
) -> Cycle:
    """The cycle of the same first harmonic, converged."""
    cycle = sinusoid(amplitude, 0.0, k, U)
    for harmonics in (1, 3, 5, 7, 11, 31, 101):
        cycle = solve_cycle(
            family, spring, cycle, hold="amplitude", symmetric=True,
            options=HarmonicOptions(harmonics=harmonics),
        )  # fmt: skip
    return cycle


CASES = [(omega_bar, spring) for omega_bar in (0.2, 0.8) for spring in ODD]


@pytest.mark.parametrize(("omega_bar", "spring"), CASES, ids=name)
def test_true_cycles_obey_the_bounds_and_lie_in_their_bands(
    omega_bar: float, spring: Spring
) -> None:
    family, df = SECTION[omega_bar], curve(omega_bar, spring)
    found, law = verdict(omega_bar, spring), law_of(family, spring)
    tried = 0
    for i in np.flatnonzero(found.guaranteed)[::3]:
        cycle = true_cycle(family, spring, df.amplitude[i], df.k[i], df.speed[i])
        low, high = found.speed[i]
        slow, fast = found.omega[i]
        assert low <= cycle.speed <= high
        assert slow <= cycle.omega <= fast
        check_bounds(family, law, cycle)
        tried += 1
    assert tried == len(np.flatnonzero(found.guaranteed)[::3])


def check_bounds(family: SectionFamily, law: Law, cycle: Cycle) -> None:
    """|1/G + N| and the rest of the motion, at the cycle's own speed and frequency."""
    a, U, w = (np.array([v]) for v in (cycle.first_harmonic, cycle.speed, cycle.omega))
    highest = highest_harmonic(family, U, w)
    F, loop = law.harmonics(a, highest), sample_loop(family, U, w, highest)
    missed = abs(loop.Z[0, 0] + law.spring.describing(a, np.zeros(1)).N[0])
    rest = np.abs(cycle.Y[3::2])
    room = 1e-9  # of the converged cycle
    if not law.memory:
        bounds = mean_square_bounds(law, a, F, loop, 1.5 * a)
        assert missed <= bounds.sigma[0] + room
        assert np.linalg.norm(rest) <= bounds.rest[0] + room * a[0]
    if np.isfinite(law.bound):
        bounds = supremum_bounds(law, a, F, loop)
        assert missed <= bounds.sigma[0] + room
        higher = cycle.Y.copy()
        higher[1] = 0.0
        assert np.max(np.abs(waveform(higher, 4096))) <= bounds.rest[0] + room * a[0]


@pytest.mark.parametrize("spring", [Hysteresis(1.0, 0.2), Hysteresis(0.3, 1.0)], ids=str)
def test_bands_of_amplitude_hold_the_exact_cycle_at_that_speed(spring: Spring) -> None:
    family, df = SECTION[0.8], curve(0.8, spring, 60)
    found = verdict(0.8, spring, 60)
    # far out the loop is all but linear and shooting at a given speed all but singular
    rows = np.flatnonzero(found.exists_at_speed & (df.amplitude < 20.0))
    assert rows.size > 20
    for i in rows[:: max(1, rows.size // 8)]:
        guess = sinusoid(df.amplitude[i], 0.0, df.k[i], df.speed[i])
        for harmonics in (1, 5, 21):
            guess = solve_cycle(family, spring, guess, options=HarmonicOptions(harmonics=harmonics))
        exact = cycle_near(family, spring, guess.Y, guess.omega, guess.speed)
        low, high = found.amplitude[i]
        assert low <= exact.first_harmonic <= high


def test_single_points_are_cut_at_their_own_speed_and_hold_the_exact_cycle() -> None:
    family, spring = SECTION[0.8], Hysteresis(1.0, 0.2)
    at = describing_at(family, spring, [0.55, 1.0, 5.0])
    points = {"amplitude": at.amplitude, "bias": at.bias, "speed": at.speed, "omega": at.k}
    found = guarantees_at(family, spring, **points, distortion=at.distortion)
    cut(family, spring, found, **points, slope=at.slope)
    assert found.exists_at_speed.all()
    for i, a in enumerate(at.amplitude):
        low, high = found.amplitude[i]
        assert low < a < high < 1.1 * a
        guess = sinusoid(a, 0.0, at.k[i], at.speed[i])
        for harmonics in (1, 5, 21, 61):
            guess = solve_cycle(family, spring, guess, options=HarmonicOptions(harmonics=harmonics))
        assert low <= guess.first_harmonic <= high


def test_no_band_of_amplitude_promises_a_cycle_beside_a_fold() -> None:
    """Just above the fold at 0.92126 the describing function has cycles, the true loop has none."""
    spring = Hysteresis(1.0, 0.2)
    df, found = curve(0.8, spring, 60), verdict(0.8, spring, 60)
    between = (df.speed_ratio > 0.92126) & (df.speed_ratio < 0.92151)
    assert between.any()
    assert not found.exists_at_speed[between].any()


# --- where there is no guarantee ------------------------------------------------------------------


@pytest.mark.parametrize(
    ("omega_bar", "spring", "reason"),
    [
        (0.2, Hysteresis(1.0, 1.0), "does not filter the harmonics"),
        (0.2, Hysteresis(1.0, 1.0, 0.3), "offset makes the cycle asymmetric"),
        (0.2, Bilinear(0.25, 0.05, 0.25, 0.5), "offset makes the cycle asymmetric"),
        (0.2, Table((0.0, 1.0, 1.7), (0.0, 0.2, 0.9)), "no centre of symmetry"),
        (0.2, Freeplay(1.0), "does not filter the harmonics"),
    ],
    ids=name,
)
def test_what_has_no_guarantee_says_why(omega_bar: float, spring: Spring, reason: str) -> None:
    found = verdict(omega_bar, spring)
    assert any(reason in text for text in found.reason)
    for i, text in enumerate(found.reason):
        assert bool(text) != found.guaranteed[i]
        assert np.isfinite(found.speed[i]).all() == found.guaranteed[i]
        assert not (found.doubtful[i] and found.guaranteed[i])


def test_a_linear_spring_has_nothing_to_guarantee() -> None:
    found = guarantees_at(
        SECTION[0.2], Linear(1.0), amplitude=1.0, bias=0.0, speed=6.0, omega=0.08, distortion=0.0
    )
    assert not found.guaranteed[0]
    assert "linear" in found.reason[0]


def test_the_mean_offset_of_a_loop_does_not_matter_at_the_quarter_chord() -> None:
    """H_off moves the origin: for a_h = -1/2 the band is that of the centred loop."""
    spring = Hysteresis(1.0, 0.2)
    moved = Hysteresis(1.0, 0.2, 0.0, 0.3)
    at = describing_at(SECTION[0.8], spring, [1.0])
    values = {"speed": at.speed, "omega": at.k, "distortion": at.distortion}
    plain = guarantees_at(SECTION[0.8], spring, amplitude=1.0, bias=0.0, **values)
    same = guarantees_at(SECTION[0.8], moved, amplitude=1.0, bias=0.3, **values)
    other = guarantees_at(SECTION[0.8], moved, amplitude=1.0, bias=0.0, **values)
    assert np.allclose(plain.speed, same.speed, rtol=1e-12)
    assert "bias of its own" in other.reason[0]


@settings(max_examples=10)
@given(st.floats(0.1, 10.0))
def test_bands_are_scale_free(factor: float) -> None:
    at = describing_at(SECTION[0.8], Hysteresis(1.0, 0.2), [1.0])
    values = {"bias": 0.0, "speed": at.speed, "omega": at.k, "distortion": at.distortion}
    one = guarantees_at(SECTION[0.8], Hysteresis(1.0, 0.2), amplitude=1.0, **values)
    scaled = guarantees_at(
        SECTION[0.8], Hysteresis(factor, 0.2 * factor), amplitude=factor, **values
    )
    assert np.allclose(one.speed, scaled.speed, rtol=1e-9)


def test_fields_of_a_guarantee() -> None:
    found = verdict(0.8, Hysteresis(1.0, 0.2))
    unit = curve(0.8, Hysteresis(1.0, 0.2)).flutter_speed
    i = int(np.flatnonzero(found.guaranteed)[0])
    fields = guarantee_fields(found, i, unit)
    assert fields["guaranteed"]
    assert fields["reason"] is None
    assert fields["speed_ratio"] == [value / unit for value in fields["speed"]]
    none = guarantee_fields(verdict(0.2, Hysteresis(1.0, 1.0, 0.3)), 0)
    assert not none["guaranteed"]
    assert none["speed"] is None
    assert "asymmetric" in none["reason"]


# --- the loop at one speed ------------------------------------------------------------------------


def test_loop_test_marks_what_spoils() -> None:
    family = SECTION[0.2]
    found = loop_test(family, Freeplay(1.0), 0.5 * 6.28509)
    assert found.cycles
    for one in found.cycles:
        assert np.allclose(one.predicted, one.answers * one.gains)
        assert np.array_equal(one.spoiling, one.predicted > found.spoils)
    # -1/N meets G at every cycle
    for one in found.cycles:
        G = 1 / family.at(found.speed).inverse_transfer(1j * one.k)
        assert abs(G * one.N + 1) < 1e-9


def test_loop_test_options_are_checked() -> None:
    with pytest.raises(InputError) as caught:
        LoopTestOptions(harmonics=1, spoils=-1.0, points=1)
    assert len(caught.value.problems) == 3
    with pytest.raises(InputError, match="speed"):
        loop_test(SECTION[0.2], Freeplay(1.0), -1.0)


def test_no_guarantee_without_a_cycle_to_find() -> None:
    """Where harmonic balance finds no cycle of that amplitude nothing may have been promised."""
    spring = Hysteresis(1.0, 1.0)
    df, found = curve(0.2, spring), verdict(0.2, spring)
    lost = []
    for i in range(df.speed.size):
        try:
            true_cycle(SECTION[0.2], spring, df.amplitude[i], df.k[i], df.speed[i])
        except ConvergenceError:
            lost.append(i)
    assert not found.guaranteed[lost].any()
