"""The exact engine: SciPy with events, published cycles, energy, and what it decides."""

from __future__ import annotations

import dataclasses
from itertools import pairwise

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given
from hypothesis import settings as budget
from hypothesis import strategies as st
from marching import event_march, growth, random_case
from taylor import taylor_march

from aeroflutter import (
    Bilinear,
    Cubic,
    Freeplay,
    Hysteresis,
    InputError,
    Linear,
    LureSystem,
    SectionFamily,
    TypicalSection,
    simplify,
)
from aeroflutter.linear.rootlocus import flutter_speed
from aeroflutter.motion.endstates import end_state
from aeroflutter.motion.exact import march
from aeroflutter.motion.flow import Flow
from aeroflutter.motion.houbolt import march as houbolt_march
from aeroflutter.motion.march import March
from aeroflutter.motion.response import Initial, SimulateOptions, simulate

DEGREE = np.pi / 180
STIFF, SOFT = (SectionFamily(TypicalSection(omega_bar=ratio)) for ratio in (0.8, 0.2))
FLUTTER = {STIFF: flutter_speed(STIFF), SOFT: flutter_speed(SOFT)}
SIX = Initial(alpha=6 * DEGREE)
SILENT = SimulateOptions(record=False)

# Height and width of the loop in degrees (thesis Table 5.1), and speed ratios of limit cycles.
RUNS = {
    "run6": (STIFF, 0.2, 1.0, (0.83, 0.86, 0.90, 0.94, 0.98)),
    "run10": (STIFF, 1.0, 1.0, (0.853, 0.87, 0.90, 0.94, 0.98)),
    "run14": (STIFF, 1.0, 0.2, (0.923, 0.935, 0.945, 0.955, 0.99)),
    "run15": (STIFF, 1.0, 0.1, (0.955, 0.9575, 0.96, 0.9625, 0.965)),
    "run16": (STIFF, 0.1, 1.0, (0.817, 0.85, 0.90, 0.94, 0.98)),
    "run111": (SOFT, 1.0, 0.2, (0.94, 0.95, 0.96, 0.97, 0.98)),
}


def at(family, ratio):
    return family.at(ratio * FLUTTER[family])


def loop_of(run):
    return Hysteresis(RUNS[run][1] * DEGREE, RUNS[run][2] * DEGREE)


# --- against an independent integration


def disagreement(seed, reference):
    """Error at 500 in units of each state's size, and the growth of a disturbance until then."""
    system, spring, start = random_case(np.random.default_rng([7, seed]))
    state, memory = start.start(system, spring)
    options = SimulateOptions(duration=500.0, decide=False, record=False)
    run = simulate(system, spring, start, options)
    _, size, growing = growth(system, spring, state, memory, 500.0)
    expected, expected_memory = reference(system, spring, state, memory, 500.0)
    error = float(np.abs((run.final_state - expected) / size).max())
    return max(error, abs(run.final_memory - expected_memory) / spring.scale), growing


def check_random_cases(seeds, reference):
    grown = []
    for seed in seeds:
        error, growing = disagreement(seed, reference)
        assert error < 1e-8 * growing, seed
        grown.append(growing)
    # The bound says something: chaos, where no two integrations can agree, is the exception.
    assert np.mean(np.array(grown) < 1e4) > 0.8


def test_random_cases_against_dop853():
    check_random_cases(range(12), event_march)


@pytest.mark.slow
def test_two_hundred_random_cases_against_dop853():
    check_random_cases(range(200), event_march)


@pytest.mark.slow
def test_two_hundred_random_cases_against_heyoka():
    pytest.importorskip("heyoka", reason="in the extra `reference`: `make reference`")
    check_random_cases(range(200), taylor_march)


def test_a_linear_spring_is_the_matrix_exponential():
    start = Initial(alpha=0.1, alpha_rate=0.02, xi=0.05, xi_rate=-0.01)
    run = simulate(
        at(STIFF, 0.9), Cubic(0.9, 0.0), start, SimulateOptions(duration=60.0, decide=False)
    )
    assert run.engine == "exact"
    closed, state = at(STIFF, 0.9).closed(0.9), start.vector(at(STIFF, 0.9))
    expected = np.array([scipy.linalg.expm(t * closed) @ state for t in run.time[::60]])
    np.testing.assert_allclose(run.states[::60], expected, rtol=0, atol=1e-13)


