"""`aeroflutter simulate`: keys, options, files, messages and exit codes."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray as xr

from aeroflutter.cli import main

KEYS = {"state", "amplitude_deg", "bias_deg", "period", "rest_deg", "engine"}


def run(capsys, *words):
    code = main(["simulate", *words])
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def result(capsys, *words):
    code, out, _ = run(capsys, *words, "--json")
    assert code == 0
    assert out.count("\n") == 1
    return json.loads(out)


def test_keys_of_a_limit_cycle_and_of_a_rest(capsys):
    cycle = result(capsys, "run14", "--speed-ratio", "0.93", "--engine", "houbolt")
    assert set(cycle) >= KEYS
    assert (cycle["state"], cycle["engine"]) == ("lco", "houbolt")
    assert cycle["rest_deg"] is None
    assert cycle["speed"] == pytest.approx(0.93 * cycle["flutter_speed"])
    assert cycle["k"] == pytest.approx(2 * np.pi / cycle["period"])
    rest = result(capsys, "run14", "--speed-ratio", "0.9", "--engine", "houbolt")
    assert rest["state"] == "damped"
    assert rest["period"] is None
    assert rest["amplitude_deg"] == 0.0
    assert abs(rest["rest_deg"]) <= 0.6  # within half the loop, (1.0 + 0.2)/2


def test_the_exact_engine_is_what_one_gets(capsys):
    for words in ((), ("--engine", "exact")):
        cycle = result(capsys, "run14", "--speed-ratio", "0.93", *words)
        assert (cycle["engine"], cycle["state"], cycle["rest_deg"]) == ("exact", "lco", None)
        assert cycle["amplitude_deg"] == pytest.approx(0.8875742140, abs=1e-9)
    houbolt = result(capsys, "run14", "--speed-ratio", "0.93", "--engine", "houbolt")
    assert cycle["period"] == pytest.approx(houbolt["period"], rel=1e-3)
    assert cycle["first_harmonic_deg"] == pytest.approx(houbolt["first_harmonic_deg"], rel=2e-3)


@pytest.mark.parametrize(
    ("ratio", "state"), [("0.90", "damped"), ("0.93", "lco"), ("1.05", "divergent")]
)
def test_the_exact_engine_draws_and_saves_every_end(capsys, tmp_path, ratio, state):
    for figure in ("overview", "traces", "spring", "phase", "psd", "poincare"):
        saved, drawn = tmp_path / "run.nc", tmp_path / f"{figure}.svg"
        words = ("--out", str(saved), "--plot", str(drawn), "--figure", figure)
        assert result(capsys, "run14", "--speed-ratio", ratio, *words)["state"] == state
        assert drawn.stat().st_size > 0
        with xr.open_dataset(saved) as dataset:
            assert dataset["time"][-1] >= 499.0
            assert dataset.attrs["engine"] == "exact"
            assert dataset["events"].sizes["event"] > 10
        saved.unlink()


def test_speed_and_speed_ratio_are_two_names_of_one_thing(capsys):
    by_ratio = result(capsys, "run14", "--speed-ratio", "0.95", "--engine", "houbolt")
    by_speed = result(capsys, "run14", "--speed", repr(by_ratio["speed"]), "--engine", "houbolt")
    assert by_speed == by_ratio


def test_initial_pitch_overrides_the_case(capsys):
    words = ("run14", "--speed-ratio", "0.95", "--alpha-deg", "0.3", "--engine", "houbolt")
    small = result(capsys, *words)
    assert (small["state"], small["alpha_deg"]) == ("damped", pytest.approx(0.3))


def test_the_thesis_preset(capsys):
    thesis = result(capsys, "run14", "--speed-ratio", "0.93", "--thesis")
    assert (thesis["engine"], thesis["state"]) == ("houbolt", "lco")
    assert thesis["duration"] == pytest.approx(5000.0)


def test_quasi_steady_sections_march_too(capsys, tmp_path):
    case = tmp_path / "quasi.toml"
    case.write_text(
        "[section]\nomega_bar = 0.8\nzeta_alpha = 0.02\nzeta_xi = 0.02\n"
        '[aerodynamics]\nmodel = "quasi-steady"\n[spring]\nkind = "linear"\n'
        "[initial]\nalpha_deg = 2.0\n"
    )
    found = result(capsys, str(case), "--speed", "2.0", "--engine", "houbolt")
    assert found["state"] == "damped"
    assert found["rest_deg"] == pytest.approx(0.0, abs=1e-9)


def test_text_names_the_end(capsys):
    code, out, _ = run(capsys, "run14", "--speed-ratio", "0.93", "--engine", "houbolt")
    assert code == 0
    assert "state:" in out
    assert "lco" in out


def test_files_hold_the_march_beyond_the_decision(capsys, tmp_path):
    words = ["run14", "--speed-ratio", "0.93", "--engine", "houbolt"]
    decided = result(capsys, *words)
    saved, drawn = tmp_path / "run.nc", tmp_path / "run.svg"
    run(capsys, *words, "--out", str(saved), "--plot", str(drawn), "--figure", "traces")
    with xr.open_dataset(saved) as dataset:
        assert dataset["time"][-1] > decided["duration"]
        assert dataset.attrs["end_state"] == "lco"
        assert dataset.attrs["speed_ratio"] == pytest.approx(0.93)
        assert "delta_v_deg" in dataset.attrs["case"]
        alpha = np.degrees(dataset["states"].sel(state_name="alpha").values)
        np.testing.assert_allclose(alpha, dataset["pitch_deg"].values, rtol=1e-12)
    assert drawn.read_text().lstrip().startswith("<?xml")


@pytest.mark.parametrize("engine", ["houbolt", "exact"])
def test_an_overflow_is_told_and_what_came_before_it_saved(capsys, tmp_path, engine):
    saved = tmp_path / "gone.nc"
    words = ["linear-08", "--speed-ratio", "1.3", "--engine", engine, "--duration", "60000"]
    found = result(capsys, *words, "--out", str(saved))
    assert found["state"] == "divergent"
    with xr.open_dataset(saved) as dataset:
        assert dataset["pitch_deg"].size > 100
        assert bool(np.isfinite(dataset["pitch_deg"]).all())


@pytest.mark.parametrize("engine", ["houbolt", "exact"])
def test_sweep_up_and_down(capsys, tmp_path, engine):
    saved, drawn = tmp_path / "sweep.nc", tmp_path / "sweep.png"
    words = ["run14", "--engine", engine, "--sweep", "0.91:0.98:5", "--alpha-deg", "10"]
    swept = result(capsys, *words, "--out", str(saved), "--plot", str(drawn))
    up, down = swept["sweeps"]
    assert (up["direction"], down["direction"]) == ("up", "down")
    assert up["speed_ratio"] == pytest.approx(np.linspace(0.91, 0.98, 5).tolist())
    assert down["speed_ratio"] == pytest.approx(np.linspace(0.98, 0.91, 5).tolist())
    assert (down["state"][0], down["state"][-1]) == ("lco", "damped")
    assert len(down["jumps"]) == 1
    with xr.open_dataset(saved) as dataset:
        assert dataset["amplitude_deg_down"].values == pytest.approx(down["amplitude_deg"])
    assert drawn.stat().st_size > 0
    code, out, _ = run(capsys, *words)
    assert code == 0
    assert "speed falling" in out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "give exactly one"),
        (["--speed", "3", "--speed-ratio", "0.9"], "give exactly one"),
        (["--speed-ratio", "-1"], "--speed-ratio"),
        (["--speed", "nan"], "--speed"),
        (["--speed-ratio", "0.9", "--duration", "0"], "duration"),
        (["--speed-ratio", "0.9", "--dt", "5", "--engine", "houbolt"], "take at most"),
        (["--speed-ratio", "0.9", "--dt", "-1"], "dt"),
        (["--speed-ratio", "0.9", "--alpha-deg", "nan"], "alpha"),
        (["--speed-ratio", "0.9", "--engine", "euler"], "houbolt"),
        (["--speed-ratio", "0.9", "--figure", "bode"], "overview"),
        (["--sweep", "0.9:1.0:3", "--speed", "3"], "--sweep"),
        (["--sweep", "0.9:1.0"], "A:B:N"),
        (["--sweep", "0.9:1.0:1"], "two"),
        (["--speed-ratio", "0.9", "--plot", "a.txt"], "--plot"),
    ],
)
def test_bad_input_ends_with_code_2_and_one_line(capsys, words, message):
    code, out, err = run(capsys, "run14", *words)
    assert code == 2
    assert out == ""
    assert message in err
    assert all(line.startswith("aeroflutter: ") for line in err.splitlines())
    assert "Traceback" not in err


def test_a_section_without_flutter_needs_a_speed(capsys, tmp_path):
    case = tmp_path / "forward.toml"
    case.write_text(
        "[section]\nomega_bar = 0.8\nx_alpha = -0.3\n"
        '[spring]\nkind = "linear"\n[initial]\nalpha_deg = 1.0\n'
    )
    code, _, err = run(capsys, str(case), "--speed-ratio", "0.9", "--engine", "houbolt")
    assert code == 2
    assert "no linear flutter speed" in err
    found = result(capsys, str(case), "--speed", "2.0", "--engine", "houbolt")
    assert found["state"] == "damped"
    assert "speed_ratio" not in found


@pytest.mark.parametrize(
    ("words", "key"),
    [
        (("--thesis", "--engine", "exact"), "--thesis: "),
        (("--kick-deg", "3"), "--kick-deg: "),
        (("--alpha-deg", "inf"), "--alpha-deg: "),
    ],
)
def test_what_would_be_ignored_or_cannot_be_is_refused(capsys, words, key):
    code, out, err = run(capsys, "run14", "--speed-ratio", "0.9", *words)
    assert (code, out) == (2, "")
    assert key in err
    assert err.count("\n") == 1
