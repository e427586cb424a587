"""Cubic springs on DOP853: published amplitudes, closed forms, Houbolt, end states."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg

from aeroflutter import Cubic, LureSystem, SectionFamily, TypicalSection
from aeroflutter.rootlocus import flutter_speed
from aeroflutter.timemarch.response import Initial, SimulateOptions, simulate

DEGREE = np.pi / 180
FAMILY = SectionFamily(TypicalSection(omega_bar=0.2))
FLUTTER = flutter_speed(FAMILY)


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


def test_energy_of_a_conservative_oscillator_is_kept():
    # y'' = -(y + y^3): E = y'^2/2 + y^2/2 + y^4/4 is constant, so the motion is a cycle at once
    # and its amplitude is the start.
    system = LureSystem(
        np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([0.0, 1.0]), np.array([1.0, 0.0])
    )
    run = simulate(system, Cubic(1.0, 1.0), Initial(state=[0.7, 0.0]))
    y, v = run.states.T
    energy = v**2 / 2 + y**2 / 2 + y**4 / 4
    assert np.ptp(energy) < 1e-8 * energy[0]
    assert run.state == "lco"
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