def test_order_of_houbolt_against_the_exact_engine():
    start = Initial(alpha=2 * DEGREE, alpha_rate=0.002, xi=0.01, xi_rate=0.01)
    system = at(STIFF, 0.9)
    for spring in (loop_of("run14"), Freeplay(0.5 * DEGREE)):
        state, memory = start.start(system, spring)
        options = [
            SimulateOptions(dt=dt, duration=40.0, decide=False) for dt in (0.1, 0.05, 0.025, 0.0125)
        ]
        exact = march(system, spring, state, memory, options[0]).final_state
        errors = [
            np.abs(houbolt_march(system, spring, state, memory, each).final_state - exact).max()
            for each in options
        ]
        order = np.polyfit(np.log([each.dt for each in options]), np.log(errors), 1)[0]
        assert order == pytest.approx(2.0, abs=0.15)


# --- what steps and scales may not change


@pytest.mark.parametrize("name", RUNS)
def test_cycles_do_not_depend_on_the_internal_step(name):
    family, _, _, ratios = RUNS[name]
    for ratio in ratios:
        runs = [
            simulate(at(family, ratio), loop_of(name), SIX, SimulateOptions(step_cap=cap))
            for cap in (None, 0.5, 0.11)
        ]
        assert {run.state for run in runs} == {"lco"}
        for measure in ("amplitude", "period", "first_harmonic"):
            values = np.array([getattr(run, measure) for run in runs])
            assert np.ptp(values) < 1e-9 * values[0]


@pytest.mark.parametrize(
    ("family", "spring", "ratio"),
    [
        (STIFF, Hysteresis(1.0 * DEGREE, 0.2 * DEGREE), 0.945),
        (SOFT, Freeplay(0.5 * DEGREE), 0.45),
        (SOFT, Freeplay(0.5 * DEGREE, centre=0.1 * DEGREE), 0.6),
    ],
)
def test_the_fundamental_of_a_cycle_against_its_samples(family, spring, ratio):
    # The third derivative of pitch jumps at a switch: what n samples miss falls with 1/n^4.
    prepared = Flow(at(family, ratio), [spring])
    end = end_state(prepared, [0.0, 6 * DEGREE, 0.0, 0.0, 0.0, 0.0], 0.0)
    assert end.state == "lco"
    errors = []
    for count in (1024, 8192):
        phase = np.arange(count) / count
        point = end.cycle.z[0]
        samples = March(prepared, prepared.begin(point[:-1], point[-1]), phase * end.period)
        samples.run(end.period)
        pitch = samples.states @ prepared.system.c
        sampled = 2.0 * abs(np.mean(pitch * np.exp(2j * np.pi * phase)))
        errors.append(abs(sampled / end.first_harmonic - 1.0))
    assert errors[0] < 1e-9
    assert errors[1] < 1e-12


@given(
    power=st.integers(-8, 8),
    sign=st.sampled_from([-1, 1]),
    alpha=st.floats(0.2, 9.0),
    ratio=st.floats(0.3, 1.1),
)
@budget(max_examples=25)
def test_scale_and_mirror(power, sign, alpha, ratio):
    # Piecewise linear: scaled by a power of two, every number scales to the last bit.
    factor, system, spring = 2.0**power, at(STIFF, ratio), loop_of("run10")
    options = SimulateOptions(duration=1500.0)
    one = simulate(system, spring, Initial(alpha=alpha * DEGREE), options)
    start = Initial(alpha=sign * factor * alpha * DEGREE)
    other = simulate(system, spring.scaled(factor), start, options)
    assert (one.state, one.duration) == (other.state, other.duration)
    np.testing.assert_array_equal(other.pitch, sign * factor * one.pitch)
    np.testing.assert_array_equal(other.memory, sign * factor * one.memory)


