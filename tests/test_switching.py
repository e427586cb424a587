"""Laws that jump in the exact flow: textbooks, SciPy with events, differences, sticking."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from aeroflutter import (
    Cubic,
    FixedFamily,
    Friction,
    InputError,
    Linear,
    LureSystem,
    Play,
    Polynomial,
    Relay,
    Saturation,
    SectionFamily,
    System,
    TypicalSection,
)
from aeroflutter.linear.rootlocus import flutter_speed
from aeroflutter.motion import proofs
from aeroflutter.motion.flow import Flow, Matrices
from aeroflutter.motion.march import March
from aeroflutter.motion.response import Initial, SimulateOptions, simulate
from aeroflutter.orbits.cycles import CycleOptions, cycles_at, limit_cycles
from aeroflutter.orbits.describing import describing_intersections
from aeroflutter.orbits.harmonic import HarmonicOptions, sinusoid, solve_cycle

SECTION = SectionFamily(TypicalSection(omega_bar=0.8))
FLUTTER = flutter_speed(SECTION)


def loop(numerator, denominator):
    """x' = A x - b F(c x) with the transfer function numerator/denominator."""
    den = np.array(denominator, dtype=float) / denominator[0]
    n = den.size - 1
    A = np.diag(np.ones(n - 1), 1)
    A[-1] = -den[:0:-1]
    c = np.zeros(n)
    c[: len(numerator)] = np.array(numerator[::-1], dtype=float) / denominator[0]
    return LureSystem(A, np.eye(n)[-1], c)


THREE = {  # Åström & Hägglund's relay test; and loops of any textbook
    "9/(s(s+1)(s+9))": (loop([9.0], [1, 10, 9, 0]), Relay(), 0.127324, 3.0, 0.135188, 2.883183),
    "1/(s(s+1)(s+2))": (loop([1.0], [1, 3, 2, 0]), Relay(), 0.212207, 2**0.5, 0.220037, 1.380595),
    "8/(s³+2s²+2s+1)": (
        loop([8.0], [1, 2, 2, 1]),
        Saturation(),
        3.343999,
        2**0.5,
        3.379909,
        1.406702,
    ),
}


@pytest.mark.parametrize("name", THREE)
def test_three_loops_by_describing_function_exactly_and_by_marching(name):
    system, law, amplitude, omega, exact, k = THREE[name]
    found = describing_intersections(system, law)
    np.testing.assert_allclose(found, [[amplitude, omega]], rtol=1e-5)
    cycles = cycles_at(FixedFamily(system), law, 1.0, CycleOptions(simulations=1)).cycles
    assert [cycle.stable for cycle in cycles] == [True]
    assert (cycles[0].amplitude, cycles[0].k) == pytest.approx((exact, k), abs=6e-7)
    run = simulate(system, law, Initial(state=[0.3, 0.0, 0.0]), SimulateOptions(record=False))
    assert run.state == "lco"
    assert run.amplitude == pytest.approx(cycles[0].amplitude, rel=1e-11)
    assert run.period == pytest.approx(cycles[0].period, rel=1e-11)
    assert run.extras["multiplier"] == pytest.approx(abs(cycles[0].multipliers[1]), rel=1e-6)


def test_the_relay_cycle_is_that_of_its_closed_form():
    # Half a period on one side, x(T/2) = -x(0) with y = 0 at both: Tsypkin's condition,
    # c (I + e^{A T/2})⁻¹ ∫₀^{T/2} e^{A s} b ds = 0, solved here by bisection on the transfer
    # function's partial fractions 1/(s(s+1)(s+2)) = 1/2s - 1/(s+1) + 1/2(s+2).
    from scipy.optimize import brentq

    def place(half):
        return 0.5 * (-half / 2) - (-np.tanh(half / 2)) + 0.25 * (-np.tanh(half))

    half = brentq(place, 1.0, 4.0)
    system = THREE["1/(s(s+1)(s+2))"][0]
    cycle = cycles_at(FixedFamily(system), Relay(), 1.0, CycleOptions(simulations=0)).cycles[0]
    assert cycle.period == pytest.approx(2 * half, rel=1e-12)


# --- against SciPy with events


