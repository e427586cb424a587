"""Each verdict on what it is for, and what used to be taken for another."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from marching import event_march

from aeroflutter import (
    Bilinear,
    Cubic,
    Freeplay,
    Hysteresis,
    Linear,
    LureSystem,
    Relay,
    SectionFamily,
    Table,
    TypicalSection,
)
from aeroflutter.case import load_case
from aeroflutter.linear.rootlocus import flutter_speed
from aeroflutter.model.aerodynamics import QuasiSteady
from aeroflutter.model.system import System
from aeroflutter.motion._kernel_flow import DONE
from aeroflutter.motion._kernel_settle import repeats
from aeroflutter.motion.basins import Loop, absolutely_stable
from aeroflutter.motion.endstates import EndOptions, end_state, end_states
from aeroflutter.motion.evidence import GROUP, LONGEST, Envelope
from aeroflutter.motion.flow import Flow
from aeroflutter.motion.judge import one_sided
from aeroflutter.motion.march import March
from aeroflutter.motion.response import STATES, Initial, SimulateOptions, simulate
from aeroflutter.motion.settling import Watch
from aeroflutter.studies.maps.columns import decide_cells

BRIEF = SimulateOptions(record=False)
SECTION = SectionFamily(TypicalSection(omega_bar=0.8))
LIGHT = SectionFamily(TypicalSection(omega_bar=0.8, zeta_alpha=0.001, zeta_xi=0.001), QuasiSteady())


def table(pitch, moment) -> Table:
    return Table(tuple(np.radians(pitch)), tuple(np.radians(moment)))


MEASURED = table([-2, -1, 0, 1, 2], [-2.5, -1, 0, 0.8, 2.5])
KINKED = table([-2, 0, 2], [-1.8, 0, 2])


def at(family, ratio):
    return family.at(ratio * flutter_speed(family))


def ends(family, spring, ratio, pitch_deg):
    return simulate(at(family, ratio), spring, Initial(alpha=np.radians(pitch_deg)), BRIEF)


# --- rest at a corner of the law ------------------------------------------------------------------


@pytest.mark.parametrize(
    ("zeta", "spring", "ratio"),
    [
        (0.0, MEASURED, 0.5),
        (0.01, KINKED, 0.5),
        (0.0, KINKED, 0.9),
        (0.0, Bilinear(0.0, 0.5, 0.0, np.radians(1.0)), 0.5),
        (0.0, MEASURED, 0.9),  # within a basin alone
    ],
)
def test_a_rest_at_a_corner_is_damped(zeta, spring, ratio):
    family = SectionFamily(TypicalSection(omega_bar=0.8, zeta_alpha=zeta, zeta_xi=zeta))
    end = ends(family, spring, ratio, 0.6)
    assert (end.state, end.rest) == ("damped", pytest.approx(0.0, abs=1e-12))
    system = at(family, ratio)
    start = np.zeros(6)
    start[1] = np.radians(0.6)
    sizes = []
    x = start
    for _ in range(2):
        x, _ = event_march(system, spring, x, 0.0, 400.0, rtol=1e-9)
        sizes.append(np.linalg.norm(x))
    assert sizes[1] < 0.9 * sizes[0]  # and so it is


def test_a_rest_at_a_corner_beside_an_unstable_piece_is_damped():
    """No Lyapunov function can be: the flat alone would flutter. The motion is seen to shrink."""
    section = TypicalSection(
        mu=247.36331299424762,
        x_alpha=0.05308322178955937,
        r_alpha=0.5689578344953204,
        omega_bar=0.21505936687242352,
    )
    spring = Bilinear(0.0, 0.32426304175562215, 0.07008450829426682, 0.37376997582386295)
    end = ends(SectionFamily(section), spring, 0.6205, np.degrees(-0.019))
    assert not Flow(at(SectionFamily(section), 0.6205), [spring]).proofs.forms.size
    assert end.state == "damped"
    assert end.rest == pytest.approx(spring.alpha_f, abs=1e-8)


def test_no_motion_leaves_the_basin_of_a_corner():
    """From its edge, in many directions, y stays as near as was said, by another integrator."""
    system = at(SECTION, 0.9)
    flow = Flow(system, [MEASURED])
    (rest,), (form,) = flow.proofs.corners, flow.proofs.forms
    assert rest == pytest.approx(0.0, abs=1e-12)
    assert np.any(form)
    rng, room = np.random.default_rng(1), np.radians(1.0)
    for _ in range(4):
        x = rng.normal(size=6) * np.array([1, 1, 0.3, 0.3, 1, 1])
        x *= 0.999 / np.sqrt(x @ form @ x)
        assert flow.rest(x) == pytest.approx(0.0, abs=1e-12)
        highest = 0.0
        for _ in range(40):
            x, _ = event_march(system, MEASURED, x, 0.0, 2.0, rtol=1e-9)
            highest = max(highest, abs(system.c @ x))
        assert highest < room
    x *= 1.01 * np.sqrt(1.0 / (x @ form @ x))
    assert np.isnan(flow.rest(x))


def test_a_lyapunov_function_is_believed_for_its_sector_alone():
    """An oscillator whose stiffness may alternate is driven off, unless it is damped well."""
    for damping, known in ((0.005, False), (0.5, True)):
        loop = Loop(np.array([[0.0, 1.0], [0.0, -damping]]), *np.eye(2)[::-1], np.zeros(2))
        # Popov's multiplier knows the potential energy: any static law is stable, and proved so
        assert absolutely_stable(loop, 0.5, 1.5, np.inf) is not None
        # what is fed back a quarter of a turn late is not
        late = Loop(loop.A, loop.b, np.array([1.0, -1.5 * 0.2]), loop.d)
        assert (absolutely_stable(late, 0.5, 1.5, np.inf) is not None) is known


# --- slow decays ----------------------------------------------------------------------------------


@pytest.mark.parametrize("ratio", [0.02, 0.05, 0.1, 0.5])
def test_a_cubic_spring_at_low_speed_is_damped(ratio):
    assert ends(SECTION, Cubic(1.0, 3.0), ratio, 6.0).state == "damped"


@pytest.mark.parametrize("pitch", [1.0, 6.0])
def test_a_decay_of_many_cycles_is_a_decay(pitch):
    end = ends(LIGHT, Freeplay(np.radians(0.2)), 0.3, pitch)
    assert end.state == "damped"


def test_an_unstable_rest_is_none():
    """Pitch leaves a rest beyond divergence so slowly that a window sees no oscillation."""
    section = TypicalSection(omega_bar=0.8, a_h=-0.2, zeta_alpha=0.3, zeta_xi=0.3)
    system = SectionFamily(section).at(6.8)
    growth = np.linalg.eigvals(system.closed(1.0))
    real = growth[np.abs(growth.imag) < 1e-12].real.max()
    assert 1e-3 < real < 0.1  # it diverges, slowly
    for engine in ("exact", "houbolt"):
        options = SimulateOptions(record=False, engine=engine, duration=3000.0)
        end = simulate(system, Cubic(1.0, 3.0), Initial(alpha=1e-9), options)
        assert end.state != "damped" or abs(end.rest) > 0.01


# --- a map's cell is decided as if alone ----------------------------------------------------------


def test_a_column_is_the_sum_of_its_cells():
    section = TypicalSection(
        mu=204.02347319304494,
        a_h=0.18467567230499504,
        x_alpha=0.07662760368962618,
        r_alpha=0.4882030436889407,
        omega_bar=0.8486861461082336,
        zeta_xi=0.001,
    )
    spring = Bilinear(0.0, -0.9596581238802968, 0.08521217907297263, 0.789782304570146)
    system = at(SectionFamily(section, QuasiSteady()), 0.3263559845240847)
    states = np.zeros((30, len(system.state_names)))
    states[:, 1] = np.radians(np.linspace(-3.159, 3.159, 30))
    memory, options = np.zeros(30), EndOptions(duration=1e7)
    column = decide_cells(Flow(system, [spring]), states, memory, options)
    alone = end_states(Flow(system, [spring]), states, memory, options)
    assert [STATES[code] for code in alone.state] == ["damped"] * 30
    np.testing.assert_array_equal(column.state, alone.state)
    np.testing.assert_allclose(column.rest, alone.rest, rtol=1e-9)


# --- neither attracts nor repels ------------------------------------------------------------------


def test_a_linear_spring_at_the_flutter_speed_is_neutral():
    end = ends(SECTION, Linear(), 1.0, 3.0)
    assert end.state == "neutral"
    system = at(SECTION, 1.0)
    x, _ = event_march(system, Linear(), [0, np.radians(3.0), 0, 0, 0, 0], 0.0, 3000.0, rtol=1e-10)
    y = []
    for _ in range(120):
        x, _ = event_march(system, Linear(), x, 0.0, 0.25, rtol=1e-10)
        y.append(system.c @ x)
    assert end.amplitude == pytest.approx(np.ptp(y) / 2, rel=2e-3)  # 110 samples a period


def test_a_loop_at_the_flutter_speed_is_neutral():
    case = load_case("run14")
    assert ends(case.family(), case.spring, 1.0, 3.0).state == "neutral"
    assert ends(case.family(), case.spring, 1.0, 0.2).state == "neutral"  # on its stick for good


def test_an_undamped_section_with_a_cubic_spring_has_no_limit_cycle():
    family = SectionFamily(TypicalSection(omega_bar=0.8), QuasiSteady())
    end = ends(family, Cubic(1.0, 3.0), 0.5, 3.0)
    assert end.state == "neutral"


def forced() -> tuple[LureSystem, Bilinear]:
    """A damped oscillator on a bilinear spring, driven by another that nothing damps."""
    A = np.array(
        [[0, 1.0, 0, 0], [0, -0.02, 1.0, 0], [0, 0, 0, 1.3], [0, 0, -1.3, 0]],
    )
    return LureSystem(A, np.array([0, 1.0, 0, 0]), np.array([1.0, 0, 0, 0])), Bilinear(
        0.0, 0.3, -0.5, 1.0
    )


def test_the_amplitude_is_that_of_the_last_part_of_a_motion():
    system, spring = forced()
    start = np.array([3.0, 0.0, 0.8, 0.0])
    end = simulate(system, spring, Initial(state=start), BRIEF)
    assert end.state in ("neutral", "undecided")
    x, _ = event_march(system, spring, start, 0.0, 900.0, rtol=1e-9)
    y = []
    for _ in range(160):
        x, _ = event_march(system, spring, x, 0.0, 0.05, rtol=1e-9)
        y.append(x[0])
    assert end.amplitude == pytest.approx(np.ptp(y) / 2, rel=0.02)


# --- evidence -------------------------------------------------------------------------------------


def envelope(peaks: np.ndarray, misses: float | np.ndarray = 0.1) -> Envelope:
    found = Envelope()
    found.add(peaks, -peaks, np.broadcast_to(misses, peaks.shape))
    return found


def test_an_envelope_that_shrinks_under_a_ripple_is_not_stationary():
    k = np.arange(800)
    decay = np.exp(-2e-3 * k) * (1.0 + 0.3 * np.sin(2.399 * k))
    change = envelope(decay).change()
    assert change.moving
    assert change.rate == pytest.approx(np.expm1(-0.2), rel=0.1)
    assert not envelope(decay).stationary()
    assert envelope(1.0 + 0.3 * np.sin(2.399 * k)).stationary()
    assert not envelope(1.0 + 0.3 * np.sin(2.399 * k), 1e-5).stationary()  # a cycle, nearly


def test_a_random_envelope_is_stationary_and_a_rising_one_is_not():
    rng = np.random.default_rng(0)
    noise = 1.0 + 0.3 * rng.random(4000)
    assert not envelope(noise).change().moving
    assert envelope(noise * np.linspace(0.5, 1.0, 4000)).change().moving
    assert envelope(noise).loops == GROUP * (4000 // GROUP)


def test_aperiodic_has_its_exponent_and_undecided_its_rate():
    family = SectionFamily(TypicalSection(omega_bar=0.2))
    chaos = ends(family, Freeplay(np.radians(0.5)), 0.3, 7.0)
    assert chaos.state == "aperiodic"
    assert "exponent" in chaos.reason
    flow = Flow(at(LIGHT, 0.3), [Freeplay(np.radians(0.2))])
    start = np.array([0.0, np.radians(6.0), 0.0, 0.0])
    end = end_state(flow, start, 0.0, EndOptions(cycles=50, patience=2))
    assert end.state == "undecided"
    assert "% a hundred cycles" in end.reason


LONG = TypicalSection(
    omega_bar=0.24972350983170014, mu=74.66737759400327, a_h=-0.3383041878504927,
    x_alpha=0.28723279670718144, r_alpha=0.5776817446360285, zeta_xi=0.0015586180745725984,
)  # fmt: skip


@pytest.mark.parametrize("ratio", [0.8027796048766759, 0.80279])
def test_a_cycle_of_seventeen_loops_is_one_even_after_chaos_that_ends(ratio: float) -> None:
    """DOP853 with events gives 2.00965678 for half the swing of each tenth of τ = 1.9e6.

    At the second speed neighbours part for longer than 400 loops on the way there.
    """
    family = SectionFamily(LONG, QuasiSteady())
    speed = flutter_speed(family)
    assert speed is not None
    system = family.at(ratio * speed)
    spring = Hysteresis(0.06110260968239387, 0.5189989653412505)
    start = Initial(
        alpha=-0.05513834996001199, alpha_rate=0.004293965451712176,
        xi=-0.03795965297485124, xi_rate=-0.004010248222542337,
    )  # fmt: skip
    found = simulate(system, spring, start, SimulateOptions(record=False))
    assert (found.state, found.extras["loops"]) == ("lco", 17)
    assert found.amplitude == pytest.approx(2.0097, abs=2e-4)
    flow = Flow(system, [spring])
    z = np.append(found.final_state, found.final_memory)
    for _ in range(200):
        before, z = z, flow.passage(z, found.period).end
    assert z == pytest.approx(before, abs=1e-9)
    assert flow.passage(z, found.period / 17).end != pytest.approx(z, abs=0.1)


def test_who_dies_down_about_a_corner_by_a_percent_in_four_hundred_loops_is_damped() -> None:
    """DOP853 with events: half the swing falls from 0.573 to 0.045 over τ = 4e5, and goes on."""
    section = TypicalSection(
        omega_bar=0.17880287571809542, mu=83.93151394747794, a_h=-0.2339745328288425,
        x_alpha=0.17231743653487938, r_alpha=0.627035465702444, zeta_xi=0.00027854919610978456,
    )  # fmt: skip
    family = SectionFamily(section, QuasiSteady())
    law = Table(
        (-1.4685757843706941, -0.5220236271052848, 0.0, 0.6860311778831789, 1.466550932579862),
        (-2.0360381320326515, -0.6528699463623391, 0.0, 0.47024895095743435, 1.2471483698409696),
    )
    flutter = flutter_speed(family)
    assert flutter is not None
    start = Initial(
        alpha=0.6572855783665155, alpha_rate=0.03480013783105062,
        xi=0.5457787364079346, xi_rate=-0.0568791056613183,
    )  # fmt: skip
    system = family.at(0.30021295946067583 * flutter)
    assert simulate(system, law, start, SimulateOptions(record=False)).state == "damped"


def test_who_grows_between_two_slopes_until_it_overflows_has_diverged() -> None:
    """Nothing is damped on either of the outer pieces, and going from one to the other feeds it."""
    section = TypicalSection(
        omega_bar=0.7140289215818567, mu=96.2719800321144, a_h=-0.3763854225516975,
        x_alpha=0.0388583410202727, r_alpha=0.4092203607168441,
    )  # fmt: skip
    family = SectionFamily(section, QuasiSteady())
    pitch = (-1.5644392577117905, -0.7348478737883277, 0.0, 0.5905483988940683, 1.1609592695182243)
    moment = (-1.4399135515950263, -0.7543742540158689, 0.0, 0.266905955893459, 0.4541040569279608)
    flutter = flutter_speed(family)
    assert flutter is not None
    start = Initial(
        alpha=0.33930002341297316, alpha_rate=0.018690635219508322,
        xi=-0.0041232301052765204, xi_rate=0.011674080264957956,
    )  # fmt: skip
    quiet = SimulateOptions(record=False)
    end = simulate(family.at(0.4607 * flutter), Table(pitch, moment), start, quiet)
    assert end.state == "divergent"
    assert "overflowed" in end.reason


def test_turning_points_that_repeat_after_many_loops_are_a_cycle():
    """Forty loops of a period, given as turning points: neither a torus nor chaos."""
    k = np.arange(8000)
    tops = 1.0 + 0.3 * np.cos(2.0 * np.pi * 7 * k / 40)
    values = np.stack((-tops, tops), axis=1).ravel()
    found, _ = repeats(np.arange(values.size, dtype=float), values, LONGEST, 1e-9, 1e-6)
    assert found == 40
    family = SectionFamily(LONG)
    watch = Watch.over(family.at(2.0), Freeplay(1.0), np.zeros(6), SimulateOptions(), 1e-9, 1e-6)
    watch.add(np.arange(values.size, dtype=float), values, -2.0, 2.0)
    verdict = watch._cycle(LONGEST)
    assert verdict is not None
    assert (verdict.state, verdict.loops) == ("lco", 40)


# --- Houbolt --------------------------------------------------------------------------------------


def test_houbolt_says_when_its_step_damps_by_itself():
    coarse = SimulateOptions(engine="houbolt", record=False, duration=1000.0)
    system = at(SECTION, 0.05)
    end = simulate(system, Linear(), Initial(alpha=0.05), coarse)
    assert "dt = 0.1 damps the fastest oscillation" in end.reason
    fine = simulate(at(SECTION, 0.9), Linear(), Initial(alpha=0.05), coarse)
    assert "dt" not in fine.reason


@pytest.mark.parametrize(("load", "rest"), [(0.1, 1.1), (-0.1, np.nan)])
def test_who_creeps_towards_a_rest_beyond_an_edge_is_not_at_rest(load: float, rest: float) -> None:
    """y' = -F(y) + load from y = 3: the line y - 1 that ends at 1 has its rest at 1 + load."""
    one = np.eye(1)
    flow = Flow(System(0.0 * one, one, one, np.array([load])), [Freeplay(2.0)])
    march = March(flow, flow.start([3.0]))
    march.run(0.1)
    assert march.motion.window[0, 1] == np.inf
    assert one_sided(flow, march.motion) == pytest.approx(rest, nan_ok=True)


