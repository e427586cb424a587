"""Houbolt's scheme: the thesis's formulas, its order, its own eigenvalues, its end states."""

from __future__ import annotations

import control
import numpy as np
import pytest
import scipy.linalg
from hypothesis import given
from hypothesis import settings as budget
from hypothesis import strategies as st
from marching import event_march, plain_houbolt

from aeroflutter import (
    Bilinear,
    Cubic,
    Freeplay,
    Hysteresis,
    InputError,
    Linear,
    LureSystem,
    QuasiSteady,
    SectionFamily,
    Table,
    TypicalSection,
    Wagner,
)
from aeroflutter.generated import houbolt as generated
from aeroflutter.linear.rootlocus import flutter_speed as exact_flutter_speed
from aeroflutter.motion.houbolt import march
from aeroflutter.motion.houbolt_scheme import Scheme, flutter_speed
from aeroflutter.motion.response import Initial, SimulateOptions, simulate
from aeroflutter.motion.second_order import SecondOrder

DEGREE = np.pi / 180
SECTION = TypicalSection(omega_bar=0.8, zeta_alpha=0.01, zeta_xi=0.02)
THREE_TERMS = Wagner((0.1, 0.2, 0.15), (0.03, 0.2, 0.5))
AERODYNAMICS = (Wagner(), THREE_TERMS, Wagner((), ()), QuasiSteady())

SPRINGS = {
    "linear": Linear(0.8, 0.3 * DEGREE),
    "freeplay": Freeplay(1.0 * DEGREE, 0.1 * DEGREE),
    "bilinear": Bilinear(0.25 * DEGREE, 0.05, 0.25 * DEGREE, 0.5 * DEGREE),
    "table": Table((-0.03, -0.01, 0.004, 0.02), (-0.02, -0.007, 0.003, 0.025)),
    "cubic": Cubic(1.0, 200.0),
    "hysteresis": Hysteresis(1.0 * DEGREE, 0.4 * DEGREE),
    "offset loop": Hysteresis(1.0 * DEGREE, 0.4 * DEGREE, 0.25 * DEGREE, 0.1 * DEGREE),
}


def houbolt(dt, duration, **changes):
    return SimulateOptions(engine="houbolt", dt=dt, duration=duration, decide=False, **changes)


def test_differences_are_exact_for_cubics():
    # The weights of q' and q'' come from a cubic through four points.
    t = np.arange(-2, 2) * 0.3
    for power in range(4):
        q = t**power
        assert generated.VELOCITY @ q / 0.3 == pytest.approx(
            power * 0.3 ** max(power - 1, 0) if power else 0.0, abs=1e-12
        )
        second = power * (power - 1) * 0.3 ** max(power - 2, 0)
        assert generated.ACCELERATION @ q / 0.09 == pytest.approx(second, abs=1e-12)


@pytest.mark.parametrize("name", ["hysteresis", "offset loop", "freeplay", "linear"])
@pytest.mark.parametrize("alpha_deg", [3.0, -0.4])
def test_the_recurrence_is_the_scheme_of_the_thesis(name, alpha_deg):
    # Against section 3.2.1 written out step by step, Wagner's start included. Both follow the
    # same arithmetic up to round-off, which q'' amplifies by 1/dt^2 and the 300 steps by their
    # number: 1e-16 * 100 * 300.
    spring = SPRINGS[name] if name != "linear" else Linear()
    aerodynamics = Wagner()
    pitch, heave, memory = plain_houbolt(
        SECTION, aerodynamics.a, aerodynamics.b, 3.9, spring, alpha_deg * DEGREE, 0.1, 300
    )
    system = SectionFamily(SECTION, aerodynamics).at(3.9)
    run = simulate(system, spring, Initial(alpha=alpha_deg * DEGREE), houbolt(0.1, 30.0))
    np.testing.assert_allclose(run.pitch, pitch, rtol=0, atol=3e-12)
    np.testing.assert_allclose(run.heave, heave, rtol=0, atol=3e-12)
    if name in ("hysteresis", "offset loop"):
        np.testing.assert_allclose(run.memory, memory, rtol=0, atol=3e-12)