def dop853(system, law, x, time, side=1.0):
    """x(time) of a relay by DOP853, stopped and started at every jump."""
    A, b, c, edge = system.A, system.b, system.c, 0.5 * law.width
    t, x = 0.0, np.array(x, dtype=float)
    if abs(c @ x) >= edge:
        side = 1.0 if c @ x >= edge else -1.0
    while t < time:

        def crosses(_, x, side=side):
            return c @ x + side * edge

        crosses.terminal, crosses.direction = True, -side
        found = solve_ivp(
            lambda _, x, side=side: A @ x - b * law.level * side,
            (t, time), x, method="DOP853", rtol=1e-12, atol=1e-14, events=crosses, max_step=0.02,
        )  # fmt: skip
        t, x = found.t[-1], found.y[:, -1]
        side = -side if found.status == 1 else side
    return x


@pytest.mark.parametrize("width", [0.0, 0.15])
def test_random_relay_loops_against_dop853(width):
    rng = np.random.default_rng(5)
    for _ in range(4):
        roots = -rng.uniform(0.2, 3.0, 2)
        system = loop([rng.uniform(0.5, 5.0)], [1.0, *(-roots.sum(), roots.prod()), 0.0])
        law, x = Relay(rng.uniform(0.5, 2.0), width), rng.normal(size=3)
        run = simulate(
            system, law, Initial(state=x, memory=1.0),
            SimulateOptions(duration=12.0, decide=False, record=False),
        )  # fmt: skip
        np.testing.assert_allclose(run.final_state, dop853(system, law, x, 12.0), atol=1e-9)


def friction_by_events(A, b, c, level, x, time):
    """Friction on c x by DOP853: slips until c A x = 0, sticks while its own force can hold."""
    r = c @ A
    gain = r @ b
    t, x, let_go = 0.0, np.array(x, dtype=float), False
    while t < time:
        force, rate = (r @ A @ x) / gain, r @ x
        stuck = abs(rate) < 1e-12 and abs(force) <= level and not let_go
        side = np.sign(rate) if abs(rate) >= 1e-12 else np.sign(force)

        def over(_, x, stuck=stuck, side=side):
            return level - abs(r @ A @ x) / gain if stuck else side * (r @ x) + 1e-15

        def slope(_, x, stuck=stuck, side=side):
            return A @ x - b * ((r @ A @ x) / gain if stuck else level * side)

        over.terminal, over.direction = True, -1.0
        first = solve_ivp(
            slope, (t, min(t + 1e-3, time)), x, method="DOP853", rtol=1e-12, atol=1e-14
        )
        found = solve_ivp(
            slope, (first.t[-1], time), first.y[:, -1], method="DOP853",
            rtol=1e-12, atol=1e-14, events=over, max_step=0.5,
        )  # fmt: skip
        t, x, let_go = found.t[-1], found.y[:, -1], found.status == 1 and stuck
        if found.status == 1 and not stuck:
            x = x - b * (r @ x) / gain
    return x


@pytest.mark.parametrize(("ratio", "friction"), [(0.9, 0.01), (1.05, 0.02)])
def test_friction_in_pitch_against_dop853(ratio, friction):
    system = SECTION.at(ratio * FLUTTER)
    x = Initial(alpha=0.1, alpha_rate=0.01, xi=0.02).vector(system)
    run = simulate(
        system, Friction(friction), Initial(state=x),
        SimulateOptions(duration=150.0, decide=False, record=False),
    )  # fmt: skip
    closed = system.closed(1.0)
    expected = friction_by_events(closed, system.b, system.c, friction, x, 150.0)
    np.testing.assert_allclose(run.final_state, expected, atol=1e-8)


# --- Jacobians across jumps, by differences


def differences(flow, z, time):
    step = 1e-6
    columns = [
        (flow.passage(z + e, time).end - flow.passage(z - e, time).end) / (2 * step)
        for e in step * np.eye(z.size)
    ]
    return np.array(columns).T


