"""Several springs through the analyses and the command line."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import oracle_springs as oracle
import pytest
import xarray as xr
from matplotlib.figure import Figure

from aeroflutter import (
    Bilinear,
    Cubic,
    Freeplay,
    Hysteresis,
    QuasiSteady,
    SectionFamily,
    Table,
    TypicalSection,
)
from aeroflutter.case import load_case
from aeroflutter.cli import main
from aeroflutter.errors import ConvergenceError, InputError
from aeroflutter.guarantees import guarantees
from aeroflutter.guarantees.looptest import LoopTestOptions, loop_test
from aeroflutter.guarantees.onset import onset
from aeroflutter.linear.rootlocus import root_locus
from aeroflutter.model.family import SectionModel
from aeroflutter.model.lure import as_lure
from aeroflutter.motion import Initial, SimulateOptions, simulate, sweep
from aeroflutter.motion.endstates import end_states
from aeroflutter.motion.flow import Flow
from aeroflutter.motion.response import STATES
from aeroflutter.motion.swings import extremes
from aeroflutter.orbits.cycles import CycleOptions, cycle_near, cycles_at, limit_cycles
from aeroflutter.orbits.describing import DescribingOptions, describing_curve
from aeroflutter.orbits.describing.several_curve import _slopes
from aeroflutter.orbits.harmonic import (
    HarmonicBranch,
    HarmonicOptions,
    harmonic_families,
    solve_cycle,
)
from aeroflutter.plots.style import named_after
from aeroflutter.springs import Polynomial, Spring
from aeroflutter.studies.tolerance import least_friction, tolerance

WORN = {
    "section": {"omega_bar": 0.6, "zeta_xi": 0.01, "zeta_alpha": 0.01},
    "flap": {"hinge": 0.5, "x_beta": 0.0125, "r_beta": 0.08, "omega_beta": 4.0},
    "spring": [
        {"at": "pitch", "kind": "freeplay", "gap_deg": 0.5},
        {"at": "flap", "kind": "freeplay", "gap_deg": 1.0},
    ],
    "initial": {"alpha_deg": 3.0},
}
"""A pitch hinge and a flap hinge with gaps."""

TOML = """
[section]
omega_bar = 0.6
zeta_xi = 0.01
zeta_alpha = 0.01
[flap]
hinge = 0.5
x_beta = 0.0125
r_beta = 0.08
omega_beta = 4.0
[[spring]]
at = "pitch"
kind = "freeplay"
gap_deg = 0.5
[[spring]]
at = "flap"
kind = "freeplay"
gap_deg = 1.0
[initial]
alpha_deg = 3.0
"""


@pytest.fixture
def worn(tmp_path: Any) -> str:
    path = tmp_path / "worn.toml"
    path.write_text(TOML)
    return str(path)


def said(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    assert main([*arguments, "--json"]) == 0
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


def test_the_linear_section_does_not_mind_which_springs_stand_outside() -> None:
    """All springs of unit slope: the same roots whether one, two or three of them are outputs."""
    case = load_case(WORN)
    speeds = [1.0, 2.0, 3.0]
    found = [
        root_locus(SectionModel(case.section, case.aerodynamics, springs), speeds=speeds)
        for springs in (["pitch"], ["pitch", "flap"], ["flap", "heave", "pitch"])
    ]
    for one in found[1:]:
        assert one.flutter.speed == pytest.approx(found[0].flutter.speed, rel=1e-12)
        assert np.sort_complex(one.roots[0]) == pytest.approx(
            np.sort_complex(found[0].roots[0]), abs=1e-10
        )


def test_divergence_is_where_the_static_loads_balance() -> None:
    """With a_h = -0.2 in closed form, U_D² = mu r_alpha²/(1 + 2 a_h), heave outside or not."""
    section = TypicalSection(omega_bar=0.6, a_h=-0.2, mu=20.0)
    expected = np.sqrt(20.0 * 0.25 / (1 - 0.4))
    for springs in (["pitch"], ["heave", "pitch"]):
        found = root_locus(SectionModel(section, springs=springs)).divergence
        assert found == pytest.approx(expected, rel=1e-10)


def test_extremes_between_samples() -> None:
    """Of sines the extremes are known; the cubic through 64 samples a period is good to 1e-7."""
    t, dt = np.linspace(0.0, 2 * np.pi, 65, retstep=True)
    x = np.column_stack((np.sin(t + 0.1), np.cos(2 * t + 0.3)))
    rates = np.column_stack((np.cos(t + 0.1), -2 * np.sin(2 * t + 0.3)))
    low, high = extremes(x, rates, float(dt), np.array([[1.0, 0.0], [0.0, 3.0]]))
    assert low == pytest.approx([-1.0, -3.0], abs=2e-5)
    assert high == pytest.approx([1.0, 3.0], abs=2e-5)


def test_every_coordinate_swings_as_far_as_another_program_finds() -> None:
    """A cycle of a worn pitch hinge and a worn flap, over one period by Runge and Kutta."""
    case = load_case(WORN)
    family, springs = case.loop()
    speed = 0.7 * root_locus(family).flutter.speed
    system = family.at(speed)
    found = simulate(system, springs, Initial(alpha=0.05))
    assert found.state == "lco"
    again = simulate(
        system,
        springs,
        Initial(state=found.final_state, memory=found.final_memory),
        SimulateOptions(duration=4000.0, decide=False, record=False),
    )
    whole = oracle.System(system.A, system.B, system.C, system.load)
    gaps = [oracle.continuous((-s.gap / 2, s.gap / 2), (1.0, 0.0, 1.0), s.gap / 2) for s in springs]
    times = np.linspace(0.0, found.period, 3000)
    truth = oracle.integrate(whole, gaps, again.final_state, [], times).x
    for swing, state in zip(found.coordinates, ("xi", "alpha", "beta"), strict=True):
        y = truth[:, system.state_names.index(state)]
        assert swing.amplitude == pytest.approx(0.5 * np.ptp(y), rel=2e-5)
        assert swing.bias == pytest.approx(0.0, abs=1e-8)
    assert [one.name for one in found.springs] == ["pitch", "flap"]
    assert found.springs[1].amplitude == found.coordinates[2].amplitude
    assert found.amplitude == found.coordinates[1].amplitude


def test_a_damped_motion_rests_where_nothing_pushes_it() -> None:
    """With friction in the pitch hinge the rest is off centre; there x' = 0 by the laws alone."""
    section = TypicalSection(omega_bar=0.8, a_h=-0.4, zeta_xi=0.02, zeta_alpha=0.02)
    system = SectionModel(section, springs=["pitch", "heave"]).at(2.0)
    springs = Hysteresis(0.02, 0.004), Freeplay(0.01)
    found = simulate(system, springs, Initial(alpha=0.1, xi=0.03))
    assert found.state == "damped"
    heave, pitch = (one.bias for one in found.coordinates)
    assert found.rest == pitch != 0.0
    memory = springs[0].advance(found.final_memory[0], pitch)
    moments = [springs[0].moment(pitch, memory), springs[1].moment(heave)]
    rates = system.A[2:4, :2] @ [heave, pitch] - system.B[2:4] @ moments
    lag = system.A[4:, :2] @ [heave, pitch]  # z at rest: A_zz z + this = 0
    z = -np.linalg.solve(system.A[4:, 4:], lag)
    assert rates + system.A[2:4, 4:] @ z == pytest.approx([0.0, 0.0], abs=1e-12)


