"""Flutter maps: agreement between engines, invariances, independence of who computes."""

from __future__ import annotations

import numpy as np
import pytest
from marching import event_march

from aeroflutter import Cubic, Freeplay, Hysteresis, Linear, SectionFamily, TypicalSection
from aeroflutter.errors import InputError
from aeroflutter.linear.rootlocus import flutter_speed
from aeroflutter.motion.endstates import EndOptions, end_state
from aeroflutter.motion.flow import Flow
from aeroflutter.motion.response import STATES, Initial, SimulateOptions
from aeroflutter.studies.maps import (
    Axis,
    Grid,
    MapOptions,
    MapStudy,
    Processes,
    SpeedPitch,
    Threads,
    collect,
    flutter_map,
    run,
)
from aeroflutter.studies.maps.attractors import label
from aeroflutter.studies.maps.columns import Room, aim
from aeroflutter.studies.maps.engines import FAILED
from aeroflutter.studies.maps.refine import bisect
from aeroflutter.studies.maps.results import MemoryResults

FAMILY = SectionFamily(TypicalSection(omega_bar=0.8))
FLUTTER = flutter_speed(FAMILY)
SOFT = SectionFamily(TypicalSection(omega_bar=0.2))
RUN14 = Hysteresis(np.radians(1.0), np.radians(0.2))
RUN102 = Hysteresis(np.radians(0.4), np.radians(1.0))
ROOT_EPSILON = 1e-7  # a defective eigenvalue, and what rests on it, is known to sqrt(2^-52) only
RESULTS = ("state", "amplitude_deg", "bias_deg", "period", "rest_deg", "decided_at", "attractor")


def cells(
    ratios: tuple[float, float, int] = (0.86, 0.99, 7),
    pitches: tuple[float, float, int] = (1.0, 15.0, 6),
    spring: object = RUN14,
    factor: float = 1.0,
    family: SectionFamily = FAMILY,
) -> SpeedPitch:
    grid = Grid(
        Axis("speed_ratio", np.linspace(*ratios)),
        Axis("initial.alpha_deg", factor * np.linspace(*pitches)),
    )
    return SpeedPitch(family, spring, grid, flutter_speed(family))


def test_a_cycle_that_a_column_knows_returns_to_the_section_once_a_loop_at_every_speed() -> None:
    """Whatever round-off makes of the return with which its period ends."""
    room = Room.of(FAMILY.c.size)
    for speed in np.linspace(0.95, 0.99, 12) * FLUTTER:
        flow = Flow(FAMILY.at(speed), [RUN14])
        cycle = end_state(flow, [0.0, np.radians(14.0), 0.0, 0.0, 0.0, 0.0], 0.0).cycle
        aim(flow, cycle, 0, room.targets)
        assert room.targets.lag[0] == cycle.loops[0] == 1


def test_blocks_cover_the_grid_once_whatever_its_shape() -> None:
    for nx, ny in ((1, 1), (40, 25), (1000, 1000), (3, 100_000), (100_000, 3)):
        grid = Grid(Axis("speed", np.arange(1.0, nx + 1)), Axis("initial.xi", np.arange(ny)))
        seen = np.zeros((nx, ny), dtype=int)
        for number, block in enumerate(grid.blocks()):
            assert block.number == number
            seen[block.x, block.y] += 1
            assert block.cells <= 8192
        assert np.all(seen == 1)