SLIDING = loop([1.0, 1.2, 0.5], [1.0, 0.2, 1.0, 0.1])
CASES = {
    "relay": (THREE["1/(s(s+1)(s+2))"][0], Relay(), [0.2, 0.1, -0.3], 7.0),
    "relay with width": (THREE["1/(s(s+1)(s+2))"][0], Relay(1.0, 0.1), [0.2, 0.1, -0.3], 7.0),
    "sliding relay": (SLIDING, Relay(), [0.9, -0.4, -0.6], 6.0),
    "sliding and leaving": (SLIDING, Relay(0.2), [0.9, -2.4, -0.6], 9.0),
    "play": (THREE["1/(s(s+1)(s+2))"][0], Play(0.1), [0.2, 0.1, -0.3, 0.15], 7.0),
    "friction": (SECTION.at(4.3), Friction(0.02), [0.05, 0.1, 0.01, 0.02, 0.01, 0.0], 60.0),
    "sticking": (SECTION.at(3.0), Friction(0.04), [0.05, 0.1, 0.01, 0.02, 0.01, 0.0], 60.0),
}


@pytest.mark.parametrize("name", CASES)
def test_jacobian_is_that_of_differences(name):
    system, law, z, time = CASES[name]
    flow, z = Flow(system, [law]), np.array(z)
    passage = flow.passage(z, time)
    assert passage.switches
    expected = differences(flow, z, time)
    room = 1e-6 * (1.0 + np.max(np.abs(expected)))
    np.testing.assert_allclose(passage.jacobian[:, : z.size], expected, atol=room)


@pytest.mark.parametrize("law", [Friction(0.02), Relay(0.02)])
def test_derivative_by_speed_is_that_of_differences(law):
    def at(speed):
        A, b = SECTION.stack(speed)
        dA, db = SECTION.derivative(speed)
        system = Matrices(A, b[:, None], SECTION.c[None], np.zeros(6))
        return Flow(system, [law], derivative=(dA, db[:, None]))

    z, step = np.array([0.05, 0.1, 0.01, 0.02, 0.01, 0.0]), 1e-5
    rise = at(4.3 + step).passage(z, 60.0).end - at(4.3 - step).passage(z, 60.0).end
    np.testing.assert_allclose(
        at(4.3).passage(z, 60.0).jacobian[:, -1], rise / (2 * step), atol=1e-6
    )


def test_the_rows_of_rates_change_with_the_system():
    # y' = y2, c A depends on the parameter: without its derivative the Jacobian is wrong.
    A = np.array([[-0.3, 1.0, 0.4], [-1.0, 0.1, 0.0], [0.2, 0.3, -0.5]])
    dA = np.array([[0.5, 0.2, -0.1], [0.1, 0.0, 0.3], [0.0, 0.2, 0.1]])
    b, c = np.array([0.0, 1.0, 0.3]), np.array([1.0, 0.0, 0.0])
    dA[0], A[0] = [0.5, 0.3, -1.0], [-0.3, 1.0, 0.0]
    b = np.array([0.0, 1.0, 0.0])

    def at(p):
        whole = A + p * dA
        system = Matrices(whole, b[:, None], c[None], np.zeros(3))
        return Flow(system, [Friction(0.1, 0.5)], derivative=(dA, np.zeros((3, 1))))

    z, step = np.array([1.0, 0.5, -0.2]), 1e-6
    rise = at(step).passage(z, 9.0).end - at(-step).passage(z, 9.0).end
    passage = at(0.0).passage(z, 9.0)
    assert len(passage.switches) > 2
    np.testing.assert_allclose(passage.jacobian[:, -1], rise / (2 * step), atol=1e-6)


# --- a relay that slides, and one that cannot


def test_a_relay_of_degree_one_slides_on_its_edge():
    options = SimulateOptions(duration=20.0, decide=False, dt=0.01)
    run = simulate(SLIDING, Relay(), Initial(state=[0.9, -0.4, -0.6]), options)
    slides = run.time > 3.0
    assert np.max(np.abs(run.pitch[slides])) < 1e-14
    assert np.max(np.abs(run.moment[slides])) < 1.0
    # Filippov: the zeros of the transfer function govern what is left.
    zeros = np.roots([1.0, 1.2, 0.5])
    x, later = run.states[400], run.states[900]
    b, c = SLIDING.b, SLIDING.c
    P = np.eye(3) - np.outer(b, c) / (c @ b)
    import scipy.linalg

    np.testing.assert_allclose(later, scipy.linalg.expm(5.0 * P @ SLIDING.A) @ x, atol=1e-12)
    assert np.linalg.norm(later) < np.exp(5.0 * zeros.real.max()) * 10 * np.linalg.norm(x)


