"""`aeroflutter map`: keys, axes, files, and what it survives."""

from __future__ import annotations

import json
import os
import random
import signal
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from killing import (
    arrays,
    command,
    committed,
    dask,
    finish,
    kill_parent,
    kill_workers,
    start,
    wait_for_blocks,
    workers,
)

from aeroflutter.case import load_case
from aeroflutter.cli import main
from aeroflutter.linear.rootlocus import flutter_speed
from aeroflutter.motion.endstates import EndOptions, end_state
from aeroflutter.motion.flow import Flow
from aeroflutter.motion.response import STATES, Initial

KEYS = {"cells", "damped", "lco", "aperiodic", "divergent", "undecided", "cpu_seconds", "store"}
# Freeplay takes its time, so that there is something to kill: 47 blocks in a second or two.
SLOW = ("run100", "--speed-ratio", "0.12:0.99:140", "--alpha-deg", "-15:15:30")
BLOCKS = 47


def run(capsys, *words: str) -> tuple[int, str, str]:
    code = main(["map", *words])
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def result(capsys, *words: str) -> dict:
    code, out, err = run(capsys, *words, "--json")
    assert code == 0, err
    assert out.count("\n") == 1
    return json.loads(out)


def refused(capsys, *words: str) -> list[str]:
    code, out, err = run(capsys, *words)
    assert (code, out) == (2, "")
    return err.splitlines()


def alone(case, speed: float, alpha_deg: float):
    """The end of one cell by itself."""
    prepared = Flow(case.family().at(speed), [case.spring])
    initial = Initial(**case.initial._replace(alpha=np.radians(alpha_deg))._asdict())
    return end_state(prepared, *initial.start(prepared.system, case.spring), EndOptions())


def test_keys_and_counts(capsys) -> None:
    found = result(capsys, "run14", "--speed-ratio", "0.9:0.99:10", "--alpha-deg", "-6:6:4")
    assert set(found) >= KEYS
    assert found["cells"] == 40
    assert sum(found[state] for state in (*STATES, "failed")) == 40
    assert found["undecided"] == found["failed"] == 0
    assert found["store"] is None
    assert found["cpu_seconds"] > 0
    assert found["x"]["key"] == "speed_ratio"
    assert found["y"]["values"] == [-6.0, -2.0, 2.0, 6.0]


def test_lists_of_negative_pitches(capsys) -> None:
    words = ("run14", "--speed-ratio", "0.9,0.95,0.97", "--alpha-deg", "-8,-0.5,8")
    found = result(capsys, *words)
    assert found["y"]["values"] == [-8.0, -0.5, 8.0]
    assert (found["damped"], found["lco"]) == (5, 4)  # cycles at ±8 degrees from 0.95 on


def test_any_two_keys_of_the_case(capsys, tmp_path: Path) -> None:
    out = tmp_path / "m.nc"
    axes = ("--x", "section.zeta_alpha=0:0.01:2", "--y", "spring.delta_v_deg=0.5,1")
    result(capsys, "run14", *axes, "--speed-ratio", "0.95", "--out", str(out))
    with xr.open_dataset(out) as found:
        assert found["state"].dims == ("zeta_alpha", "delta_v_deg")
        for i, zeta in enumerate(found["zeta_alpha"].values):
            for j, height in enumerate(found["delta_v_deg"].values):
                changes = {"section.zeta_alpha": zeta, "spring.delta_v_deg": height}
                case = load_case("run14", changes)
                # a ratio is one to the flutter speed of the cell's own section
                end = alone(case, 0.95 * flutter_speed(case.family()), 6.0)
                assert STATES[int(found["state"][i, j])] == end.state
                # Newton closes the cycle to round-off, from the same start
                assert float(found["amplitude_deg"][i, j]) == pytest.approx(
                    np.degrees(end.amplitude), rel=1e-9, abs=1e-12
                )


