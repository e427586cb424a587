"""Sections tabulated from Theodorsen's function and read back as modal models.

Direct models have the ten-term indicial function, within 1.2e-5 of C(k); 0.1 % is what the issue of
a model from elsewhere being as good as one's own asks for.
"""

import json

import numpy as np
import pytest
from theodorsen import tables

from aeroflutter.case import load_case
from aeroflutter.cli import main
from aeroflutter.linear.pk import PKOptions, pk_method
from aeroflutter.linear.rootlocus import RootLocusOptions, root_locus
from aeroflutter.model.aerodynamics import Wagner
from aeroflutter.model.family import SectionModel
from aeroflutter.model.lure import SpringFamily
from aeroflutter.model.section import Scale, TypicalSection
from aeroflutter.orbits.cycles import cycles_at
from aeroflutter.orbits.describing import describing_curve
from aeroflutter.springs import Freeplay

PLAIN = TypicalSection(omega_bar=0.6, zeta_alpha=0.01, zeta_xi=0.01, scale=Scale(0.5, 40.0))
CONNER = load_case("conner").section
K = np.concatenate([[0.0], np.geomspace(0.002, 4.0, 40)])
GAP = Freeplay(np.radians(1.0))
CASES = pytest.mark.parametrize(
    ("section", "row", "at"), [(PLAIN, 1, "pitch"), (CONNER, 2, "flap")], ids=["plain", "conner"]
)


def written(path, section, row, at):
    """A modal model in a file, its spring in one coordinate."""
    given = tables(section, K)
    chosen = {name: given[name] for name in ("M", "C", "K", "k", "Q", "semichord", "density")}
    rows = np.zeros((1, len(given["M"])))
    rows[0, row] = 1.0
    np.savez(
        path, **chosen, rows=rows, stiffness=[given["stiffness"][row]], names=[at], units=["rad"]
    )


def modal(tmp_path, section, row, at, **keys):
    written(tmp_path / "m.npz", section, row, at)
    keys = {"exact": [0.0], "speed_range": [0.5, 300.0]} | keys
    model = {"kind": "modal", "file": str(tmp_path / "m.npz"), **keys}
    return load_case({"model": model, "spring": {"kind": "freeplay", "gap_deg": 1.0}})


def direct(section, at):
    return SpringFamily(SectionModel(section, Wagner.named("ten-term"), (at,)))


@CASES
def test_flutter_and_describing_functions_within_a_thousandth(tmp_path, section, row, at):
    family = direct(section, at)
    expected = root_locus(family).flutter
    V = section.scale.velocity(expected.speed)
    case = modal(tmp_path, section, row, at)
    found = root_locus(case.family(), RootLocusOptions(low=0.1 * V, high=2 * V)).flutter
    assert found.speed == pytest.approx(V, rel=1e-3)
    assert found.k == pytest.approx(expected.k, rel=1e-3)
    table = pk_method(case.imported.modal.whole(), PKOptions(low=0.3 * V, high=1.2 * V, points=40))
    assert table.flutter.speed == pytest.approx(V, rel=5e-5)
    curve, wanted = describing_curve(case.family(), GAP), describing_curve(family, GAP)
    assert curve.onset.speed == pytest.approx(section.scale.velocity(wanted.onset.speed), rel=1e-3)
    assert curve.onset.amplitude == pytest.approx(wanted.onset.amplitude, rel=1e-3)


def test_the_error_of_flutter_falls_with_the_number_of_lag_roots(tmp_path):
    V = PLAIN.scale.velocity(root_locus(direct(PLAIN, "pitch")).flutter.speed)
    errors = []
    for lags in (1, 2, 4, 8):
        case = modal(tmp_path, PLAIN, 1, "pitch", lags=lags)
        found = root_locus(case.family(), RootLocusOptions(low=0.3 * V, high=2 * V, grid=60))
        errors.append((abs(found.flutter.speed / V - 1), case.imported.modal.fit.errors.max()))
    flutter, fitted = zip(*errors, strict=True)
    assert flutter[0] > flutter[1] > flutter[2] > flutter[3]
    assert flutter[3] < 2e-4
    assert fitted[0] > fitted[1] > fitted[2] > fitted[3]


@pytest.mark.slow  # the cycles of Conner's flap at one speed take half a minute
@CASES
def test_exact_cycles_within_a_thousandth(tmp_path, section, row, at):
    family = direct(section, at)
    U = 0.62 * root_locus(family).flutter.speed
    case = modal(tmp_path, section, row, at, lags=8)
    wanted = [one for one in cycles_at(family, GAP, U).cycles if one.stable]
    there = cycles_at(case.family(), GAP, section.scale.velocity(U)).cycles
    found = [one for one in there if one.stable]
    assert wanted
    assert len(found) == len(wanted)
    for ours, theirs in zip(found, wanted, strict=True):
        assert ours.amplitude == pytest.approx(theirs.amplitude, rel=1e-3)
        assert ours.period == pytest.approx(theirs.period, rel=1e-3)


def test_import_writes_a_case_and_pk_compares(tmp_path, capsys, monkeypatch):
    written(tmp_path / "m.npz", PLAIN, 1, "pitch")
    monkeypatch.chdir(tmp_path)
    assert main(["import", "m.npz", "-o", "case.toml"]) == 0
    out = capsys.readouterr().out
    assert "N m/rad taken out of K for the spring at pitch" in out
    case = load_case("case.toml")
    assert case.imported.modal is not None
    assert 'file = "m.npz"' in (tmp_path / "case.toml").read_text()
    assert main(["import", "m.npz", "-o", "case.toml"]) == 2
    assert "exists" in capsys.readouterr().err
    assert main(["pk", "case.toml", "--json", "--points", "40", "--plot", "vg.png"]) == 0
    found = json.loads(capsys.readouterr().out)
    V = PLAIN.scale.velocity(root_locus(direct(PLAIN, "pitch")).flutter.speed)
    assert found["flutter"]["speed"] == pytest.approx(V, rel=1e-4)
    others = [one["speed"] for one in found["approximation"]["crossings"]]
    assert others == pytest.approx([one["speed"] for one in found["crossings"]], rel=2e-3)
    assert (tmp_path / "vg.png").stat().st_size > 10_000
    assert main(["pk", "run14"]) == 2
    assert "p-k needs air forces over k" in capsys.readouterr().err


def test_import_says_what_the_file_does_not(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    np.savez("ss.npz", A=np.eye(2), B=np.ones((2, 1)), C=np.ones((1, 2)))
    assert main(["import", "ss.npz", "-o", "ss.toml"]) == 2
    assert 'model.time_unit: is missing; say "s" or "semichord"' in capsys.readouterr().err
    assert main(["import", "ss.npz", "-o", "ss.toml", "--set", "time_unit=s"]) == 0
    assert load_case("ss.toml").imported.one_speed
    np.savez("no.npz", X=np.eye(2))
    assert main(["import", "no.npz", "-o", "no.toml"]) == 2
    assert "holds neither A, B, C nor M, K, Q, k; it holds X" in capsys.readouterr().err
