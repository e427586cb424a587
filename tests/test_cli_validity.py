"""`aeroflutter hb`, `loop`, and the guarantee of `df`: keys, files, figures, messages."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
import xarray as xr

from aeroflutter.cli import main

POINT = {
    "amplitude_deg", "bias_deg", "first_harmonic_deg", "speed_ratio", "k", "period", "stable",
    "stability_certain", "multipliers", "symmetric", "harmonics", "truncation",
}  # fmt: skip
QUICK = ("--harmonics", "3", "--max-step", "0.3")


def result(capsys, *words):
    assert main([*words, "--json"]) == 0
    captured = capsys.readouterr()
    assert captured.out.count("\n") == 1
    return json.loads(captured.out)


def refused(capsys, *words):
    assert main(list(words)) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    return captured.err


# --- hb -------------------------------------------------------------------------------------------


def test_hb_keys_and_agreement_between_its_outputs(capsys, tmp_path):
    file, figure = tmp_path / "hb.nc", tmp_path / "hb.png"
    found = result(capsys, "hb", "run14", *QUICK, "--out", str(file), "--plot", str(figure))
    assert set(found["branch"][0]) >= POINT
    assert found["onset"]["kind"] == "fold"
    # three harmonics leave a fifth of the describing function's error, 0.92126 for 0.92151328
    assert abs(found["onset"]["speed_ratio"] - 0.92151328) < 0.22 * (0.92151328 - 0.92126)
    assert {event["kind"] for event in found["bifurcations"]} >= {"fold"}
    assert all(len(point["multipliers"]) == 6 for point in found["branch"])
    with xr.open_dataset(file) as saved:
        amplitudes = [point["amplitude_deg"] for point in found["branch"]]
        assert saved["amplitude_deg"].values == pytest.approx(amplitudes, rel=1e-12)
        assert saved["amplitude_deg"].attrs["units"] == "degree"
        assert saved.attrs["case"]
        assert saved["bifurcation_kind"].values.tolist() == [
            event["kind"] for event in found["bifurcations"]
        ]
    assert figure.read_bytes().startswith(b"\x89PNG")


def test_hb_text_names_onset_and_convergence(capsys):
    assert main(["hb", "run14", *QUICK]) == 0
    out = capsys.readouterr().out
    assert "onset:" in out
    assert "NOT converged" in out  # three harmonics leave out more than the tolerance
    assert "(fold, stable beside it)" in out


def test_hb_si_section_carries_units(capsys):
    found = result(capsys, "hb", "naca496", "--set", "spring.kind=cubic", "--set",
                   "spring.beta3=2.0", *QUICK)  # fmt: skip
    assert {"velocity_m_s", "frequency_hz"} <= set(found["branch"][0])


def test_hb_refuses_what_it_cannot_do(capsys):
    for words, expected in [
        (["hb", "run14", "--harmonics", "many"], "--harmonics: must be a whole number or auto"),
        (["hb", "run14", "--harmonics", "0"], "harmonics: must be at least 1"),
        (["hb", "run14", "--speed-ratio-range", "1"], "--speed-ratio-range"),
        (["hb", "run14", "--tolerance", "-1"], "tolerance: must be positive"),
        (["hb", "run14", "--out", "x.png"], "--out"),
    ]:
        assert expected in refused(capsys, *words)


def test_hb_of_a_linear_spring_does_not_converge(capsys):
    assert main(["hb", "linear-02"]) == 3
    assert "aeroflutter: " in capsys.readouterr().err


# --- loop -----------------------------------------------------------------------------------------


def test_loop_keys_and_files(capsys, tmp_path):
    file, figure = tmp_path / "loop.nc", tmp_path / "loop.svg"
    words = ("loop", "run14", "--speed-ratio", "0.95", "--out", str(file), "--plot", str(figure))
    found = result(capsys, *words)
    assert found["speed_ratio"] == pytest.approx(0.95)
    unstable, stable = found["cycles"]
    assert unstable["amplitude_deg"] < stable["amplitude_deg"]
    for cycle in found["cycles"]:
        # on the locus: -1/N = G, at the cycle's frequency
        N = complex(*cycle["describing_function"])
        G = np.array(found["response"]) @ [1, 1j]
        at = np.interp(np.log(cycle["k"]), np.log(found["frequency"]), G)
        assert abs(at + 1 / N) < 1e-2 * abs(1 / N)  # the response is interpolated
        assert cycle["guarantee"]["guaranteed"]
        low, high = cycle["guarantee"]["speed_ratio"]
        assert low < 0.95 < high
        for harmonic in cycle["harmonics"]:
            assert harmonic["spoils"] == (harmonic["predicted"] > 0.01)
    with xr.open_dataset(file) as saved:
        assert saved["predicted"].shape == (2, 8)
        assert saved.attrs["speed_ratio"] == pytest.approx(0.95)
    assert "<svg" in figure.read_text()


def test_loop_verdict_in_words(capsys):
    assert main(["loop", "run14", "--speed-ratio", "0.95"]) == 0
    out = capsys.readouterr().out
    assert out.count("verdict:") == 2
    assert "proved: a cycle of this first harmonic" in out
    assert main(["loop", "run103", "--speed-ratio", "0.75"]) == 0
    out = capsys.readouterr().out
    assert "no guarantee: the loop does not filter the harmonics enough" in out
    assert "doubtful" in out
    assert "spoiled by harmonics: 3" in out


def test_loop_where_there_is_no_cycle(capsys, tmp_path):
    figure = tmp_path / "none.png"
    assert main(["loop", "run14", "--speed-ratio", "0.8", "--plot", str(figure)]) == 0
    assert "no cycle at this speed" in capsys.readouterr().out
    assert figure.read_bytes().startswith(b"\x89PNG")


def test_loop_refuses_what_it_cannot_do(capsys):
    for words, expected in [
        ([], "--speed-ratio, --speed: give one of them"),
        (["--speed", "4", "--speed-ratio", "1"], "give one of them"),
        (["--speed", "-4"], "--speed: must be positive"),
        (["--speed", "4", "--harmonics", "1"], "harmonics: must be at least 2"),
        (["--speed", "4", "--spoils", "0"], "spoils: must be positive"),
    ]:
        assert expected in refused(capsys, "loop", "run14", *words)


# --- the guarantee of df --------------------------------------------------------------------------


def test_df_points_carry_their_guarantee(capsys, tmp_path):
    file, figure = tmp_path / "df.nc", tmp_path / "df.png"
    words = ("df", "run103", "--points", "40", "--out", str(file), "--plot", str(figure))
    found = result(capsys, *words)
    proved = [p for p in found["branch"] if p["guarantee"]["guaranteed"]]
    left = [p for p in found["branch"] if not p["guarantee"]["guaranteed"]]
    assert proved
    assert left
    for point in proved:
        low, high = point["guarantee"]["speed_ratio"]
        assert low < point["speed_ratio"] < high
        band = point["guarantee"]["amplitude_deg"]
        assert band is None or band[0] < point["amplitude_deg"] < band[1]
        assert point["guarantee"]["reason"] is None
    for point in left:
        assert point["guarantee"]["reason"]
        assert point["guarantee"]["speed_ratio"] is None
        assert point["guarantee"]["expected_error"] >= 0
    with xr.open_dataset(file) as saved:
        flags = [point["guarantee"]["guaranteed"] for point in found["branch"]]
        assert saved["guaranteed"].values.astype(bool).tolist() == flags
        assert np.isfinite(saved["guarantee_speed"].values).all(axis=1).tolist() == flags
        assert (saved["guarantee_reason"].values == "").tolist() == flags
    assert figure.read_bytes().startswith(b"\x89PNG")


def test_df_text_tells_proved_from_expected(capsys):
    assert main(["df", "run103", "--points", "40"]) == 0
    out = capsys.readouterr().out
    assert "(proved)" in out
    assert "(doubtful)" in out
    assert "no proof where the loop does not filter the harmonics enough" in out


def test_the_distortion_is_continuous_where_the_loop_first_meets_its_stops(capsys):
    # A = D + δ = 1°; closed with dF₀/dB it jumped there, from 97 % to 134 %. The share of the cycle
    # on which the slider moves has a square root there: a distance of 1e-8 is felt as 1e-4.
    below, above = (
        result(capsys, "df", "run103", "--amplitudes-deg", amplitude)["branch"][0]
        for amplitude in ("0.99999999", "1.00000001")
    )
    assert below["in_thesis_range"] < above["in_thesis_range"]
    assert math.isclose(below["distortion"], above["distortion"], rel_tol=1e-3)