def test_the_trace_is_the_motion_that_was_judged():
    # The judge and the trace make the same steps: also where round-off soon decides everything.
    cases = [(SOFT, 0.30, Freeplay(0.5 * DEGREE)), (STIFF, 0.99, loop_of("run14"))]
    for family, ratio, spring in cases:
        traced = simulate(at(family, ratio), spring, SIX)
        silent = simulate(at(family, ratio), spring, SIX, SILENT)
        np.testing.assert_array_equal(traced.final_state, silent.final_state)
        assert traced.final_memory == pytest.approx(silent.final_memory, abs=1e-17)
        assert traced.duration == silent.duration
        assert silent.time.size == silent.events.size == 0
        assert np.all(np.diff(traced.events[:, 0]) >= 0.0)
        assert traced.time[-1] <= traced.duration < traced.time[-1] + 0.1
    # Known at once that a linear spring is damped: the record shows it all the same.
    damped = simulate(at(STIFF, 0.9), Linear(), SIX)
    assert damped.duration == damped.time[-1] == 400.0
    assert simulate(at(STIFF, 0.9), Linear(), SIX, SILENT).duration == 0.0


def test_going_on_from_the_end_is_the_same_motion():
    system, spring = at(STIFF, 0.93), loop_of("run14")
    options = SimulateOptions(duration=200.0, decide=False)
    half = simulate(system, spring, SIX, SimulateOptions(duration=100.0, decide=False))
    rest = Initial(state=half.final_state, memory=half.final_memory)
    whole = simulate(system, spring, SIX, options)
    again = simulate(system, spring, rest, SimulateOptions(duration=100.0, decide=False))
    # other steps from τ = 100 on: a thousand ulps of states of 0.05, whatever the machine
    np.testing.assert_allclose(again.final_state, whole.final_state, rtol=0, atol=1e-14)


@pytest.mark.parametrize(
    "loop",
    [
        Hysteresis(0.0, DEGREE, 0.2 * DEGREE, 0.1 * DEGREE),
        Hysteresis(DEGREE, 0.0, 0.2 * DEGREE, 0.1 * DEGREE),
        Hysteresis(0.0, DEGREE),
    ],
)
def test_loops_without_height_or_width(loop):
    options = SimulateOptions(duration=300.0, decide=False)
    run = simulate(at(SOFT, 0.2), loop, SIX, options)
    simple = simulate(at(SOFT, 0.2), simplify(loop), SIX, options)
    np.testing.assert_array_equal(run.states, simple.states)
    np.testing.assert_allclose(run.moment, simple.moment, rtol=0, atol=1e-15)
    np.testing.assert_array_equal(run.memory, loop.advance(run.memory, run.pitch))


def test_grazing_an_edge():
    # y'' = -F(y), slope 1 but for a stiffer piece on [-5/3, -1]. Started at rest at that edge the
    # motion touches it once a turn and never enters. A depth d beyond it is crossed in a time of
    # the order of sqrt(d), which changes the rate by d^(1/2) and the phase by d^(3/2): nothing.
    system = LureSystem(
        np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([0.0, 1.0]), np.array([1.0, 0.0])
    )
    spring = Bilinear(-3.0, 3.0, -5.0 / 3.0, 2.0 / 3.0)
    options = SimulateOptions(duration=50.0, decide=False)
    centre = -float(spring.pieces().offsets[-1])
    for beyond in (0.0, -1e-9, 1e-9, 1e-15):
        run = simulate(system, spring, Initial(state=[-1.0 - beyond, 0.0]), options)
        y = centre - (1.0 + centre + beyond) * np.cos(run.time)
        np.testing.assert_allclose(run.pitch, y, rtol=0, atol=1e-12 if beyond <= 0 else 1e-8)
        assert np.any(run.events[:, 0] > 0.0) == (beyond > 1e-12)


# --- energy


def cycle_of(name, ratio):
    """Prepared system and exact cycle, with its switches: time, kind, mode, pitch, moment."""
    family = RUNS[name][0]
    prepared = Flow(at(family, ratio), [loop_of(name)])
    state, memory = SIX.start(prepared.system, prepared.springs[0])
    end = end_state(prepared, state, memory)
    assert end.state == "lco"
    point = end.cycle.z[0]
    log = March(prepared, prepared.begin(point[:-1], point[-1]), events=1024)
    log.run(end.period)
    return prepared, end, log.events()