@pytest.mark.parametrize(
    ("family", "spring", "ratios"),
    [
        (FAMILY, RUN14, (0.86, 0.999, 9)),
        (FAMILY, Hysteresis(np.radians(0.1), np.radians(1.0)), (0.75, 0.99, 5)),
        (SOFT, RUN102, (0.5, 0.99, 9)),
        (FAMILY, Freeplay(np.radians(1.0)), (0.5, 0.99, 5)),
    ],
)
def test_every_cell_ends_as_it_would_alone(family, spring, ratios) -> None:
    """What cells of a column share must not change how any of them ends."""
    found = flutter_map(cells(ratios, (-3.0, 15.0, 10), spring, family=family))
    reference = flutter_speed(family)
    for i, ratio in enumerate(found.grid.x.values):
        prepared = Flow(family.at(ratio * reference), [spring])
        for j, pitch in enumerate(found.grid.y.values):
            start = Initial(alpha=np.radians(pitch)).start(prepared.system, spring)
            alone = end_state(prepared, *start, EndOptions(duration=1e7))
            assert STATES[found.state[i, j]] == alone.state, (ratio, pitch)
            if alone.state in ("lco", "damped"):
                # the same cycle, closed by Newton to round-off from different starts
                assert np.radians(found.amplitude_deg[i, j]) == pytest.approx(
                    alone.amplitude, rel=1e-8
                )
                assert np.radians(found.bias_deg[i, j]) == pytest.approx(
                    alone.bias, abs=ROOT_EPSILON * spring.scale + 1e-8 * alone.amplitude
                )


def test_nothing_is_undecided_on_run_14() -> None:
    found = flutter_map(cells((0.85, 0.999, 40), (1.0, 15.0, 25)))
    assert found.count("undecided") == 0
    assert found.count("damped") + found.count("lco") == found.grid.cells == 1000
    # Table 5.1 has the first limit cycle at 0.922 of the linear flutter speed
    first = found.grid.x.values[np.any(found.state == 1, axis=1)][0]
    assert first == pytest.approx(0.922, abs=0.004)  # one step of the grid


@pytest.mark.parametrize(
    ("family", "spring", "ratio", "pitch"),
    [
        (FAMILY, RUN14, 0.919, 9.705882352941174),
        (
            FAMILY,
            Hysteresis(np.radians(0.1), np.radians(1.0)),
            0.7993103448275862,
            4.655172413793103,
        ),
        (FAMILY, Freeplay(np.radians(1.0)), 0.5586206896551724, -8.793103448275861),
        (SOFT, Freeplay(np.radians(1.0)), 0.1, -15.0),
        (SOFT, Freeplay(np.radians(1.0)), 0.1317241379310345, 3.6206896551724164),
    ],
)
def test_a_switch_to_round_off_is_passed_once(family, spring, ratio, pitch) -> None:
    """At these the bound of one piece's round-off was below the error of the piece before."""
    found = flutter_map(cells((ratio, ratio, 1), (pitch, pitch, 1), spring, family=family))
    assert found.count("undecided") == 0


def test_a_path_is_not_joined_before_the_unstable_cycle_that_it_passes() -> None:
    """Beside it the cell at 15 degrees goes the other way, as SciPy's DOP853 confirms."""
    run101 = Hysteresis(np.radians(0.2), np.radians(1.0))
    ratio = 0.4334782608695652
    found = flutter_map(cells((ratio, ratio, 1), (-14.0, 15.0, 40), run101, family=SOFT))
    system = SOFT.at(ratio * flutter_speed(SOFT))
    start = Initial(alpha=np.radians(15.0)).start(system, run101)
    x, h = event_march(system, run101, *start, 600.0)
    later, _ = event_march(system, run101, x, h, 20.0)
    # at rest within the loop: the pitch that the friction left it with
    assert float(system.c @ later) == pytest.approx(float(system.c @ x), abs=1e-4)
    assert STATES[found.state[0, -1]] == "damped"
    assert found.rest_deg[0, -1] == pytest.approx(np.degrees(system.c @ later), abs=1e-2)


def test_houbolt_sides_with_the_exact_engine_away_from_boundaries() -> None:
    place = ((0.86, 0.96, 4), (8.0, 15.0, 3))
    exact = flutter_map(cells(*place))
    options = MapOptions(march=SimulateOptions(engine="houbolt", dt=0.1, record=False))
    houbolt = flutter_map(cells(*place), options)
    inner = _inner(exact.state)
    assert np.array_equal(exact.state[inner], houbolt.state[inner])
    both = (exact.state == 1) & (houbolt.state == 1) & inner
    assert both.any()
    # second order in the step: 0.1 leaves less than a percent of amplitude
    assert houbolt.amplitude_deg[both] == pytest.approx(exact.amplitude_deg[both], rel=0.01)