def test_a_key_against_speed_and_two_starting_conditions(capsys) -> None:
    found = result(capsys, "run14", "--y", "initial.xi=0:0.1:3", "--speed", "3.8,3.9")
    assert [found[axis]["key"] for axis in "xy"] == ["speed", "initial.xi"]
    axes = ("--x", "initial.xi=0:0.1:3", "--y", "initial.alpha_rate_deg=0:1:2")
    assert result(capsys, "run14", *axes, "--speed-ratio", "0.95")["cells"] == 6


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--x", "foo.bar=1:2:3"), "foo: is not a known key"),
        (("--x", "section.mu=1:2:3", "--y", "section.r_alpha=1:2:3"), "give the airspeed"),
        (("--x", "section.mu"), "KEY=A:B:N"),
        (("--speed-ratio", "0:1:5"), "must be positive"),
        (("--speed-ratio", "1:2"), "A:B:N"),
        (("--speed", "1:2:3", "--speed-ratio", "1:2:3"), "give one of the two"),
        (("--workers", "-1"), "zero or more"),
        (("--resume",), "name the store with --out"),
        (("--out", "m.csv"), "must end in .zarr or .nc"),
        (("--refine", "--tolerance", "0"), "positive width"),
        (("--scheduler", "tcp://127.0.0.1:1"), "no Dask scheduler answers"),
    ],
)
def test_bad_options_are_one_line(capsys, words, message: str) -> None:
    small = () if "--speed-ratio" in words or "--x" in words else ("--speed-ratio", "0.9:1:3")
    lines = refused(capsys, "run14", *small, *words)
    assert len(lines) == 1
    assert message in lines[0]


def test_netcdf_says_what_it_holds_and_where_it_came_from(capsys, tmp_path: Path) -> None:
    out = tmp_path / "m.nc"
    words = ("run14", "--speed-ratio", "0.9:0.95:4", "--alpha-deg", "2:8:3", "--refine")
    found = result(capsys, *words, "--out", str(out))
    assert found["store"] == str(tmp_path / "m.zarr")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["m.nc", "m.zarr"]
    with xr.open_dataset(out) as data:
        assert data.attrs["Conventions"].startswith("CF-")
        assert "aeroflutter" in data.attrs["source"]
        assert "[section]" in data.attrs["case"]
        assert len(data.attrs["generated_code_sha256"]) == 64
        flags = data["state"].attrs
        assert flags["flag_meanings"].split() == ["failed", *STATES]
        assert list(flags["flag_values"]) == [-1, 0, 1, 2, 3, 4, 5]
        for name in data.variables:
            assert {"units", "long_name"} <= set(data[name].attrs), name
        assert int((data["state"] == 1).sum()) == found["lco"]
        edges = data["boundary_x"].values
        assert np.isfinite(edges).sum() == (np.diff(data["state"].values, axis=0) != 0).sum()


def test_a_boundary_is_where_single_runs_change(capsys, tmp_path: Path) -> None:
    out = tmp_path / "m.nc"
    words = ("--speed-ratio", "0.9,0.95", "--alpha-deg", "8", "--refine")
    result(capsys, "run14", *words, "--out", str(out))
    with xr.open_dataset(out) as data:
        edge = float(data["boundary_x"][0, 0])
    case = load_case("run14")
    flutter = flutter_speed(case.family())
    assert alone(case, (edge - 1e-6) * flutter, 8.0).state == "damped"
    assert alone(case, (edge + 1e-6) * flutter, 8.0).state == "lco"


def test_nothing_is_overwritten_and_nothing_else_resumed(capsys, tmp_path: Path) -> None:
    out = str(tmp_path / "m.nc")
    words = ("run14", "--speed-ratio", "0.9:0.95:3", "--alpha-deg", "2:8:2", "--out", out)
    first = result(capsys, *words)
    assert "--overwrite" in refused(capsys, *words)[0]
    assert "holds another study" in refused(capsys, "run15", *words[1:], "--resume")[0]
    lines = refused(capsys, *words, "--set", "section.mu=90", "--resume")
    assert any("section.mu is 100.0 in the store, 90.0 here" in line for line in lines)
    again = result(capsys, *words, "--resume")
    assert {key: again[key] for key in KEYS} == {key: first[key] for key in KEYS}
    assert result(capsys, *words, "--set", "section.mu=90", "--overwrite")["cells"] == 6


