"""Cubic and other smooth springs: published amplitudes, closed forms, Houbolt, end states."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
import scipy.special

from aeroflutter import Cubic, LureSystem, SectionFamily, Spring, TypicalSection
from aeroflutter.linear.rootlocus import flutter_speed
from aeroflutter.motion.response import Initial, SimulateOptions, simulate
from aeroflutter.motion.smooth_steps import Limits, stepper
from aeroflutter.orbits.harmonic import HarmonicOptions, sinusoid, solve_cycle

DEGREE = np.pi / 180
FAMILY = SectionFamily(TypicalSection(omega_bar=0.2))
FLUTTER = flutter_speed(FAMILY)
DUFFING = LureSystem(np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([0.0, 1.0]), np.array([1.0, 0.0]))


def at(ratio):
    return FAMILY.at(ratio * FLUTTER)


@pytest.mark.parametrize(
    ("ratio", "amplitude", "k"), [(1.05, 11.4, 0.0830), (1.10, 16.4, 0.0820), (1.15, 20.4, 0.0810)]
)
def test_amplitudes_of_lee_jiang_and_wong(ratio, amplitude, k):
    # Lee, Jiang & Wong 1999, beta3 = 3, read off their figures: half a division is 0.3 deg in
    # amplitude and 0.0001 in frequency.
    run = simulate(at(ratio), Cubic(1.0, 3.0), Initial(alpha=5 * DEGREE))
    assert (run.engine, run.state) == ("smooth", "lco")
    assert run.amplitude / DEGREE == pytest.approx(amplitude, abs=0.3)
    assert 2 * np.pi / run.period == pytest.approx(k, abs=1e-4)
    assert run.bias == pytest.approx(0.0, abs=1e-8)


def test_amplitude_scales_with_the_root_of_the_cubic_term():
    # F = a + b3 a^3 is scale-free: amplitude is proportional to b3^(-1/2), the period the same.
    # Each start is scaled alike, so the runs are the same motion to the integrator's tolerance.
    runs = [
        simulate(at(1.1), Cubic(1.0, beta3), Initial(alpha=0.3 / np.sqrt(beta3)))
        for beta3 in (3.0, 48.0)
    ]
    assert runs[0].amplitude == pytest.approx(4.0 * runs[1].amplitude, rel=1e-7)
    assert runs[0].period == pytest.approx(runs[1].period, rel=1e-7)


def test_houbolt_tends_to_the_same_cycle_with_the_square_of_its_step():
    spring, start = Cubic(1.0, 80.0), Initial(alpha=3 * DEGREE)
    exact = simulate(at(1.2), spring, start)
    steps, errors = np.array([0.4, 0.2, 0.1]), []
    for dt in steps:
        run = simulate(at(1.2), spring, start, SimulateOptions(engine="houbolt", dt=dt))
        assert run.state == "lco"
        errors.append(abs(run.period - exact.period))
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(2.0, abs=0.2)


def test_without_cubic_term_the_motion_is_that_of_the_matrix_exponential():
    start = Initial(alpha=0.1, alpha_rate=0.02, xi=0.05, xi_rate=-0.01)
    options = SimulateOptions(duration=60.0, decide=False)
    run = simulate(at(0.9), Cubic(1.0, 0.0), start, options)
    system = at(0.9)
    expected = scipy.linalg.expm(60.0 * system.closed(1.0)) @ start.vector(system)
    # Tolerance 1e-11 a step, some 100 steps.
    np.testing.assert_allclose(run.final_state, expected, rtol=0, atol=1e-9)
    assert run.duration == pytest.approx(60.0)
    middle = scipy.linalg.expm(30.0 * system.closed(1.0)) @ start.vector(system)
    np.testing.assert_allclose(run.states[300], middle, rtol=0, atol=1e-9)


@pytest.mark.parametrize("amplitude", [0.1, 0.7, 5.0])
def test_the_motion_of_duffings_oscillator_is_jacobis_elliptic_cosine(amplitude):
    # y'' = -(y + y^3) from rest at A: y = A cn(w t, m), w^2 = 1 + A^2, m = A^2/(2 w^2).
    frequency = np.sqrt(1 + amplitude**2)
    parameter = amplitude**2 / (2 * frequency**2)
    options = SimulateOptions(duration=100.0, decide=False)
    run = simulate(DUFFING, Cubic(1.0, 1.0), Initial(state=[amplitude, 0.0]), options)
    cosine = scipy.special.ellipj(frequency * run.time, parameter)[1]
    np.testing.assert_allclose(run.pitch, amplitude * cosine, rtol=0, atol=1e-12 * amplitude)


def test_turning_points_of_duffings_oscillator_are_half_a_period_apart():
    motion = stepper(
        DUFFING, Cubic(1.0, 1.0), np.array([0.7, 0.0]), Limits(1.0, np.inf, 1e3, 1.0, 1.0)
    )
    turns = np.vstack([motion.march(until).turns for until in (1.0, 1.5, 40.0, 400.0)])
    frequency = np.sqrt(1.49)
    half = 2 * scipy.special.ellipk(0.49 / (2 * 1.49)) / frequency
    count = int(400 / half)
    np.testing.assert_allclose(turns[:, 0], half * np.arange(1, count + 1), atol=1e-11)
    np.testing.assert_allclose(turns[:, 1], 0.7 * (-1.0) ** np.arange(1, count + 1), atol=1e-12)


class Law(Spring):
    """The cubic spring as a law that nothing else is known of."""

    kind = "law"

    def __init__(self, law):
        self.law = law

    scale = property(lambda self: self.law.scale)
    odd = True

    def moment(self, alpha, memory=0.0):
        return self.law.moment(alpha, memory)

    def describing(self, amplitude, bias=0.0):
        return self.law.describing(amplitude, bias)

    def scaled(self, factor):
        return Law(self.law.scaled(factor))

    def slope_range(self):
        return self.law.slope_range()

    def span(self):
        return self.law.span()


def test_a_law_of_ones_own_ends_as_the_cubic_spring_does():
    # DOP853 at 1e-11 instead of Taylor series; Newton's method ends on the same cycle.
    cubic, start = Cubic(1.0, 3.0), Initial(alpha=5 * DEGREE)
    series, dopri = (simulate(at(1.1), spring, start) for spring in (cubic, Law(cubic)))
    assert series.extras["rtol"] < dopri.extras["rtol"]
    assert (series.state, dopri.state) == ("lco", "lco")
    n = min(series.pitch.size, dopri.pitch.size, 2000)
    np.testing.assert_allclose(series.pitch[:n], dopri.pitch[:n], rtol=0, atol=1e-9)
    for name in ("amplitude", "period", "first_harmonic"):
        assert getattr(series, name) == pytest.approx(getattr(dopri, name), rel=1e-9)
    multipliers = series.extras["multiplier"], dopri.extras["multiplier"]
    assert multipliers[0] == pytest.approx(multipliers[1], abs=1e-4)


@pytest.mark.parametrize(("ratio", "beta3"), [(1.05, 3.0), (1.1, 3.0), (1.5, 80.0)])
def test_the_cycle_is_that_of_harmonic_balance_to_twelve_digits(ratio, beta3):
    spring = Cubic(1.0, beta3)
    options = SimulateOptions(record=False)
    run = simulate(at(ratio), spring, Initial(alpha=4 * DEGREE), options)
    guess = sinusoid(run.first_harmonic, 0.0, 2 * np.pi / run.period, ratio * FLUTTER)
    cycle = solve_cycle(FAMILY, spring, guess, options=HarmonicOptions(tolerance=1e-13))
    assert run.period == pytest.approx(cycle.period, rel=1e-12)
    assert run.first_harmonic == pytest.approx(cycle.first_harmonic, rel=1e-12)


def test_a_motion_that_never_settles_is_given_up_after_its_cycles():
    # Two wells; neighbours part by many orders, so it is chaos and no slow settling.
    spring, system = Cubic(-0.03, 50.0), at(0.55)
    run = simulate(system, spring, Initial(alpha=5 * DEGREE), SimulateOptions(record=False))
    assert run.state == "aperiodic"
    marching = SimulateOptions(duration=3000.0, decide=False)
    beside = [
        simulate(system, spring, Initial(alpha=(5 + shift) * DEGREE), marching).pitch[-2000:]
        for shift in (0.0, 1e-10)
    ]
    assert np.max(np.abs(beside[0] - beside[1])) > 1e5 * 1e-10 * DEGREE


def test_at_the_flutter_speed_a_motion_settles_for_ever():
    # The linear section is neutral there: the cubic term wears the motion down ever more slowly.
    limits = SimulateOptions(record=False, cycles=50)
    run = simulate(at(1.0), Cubic(1.0, 80.0), Initial(alpha=5 * DEGREE), limits)
    assert run.state == "undecided"
    assert "still drifting" in run.reason


def test_energy_of_a_conservative_oscillator_is_kept():
    # y'' = -(y + y^3): E = y'^2/2 + y^2/2 + y^4/4 is constant, so the motion is a cycle at once,
    # one of a continuum that neither attracts nor repels, and its amplitude is the start.
    run = simulate(DUFFING, Cubic(1.0, 1.0), Initial(state=[0.7, 0.0]))
    y, v = run.states.T
    energy = v**2 / 2 + y**2 / 2 + y**4 / 4
    assert np.ptp(energy) < 1e-12 * energy[0]
    assert run.state == "neutral"
    assert run.amplitude == pytest.approx(0.7, rel=1e-8)


def test_end_states():
    damped = simulate(at(0.9), Cubic(1.0, 3.0), Initial(alpha=5 * DEGREE))
    assert damped.state == "damped"
    assert abs(damped.rest) < 1e-5
    softening = simulate(at(0.95), Cubic(1.0, -3.0), Initial(alpha=60 * DEGREE))
    assert softening.state == "divergent"
    assert np.isfinite(softening.states[:-1]).all()
    short = simulate(
        at(1.05), Cubic(1.0, 3.0), Initial(alpha=5 * DEGREE), SimulateOptions(duration=300.0)
    )
    assert short.state == "undecided"
    assert "300" in short.reason
    assert short.time[-1] == pytest.approx(300.0)


def test_decision_off_marches_on():
    options = SimulateOptions(duration=2500.0, decide=False)
    run = simulate(at(1.1), Cubic(1.0, 3.0), Initial(alpha=5 * DEGREE), options)
    assert (run.state, run.duration) == ("lco", pytest.approx(2500.0))
    silent = simulate(
        at(1.1), Cubic(1.0, 3.0), Initial(alpha=5 * DEGREE), SimulateOptions(record=False)
    )
    assert silent.time.size == 0
    assert silent.amplitude == pytest.approx(run.amplitude, rel=1e-6)
