"""What a user meets: SI units in every encoding, nothing lost, tables that fit, one vocabulary."""

import contextlib
import io
import json
import re

import bah
import numpy as np
import pytest
import xarray as xr
from test_engineering import TAILPLANE

from aeroflutter.cli import main
from aeroflutter.cli.progress import pace
from aeroflutter.cli.show import show_facts, show_table

QUICK = ("--simulations", "0", "--depth", "0", "--points", "20")
V_L = 196.672  # flutter speed of the tailplane, m/s


@pytest.fixture
def tail(tmp_path):
    file = tmp_path / "tail.toml"
    file.write_text('title = "a tailplane of $5"\n' + TAILPLANE)
    return str(file)


def result(capsys, *words):
    assert main([*words, "--json"]) == 0, capsys.readouterr().err
    return json.loads(capsys.readouterr().out)


class Terminal(io.StringIO):
    """A terminal of 80 columns."""

    def isatty(self):
        return True


# Units


def test_speeds_frequencies_and_periods_stand_beside_in_si(capsys, tail):
    found = result(capsys, "rootlocus", tail)
    assert found["flutter"]["velocity_m_s"] == pytest.approx(V_L, abs=1e-3)
    assert found["flutter"]["frequency_hz"] == pytest.approx(13.38, abs=5e-3)
    assert found["divergence"]["velocity_m_s"] == pytest.approx(282.0, abs=0.05)
    point = result(capsys, "lco", tail, *QUICK, "--velocity", "157.3")["cycles"][-1]
    assert point["velocity_m_s"] == pytest.approx(157.3)
    assert point["period_s"] * point["frequency_hz"] == pytest.approx(1.0)
    assert point["amplitude_deg"] == pytest.approx(0.334, abs=5e-4)


def test_one_speed_by_three_names(capsys, tail):
    by = [
        result(capsys, "simulate", tail, f"--{name}", value)
        for name, value in (("velocity", "157.3"), ("speed", repr(157.3 / (0.45 * 42 * np.pi))))
    ]
    assert by[0]["amplitude_deg"] == pytest.approx(by[1]["amplitude_deg"], rel=1e-9)
    ratio = repr(by[0]["speed_ratio"])
    again = result(capsys, "simulate", tail, "--speed-ratio", ratio)
    assert again["velocity_m_s"] == pytest.approx(157.3, rel=1e-12)


@pytest.mark.parametrize("command", ["simulate", "lco", "loop", "chaos", "map", "tolerance"])
def test_velocity_needs_si_data(capsys, command):
    more = ["--amplitude-deg", "1"] if command == "tolerance" else []
    assert main([command, "run14", "--velocity", "100", *more]) == 2
    assert "SI units" in capsys.readouterr().err


def test_text_is_in_si_where_the_case_is(capsys, tail):
    assert main(["df", tail, "--amplitudes-deg", "0.3"]) == 0
    text = capsys.readouterr().out
    assert "V (m/s)" in text
    assert "(196.67 m/s)" in text
    assert main(["df", tail, "--amplitudes-deg", "0.3", "--units", "nondimensional"]) == 0
    assert "m/s" not in capsys.readouterr().out
    assert main(["df", "run14", "--units", "si"]) == 2
    assert "no SI data" in capsys.readouterr().err


def labels(path):
    """Texts of an SVG figure."""
    return " ".join(re.findall(r"<!-- (.*?) -->", path.read_text()))


def test_figures_are_in_si_where_the_case_is(capsys, tail, tmp_path):
    for words, units in (
        (("hb", tail, "--harmonics", "1", "--largest-deg", "1"), ["airspeed $V$ (m/s)"]),
        (("rootlocus", tail), ["airspeed $V$ (m/s)", "frequency (Hz)"]),
        (("simulate", tail, "--velocity", "157.3"), ["time (s)", "frequency (Hz)"]),
        (
            ("map", tail, "--speed-ratio", "0.5:0.9:3", "--alpha-deg", "1,2"),
            ["airspeed $V$ (m/s)"],
        ),
    ):
        file = tmp_path / "figure.svg"
        assert main([*words, "--plot", str(file)]) == 0, capsys.readouterr().err
        seen = labels(file)
        assert all(unit in seen for unit in units), (words, seen)
        assert "U^*" not in seen.replace("U^*_L", "")
        assert main([*words, "--plot", str(file), "--units", "nondimensional"]) == 0
        assert "m/s" not in labels(file)