# --- slow motions ---------------------------------------------------------------------------------


def odd(mu, x_alpha, r_alpha, omega_bar, **more) -> SectionFamily:
    """A quasi-steady section, about the quarter chord."""
    return SectionFamily(
        TypicalSection(mu=mu, x_alpha=x_alpha, r_alpha=r_alpha, omega_bar=omega_bar, **more),
        QuasiSteady(),
    )


def test_a_slow_approach_to_a_cycle_ends_on_it():
    family = odd(183.4523941644868, 0.21708992047520886, 0.5895041854650517, 0.2160932776131578,
                 a_h=-0.48919882793882263, zeta_xi=0.0011514954814926522)  # fmt: skip
    spring = Bilinear(0.0, -0.11273810341693746, 0.011951187578690514, 0.4444533114677971)
    start = Initial(alpha=1.5735935406710593, alpha_rate=0.07958838403428466,
                    xi=0.5464517399977854, xi_rate=0.04485660832664138)  # fmt: skip
    flow = Flow(at(family, 0.7792), [spring])
    end = end_state(flow, *start.start(flow.system, spring))
    assert end.state == "lco"
    assert 0.9995 < end.multiplier < 1.0
    z = end.cycle.z[0, : flow.n]
    x, _ = event_march(flow.system, spring, z, 0.0, end.period)
    np.testing.assert_allclose(x, z, rtol=0, atol=1e-9 * np.abs(z).max())