def test_the_recurrence_is_the_derived_step():
    # generated.step_matrices states the step from M, C, K; the recurrence is built from M = 1.
    system = SectionFamily(SECTION, THREE_TERMS).at(3.0)
    form, dt = SecondOrder.of(system), 0.13
    scheme = Scheme.build(system, dt)
    step = scheme.step
    lift = -form.lag_gain[:, 0] / THREE_TERMS.a[0]
    derived = generated.step_matrices(
        np.eye(2),
        -form.damping - np.outer(lift, form.d1),
        -form.stiffness - np.outer(lift, form.d0),
        lift,
        form.d0,
        form.d1,
        np.array(THREE_TERMS.a),
        np.array(THREE_TERMS.b),
        dt,
    )
    inverse = np.linalg.inv(derived.new)
    newest_first = np.reshape(step.q_q, (2, 3, 2))[:, ::-1]
    for k in range(3):
        np.testing.assert_allclose(newest_first[:, k], -inverse @ derived.old[k], rtol=1e-9)
    np.testing.assert_allclose(step.q_f, -inverse @ form.push, rtol=1e-10)
    assert step.j_j == pytest.approx(tuple(derived.decay), rel=1e-14)
    weights = np.reshape(step.j_l, (3, 4))
    np.testing.assert_allclose(weights[:, 2::-1], derived.weights, rtol=1e-13)
    assert weights[:, 3] == pytest.approx(derived.newest, rel=1e-14)


@pytest.mark.parametrize("aerodynamics", AERODYNAMICS, ids=["jones", "three", "none", "quasi"])
def test_second_order_form_returns_the_system(aerodynamics):
    system = SectionFamily(SECTION, aerodynamics).at(2.5)
    form = SecondOrder.of(system)
    rng = np.random.default_rng(3)
    x = rng.standard_normal((4, system.order))
    q, v, J = x[:, form.positions], x[:, form.rates], form.duhamel(x)
    np.testing.assert_allclose(form.state(q, v, J), x, rtol=1e-13)
    acceleration = q @ form.stiffness.T + v @ form.damping.T - J @ form.lag_gain.T
    np.testing.assert_allclose(acceleration, (x @ system.A.T)[:, form.rates], rtol=1e-10)


@pytest.mark.parametrize("aerodynamics", AERODYNAMICS, ids=["jones", "three", "none", "quasi"])
def test_every_mode_decays_and_turns_as_the_poles_say(aerodynamics):
    # Each mode excited alone; rate and frequency from the march itself, one period (or one
    # e-folding) of it. The error falls with the square of the step, for every mode.
    system = SectionFamily(SECTION, aerodynamics).at(3.5)
    closed = system.closed(1.0)
    poles = control.poles(control.ss(closed, np.zeros((system.order, 1)), system.c, 0))
    values, vectors = scipy.linalg.eig(closed)
    assert np.allclose(np.sort_complex(poles), np.sort_complex(values), atol=1e-9)
    for pole, mode in zip(values, vectors.T, strict=True):
        if pole.imag < 0:
            continue
        steps = np.array([0.1, 0.05, 0.025])
        errors = [abs(measured_pole(system, mode, pole, dt) - pole) for dt in steps]
        order = np.polyfit(np.log(steps), np.log(errors), 1)[0]
        assert errors[-1] < 0.01 * abs(pole)
        assert order == pytest.approx(2.0, abs=0.15)


def measured_pole(system, mode, pole, dt):
    """Pole of a march that starts on Re(mode), from the ratio of two complex modal amplitudes."""
    mode = mode / (system.c @ mode)
    left = np.linalg.inv(np.linalg.eig(system.closed(1.0))[1])
    k = int(np.argmin(np.abs(np.linalg.eig(system.closed(1.0))[0] - pole)))
    span = dt * round((min(40.0, 2 * np.pi / abs(pole))) / dt)
    run = simulate(
        system, Linear(), Initial(state=0.01 * mode.real), houbolt(dt, span + 4 * dt, growth=1e9)
    )
    end = round(span / dt)
    start, stop = left[k] @ run.states[0], left[k] @ run.states[end]
    phase = np.log(stop / start)
    turns = np.round((pole.imag * span - phase.imag) / (2 * np.pi))
    return complex(phase.real, phase.imag + 2 * np.pi * turns) / span


