"""Several springs through the analyses and the command line."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import oracle_springs as oracle
import pytest

from aeroflutter import Freeplay, Hysteresis, TypicalSection
from aeroflutter.case import load_case
from aeroflutter.cli import main
from aeroflutter.linear.rootlocus import root_locus
from aeroflutter.model.family import SectionModel
from aeroflutter.motion import Initial, SimulateOptions, simulate, sweep
from aeroflutter.motion.swings import extremes

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