def _inner(state: np.ndarray) -> np.ndarray:
    """Cells whose neighbours along x and y end alike."""
    padded = np.pad(state, 1, mode="edge")
    around = (padded[:-2, 1:-1], padded[2:, 1:-1], padded[1:-1, :-2], padded[1:-1, 2:])
    return np.logical_and.reduce([state == other for other in around])


def test_scaling_angles_scales_a_whole_map() -> None:
    base = flutter_map(cells())
    for factor, exactly in ((4.0, True), (3.7, False)):
        scaled = flutter_map(cells(spring=RUN14.scaled(factor), factor=factor))
        assert np.array_equal(base.state, scaled.state)
        tolerance = 1e-15 if exactly else 1e-8  # a power of two is exact up to the degrees
        assert scaled.amplitude_deg == pytest.approx(
            factor * base.amplitude_deg, rel=tolerance, nan_ok=True
        )


def test_an_odd_spring_mirrors_a_whole_map() -> None:
    up = flutter_map(cells())
    down = flutter_map(cells(factor=-1.0))
    assert np.array_equal(up.state, down.state)
    assert down.amplitude_deg == pytest.approx(up.amplitude_deg, rel=1e-8, nan_ok=True)
    assert down.bias_deg == pytest.approx(-up.bias_deg, abs=1e-8, nan_ok=True)
    assert down.rest_deg == pytest.approx(-up.rest_deg, abs=1e-8, nan_ok=True)


class _Backwards:
    """One thread that takes the blocks last first."""

    workers = 1

    def run(self, study, tasks):
        return Threads(1).run(study, list(reversed(tasks)))


def test_results_do_not_depend_on_who_computes() -> None:
    study = MapStudy(cells((0.86, 0.99, 20), (1.0, 15.0, 20)), MapOptions(refine=1e-2))
    assert len(study.grid.blocks()) > 2
    runs = []
    for executor in (Threads(1), Threads(3), _Backwards(), Processes(2)):
        results = MemoryResults(study)
        run(study, results, executor)
        runs.append(collect(study, results))
        assert runs[-1].failures == []
    for name in (*RESULTS, "boundary_x", "boundary_y"):
        for other in runs[1:]:
            assert getattr(other, name).tobytes() == getattr(runs[0], name).tobytes(), name


def test_a_cell_does_not_depend_on_the_other_cells_of_its_column() -> None:
    whole = flutter_map(cells((0.95, 0.95, 1), (1.0, 15.0, 15)))
    part = flutter_map(cells((0.95, 0.95, 1), (8.0, 15.0, 8)))
    assert np.array_equal(whole.state[:, 7:], part.state)
    # the cycle is the same root of the same equations
    assert part.amplitude_deg == pytest.approx(whole.amplitude_deg[:, 7:], rel=1e-9, abs=1e-12)


def test_linear_and_freeplay_and_cubic_springs_have_maps_too() -> None:
    linear = flutter_map(cells((0.9, 1.1, 2), (1.0, 5.0, 2), Linear()))
    assert [STATES[code] for code in linear.state[:, 0]] == ["damped", "divergent"]
    freeplay = flutter_map(cells((0.5, 0.9, 2), (2.0, 8.0, 2), Freeplay(np.radians(1.0))))
    assert freeplay.count("undecided") == 0
    cubic = flutter_map(cells((0.9, 1.05, 2), (2.0, 2.0, 1), Cubic(1.0, 30.0)))
    assert [STATES[code] for code in cubic.state[:, 0]] == ["damped", "lco"]