@pytest.mark.parametrize("name", SPRINGS)
def test_second_order_against_an_integration_with_events(name):
    # Nonzero rates in pitch and heave, several switches on the way; first order once the spring
    # is frozen at the old pitch (design of the scheme, section 3.2.1).
    spring = SPRINGS[name]
    system = SectionFamily(SECTION).at(3.6)
    state = Initial(alpha=2 * DEGREE, alpha_rate=0.002, xi=0.01, xi_rate=0.01).vector(system)
    memory = float(spring.initial_memory(2 * DEGREE))
    duration, steps = 40.0, np.array([0.1, 0.05, 0.025, 0.0125])
    if name == "cubic":
        exact = simulate(
            system, spring, Initial(state=state), SimulateOptions(duration=duration, decide=False)
        ).final_state
    else:
        exact = event_march(system, spring, state, memory, duration)[0]
    for frozen, order in ((False, 2.0), (True, 1.0)):
        errors = [
            np.abs(
                march(system, spring, state, memory, houbolt(dt, duration), frozen).final_state
                - exact
            ).max()
            for dt in steps
        ]
        assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(order, abs=0.15)


def test_a_run_taken_up_again_keeps_its_order():
    # Stopping and going on from the end restarts the history from a Taylor series: still second
    # order, and the memory of flow and spring goes along.
    system, spring = SectionFamily(SECTION).at(3.6), SPRINGS["hysteresis"]
    start = Initial(alpha=3 * DEGREE)
    exact = event_march(system, spring, *start.start(system, spring), 40.0)[0]
    steps, errors = np.array([0.1, 0.05, 0.025]), []
    for dt in steps:
        half = simulate(system, spring, start, houbolt(dt, 20.0))
        rest = Initial(state=half.final_state, memory=half.final_memory)
        errors.append(
            np.abs(simulate(system, spring, rest, houbolt(dt, 20.0)).final_state - exact).max()
        )
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(2.0, abs=0.3)


@pytest.mark.parametrize(
    ("omega_bar", "at_a_tenth"),
    [(0.8, 4.1143), (0.2, 6.2851)],
)
def test_flutter_speed_of_the_scheme(omega_bar, at_a_tenth):
    # Spectral radius of the one-step matrix. 4.1143 at a step of 0.1 is the checked value of the
    # scheme (exact 4.1145); the thesis prints 4.1128 from simulations. Second order in the step.
    family = SectionFamily(TypicalSection(omega_bar=omega_bar))
    exact = exact_flutter_speed(family)
    steps = np.array([0.4, 0.2, 0.1, 0.05])
    speeds = np.array([flutter_speed(family, dt) for dt in steps])
    assert speeds[2] == pytest.approx(at_a_tenth, abs=5e-5)
    assert np.all(speeds < exact)
    order = np.polyfit(np.log(steps[1:]), np.log(exact - speeds[1:]), 1)[0]
    assert order == pytest.approx(2.0, abs=0.1)


def test_companion_matrix_makes_the_steps_of_the_march():
    system = SectionFamily(SECTION).at(3.0)
    scheme = Scheme.build(system, 0.1)
    run = simulate(system, Linear(0.7), Initial(alpha=0.1, xi_rate=0.02), houbolt(0.1, 6.0))
    form, n = scheme.form, 30
    q = run.states[n - 3 : n + 1, form.positions]
    lam = np.diff(run.states[:, form.positions] @ form.d0 + run.states[:, form.rates] @ form.d1)
    T = scheme.companion(0.7)
    values = np.linalg.eigvals(T)
    modes = np.exp(0.1 * np.linalg.eigvals(system.closed(0.7)))
    nearest = [np.min(np.abs(values - mode)) for mode in modes]
    assert max(nearest) < 1e-3  # local error of the scheme over one step: O(dt^3)
    # The slowest parts of the trace satisfy the characteristic polynomial of the matrix.
    polynomial = np.poly(T)
    y = run.pitch[20 : 20 + polynomial.size]
    assert abs(polynomial @ y[::-1]) < 1e-9
    assert q.shape == (4, 2)
    assert lam.size == run.time.size - 1


FIRST_LCO = {
    "run 14": (1.0, 0.2, 0.922),
    "run 15": (1.0, 0.1, 0.954),
    "run 16": (0.1, 1.0, 0.816),
    "run 10": (1.0, 1.0, 0.852),
}