@pytest.mark.parametrize("name", RUNS)
def test_energy_of_a_cycle(name):
    # F is a straight line in pitch between switches, so trapezia give the work of the spring
    # exactly. What the loop dissipates, the air must have put in: times r_alpha^2/U^2 by the
    # equations of motion, integrated by Gauss's rule between switches.
    family, height, width, ratios = RUNS[name]
    for ratio in ratios[::2]:
        prepared, end, events = cycle_of(name, ratio)
        y, F = events[:, 3], events[:, 4]
        dissipated = np.sum(0.5 * (F + np.roll(F, -1)) * (np.roll(y, -1) - y))
        assert dissipated == pytest.approx(height * width * DEGREE**2, rel=1e-12)
        work = aerodynamic_work(family, ratio, prepared, end, events)
        speed = ratio * FLUTTER[family]
        assert work == pytest.approx(0.25 / speed**2 * dissipated, rel=1e-9)


def aerodynamic_work(family, ratio, prepared, end, events):
    """Integral of (-C_L xi' + 2 C_M alpha')/(pi mu) over a period, from the lift and moment."""
    nodes, weights = np.polynomial.legendre.leggauss(20)
    ends = np.concatenate(([0.0], events[:, 0], [end.period]))
    pieces = np.concatenate([np.linspace(a, b, 5)[:-1] for a, b in pairwise(ends)])
    pieces = np.unique(np.append(pieces, end.period))
    half, middle = np.diff(pieces) / 2, (pieces[1:] + pieces[:-1]) / 2
    times = (middle[:, None] + half[:, None] * nodes).ravel()
    point = end.cycle.z[0]
    log = March(prepared, prepared.begin(point[:-1], point[-1]), times)
    log.run(end.period)
    system, section = prepared.system, family.section
    x = log.states
    rates = x @ system.A.T - np.outer(log.moments[:, 0], system.b)
    _, alpha, xi_1, alpha_1, z1, z2 = x.T
    xi_2, alpha_2 = rates[:, 2], rates[:, 3]
    a_h, mu = section.a_h, section.mu
    w = alpha + xi_1 + (0.5 - a_h) * alpha_1
    W = 0.5 * w + 0.165 * 0.0455 * z1 + 0.335 * 0.3 * z2
    lift = np.pi * (xi_2 - a_h * alpha_2 + alpha_1) + 2 * np.pi * W
    moment = np.pi * (0.5 + a_h) * W + np.pi / 2 * (
        a_h * (xi_2 - a_h * alpha_2) - (0.5 - a_h) * alpha_1 - alpha_2 / 8
    )
    power = (-lift * xi_1 + 2 * moment * alpha_1) / (np.pi * mu)
    return float(np.sum(half[:, None] * weights * power.reshape(half.size, -1)))


# --- published numbers


@pytest.mark.parametrize(
    ("name", "published"), [("run14", 0.922), ("run15", 0.954), ("run16", 0.816), ("run10", 0.852)]
)
def test_first_limit_cycle_from_six_degrees(name, published):
    # Table 5.1, Houbolt column, on the same grid of 0.001: all damped before, the same speed.
    for ratio in np.round(np.arange(0.70, 1.0, 0.001), 3):
        run = simulate(at(STIFF, ratio), loop_of(name), SIX, SILENT)
        if run.state != "damped":
            break
    assert (run.state, ratio) == ("lco", published)


def test_freeplay_has_the_regimes_of_price():
    # Price, Alighanbari & Lee 1995: stable up to 0.13, limit cycles at 0.14-0.22, chaos at
    # 0.29-0.33; the exact engine finds a cycle of four loops at 0.33.
    gap, start = Freeplay(0.5 * DEGREE), Initial(alpha=7 * DEGREE)
    states = [
        simulate(at(SOFT, ratio), gap, start, SILENT).state
        for ratio in np.round(np.arange(0.10, 0.325, 0.01), 2)
    ]
    assert states[:4] == ["damped"] * 4
    assert states[4:13] == ["lco"] * 9
    assert states[19:] == ["aperiodic"] * 4