def test_a_relay_of_degree_two_makes_three_thousand_switches_and_then_its_end_is_proved():
    system = LureSystem(np.array([[0.0, 1.0], [0.0, -0.1]]), np.array([0.0, 1.0]), np.eye(2)[0])
    marching = SimulateOptions(duration=159.0, decide=False, dt=1.0)
    run = simulate(system, Relay(), Initial(state=[0.0, 1.0]), marching)
    # From one velocity to the next |v| falls by v²/15, so that |v| = 15/(n + 15).
    assert len(run.events) == pytest.approx(3000, rel=0.01)
    assert abs(run.final_state[1]) < 1.1 * 15 / (len(run.events) + 15)
    ended = simulate(system, Relay(), Initial(state=[0.0, 1.0]))
    assert (ended.state, ended.rest) == ("damped", 0.0)
    assert "shrinks to nothing" in ended.reason
    growing = LureSystem(np.array([[0.0, 1.0], [0.0, 0.1]]), np.array([0.0, 1.0]), np.eye(2)[0])
    assert Flow(growing, [Relay()]).contraction.holds(np.array([0.0, 1e-3])) is False


def test_the_bound_of_a_relay_shrinks_along_its_motion():
    # With zero dynamics: what is proved at a point is seen on the motion from there.
    A = np.array([[0, 1, 0, 0], [0, -0.1, 0.3, 0.05], [0.2, 0, -0.5, 1.0], [0, 0.1, -1.0, -0.5]])
    system = LureSystem(A, np.array([0, 1.0, 0.2, 0]), np.eye(4)[0])
    flow = Flow(system, [Relay()])
    point = flow.start([0.0, 0.3, 0.1, 0.0])
    assert not flow.contraction.holds(np.array([0.0, 0.3, 50.0, 0.0]))
    assert flow.contraction.holds(np.array([0.0, 1e-3, 1e-3, 0.0]))
    held, speeds = False, []
    for _ in range(300):
        point = flow.advance(point)
        held = held or flow.contraction.holds(point.x)
        if held:
            speeds.append(abs(point.x[1]))
    assert held
    assert speeds[-1] < 0.5 * speeds[0]


# --- friction


def test_the_cycle_of_negative_damping_and_friction_is_its_closed_form():
    # y'' - 2 ζ y' + y + F₀ sgn y' = 0: each half swing is a spiral about ∓F₀ that grows by e^d,
    # so that A = F₀ (e^d + 1)/(e^d - 1), and its multiplier is e^{2d}.
    zeta, F0 = 0.05, 0.3
    system = LureSystem(np.array([[0.0, 1.0], [0.0, 2 * zeta]]), np.eye(2)[1], np.eye(2)[0])
    d = zeta * np.pi / np.sqrt(1 - zeta**2)
    amplitude, law = F0 * (np.exp(d) + 1) / (np.exp(d) - 1), Friction(F0)
    found = describing_intersections(system, law)  # n_q = 4 F₀/(π A) = 2 ζ ω at ω = 1
    np.testing.assert_allclose(found, [[4 * F0 / (np.pi * 2 * zeta), 1.0]], rtol=1e-9)
    cycle = cycles_at(FixedFamily(system), law, 1.0, CycleOptions(simulations=1)).cycles[0]
    assert cycle.amplitude == pytest.approx(amplitude, rel=1e-12)
    assert cycle.multipliers[1].real == pytest.approx(np.exp(2 * d), rel=1e-9)
    assert not cycle.stable
    # It takes 4 F₀ A a cycle: what the damper gives.
    flow = Flow(system, [law])
    times = np.linspace(0.0, cycle.period, 4001)
    march = March(flow, flow.begin(cycle.state), times=times)
    march.run(cycle.period)
    power = march.states[:, 1] ** 2 * 2 * zeta
    assert np.trapezoid(power, times) == pytest.approx(4 * F0 * amplitude, rel=1e-6)


