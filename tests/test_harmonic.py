"""Harmonic balance: identities, the describing function, the exact cycles, published numbers."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from aeroflutter.case import load_case
from aeroflutter.errors import ConvergenceError, InputError
from aeroflutter.model.lure import SectionFamily
from aeroflutter.model.section import TypicalSection
from aeroflutter.orbits.cycles import Cycle as ExactCycle
from aeroflutter.orbits.cycles import cycle_near
from aeroflutter.orbits.describing import DescribingCurve, DescribingOptions, describing_curve
from aeroflutter.orbits.harmonic import (
    Cycle,
    HarmonicBranch,
    HarmonicOptions,
    asymmetric_branch,
    continue_branch,
    harmonic_balance,
    multipliers,
    sinusoid,
    solve_cycle,
)
from aeroflutter.orbits.harmonic.balance import Balance
from aeroflutter.orbits.harmonic.moment import Answer, Sampled, answer, waveform
from aeroflutter.springs import Bilinear, Cubic, Freeplay, Hysteresis, Play, Spring, Table, respond

SECTION = {name: SectionFamily(TypicalSection(omega_bar=name)) for name in (0.2, 0.8)}
ONE = HarmonicOptions(harmonics=1)


@cache
def curve(omega_bar: float, spring: Spring) -> DescribingCurve:
    return describing_curve(SECTION[omega_bar], spring, DescribingOptions(points=12))


def stable_cycle(omega_bar: float, spring: Spring, ratio: float, harmonics: int) -> Cycle:
    """The stable symmetric cycle at a speed ratio, from the describing function."""
    df = curve(omega_bar, spring)
    rows = np.flatnonzero((df.bias == 0) & df.stable)
    i = rows[np.argmin(np.abs(df.speed_ratio[rows] - ratio))]
    guess = sinusoid(df.amplitude[i], 0.0, df.k[i], ratio * df.flutter_speed)
    for count in dict.fromkeys((1, min(7, harmonics), harmonics)):
        options = HarmonicOptions(harmonics=count)
        guess = solve_cycle(SECTION[omega_bar], spring, guess, options=options)
    return guess


# --- the spring's answer ------------------------------------------------------------------------

LAWS = [
    Hysteresis(1.0, 0.4),
    Hysteresis(0.5, 1.0, 0.2, 0.1),
    Freeplay(1.0, 0.1),
    Bilinear(0.25, 0.05, 0.25, 0.5),
    Table((-2.0, -0.5, 0.3, 1.0), (-1.5, -0.4, 0.2, 1.4)),
    Cubic(1.0, 3.0),
]


CUBIC = Cubic(1.0, 3.0)


def sampled(spring: Spring, Y: np.ndarray) -> Answer:
    """The answer of a law known only by its values."""
    return Sampled(Y, spring)


def random_motion(rng: np.random.Generator, top: int) -> np.ndarray:
    Y = (rng.normal(size=top + 1) + 1j * rng.normal(size=top + 1)) / np.arange(1, top + 2) ** 2
    Y[0] = Y[0].real
    return Y


@pytest.mark.parametrize("spring", LAWS, ids=lambda s: type(s).__name__)
def test_moment_is_that_of_the_motion_sample_by_sample(spring: Spring) -> None:
    # Sampling errs by kinks: an eighth of the squared step times the jump of the slope.
    # Large motions: a loop that meets no stop remembers its start, and any mean is an answer.
    samples = 1 << 13
    for seed in range(5):
        Y = 4.0 * random_motion(np.random.default_rng(seed), 5)
        y = waveform(Y, samples)
        moment, _ = respond(spring, np.tile(y, 2))
        expected = 2 * np.fft.rfft(moment[samples:])[:8] / samples
        expected[0] /= 2
        assert np.max(np.abs(answer(spring, Y).moment(8) - expected)) < 1e-5 * np.max(np.abs(Y))


@pytest.mark.parametrize("spring", LAWS, ids=lambda s: type(s).__name__)
@pytest.mark.parametrize("symmetric", [False, True])
def test_jacobian_is_the_derivative_of_the_residual(spring: Spring, symmetric: bool) -> None:
    balance = Balance(SECTION[0.8], spring, 5, symmetric)
    rng = np.random.default_rng(3)
    x = 0.3 * rng.normal(size=balance.unknowns)
    x[0], x[-2], x[-1] = 0.4, np.log(0.2), np.log(3.0)
    steps = 1e-6 * np.eye(x.size)
    rise = [balance.residual(x + h) - balance.residual(x - h) for h in steps]
    difference = np.array(rise).T / 2e-6
    assert np.max(np.abs(balance.jacobian(x) - difference)) < 1e-6 * np.max(np.abs(difference))


@given(st.floats(0.01, 0.99), st.floats(-0.9, 0.9))
def test_a_slider_that_never_moves_leaves_a_straight_line(share: float, place: float) -> None:
    """Amplitudes below ΔV/2 anywhere near the loop: slope one, whatever the memory came from."""
    spring = Hysteresis(1.0, 0.5)
    amplitude = share * spring.delta_v / 2
    given_back = answer(spring, np.array([place, -1j * amplitude]))
    assert given_back.slope(1)[0].real == pytest.approx(1.0, abs=1e-6)


# --- one harmonic is the describing function -----------------------------------------------------


@pytest.mark.parametrize(
    ("omega_bar", "spring"),
    [
        (0.8, Hysteresis(1.0, 0.2)),
        (0.2, Hysteresis(1.0, 1.0)),
        (0.2, Hysteresis(1.0, 1.0, 0.3, 0.2)),
        (0.2, Freeplay(1.0)),
        (0.2, Bilinear(0.25, 0.05, 0.25, 0.5)),
        (0.2, Cubic(1.0, 3.0)),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, Spring) else str(value),
)
def test_one_harmonic_is_the_describing_function(omega_bar: float, spring: Spring) -> None:
    """Two programs, two forms of N (closed, and integrated along the motion), to 1e-12."""
    df, family = curve(omega_bar, spring), SECTION[omega_bar]
    tried = 0
    for i in range(df.speed.size):
        A, B, U, k = df.amplitude[i], df.bias[i], df.speed[i], df.k[i]
        start = sinusoid(A, B, k * (1 + 1e-4), U * (1 + 1e-4))
        symmetric = spring.odd and B == 0.0
        balance = Balance(family, spring, 1, symmetric)
        at_kink = np.min(np.abs(spring.corners(B) - A), initial=np.inf) < 1e-9
        if balance.answer(balance.pack(start)).straight or at_kink:
            continue  # linear, or where Newton's method has two slopes to choose from
        try:
            cycle = solve_cycle(
                family, spring, start, hold="amplitude", symmetric=symmetric, options=ONE
            )
        except ConvergenceError:
            continue  # at a turn of the amplitude no other unknown is determined by it
        if abs(cycle.speed / U - 1) > 1e-3:
            continue  # beside a turn: the other cycle of this amplitude
        tried += 1
        assert cycle.first_harmonic == pytest.approx(A, rel=1e-12)
        assert cycle.speed == pytest.approx(U, rel=1e-12)
        assert cycle.omega == pytest.approx(k, rel=1e-12)
        assert cycle.Y[0].real == pytest.approx(B, abs=1e-12 * spring.scale)
    assert tried >= 7


# --- many harmonics are the exact cycle ----------------------------------------------------------

PLACES = [
    (0.8, Hysteresis(1.0, 0.2), 0.95),
    (0.2, Hysteresis(1.0, 1.0), 0.85),
    (0.2, Freeplay(1.0), 0.5),
]


@pytest.mark.parametrize(("omega_bar", "spring", "ratio"), PLACES, ids=["run14", "run103", "gap"])
def test_converges_to_the_exact_cycle_with_the_fifth_power(
    omega_bar: float, spring: Spring, ratio: float
) -> None:
    """F_k falls with k⁻², G with k⁻²: what is left out acts back with Σ k⁻⁶, that is H⁻⁵."""
    family = SECTION[omega_bar]
    counts = np.array([15, 21, 31, 41, 61, 81])
    cycles = [stable_cycle(omega_bar, spring, ratio, int(count)) for count in counts]
    exact = cycle_near(family, spring, cycles[-1].Y, cycles[-1].omega, cycles[-1].speed)
    assert exact.closure < 1e-12
    error = np.array([abs(cycle.period / exact.period - 1) for cycle in cycles])
    # the error of single counts scatters with where the switches fall: fit the whole
    order = -np.polyfit(np.log(counts), np.log(error), 1)[0]
    assert order > 4.0
    assert error[-1] < 1e-8


@pytest.mark.parametrize(("omega_bar", "spring", "ratio"), PLACES, ids=["run14", "run103", "gap"])
def test_hill_agrees_with_the_exact_multipliers(
    omega_bar: float, spring: Spring, ratio: float
) -> None:
    cycle = stable_cycle(omega_bar, spring, ratio, 61)
    family = SECTION[omega_bar]
    exact = cycle_near(family, spring, cycle.Y, cycle.omega, cycle.speed)
    found = multipliers(family, cycle, answer(spring, cycle.Y), symmetric=True)
    assert found.all.size == family.c.size
    assert found.error < 1e-3
    assert exact_distance(found.all, exact) < 2 * found.error_of_all


@pytest.mark.parametrize(
    ("spring", "law"),
    [(Freeplay(1.0, 0.1), answer), (LAWS[4], answer), (CUBIC, answer), (CUBIC, sampled)],
)
def test_multipliers_are_those_of_the_variational_equation(
    spring: Spring, law: Callable[[Spring, np.ndarray], Answer]
) -> None:
    """v' = (A - F'(y) b c) v by DOP853 along a motion that is no cycle: no multiplier is one.

    Its steps are kept below a thousandth of the period where the slope jumps.
    """
    family, omega, speed = SECTION[0.8], 0.3, 3.5
    Y = 2.0 * random_motion(np.random.default_rng(2), 4)
    A, b = family.stack(speed)
    ks = np.arange(Y.size)

    def rate(time: float, v: np.ndarray) -> np.ndarray:
        y = float((Y @ np.exp(1j * ks * omega * time)).real)
        slope = float(spring.moment(y + 1e-6) - spring.moment(y - 1e-6)) / 2e-6
        v = v.reshape(6, 6)
        return (A @ v - slope * np.outer(b, family.c @ v)).ravel()

    period = 2 * np.pi / omega
    end = solve_ivp(
        rate, (0.0, period), np.eye(6).ravel(), "DOP853", rtol=1e-9, atol=1e-10,
        max_step=period / 1000,
    ).y[:, -1]  # fmt: skip
    wanted = np.linalg.eigvals(end.reshape(6, 6))
    found = multipliers(family, Cycle(Y, omega, speed), law(spring, Y), symmetric=False).all
    apart = np.min(np.abs(found[:, None] - wanted), axis=1)
    assert np.max(apart) < 2e-5 * np.max(np.abs(wanted))
    assert np.min(np.abs(wanted - 1.0)) > 1e-2


@pytest.mark.parametrize("symmetric", [True, False])
def test_a_memory_that_is_held_enters_the_multipliers(symmetric: bool) -> None:
    """Below A = D + δ the slider turns back on its flats."""
    family, spring = SECTION[0.8], Hysteresis(1.0, 0.2)
    df = curve(0.8, spring)
    i = int(np.argmin(np.abs(df.amplitude - 0.57)))
    guess = sinusoid(df.amplitude[i], 0.0, df.k[i], df.speed[i])
    for count in (1, 7, 61):
        guess = solve_cycle(
            family, spring, guess, hold="amplitude", options=HarmonicOptions(harmonics=count)
        )
    assert answer(spring, guess.Y).held.at.size
    exact = cycle_near(family, spring, guess.Y, guess.omega, guess.speed)
    found = multipliers(family, guess, answer(spring, guess.Y), symmetric=symmetric)
    assert exact_distance(found.all, exact) < 1e-4


def exact_distance(found: np.ndarray, exact: ExactCycle) -> float:
    """Distance of the two largest proper multipliers from the nearest exact ones."""
    return max(float(np.min(np.abs(exact.multipliers - root))) for root in found[1:3])


def test_stability_is_said_to_be_uncertain_beside_grazing() -> None:
    """Run 103 has a fold at 0.6789 beside two changes of its switching sequence (Chung 2009)."""
    branch = run103_branch()
    off = [
        i
        for i in range(branch.speed.size)
        if branch.certain[i] and branch.stable[i] != stable_exactly(branch, i)
    ]
    assert off == []
    assert not branch.certain.all()


@cache
def run103_branch() -> HarmonicBranch:
    start = stable_cycle(0.2, Hysteresis(1.0, 1.0), 0.75, 31)
    options = HarmonicOptions(
        harmonics=31, speed_ratio_range=(0.6, 0.76), max_step=0.2, max_states=30
    )
    return continue_branch(SECTION[0.2], Hysteresis(1.0, 1.0), start, options)


def stable_exactly(branch: HarmonicBranch, i: int) -> bool:
    cycle = branch.cycles[i]
    try:
        exact = cycle_near(SECTION[0.2], Hysteresis(1.0, 1.0), cycle.Y, cycle.omega, cycle.speed)
    except ConvergenceError:  # Newton's method leaves a fold
        return bool(branch.stable[i])
    near = abs(exact.period / cycle.period - 1) < 1e-3
    return exact.stable if near else bool(branch.stable[i])


def test_run14_branch_has_the_exact_fold() -> None:
    case = load_case("run14")
    branch = harmonic_balance(
        case.family(), case.spring, HarmonicOptions(max_step=0.2, speed_ratio_range=(0.5, 0.99))
    )
    assert branch.converged
    assert branch.onset.kind == "fold"
    # event-exact fold, 0.92151328; a truncation of 1e-5 acts back in the second order
    assert branch.onset.speed_ratio == pytest.approx(0.92151328, abs=1e-8)
    assert branch.onset.stable
    upper = branch.amplitude > 1.1 * branch.onset.amplitude
    assert branch.stable[upper].all()


# --- the cubic spring ----------------------------------------------------------------------------


def test_lee_jiang_and_wong_1999_beta3_3() -> None:
    """Amplitudes near 11.4°, 16.4°, 20.4°, k near 0.0830, 0.0820, 0.0810, read off figures.

    Read off, so to a third of a degree and half a unit of the last digit of k.
    """
    published = {1.05: (11.4, 0.0830), 1.10: (16.4, 0.0820), 1.15: (20.4, 0.0810)}
    for ratio, (amplitude, k) in published.items():
        cycle = stable_cycle(0.2, Cubic(1.0, 3.0), ratio, 9)
        low, high = answer(Cubic(1.0, 3.0), cycle.Y).extremes
        assert np.degrees(0.5 * (high - low)) == pytest.approx(amplitude, abs=0.35)
        assert cycle.omega == pytest.approx(k, abs=5e-4)


@cache
def beta3_80(harmonics: int) -> HarmonicBranch:
    options = HarmonicOptions(
        harmonics=harmonics, speed_ratio_range=(0.9, 3.0), max_step=0.1, largest=2.0
    )
    return harmonic_balance(SECTION[0.2], Cubic(1.0, 80.0), options)


def breaks(branch: HarmonicBranch) -> list[float]:
    return [
        event.speed_ratio
        for event in branch.bifurcations
        if event.kind in ("fold", "symmetry-breaking", "neimark-sacker")
    ]


def test_liu_and_dowell_2004_secondary_bifurcation() -> None:
    """β₃ = 80: nine harmonics find the secondary bifurcation near U/U_L = 2, one does not.

    It is a pair of folds with a jump either way between them; "near" is all that their figures
    say, so the pair has to enclose 2 within 1.8 and 2.5 (Liu & Dowell 2004).
    """
    lower, upper = sorted(breaks(beta3_80(9)))
    assert 1.8 < lower < 2.0 < upper < 2.5
    assert breaks(beta3_80(1)) == []


def test_one_harmonic_is_poor_for_beta3_80_above_1_25() -> None:
    def first(ratio: float, harmonics: int) -> float:
        return stable_cycle(0.2, Cubic(1.0, 80.0), ratio, harmonics).first_harmonic

    below, above = (abs(first(r, 1) / first(r, 9) - 1) for r in (1.02, 1.4))
    assert below < 0.01
    assert above > 5 * below


def test_scaling_a_cubic_scales_its_cycles() -> None:
    """β₃ → 100 β₃ is α → α/10: the same curve, ten times smaller."""
    small, large = (stable_cycle(0.2, Cubic(1.0, beta), 1.1, 15) for beta in (300.0, 3.0))
    assert np.max(np.abs(10 * small.Y - large.Y)) < 1e-9 * abs(large.Y[1])


# --- symmetry, and its loss ----------------------------------------------------------------------


def test_general_and_symmetric_equations_agree_on_symmetric_cycles() -> None:
    cycle = stable_cycle(0.8, Hysteresis(1.0, 0.2), 0.95, 15)
    general = solve_cycle(
        SECTION[0.8],
        Hysteresis(1.0, 0.2),
        cycle,
        options=HarmonicOptions(harmonics=15),
        symmetric=False,
    )
    assert np.max(np.abs(general.Y - cycle.Y)) < 1e-10 * abs(cycle.Y[1])


def test_only_a_symmetry_breaking_has_asymmetric_branches() -> None:
    branch = beta3_80(9)
    with pytest.raises(InputError, match="symmetry-breaking"):
        asymmetric_branch(SECTION[0.2], Cubic(1.0, 80.0), branch, branch.bifurcations[0])


@settings(max_examples=15)
@given(st.floats(0.2, 5.0))
def test_piecewise_linear_cycles_are_scale_free(factor: float) -> None:
    spring = Hysteresis(1.0, 0.2)
    cycle = stable_cycle(0.8, spring, 0.95, 7)
    scaled = solve_cycle(
        SECTION[0.8],
        spring.scaled(factor),
        Cycle(1.001 * factor * cycle.Y, cycle.omega, cycle.speed),
        options=HarmonicOptions(harmonics=7),
    )
    assert np.max(np.abs(scaled.Y / factor - cycle.Y)) < 1e-10 * abs(cycle.Y[1])


# --- options and failures ------------------------------------------------------------------------


def test_bad_options_are_named() -> None:
    with pytest.raises(InputError) as caught:
        HarmonicOptions(harmonics=0, tolerance=-1.0, max_step=np.nan, speed_ratio_range=(2, 1))
    assert {problem.split(":")[0] for problem in caught.value.problems} == {
        "harmonics", "tolerance", "max_step", "speed_ratio_range",
    }  # fmt: skip


def test_too_few_harmonics_say_how_much_they_leave_out() -> None:
    guess = stable_cycle(0.2, Freeplay(1.0), 0.5, 7)
    options = HarmonicOptions(max_harmonics=9, tolerance=1e-9)
    with pytest.raises(ConvergenceError, match="leave out") as caught:
        solve_cycle(SECTION[0.2], Freeplay(1.0), guess, options=options)
    assert isinstance(caught.value.partial, Cycle)


def test_what_to_hold_is_speed_or_amplitude() -> None:
    with pytest.raises(InputError, match="hold"):
        solve_cycle(SECTION[0.2], Freeplay(1.0), sinusoid(1.0, 0.0, 0.1, 3.0), hold="k")


@pytest.mark.parametrize(("run", "tori"), [("run6", 1), ("run14", 0)])
def test_only_a_complex_pair_on_the_unit_circle_is_neimark_sacker(run: str, tori: int) -> None:
    """A pair passes the product one on either branch; run 14's is real, a neutral saddle."""
    case = load_case(run)
    branch = harmonic_balance(case.family(), case.spring, HarmonicOptions(harmonics=9))
    products = []
    for row in branch.multipliers:
        others = row[np.isfinite(row)][1:]
        i, j = np.triu_indices(others.size, 1)
        products.append(np.prod(1 - others[i] * others[j]).real)
    assert min(products) < -1e-4 < 1e-4 < max(products)
    assert sum(event.kind == "neimark-sacker" for event in branch.bifurcations) == tori