def test_a_map_in_metres_a_second(capsys, tail, tmp_path):
    file = tmp_path / "map.nc"
    words = ("--velocity", "100,157.3", "--alpha-deg", "0.02,2")
    found = result(capsys, "map", tail, *words, "--out", str(file))
    assert found["x"] == {"key": "velocity", "values": [100.0, 157.3]}
    assert (found["damped"], found["lco"]) == (3, 1)
    with xr.open_dataset(file) as data:
        assert data["velocity"].attrs["units"] == "m s-1"
    ratio = result(capsys, "map", tail, "--speed-ratio", "0.5,0.8", "--alpha-deg", "2")
    assert ratio["velocities_m_s"] == pytest.approx([0.5 * V_L, 0.8 * V_L], rel=1e-5)


def test_a_scan_for_chaos_is_in_metres_and_per_second(capsys, tail, tmp_path):
    file, plot = tmp_path / "scan.nc", tmp_path / "scan.svg"
    words = ("chaos", tail, "--velocity", "157.3,170", "--cycles", "40", "--transient", "10")
    found = result(capsys, *words, "--out", str(file), "--plot", str(plot))
    speeds = [point["velocity_m_s"] for point in found["points"]]
    assert speeds == pytest.approx([157.3, 170.0])
    tau = [point["return_time"] / point["return_time_s"] for point in found["points"]]
    assert tau == pytest.approx([v / 0.45 for v in speeds])
    with xr.open_dataset(file) as data:
        assert data["velocity_m_s"].values == pytest.approx(speeds)
        assert data["largest_lyapunov_per_s"].attrs["units"] == "s-1"
    assert "airspeed $V$ (m/s)" in labels(plot)
    assert "per s)" in labels(plot)
    assert main(words) == 0
    assert "lambda 1 (1/s)" in capsys.readouterr().out
    assert main([*words, "--units", "nondimensional"]) == 0
    assert "(1/s)" not in capsys.readouterr().out


def test_every_section_of_a_sweep_has_its_own_scale(capsys, tail, tmp_path):
    """b varies, and V = U* b omega_alpha with it."""
    file = tmp_path / "s.nc"
    words = ("--vary", "section.si.b=uniform(0.4,0.5)", "--sample", "4", "--onset", "none")
    found = result(capsys, "sweep", tail, *words, "--out", str(file))["values"]
    b, speed = np.array(found["section.si.b"]), np.array(found["flutter_speed"])
    expected = speed * b * 42 * np.pi
    assert found["flutter_velocity_m_s"] == pytest.approx(expected.tolist(), rel=1e-12)
    with xr.open_dataset(file) as data:
        assert np.allclose(data["flutter_velocity_m_s"], expected, rtol=1e-12)
        assert data["flutter_velocity_m_s"].attrs["units"] == "m s-1"


def test_the_exact_onset_of_a_sweep_and_the_words_for_the_other(capsys, tail):
    words = ("--vary", "spring.gap_deg=choice(0.15)", "--sample", "1")
    found = result(capsys, "sweep", tail, *words)
    assert found["onset_method"] == "describing function"
    assert found["onset_velocity_m_s"]["mean"] == pytest.approx(110.56, abs=0.01)  # 3 % off
    assert main(["sweep", tail, *words]) == 0
    assert "onset_velocity_m_s (describing function)" in capsys.readouterr().out


@pytest.mark.slow
def test_the_exact_onset_is_that_of_lco(capsys, tail):
    words = ("--vary", "spring.gap_deg=choice(0.15)", "--sample", "1", "--onset", "exact")
    found = result(capsys, "sweep", tail, *words)
    assert found["onset_method"] == "exact"
    assert found["onset_velocity_m_s"]["mean"] == pytest.approx(114.05, abs=0.005)


# Families