def test_sweeps_carry_every_memory_over() -> None:
    section = TypicalSection(omega_bar=0.8, zeta_xi=0.02, zeta_alpha=0.02)
    family = SectionModel(section, springs=["pitch", "heave"])
    springs = [Freeplay(0.02), Hysteresis(0.001, 0.002)]
    found = sweep(family, springs, [3.95, 3.9, 0.5], Initial(alpha=0.1))
    assert found.state[0] == "lco"
    assert found.state[-1] == "damped"
    assert np.shape(found.end.memory) == (2,)


def test_simulate_names_every_coordinate_and_every_spring(
    worn: str, capsys: pytest.CaptureFixture[str]
) -> None:
    found = said(capsys, "simulate", worn, "--speed-ratio", "0.7")
    assert [one["name"] for one in found["coordinates"]] == ["heave", "pitch", "flap"]
    assert [one["unit"] for one in found["coordinates"]] == ["semichord", "deg", "deg"]
    assert [one["at"] for one in found["springs"]] == ["pitch", "flap"]
    assert found["springs"][0]["amplitude"] == found["amplitude_deg"]


def test_a_heave_spring_may_come_first(tmp_path: Any, capsys: pytest.CaptureFixture[str]) -> None:
    """The answer is that of the other order: degrees are told of the one in an angle."""
    gap = {"at": "heave", "kind": "hysteresis", "delta_v": 0.004, "delta_h": 0.006}
    loop = {"at": "pitch", "kind": "hysteresis", "delta_v_deg": 0.1, "delta_h_deg": 0.2}
    section = {"omega_bar": 0.6, "zeta_xi": 0.02, "zeta_alpha": 0.02}
    found = []
    for springs, memory in (([gap, loop], [0.002, 0.001]), ([loop, gap], [0.001, 0.002])):
        case = load_case(
            {"section": section, "spring": springs, "initial": {"alpha_deg": 1, "memory": memory}}
        )
        file = tmp_path / f"{springs[0]['at']}.toml"
        file.write_text(case.text)
        found.append(said(capsys, "simulate", str(file), "--speed-ratio", "0.9"))
    one, other = ({k: v for k, v in each.items() if k != "title"} for each in found)
    assert one == other
    assert one["springs"][0]["at"] == "pitch"