def test_friction_rests_anywhere_in_its_band_and_sticks_at_round_off():
    system, F0 = SECTION.at(0.8 * FLUTTER), 0.02
    rests = []
    for alpha in (0.005, 0.03, 0.1, -0.07):
        run = simulate(system, Friction(F0), Initial(alpha=alpha))
        assert run.state == "damped"
        still = run.time > 0.9 * run.duration
        assert np.ptp(run.pitch[still]) == 0.0
        assert run.pitch[-1] == pytest.approx(run.rest, abs=1e-15)
        rates = run.states[:, run.state_names.index("alpha_rate")]
        assert np.max(np.abs(rates[still])) < 1e-15
        assert np.max(np.abs(run.moment - run.pitch)) < F0 * (1 + 1e-12)
        # at rest spring and friction balance: for a_h = -1/2 the air has no part in pitch
        assert abs(run.moment[-1]) < 0.05 * F0
        assert abs(run.rest) <= F0
        rests.append(run.rest)
    assert rests[0] == 0.005  # it never moves
    assert len(set(rests)) == len(rests)


def test_what_stays_in_a_sticking_mode_is_well_told_from_what_decays(monkeypatch):
    """Two neutral coordinates have no eigenvectors of their own: any basis of them must do."""
    monkeypatch.setattr(proofs, "BASIS", 1e3)
    for ratio in (0.3, 0.8, 0.95):
        flow = Flow(SECTION.at(ratio * FLUTTER), [Friction(0.02)])
        assert np.all(flow.proofs.decays == proofs.ALWAYS)


# --- several at once


def two_masses(F0, coupling=0.3):
    """Two masses on a belt's side, coupled by a spring, each with friction."""
    A = np.zeros((4, 4))
    A[0, 2] = A[1, 3] = 1.0
    A[2, :2], A[3, :2] = [-coupling, coupling], [coupling, -coupling]
    A[2, 2], A[3, 3] = 0.15, -0.05
    B = np.zeros((4, 2))
    B[2, 0], B[3, 1] = 1.0, 0.8
    C = np.eye(2, 4)
    laws = [Friction(F0[0], 1.0), Friction(F0[1], 0.4)]
    return System(
        A, B, C, names=("one", "two"), units=("rad", "rad"), state_names=("a", "b", "c", "d")
    ), laws


def test_two_sliders_obey_the_law_of_friction_at_every_sample():
    system, laws = two_masses((0.2, 0.12))
    flow = Flow(system, laws)
    times = np.linspace(0.0, 40.0, 40_001)
    march = March(flow, flow.begin([1.0, -0.7, 0.0, 0.0]), times=times, events=400)
    march.run(40.0)
    x, F = march.states, flow.channels.forces(march.moments)
    friction = F - x[:, :2] * [1.0, 0.4]
    for i, law in enumerate(laws):
        rate = x[:, 2 + i]
        slips = np.abs(rate) > 1e-9
        np.testing.assert_allclose(
            friction[slips, i], law.friction * np.sign(rate[slips]), atol=1e-12
        )
        assert np.max(np.abs(friction[:, i])) <= law.friction * (1 + 1e-9)
        assert np.any(~slips)
        assert np.any(slips)
    # and the equations: x' = A x - B F, integrated by Simpson's rule over pairs of samples
    rates = x @ system.A.T - F @ system.B.T
    h = times[1]
    whole = h / 3 * (rates[:-2:2] + 4 * rates[1:-1:2] + rates[2::2])
    error = np.abs(x[2::2] - x[:-2:2] - whole)
    jumps = {int(t / (2 * h)) for t in march.events()[:, 0]}
    smooth = np.array([i for i in range(len(error)) if i not in jumps])
    assert np.max(error[smooth]) < 1e-13


def test_sliders_without_a_single_answer_are_refused():
    system, laws = two_masses((0.2, 0.12))
    B = np.array(system.B)
    B[2:, :] = [[1.0, 2.0], [2.0, 1.0]]  # C A B is no P-matrix
    bad = System(
        system.A,
        B,
        system.C,
        names=system.names,
        units=system.units,
        state_names=system.state_names,
    )
    with pytest.raises(InputError, match="no single answer"):
        Flow(bad, laws)