def test_a_family_is_one_answer_one_figure_one_file(capsys, tail, tmp_path):
    out, plot = tmp_path / "f.nc", tmp_path / "f.svg"
    words = ("rootlocus", tail, "--vary", "section.si.frequency_h_hz=8:10:3")
    found = result(capsys, *words, "--out", str(out), "--plot", str(plot))
    assert found["vary"] == "section.si.frequency_h_hz"
    members = found["members"]
    assert [one["value"] for one in members] == [8.0, 9.0, 10.0]
    assert members[1]["flutter"]["velocity_m_s"] == pytest.approx(V_L, abs=1e-3)
    assert "frequency_hz" in members[0]["wind_off"][0]
    with xr.open_dataset(out) as data:
        speeds = [one["flutter"]["velocity_m_s"] for one in members]
        assert data["flutter_velocity_m_s"].values.tolist() == speeds
        assert data["value"].values.tolist() == [8.0, 9.0, 10.0]
        assert data["root"].dims[:2] == ("member", "speed_place")
    assert "section.si.frequency_h_hz" in labels(plot)


def test_a_family_of_scales_has_the_scale_of_every_member(capsys, tail):
    words = ("rootlocus", tail, "--vary", "section.si.frequency_alpha_hz=20,21")
    for one, hertz in zip(result(capsys, *words)["members"], (20, 21), strict=True):
        expected = one["flutter"]["speed"] * 0.45 * 2 * np.pi * hertz
        assert one["flutter"]["velocity_m_s"] == pytest.approx(expected, rel=1e-12)


def test_gaps_start_where_they_do(capsys, tail):
    """Describing functions here, some per cent below the exact onsets of the how-to page."""
    words = ("df", tail, "--points", "2", "--vary", "spring.gap_deg=0.05,0.15,0.3,0.5")
    members = result(capsys, *words)["members"]
    starts = [one["onset"]["velocity_m_s"] for one in members]
    for found, exact in zip(starts, (154.8, 114.1, 91.2, 79.1), strict=True):
        assert 0.9 * exact < found < exact


@pytest.mark.parametrize(
    ("text", "message"),
    [("spring.gap_deg", "KEY=A:B:N"), ("spring.gap=1,2", "spring.gap"), ("x=", "KEY=A:B:N")],
)
def test_families_that_cannot_be_are_refused(capsys, text, message):
    assert main(["df", "run14", "--vary", text]) == 2
    assert message in capsys.readouterr().err


# Nothing is lost


def test_a_damped_motion_is_told_though_it_cannot_be_drawn(capsys, tmp_path):
    out = tmp_path / "c.nc"
    words = ("chaos", "freeplay-02", "--speed-ratio", "0.12", "--cycles", "300")
    assert main([*words, "--plot", str(tmp_path / "c.png"), "--out", str(out)]) == 2
    told, why = capsys.readouterr()
    assert "verdict:" in told
    assert "damped" in told
    assert "no attractor" in why
    assert out.exists()


def test_no_file_of_another_command_or_case_is_replaced(capsys, tmp_path):
    file = str(tmp_path / "x.nc")
    assert main(["rootlocus", "run14", "--out", file]) == 0
    assert main(["rootlocus", "run14", "--out", file]) == 0  # the same again
    capsys.readouterr()
    for words in (["spring", "run14"], ["rootlocus", "run15"]):
        assert main([*words, "--out", file]) == 2
        assert "--overwrite" in capsys.readouterr().err
    assert main(["rootlocus", "run15", "--out", file, "--overwrite"]) == 0
    with xr.open_dataset(file) as data:
        assert "run 15" in data.attrs["title"]


def test_what_is_replaced_is_said(capsys, tmp_path):
    out = tmp_path / "r.nc"
    for word in ("written", "replaced"):
        assert main(["spring", "run14", "--out", str(out)]) == 0
        assert f"{word}: {out}" in capsys.readouterr().out
    out.write_text("no file of this program")
    assert main(["spring", "run14", "--out", str(out)]) == 2
    assert out.read_text() == "no file of this program"


def test_a_linear_spring_has_no_onset_and_is_drawn(capsys, tmp_path):
    plot = tmp_path / "l.png"
    found = result(capsys, "df", "linear-08", "--points", "10", "--plot", str(plot))
    assert found["onset"] is found["stable_onset"] is None
    assert "the spring is linear" in found["notes"][0]
    assert plot.stat().st_size > 0