def test_a_fast_mode_that_dies_first_is_no_damping():
    """Both pieces that meet at the rest are unstable in the slow mode, at first a small one."""
    family = odd(38.305404158194385, 0.1757379526556079, 0.407915874667776, 0.4349169956165135,
                 zeta_alpha=0.0011060370322091464)  # fmt: skip
    spring = Bilinear(0.0, 0.2520799625624375, -0.11210822758936231, 0.42679474828024466)
    system = at(family, 1.0186)
    for slope in (spring.m_f, 1.0):
        assert np.linalg.eigvals(system.closed(slope)).real.max() > 0.0
    end = simulate(system, spring, Initial(alpha=0.06457434155821892), BRIEF)
    assert end.state == "divergent"
    assert "at every larger size" in end.reason


def test_a_drift_whose_zeros_are_parted_by_round_off_is_no_oscillation():
    """Quasi-steady about the quarter chord, pitch moves on at its rate across a gap."""
    family = odd(200.34205177779498, 0.27286820750147313, 0.6279230049744542, 0.23769628357949288,
                 zeta_xi=0.000905446179366346)  # fmt: skip
    spring = Freeplay(1.0, 0.11910379057552062)
    flow = Flow(at(family, 0.2826), [spring])
    flat = int(flow.arrays.lookup[flow.place([1])])
    assert flow.proofs.decays[flat] == 0
    assert np.all(np.isfinite(flow.proofs.centre))
    end = simulate(at(family, 0.2826), spring, Initial(alpha=4.97, alpha_rate=0.33), BRIEF)
    assert end.state == "lco"


