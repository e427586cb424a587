"""Several springs of which one has no straight pieces: series, and what stands on them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from aeroflutter import (
    Cubic,
    Freeplay,
    Friction,
    InputError,
    Linear,
    Polynomial,
    Relay,
    SectionFamily,
    System,
    Table,
    TypicalSection,
)
from aeroflutter.linear.rootlocus import flutter_speed
from aeroflutter.model.family import SectionModel
from aeroflutter.model.section import Flap
from aeroflutter.motion import Initial, SimulateOptions, simulate
from aeroflutter.motion.chaos import ChaosOptions, chaos
from aeroflutter.motion.smooth_laws import SmoothLoop
from aeroflutter.orbits.cycles import cycle_near
from aeroflutter.orbits.cycles.smooth import SmoothFlow
from aeroflutter.orbits.harmonic import HarmonicOptions, sinusoid, solve_cycle
from aeroflutter.orbits.result import Cycle

SECTION = TypicalSection(omega_bar=0.6, zeta_xi=0.01, zeta_alpha=0.01)
TWO = SectionModel(SECTION, springs=["pitch", "heave"])
FLUTTER = flutter_speed(TWO)
FLAPPED = SectionModel(
    TypicalSection(
        omega_bar=0.6, zeta_xi=0.01, zeta_alpha=0.01,
        flap=Flap(hinge=0.5, x_beta=0.0125, r_beta=0.08, omega_beta=4.0),
    ),
    springs=["pitch", "flap", "heave"],
)  # fmt: skip
TABLE = Table((-0.02, -0.01, 0.01, 0.02), (-0.03, -0.003, 0.003, 0.03))
PAIRS = {
    "cubics": (Cubic(1.0, 20.0), Cubic(1.0, 20.0)),
    "gap and cubic": (Freeplay(0.02), Cubic(1.0, 20.0)),
    "polynomial and table": (Polynomial((1.0, -2.0, 30.0)), TABLE),
}


def by_dop853(system, springs, x, time):
    """x(time) by SciPy, stopped and started at every corner of a law."""
    C, corners = system.C, []
    for i, one in enumerate(springs):
        at = one.pieces().breaks if hasattr(one, "pieces") else []
        corners += [lambda _, x, i=i, edge=edge: C[i] @ x - edge for edge in at]
    for corner in corners:
        corner.terminal = True

    def rate(_, x):
        forces = [float(one.moment(y)) for one, y in zip(springs, C @ x, strict=True)]
        return system.A @ x - system.B @ forces + system.load

    t, settings = 0.0, {"method": "DOP853", "rtol": 1e-12, "atol": 1e-15}
    while t < time:
        found = solve_ivp(rate, (t, time), x, events=corners or None, max_step=1.0, **settings)
        t, x = float(found.t[-1]), found.y[:, -1]
        if t < time:  # across the corner
            found = solve_ivp(rate, (t, min(t + 1e-3, time)), x, **settings)
            t, x = float(found.t[-1]), found.y[:, -1]
    return x


@pytest.mark.parametrize("name", PAIRS)
def test_the_motion_is_that_of_dop853(name):
    system, springs = TWO.at(0.9 * FLUTTER), PAIRS[name]
    x = Initial(alpha=0.05, xi=0.02).vector(system)
    options = SimulateOptions(duration=60.0, decide=False, record=False)
    run = simulate(system, springs, Initial(state=x), options)
    assert run.engine == "smooth"
    np.testing.assert_allclose(run.final_state, by_dop853(system, springs, x, 60.0), atol=1e-11)


def test_three_springs_and_a_load():
    known = FLAPPED.at(3.0)
    load = np.zeros(known.order)
    load[4] = 1e-3
    system = System(known.A, known.B, known.C, load, known.names, known.units, known.state_names)
    springs = Freeplay(0.02), TABLE, Polynomial((1.0, 0.0, 5.0, 0.0, 900.0))
    x = Initial(alpha=0.05, xi=0.02, beta=-0.03).vector(system)
    options = SimulateOptions(duration=30.0, decide=False, record=False)
    run = simulate(system, springs, Initial(state=x), options)
    np.testing.assert_allclose(run.final_state, by_dop853(system, springs, x, 30.0), atol=1e-11)
    rest = simulate(system, [Linear(), Cubic(1.0, 9.0), Cubic(1.0, 9.0)], Initial(state=0.1 * x))
    assert rest.state == "damped"
    loop = SmoothLoop.of(system, [Linear(), Cubic(1.0, 9.0), Cubic(1.0, 9.0)])
    still = loop.rest_near(rest.final_state)
    assert still is not None
    assert [one.bias for one in rest.springs] == pytest.approx(system.C @ still, abs=1e-15)
    assert np.max(np.abs(loop.rate(still))) < 1e-17


@pytest.mark.parametrize("name", PAIRS)
def test_cycles_are_those_of_harmonic_balance_and_multipliers_those_of_differences(name):
    """Of the stable cycle that a motion settles on; where laws have corners to what is left out."""
    springs, speed = PAIRS[name], 1.1 * FLUTTER
    run = simulate(TWO.at(speed), springs, Initial(alpha=0.1), SimulateOptions(record=False))
    assert run.state == "lco"
    flow = SmoothFlow(TWO, springs, speed)
    y = flow.trace(run.final_state, run.period, 512).states @ flow.C.T
    Y = (2 * np.fft.rfft(y, axis=0)[:16] / len(y)).T
    Y[:, 0] *= 0.5
    exact = cycle_near(TWO, springs, Y, 2 * np.pi / run.period, speed)
    assert exact.stable
    assert exact.amplitude == pytest.approx(run.amplitude, rel=1e-8)
    assert [one.amplitude for one in exact.springs] == pytest.approx(
        [one.amplitude for one in run.springs], rel=1e-7
    )
    guess = Cycle(Y[0], exact.omega, speed, method="harmonic", outputs=Y)
    balance = solve_cycle(TWO, springs, guess, options=HarmonicOptions(harmonics=31))
    assert balance.omega == pytest.approx(exact.omega, rel=1e-6)
    for one, other in zip(balance.springs, exact.springs, strict=True):
        assert one.amplitude == pytest.approx(other.amplitude, rel=1e-5)
    n, step = exact.state.size, 1e-6 * np.abs(exact.state).max()
    passage = flow.passage(exact.state, exact.period)
    ends = [
        [flow.passage(exact.state + s * step * e, exact.period).end for s in (1, -1)]
        for e in np.eye(n)
    ]
    matrix = np.array([(up - down) / (2 * step) for up, down in ends]).T
    np.testing.assert_allclose(passage.jacobian[:, :n], matrix, atol=1e-6 * np.abs(matrix).max())
    assert run.extras["multiplier"] == pytest.approx(np.abs(exact.multipliers[1]), rel=1e-5)


def test_exponents_of_a_cycle_of_mixed_springs_are_its_multipliers():
    springs, system = PAIRS["gap and cubic"], TWO.at(1.1 * FLUTTER)
    found = chaos(system, springs, Initial(alpha=0.1), ChaosOptions(cycles=200, transient=20))
    run = simulate(system, springs, Initial(alpha=0.1), SimulateOptions(record=False))
    assert found.verdict == "periodic"
    expected = np.log(run.extras["multiplier"]) / run.period
    assert found.exponents.values[1] == pytest.approx(expected, rel=1e-2)


class Sinh(Cubic):
    """F = sinh(a y)/a, of which nothing but its values is known."""

    kind = "sinh"

    def moment(self, alpha, memory=0.0):
        return np.sinh(6.0 * np.asarray(alpha, dtype=float)) / 6.0

    def polynomial(self):
        return None


def test_the_exact_cycle_of_a_law_of_ones_own_is_that_of_harmonic_balance():
    family, law = SectionFamily(TypicalSection(omega_bar=0.2)), Sinh(1.0, 6.0)
    speed = 1.1 * flutter_speed(family)
    options = HarmonicOptions(tolerance=1e-12)
    balance = solve_cycle(family, law, sinusoid(0.2, 0.0, 0.08, speed), options=options)
    exact = cycle_near(family, law, balance.motions[0], balance.omega, speed)
    assert exact.closure < 1e-10
    assert exact.omega == pytest.approx(balance.omega, rel=1e-12)
    assert exact.first_harmonic == pytest.approx(balance.first_harmonic, rel=1e-8)


@pytest.mark.parametrize("law", [Relay(0.01), Friction(0.01)])
def test_a_jump_beside_a_law_without_pieces_is_refused(law):
    with pytest.raises(InputError, match="jumps"):
        simulate(TWO.at(3.0), [law, Cubic(1.0, 20.0)], Initial(alpha=0.1))
    with pytest.raises(InputError, match="jumps"):
        cycle_near(TWO, [law, Cubic(1.0, 20.0)], np.ones((2, 4)), 0.2, 3.0)
