"""`aeroflutter onset`: the answer in words, in JSON, in a file and in a figure."""

import json

import pytest
import xarray as xr

from aeroflutter.cli import main
from aeroflutter.guarantees.absence import Certificate

checker = pytest.importorskip("aeroflutter.guarantees.absence.checker")


def run(capsys, *words):
    code = main(["onset", *words])
    return code, capsys.readouterr()


def test_freeplay_at_low_frequency_ratio(capsys, tmp_path):
    saved, figure, proof = (tmp_path / name for name in ("o.nc", "o.png", "o.json"))
    code, printed = run(
        capsys, "run100", "--json", "--out", str(saved), "--plot", str(figure),
        "--certificate", str(proof),
    )  # fmt: skip
    assert code == 0
    found = json.loads(printed.out)
    free, lowest, stable = (
        found[key] for key in ("proved_free_below", "lowest_cycle", "lowest_stable_cycle")
    )
    assert free["certified"]
    assert free["from_ratio"] < 0.05
    assert 0.1303 < free["speed_ratio"] < lowest["speed_ratio"] <= stable["speed_ratio"]
    assert lowest["speed_ratio"] == pytest.approx(0.13099, abs=1e-5)  # docs/errata.md
    assert lowest["amplitude_deg"] > 0.0
    assert lowest["proved"] is False
    assert found["gap"] == pytest.approx(1.0 - free["speed"] / lowest["speed"])
    assert checker.check(Certificate.load(proof)).high == free["speed"]
    assert figure.stat().st_size > 0
    with xr.open_dataset(saved) as dataset:
        assert dataset.attrs["proved_free_below_speed"] == free["speed"]
        assert dataset.attrs["proved_free_below_certified"] == 1


def test_whatever_the_load(capsys):
    code, printed = run(capsys, "run100", "--any-load", "--json")
    found = json.loads(printed.out)
    assert code == 0
    assert found["any_load"] is True
    assert found["proved_free_below"]["speed_ratio"] > 0.1300
    assert found["lowest_cycle"] is None
    assert found["gap"] is None


def test_in_words(capsys):
    code, printed = run(capsys, "run100")
    assert code == 0
    assert "proved free" in printed.out
    assert "certified" in printed.out
    assert "lowest cycle" in printed.out


def test_a_linear_spring_has_no_cycles_and_is_free_up_to_flutter(capsys):
    code, printed = run(capsys, "linear-08", "--json")
    found = json.loads(printed.out)
    assert code == 0
    assert found["lowest_cycle"] is None
    assert 0.999 < found["proved_free_below"]["speed_ratio"] < 1.0


def test_a_cubic_spring_is_answered_with_the_reason(capsys):
    code, printed = run(
        capsys, "linear-02", "--json", "--set", "spring.kind=cubic", "--set", "spring.beta3=3.0"
    )
    found = json.loads(printed.out)
    assert code == 0
    assert found["proved_free_below"] is None
    assert any("no bound" in note for note in found["notes"])


def test_a_certificate_needs_its_suffix(capsys, tmp_path):
    code, printed = run(capsys, "run100", "--certificate", str(tmp_path / "proof.txt"))
    assert code == 2
    assert "--certificate" in printed.err


def test_a_chart_of_friction_over_gap(capsys, tmp_path):
    """Run 14's section: at 0.95 it needs 1.8533 times run 14's friction, by `tolerance`."""
    figure, saved = tmp_path / "c.png", tmp_path / "c.nc"
    code, printed = run(
        capsys, "run14", "--chart", "0.7,0.85,0.95,1.1", "--json", "--plot", str(figure),
        "--out", str(saved),
    )  # fmt: skip
    assert code == 0
    found = json.loads(printed.out)
    low, middle, high, beyond = found["chart"]
    assert found["friction_ratio"] == pytest.approx(5.0)
    assert [row["speed_ratio"] for row in found["chart"]] == pytest.approx([0.7, 0.85, 0.95, 1.1])
    assert low["proved_ratio"] == low["exact_ratio"] == 0.0  # any friction is enough
    assert high["exact_ratio"] / 5.0 == pytest.approx(1.8533, abs=1e-4)
    assert high["exact_ratio"] < high["proved_ratio"] < 1.875 * 5.0
    assert middle["exact_ratio"] < middle["proved_ratio"] < 1.02 * middle["exact_ratio"]
    assert all(row["certified"] for row in (low, middle, high))
    assert beyond["proved_ratio"] is None
    assert beyond["exact_ratio"] is None
    assert figure.stat().st_size > 0
    with xr.open_dataset(saved) as dataset:
        assert dataset["proved_ratio"].values[2] == high["proved_ratio"]