def test_what_grows_without_any_damping_is_not_neutral():
    """A hinge drives an undamped quasi-steady section ever farther, by less and less."""
    family = odd(30.64801909276379, 0.2023703983566562, 0.6256399272122761, 0.4888308760190031)
    spring = Hysteresis(0.764234250130302, 0.7075702817432775)
    end = simulate(at(family, 0.8187), spring, Initial(alpha=4.0), BRIEF)
    assert end.state == "divergent"


@pytest.mark.parametrize(
    "spring", [Linear(), Freeplay(0.01), Hysteresis(0.01, 0.01), Cubic(1.0, 3.0)]
)
def test_a_motion_of_nothing_has_no_loops(spring):
    """4e-321 degrees: what is left of a number is no cycle of nine loops."""
    end = simulate(at(SECTION, 0.5), spring, Initial(alpha=7e-323), BRIEF)
    assert (end.state, end.amplitude, end.extras["loops"]) == ("damped", 0.0, 0)


def test_a_relay_that_begins_at_nothing_is_over():
    end = simulate(at(SECTION, 0.5), Relay(0.01), Initial(alpha=1e-200), BRIEF)
    assert (end.state, end.rest) == ("damped", 0.0)


def test_a_cell_that_round_off_decides_is_the_same_in_a_map():
    """Long chaotic transients between two attractors: the same steps to the last bit."""
    section = TypicalSection(mu=104.33777042521686, x_alpha=0.10886648918440518,
                             r_alpha=0.4453599827064744, omega_bar=0.8128487546510065)  # fmt: skip
    spring = Bilinear(0.0, -0.21924745602071616, 0.014622694886790188, 0.9161041030539276)
    system = at(SectionFamily(section), 0.8567)
    states = np.zeros((40, system.order))
    states[:, 1] = np.linspace(-3.0, 3.0, 40)
    options, memory = EndOptions(duration=1e7), np.zeros(40)
    column = decide_cells(Flow(system, [spring]), states, memory, options)
    alone = end_states(Flow(system, [spring]), states, memory, options)
    fickle = (
        end_states(Flow(system, [spring]), states * (1 + near * 2.3e-16), memory, options)
        for near in (1, -2, 3, -4, 5)
    )
    assert any(np.any(one.state != alone.state) for one in fickle)
    np.testing.assert_array_equal(column.state, alone.state)