@given(seed=st.integers(0, 10**6), slack=st.floats(0.1, 3.0))
@settings(max_examples=30)
def test_play_answers_as_the_loop_without_stops_that_it_is(seed: int, slack: float) -> None:
    """Against memory carried round sample by sample; derivatives against differences."""
    rng = np.random.default_rng(seed)
    H = int(rng.integers(1, 9))
    Y = (rng.standard_normal(H + 1) + 1j * rng.standard_normal(H + 1)) / np.arange(1, H + 2) ** 2
    Y[0] = Y[0].real
    law = Play(slack)
    found = answer(law, Y)
    sampled = Sampled(Y, law).moment(12)
    assert found.moment(12) == pytest.approx(sampled, abs=2e-5)  # 2048 samples miss the extrema
    ks, step = np.arange(H + 1), 1e-6
    J, place = found.derivative(ks), int(rng.integers(H + 1))
    if found.margin < 100 * step:
        return
    for column, change in ((place, step), (place + H + 1, 1j * step)):
        if place == 0 and column:
            continue  # the mean is real
        shift = np.zeros(H + 1, dtype=complex)
        shift[place] = change
        ahead, behind = (answer(law, Y + s).moment(H + 1) for s in (shift, -shift))
        by = (ahead - behind) / (2 * step)
        assert np.concatenate((by.real, by.imag)) == pytest.approx(J[:, column], abs=1e-6)


def test_multipliers_of_play_are_those_of_the_exact_cycle() -> None:
    """Thirty-one harmonics leave 1e-3 of them."""
    family = SectionFamily(TypicalSection(omega_bar=0.8))
    law = Play(np.radians(1.0))
    branch = harmonic_balance(family, law, HarmonicOptions(harmonics=31))
    cycle = branch.cycles[len(branch.cycles) // 2]
    near = cycle_near(family, law, cycle.Y, cycle.omega, cycle.speed)
    sizes, exact = (np.sort(np.abs(one.multipliers))[::-1][:3] for one in (cycle, near))
    assert sizes == pytest.approx(exact, rel=2e-3)
    assert exact[0] > 1.05
