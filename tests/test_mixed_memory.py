"""Loops with memory beside polynomials: motions, Jacobians, rests, cycles, exponents, maps."""

from __future__ import annotations

import numpy as np
import oracle_mixed as oracle
import pytest
from oracle_springs import section

from aeroflutter import (
    ConvergenceError,
    Cubic,
    Freeplay,
    Hysteresis,
    InputError,
    Play,
    Polynomial,
    System,
    TypicalSection,
)
from aeroflutter.linear.rootlocus import flutter_speed
from aeroflutter.model.family import SectionModel
from aeroflutter.motion import Initial, SimulateOptions, simulate
from aeroflutter.motion.basins import joint_basin
from aeroflutter.motion.chaos import ChaosOptions, chaos
from aeroflutter.motion.chaos.smooth_window import passage
from aeroflutter.motion.smooth_laws import SmoothLoop
from aeroflutter.orbits.cycles import CycleOptions, cycle_near, limit_cycles
from aeroflutter.orbits.cycles.smooth import SmoothFlow
from aeroflutter.orbits.harmonic import HarmonicOptions, solve_cycle
from aeroflutter.orbits.result import Cycle
from aeroflutter.springs._kernel_columns import CEILING, FLOOR
from aeroflutter.studies.maps.cells import Group
from aeroflutter.studies.maps.engines import decide

SECTION = TypicalSection(omega_bar=0.6, zeta_xi=0.01, zeta_alpha=0.01)
TWO = SectionModel(SECTION, springs=["pitch", "heave"])
FLUTTER = flutter_speed(TWO)
HINGE, HARDENING = Hysteresis(0.01, 0.02), Cubic(1.0, 20.0)
PAIRS = {
    "hysteresis and cubic": (HINGE, HARDENING),
    "cubic and hysteresis": (HARDENING, HINGE),
    "offset hysteresis and polynomial": (
        Hysteresis(0.01, 0.02, 0.002, 0.003), Polynomial((1.0, -2.0, 30.0)),
    ),
    "play and cubic": (Play(0.01), HARDENING),
}  # fmt: skip

KINDS = ("hysteresis", "play"), ("cubic", "polynomial")


