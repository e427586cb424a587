"""What decides that a motion is over: each guard of a proof is needed."""

from __future__ import annotations

from functools import cache
from types import SimpleNamespace

import numpy as np
import oracle_springs as oracle
import pytest
import scipy.linalg

from aeroflutter import Freeplay, Hysteresis, SectionFamily, Table, TypicalSection
from aeroflutter.case import load_case
from aeroflutter.linear.rootlocus import flutter_speed
from aeroflutter.model.family import SectionModel
from aeroflutter.motion.endstates import end_state, end_states
from aeroflutter.motion.flow import Flow
from aeroflutter.motion.march import March
from aeroflutter.motion.response import STATES
from aeroflutter.orbits.cycles import cycles_at

LOOP = oracle.Loop(1.0, -1.0, -0.5, 0.5)


def beating(signs: list[list[int]]) -> tuple[oracle.System, np.ndarray]:
    """Three oscillators that are heard together and hardly decay, out of step at first.

    Each is of amplitude 0.48 in the outputs that hear it, by a row of signs; after a while their
    sum comes near 1.44, and two of them alone stay below one.
    """
    blocks = [
        np.array([[-1e-4, frequency], [-frequency, -1e-4]]) for frequency in (0.9, 1.13, 1.47)
    ]
    A, outputs = scipy.linalg.block_diag(*blocks), len(signs)
    C, B = np.zeros((outputs, 6)), np.zeros((6, outputs))
    C[:, ::2], B[1::2] = signs, np.transpose(signs) / np.arange(1, 4)[:, None]
    angles = 2 * np.pi / 3 * np.arange(3)
    x = 0.48 * np.column_stack((np.cos(angles), np.sin(angles))).ravel()
    return oracle.System(A, B, C, np.zeros(6)), x


def package(system: oracle.System) -> SimpleNamespace:
    return SimpleNamespace(**system._asdict())


HEARD = pytest.mark.parametrize(
    "signs",
    [[[1, 1, 1]], [[1, 1, 1], [1, -1, 1]], [[1, 0, 0], [1, -1, 1]], [[1, -1, 1], [1, 0, 0]]],
    ids=["one spring", "two springs", "the second alone", "the first alone"],
)


@HEARD
def test_modes_that_meet_beyond_the_edge_are_not_held_for_a_decay(signs: list[list[int]]) -> None:
    """In its gap the motion decays; before it has, it leaves, to where the spring drives it off."""
    (system, x), outputs = beating(signs), len(signs)
    law = oracle.continuous((-1.0, 1.0), (-2.0, 0.0, -2.0), -2.0)
    times = np.array([150.0])
    truth = oracle.integrate(system, [law] * outputs, x, [], times)
    assert truth.size > 100.0
    flow = Flow(package(system), [Table((-2.0, -1.0, 1.0, 2.0), (2.0, 0.0, 0.0, -2.0))] * outputs)
    assert end_state(flow, x, 0.0).state == "divergent"
    quiet = end_state(flow, 0.69 * x, 0.0)  # all three stay below one
    assert (quiet.state, quiet.rest) == ("damped", pytest.approx(0.0, abs=1e-12))
    assert not oracle.integrate(system, [law] * outputs, 0.69 * x, [], times).events


@HEARD
def test_what_is_damped_never_switches_again(signs: list[list[int]]) -> None:
    """From where a march was ended, the loops neither slip nor meet a stop any more."""
    (system, x), outputs = beating(signs), len(signs)
    closed = system._replace(A=system.A + system.B @ system.C)  # on the stick: as they are
    flow = Flow(package(closed), [Hysteresis(2.0, 1.0)] * outputs)
    end = end_state(flow, x, np.zeros(outputs))
    assert end.state == "damped"
    assert oracle.integrate(closed, [LOOP] * outputs, x, np.zeros(outputs), [end.time]).events
    memory, state = np.atleast_1d(end.final_memory), np.asarray(end.final_state)
    assert not oracle.integrate(closed, [LOOP] * outputs, state, memory, [300.0]).events
    rest = -closed.C @ np.linalg.solve(system.A, system.B @ memory)  # A x + B h = 0
    assert end.rest == pytest.approx(rest[0], abs=1e-12)


def ends_on_a_cycle(flow: Flow, z: np.ndarray, period: float) -> bool:
    """By waiting: until there are no more switches, or for two thousand periods."""
    for _ in range(40):
        passage = flow.passage(z, 50 * period)
        if not passage.switches:
            return False
        z = passage.end
    return True


@cache
def beside_a_fold():
    """Flow just above a fold of run 14, the unstable cycle there and the stable one."""
    case = load_case("run14")
    speed = 0.921514 * flutter_speed(case.family())
    found = cycles_at(case.family(), case.spring, speed).cycles
    return Flow(case.family().at(speed), [case.spring]), *sorted(found, key=lambda c: c.amplitude)