@pytest.mark.parametrize("title", ["costs $5 and $6", "$", r"$\frac{$", "100 %, a_b^c"])
def test_any_title_is_drawn(capsys, tmp_path, title):
    case, plot = tmp_path / "t.toml", tmp_path / "t.png"
    text = json.dumps(title)
    case.write_text(f"title = {text}\n[section]\nomega_bar = 0.8\n")
    for command in ("rootlocus", "spring"):
        assert main([command, str(case), "--plot", str(plot)]) == 0
        assert plot.stat().st_size > 0
        plot.unlink()
        capsys.readouterr()


def test_what_fails_in_drawing_takes_nothing_with_it(capsys, monkeypatch, tmp_path):
    def fail(*_, **__):
        raise ValueError("no such thing")

    monkeypatch.setattr("aeroflutter.plots.rootlocus.plot_root_locus", fail)
    out = tmp_path / "r.nc"
    words = ("--plot", str(tmp_path / "r.png"), "--out", str(out))
    assert main(["rootlocus", "run14", *words]) == 1
    told, why = capsys.readouterr()
    assert "flutter speed" in told
    assert why.count("\n") == 1
    assert "no such thing" in why
    assert out.exists()


def test_the_way_down_says_where_it_starts(capsys):
    words = ("run14", "--sweep", "0.85:0.9:3", "--alpha-deg", "1")
    up, down = result(capsys, "simulate", *words)["sweeps"]
    assert up["state"] == ["damped"] * 3
    assert "once more" in down["starts"]
    assert "came to rest" in down["starts"]
    assert main(["simulate", *words]) == 0
    assert "once more" in capsys.readouterr().out
    assert main(["simulate", "run14", "--sweep", "0.94:0.96:3"]) == 0
    assert "speed falling, from where the way out ended" in capsys.readouterr().out


def test_durations_are_the_same_wherever_they_stand(capsys, tmp_path):
    file = tmp_path / "s.nc"
    found = result(capsys, "simulate", "run14", "--speed-ratio", "0.95", "--out", str(file))
    with xr.open_dataset(file) as data:
        assert data.attrs["duration"] == found["duration"]
        assert data.attrs["trace_duration"] == found["trace_duration"]
        assert float(data["time"][-1]) == pytest.approx(found["trace_duration"], rel=1e-3)


def test_friction_is_said_to_be_half_of_delta_v(capsys):
    assert main(["spring", "run14"]) == 0
    assert "friction ± 0.5 deg (delta_v = 1 deg, twice the friction)" in capsys.readouterr().out


# The terminal; what every command shows is in test_screens.py


def test_columns_are_left_out_by_rank_and_named(monkeypatch, capsys):
    screen = Terminal()
    monkeypatch.setenv("COLUMNS", "40")
    headings = ("U*/U*_L", "first harmonic", "amplitude (deg)", "period")
    rows = [(0.123456, 1.23456, 12.3456, 123456.0)]
    with contextlib.redirect_stdout(screen):
        show_table(headings, rows)
        show_facts({"a label": "words that go on " * 5})
    text = screen.getvalue()
    assert "amplitude (deg)" in text.splitlines()[0]
    assert "first harmonic" not in text.splitlines()[0]
    assert "(no room for first harmonic" in text
    assert max(map(len, text.splitlines())) <= 40
    show_table(headings, rows)
    assert all(heading in capsys.readouterr().out for heading in headings[:1])


def test_a_rate_is_never_none_a_second():
    assert pace(0.3, "sections") == "3.33 s for one of the sections"
    assert pace(1234.0, "cells") == "1,234 cells/s"
    assert pace(2.5, "cells") == "2.5 cells/s"


# One vocabulary


@pytest.mark.parametrize(
    ("words", "today"),
    [
        (["rootlocus", "run14", "--speeds", "3:4:2"], "--speed"),
        (["rootlocus", "run14", "--low", "1", "--high", "9"], "--speed-range"),
        (["df", "run14", "--points", "5", "--amplitude-range-deg", "0.6,5"], "--largest-deg"),
        (["lco", "run14", *QUICK, "--largest", "5"], "--largest-deg"),
    ],
)
def test_former_options_work_and_say_their_names_of_today(capsys, words, today):
    assert main([*words, "--json"]) == 0
    out, err = capsys.readouterr()
    assert json.loads(out)["title"]
    assert words[2] in err or words[-2] in err
    assert f"is {today}" in err or today in err