def case(seed):
    """A random section, or one whose two springs are in pitch; springs, their oracle's, a start."""
    rng = np.random.default_rng((17, seed))
    speed = rng.uniform(1.5, 5.0)
    A, B, C, d = section(rng, speed)
    if seed % 5 == 4:
        B, C = np.column_stack((B[:, 0], B[:, 1], 0.4 * B[:, 1])), C[[0, 1, 1]]
    laws = [random_law(rng, KINDS[0][seed % 2]), random_law(rng, KINDS[1][seed // 2 % 2])]
    if len(C) == 3:
        laws.append(random_law(rng, KINDS[0][seed // 3 % 2]))
    else:
        laws = laws[:: rng.choice([1, -1])]
    x = rng.normal(size=6) * np.array([1, 1, 0.2, 0.2, 0, 0])
    memory = rng.uniform(-0.3, 0.3, len(laws))
    springs, others = zip(*laws, strict=True)
    return (A, B, C, d), springs, others, x, memory, 30 * speed


def random_law(rng, kind):
    if kind == "hysteresis":
        v, h, v_off, h_off = rng.uniform([0.1, 0.2, -0.3, -0.3], [0.8, 1.0, 0.3, 0.3])
        loop = oracle.Slider(v_off + v / 2, v_off - v / 2, h_off - h / 2, h_off + h / 2)
        return Hysteresis(v, h, v_off, h_off), loop
    if kind == "play":
        width = rng.uniform(0.2, 0.8)
        return Play(width), oracle.Slider(width / 2, -width / 2, play=True)
    beta = tuple(rng.uniform([0.2, 0.0, 0.1], [1.0, 0.0 if kind == "cubic" else 0.3, 1.0]))
    return (Cubic(beta[0], beta[2]) if kind == "cubic" else Polynomial(beta)), oracle.Power(beta)


def compare(seed):
    """Largest difference from DOP853 over growth and size, and the number of switches."""
    system, springs, others, x, memory, time = case(seed)
    end, held, switches = oracle.march(system, others, x, memory, time)
    options = SimulateOptions(duration=time, decide=False, record=False)
    run = simulate(System(*system), springs, Initial(state=x, memory=memory), options)
    assert run.engine == "smooth"
    loop = SmoothLoop.of(System(*system), springs)
    found = passage(loop, loop.point(x, memory), time)
    growth = max(1.0, np.linalg.norm(found.jacobian, 2))
    size = max(1.0, np.abs(end).max())
    away = [
        np.abs(run.final_state - end).max(),
        np.abs(run.final_memory - held)[loop.held].max(),
        np.abs(found.end - np.append(end, held[loop.held])).max(),
    ]
    return max(away) / (growth * size), switches


@pytest.mark.parametrize("seed", [0, 1, 4, 9])
def test_motions_are_those_of_dop853_with_events(seed):
    away, switches = compare(seed)
    assert switches > 4
    assert away < 1e-8


@pytest.mark.slow
def test_three_hundred_motions_are_those_of_dop853_with_events():
    found = [compare(seed) for seed in range(300)]
    assert sum(switches for _, switches in found) > 3000
    assert max(away for away, _ in found) < 1e-8


@pytest.mark.parametrize("seed", [4, 9])
def test_the_jacobian_is_that_of_differences_of_dop853(seed):
    """Along random directions, of motions that slide, turn and meet stops on the way."""
    system, springs, others, x, memory, time = case(seed)
    loop = SmoothLoop.of(System(*system), springs)
    z = loop.point(x, memory)
    found = passage(loop, z, time / 3)
    assert len(found.switches) > 4
    step, rng = 1e-6, np.random.default_rng(seed)
    for _ in range(2):
        v, ends = rng.normal(size=z.size), []
        for side in (1.0, -1.0):
            at = z + side * step * v
            end, held, _ = oracle.march(system, others, loop.state(at), loop.memories(at), time / 3)
            ends.append(np.append(end, held[loop.held]))
        rise = (ends[0] - ends[1]) / (2 * step)
        size = np.linalg.norm(found.jacobian, 2)
        np.testing.assert_allclose(found.jacobian[:, :-1] @ v, rise, atol=1e-6 * size)


@pytest.mark.parametrize("seed", [315, 561])
def test_a_turn_at_the_edge_that_it_makes_is_no_switch(seed):
    """Where y turns on a flat the loop sticks at its very edge, which round-off may pass."""
    system, springs, others, x, memory, time = case(seed)
    loop = SmoothLoop.of(System(*system), springs)
    _, _, switches = oracle.march(system, others, x, memory, time)
    assert len(passage(loop, loop.point(x, memory), time).switches) == switches


@pytest.mark.parametrize("name", PAIRS)
def test_cycles_are_those_of_harmonic_balance_and_their_derivatives_those_of_differences(name):
    """Of the stable cycle that a motion settles on; of harmonics to what is left out of them."""
    springs, speed = PAIRS[name], 1.1 * FLUTTER
    run = simulate(TWO.at(speed), springs, Initial(alpha=0.1), SimulateOptions(record=False))
    assert run.state == "lco"
    flow = SmoothFlow(TWO, springs, speed)
    z = flow.loop.point(run.final_state, run.final_memory)
    y = flow.trace(z, run.period, 512).states @ flow.C.T
    Y = (2 * np.fft.rfft(y, axis=0)[:16] / len(y)).T
    Y[:, 0] *= 0.5
    exact = cycle_near(TWO, springs, Y, 2 * np.pi / run.period, speed)
    assert exact.stable
    assert exact.closure < 1e-12
    assert exact.switches >= 4  # slides and turns, either way
    assert [one.amplitude for one in exact.springs] == pytest.approx(
        [one.amplitude for one in run.springs], rel=1e-7
    )
    guess = Cycle(Y[0], exact.omega, speed, method="harmonic", outputs=Y)
    balance = solve_cycle(TWO, springs, guess, options=HarmonicOptions(harmonics=31))
    assert balance.omega == pytest.approx(exact.omega, rel=1e-6)
    for one, other in zip(balance.springs, exact.springs, strict=True):
        assert one.amplitude == pytest.approx(other.amplitude, rel=1e-5)
    z = np.append(exact.state, exact.memory[flow.loop.held])
    found = flow.passage(z, exact.period)
    columns = []
    for at in range(z.size + 1):
        step = 1e-6 * (speed if at == z.size else np.abs(z).max())
        ends = []
        for side in (step, -step):
            other = SmoothFlow(TWO, springs, speed + side) if at == z.size else flow
            moved = z + side * np.eye(z.size + 1)[at, :-1]
            ends.append(other.passage(moved, exact.period).end)
        columns.append((ends[0] - ends[1]) / (2 * step))
    matrix = np.array(columns).T
    table = springs[flow.loop.held[0]].piece_table().rows[0]
    moves = table[FLOOR] < z[-1] < table[CEILING]  # at a stop differences have one side
    columns = [*range(z.size - 1), *([z.size - 1] if moves else []), z.size]
    size = np.abs(matrix).max(axis=0)
    size[:-1] = size[:-1].max()
    away = np.abs(found.jacobian - matrix) / size
    assert np.max(away[:, columns]) < 1e-5
    free = 2 if exact.continuum else 1
    largest = np.abs(exact.multipliers[free])
    assert run.extras["multiplier"] == pytest.approx(largest, rel=1e-8)
    values = np.sort(np.abs(np.linalg.eigvals(matrix[:, :-1])))[::-1]
    assert values[free] == pytest.approx(largest, rel=1e-4)


def test_a_family_of_cycles_goes_from_sticking_through_sliding_to_the_stops():
    """Of a hinge with friction in heave: stable and unstable, each closed, as by harmonics."""
    springs = PAIRS["cubic and hysteresis"]
    found = limit_cycles(TWO, springs, CycleOptions(simulations=0))
    (family,) = found.families
    assert max(cycle.closure for cycle in found.cycles) < 1e-10
    assert {0, 4} <= {cycle.switches for cycle in family.cycles}
    assert {True, False} == {cycle.stable for cycle in family.cycles}
    for cycle in [one for one in family.cycles if one.switches][::60]:
        guess = Cycle(
            cycle.outputs[0], cycle.omega, cycle.speed, method="harmonic", outputs=cycle.outputs
        )
        balance = solve_cycle(TWO, springs, guess, options=HarmonicOptions(harmonics=31))
        assert balance.omega == pytest.approx(cycle.omega, rel=1e-5)
        assert balance.springs[0].amplitude == pytest.approx(cycle.amplitude, rel=1e-5)


def test_a_passage_that_switches_more_often_than_a_cycle_is_given_up():
    """Newton's method asks for such motions now and then; they would take for ever."""
    flow = SmoothFlow(TWO, (HINGE, HARDENING), 1.1 * FLUTTER)
    z = flow.loop.point(Initial(alpha=0.1).vector(TWO.at(1.1 * FLUTTER)), 0.0)
    assert len(flow.passage(z, 1000.0).switches) > 100
    with pytest.raises(ConvergenceError, match="regular"):
        flow.passage(z, 1e6)


def test_a_loop_without_friction_has_no_memory():
    system, start = TWO.at(0.8 * FLUTTER), Initial(alpha=0.1)
    options = SimulateOptions(record=False)
    loop = simulate(system, (Hysteresis(0.0, 0.02), HARDENING), start, options)
    gap = simulate(system, (Freeplay(0.02), HARDENING), start, options)
    assert loop.amplitude == gap.amplitude
    assert not np.any(loop.final_memory)


def test_loops_that_switch_at_one_moment_are_one_of_their_sum():
    A, B, C, d = section(np.random.default_rng(5), 3.0)
    start = Initial(state=[0.8, -0.6, 0.1, 0.2, 0.0, 0.0])
    options = SimulateOptions(duration=60.0, decide=False, record=False)
    loop, power = Hysteresis(0.3, 0.5, 0.1, -0.1), Polynomial((0.8, 0.2, 0.6))
    whole = simulate(System(A, B, C, d), (power, loop), start, options)
    halves = np.column_stack((0.5 * B[:, 1], B[:, 0], 0.5 * B[:, 1])), C[[1, 0, 1]]
    both = simulate(System(A, *halves, d), (loop, power, loop), start, options)
    np.testing.assert_allclose(both.final_state, whole.final_state, atol=1e-12)
    np.testing.assert_allclose(both.final_memory[[0, 2]], whole.final_memory[1], atol=1e-12)


def test_a_motion_comes_to_rest_where_its_loop_sticks():
    system = TWO.at(0.6 * FLUTTER)
    run = simulate(system, (HINGE, HARDENING), Initial(alpha=0.004, xi=0.02))
    assert run.state == "damped"
    assert "provably" in run.reason
    loop = SmoothLoop.of(system, (HINGE, HARDENING))
    rest = loop.rest_near(loop.point(run.final_state, run.final_memory))
    assert np.max(np.abs(loop.rate(rest))) < 1e-16
    later = SimulateOptions(duration=2000.0, decide=False, record=False)
    start = Initial(state=run.final_state, memory=run.final_memory)
    on = simulate(system, (HINGE, HARDENING), start, later)
    assert np.array_equal(on.final_memory, run.final_memory)
    np.testing.assert_allclose(on.final_state, loop.state(rest), atol=1e-9)


OSCILLATORS = System(
    np.array([[0, 1, 0, 0], [0, -0.4, 0.1, 0], [0, 0, 0, 1], [0.1, 0, 0, -0.4]]),
    np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 0.0], [0.0, 1.0]]),
    np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]]),
    np.array([0.0, 1.0, 0.0, 0.0]),
)  # fmt: skip