def test_a_spring_in_heave_alone_is_told_in_semichords(
    tmp_path: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    """And where a pitch hinge without a gap comes first, of pitch: the same cycle."""
    sections = "[section]\nomega_bar = 0.2\nzeta_xi = 0.01\nzeta_alpha = 0.01\n"
    gap = 'at = "heave"\nkind = "freeplay"\ngap = 0.02\n'
    tight = '[[spring]]\nat = "pitch"\nkind = "freeplay"\ngap_deg = 0\n'
    found = []
    for name, springs in (("one", f"[spring]\n{gap}"), ("two", f"{tight}[[spring]]\n{gap}")):
        file = tmp_path / f"{name}.toml"
        file.write_text(sections + springs)
        ratio = ("--speed-ratio", "1.03", "--simulations", "0")
        answer = said(capsys, "lco", str(file), *ratio)
        (cycle,) = answer["cycles"]
        found.append({one["name"]: one["amplitude"] for one in cycle["coordinates"]})
        assert cycle["symmetric"]
        told = (cycle["amplitude_deg"], found[-1]["pitch"])
        if name == "one":
            assert cycle["amplitude_deg"] is None
            told = (cycle["springs"][0]["amplitude"], found[-1]["heave"])
        assert told[0] == pytest.approx(told[1], rel=1e-9)
    assert found[0] == pytest.approx(found[1], rel=1e-6)
    assert answer["onset"]["amplitude_deg"] < 1e3  # followed as far as the gap is worth in pitch
    start = ("--speed-ratio", "0.9", "--alpha-deg", "2")  # of pitch, whichever is told of
    run = said(capsys, "simulate", str(tmp_path / "one.toml"), *start)
    assert run["alpha_deg"] == 2.0
    assert abs(run["rest"]) < 0.01
    assert run["rest_deg"] is None


def test_a_map_over_one_of_two_gaps(worn: str, capsys: pytest.CaptureFixture[str]) -> None:
    """The flap's gap along x: cells end as single runs of the changed case end."""
    grid = ["--x", "spring.flap.gap_deg=0.5:1:2", "--alpha-deg", "1:3:2", "--workers", "0"]
    found = said(capsys, "map", worn, "--speed-ratio", "0.7", *grid)
    states = []
    for gap in ("0.5", "1"):
        for alpha in ("1", "3"):
            changed = ["--set", f"spring.flap.gap_deg={gap}", "--alpha-deg", alpha]
            states.append(said(capsys, "simulate", worn, "--speed-ratio", "0.7", *changed)["state"])
    assert (found["lco"], found["damped"]) == (states.count("lco"), states.count("damped"))


def test_houbolt_takes_one_spring(worn: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", worn, "--speed-ratio", "0.7", "--engine", "houbolt"]) == 2
    assert "engine: Houbolt's scheme" in capsys.readouterr().err


# --- cycles ---------------------------------------------------------------------------------------


def a_spring(rng: np.random.Generator, size: float) -> Spring:
    """A law of straight pieces: gap, loop, preload or table, centred or not."""
    kind = rng.integers(4)
    if kind == 0:
        return Freeplay(size)
    if kind == 1:
        return Hysteresis(size * rng.uniform(0.05, 1), size)
    if kind == 2:
        if rng.random() < 0.3:
            return Bilinear(0.0, rng.uniform(0, 0.7), -size / 2, size)
        return Freeplay(size, rng.uniform(-0.3, 0.3) * size)
    steep = 1 + rng.uniform(0, 1, 2)
    moments = np.array([-steep[0], -0.3, 0.3, steep[1]]) * size / 2
    return Table((-size, -size / 2, size / 2, size), tuple(moments))


def a_loop(seed: int) -> tuple[SectionModel, tuple[Spring, Spring]]:
    """A section with springs in pitch and heave."""
    rng = np.random.default_rng(seed)
    section = TypicalSection(
        omega_bar=rng.uniform(0.3, 0.9),
        mu=rng.uniform(30, 150),
        a_h=rng.uniform(-0.6, -0.3),
        x_alpha=rng.uniform(0.1, 0.3),
        zeta_alpha=0.02,
        zeta_xi=0.02,
    )
    springs = a_spring(rng, 0.02), a_spring(rng, 0.02 * rng.uniform(0.2, 1))
    return SectionModel(section, springs=["pitch", "heave"]), springs


def balanced(seed: int) -> tuple[HarmonicBranch, ...]:
    options = HarmonicOptions(
        tolerance=3e-4, max_harmonics=41, max_step=0.1, speed_ratio_range=(0.2, 1.3)
    )
    return harmonic_families(*a_loop(seed), options)


def compare(seed: int, points: int) -> tuple[list[float], set[bool], set[bool]]:
    """Differences of amplitude between harmonic balance and exact cycles; what cycles these are."""
    family, springs = a_loop(seed)
    differences, stable, symmetric = [], set(), set()
    for branch in balanced(seed):
        for i in np.linspace(1, len(branch.cycles) - 2, points).astype(int):
            cycle = branch.cycles[i]
            if any(
                isinstance(spring, Hysteresis) and swing.amplitude <= spring.delta_v / 2
                for spring, swing in zip(springs, cycle.springs, strict=True)
            ):
                continue  # the loop sticks: the balance walks along the places where it may
            if np.abs(cycle.multipliers).max() >= 1e3:
                continue  # no shooting over a period gets there: some have 1e17
            try:
                exact = cycle_near(family, springs, cycle.motions, cycle.omega, cycle.speed)
            except ConvergenceError:  # beside a fold the next cycle may be at no such speed
                differences.append(np.inf)
                continue
            assert exact.closure < 1e-10
            away = abs(exact.speed / cycle.speed - 1.0)
            swings = zip(exact.springs, cycle.springs, strict=True)
            sizes = [abs(one.amplitude / other.amplitude - 1.0) for one, other in swings]
            differences.append(away + max(sizes))
            stable.add(exact.stable)
            symmetric.add(exact.symmetric)
    return differences, stable, symmetric


@pytest.mark.parametrize("seed", [0, 1, 3])
def test_harmonic_balance_and_exact_cycles_of_two_springs_agree(seed: int) -> None:
    """Amplitudes of both springs, within what the balance itself says it has left out."""
    differences, stable, _ = compare(seed, 6)
    assert stable == {True, False}
    assert np.sort(differences)[:-1] == pytest.approx(0.0, abs=1e-3)


@pytest.mark.slow
def test_fifty_random_pairs_of_springs() -> None:
    """Stable and unstable, odd and not, within 1e-3 once the balance has harmonics enough.

    Shooting over a whole period multiplies what the balance leaves out by the largest multiplier:
    from 1e3 on nothing can be asked of it (some cycles have 1e11). Of the others some stay on one
    straight piece, or on the edge of a loop that sticks: those few are no cycles of the kind.
    """
    differences, stable, symmetric = [], set[bool](), set[bool]()
    for seed in range(50):
        family, springs = a_loop(seed)
        for branch in balanced(seed):
            for i in np.linspace(1, len(branch.cycles) - 2, 4).astype(int):
                cycle = branch.cycles[i]
                if np.abs(cycle.multipliers).max() < 1e3 and not sticks(springs, cycle):
                    differences.append(nearest(family, springs, cycle, stable, symmetric))
    assert stable == symmetric == {True, False}
    assert len(differences) > 150
    assert np.mean(np.array(differences) < 1e-3) > 0.97


def sticks(springs: tuple[Spring, Spring], cycle: Any) -> bool:
    """Whether a loop never slides: the balance walks along the places where it may."""
    return any(
        isinstance(spring, Hysteresis) and swing.amplitude <= spring.delta_v / 2
        for spring, swing in zip(springs, cycle.springs, strict=True)
    )


def nearest(
    family: SectionModel,
    springs: tuple[Spring, Spring],
    cycle: Any,
    stable: set[bool],
    symmetric: set[bool],
) -> float:
    """Difference of amplitudes and speed between a balance and the exact cycle next to it."""
    for harmonics in (None, 81):
        try:
            if harmonics is not None:
                options = HarmonicOptions(harmonics=harmonics)
                cycle = solve_cycle(family, springs, cycle, options=options)
            exact = cycle_near(family, springs, cycle.motions, cycle.omega, cycle.speed)
        except ConvergenceError:
            continue
        swings = zip(exact.springs, cycle.springs, strict=True)
        away = abs(exact.speed / cycle.speed - 1.0)
        away += max(abs(one.amplitude / other.amplitude - 1.0) for one, other in swings)
        if away < 1e-3:
            stable.add(exact.stable)
            symmetric.add(exact.symmetric)
            return float(away)
    return np.inf


def test_harmonic_balance_of_two_springs_converges() -> None:
    """To the exact cycle, with the third power of the harmonics or so: moments have kinks."""
    family, springs = a_loop(3)
    branch = balanced(3)[0]
    start = branch.cycles[len(branch.cycles) // 2]
    exact = cycle_near(family, springs, start.motions, start.omega, start.speed)
    errors = []
    for harmonics in (5, 11, 23, 47):
        options = HarmonicOptions(harmonics=harmonics)
        cycle = solve_cycle(family, springs, start, options=options, symmetric=True)
        sizes = np.abs(cycle.motions[:, 1]) / np.abs(exact.outputs[:, 1])
        errors.append(float(np.max(np.abs(sizes - 1.0))))
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < 1e-2 * errors[0]
    assert errors[-1] < 1e-6


def test_multipliers_of_two_springs_are_those_of_differences() -> None:
    """Of the exact map, by central differences, for an unstable and a stable cycle."""
    family, springs = a_loop(0)
    seen = set()
    for cycle in balanced(0)[0].cycles[20::40]:
        found = cycle_near(family, springs, cycle.motions, cycle.omega, cycle.speed)
        flow = Flow(family.at(found.speed), springs)
        matrix = np.empty((flow.n, flow.n))
        for i in range(flow.n):
            step = np.eye(flow.n)[i] * 1e-7 * np.abs(found.state).max()
            ends = [flow.passage(found.state + s * step, found.period).end for s in (1, -1)]
            matrix[:, i] = (ends[0] - ends[1]) / (2 * step[i])
        expected = np.linalg.eigvals(matrix)
        largest = np.sort(np.abs(expected))[::-1][:3]
        assert np.sort(np.abs(found.multipliers))[::-1][:3] == pytest.approx(largest, rel=1e-3)
        assert np.sort(np.abs(cycle.multipliers))[::-1][:2] == pytest.approx(largest[:2], abs=0.05)
        seen.add(found.stable)
    assert seen == {True, False}


def test_springs_that_share_a_coordinate_are_their_sum() -> None:
    """A gap and a spring of half its stiffness beside it, in pitch: a bilinear spring of 1.5.

    Scaled to unit slope that is a spring of inner slope a third on a section of 1.5 times the
    stiffness.
    """
    section = TypicalSection(omega_bar=0.6, zeta_alpha=0.02, zeta_xi=0.02)
    gap, third = Freeplay(0.02), Bilinear(-0.01 / 3, 1 / 3, -0.01, 0.02)
    half = Bilinear(-0.01, 1.0, -0.01, 0.02)  # straight, though it does not say so
    several = SectionModel(section, springs=["pitch", "pitch"], stiffness=[1.0, 0.5])
    one = SectionModel(section, springs=["pitch"], stiffness=[1.5])
    options = HarmonicOptions(harmonics=9, speed_ratio_range=(0.3, 1.2))
    expected = harmonic_families(one, third, options)[0]
    start = expected.cycles[len(expected.cycles) // 2]
    guess = replace(start, outputs=np.array([start.Y, start.Y]))
    found = solve_cycle(several, (gap, half), guess, options=options, symmetric=True)
    assert pytest.approx(start.Y, abs=1e-9) == found.Y
    exact = cycle_near(several, (gap, half), found.motions, found.omega, found.speed)
    alone = cycle_near(one, third, start.Y, start.omega, start.speed)
    assert exact.amplitude == pytest.approx(alone.amplitude, rel=1e-10)
    assert exact.multipliers[1] == pytest.approx(alone.multipliers[1], rel=1e-8)


def test_every_stable_cycle_of_two_springs_is_on_a_family() -> None:
    """What motions from all sizes and sides end on is among the cycles at that speed."""
    family, springs = a_loop(1)
    speed = 0.9 * root_locus(family).flutter.speed
    options = CycleOptions(simulations=4, points=2, depth=1)
    known = cycles_at(family, springs, speed, options).cycles
    rng = np.random.default_rng(5)
    states = 0.1 * rng.normal(size=(60, 6)) * [1, 1, 0.1, 0.1, 1, 1]
    ends = end_states(Flow(family.at(speed), springs), states, 0.0, share=True)
    stable = [cycle.amplitude for cycle in known if cycle.stable]
    assert stable
    assert "lco" in {STATES[code] for code in ends.state}
    for code, amplitude in zip(ends.state, ends.amplitude, strict=True):
        if STATES[code] == "lco":
            assert min(abs(amplitude / one - 1.0) for one in stable) < 1e-6


def test_a_loop_in_heave_that_never_meets_its_stops_may_sit_anywhere() -> None:
    """Nothing but its spring depends on heave: another multiplier is one, and motions end there.

    By harmonic balance too, where the flip that this looks like is none.
    """
    family, springs = a_loop(1)
    speed = 0.7940455657135764 * root_locus(family).flutter.speed
    options = CycleOptions(simulations=4, points=2, depth=1)
    (cycle,) = cycles_at(family, springs, speed, options).cycles
    assert (cycle.stable, cycle.continuum, cycle.symmetric) == (True, True, True)
    assert cycle.multipliers[1] == pytest.approx(1.0, abs=1e-9)
    stable = [one for one in balanced(1)[0].cycles if abs(one.speed / speed - 1.0) < 0.03]
    assert stable
    assert all(one.stable for one in stable)
    ends = end_states(Flow(family.at(speed), springs), [[0, 0.1, 0, 0, 0, 0]], 0.0)
    assert ends.amplitude[0] == pytest.approx(cycle.amplitude, rel=1e-9)


def test_df_of_two_springs_is_the_balance_of_one_harmonic() -> None:
    """With one spring outside it is the curve of old; and it says that its bands are for one."""
    family, springs = a_loop(3)
    curve = describing_curve(family, springs, DescribingOptions(points=30))
    i = int(np.argmin(curve.distortion))
    Y = np.array([one.amplitude for one in curve.swings(i)[1]])
    system = family.at(curve.speed[i])
    gains = [s.describing(a, 0.0).N for s, a in zip(springs, Y, strict=True)]
    roots = np.linalg.eigvals(system.A - (system.B * np.array(gains)) @ system.C)
    assert np.min(np.abs(roots - 1j * curve.k[i])) < 1e-9
    reasons = guarantees(family, springs, curve).reason
    assert set(reasons) == {"there are several springs: bands are for one"}


def test_a_spring_that_hardly_matters_leaves_the_curve_of_the_other() -> None:
    """A heave gap of a hundred thousandth: the describing function of pitch alone."""
    section = TypicalSection(omega_bar=0.8)
    options = DescribingOptions(points=30)
    alone = describing_curve(
        SectionModel(section, springs=["pitch"]), Hysteresis(1.0, 0.2), options
    )
    both = SectionModel(section, springs=["pitch", "heave"])
    found = describing_curve(both, (Hysteresis(1.0, 0.2), Freeplay(1e-5)), options)
    assert found.onset.speed == pytest.approx(alone.onset.speed, rel=1e-4)
    assert (found.onset.kind, found.onset.stable) == (alone.onset.kind, alone.onset.stable)


def test_curves_of_two_worn_hinges_from_the_command_line(
    worn: str, capsys: pytest.CaptureFixture[str], tmp_path: Any
) -> None:
    """`df` and `lco` list both springs at every point, in JSON and in the file."""
    out = tmp_path / "curve.nc"
    found = said(capsys, "df", worn, "--points", "8", "--out", str(out))
    assert {one["at"] for point in found["branch"] for one in point["springs"]} == {"pitch", "flap"}
    assert found["branch"][0]["guarantee"]["guaranteed"] is False
    with xr.open_dataset(out) as saved:
        assert saved.coordinate_amplitude.dims == ("point", "coordinate")
        assert saved.spring_at.values[0].tolist() == ["pitch", "flap"]


# --- published sections ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("omega_bar", "zeta_alpha", "beta3", "unit", "linear", "fold"),
    [(np.sqrt(0.2), 0.1, 40.0, 1.0, 4.080, None), (1.0, 0.2236, 200.0, 5.0, 0.9965, 0.908)],
)
def test_cubic_springs_in_both_coordinates(
    omega_bar: float,
    zeta_alpha: float,
    beta3: float,
    unit: float,
    linear: float,
    fold: float | None,
) -> None:
    """Chen, Chen & Liu (2012), Q = U²: as printed, and with a fifth of the pitch stiffness.

    The first is supercritical, the second subcritical; its fold is that of one harmonic. Printed
    to three digits.
    """
    section = TypicalSection(
        mu=20, a_h=-0.1, x_alpha=0.25, r_alpha=np.sqrt(0.5), omega_bar=omega_bar,
        zeta_alpha=zeta_alpha, zeta_xi=0.1118,
    )  # fmt: skip
    family = SectionModel(section, QuasiSteady(), ["heave", "pitch"])
    assert root_locus(family).flutter.speed ** 2 / unit == pytest.approx(linear, abs=5e-4)
    options = DescribingOptions(points=20, speed_ratio_range=(0.5, 1.5))
    (one,) = describing_curve(family, (Cubic(1, 25.0), Cubic(1, beta3)), options).families
    if fold is None:
        assert (one.onset.kind, one.stable_onset.kind) == ("edge", "edge")
        assert all(cycle.stable for cycle in one.cycles)
    else:
        assert one.onset.kind == "fold"
        assert one.onset.speed**2 / unit == pytest.approx(fold, abs=2e-3)


def rig(m: float, heave: float, S: float, I_alpha: float, **rest: float) -> SectionFamily:
    section = TypicalSection.from_si(m=m, m_heave=heave, S=S, I_alpha=I_alpha, **rest)
    return SectionFamily(section)


def test_bristol_rig() -> None:
    """Heave, mm, of the stable cycles of model 1's own equations, at four airspeeds in m/s.

    The measured ones are 19.2, 25.9, 32.7 and 44.3: the model is softer than the rig.
    """
    family = rig(
        5.3, 16.9, 0.1908, 0.1724, b=0.15, rho=1.204, K_alpha=54.1162, K_h=3529.4,
        c_alpha=0.5628, c_h=14.5756,
    )  # fmt: skip
    scale = family.section.scale
    assert scale is not None
    flutter = root_locus(family).flutter
    assert scale.velocity(flutter.speed) == pytest.approx(17.957, abs=5e-4)
    spring = Polynomial((1.0, 751.6 / 54.1162, 5006.7 / 54.1162))
    options = HarmonicOptions(harmonics=7, max_step=0.1, speed_ratio_range=(0.8, 1.05))
    (branch,) = harmonic_families(family, spring, options)
    stable = [cycle for cycle in branch.cycles if cycle.stable]
    speeds = [scale.velocity(cycle.speed) for cycle in stable]
    heaves = [150 * cycle.coordinates[0].amplitude for cycle in stable]
    order = np.argsort(speeds)
    found = np.interp([14.9, 15.6, 16.5, 17.3], np.array(speeds)[order], np.array(heaves)[order])
    assert found == pytest.approx([21.7, 25.4, 29.1, 32.1], abs=0.15)


def test_nata() -> None:
    """Flutter by Jones's terms with totals per span of 0.6 m, and a stable cycle below it."""
    family = rig(
        1.662 / 0.6, 12.387 / 0.6, 1.662 * 0.066 / 0.6, 0.065 / 0.6, a_h=-0.8424, b=0.135,
        rho=1.225, K_alpha=2.82 / 0.6, K_h=2844.4 / 0.6, c_alpha=0.036 / 0.6, c_h=27.43 / 0.6,
    )  # fmt: skip
    scale, flutter = family.section.scale, root_locus(family).flutter
    assert scale is not None
    assert scale.velocity(flutter.speed) == pytest.approx(16.18, abs=5e-3)
    assert scale.frequency_hz(flutter.k, flutter.speed) == pytest.approx(2.05, abs=5e-3)
    spring = Polynomial((1.0, -22.1, 1315.5, -8580.0, 17289.7))
    options = HarmonicOptions(harmonics=7, max_step=0.1, speed_ratio_range=(0.6, 1.1))
    (branch,) = harmonic_families(family, spring, options)
    assert branch.stable_onset is not None
    assert scale.velocity(branch.stable_onset.speed) < 14.25  # where one was measured


def test_exponents_of_two_springs(worn: str, capsys: pytest.CaptureFixture[str]) -> None:
    """On a cycle the largest but the zero one is what its multiplier says."""
    found = said(capsys, "chaos", worn, "--speed-ratio", "0.7", "--cycles", "300")
    assert found["verdict"] == "periodic"
    first, second = found["lyapunov"][:2]
    assert first == pytest.approx(0.0, abs=1e-4)
    assert second == pytest.approx(found["floquet_exponent"], rel=0.02)


def test_files_and_figures_of_a_flap_speak_of_the_flap(tmp_path: Any) -> None:
    """The first spring of this case is in the flap: nothing that is saved calls it pitch."""
    case, out = load_case("conner"), tmp_path / "flap.nc"
    arguments = ["simulate", "conner", "--speed-ratio", "0.3", "--out", str(out)]
    assert main(arguments) == 0
    with xr.open_dataset(out) as saved:
        assert saved.flap_deg.attrs["long_name"] == "flap"
        names = [one.attrs.get("long_name", "") for one in saved.variables.values()]
        assert not any("pitch" in name for name in names)
        beta = saved.states.values[:, saved.state_name.values.tolist().index("beta")]
        assert np.degrees(beta) == pytest.approx(saved.flap_deg.values, abs=1e-12)
    figure, axes = figure_of()
    axes.set_ylabel("pitch amplitude (deg)")
    named_after(figure, case.model().names[0])
    assert axes.get_ylabel() == "flap amplitude (deg)"


def figure_of() -> Any:
    figure = Figure()
    return figure, figure.subplots()


# --- what one of several springs may be, and its loop ---------------------------------------------


def test_the_loop_beside_a_straight_spring_is_that_of_a_spring_alone() -> None:
    """The first spring is as good as linear: its describing function is its slope."""
    section = TypicalSection(omega_bar=0.6, zeta_alpha=0.02, zeta_xi=0.02)
    gap, straight = Freeplay(0.02), Cubic(1.0, 1e-9)
    options, few = LoopTestOptions(points=50), DescribingOptions(points=16)
    one = SectionModel(section, springs=["pitch"])
    alone = loop_test(one, gap, 3.0, options, describing_curve(as_lure(one), gap, few))
    both, laws = SectionModel(section, springs=["heave", "pitch"]), [straight, gap]
    found = loop_test(both, laws, 3.0, options, describing_curve(both, laws, few), which=1)
    cycle, other = alone.cycles[-1], found.cycles[-1]
    assert (other.amplitude, other.k) == pytest.approx((cycle.amplitude, cycle.k), rel=1e-6)
    assert other.predicted[1::2] == pytest.approx(cycle.predicted[1::2], rel=1e-4)
    system = SectionModel(section, springs=["pitch"]).at(3.0)
    seen = system.transfer(1j * found.frequency)[:, 0, 0]
    assert pytest.approx(seen, rel=1e-6) == found.G
    assert not other.guarantee.guaranteed[0]


@pytest.mark.slow
def test_how_large_one_of_two_springs_may_be() -> None:
    """The amplitude is met at the answer, and passed with a spring that is larger."""
    family, springs = a_loop(1)
    options = CycleOptions(simulations=4, speed_ratio_range=(0.5, 1.0))
    limit = 0.018
    found = tolerance(family, springs, 0.7, limit, options, which=0)
    assert found.which == 0
    assert found.worst is not None
    assert found.worst.amplitude == pytest.approx(limit, rel=2e-3)
    assert found.worst.amplitude <= limit * (1 + 1e-9)
    assert found.spring == springs[0].scaled(found.factor)
    sizes = np.array(found.trials)
    assert np.all(np.diff(sizes[:, 1]) >= -1e-9)
    with pytest.raises(InputError, match="has no friction to vary"):
        least_friction(family, springs, 0.7, limit, options, which=0)


@pytest.mark.slow
def test_onset_of_two_springs_is_that_of_its_cycles() -> None:
    options = CycleOptions(simulations=0, depth=0, points=2, speed_ratio_range=(0.5, 0.8))
    family, springs = a_loop(1)
    found = onset(family, springs, options)
    assert found.lowest is not None
    assert found.free is None
    assert any("nothing is proved free" in note for note in found.notes)
    assert found.lowest.cycle.speed == limit_cycles(family, springs, options).onset.cycle.speed


def test_the_slope_of_a_curve_is_that_of_its_own_family() -> None:
    """Two parabolas one after the other, and a point that a family shares with itself."""
    A = np.linspace(1.0, 2.0, 41)
    family = np.repeat([1, 2], 41)
    amplitude, speed = np.concatenate((A, A)), np.concatenate((A**2, 5.0 - A**3))
    found = _slopes(family, speed, amplitude)
    inner = np.r_[1:40, 42:81]
    assert found[inner] == pytest.approx(np.concatenate((2.0 * A, -3.0 * A**2))[inner], rel=1e-3)
    turn = _slopes(np.ones(3, dtype=int), np.array([1.0, 2.0, 3.0]), np.array([1.0, 1.5, 1.0]))
    assert np.isnan(turn[1])
    assert turn[[0, 2]] == pytest.approx([2.0, -2.0])
