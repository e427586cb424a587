"""Lyapunov exponents and verdicts: identities, closed forms, other methods, published bands."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st

from aeroflutter import (
    Cubic,
    Freeplay,
    Hysteresis,
    InputError,
    Linear,
    LureSystem,
    SectionFamily,
    Table,
    TypicalSection,
)
from aeroflutter.linear.rootlocus import flutter_speed
from aeroflutter.motion._kernel_roots import REVERSAL
from aeroflutter.motion.chaos import Band, ChaosOptions, Edge, band_edge, chaos, chaos_scan
from aeroflutter.motion.chaos.exact import ExactEngine
from aeroflutter.motion.chaos.growth import Landing, first_tangents
from aeroflutter.motion.chaos.smooth import SmoothEngine, slope_law
from aeroflutter.motion.chaos.verdict import recurrence
from aeroflutter.motion.exponents import measured, of_eigenvalues
from aeroflutter.motion.flow import Flow
from aeroflutter.motion.march import March
from aeroflutter.motion.response import Initial, SimulateOptions, simulate
from aeroflutter.motion.tangents import Tangents

DEGREE = np.pi / 180
FAMILY = SectionFamily(TypicalSection(omega_bar=0.2))
FLUTTER = flutter_speed(FAMILY)
FREEPLAY = Freeplay(0.5 * DEGREE)
SEVEN = Initial(alpha=7 * DEGREE)
SHORT = ChaosOptions(cycles=4000)


def at(ratio):
    return FAMILY.at(ratio * FLUTTER)


def landing(x, memory=0.0):
    """A state from which to follow a motion, wherever it goes."""
    nan = float("nan")
    return Landing(
        state="undecided", reason="", loops=0, period=nan, multiplier=nan, rest=nan,
        state_vector=np.array(x, dtype=float), memory=memory,
    )  # fmt: skip


def carried(prepared, x, memory, tangents, count):
    """Tangents after `count` maxima, undone of their scaling, and the time."""
    n, k = x.size, tangents.shape[1]
    columns = []
    for i in range(k):
        march = March(prepared, prepared.begin(x, memory), tangents=tangents[:, i : i + 1])
        _, times, _, logs = Tangents(march, np.ones(n + 1)).over(count)
        assert times.size == count
        columns.append(march.motion.tangents[:, 0] * np.exp(logs[-1, 0]))
    return np.array(columns).T, times[-1]


def marched(prepared, x, memory, time, events=500):
    """The motion after a time."""
    march = March(prepared, prepared.begin(x, memory), events=events)
    march.run(time)
    return march


# The variational flow -------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("spring", "ratio", "alpha", "reversals"),
    [
        (FREEPLAY, 0.3, 7 * DEGREE, False),
        (Hysteresis(0.4, 1.0), 0.7, 6.0, False),
        (Hysteresis(0.2, 1.0), 0.4, 6.0, True),
        (Hysteresis(0.2, 1.0), 0.5, -2.0, True),
    ],
    ids=["freeplay", "run 102", "run 101", "run 101 from below"],
)
def test_tangents_are_the_derivative_of_the_flow(spring, ratio, alpha, reversals):
    # Central differences of the exact flow over the time of some maxima, through many switches
    # and memories: h = alpha - V is taken up where pitch turns back on a flat, and released
    # later. Their error is round-off over the step, some 1e-9 of the growth.
    prepared = Flow(at(ratio), [spring])
    x, memory = Initial(alpha=alpha).start(at(ratio), spring)
    n, step = x.size, 1e-6 * np.abs(x).max()
    tangents, time = carried(prepared, x, memory, np.eye(n + 1)[:, :n], 12)

    def end(moved):
        march = marched(prepared, moved, memory, time)
        return march.point().x, march.events()[:, 1]

    turned = np.flatnonzero(end(x.copy())[1] == REVERSAL)
    assert (turned.size > 0 and turned[0] < end(x.copy())[1].size - 1) == reversals
    for i in range(n):
        shift = step * np.eye(n)[i]
        numeric = (end(x + shift)[0] - end(x - shift)[0]) / (2 * step)
        allowed = 1e-7 * np.abs(tangents).max()
        np.testing.assert_allclose(tangents[:n, i], numeric, rtol=0, atol=allowed)


def test_direction_of_the_flow_is_carried_into_itself():
    # d/dt of x' = f(x) is the variational equation: f(x(t)) = Phi f(x(0)), for any spring.
    system, prepared = at(0.3), Flow(at(0.3), [FREEPLAY])
    x = chaos(system, FREEPLAY, SEVEN, ChaosOptions(cycles=80)).final_state

    def rate(state):
        return system.A @ state - system.b * FREEPLAY.moment(system.c @ state)

    begin = np.append(rate(x), 0.0)[:, None]
    tangents, time = carried(prepared, x, 0.0, begin, 8)
    end = marched(prepared, x, 0.0, time).point().x
    np.testing.assert_allclose(tangents[:6, 0], rate(end), rtol=0, atol=1e-12)


# Closed forms ---------------------------------------------------------------------------------


@pytest.mark.parametrize("ratio", [0.9, 1.03])
def test_linear_section_grows_at_the_real_part_of_its_root(ratio):
    # Between two maxima of the leading mode its plane is multiplied by exp(Re p T), both ways
    # alike; other modes have died out in the transient.
    system = at(ratio)
    growth = ExactEngine.of(system, Linear()).grow(landing([0, 1, 0, 0, 0, 0]), 200, 100, 2)
    found = measured(growth.time, growth.logs, 4)
    exact = np.linalg.eigvals(system.closed(1.0)).real.max()
    assert abs(exact) > 1e-4
    np.testing.assert_allclose(found.values, exact, rtol=1e-9)


def test_all_exponents_add_up_to_the_trace():
    # Liouville: c b = 0 for the section, so the trace of A - k b c is that of A on every piece.
    found = chaos(at(0.3), FREEPLAY, SEVEN, ChaosOptions(cycles=2000, exponents=6))
    assert found.verdict == "chaotic"
    assert found.exponents.values.sum() == pytest.approx(np.trace(at(0.3).A), rel=1e-9)
    assert np.all(np.diff(found.exponents.values) < 0)


def test_direction_of_the_flow_has_no_exponent():
    # A chaotic motion of an autonomous system has one exponent that is exactly zero.
    found = chaos(at(0.29), FREEPLAY, SEVEN).exponents
    assert abs(found.values[1]) <= found.error[1] < 0.01 * found.values[0]


def test_motion_at_rest_has_the_exponents_of_its_branch():
    found = chaos(at(0.12), FREEPLAY, SEVEN)
    assert (found.verdict, found.amplitude) == ("damped", 0.0)
    roots = np.sort(np.linalg.eigvals(at(0.12).closed(0.0)).real)[::-1]
    np.testing.assert_allclose(found.exponents.values, roots[:3], atol=1e-14)
    away = chaos(at(1.05), FREEPLAY, SEVEN)
    assert away.verdict == "divergent"
    top = np.linalg.eigvals(at(1.05).closed(1.0)).real.max()
    assert away.exponents.values[0] == pytest.approx(top)


# Two methods ----------------------------------------------------------------------------------


@pytest.mark.parametrize("ratio", [0.2, 0.24, 0.39])
def test_exponents_of_a_cycle_are_its_multipliers(ratio):
    # Real leading multiplier: lambda_1 = 0 and lambda_2 = log|mu_2|/T, by Newton and its Jacobian.
    found = chaos(at(ratio), FREEPLAY, SEVEN, SHORT)
    assert found.verdict == "periodic"
    assert abs(found.exponents.values[0]) < 1e-11
    assert found.exponents.values[1] == pytest.approx(found.floquet, rel=1e-6)


def test_exponents_of_the_published_cycle_of_run_103():
    # Chung, He & Lee 2009 at 0.85: period 82.78, multipliers 0.0955 ± 0.1477 i; their modulus is
    # good to the 0.3 % by which two event-exact computations differ from the print.
    found = chaos(at(0.85), Hysteresis(1.0, 1.0), Initial(alpha=6.0), SHORT)
    assert found.period == pytest.approx(82.78, rel=1e-3)
    pair = found.exponents.values[1:3].mean()
    assert np.exp(pair * found.period) == pytest.approx(math.hypot(0.0955, 0.1477), rel=3e-3)
    assert pair == pytest.approx(found.floquet, rel=1e-9)


def two_trajectories(system, spring, state, memory, windows, window, apart=1e-9):
    """Largest exponent by two neighbours, brought together again after every window: Benettin."""
    prepared, n = Flow(system, [spring]), state.size
    size = np.abs(state).max()
    direction = np.append(np.random.default_rng(1).standard_normal(n), 0.0)
    gains, z = [], np.append(state, memory)
    for _ in range(windows):
        pair = [z, z + apart * size * direction / np.linalg.norm(direction)]
        for k, (*x, h) in enumerate(pair):
            end = marched(prepared, np.array(x), h, window, events=0).point()
            pair[k] = np.append(end.x, end.memory)
        z, direction = pair[0], pair[1] - pair[0]
        gains.append(np.log(np.linalg.norm(direction) / (apart * size)) / window)
    blocks = np.array(gains[len(gains) // 10 :]).reshape(18, -1).mean(axis=1)
    return blocks.mean(), 2.1 * blocks.std(ddof=1) / np.sqrt(18)


@pytest.mark.parametrize(
    ("spring", "ratio", "alpha"),
    [
        (FREEPLAY, 0.27, 7 * DEGREE),
        (FREEPLAY, 0.29, 7 * DEGREE),
        (FREEPLAY, 0.32, 7 * DEGREE),
        (Hysteresis(0.2, 1.0), 0.56, -2.0),
        (Hysteresis(0.2, 1.0), 0.64, -2.0),
    ],
)
def test_two_neighbouring_trajectories_part_at_the_exponent(spring, ratio, alpha):
    # Two runs of a chaotic motion differ, so the estimates can only agree within their errors.
    found = chaos(at(ratio), spring, Initial(alpha=alpha), ChaosOptions(cycles=8000))
    assert found.verdict == "chaotic"
    start = found.final_state, found.final_memory
    other, spread = two_trajectories(at(ratio), spring, *start, 4000, 40.0)
    assert other == pytest.approx(found.exponents.values[0], abs=spread + found.exponents.error[0])
    assert other > 5 * spread


def rounded(width):
    """The freeplay with corners rounded by softplus over `width` of the gap."""

    class Rounded(Freeplay):
        kind = "rounded"

        def moment(self, alpha, memory=0.0):
            w, half = width * self.gap, self.gap / 2
            y = np.asarray(alpha, dtype=float)
            return w * (np.logaddexp(0, (y - half) / w) - np.logaddexp(0, (-y - half) / w))

    return Rounded(FREEPLAY.gap)


def test_dop853_tends_to_the_exact_tangents_as_the_corners_sharpen():
    # Rounding the corners over w changes what the spring has done across one by O(w²), both in
    # the motion and in its tangents; over some oscillations that is the order seen.
    system = at(0.3)
    x = Initial(alpha=0.4 * DEGREE, xi=0.005).vector(system)
    first = np.append(np.linalg.qr(first_tangents(6, 1))[0], [[0.0]], axis=0)
    tangents, time = carried(Flow(system, [FREEPLAY]), x, 0.0, first, 4)
    exact = np.log(np.linalg.norm(tangents))
    widths, errors = np.array([0.01, 0.005, 0.0025]), []
    for width in widths:
        one_window = dataclasses.replace(landing(x), period=time, loops=1)
        growth = SmoothEngine(system, rounded(width)).grow(one_window, 1, 0, 1)
        errors.append(abs(growth.logs[-1, 0] - exact))
    assert np.polyfit(np.log(widths), np.log(errors), 1)[0] == pytest.approx(2.0, abs=0.1)


@pytest.mark.slow
def test_smoothed_spring_on_dop853_has_the_same_exponents():
    # Corners rounded over 1 % of the gap: another engine, other variational equations.
    system, spring = at(0.3), rounded(0.01)
    exact = chaos(system, FREEPLAY, SEVEN)
    growth = SmoothEngine(system, spring).grow(landing(exact.final_state), 2000, 50, 2)
    found = measured(growth.time, growth.logs, 20)
    assert found.values[0] > 3 * found.error[0]
    allowed = found.error + exact.exponents.error[:2]
    assert np.all(np.abs(found.values - exact.exponents.values[:2]) <= allowed)


class Straight(Freeplay):
    """A law that nothing else is known of, though it is a straight line."""

    kind = "straight"

    def moment(self, alpha, memory=0.0):
        return np.asarray(alpha, dtype=float)


@pytest.mark.parametrize("law", [Cubic(1.0, 0.0), None], ids=["series", "dop853"])
def test_exponents_of_a_linear_spring_are_its_roots(law):
    system = at(0.9)
    engine = SmoothEngine(system, law or Straight(0.01))
    growth = engine.grow(landing([0, 0.1, 0, 0, 0, 0]), 40, 80, 2)
    found = measured(growth.time, growth.logs, 4)
    exact = np.linalg.eigvals(system.closed(1.0)).real.max()
    # Within a window that is no period the two leading directions turn: their mean does not.
    tolerance = 1e-6 if law is None else 1e-10  # of DOP853 at 1e-9 and of the series
    assert found.values.mean() == pytest.approx(exact, rel=tolerance)


def test_cycle_of_a_cubic_spring():
    found = chaos(
        at(1.1), Cubic(1.0, 3.0), Initial(alpha=0.2), ChaosOptions(cycles=40, transient=20)
    )
    assert (found.name, found.engine) == ("period-1", "smooth")
    assert abs(found.exponents.values[0]) <= found.exponents.error[0]
    assert found.exponents.values[1] < -found.exponents.error[1]
    assert slope_law(Cubic(1.0, 3.0))(0.5) == 1.0 + 9.0 * 0.25


# Published bands ------------------------------------------------------------------------------


@pytest.mark.parametrize("ratio", [0.14, 0.16, 0.18, 0.20, 0.22])
def test_freeplay_has_limit_cycles_where_price_et_al_have_them(ratio):
    # Price, Alighanbari & Lee 1995, freeplay of 0.5 deg from 7 deg: limit cycles at 0.14-0.22.
    found = chaos(at(ratio), FREEPLAY, SEVEN, SHORT)
    assert found.verdict == "periodic"
    assert abs(found.exponents.values[0]) <= found.exponents.error[0] < 2e-4


@pytest.mark.parametrize("ratio", [0.29, 0.30, 0.31, 0.32])
def test_freeplay_is_chaotic_where_price_et_al_have_chaos(ratio):
    found = chaos(at(ratio), FREEPLAY, SEVEN, SHORT)
    assert found.verdict == "chaotic"
    assert found.exponents.values[0] > 3 * found.exponents.error[0]
    assert 2.0 < found.exponents.dimension < 3.0


def test_double_scroll_of_chuas_circuit():
    # Matsumoto, Chua & Komuro 1985 (IEEE Trans. Circuits Syst. 32, 797), 1/C1 = 9, 1/C2 = 1,
    # 1/L = 7, G = 0.7, slopes -0.8 and -0.5: one positive, one zero and one negative exponent,
    # and a dimension between 2 and 3. Here c b is not zero: the spring acts on the rate of y.
    A = np.array([[-6.3, 6.3, 0.0], [0.7, -0.7, 1.0], [0.0, -7.0, 0.0]])
    circuit = LureSystem(A, np.array([9.0, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]))
    diode = Table((-2.0, -1.0, 1.0, 2.0), (1.3, 0.8, -0.8, -1.3))
    start = Initial(state=[0.1, 0.0, 0.0])
    found = chaos(circuit, diode, start)
    exponents = found.exponents
    assert found.verdict == "chaotic"
    assert exponents.values[0] > 10 * exponents.error[0]
    assert abs(exponents.values[1]) <= exponents.error[1] < 1e-3
    assert 2.0 < exponents.dimension < 3.0
    # The sum is the mean divergence, known from the time spent on the inner slope.
    run = simulate(circuit, diode, start, SimulateOptions(duration=2e4, dt=0.05, decide=False))
    inner = np.mean(np.abs(run.pitch[2000:]) < 1.0)
    divergence = np.trace(A) + 9.0 * (0.8 * inner + 0.5 * (1.0 - inner))
    assert abs(exponents.values.sum() - divergence) <= exponents.error.sum()
    assert exponents.error.sum() < 0.02


def test_chua_circuit_with_a_cubic_diode_is_chaotic():
    A = np.array([[0.0, 10.0, 0.0], [1.0, -1.0, 1.0], [0.0, -16.0, 0.0]])
    circuit = LureSystem(A, np.array([10.0, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]))
    diode, start = Cubic(-0.143, 1.0), Initial(state=[0.1, 0.0, 0.0])
    found = chaos(circuit, diode, start, ChaosOptions(cycles=4000))
    exponents = found.exponents
    assert (found.verdict, found.engine) == ("chaotic", "smooth")
    assert abs(exponents.values[1]) <= exponents.error[1]
    # The sum of all three is the mean divergence of the flow, tr A - b c F'.
    run = simulate(circuit, diode, start, SimulateOptions(duration=2e4, dt=0.05, decide=False))
    divergence = np.trace(A) - 10.0 * (-0.143 + 3.0 * np.mean(run.pitch[2000:] ** 2))
    assert abs(exponents.values.sum() - divergence) <= exponents.error.sum()
    assert exponents.error.sum() < 0.02 * abs(divergence)


def damped_scan(ratios, *keys):
    """Freeplay with a tenth of the critical damping, over ratios to the undamped flutter speed."""
    family = SectionFamily(TypicalSection(omega_bar=0.2, **dict.fromkeys(keys, 0.1)))
    return chaos_scan(lambda r: family.at(r * FLUTTER), ratios, FREEPLAY, SEVEN, SHORT)


@pytest.mark.parametrize("keys", [("zeta_alpha",), ("zeta_xi",), ("zeta_alpha", "zeta_xi")])
def test_structural_damping_of_a_tenth_removes_the_chaos(keys):
    scan = damped_scan(np.arange(0.24, 0.3401, 0.01), *keys)
    assert "chaotic" not in scan.verdicts
    assert np.all(scan.exponents[:, 0] <= scan.errors[:, 0])


def test_damping_in_pitch_alone_leaves_a_narrow_band_at_lower_speed():
    scan = damped_scan([0.195, 0.2075, 0.215], "zeta_alpha")
    assert scan.verdicts == ("periodic", "chaotic", "periodic")


@pytest.mark.parametrize(("delta_v", "delta_h"), [(1.0, 1.0), (1.0, 0.2)], ids=["103", "111"])
def test_wide_loops_have_no_chaos(delta_v, delta_h):
    ratios = np.linspace(0.7, 0.98, 15)
    scan = chaos_scan(at, ratios, Hysteresis(delta_v, delta_h), Initial(alpha=6.0), SHORT)
    assert set(scan.verdicts) == {"damped", "periodic"}


# Verdicts, errors, scans ----------------------------------------------------------------------


@settings(max_examples=5)
@given(power=st.integers(-20, 20))
def test_exponents_do_not_depend_on_the_size_of_the_spring(power):
    # A power of two scales every number of the motion without rounding.
    factor = 2.0**power
    options = ChaosOptions(cycles=200, transient=50)
    one = chaos(at(0.3), FREEPLAY, SEVEN, options)
    other = chaos(at(0.3), FREEPLAY.scaled(factor), Initial(alpha=7 * DEGREE * factor), options)
    np.testing.assert_array_equal(one.exponents.values, other.exponents.values)
    np.testing.assert_array_equal(one.section.pitch * factor, other.section.pitch)


def test_verdict_is_that_of_what_comes_after_a_transient(monkeypatch):
    # As if the end state had been missed the first time: the motion is looked at again.
    land, calls = ExactEngine.land, []

    def hasty(engine, state, memory):
        calls.append(memory)
        found = land(engine, state, memory)
        return found if len(calls) > 1 else dataclasses.replace(found, state="aperiodic", loops=0)

    monkeypatch.setattr(ExactEngine, "land", hasty)
    found = chaos(at(0.2), FREEPLAY, SEVEN, ChaosOptions(cycles=400, transient=100))
    assert (found.name, len(calls)) == ("period-1", 2)
    assert found.transient == 100 + 400 + 100


def test_torus_is_quasi_periodic():
    # Two undamped oscillators of frequencies 1 and sqrt(2), seen through their sum, no spring.
    A = scipy.linalg.block_diag([[0.0, 1.0], [-1.0, 0.0]], [[0.0, 1.0], [-2.0, 0.0]])
    system = LureSystem(A, np.array([0.0, 1.0, 0.0, 1.0]), np.array([1.0, 0.0, 1.0, 0.0]))
    found = chaos(system, Linear(0.0), Initial(state=[1, 0, 0.6, 0]), ChaosOptions(cycles=1000))
    assert found.verdict == "quasi-periodic"
    assert np.all(np.abs(found.exponents.values) <= found.exponents.error)


def test_stated_error_covers_polynomial_growth_and_trends():
    time = np.arange(1.0, 2001.0)
    shear = measured(time, np.log1p(time)[:, None], 20)
    assert 0 < shear.values[0] <= shear.error[0]
    steady = measured(time, 0.3 * time[:, None], 20)
    assert steady.values[0] == pytest.approx(0.3, rel=1e-12)
    assert steady.statistical[0] < 1e-12
    faster = measured(time, 1e-3 * time[:, None] ** 2, 20)
    assert faster.error[0] >= abs(faster.drift[0]) > 0.9


def test_stated_error_of_noise_holds_the_truth_at_its_confidence():
    # Independent gains: the 95 % interval of 20 block means must miss in about one case of 20.
    rng = np.random.default_rng(5)
    time = np.arange(1.0, 401.0)
    misses = 0
    for _ in range(400):
        found = measured(time, np.cumsum(0.1 + rng.standard_normal(400))[:, None], 20)
        misses += abs(found.values[0] - 0.1) > found.statistical[0]
    assert 0.02 < misses / 400 < 0.09


def test_dimension_of_kaplan_and_yorke():
    def dimension(*values):
        return of_eigenvalues(np.diag(values), len(values)).dimension

    assert dimension(0.5, 0.0, -1.0) == pytest.approx(2.5)
    assert dimension(0.0, -1.0) == pytest.approx(1.0)
    assert dimension(-1.0, -2.0) == 0.0
    assert math.isnan(dimension(1.0, 0.0))


def test_recurrence_of_returns():
    theta = np.arange(4000)[:, None]
    assert recurrence(np.cos(2 * np.pi * theta / 7)) == 7
    assert recurrence(np.cos(theta)) == 0
    assert recurrence(np.empty((0, 3))) == 0
    noise = 1e-17 * np.random.default_rng(2).standard_normal(theta.shape)  # y' at a maximum
    assert recurrence(np.hstack((np.cos(2 * np.pi * theta / 7), noise))) == 7


@pytest.mark.parametrize(
    ("delta_v", "ratio", "alpha", "loops"), [(0.05, 0.4025, 6.0, 18), (0.0, 0.2507, 14.0, 32)]
)
def test_long_periods_after_a_chaotic_transient(delta_v, ratio, alpha, loops):
    # Beyond the 16 loops of the end state's search, and in the first case after some hundred
    # oscillations of chaos that would spoil the exponents: they are measured again after it.
    options = ChaosOptions(cycles=2000)
    found = chaos(at(ratio), Hysteresis(delta_v, 1.0), Initial(alpha=alpha), options)
    assert (found.verdict, found.loops) == ("periodic", loops)
    assert abs(found.exponents.values[0]) <= found.exponents.error[0] < 5e-4


def test_slow_approach_to_a_cycle_is_not_quasi_periodic():
    # A symmetry breaks next to 0.2511: the cycle attracts with an exponent of some -1e-5 only.
    found = chaos(at(0.2511), FREEPLAY, SEVEN, ChaosOptions(cycles=2000))
    assert found.verdict in ("periodic", "undecided")


def test_bands_and_their_edges():
    scan = chaos_scan(at, [0.24, 0.28, 0.30, 0.34], FREEPLAY, SEVEN, ChaosOptions(cycles=1000))
    (band,) = scan.bands
    assert band == Band(0.28, 0.30, Edge(0.24, 0.28), Edge(0.34, 0.30))
    edge = band_edge(at, band.upper, FREEPLAY, SEVEN, ChaosOptions(cycles=1000), steps=5)
    assert abs(edge.outside - edge.inside) == pytest.approx(0.04 / 32)
    assert 0.32 < edge.inside < edge.outside < 0.34
    with pytest.raises(InputError, match="values"):
        chaos_scan(at, [], FREEPLAY)


def test_following_stays_with_its_attractor():
    # Mirror images of a cycle that is not symmetric: followed, the side stays the same.
    ratios = np.linspace(0.35, 0.40, 11)
    scan = chaos_scan(at, ratios, FREEPLAY, SEVEN, SHORT, follow=True)
    sides = {np.sign(result.bias) for result in scan.results}
    assert set(scan.verdicts) == {"periodic"}
    assert len(sides) == 1


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"blocks": 3}, "blocks"),
        ({"cycles": 39}, "cycles"),
        ({"transient": -1}, "transient"),
        ({"exponents": 0}, "exponents"),
    ],
)
def test_options_out_of_range_are_named(change, word):
    with pytest.raises(InputError, match=word):
        ChaosOptions(**change)