def test_friction_is_refused_where_it_has_no_mass_to_hold():
    direct = loop([1.0, 1.2, 0.5], [1.0, 0.2, 1.0, 0.1])
    with pytest.raises(InputError, match="C B = 0"):
        Flow(direct, [Friction(0.1)])
    third = loop([1.0], [1.0, 0.2, 1.0, 0.1])
    with pytest.raises(InputError, match="C A B > 0"):
        Flow(third, [Friction(0.1)])


def test_friction_beside_another_spring_in_its_place():
    # A linear spring in heave beside friction in pitch changes nothing but the stiffness.
    family = SectionFamily(TypicalSection(omega_bar=0.8))
    system = family.at(3.5).system
    wide = System(
        system.A, np.hstack((system.B, np.eye(6)[:, 2:3])), np.vstack((system.C, np.eye(6)[:1])),
        names=("pitch", "heave"), units=("rad", "rad"), state_names=system.state_names,
    )  # fmt: skip
    flow = Flow(wide, [Friction(0.02), Linear(0.0)])
    alone = Flow(family.at(3.5), [Friction(0.02)])
    x = [0.05, 0.1, 0.01, 0.02, 0.01, 0.0]
    one, other = (f.advance(f.advance(f.start(x))) for f in (flow, alone))
    assert one.time == pytest.approx(other.time, rel=1e-12)
    np.testing.assert_allclose(one.x, other.x, atol=1e-12)


# --- play


def test_play_in_a_position_loop():
    # Gain 5 on 1/(s(s+1)(s+2)): stable cycle, unstable one below it.
    system, law = loop([5.0], [1, 3, 2, 0]), Play(0.2)
    large = describing_intersections(system, law)[-1]
    cycles = cycles_at(FixedFamily(system), law, 1.0, CycleOptions(simulations=1)).cycles
    exact = cycles[-1]
    assert exact.stable
    assert (exact.amplitude, exact.k) == pytest.approx(tuple(large), rel=5e-3)
    run = simulate(system, law, Initial(state=[0.3, 0.0, 0.0]), SimulateOptions(record=False))
    assert run.state == "lco"
    assert run.amplitude == pytest.approx(exact.amplitude, rel=1e-9)


# --- polynomials by shooting on Taylor's flow


def test_cycles_of_a_cubic_spring_are_those_of_harmonic_balance():
    family, spring = SectionFamily(TypicalSection(omega_bar=0.2)), Cubic(1.0, 3.0)
    result = limit_cycles(family, spring, CycleOptions(points=12, simulations=0))
    (branch,) = result.families
    assert "Hopf" in branch.ends[0]
    assert [cycle.stable for cycle in branch.cycles] == [True] * len(branch.cycles)
    for cycle in branch.cycles[2::5]:
        guess = sinusoid(cycle.first_harmonic, 0.0, cycle.k, cycle.speed)
        same = solve_cycle(family, spring, guess, options=HarmonicOptions(tolerance=1e-12))
        assert cycle.period == pytest.approx(same.period, rel=1e-12)
        assert cycle.first_harmonic == pytest.approx(same.first_harmonic, rel=1e-8)


def test_biased_cycles_of_a_polynomial_are_those_that_motions_settle_on():
    family, spring = SectionFamily(TypicalSection(omega_bar=0.2)), Polynomial((1.0, 0.6, 3.0))
    speed = 1.1 * flutter_speed(family)
    run = simulate(family.at(speed), spring, Initial(alpha=0.1), SimulateOptions(record=False))
    options = CycleOptions(simulations=0, speed_ratio_range=(1.0, 1.2))
    (cycle,) = cycles_at(family, spring, speed, options).cycles
    assert cycle.amplitude == pytest.approx(run.amplitude, rel=1e-8)
    assert cycle.bias == pytest.approx(run.bias, rel=1e-6)
    assert abs(cycle.multipliers[1]) == pytest.approx(run.extras["multiplier"], abs=1e-6)