@pytest.mark.parametrize("name", FIRST_LCO)
def test_first_limit_cycle_from_six_degrees(name):
    # Table 5.1, Houbolt column, dt = 0.1, on a grid of 0.001: within one step of the grid.
    delta_v, delta_h, published = FIRST_LCO[name]
    spring = Hysteresis(delta_v * DEGREE, delta_h * DEGREE)
    family = SectionFamily(TypicalSection(omega_bar=0.8))
    reference = exact_flutter_speed(family)
    options = SimulateOptions(engine="houbolt", record=False)
    for ratio in np.arange(published - 0.012, published + 0.004, 0.001):
        run = simulate(family.at(ratio * reference), spring, Initial(alpha=6 * DEGREE), options)
        assert run.state in ("damped", "lco")
        if run.state == "lco":
            break
    assert ratio == pytest.approx(published, abs=0.00101)


def test_the_windows_of_run_14():
    # Damped just above 0.97, limit cycle again from about 0.984, as an exact simulation has it.
    family = SectionFamily(TypicalSection(omega_bar=0.8))
    reference, spring = exact_flutter_speed(family), Hysteresis(DEGREE, 0.2 * DEGREE)
    options = SimulateOptions(engine="houbolt", record=False)
    states = [
        simulate(family.at(r * reference), spring, Initial(alpha=6 * DEGREE), options).state
        for r in (0.91, 0.93, 0.96, 0.975, 0.99)
    ]
    assert states == ["damped", "lco", "lco", "damped", "lco"]


def test_the_thesis_end_states():
    # 50 000 steps of 0.1; damped below 0.001 deg, divergent above 100 deg (section 4.2).
    family = SectionFamily(TypicalSection(omega_bar=0.8))
    reference, spring = exact_flutter_speed(family), Hysteresis(DEGREE, 0.2 * DEGREE)
    options = SimulateOptions.thesis(record=False)
    assert (options.dt, options.duration) == (0.1, 5000.0)
    runs = {
        ratio: simulate(family.at(ratio * reference), spring, Initial(alpha=6 * DEGREE), options)
        for ratio in (0.9, 0.93, 1.05)
    }
    assert [run.state for run in runs.values()] == ["damped", "lco", "divergent"]
    assert runs[0.9].duration < 5000.0
    assert runs[0.93].duration == pytest.approx(5000.0)
    free = simulate(
        family.at(0.93 * reference),
        spring,
        Initial(alpha=6 * DEGREE),
        SimulateOptions(engine="houbolt"),
    )
    # Switches fall anywhere within a step: two cycles differ by the square of k dt.
    assert runs[0.93].amplitude == pytest.approx(free.amplitude, rel=2e-4)
    assert np.degrees(abs(runs[1.05].final_state[1])) > 100.0


@given(
    power=st.integers(-8, 8),
    sign=st.sampled_from([-1, 1]),
    alpha=st.floats(0.2, 9.0),
    ratio=st.floats(0.7, 1.1),
)
@budget(max_examples=25)
def test_scale_and_mirror(power, sign, alpha, ratio):
    # Piecewise linear: scaled by a power of two, every number scales to the last bit.
    factor = 2.0**power
    system = SectionFamily(TypicalSection(omega_bar=0.8)).at(4.1 * ratio)
    spring, options = SPRINGS["hysteresis"], SimulateOptions(engine="houbolt", duration=1500.0)
    one = simulate(system, spring, Initial(alpha=alpha * DEGREE), options)
    other = simulate(
        system, spring.scaled(factor), Initial(alpha=sign * factor * alpha * DEGREE), options
    )
    assert (one.state, one.duration) == (other.state, other.duration)
    np.testing.assert_array_equal(other.pitch, sign * factor * one.pitch)
    np.testing.assert_array_equal(other.memory, sign * factor * one.memory)


def test_linear_spring_below_and_above_flutter():
    family = SectionFamily(TypicalSection(omega_bar=0.8))
    reference = exact_flutter_speed(family)
    options = SimulateOptions(engine="houbolt")
    below = simulate(family.at(0.9 * reference), Linear(1.0, 0.02), Initial(alpha=0.1), options)
    assert below.state == "damped"
    assert below.rest == pytest.approx(0.02, rel=1e-9)  # a_h = -1/2: no aerodynamic moment
    above = simulate(family.at(1.1 * reference), Linear(), Initial(alpha=0.1), options)
    assert above.state == "divergent"
    assert abs(above.pitch[-1]) > 100.0
    assert above.time.size == above.pitch.size > 100


