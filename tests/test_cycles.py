"""Exact limit cycles: identities, other methods, published numbers."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from marching import event_march

from aeroflutter.case import load_case
from aeroflutter.errors import ConvergenceError, InputError
from aeroflutter.linear.rootlocus import flutter_speed
from aeroflutter.model.lure import FixedFamily, LureFamily, SampledFamily, SectionFamily
from aeroflutter.model.section import TypicalSection
from aeroflutter.motion.endstates import end_state
from aeroflutter.motion.flow import Flow
from aeroflutter.orbits.continuation import State
from aeroflutter.orbits.cycles import Cycle, CycleOptions, LimitCycles, cycles_at, limit_cycles
from aeroflutter.orbits.cycles.leg import Leg, _change, changes
from aeroflutter.orbits.cycles.search import Search
from aeroflutter.springs import Bilinear, Freeplay, Hysteresis, Linear, Spring, Table

CHUNG = 6.2851  # U*_L as Chung, He & Lee 2009 round it; their speeds are multiples of it
PLAIN = CycleOptions(simulations=0, depth=0)
QUICK = replace(PLAIN, points=30)


@cache
def branch(run: str) -> LimitCycles:
    """The branch of a built-in case, computed once."""
    case = load_case(run)
    return limit_cycles(case.family(), case.spring)


@cache
def section(omega_bar: float = 0.8, a_h: float = -0.5) -> SectionFamily:
    return SectionFamily(TypicalSection(omega_bar=omega_bar, a_h=a_h))


def speeds(result: LimitCycles, kind: str, family: int = 1) -> list[float]:
    """U* of the bifurcations of one kind on one family, ascending."""
    return sorted(
        event.cycle.speed
        for event in result.bifurcations
        if event.kind == kind and event.cycle.family == family
    )


def misses(family: LureFamily, spring: Spring, cycle: Cycle) -> float:
    """What a march by DOP853 misses after one period, over the size of the state."""
    system = family.at(cycle.speed)
    x, h = event_march(system, spring, cycle.state, cycle.memory, cycle.period, rtol=1e-13)
    missed = np.max(np.abs(x - cycle.state) / np.max(np.abs(cycle.state)))
    return max(float(missed), abs(h - cycle.memory) / cycle.amplitude)


# --- Chung, He & Lee 2009: delta_v = delta_h, mu = 100, omega_bar = 0.2 -------------------------


def test_fold_and_broken_symmetry_of_chung_he_and_lee_in_their_order() -> None:
    """They print eight digits, relative to U*_L = 6.2851."""
    fold = min(speeds(branch("run103"), "fold"))
    broken = min(speeds(branch("run103"), "symmetry-breaking"))
    assert abs(fold / CHUNG - 0.67892265) < 1e-8
    assert abs(broken / CHUNG - 0.67892272) < 1e-8
    assert fold < broken


def test_period_and_multipliers_of_chung_he_and_lee() -> None:
    """Period 105.6 at 0.70 on the unstable branch. At 0.85 two independent event-exact
    computations give 82.804 and -0.0937 ± 0.1485i; the paper's 82.78 and 0.0955 ± 0.1477i belong
    to 0.8502, with the sign of the real part misprinted."""
    family, spring = section(0.2), load_case("run103").spring
    small, large = cycles_at(family, spring, 0.70 * CHUNG, QUICK).cycles
    assert not large.stable
    assert abs(large.period - 105.6) < 0.05
    assert not small.stable
    stable = cycles_at(family, spring, 0.85 * CHUNG, QUICK).cycles[-1]
    assert stable.stable
    assert abs(stable.period - 82.804) < 5e-4
    assert abs(stable.multipliers[1].real + 0.0937) < 5e-5
    assert abs(abs(stable.multipliers[1].imag) - 0.1485) < 5e-5
    printed = cycles_at(family, spring, 0.8502 * CHUNG, QUICK).cycles[-1]
    assert abs(printed.period - 82.78) < 5e-3
    assert abs(printed.multipliers[1].real + 0.0955) < 2e-4
    assert abs(abs(printed.multipliers[1].imag) - 0.1477) < 1e-4


def test_symmetric_cycle_of_chung_he_and_lee_is_stable_above_where_symmetry_heals() -> None:
    """Printed 0.8152; recomputed by others 0.8155."""
    event = max(
        (e for e in branch("run103").bifurcations if e.kind == "symmetry-breaking"),
        key=lambda e: e.cycle.speed,
    )
    assert abs(event.cycle.speed / CHUNG - 0.8155) < 1e-4
    assert event.stable_beside == (False, True)
    above = [
        c for c in branch("run103").families[0].cycles if c.amplitude > event.cycle.amplitude * 1.01
    ]
    assert len(above) > 50
    assert all(cycle.stable for cycle in above)


# --- every cycle ---------------------------------------------------------------------------------

RUNS = ("run6", "run10", "run14", "run15", "run16", "run101", "run102", "run103", "run111")


@pytest.mark.parametrize("run", RUNS)
def test_every_cycle_closes_and_has_the_multiplier_one(run: str) -> None:
    """Twice in a continuum of bias."""
    cycles = branch(run).cycles
    assert len(cycles) >= 200
    assert max(cycle.closure for cycle in cycles) < 1e-10
    for cycle in cycles:
        ones = np.sort(np.abs(cycle.multipliers - 1.0))[: 2 if cycle.continuum else 1]
        assert np.all(ones < 1e-8)


@pytest.mark.parametrize("run", ["run14", "run102", "run103"])
def test_cycles_close_under_dop853(run: str) -> None:
    """An integrator that shares nothing with the exact flow; its own error is magnified by the
    largest multiplier."""
    case = load_case(run)
    chosen = branch(run).cycles[5 :: len(branch(run).cycles) // 6]
    assert {cycle.stable for cycle in chosen} == {True, False}
    for cycle in chosen:
        worst = max(1.0, float(np.abs(cycle.multipliers).max()))
        assert misses(case.family(), case.spring, cycle) < 1e-10 * worst


@pytest.mark.parametrize(
    ("run", "lost_by"),
    [
        ("run6", "neimark-sacker"),
        ("run10", "neimark-sacker"),
        ("run14", "fold"),
        ("run15", "fold"),
        ("run16", "neimark-sacker"),
        ("run111", "fold"),
    ],
)
def test_onset_is_a_fold_and_stability_is_lost_there_or_above(run: str, lost_by: str) -> None:
    """What the events mean, seen in the multipliers: one passes 1, or a pair the unit circle."""
    onset, stable = branch(run).onset, branch(run).stable_onset
    assert onset is not None
    assert stable is not None
    assert (onset.kind, stable.kind) == ("fold", lost_by)
    assert onset.stable == (lost_by == "fold")
    others = onset.cycle.multipliers[1:]
    assert np.abs(others - 1.0).min() < 1e-6
    if lost_by == "fold":
        assert stable.cycle.speed == onset.cycle.speed
    else:
        assert stable.cycle.speed_ratio > onset.cycle.speed_ratio + 2e-4
        pair = stable.cycle.multipliers[1:3]
        assert abs(pair[0].imag) > 0.01
        assert np.abs(np.abs(pair) - 1.0).max() < 1e-8


@pytest.mark.slow
@pytest.mark.parametrize("run", ["run6", "run10", "run14", "run15", "run16", "run111", "run103"])
def test_onsets_stay_to_1e_10_when_every_step_is_halved(run: str) -> None:
    case = load_case(run)
    options = CycleOptions(step=0.01, max_step=0.06, points=400)
    fine, coarse = limit_cycles(case.family(), case.spring, options), branch(run)
    for name in ("onset", "stable_onset"):
        one, other = getattr(fine, name), getattr(coarse, name)
        assert one.kind == other.kind
        assert abs(one.cycle.speed_ratio - other.cycle.speed_ratio) < 1e-10


@pytest.mark.parametrize("run", ["run101", "run102", "run103"])
def test_branches_with_broken_sequences_are_followed_to_their_ends(run: str) -> None:
    """From the linear cycle at U*_L, where the slider begins to slide, to fifty times the scale;
    on the way the sequence of switches changes and the curve turns back."""
    main = branch(run).families[0]
    ends = " | ".join(main.stopped)
    assert "no longer switches" in ends
    assert "50 times the spring's scale" in ends
    ratios = [cycle.speed_ratio for cycle in main.cycles]
    assert abs(max(ratios[0], ratios[-1]) - 1.0) < 1e-6
    inside = [event for event in main.bifurcations if event.cycle.speed_ratio < 0.999]
    assert sum(event.kind in ("grazing", "corner") for event in inside) >= 3
    assert len({cycle.switches for cycle in main.cycles}) > 1


def test_motions_end_on_stable_cycles_and_leave_unstable_ones() -> None:
    """Freeplay at omega_bar = 0.2, where several attractors share a speed: the exact engine's end
    state from one part in a thousand beside a cycle."""
    case = load_case("run100")
    seen = set()
    for family in branch("run100").families[:5]:
        for cycle in family.cycles[5 :: max(1, len(family.cycles) // 6)]:
            margin = np.abs(cycle.multipliers[1:]).max() - 1.0
            if abs(margin) < 0.05:
                continue  # decides too slowly to be told
            prepared = Flow(case.family().at(cycle.speed), [case.spring])
            end = end_state(prepared, 1.001 * cycle.state, 0.0)
            near = end.state == "lco" and abs(end.amplitude / cycle.amplitude - 1.0) < 1e-8
            assert near == cycle.stable
            seen.add((family.symmetric, cycle.stable))
    assert seen == {(True, True), (True, False), (False, True), (False, False)}


def test_preloaded_freeplay_of_price_alighanbari_and_lee() -> None:
    """Price, Alighanbari & Lee 1995, M0 = alpha_f = 0.25, delta = 0.5, M_f = 0.05: period-1 cycles
    from U/U*_L = 0.83 (read off a figure in steps of 0.01), period-2 ones below."""
    spring = Bilinear(0.25, 0.05, 0.25, 0.5)
    found = limit_cycles(section(0.2), spring, replace(PLAIN, depth=1, points=60))
    healed = max(e.cycle.speed_ratio for e in found.bifurcations if e.kind == "period-doubling"
                 and e.cycle.family == 1)  # fmt: skip
    assert abs(healed - 0.83) < 0.005
    doubled = [one for one in found.families if one.parent == 1]
    assert any(cycle.stable and cycle.speed_ratio < 0.83 for cycle in doubled[0].cycles)
    assert not any(cycle.symmetric for cycle in found.cycles)
    assert max(abs(cycle.bias) for cycle in found.families[0].cycles) > 0.1


# --- families that no other family leads to ------------------------------------------------------


def test_isolated_cycles_of_run_103_exist() -> None:
    """A closed curve of symmetric cycles far below the fold of Chung, He & Lee, on which few
    motions from rest end: checked by DOP853, and by a motion that ends there."""
    case = load_case("run103")
    found = branch("run103")
    assert found.onset is not None
    isolated = next(f for f in found.families if any("closes" in stop for stop in f.stopped))
    assert isolated.symmetric
    assert abs(found.onset.cycle.speed_ratio - min(c.speed_ratio for c in isolated.cycles)) < 1e-12
    assert found.onset.cycle.speed_ratio < 0.6
    for wanted in (True, False):
        cycle = next(c for c in isolated.cycles if c.stable is wanted)
        worst = max(1.0, float(np.abs(cycle.multipliers).max()))
        assert misses(case.family(), case.spring, cycle) < 1e-10 * worst
    cycle = next(c for c in isolated.cycles if c.stable and np.abs(c.multipliers[1:]).max() < 0.9)
    prepared = Flow(case.family().at(cycle.speed), [case.spring])
    end = end_state(prepared, 1.01 * cycle.state, 1.01 * cycle.memory)
    assert end.state == "lco"
    assert abs(end.amplitude / cycle.amplitude - 1.0) < 1e-8


def test_period_two_motion_of_price_alighanbari_and_lee() -> None:
    """Price, Alighanbari & Lee 1995 report period-2 motion for 0.75-0.80 of U*_L and none from
    there to 0.83 (from one initial pitch, in steps of 0.01). Price 1994 gives its frequency with
    a flat of no slope as 0.335 omega_alpha at 0.79, in three digits."""
    options = CycleOptions(depth=0)
    found = limit_cycles(section(0.2), Bilinear(0.25, 0.05, 0.25, 0.5), options)
    isolated = next(f for f in found.families if any("closes" in stop for stop in f.stopped))
    ratios = [cycle.speed_ratio for cycle in isolated.cycles if cycle.stable]
    assert min(ratios) < 0.75
    assert 0.80 < max(ratios) < 0.81
    speed = 0.79 * found.flutter_speed
    (stable,) = (
        cycle
        for cycle in cycles_at(section(0.2), Bilinear(0.25, 0.0, 0.25, 0.5), speed, options).cycles
        if cycle.stable
    )
    assert abs(stable.k * speed - 0.335) < 0.0005


def test_no_family_stands_still_where_the_memory_meets_a_stop() -> None:
    """Newton's method seems to converge there on either side of a corner, with steps that lead
    nowhere, until the walk has taken all the steps it may."""
    assert "could not be followed further" not in " ".join(branch("run101").notes)


@pytest.mark.parametrize("run", ["run100", "run103", "preload-02"])
def test_a_branch_of_doubled_period_ends_on_its_parent_and_does_not_close(run: str) -> None:
    """Followed on, it would come back half a period late, and its seed would look like an edge."""
    (closed,) = (f for f in branch(run).families if any("closes" in s for s in f.stopped))
    assert closed.onset is not None
    assert closed.onset.kind == "fold"


@pytest.mark.parametrize("factor", [1.0, 0.9])
def test_a_branch_of_doubled_period_ends_on_its_parent_whatever_the_round_off(
    factor: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The branch leaves its parent where that grazes, with a kink: shorter internal steps change
    how the walk meets it there, and nothing else."""
    from aeroflutter.motion import step_tables

    longest = step_tables._stretch
    monkeypatch.setattr(step_tables, "_stretch", lambda *given: factor * longest(*given))
    case = load_case("run103")
    options = CycleOptions(speed_ratio_range=(0.67, 0.82), simulations=0, points=10)
    found = limit_cycles(case.family(), case.spring, options).families
    (doubled,) = (f for f in found if "period-doubling" in f.origin)
    assert "comes back" in doubled.ends[1]
    ends = sorted(doubled.cycles[i].speed_ratio for i in (0, -1))
    assert np.allclose(ends, (0.709707, 0.720030), atol=2e-6)