def test_the_cycle_of_chung_he_and_lee():
    # Chung, He & Lee 2009, run 103 at 0.85: period 82.78 printed, 82.804 by two independent
    # event-exact computations; multipliers of modulus |0.0937 + 0.1485 i|.
    run = simulate(at(SOFT, 0.85), Hysteresis(DEGREE, DEGREE), SIX)
    assert run.state == "lco"
    assert run.period == pytest.approx(82.80, abs=0.03)
    assert run.extras["multiplier"] == pytest.approx(abs(0.0937 + 0.1485j), abs=1e-4)


# --- end states


def test_rest_inside_the_loop_is_where_the_motion_goes():
    system, loop = at(STIFF, 0.8), loop_of("run14")
    run = simulate(system, loop, SIX)
    assert run.state == "damped"
    long = simulate(system, loop, SIX, SimulateOptions(duration=6000.0, decide=False))
    assert long.pitch[-1] == pytest.approx(run.rest, abs=1e-13)
    assert long.state == "damped"
    assert long.duration == 6000.0


def test_above_flutter_the_motion_diverges_and_says_so():
    run = simulate(at(STIFF, 1.05), loop_of("run14"), SIX)
    assert run.state == "divergent"
    assert np.isnan(run.amplitude)
    assert "unstable" in run.reason


def test_a_bounded_cycle_above_the_flutter_speed_of_the_inner_piece():
    # A spring that hardens: the inner piece is unstable, the outer one is not.
    spring = Bilinear(-0.2, 0.4, -0.5, 1.0)
    run = simulate(at(STIFF, 0.9), spring, Initial(alpha=0.6))
    assert run.state == "lco"
    assert run.amplitude > 0.5


def test_an_undamped_oscillator_is_neutral_with_the_reason():
    system = LureSystem(
        np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([0.0, 1.0]), np.array([1.0, 0.0])
    )
    run = simulate(system, Linear(), Initial(state=[0.7, 0.0]))
    assert run.state == "neutral"
    assert "neither attracts nor repels" in run.reason


def test_time_that_is_too_short_is_told():
    run = simulate(at(STIFF, 0.93), loop_of("run14"), SIX, SimulateOptions(duration=100.0))
    assert (run.state, run.duration) == ("undecided", 100.0)
    assert "not settled" in run.reason
    assert run.time[-1] == pytest.approx(100.0)


def test_an_overflow_is_told_and_what_came_before_it_kept():
    options = SimulateOptions(duration=60_000.0, decide=False)
    run = simulate(at(STIFF, 1.3), Linear(), SIX, options)
    assert run.state == "divergent"
    assert "overflowed" in run.reason
    assert run.duration < 60_000.0
    assert run.time.size > 1000
    assert np.isfinite(run.states).all()


def test_the_criteria_of_the_thesis():
    options = SimulateOptions(engine="exact", criteria="thesis", duration=5000.0)
    runs = [simulate(at(STIFF, r), loop_of("run14"), SIX, options) for r in (0.9, 0.93, 1.05)]
    assert [run.state for run in runs] == ["damped", "lco", "divergent"]
    assert runs[1].duration == 5000.0
    certain = simulate(at(STIFF, 0.93), loop_of("run14"), SIX)
    assert runs[1].amplitude == pytest.approx(certain.amplitude, rel=1e-9)
    assert runs[1].period == pytest.approx(certain.period, rel=1e-9)
    silent = simulate(
        at(STIFF, 0.93), loop_of("run14"), SIX, dataclasses.replace(options, record=False)
    )
    assert (silent.state, silent.amplitude) == (runs[1].state, runs[1].amplitude)


def test_progress_is_told():
    fractions = []
    options = SimulateOptions(duration=1e5, dt=1.0, decide=False, progress=fractions.append)
    simulate(at(STIFF, 0.93), loop_of("run14"), SIX, options)
    assert len(fractions) > 1
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0


def test_springs_without_pieces_are_refused():
    system, options = at(STIFF, 0.9), SimulateOptions()
    with pytest.raises(InputError, match="no linear pieces"):
        march(system, Cubic(1.0, 3.0), np.zeros(6), 0.0, options)