def test_another_version_is_not_resumed(capsys, tmp_path: Path, monkeypatch) -> None:
    out = str(tmp_path / "m.zarr")
    words = ("run14", "--speed-ratio", "0.9:0.95:3", "--alpha-deg", "2:8:2", "--out", out)
    result(capsys, *words)
    monkeypatch.setattr("aeroflutter.__version__", "99.0")
    lines = refused(capsys, *words, "--resume")
    assert "aeroflutter is" in lines[1]
    assert "'99.0' here" in lines[1]


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> dict[str, bytes]:
    """The slow map, computed in one go by two threads."""
    store = tmp_path_factory.mktemp("whole") / "m.zarr"
    assert json.loads(finish(command(SLOW[0], store, *SLOW[1:])))["failed"] == 0
    return arrays(store)


def test_killed_and_resumed_is_as_if_nothing_had_happened(whole, tmp_path: Path) -> None:
    """SIGKILL at two random moments; `benchmarks/bench_kills.py` does it twenty times."""
    chance = random.Random(6)
    store = tmp_path / "m.zarr"
    words = command(SLOW[0], store, *SLOW[1:], "--workers", "2")
    killed = kill_parent(words, store, chance.randrange(1, BLOCKS // 4), chance)
    killed += kill_parent([*words, "--resume"], store, committed(store) + 3, chance)
    assert killed == 2
    assert 0 < committed(store) < BLOCKS
    finish([*words, "--resume"])
    assert arrays(store) == whole


@pytest.mark.slow
def test_dead_workers_cost_their_blocks_only(whole, tmp_path: Path) -> None:
    store = tmp_path / "m.zarr"
    words = command(SLOW[0], store, *SLOW[1:], "--workers", "2")
    assert kill_workers(words, store, 2, random.Random(7)) == 2
    assert arrays(store) == whole


def test_ctrl_c_says_how_to_go_on(tmp_path: Path) -> None:
    store = tmp_path / "m.zarr"
    endless = ("--speed-ratio", "0.12:0.99:14000", "--alpha-deg", "-15:15:30")
    process = start(command("run100", store, *endless, "--workers", "2"))
    assert wait_for_blocks(process, store, 2)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert (process.returncode, out) == (130, "")
    assert f"blocks are safe in {store}" in err
    assert "--resume" in err
    assert "Traceback" not in err


@pytest.mark.slow
def test_a_full_disk_is_told_and_the_run_goes_on_later(tmp_path: Path) -> None:
    # The pitches compress, the times of decision do not: their block is what the disk cannot take.
    words = ("--speed-ratio", "0.9:0.95:4", "--alpha-deg", "2:2001:2000")
    store, other = tmp_path / "m.zarr", tmp_path / "other.zarr"
    told = finish(command("run14", store, *words), code=1, file_limit=8_192)
    assert "no room to write" in told
    assert "go on with" in told
    assert "Traceback" not in told
    finish(command("run14", store, *words, "--resume"))
    finish(command("run14", other, *words))
    assert arrays(store) == arrays(other)


def test_dask_gives_the_same_and_survives_its_workers(whole, tmp_path: Path) -> None:
    store = tmp_path / "m.zarr"
    with dask(tmp_path) as (address, nannies):
        words = command(SLOW[0], store, *SLOW[1:], "--scheduler", address)
        process = start(words)
        assert wait_for_blocks(process, store, 3)
        victims = workers(nannies)
        assert victims
        os.kill(victims[0], signal.SIGKILL)
        _, err = process.communicate(timeout=300)
    assert process.returncode == 0, err
    assert arrays(store) == whole