def test_a_cubic_that_moves_slowly_to_a_cycle_is_told_so():
    end = simulate(
        at(LIGHT, 1.005), Cubic(1.0, 3.0), Initial(alpha=0.05), replace(BRIEF, cycles=60)
    )
    assert end.state == "lco"
    assert end.amplitude == pytest.approx(0.058503061485, rel=1e-6)


def test_a_cubic_that_shrinks_at_every_size_is_damped():
    family = odd(97.25673851168847, 0.060348073314756015, 0.5529632920769421, 0.18464611378491427,
                 zeta_xi=0.0002829619574536886)  # fmt: skip
    end = simulate(at(family, 0.4736), Cubic(1.0, 3.0), Initial(alpha=5.0), BRIEF)
    assert (end.state, end.rest) == ("damped", 0.0)


# --- what a verdict costs -------------------------------------------------------------------------


@pytest.mark.parametrize("stiff", [1e2, 1e4, 1e6])
def test_a_stiff_spring_costs_what_its_motion_does(stiff: float) -> None:
    """Beside one wall the motion soon stays on the soft slope, which has long steps however stiff
    the wall is; between two it hops from wall to wall, in two steps a hop at most."""
    system = at(SECTION, 0.8)
    start = Initial(alpha=np.radians(6.0)).vector(system)
    wall = Bilinear(m0=0.0, m_f=stiff, alpha_f=np.radians(-0.5), delta=np.radians(1.0))
    walls = table([-2, -1, 1, 2], [-1 - stiff, -1, 1, 1 + stiff])
    for spring, hops in ((wall, 60), (walls, 20.0 * np.sqrt(stiff))):
        flow = Flow(system, (spring,))
        march = March(flow, flow.begin(start), events=100_000)
        assert march.run(100.0) == DONE
        assert len(march.events()) < hops
        again = March(flow, flow.begin(start))
        assert again.run(100.0, most=20 + 2 * len(march.events())) == DONE
        assert end_state(flow, start, 0.0).state == "damped"