def test_former_names_of_import_and_pk(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    A = np.array([[0.0, 1.0], [-4.0, -0.1]])
    np.savez(
        "ss.npz", speeds=[10.0, 20.0], A=np.array([A, A]), B=np.ones((2, 2, 1)),
        C=np.array([[1.0, 0.0]]), names=["flap"], units=["rad"],
    )  # fmt: skip
    for name, file in (("-o", "a.toml"), ("--output", "b.toml"), ("--out", "c.toml")):
        assert main(["import", "ss.npz", name, file, "--set", "time_unit=s"]) == 0
        assert ("is --out now" in capsys.readouterr().err) == (name != "--out")
        assert (tmp_path / file).exists()
    case = tmp_path / "wing.toml"
    keys = {**bah.MODEL, "speed_range": [350.0, 450.0]}
    lines = [f"{key} = {json.dumps(value)}" for key, value in keys.items()]
    case.write_text('title = "a wing"\n[model]\n' + "\n".join(lines))
    found = [
        result(capsys, "pk", str(case), "--points", "5", *words)
        for words in (("--low", "380", "--high", "420"), ("--velocity", "380,420"))
    ]
    assert found[0] == found[1]
    assert main(["pk", str(case), "--points", "5", "--low", "380"]) == 0
    assert "--velocity LOW,HIGH now" in capsys.readouterr().err


def test_former_onset_flags_of_sweep(capsys):
    words = ["sweep", "run14", "--vary", "section.mu=normal(100,5)", "--sample", "2"]
    for flag, method in (("--no-onset", "none"), ("--onset", "describing function")):
        assert main([*words, flag, "--json"]) == 0
        out, err = capsys.readouterr()
        assert json.loads(out)["onset_method"] == method
        assert "now" in err


def test_a_map_of_three_axes_is_told_what_to_do(capsys):
    words = ("--x", "section.mu=1:2:2", "--y", "section.zeta_xi=0:1:2", "--alpha-deg", "1,2")
    assert main(["map", "run14", *words, "--speed-ratio", "0.9"]) == 2
    assert "takes two axes" in capsys.readouterr().err


# Reports, and the largest gap


def test_a_report_is_in_metres_a_second(tmp_path, tail):
    page = tmp_path / "r.html"
    words = ("--velocity", "150,160", "--alpha-deg", "1", "--periods", "2")
    case = ("--set", "spring.kind=linear")
    assert main(["report", tail, *case, *words, "--out", str(page)]) == 0
    text = page.read_text()
    assert "airspeed V (m/s)" in text
    assert "frequency (Hz)" in text
    data = json.loads(re.search(r'application/json"[^>]*>(.*?)</script>', text, re.DOTALL)[1])
    assert data["axis"]["flutter"] == pytest.approx(V_L, abs=0.01)
    assert data["locus"]["flutter"] == pytest.approx(V_L, abs=0.01)
    assert data["locus"]["divergence"] == pytest.approx(282.04, abs=0.01)
    values, factor = data["map"]["x"]["values"], data["map"]["x"]["scale"]
    assert [factor * value for value in values] == pytest.approx([150.0, 160.0], rel=1e-5)


@pytest.mark.slow
def test_the_largest_gap_is_just_small_enough(tail):
    """Against the amplitude at which motions end, with that gap and one a thousandth larger."""
    import aeroflutter as af

    case = af.load_case(tail)
    quick = af.CycleOptions(simulations=0, depth=0)
    answer = af.largest_gap(case, velocity=177.0, amplitude=np.radians(0.5), options=quick)
    gap = float(np.degrees(answer.spring.delta_h))
    assert answer.spring.delta_v == case.spring.delta_v
    ends = [
        np.degrees(af.simulate(case.replace("spring.gap_deg", g), velocity=177.0).amplitude)
        for g in (gap, 1.001 * gap)
    ]
    assert ends[0] <= 0.5 * (1 + 1e-9) < ends[1]
    assert gap == pytest.approx(0.1172, abs=1e-4)
    assert sorted(value for value, _ in answer.trials) == [value for value, _ in answer.trials]