def test_rest_inside_the_loop_is_reported():
    system = SectionFamily(TypicalSection(omega_bar=0.8)).at(3.3)
    loop = Hysteresis(DEGREE, 0.2 * DEGREE)
    run = simulate(system, loop, Initial(alpha=6 * DEGREE), SimulateOptions(engine="houbolt"))
    assert run.state == "damped"
    assert run.rest == pytest.approx(run.final_memory, abs=1e-12)
    long = simulate(system, loop, Initial(alpha=6 * DEGREE), houbolt(0.1, 6000.0))
    assert long.pitch[-1] == pytest.approx(run.rest, abs=1e-9)
    assert long.state == "damped"


def test_overflow_keeps_what_was_computed():
    system = SectionFamily(TypicalSection(omega_bar=0.8)).at(6.0)
    options = SimulateOptions(engine="houbolt", growth=1e308, duration=50_000.0)
    run = simulate(system, Linear(), Initial(alpha=0.1), options)
    assert run.state == "divergent"
    assert "overflow" in run.reason
    assert run.duration < 50_000.0
    assert np.isfinite(run.pitch[:-1]).all()
    assert run.pitch.size > 1000


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"dt": 5.0, "duration": 1000.0}, "dt: 5.0 takes"),
        ({"duration": 0.0}, "duration"),
        ({"duration": np.nan}, "duration"),
        ({"dt": -0.1}, "dt"),
        ({"dt": np.inf}, "dt"),
        ({"dt": 1.0, "duration": 2.0}, "fewer than four steps"),
        ({"engine": "euler"}, "engine"),
        ({"criteria": "none"}, "criteria"),
        ({"growth": 0.0}, "growth"),
        ({"cycles": 0}, "cycles"),
    ],
)
def test_bad_options_are_named(options, words):
    system = SectionFamily(SECTION).at(3.0)
    with pytest.raises(InputError, match=words):
        simulate(
            system, Linear(), Initial(alpha=0.1), SimulateOptions(**{"engine": "houbolt"} | options)
        )


@pytest.mark.parametrize(
    ("A", "b", "c", "words"),
    [
        ([[0.0, 1.0], [-1.0, -0.1]], [1.0, 1.0], [1.0, 0.0], "no state is the derivative"),
        ([[-1.0, 0.5], [0.2, -2.0]], [1.0, 0.0], [1.0, 0.0], "no state is the derivative"),
        ([[0.0, 1.0], [-1.0, -0.1]], [0.0, 1.0], [0.0, 1.0], "not a displacement"),
        (
            [[0, 1.0, 0], [-1.0, -0.1, 0.1], [1.0, 0.5, -0.2]],
            [0, 1.0, 1.0],
            [1.0, 0, 0],
            "acts on a lag",
        ),
        (
            [[0, 1.0, 0], [-1.0, -0.1, 0.1], [1.0, 0.5, 0.2]],
            [0, 1.0, 0],
            [1.0, 0, 0],
            "does not decay",
        ),
    ],
)
def test_systems_without_the_form_are_refused(A, b, c, words):
    system = LureSystem(np.array(A), np.array(b), np.array(c))
    with pytest.raises(InputError, match=words):
        simulate(
            system, Linear(), Initial(state=np.ones(len(b))), SimulateOptions(engine="houbolt")
        )


def test_an_oscillator_from_elsewhere():
    # One degree of freedom, no aerodynamics: van der Pol's plant with freeplay is nobody's wing.
    system = LureSystem(
        np.array([[0.0, 1.0], [-0.2, -0.05]]), np.array([0.0, 1.0]), np.array([1.0, 0.0])
    )
    spring, state = Freeplay(0.4), np.array([1.0, 0.3])
    exact = event_march(system, spring, state, 0.0, 20.0)[0]
    steps = np.array([0.1, 0.05, 0.025])
    errors = [
        np.abs(
            simulate(system, spring, Initial(state=state), houbolt(dt, 20.0)).final_state - exact
        ).max()
        for dt in steps
    ]
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(2.0, abs=0.15)
