"""`aeroflutter lco` and `tolerance`: their contract, figures, the tolerable spring."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from aeroflutter.case import load_case
from aeroflutter.cli import main
from aeroflutter.errors import ConvergenceError, InputError
from aeroflutter.model.lure import FixedFamily, SectionFamily
from aeroflutter.model.section import TypicalSection
from aeroflutter.motion.endstates import end_state
from aeroflutter.motion.flow import Flow
from aeroflutter.orbits.cycles import CycleOptions, limit_cycles
from aeroflutter.springs import Freeplay, Hysteresis, Linear
from aeroflutter.studies.tolerance import least_friction, tolerance

SECTION = SectionFamily(TypicalSection(omega_bar=0.8))
QUICK = CycleOptions(simulations=0, depth=0, points=30)


def printed(capsys: pytest.CaptureFixture[str], *words: str) -> dict[str, Any]:
    assert main([*words, "--json"]) == 0
    return dict(json.loads(capsys.readouterr().out))


def test_lco_prints_the_contract(capsys: pytest.CaptureFixture[str]) -> None:
    found = printed(capsys, "lco", "run14", "--simulations", "0")
    names = (
        "amplitude_deg bias_deg first_harmonic_deg speed_ratio period stable multipliers symmetric"
    )
    assert len(found["branch"]) >= 200
    assert all(set(names.split()) <= set(point) for point in found["branch"])
    assert np.shape([point["multipliers"] for point in found["branch"]])[1:] == (6, 2)
    assert {"kind", "speed_ratio", "amplitude_deg"} <= set(found["bifurcations"][0])
    onset = found["onset"]
    assert (onset["kind"], onset["stable"]) == ("fold", True)
    lowest = min(point["speed_ratio"] for point in found["branch"])
    assert onset["speed_ratio"] == lowest


def test_lco_at_one_speed_lists_the_cycles_there(capsys: pytest.CaptureFixture[str]) -> None:
    found = printed(capsys, "lco", "run14", "--speed-ratio", "0.95", "--simulations", "0")
    assert [point["stable"] for point in found["cycles"]] == [False, True]
    assert all(abs(point["speed_ratio"] - 0.95) < 1e-14 for point in found["cycles"])
    assert found["cycles"] == found["branch"]


def test_lco_draws_and_saves(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    csv = tmp_path / "wind-tunnel.csv"
    csv.write_text("speed_ratio,amplitude_deg,remark\n0.95,1.4,a\n0.97, 2.2,b\n")
    figure, file = tmp_path / "lco.svg", tmp_path / "lco.nc"
    overlays = ["--df", "--simulate", "0.93:0.97:2", "--points-csv", str(csv)]
    quick = ["--simulations", "0", "--points", "20"]
    targets = ["--plot", str(figure), "--out", str(file)]
    assert main(["lco", "run14", *quick, *overlays, *targets]) == 0
    assert "stable onset" in capsys.readouterr().out
    assert figure.stat().st_size > 10_000
    with xr.open_dataset(file) as saved:
        assert saved["multipliers"].attrs["units"] == "1"
        assert saved.attrs["onset_kind"] == "fold"
        assert float(saved["closure"].max()) < 1e-10
    circle = tmp_path / "circle.png"
    assert main(["lco", "run14", *quick, "--figure", "multipliers", "--plot", str(circle)]) == 0
    assert circle.stat().st_size > 10_000


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "has no rows"),
        ("speed_ratio\n0.9\n", "lacks the column amplitude_deg"),
        ("speed,amplitude_deg\n0.9,high\n", "could not convert"),
    ],
)
def test_points_that_cannot_be_used_are_refused(
    text: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    csv = tmp_path / "points.csv"
    csv.write_text(text)
    words = ["lco", "run14", "--plot", str(tmp_path / "a.png"), "--points-csv", str(csv)]
    assert main(words) == 2
    error = capsys.readouterr().err
    assert message in error
    assert "points.csv" in error


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["lco", "run14", "--speed-ratio", "-1"], "--speed-ratio: must be a positive number"),
        (["lco", "run14", "--speed", "3", "--speed-ratio", "1"], "give one of the two"),
        (["lco", "run14", "--df"], "give --plot FILE"),
        (["tolerance", "run14", "--speed-ratio", "0.9", "--amplitude-deg", "0"], "--amplitude-deg"),
        (["tolerance", "linear-02", "--speed-ratio", "0.9", "--amplitude-deg", "1"], "linear"),
    ],
)
def test_bad_words_are_refused_in_one_line(
    words: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(words) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert message in captured.err


# --- tolerance -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "spring", [Hysteresis(1.0, 0.2), Freeplay(1.0)], ids=lambda spring: spring.kind
)
def test_the_tolerable_spring_has_cycles_of_just_that_amplitude(spring: Any) -> None:
    """The branch of the answer, and a motion of it at the highest speed."""
    limit = np.radians(2.0)
    answer = tolerance(SECTION, spring, 0.95, limit, QUICK)
    assert answer.spring is not None
    again = limit_cycles(SECTION, answer.spring, replace(QUICK, points=400))
    stable = [c.amplitude for c in again.cycles if c.stable and c.speed_ratio <= 0.95]
    assert 0.98 * limit < max(stable) < limit * (1 + 1e-9)
    prepared = Flow(SECTION.at(answer.speed), [answer.spring])
    assert answer.worst is not None
    start = 1.02 * answer.factor * answer.worst.state  # beside the largest cycle, to scale
    end = end_state(prepared, start, answer.factor * answer.worst.memory)
    assert end.state == "lco"
    assert abs(end.amplitude / limit - 1.0) < 1e-8


def test_below_every_stable_cycle_any_size_is_tolerable() -> None:
    answer = tolerance(SECTION, Hysteresis(1.0, 0.2), 0.9, 0.01, QUICK)
    assert answer.unlimited
    assert answer.spring is None


@pytest.mark.slow
def test_least_friction_is_just_enough() -> None:
    limit = 1.4
    answer = least_friction(SECTION, Hysteresis(0.2, 1.0), 0.86, limit, QUICK)
    assert isinstance(answer.spring, Hysteresis)
    assert answer.spring.delta_h == 1.0

    def largest(delta_v: float) -> float:
        trial = tolerance(SECTION, Hysteresis(delta_v, 1.0), 0.86, limit, QUICK)
        return 0.0 if trial.worst is None else trial.worst.amplitude

    assert largest(answer.spring.delta_v) <= limit < largest(answer.spring.delta_v * 0.999)


@pytest.mark.slow
def test_least_friction_does_not_depend_on_the_friction_it_starts_from() -> None:
    """From a hundred millionth of the gap as from a fifth: no corner of a thin loop ends it."""
    limit, options = 0.5, replace(QUICK, points=10)
    known = least_friction(SECTION, Hysteresis(0.2, 1.0), 0.86, limit, options)
    thin = least_friction(SECTION, Hysteresis(1e-8, 1.0), 0.86, limit, options)
    assert thin.spring.delta_v == pytest.approx(known.spring.delta_v, rel=1e-3)
    assert thin.factor * 1e-8 == pytest.approx(thin.spring.delta_v)


def test_tolerance_refuses_and_says_when_nothing_is_tolerable() -> None:
    with pytest.raises(ConvergenceError, match="no size is tolerable"):
        tolerance(SECTION, Hysteresis(1.0, 0.2), 1.0, 0.1, QUICK)
    with pytest.raises(InputError, match="linear"):
        tolerance(SECTION, Linear(), 0.9, 0.1)
    with pytest.raises(InputError, match="does not depend on speed"):
        tolerance(FixedFamily(SECTION.at(3.9)), Freeplay(1.0), 0.9, 0.1)
    with pytest.raises(InputError, match="delta_h_deg"):
        least_friction(SECTION, Freeplay(1.0), 0.9, 0.1)


def test_tolerance_prints_the_spring_as_a_case_writes_it(
    capsys: pytest.CaptureFixture[str],
) -> None:
    found = printed(capsys, "tolerance", "run14", "--speed-ratio", "0.95", "--amplitude-deg", "2")
    assert found["worst"]["speed_ratio"] == pytest.approx(0.95, abs=1e-14)
    own = load_case("run14").spring
    assert isinstance(own, Hysteresis)
    assert found["spring"]["delta_h_deg"] == pytest.approx(
        np.degrees(own.delta_h) * 2.0 / found["worst"]["amplitude_deg"], rel=1e-12
    )