def test_a_cycle_attracts_only_what_is_seen_to_come_to_it() -> None:
    """Just above a fold, motions that pass by the stable cycle on the far side of the unstable one.

    They come closer turn by turn, and then go away for good. On a line across the unstable cycle
    every verdict is what waiting shows.
    """
    flow, small, large = beside_a_fold()
    assert (small.stable, large.stable) == (False, True)
    across = small.state - large.state
    aside = 0.004 * np.abs(small.state) * np.random.default_rng(3).normal(size=6)
    states = [small.state + aside + part * across for part in np.linspace(-4.0, -2.6, 29)]
    found = end_states(flow, np.array(states), small.memory)
    verdicts = [STATES[code] for code in found.state]
    waited = [
        "lco" if ends_on_a_cycle(flow, np.append(state, small.memory), small.period) else "damped"
        for state in states
    ]
    assert set(waited) == {"lco", "damped"}
    assert verdicts == waited


def test_nothing_passes_for_attracted_by_chance() -> None:
    """Beyond the unstable cycle, where what decays fast makes two returns look like an approach."""
    flow, small, large = beside_a_fold()
    starts = []
    for seed, parts in ((4, (-6.67, -7.33)), (0, (-4.67,))):
        aside = 0.012 * np.abs(small.state) * np.random.default_rng(seed).normal(size=6)
        starts += [small.state + aside + part * (small.state - large.state) for part in parts]
    found = end_states(flow, np.array(starts), small.memory)
    assert [STATES[code] for code in found.state] == ["damped"] * 3


# --- two springs ----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def two_hinges():
    """The section with a loop in pitch and a gap in heave, by its share of the flutter speed."""
    section = TypicalSection(omega_bar=0.8)
    model = SectionModel(section, springs=("pitch", "heave"))
    flutter = flutter_speed(SectionFamily(section))
    return lambda ratio: Flow(model.at(ratio * flutter), [Hysteresis(1.0, 0.2), Freeplay(0.3)])


@pytest.mark.parametrize("ratio", [0.9, 0.93, 0.95])
def test_a_cycle_of_two_springs_closes_with_the_multipliers_of_differences(two_hinges, ratio):
    flow = two_hinges(ratio)
    end = end_state(flow, [0.5, 6.0, 0.0, 0.0, 0.0, 0.0], [0.1, 0.0])
    assert end.state == "lco"
    z, step = end.cycle.z[0, :7], 1e-6
    passage = flow.passage(z, end.period)
    assert {spring for spring, *_ in passage.switches} == {0, 1}  # both take part
    np.testing.assert_allclose(passage.end, z, rtol=0, atol=1e-12)
    numeric = [
        (flow.passage(z + h, end.period).end - flow.passage(z - h, end.period).end) / (2 * step)
        for h in step * np.eye(7)
    ]
    found, expected = (
        np.sort(np.abs(np.linalg.eigvals(matrix)))
        for matrix in (passage.jacobian[:, :7], np.transpose(numeric))
    )
    # Central differences: round-off of the passage over the step.
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-8)
    assert found[-1] == pytest.approx(1.0, abs=1e-9)  # along the flow
    assert found[-2] == pytest.approx(end.multiplier, abs=1e-9)


@pytest.mark.parametrize("pitch", [1.0, 1.5, 2.0, 3.0, 6.0])
def test_the_rest_of_two_springs_is_where_the_motion_goes(two_hinges, pitch):
    flow = two_hinges(0.97)
    start, memory = [0.5, pitch, 0.0, 0.0, 0.0, 0.0], [0.1, 0.0]
    end = end_state(flow, start, memory)
    assert end.state == "damped"
    march = March(flow, flow.begin(start, memory))
    march.run(6000.0)
    assert flow.C[0] @ march.point().x == pytest.approx(end.rest, abs=1e-10)


@pytest.mark.parametrize("beside", [np.inf, 0.3, 0.0])
def test_motions_that_pass_a_known_cycle_find_their_own(
    monkeypatch: pytest.MonkeyPatch, beside: float
) -> None:
    """However near counts as going to a known cycle, a motion that closes elsewhere is heard."""
    monkeypatch.setattr("aeroflutter.motion.judge.BESIDE", beside)
    family = SectionFamily(TypicalSection(omega_bar=0.2))
    speed = flutter_speed(family)
    assert speed is not None
    states = 3.0 * np.random.default_rng(1).normal(size=(10, 6))
    found = end_states(Flow(family.at(0.7 * speed), [Freeplay(1.0)]), states, 0.0, share=True)
    assert {STATES[code] for code in found.state} == {"lco"}
    assert sorted(np.round(found.cycles.amplitude, 4)) == [1.5946, 1.8324, 1.8324]
    assert np.ptp(found.cycles.bias) > 0.4  # mirror images are two