@pytest.mark.parametrize(("memory", "sticks"), [(-0.5, False), (0.2, False), (0.5, True)])
def test_a_rest_is_where_a_loop_can_hold_what_it_has(memory, sticks):
    """A load of one moves the loop to its stop at 0.5, wherever it was before."""
    loop = SmoothLoop.of(OSCILLATORS, (Hysteresis(0.2, 1.0), Cubic(1.0, 0.01)))
    rest = loop.rest_near(loop.point(np.array([0.9, 0.0, 0.1, 0.0]), memory))
    assert (rest is not None) == sticks
    if rest is not None:
        assert np.max(np.abs(loop.rate(rest))) < 1e-14


@pytest.mark.parametrize("edge", [1e-3, 0.05])
def test_no_basin_is_wider_than_the_window_in_which_its_loop_sticks(edge):
    known = OSCILLATORS
    loop = SmoothLoop.of(
        System(known.A, known.B, known.C), (Hysteresis(2 * edge, 1.0), Cubic(1.0, 0.01))
    )
    basin = joint_basin(loop, np.zeros(5))
    reach = np.sqrt(known.C[0] @ np.linalg.solve(basin.form, known.C[0]))
    assert 0.1 * edge < reach < edge * (1 + 1e-12)


def test_samples_tell_memory_and_moment():
    springs, system = (HINGE, HARDENING), TWO.at(0.9 * FLUTTER)
    options = SimulateOptions(duration=40.0, decide=False)
    run = simulate(system, springs, Initial(alpha=0.05), options)
    held = np.empty_like(run.memory)
    held[0] = run.memory[0]
    for i, pitch in enumerate(run.pitch[1:], start=1):
        held[i] = HINGE.advance(held[i - 1], pitch)
    # Between samples pitch may turn within dt: its excess is of second order in dt.
    np.testing.assert_allclose(run.memory, held, atol=2e-5)
    assert np.ptp(run.memory) == pytest.approx(HINGE.delta_h)
    np.testing.assert_allclose(run.moment, run.pitch - run.memory, atol=1e-15)