def test_a_walk_that_steps_over_to_the_parent_has_come_back() -> None:
    """On the parent what a cycle differed from it by does not change its sign: it is zero."""
    search = Search(section(0.8, -0.2), Freeplay(0.02), QUICK)
    search.run()
    parent, own = (
        next(f for f in search.families if f.facts.symmetric == wanted) for wanted in (True, False)
    )
    near, beyond = own.strands[0].places[2:4]
    leg = replace(near.leg, halves=(-1.0,))
    assert not leg.comes_back(near.state.x, beyond.state.x)
    for place in parent.strands[0].places[:8]:  # of which round-off may change the sign for some
        assert leg.comes_back(near.state.x, place.state.x)


def test_changes_that_round_off_makes_come_to_an_end(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside a corner the sequence may change at every look, at one speed."""
    looks = [0]

    def change(_: object, state: State, beyond: State) -> tuple[State, State]:
        looks[0] += 1
        return state, replace(state, x=np.array([float(looks[0]), 0.5]))

    leg = SimpleNamespace(
        switches=lambda x: ((0, int(x[0])),), walk=SimpleNamespace(scale=np.ones(2))
    )
    monkeypatch.setattr("aeroflutter.orbits.cycles.leg._change", change)
    monkeypatch.setattr("aeroflutter.orbits.cycles.leg._left", lambda *_: 0.0)
    old = State(np.array([0.0, 0.4]), np.array([0.0, 1.0]), 0.0)
    found = changes(cast(Leg, leg), old, replace(old, x=np.array([-1.0, 0.6])))
    assert len(found) <= 12
    assert looks[0] < 100


FOLDED = TypicalSection(
    omega_bar=0.7421741270109511, mu=93.77995260266562, a_h=0.0905644338124173,
    x_alpha=0.30199923470544693, r_alpha=0.566277543927686, zeta_alpha=0.0011305020315578625,
    zeta_xi=0.0012407119839287794,
)  # fmt: skip


@pytest.mark.parametrize(
    ("family", "spring", "count"),
    [
        (SectionFamily(FOLDED), Freeplay(1.0), 2),  # a seed a hair off the fold
        (section(0.25), Bilinear(0.0, 0.71, 0.0317, 0.476), 1),  # cycles of any size at one speed
    ],
)
def test_a_seed_on_a_known_family_starts_no_other(
    family: SectionFamily, spring: Spring, count: int
) -> None:
    """Where the speed does not tell cycles apart: at a fold, and where a loop is homogeneous."""
    found = limit_cycles(family, spring, replace(PLAIN, points=10)).families
    assert len(found) == count


def test_what_hardly_closes_is_left_out_and_counted() -> None:
    """Friction a hundred millionth of the gap: where the slider's place decides everything, some
    starts lead to nothing that closes. They end no search and make no family."""
    case = load_case("run103", {"spring.delta_v_deg": 1e-8})
    options = replace(PLAIN, speed_ratio_range=(0.15, 0.25), points=10, max_states=20)
    found = limit_cycles(case.family(), case.spring, options)
    assert found.families
    assert all(family.cycles for family in found.families)
    assert any("led to what does not close" in note for note in found.notes)
    stops = [stop for family in found.families for stop in family.stopped]
    # round-off may give Newton's method the last word on one of them
    assert sum("20 cycles were followed" in stop for stop in stops) >= len(stops) - 1


# --- invariances ---------------------------------------------------------------------------------


def test_a_cycle_larger_than_what_is_followed_is_not_passed_over_in_silence() -> None:
    """Cycles of a gap grow without end towards the flutter speed, like the gap over what is left of
    the speed: at 1 - 1e-4 of it the largest is found, at 1 - 1e-7 it is said that it is not."""
    flutter = flutter_speed(section())
    assert flutter is not None
    near = cycles_at(section(), Hysteresis(1.0, 0.2), (1 - 1e-4) * flutter, QUICK)
    assert near.cycles[-1].amplitude > 600.0
    assert not near.branch.notes
    nearer = cycles_at(section(), Hysteresis(1.0, 0.2), (1 - 1e-7) * flutter, QUICK)
    assert nearer.cycles[-1].amplitude < 1.0
    assert "no further than to 2000 times" in nearer.branch.notes[0]


def test_the_spring_is_scale_free() -> None:
    one = limit_cycles(section(), Hysteresis(1.0, 0.2), QUICK)
    other = limit_cycles(section(), Hysteresis(1e-3, 2e-4), QUICK)
    assert one.onset is not None
    assert other.onset is not None
    assert abs(one.onset.cycle.speed / other.onset.cycle.speed - 1.0) < 1e-10
    assert abs(one.onset.cycle.amplitude / other.onset.cycle.amplitude / 1e3 - 1.0) < 1e-6


def test_an_offset_of_the_gap_only_moves_the_motion_where_pitch_rests_freely() -> None:
    """a_h = -1/2: motion about (H_off, -2 H_off U²/(mu omega_bar²)) is that of the centred loop."""
    speed = 0.95 * 4.114540148067488
    plain = cycles_at(section(), Hysteresis(1.0, 0.2), speed, QUICK).cycles
    moved = cycles_at(section(), Hysteresis(1.0, 0.2, h_off=0.5), speed, QUICK).cycles
    assert len(plain) == len(moved) == 2
    for one, other in zip(plain, moved, strict=True):
        assert abs(one.amplitude - other.amplitude) < 1e-10
        assert abs(other.bias - one.bias - 0.5) < 1e-10
        assert misses(section(), Hysteresis(1.0, 0.2, h_off=0.5), other) < 1e-9


def test_offset_of_the_moment_makes_every_cycle_biased() -> None:
    spring = Hysteresis(1.0, 0.5, v_off=0.25, h_off=0.3)
    found = cycles_at(section(0.8, -0.4), spring, 0.95 * 3.920433920458305, QUICK).cycles
    assert len(found) == 2
    for cycle in found:
        assert not cycle.symmetric
        assert abs(cycle.bias) > 0.01
        assert misses(section(0.8, -0.4), spring, cycle) < 1e-9


def test_cycles_of_a_hardening_table_begin_at_an_edge() -> None:
    """Soft inside, stiff outside: the section flutters on the inner slope, and cycles begin where
    they reach the first break, at the flutter speed of that slope."""
    spring = Bilinear(-0.25, 0.5, -0.5, 1.0)
    found = limit_cycles(section(), spring, QUICK)
    assert found.onset is not None
    assert found.onset.kind == "edge"
    assert found.onset.stable
    inner = flutter_speed(section(), 0.5)
    assert inner is not None
    assert abs(found.onset.cycle.speed / inner - 1.0) < 1e-8


def test_loop_without_friction_is_freeplay() -> None:
    loop = limit_cycles(section(), Hysteresis(0.0, 1.0), QUICK)
    gap = limit_cycles(section(), Freeplay(1.0), QUICK)
    assert loop.onset is not None
    assert gap.onset is not None
    assert loop.onset.cycle.speed == gap.onset.cycle.speed


# --- other systems -------------------------------------------------------------------------------


def test_cycles_of_one_fixed_system_are_those_of_the_family_at_its_speed() -> None:
    """Found along the gain instead of along the airspeed."""
    spring = Hysteresis(1.0, 0.2)
    along = cycles_at(section(), spring, 3.9, QUICK).cycles
    fixed = cycles_at(FixedFamily(section().at(3.9)), spring, 0.0, QUICK).cycles
    assert len(along) == len(fixed) == 2
    for one, other in zip(along, fixed, strict=True):
        assert abs(one.amplitude - other.amplitude) < 1e-10
        assert one.stable == other.stable


def test_sampled_model_has_the_cycles_of_what_was_sampled() -> None:
    """The spline of 80 samples is good to 1e-7; so are its cycles."""
    grid = np.linspace(3.5, 4.3, 80)
    sampled = SampledFamily(grid, [section().at(u) for u in grid])
    spring = Hysteresis(1.0, 0.2)
    for one, other in zip(
        cycles_at(section(), spring, 3.91, QUICK).cycles,
        cycles_at(sampled, spring, 3.91, QUICK).cycles,
        strict=True,
    ):
        assert abs(one.amplitude - other.amplitude) < 1e-6


# --- refusals, and what is said ------------------------------------------------------------------


def test_a_family_that_ends_says_where_and_why_and_what_there_is_is_kept() -> None:
    short = limit_cycles(section(), Hysteresis(1.0, 0.2), replace(QUICK, max_states=12))
    family = short.families[0]
    assert any("12 cycles were followed (at 0.9" in stop for stop in family.stopped)
    assert len(family.cycles) > 12
    assert any("family 1 could not be followed further" in note for note in short.notes)
    narrow = limit_cycles(section(), Hysteresis(1.0, 0.2), replace(QUICK, largest=2.0))
    assert any("2 times the spring's scale (at 0.9" in s for s in narrow.families[0].stopped)


def test_no_cycle_is_said_and_no_error() -> None:
    assert "linear" in limit_cycles(section(), Linear()).notes[0]
    below = replace(QUICK, speed_ratio_range=(0.3, 0.5))
    assert "no limit cycle" in limit_cycles(section(), Hysteresis(1.0, 0.2), below).notes[-1]


def test_what_cannot_be_done_is_refused() -> None:
    with pytest.raises(InputError, match="cycles_at"):
        limit_cycles(FixedFamily(section().at(3.9)), Freeplay(1.0))
    with pytest.raises(InputError, match="speed: must lie between"):
        cycles_at(section(), Freeplay(1.0), 1e9)
    with pytest.raises(InputError, match=r"points: .*\n.*max_step: "):
        CycleOptions(points=1, max_step=-1.0)


@pytest.mark.parametrize(("run", "tori"), [("run6", 1), ("run14", 0)])
def test_only_a_complex_pair_on_the_unit_circle_is_neimark_sacker(run: str, tori: int) -> None:
    """A pair passes the product one on either branch; run 14's is real, a neutral saddle."""
    case = load_case(run)
    found = limit_cycles(case.family(), case.spring, QUICK)
    products = []
    for cycle in found.cycles:
        others = cycle.multipliers[1:]
        i, j = np.triu_indices(others.size, 1)
        products.append(np.prod(1 - others[i] * others[j]).real)
    assert min(products) < -1e-4 < 1e-4 < max(products)
    events = [event.cycle for event in found.bifurcations if event.kind == "neimark-sacker"]
    assert len(events) == tori
    for cycle in events:
        complex_pair = cycle.multipliers[np.abs(cycle.multipliers.imag) > 1e-3]
        assert np.sum(np.abs(np.abs(complex_pair) - 1) < 1e-7) == 2


def test_a_corner_between_whose_sides_newton_never_comes_ends_the_search_for_it() -> None:
    """What it finds between two states jumps by round-off about one of them."""
    count = [0]

    def between(state: State, beyond: State, fraction: float) -> State:
        count[0] += 1
        assert count[0] < 100
        return State(np.array([0.0, 1e-9 * (count[0] % 2 + 1)]), np.zeros(2), 0.0)

    walk = SimpleNamespace(between=between, scale=np.ones(2))
    leg = cast(Leg, SimpleNamespace(switches=lambda x: ((int(x[0] > 0.5),),), walk=walk))
    ends = State(np.zeros(2), np.zeros(2), 0.0), State(np.ones(2), np.zeros(2), 1.0)
    before, after = _change(leg, *ends)
    assert count[0] > 20
    assert (before.x[0], after.x[0]) == (0.0, 1.0)


# --- springs of many corners ----------------------------------------------------------------------


def many_corners(count: int, reach: float = 3.0) -> Table:
    """A gap whose edges are rounded off, in straight pieces."""
    pitch = np.linspace(-reach, reach, count)
    return Table(tuple(pitch), tuple(pitch - np.tanh(2.0 * pitch) / 2.0))


def test_a_passage_may_meet_many_corners() -> None:
    """The cycle that a motion ends on meets all 239 corners twice a period, and closes."""
    flow = Flow(section().at(0.985 * cast(float, flutter_speed(section()))), (many_corners(241),))
    cycle = end_state(flow, 0.3 * np.eye(flow.n)[0], 0.0).cycle
    assert cycle is not None
    z, period = cycle.z[0, : flow.n], float(cycle.period[0])
    trace = flow.trace(z, period, 64)
    assert len(trace.events) == 2 * 239
    assert np.max(np.abs(trace.end - z)) < 1e-8 * np.max(np.abs(trace.states))
    assert np.max(np.abs(flow.passage(z, period).end - z)) < 1e-8 * np.max(np.abs(trace.states))


@pytest.mark.slow
def test_a_cycle_over_many_corners_is_followed() -> None:
    """It is on the family that begins at the fold, in one search."""
    spring = many_corners(241)
    found = limit_cycles(section(), spring, replace(QUICK, simulations=1, points=5))
    assert len(found.families) == 1
    large = found.families[0].cycles[-1]
    assert large.amplitude > 10.0
    assert large.switches == 2 * 239
    assert misses(section(), spring, large) < 1e-7


def test_an_end_that_cannot_be_followed_costs_no_family(monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither where a motion ends nor where a family goes on: what was found is kept, and said."""

    def lost(*_: object) -> None:
        raise ConvergenceError("the motion switches too often")

    spring, options = Hysteresis(1.0, 0.2), replace(QUICK, points=10, simulations=4)
    whole = limit_cycles(section(), spring, replace(options, simulations=0))
    monkeypatch.setattr("aeroflutter.orbits.cycles.search.mirrors", lost)
    found = limit_cycles(section(), spring, options)
    assert len(found.families) == len(whole.families)
    assert len(found.families[0].cycles) == len(whole.families[0].cycles)
    assert any("starts led to what does not close" in note for note in found.notes)

    calls = [0]

    def comes_back(self: Leg, old: object, new: object) -> bool:
        calls[0] += 1
        if calls[0] > 3:
            lost()
        return False

    monkeypatch.setattr(Leg, "comes_back", comes_back)
    short = limit_cycles(section(), spring, replace(options, simulations=0))
    assert 3 <= len(short.families[0].cycles) < len(whole.families[0].cycles)
    assert any("the motion switches too often" in note for note in short.notes)
