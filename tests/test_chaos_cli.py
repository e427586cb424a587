"""`aeroflutter chaos`: keys, scans, files, figures, messages and exit codes."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray as xr

from aeroflutter import SectionFamily, TypicalSection
from aeroflutter.cli import main

QUICK = ("--cycles", "400", "--transient", "100")
KEYS = {
    "speed", "speed_ratio", "flutter_speed", "zeta_alpha", "zeta_xi", "verdict", "name", "reason",
    "lyapunov", "lyapunov_error", "statistical_error", "drift", "resolution", "dimension", "loops",
    "period", "multiplier", "floquet_exponent", "amplitude_deg", "bias_deg", "peaks_deg",
    "cycles", "transient", "return_time", "engine",
}  # fmt: skip


def run(capsys, *words):
    code = main(["chaos", *words])
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def result(capsys, *words):
    code, out, err = run(capsys, *words, *QUICK, "--json")
    assert code == 0, err
    assert out.count("\n") == 1
    return json.loads(out)


def test_keys_of_a_chaotic_and_of_a_periodic_motion(capsys):
    wild = result(capsys, "freeplay-02", "--speed-ratio", "0.3")
    assert set(wild) >= KEYS
    assert (wild["verdict"], wild["period"], wild["multiplier"]) == ("chaotic", None, None)
    assert wild["lyapunov"][0] > wild["lyapunov_error"][0] > 0
    assert len(wild["lyapunov"]) == 3
    tame = result(capsys, "freeplay-02", "--speed-ratio", "0.24")
    assert (tame["name"], tame["loops"]) == ("period-2", 2)
    assert len(set(np.round(tame["peaks_deg"], 9))) == 2
    assert tame["lyapunov"][1] == pytest.approx(tame["floquet_exponent"], rel=1e-3)


def test_speed_and_speed_ratio_are_two_names_of_one_thing(capsys):
    by_ratio = result(capsys, "freeplay-02", "--speed-ratio", "0.2")
    by_speed = result(capsys, "freeplay-02", "--speed", repr(by_ratio["speed"]))
    assert by_speed["period"] == pytest.approx(by_ratio["period"], rel=1e-12)


def test_scan_over_speed_finds_the_band_and_halves_its_edges(capsys):
    words = ("freeplay-02", "--speed-ratio", "0.2:0.4:5")
    found = result(capsys, *words)
    assert found["parameter"] == "speed_ratio"
    assert [point["verdict"] for point in found["points"]][2] == "chaotic"
    (band,) = found["bands"]
    assert band["lower_edge"] == pytest.approx([0.25, 0.3])
    (finer,) = result(capsys, *words, "--edges")["bands"]
    low, high = finer["lower_edge"]
    assert 0.25 < low < high < 0.27
    assert high - low == pytest.approx(0.05 / 1024)


def test_scan_over_damping_at_one_speed(capsys):
    words = ("freeplay-02", "--speed-ratio", "0.3", "--zeta-alpha", "0:0.1:2")
    found = result(capsys, *words, "--zeta-xi", "0.001")
    assert found["parameter"] == "zeta_alpha"
    assert [point["verdict"] for point in found["points"]] == ["chaotic", "periodic"]
    assert {point["zeta_xi"] for point in found["points"]} == {0.001}
    together = result(capsys, *words, "--zeta-xi", "0.0,0.1")
    assert [point["zeta_xi"] for point in together["points"]] == [0.0, 0.1]
    assert {point["speed"] for point in together["points"]} == {0.3 * found["flutter_speed"]}


def test_text_names_motion_and_bands(capsys):
    _, one, _ = run(capsys, "freeplay-02", "--speed-ratio", "0.3", *QUICK)
    assert "chaotic" in one
    assert "statistical" in one
    _, many, _ = run(capsys, "freeplay-02", "--speed-ratio", "0.24,0.3", *QUICK)
    assert "chaos from between 0.24 and 0.3 to 0.3 (where the scan ends)" in many
    _, none, _ = run(capsys, "run103", "--speed-ratio", "0.6,0.9", *QUICK)
    assert "no chaos" in none
    assert "damped" in none


def test_files_and_figures(capsys, tmp_path):
    out, plot = tmp_path / "one.nc", tmp_path / "one.png"
    words = ("--out", str(out), "--plot", str(plot))
    assert run(capsys, "freeplay-02", "--speed-ratio", "0.3", *QUICK, *words)[0] == 0
    with xr.open_dataset(out) as one:
        assert one.attrs["verdict"] == "chaotic"
        assert one["peak_deg"].size == 400
        assert one["lyapunov"].attrs["long_name"]
        unnamed = [name for name in one.data_vars if "units" not in one[name].attrs]
        assert not unnamed
    assert plot.stat().st_size > 10_000
    out, plot = tmp_path / "scan.nc", tmp_path / "scan.svg"
    words = ("--out", str(out), "--plot", str(plot))
    assert run(capsys, "freeplay-02", "--speed-ratio", "0.12:0.3:4", *QUICK, *words)[0] == 0
    with xr.open_dataset(out) as scan:
        assert scan["speed_ratio"].size == 4
        codes = scan["verdict"].attrs["flag_meanings"].split()
        assert codes[int(scan["verdict"][0])] == "damped"
        assert codes[int(scan["verdict"][-1])] == "chaotic"
        assert not [name for name in scan.data_vars if "units" not in scan[name].attrs]
    assert plot.stat().st_size > 10_000


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("freeplay-02",), "--speed-ratio or --speed"),
        (("freeplay-02", "--speed-ratio", "0.3", "--speed", "2"), "--speed-ratio or --speed"),
        (("freeplay-02", "--speed-ratio", "-1"), "--speed-ratio"),
        (("freeplay-02", "--speed", "1:2:2", "--zeta-xi", "0:1:3"), "single speed"),
        (
            ("freeplay-02", "--speed", "2", "--zeta-xi", "0:1:3", "--zeta-alpha", "0:1:2"),
            "as many values",
        ),
        (("freeplay-02", "--speed-ratio", "0.3", "--cycles", "3"), "cycles"),
        (("freeplay-02", "--speed-ratio", "0.3", "--alpha-deg", "nan"), "--alpha-deg"),
        (("freeplay-02", "--speed-ratio", "0.2:0.3:3", "--follow", "--edges"), "--follow"),
    ],
)
def test_bad_input_is_refused_with_its_key(capsys, words, message):
    code, out, err = run(capsys, *words)
    assert (code, out) == (2, "")
    assert message in err
    assert "Traceback" not in err


def test_a_motion_that_sticks_has_the_exponents_of_what_still_moves(capsys, tmp_path):
    """Pitch stays where friction holds it, near by as well, while heave dies out."""
    case = tmp_path / "friction.toml"
    case.write_text('[section]\nomega_bar = 0.8\n[spring]\nkind = "friction"\nfriction_deg = 0.2\n')
    found = result(capsys, str(case), "--speed", "2")
    assert found["verdict"] == "damped"
    system = SectionFamily(TypicalSection(omega_bar=0.8)).at(2.0)
    rate, b = system.state_names.index("alpha_rate"), system.b
    held = system.A - np.outer(b, system.A[rate]) / b[rate]  # the moment that keeps it there
    roots = np.sort(np.linalg.eigvals(held).real)[::-1]
    assert np.array(found["lyapunov"]) == pytest.approx(roots[:3], abs=1e-7)  # zeros: defective
    assert found["lyapunov"][1] == pytest.approx(0.0, abs=1e-12)
    assert found["lyapunov"][2] < -1e-3
    figure = tmp_path / "attractor.svg"
    code, out, err = run(capsys, str(case), "--speed", "2", *QUICK, "--plot", str(figure))
    assert code == 2
    assert "damped" in out
    assert "there is no attractor to draw" in err