def test_refined_boundaries_separate_the_states_and_nothing_else() -> None:
    options = MapOptions(refine=1e-6)
    place = ((0.90, 0.94, 4), (2.0, 14.0, 4))
    found = flutter_map(cells(*place), options)
    study = MapStudy(cells(*place), options)
    differs = found.state[1:] != found.state[:-1]
    assert np.array_equal(np.isfinite(found.boundary_x[:-1]), differs)
    assert np.all(np.isnan(found.boundary_x[-1]))
    assert differs.any()
    y = np.broadcast_to(found.grid.y.values, differs.shape)[differs]
    edge = found.boundary_x[:-1][differs]
    assert np.array_equal(study.states(edge - 1e-6, y), found.state[:-1][differs])
    assert np.all(study.states(edge + 1e-6, y) != found.state[:-1][differs])


def test_bisection_closes_in_on_a_known_edge() -> None:
    edge = np.array([0.3, 0.7, -0.2])
    calls = []

    def decide(at, index):
        calls.append(at.size)
        side = np.sign(np.array([1.0, 1.0, -1.0]))[index.astype(int)]
        return (side * (at - edge[index.astype(int)]) > 0).astype(np.int8)

    low, high = np.array([0.0, 0.0, 1.0]), np.array([1.0, 1.0, -1.0])
    of_low = decide(low, np.arange(3.0))
    found = bisect(decide, np.arange(3.0), low, high, of_low, 1e-9)
    assert found == pytest.approx(edge, abs=1e-9)
    assert len(calls) <= 33  # log2 of the range over the width, and the first call


def test_cells_of_one_attractor_share_a_label() -> None:
    state = np.array([[0, 1, 1, 1], [0, 1, 1, 3], [0, 2, 1, 4]], dtype=np.int8)
    amplitude = np.array([[0, 1.0, 1.0, 2.0], [0, 1.05, 2.1, 9], [0, 5.0, 2.2, 0.0]])
    period = np.array([[0, 10.0, 10.0, 30.0], [0, 10.1, 30.1, 9], [0, 5.0, 30.2, 0.0]])
    labels = label(state, amplitude, np.zeros((3, 4)), period, 0, 1e-6)
    assert labels.tolist() == [[1, 2, 2, 3], [1, 2, 3, 0], [1, 4, 3, 0]]
    turned = label(state.T, amplitude.T, np.zeros((4, 3)), period.T, 1, 1e-6)
    assert np.array_equal(turned.T, labels)


def test_mirrored_cycles_are_two_attractors() -> None:
    state = np.ones((1, 2), dtype=np.int8)
    same = np.ones((1, 2))
    labels = label(state, same, np.array([[0.1, -0.1]]), same, 0, 1e-6)
    assert labels.tolist() == [[2, 3]]


class Fragile(MapStudy):
    def compute(self, task):
        if task.number == 1:
            raise FloatingPointError("of all things")
        return super().compute(task)


def test_a_block_that_fails_is_noted_and_the_others_go_on() -> None:
    study = Fragile(cells((0.86, 0.99, 20), (1.0, 15.0, 20)))
    results = MemoryResults(study)
    run(study, results, Threads(2))
    found = collect(study, results)
    [failure] = found.failures
    assert "of all things" in failure["reason"]
    assert "speed_ratio" in failure["block"]
    block = study.grid.blocks()[1]
    assert np.all(found.state[block.x, block.y] == FAILED)
    assert found.count("failed") == block.cells
    assert np.all(np.delete(found.state, np.r_[block.x], axis=0) != FAILED)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Axis("speed", []), "at least one value"),
        (lambda: Axis("speed", [1.0, np.inf]), "finite"),
        (lambda: Axis("speed", [1.0, 3.0, 2.0]), "ascending or descending"),
        (lambda: Grid(Axis("speed", [1.0]), Axis("speed_ratio", [1.0])), "both axes"),
        (lambda: cells((-0.5, 0.5, 3)), "positive"),
        (lambda: MapOptions(refine=0.0), "refine"),
    ],
)
def test_bad_input_is_named(make, words: str) -> None:
    with pytest.raises(InputError, match=words):
        make()
