"""The flow of several springs: against Runge and Kutta, and its Jacobian against differences."""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import oracle_springs as oracle
import pytest

from aeroflutter import (
    Bilinear,
    Freeplay,
    Hysteresis,
    Linear,
    SectionFamily,
    Table,
    TypicalSection,
)
from aeroflutter.model.system import System
from aeroflutter.motion._kernel_roots import WIDTH
from aeroflutter.motion.endstates import end_state
from aeroflutter.motion.flow import Flow
from aeroflutter.motion.step_tables import build
from aeroflutter.springs import Spring
from aeroflutter.springs._kernel_columns import STICK

BELOW, ABOVE, REVERSAL = 1, 2, 3
CASES = oracle.cases(200)
# Every kind of case in turn, so that the light half has every pairing and every kind of system.
LIGHT = [number for number in range(200) if (number // 6) % 4 == 0]
NUMBERS = [
    pytest.param(number, marks=() if number in LIGHT else pytest.mark.slow, id=CASES[number].name)
    for number in range(200)
]
STATES = 1e-8  # of the growth of the variation


def spring_of(law: oracle.Static | oracle.Loop) -> Spring:
    """The package's spring with a law of the oracle's."""
    if isinstance(law, oracle.Loop):
        return Hysteresis(
            law.v1 - law.v2,
            law.h_high - law.h_low,
            0.5 * (law.v1 + law.v2),
            0.5 * (law.h_low + law.h_high),
        )
    low, high = law.breaks[0], law.breaks[-1]
    if law.slopes == (1.0, 0.0, 1.0) and law.offsets[1] == 0.0:
        return Freeplay(high - low, 0.5 * (low + high))
    if len(law.slopes) == 3 and law.slopes[0] == law.slopes[2] == 1.0:
        return Bilinear(low + law.offsets[0], law.slopes[1], low, high - low)
    pitch = np.concatenate(([low - 1.0], law.breaks, [high + 1.0]))
    pieces = np.searchsorted(law.breaks, pitch)
    moments = np.take(law.slopes, pieces) * pitch + np.take(law.offsets, pieces)
    return Table(tuple(pitch), tuple(moments))


def flow_of(case: oracle.Case, **options) -> Flow:
    system = SimpleNamespace(**case.system._asdict())
    return Flow(system, [spring_of(law) for law in case.springs], **options)


def loops(case: oracle.Case) -> list[int]:
    return [i for i, law in enumerate(case.springs) if isinstance(law, oracle.Loop)]


def start(case: oracle.Case) -> np.ndarray:
    """z = (x, memories)."""
    return np.concatenate((case.x, case.memory))


def memories(case: oracle.Case) -> np.ndarray:
    """One number a spring."""
    full = np.zeros(len(case.springs))
    full[loops(case)] = case.memory
    return full


def kind_of(case: oracle.Case, spring: int, kind: int, mode: int) -> str:
    """What the oracle calls an event of the package, by the mode that it led to."""
    if isinstance(case.springs[spring], oracle.Static):
        assert kind in (BELOW, ABOVE)
        return "corner"
    if kind == REVERSAL:
        return "reversal"
    return "stop" if mode == STICK else "slip"


@cache
def reference(number: int) -> oracle.Motion:
    case = CASES[number]
    return oracle.integrate(case.system, case.springs, case.x, case.memory, case.times)


def plain(motion: oracle.Motion) -> bool:
    """Whether no event of a motion comes near to not happening, or to happening once more."""
    slowest = min((event.speed for event in motion.events), default=1.0)
    return motion.clearance > 1e-6 and slowest > 1e-6


@pytest.mark.parametrize("n", [1, 6, 30])
def test_tables_are_the_matrix_exponential_to_round_off(n: int) -> None:
    """All through the step, for badly scaled matrices far from normal, and their derivatives: the
    exponential of [[A, B], [0, 0]] and of the block that its derivative makes, in long doubles."""
    rng = np.random.default_rng(n)
    scale = np.append(10.0 ** rng.uniform(-3, 3, n), [1.0, 1.0])
    even = np.zeros((2, n + 2, n + 2))
    even[:, :n] = rng.normal(size=(2, n, n + 2)) / n
    even[:, :n, :n] += 10.0 * np.triu(rng.normal(size=(2, n, n)), 1) / n
    d_even = even * rng.uniform(0.5, 1.5, even.shape)
    units = scale[:, None] / scale
    C = rng.normal(size=(1, n)) / scale[:n]
    tables = build((even * units)[:, :n], C, d_generator=(d_even * units)[:, :n])
    block = np.concatenate(
        (np.concatenate((even, 0.0 * even), 2), np.concatenate((d_even, even), 2)), 1
    )
    rows_of = tables.flow.shape[1]
    whole_steps = {2.0**j: np.eye(rows_of)[WIDTH + j] for j in range(rows_of - WIDTH)}
    assert len(whole_steps) == (6 if n == 30 else 1)  # many states: up to 32 steps at once
    for s in (0.31, *whole_steps):
        powers = whole_steps.get(s, np.append(s ** np.arange(WIDTH), np.zeros(rows_of - WIDTH)))
        for i, one in enumerate(block):
            whole = exponential(one * (s * tables.step[i]))
            for found, rows in ((tables.flow[i], slice(n)), (tables.d_flow[i], slice(n + 2, -2))):
                M = (powers @ found).reshape(n, n + 2) / units[:n]
                exact = whole[rows, : n + 2]
                assert np.max(np.abs(M - exact)) < 4e-15 * max(1.0, np.max(np.abs(whole)))


def test_tangents_of_many_states_take_many_steps_at_once() -> None:
    """A slow cycle beside fast modes: whole steps by the dozen between switches; by differences."""
    rng, fast = np.random.default_rng(4), 8
    omega = np.append(0.2, 8.0 + 4.0 * np.arange(fast))
    A = np.zeros((18, 18))
    for i, one in enumerate(omega):
        A[2 * i, 2 * i + 1], A[2 * i + 1, 2 * i : 2 * i + 2] = 1.0, (-(one**2), -0.04 * one)
    B = np.zeros((18, 1))
    B[1::2, 0] = np.append(1.0, 0.3 * rng.normal(size=fast))
    C = np.zeros((1, 18))
    C[0, ::2] = np.append(1.0, 0.1 * rng.normal(size=fast))
    dA, dB = 0.1 * rng.normal(size=(18, 18)), rng.normal(size=(18, 1))
    z = np.append([3.0, 0.0], 0.05 * rng.normal(size=16))

    def flow_at(change: float) -> Flow:
        system = System(A + change * dA, B + change * dB, C)
        return Flow(system, [Freeplay(1.0)], derivative=(dA, dB))

    found, h = flow_at(0.0).passage(z, 12.0), 1e-5
    assert len(found.switches) > 2
    assert 12.0 / flow_at(0.0).arrays.step.max() > 40.0
    ways = [
        (flow_at(0.0).passage(z + step, 12.0).end - flow_at(0.0).passage(z - step, 12.0).end)
        for step in h * np.eye(18)
    ]
    ways.append(flow_at(h).passage(z, 12.0).end - flow_at(-h).passage(z, 12.0).end)
    differences = np.array(ways).T / (2.0 * h)
    assert np.max(np.abs(found.jacobian - differences)) < 1e-7 * np.max(np.abs(differences))


def test_the_first_motion_on_tables_made_on_its_way_carries_the_parameter() -> None:
    """A spring of more slopes than are made ready at once: against central differences."""
    family, pitch = SectionFamily(TypicalSection(omega_bar=0.8)), np.linspace(-6.0, 6.0, 42)
    spring = Table(tuple(pitch), tuple(0.2 * pitch + 0.02 * pitch**3))
    z = np.array([0.1, 3.0, 0.2, -0.1, 0.0, 0.3])

    def flow_at(speed: float) -> Flow:
        dA, db = family.derivative(speed)
        return Flow(family.at(speed), [spring], derivative=(dA, db[:, None]))

    first = flow_at(3.9).passage(z, 20.0)
    assert len(first.switches) > 10
    ends = [flow_at(3.9 + step).passage(z, 20.0).end for step in (-1e-5, 1e-5)]
    difference = (ends[1] - ends[0]) / 2e-5
    assert np.max(np.abs(difference)) > 1.0
    assert first.jacobian[:, -1] == pytest.approx(difference, rel=1e-5, abs=1e-5)
    ready = flow_at(3.9)
    ready.prepare(np.arange(ready.arrays.lookup.size))
    ends = [end_state(flow, z, 0.0) for flow in (flow_at(3.9), ready)]
    assert ends[0].state == ends[1].state
    assert ends[0].amplitude == pytest.approx(ends[1].amplitude, rel=1e-9)


def exponential(matrix: np.ndarray) -> np.ndarray:
    """By Taylor's series of a small part, squared again, with eleven bits to spare."""
    halvings = max(0, int(np.ceil(np.log2(np.sum(np.abs(matrix), axis=1).max()))) + 2)
    small = matrix.astype(np.longdouble) / 2**halvings
    term = total = np.eye(len(matrix), dtype=np.longdouble)
    for order in range(1, 25):
        term = term @ small / order
        total = total + term
    for _ in range(halvings):
        total = total @ total
    return total


def test_the_cases_hold_what_they_are_for() -> None:
    """Every pairing, every kind of event in both springs, ties in plenty, hardly any grazing."""
    motions = [reference(number) for number in LIGHT]
    assert {CASES[number].name.split(": ")[1] for number in LIGHT} == {
        f"{one} and {other}" for one in oracle.KINDS for other in oracle.KINDS
    }
    found = {(event.spring, event.kind) for motion in motions for event in motion.events}
    assert found == {(i, kind) for i in (0, 1) for kind in ("corner", "slip", "stop", "reversal")}
    ties = [
        sum(
            abs(a.time - b.time) < 1e-10 and a.spring != b.spring
            for a, b in pairwise(motion.events)
        )
        for motion in motions
    ]
    assert sum(count > 0 for count in ties) >= len(LIGHT) / 4
    assert sum(plain(motion) for motion in motions) > 0.9 * len(LIGHT) - sum(ties)


def test_the_oracle_follows_the_clips_step_by_step() -> None:
    """The law as written, in small steps of the second order: it converges to the oracle."""
    case = CASES[96]
    A, B, C, d = case.system
    duration = 60.0
    exact = oracle.integrate(case.system, case.springs, case.x, case.memory, [duration])
    errors = []
    for steps in (4000, 8000, 16000):
        x, h, dt = case.x.copy(), case.memory.copy(), duration / steps

        def advanced(x, h):
            y = C @ x
            new = [
                np.clip(np.clip(m, v - loop.v1, v - loop.v2), loop.h_low, loop.h_high)
                for m, v, loop in zip(h, y, case.springs, strict=True)
            ]
            return A @ x - B @ (y - new) + d, np.array(new)

        for _ in range(steps):
            first, h = advanced(x, h)
            second, _ = advanced(x + dt * first, h)
            x = x + 0.5 * dt * (first + second)
        errors.append(np.max(np.abs(x - exact.x[0])))
    assert len(exact.events) > 4
    assert errors[-1] < 1e-4
    assert errors[0] / errors[-1] > 8


@pytest.mark.parametrize("number", NUMBERS)
def test_motions_of_two_springs(number: int) -> None:
    """State and memory at three times; advanced from event to event, and in one passage."""
    case, motion, flow = CASES[number], reference(number), flow_of(CASES[number])
    room = STATES * motion.growth * max(1.0, motion.size)
    point, seen = flow.start(case.x, memories(case)), []
    for time, x, memory in zip(case.times, motion.x, motion.memory, strict=True):
        point = flow.advance(point, time - point.time)
        while point.event is not None:
            seen.append(point)
            point = flow.advance(point, time - point.time)
        assert point.time == pytest.approx(time, rel=1e-14)
        assert np.max(np.abs(point.x - x)) < room
        assert np.max(np.abs(point.memory[loops(case)] - memory), initial=0.0) < room
        passage = flow.passage(start(case), time)
        assert np.max(np.abs(passage.end - np.concatenate((x, memory)))) < room
    if plain(motion):
        compare_events(case, motion, seen)


def compare_events(case: oracle.Case, motion: oracle.Motion, seen: list) -> None:
    """Spring by spring, for springs may switch at once in either order."""
    for i in range(len(case.springs)):  # at the start a mode may only be found to be another
        expected = [event for event in motion.events if event.spring == i and event.time > 0]
        found = [point for point in seen if point.event[0] == i and point.time > 0]
        assert [kind_of(case, *point.event, point.modes[i]) for point in found] == [
            event.kind for event in expected
        ]
        for point, event in zip(found, expected, strict=True):
            slack = STATES * motion.growth * max(1.0, motion.size) / event.speed
            assert abs(point.time - event.time) < slack


@pytest.mark.parametrize("number", NUMBERS[::3])
def test_jacobians_of_two_springs(number: int) -> None:
    """Against the oracle's variation, where no event is about to appear."""
    case, motion = CASES[number], reference(number)
    if not plain(motion):
        pytest.skip("an event is about to appear or vanish: the Jacobian jumps")
    end = flow_of(case).passage(start(case), case.times[-1])
    error = np.max(np.abs(end.jacobian[:, :-1] - motion.jacobian[-1]))
    assert error < 1e-7 * motion.growth
    assert not np.any(end.jacobian[:, -1])


@pytest.mark.parametrize("number", NUMBERS[::6])
def test_samples_of_two_springs(number: int) -> None:
    case, motion, flow = CASES[number], reference(number), flow_of(CASES[number])
    samples = 50
    trace = flow.trace(start(case), case.times[-1], samples)
    times = case.times[-1] / samples * np.arange(1, samples)
    expected = oracle.integrate(case.system, case.springs, case.x, case.memory, times)
    room = STATES * motion.growth * max(1.0, motion.size)
    assert trace.states.shape == (samples, case.x.size)
    assert np.max(np.abs(trace.states[0] - case.x)) < 1e-14
    assert np.max(np.abs(trace.states[1:] - expected.x)) < room
    assert np.max(np.abs(trace.end - np.concatenate((motion.x[-1], motion.memory[-1])))) < room


# --- Jacobians against differences ----------------------------------------------------------------


BUSY = [7, 18, 31, 45, 88]  # loops of which both slip, meet a stop and turn back


def differences(end, z: np.ndarray, step: float) -> np.ndarray:
    return np.column_stack(
        [(end(z + step * e) - end(z - step * e)) / (2 * step) for e in np.eye(z.size)]
    )


@pytest.mark.parametrize("seed", BUSY)
def test_jacobian_across_stops_corners_and_reversals_of_both_springs(seed: int) -> None:
    case = oracle.loops_case(seed)
    motion, flow = oracle.integrate(*case[1:]), flow_of(case)
    kinds = {(event.spring, event.kind) for event in motion.events}
    assert kinds == {(i, kind) for i in (0, 1) for kind in ("slip", "stop", "reversal")}
    assert plain(motion)
    duration, z, step = case.times[-1], start(case), 1e-6
    passage = flow.passage(z, duration)
    slopes = differences(lambda z: flow.passage(z, duration).end, z, step)
    assert np.max(np.abs(passage.jacobian[:, :-1] - slopes)) < 1e-6 * motion.growth
    assert np.max(np.abs(passage.jacobian[:, :-1] - motion.jacobian[-1])) < 1e-8 * motion.growth
    later, sooner = (flow.passage(z, duration + sign * step).end for sign in (1, -1))
    assert np.max(np.abs(passage.rate - (later - sooner) / (2 * step))) < 1e-6 * motion.growth


@pytest.mark.parametrize("seed", BUSY[:2])
def test_derivative_with_respect_to_a_parameter(seed: int) -> None:
    """The last column of the Jacobian, for A + p dA and B + p dB."""
    case, rng = oracle.loops_case(seed), np.random.default_rng(5)
    system, duration = case.system, 0.5 * case.times[-1]
    dA, dB = (rng.normal(size=part.shape) * 0.1 for part in (system.A, system.B))

    def end(p: np.ndarray) -> np.ndarray:
        moved = system._replace(A=system.A + p[0] * dA, B=system.B + p[0] * dB)
        return flow_of(case._replace(system=moved)).passage(start(case), duration).end

    found = flow_of(case, derivative=(dA, dB)).passage(start(case), duration).jacobian[:, -1]
    slope = differences(end, np.zeros(1), 1e-7)[:, 0]
    assert np.max(np.abs(slope)) > 1.0
    assert np.max(np.abs(found - slope)) < 1e-5 * np.max(np.abs(slope))


@pytest.mark.parametrize("spring", [0, 1])
@pytest.mark.parametrize("beyond", [-10.0, 10.0])
@pytest.mark.parametrize("place", ["flat", "stop"])
def test_jacobian_of_a_start_whose_memory_the_law_moves(
    spring: int, beyond: float, place: str
) -> None:
    """A memory that does not fit is clipped: y moves it on a flat, nothing does at a stop."""
    case = oracle.loops_case(7)
    flow, law, other = flow_of(case), case.springs[spring], case.springs[1 - spring]
    y = np.empty(2)
    # h is to be y - v1 from below, y - v2 from above; in the middle, or beyond a stop
    y[spring] = 0.5 * (law.h_low + law.h_high) + (law.v1 if beyond < 0 else law.v2)
    if place == "stop":
        y[spring] = law.v2 + law.h_low - 1.0 if beyond < 0 else law.v1 + law.h_high + 1.0
    y[1 - spring] = 0.5 * (other.v1 + other.v2 + other.h_low + other.h_high)
    z = np.concatenate(
        (y, 0.05 * case.x[2:], [0.5 * (each.h_low + each.h_high) for each in (law, other)])
    )
    z[6:] = z[6:][:: 1 if spring == 0 else -1]
    z[6 + spring] = beyond
    passage = flow.passage(z, 0.3)
    slopes = differences(lambda z: flow.passage(z, 0.3).end, z, 1e-7)
    assert np.max(np.abs(passage.jacobian[:, :-1] - slopes)) < 1e-6
    assert not np.any(passage.jacobian[:, 6 + spring])
    assert np.any(passage.jacobian[6 + spring]) == (place == "flat")


# --- events that come and go within a step --------------------------------------------------------

SHORT = pytest.mark.parametrize("depth", [1e-2, 1e-4, 1e-6, 1e-8, 1e-10])


def prescribed(A: np.ndarray, c: np.ndarray, spring: Spring) -> Flow:
    """A motion that its spring does not act on: y(t) is known, and so is every event."""
    n = c.size
    system = SimpleNamespace(A=A, B=np.zeros((n, 1)), C=c[None], d=np.zeros(n))
    return Flow(system, [spring])


def events(flow: Flow, x: np.ndarray, memory: float, duration: float) -> np.ndarray:
    """Times and kinds of all events, (k, 2)."""
    point, found = flow.advance(flow.start(x, [memory]), duration), []
    while point.event is not None:
        found.append((point.time, point.event[1]))
        point = flow.advance(point, duration - point.time)
    return np.array(found).reshape(-1, 2)


@SHORT
def test_a_top_that_barely_passes_an_edge_is_met_both_ways(depth: float) -> None:
    """y = (1 + η) sin t over breaks at ±1; and y = (1 - η) sin t, which meets none."""
    flow = prescribed(np.array([[0.0, 1.0], [-1.0, 0.0]]), np.array([1.0, 0.0]), Freeplay(2.0))
    found = events(flow, np.array([0.0, 1 + depth]), 0.0, 2 * np.pi)
    first = np.arcsin(1 / (1 + depth))
    times = np.array([first, np.pi - first, np.pi + first, 2 * np.pi - first])
    assert found[:, 1].tolist() == [ABOVE, BELOW, BELOW, ABOVE]
    np.testing.assert_allclose(found[:, 0], times, atol=1e-13 / np.sqrt(depth))
    assert not events(flow, np.array([0.0, 1 - depth]), 0.0, 2 * np.pi).size


@SHORT
def test_a_flat_on_which_y_barely_turns_back_is_left_and_taken_up_again(depth: float) -> None:
    """y = (1 - η) t + sin t turns back where cos t = η - 1, until the flat is met again."""
    A = np.zeros((4, 4))
    A[0, 1], A[2, 3], A[3, 2] = 1.0, 1.0, -1.0
    flow = prescribed(A, np.array([1.0, 0.0, 1.0, 0.0]), Hysteresis(0.2, 100.0))
    x = np.array([0.0, 1 - depth, 0.0, 1.0])
    found = events(flow, x, -0.05, 4.0)
    slip, turn, again = found[np.diff(found[:, 0], prepend=-1.0) > 1e-9, 0]  # instants
    assert found[[0, 1, -1], 1].tolist() == [ABOVE, REVERSAL, ABOVE]
    assert slip < turn < again
    assert abs(turn - np.arccos(depth - 1)) < 1e-11 / np.sqrt(depth)

    def y(t: float) -> float:
        return (1 - depth) * t + np.sin(t)

    assert y(again) == pytest.approx(y(turn), abs=1e-14)
    middle = 0.5 * (turn + again)  # there the slider stands where y turned, at h = y - v1
    end = flow.passage(np.append(x, -0.05), middle).end
    assert end[4] == pytest.approx(y(turn) - 0.1, abs=1e-14)
    steady = events(flow, np.array([0.0, 1 + depth, 0.0, 1.0]), -0.05, 4.0)
    assert steady[:, 1].tolist() == [ABOVE]


# --- one spring, many springs ---------------------------------------------------------------------


def one_spring(case: oracle.Case) -> oracle.Case:
    """The first spring alone, the second one's slope 1 taken into A."""
    A, B, C, d = case.system
    kept = case.memory[:1] if isinstance(case.springs[0], oracle.Loop) else case.memory[:0]
    system = oracle.System(A - B[:, 1:] @ C[1:], B[:, :1], C[:1], d)
    return case._replace(system=system, springs=case.springs[:1], memory=kept)


@pytest.mark.parametrize("number", NUMBERS[1::9])
def test_one_spring_is_two_of_which_one_is_linear(number: int) -> None:
    case = CASES[number]
    alone = one_spring(case)
    system = SimpleNamespace(**case.system._asdict())
    both = Flow(system, [spring_of(case.springs[0]), Linear(1.0)])
    expected = oracle.integrate(*alone[1:5], alone.times)
    room = STATES * expected.growth * max(1.0, expected.size)
    for flow in (flow_of(alone), both):
        passage = flow.passage(start(alone), alone.times[-1])
        assert np.max(np.abs(passage.end[: alone.x.size] - expected.x[-1])) < room
        if plain(expected):
            error = passage.jacobian[:, :-1] - expected.jacobian[-1]
            assert np.max(np.abs(error)) < 1e-7 * expected.growth


def test_springs_that_share_a_coordinate_are_their_sum() -> None:
    """Freeplay beside a linear spring on one output is a bilinear spring."""
    case = CASES[0]
    A, B, C, d = case.system
    pair = SimpleNamespace(
        A=A, B=np.repeat(B[:, 1:], 2, axis=1), C=np.repeat(C[1:], 2, axis=0), d=d
    )
    parts = Flow(pair, [Freeplay(1.0), Linear(0.5)])
    whole = Flow(
        SimpleNamespace(A=A, B=B[:, 1:], C=C[1:], d=d),
        [Table((-1.5, -0.5, 0.5, 1.5), (-1.75, -0.25, 0.25, 1.75))],
    )
    ends = [flow.passage(case.x, 30.0) for flow in (parts, whole)]
    assert len(ends[1].switches) > 3
    np.testing.assert_allclose(ends[0].end, ends[1].end, rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(ends[0].jacobian, ends[1].jacobian, rtol=1e-8, atol=1e-8)


def test_the_order_of_the_springs_does_not_matter() -> None:
    for number in LIGHT[:12]:
        case = CASES[number]
        A, B, C, d = case.system
        swapped = SimpleNamespace(A=A, B=B[:, ::-1], C=C[::-1], d=d)
        springs = [spring_of(law) for law in case.springs[::-1]]
        z = np.concatenate((case.x, case.memory[::-1]))
        found = Flow(swapped, springs).passage(z, case.times[-1]).end
        end = flow_of(case).passage(start(case), case.times[-1]).end
        n = case.x.size
        room = STATES * reference(number).growth * max(1.0, reference(number).size)
        assert np.max(np.abs(found[:n] - end[:n])) < room
        assert np.max(np.abs(found[n:][::-1] - end[n:]), initial=0.0) < room