def test_a_chart_needs_a_gap(capsys):
    code, printed = run(capsys, "linear-02", "--chart", "0.5:0.9:3")
    assert code == 2
    assert "delta_h_deg" in printed.err
    code, printed = run(capsys, "run14", "--chart", "-1,0.5")
    assert code == 2
    assert "--chart" in printed.err


def test_a_family_of_onsets(capsys, tmp_path):
    """Damping moves what is proved up; one figure shows all members."""
    figure = tmp_path / "v.png"
    code, printed = run(
        capsys, "run100", "--vary", "section.zeta_alpha=0,0.02", "--any-load", "--json",
        "--plot", str(figure),
    )  # fmt: skip
    assert code == 0
    low, high = json.loads(printed.out)["members"]
    assert low["proved_free_below"]["speed_ratio"] < high["proved_free_below"]["speed_ratio"]
    assert figure.stat().st_size > 0
    code, printed = run(capsys, "run100", "--vary", "section.zeta_alpha=0,0.02", "--chart", "0.5")
    assert code == 2
    assert "--vary" in printed.err


def test_lco_says_what_is_proved_empty(capsys, tmp_path):
    """Without terms at once; `--proved` looks as far as `onset`."""
    words = ("run100", "--points", "4", "--simulations", "0", "--depth", "0")
    assert main(["lco", *words, "--json"]) == 0
    quick = json.loads(capsys.readouterr().out)
    assert main(["lco", *words, "--json", "--proved", "--plot", str(tmp_path / "l.png")]) == 0
    whole = json.loads(capsys.readouterr().out)
    assert quick["proved_certified"]
    assert whole["proved_certified"]
    assert 0.1 < quick["proved_free_below_ratio"] <= whole["proved_free_below_ratio"] < 0.13099
    assert whole["proved_free_below_ratio"] > 0.1303
    assert main(["lco", *words]) == 0
    assert "proved empty" in capsys.readouterr().out


def test_tolerance_names_what_is_proved(capsys):
    words = ("run14", "--speed-ratio", "0.95", "--amplitude-deg", "2")
    assert main(["tolerance", *words, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["proved_certified"]
    assert 9.2664 < found["proved_friction_over_gap"] < 9.8  # its lowest cycle, and 6 % above
    assert found["proved_gap_deg"] is None  # the whole size decides nothing
    assert main(["tolerance", *words]) == 0
    assert "nothing at all oscillates" in " ".join(capsys.readouterr().out.split())


def test_nothing_is_proved_of_several_springs_or_without_a_range_of_speeds(tmp_path):
    from aeroflutter.case import load_case
    from aeroflutter.cli.proving import free_range
    from aeroflutter.guarantees.absence import Uncovered, absence
    from aeroflutter.model.family import FixedModel, SectionModel
    from aeroflutter.model.lure import SpringFamily

    path = tmp_path / "two.toml"
    path.write_text(
        '[section]\nomega_bar = 0.8\n[[spring]]\nkind = "hysteresis"\ndelta_v_deg = 1.0\n'
        'delta_h_deg = 0.2\n[[spring]]\nat = "heave"\nkind = "freeplay"\ngap = 0.01\n',
        encoding="utf-8",
    )
    assert free_range(load_case(path), terms=False) is None
    case = load_case("run14")
    system = SectionModel(case.section).at(3.0)
    with pytest.raises(Uncovered, match="range"):
        absence(SpringFamily(FixedModel(system)), case.spring)


def test_of_two_springs_one_speed_is_proved(capsys, tmp_path, monkeypatch):
    """Run 14's section with a half-slope gap in heave; marching rests at 0.85 of flutter."""
    from aeroflutter.guarantees.absence import Joint, several
    from aeroflutter.guarantees.absence.joint_checker import check_joint

    monkeypatch.setattr(several, "_SHARES", (0.85,))
    monkeypatch.setattr(several, "_RESOLVED", 1.0)  # one speed only is looked at
    case, proof = tmp_path / "two.toml", tmp_path / "two.json"
    case.write_text(
        '[section]\nomega_bar = 0.8\n[[spring]]\nkind = "hysteresis"\ndelta_v_deg = 1.0\n'
        'delta_h_deg = 0.25\n[[spring]]\nat = "heave"\nkind = "bilinear"\nm0 = 0.0\nm_f = 0.5\n'
        "alpha_f = -0.005\ndelta = 0.01\n",
        encoding="utf-8",
    )
    code, printed = run(capsys, str(case), "--any-load", "--json", "--certificate", str(proof))
    assert code == 0
    found = json.loads(printed.out)
    assert found["proved_free_below"] is None
    assert found["proved_free_at"]["certified"]
    assert found["proved_free_at"]["speed_ratio"] == pytest.approx(0.85)
    assert check_joint(Joint.load(proof)) > 0