def test_exponents_of_a_cycle_are_its_multipliers():
    springs, system = (HINGE, HARDENING), TWO.at(1.1 * FLUTTER)
    found = chaos(system, springs, Initial(alpha=0.1), ChaosOptions(cycles=200, transient=20))
    run = simulate(system, springs, Initial(alpha=0.1), SimulateOptions(record=False))
    assert found.verdict == "periodic"
    expected = np.log(run.extras["multiplier"]) / run.period
    assert np.mean(found.exponents.values[1:3]) == pytest.approx(expected, rel=1e-2)
    assert np.ptp(found.memory[:, 0]) < 1e-12  # at the maxima, of which all are one


def test_a_cell_of_a_map_is_decided_as_its_motion():
    springs, system = (HINGE, HARDENING), TWO.at(0.9 * FLUTTER)
    starts = [Initial(alpha=alpha) for alpha in (0.004, 0.1)]
    states, memory = zip(*(one.start(system, springs) for one in starts), strict=True)
    options = SimulateOptions(record=False)
    group = Group(np.arange(2), system, springs, np.array(states), np.array(memory))
    ends = decide(group, options)
    for i, start in enumerate(starts):
        run = simulate(system, springs, start, options)
        assert ends.amplitude[i] == run.amplitude
        assert ends.time[i] == run.duration


def test_a_memory_beside_a_law_of_which_only_values_are_known_is_refused():
    class Sinh(Cubic):
        def polynomial(self):
            return None

    with pytest.raises(InputError, match="only values are known"):
        simulate(TWO.at(3.0), [HINGE, Sinh(1.0, 6.0)], Initial(alpha=0.1))
