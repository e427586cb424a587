"""Models from elsewhere in every command: in the unit of the first spring, from any start."""

import json

import numpy as np
import pytest
import xarray as xr
from test_elsewhere import SCALE, variables

import aeroflutter as af
from aeroflutter.case import load_case
from aeroflutter.cli import main
from aeroflutter.studies.cases import direction

GAP = float(np.radians(1.0))


@pytest.fixture(scope="module")
def cases(tmp_path_factory):
    """The same model, its spring in an angle and in metres."""
    folder = tmp_path_factory.mktemp("units")
    for unit, gap in (("rad", "gap_deg = 1.0"), ("m", f"gap = {GAP!r}")):
        given = variables() | {"units": [unit], "names": ["hinge"]}
        np.savez(folder / f"{unit}.npz", **given)
        (folder / f"{unit}.toml").write_text(
            f'[model]\nkind = "state-space"\nfile = "{unit}.npz"\n'
            f'[spring]\nkind = "freeplay"\n{gap}\n'
        )
    return folder


def told(capsys, *words):
    assert main([*map(str, words), "--json"]) == 0
    return json.loads(capsys.readouterr().out)


COMMANDS = {
    "df": ("--points", "8"),
    "simulate": ("--velocity", "60", "--alpha-deg", "START"),
    "lco": ("--depth", "0", "--simulations", "0", "--points", "3", "--velocity-range", "50,56"),
    "loop": ("--velocity", "60"),
}


def numbers(record, path=""):
    """Every number of a record by its path."""
    if isinstance(record, float):
        return {path: record}
    found = {}
    for key, one in record.items() if isinstance(record, dict) else enumerate(record):
        found |= numbers(one, f"{path}/{key}") if isinstance(one, dict | list | float) else {}
    return found


@pytest.mark.parametrize("command", COMMANDS)
def test_metres_are_told_as_they_are(cases, capsys, command):
    """What is an angle in one case is as many radians as there are metres in the other."""
    options = [(w, w) if w != "START" else ("2.0", str(np.radians(2.0))) for w in COMMANDS[command]]
    rad, m = (
        told(capsys, command, cases / f"{unit}.toml", *(pair[i] for pair in options))
        for i, unit in enumerate(("rad", "m"))
    )
    found, wanted = numbers(m), numbers(rad)
    angles = 0
    for path, value in wanted.items():
        bare = path.replace("_deg", "")
        angle = bare != path or ("/springs/" in path or "/coordinates/" in path)
        angles += angle
        if angle:
            value = np.radians(value)
        assert found[bare] == pytest.approx(value, rel=1e-9, abs=1e-12), path
    assert angles > 3
    assert not any("_deg" in path for path in found)


def test_files_tables_and_figures_speak_of_metres_and_of_v(cases, tmp_path, capsys):
    out, plot = tmp_path / "x.nc", tmp_path / "x.svg"
    words = ["df", str(cases / "m.toml"), "--points", "8", "--out", str(out), "--plot", str(plot)]
    assert main(words) == 0
    table = capsys.readouterr().out
    assert "amplitude (m)" in table
    assert "V/V_L" in table
    assert "deg" not in table
    assert "U*" not in table
    with xr.open_dataset(out) as held:
        assert held["amplitude"].attrs["units"] == "m"
        assert held["amplitude"].attrs["long_name"].startswith("hinge amplitude")
        assert not any(str(name).endswith("_deg") for name in held.variables)
    curve = af.describing_curve(load_case(cases / "m.toml"), af.DescribingOptions(points=8))
    labels = {axes.get_ylabel() for axes in curve.plot().axes}
    assert "hinge amplitude (m)" in labels
    assert curve.to_dataframe()["amplitude"].max() == pytest.approx(curve.amplitude.max())
    degrees = af.describing_curve(load_case(cases / "rad.toml"), af.DescribingOptions(points=8))
    assert "amplitude_deg" in degrees.to_dataframe()  # nothing is left of the metres


def test_maps_start_by_the_first_spring_by_any_output_and_by_states(cases, capsys):
    speeds = ("--velocity", "45:75:3")
    pairs = []
    for unit in ("rad", "m"):
        start = "0.5:3:3" if unit == "rad" else f"{np.radians(0.5)}:{np.radians(3.0)}:3"
        named = "hinge_deg" if unit == "rad" else "hinge"
        file = cases / f"{unit}.toml"
        first = told(capsys, "map", file, *speeds, "--alpha-deg", start)
        other = told(capsys, "map", file, *speeds, "--y", f"initial.{named}={start}")
        alike = ("damped", "lco", "divergent", "attractors")
        assert {k: first[k] for k in alike} == {k: other[k] for k in alike}
        assert first["lco"] > 0
        pairs.append(first)
    assert pairs[0]["lco"] == pairs[1]["lco"]
    case = load_case(cases / "rad.toml")
    end = af.flutter_map(case, velocity=[60.0], alpha_deg=[2.0])
    motion = af.simulate(
        case, af.Initial(**case.displaced(np.radians(2.0))._asdict()), velocity=60.0
    )
    assert end.amplitude_deg[0, 0] == pytest.approx(np.degrees(motion.amplitude), rel=1e-9)
    metres = af.flutter_map(load_case(cases / "m.toml"), velocity=[60.0], alpha_deg=[0.035])
    dataset = metres.to_dataset()
    assert dataset["amplitude"].attrs["units"] == "m"
    assert dataset["amplitude"].values[0, 0] == pytest.approx(motion.amplitude, rel=1e-6)
    state = direction(case, "initial.x3")
    assert state.tolist() == [0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
    words = ["map", str(cases / "rad.toml"), *speeds, "--y", "initial.flap=0:1:2"]
    assert main(words) == 2
    line = capsys.readouterr().err
    assert "initial.flap: is none of its motion; give initial.alpha_deg, initial. and one" in line
    assert len(line.splitlines()) == 1


def test_what_is_not_on_an_axis_is_as_the_case_says(cases):
    """Zero where it says nothing: the default start is no part of another one."""
    from aeroflutter.studies.cases import CaseCells
    from aeroflutter.studies.maps import Axis, Grid

    case = load_case(cases / "rad.toml")
    grid = Grid(Axis("velocity", [60.0]), Axis("initial.x3", [0.1, 0.2]))
    (group,) = CaseCells(case.text, "c", grid).groups(np.full(2, 60.0), np.array([0.1, 0.2]))
    assert group.states.tolist() == [[0, 0, 0.1, 0, 0, 0], [0, 0, 0.2, 0, 0, 0]]
    said = case.with_overrides({"initial.alpha_deg": 2.0})
    (group,) = CaseCells(said.text, "c", grid).groups(np.full(1, 60.0), np.array([0.1]))
    assert group.states[0].tolist() == pytest.approx([0, np.radians(2.0), 0.1, 0, 0, 0])


def test_sweeps_of_springs_and_of_speed(cases, capsys):
    vary = ("--vary", "spring.gap_deg=uniform(0.5,1.5)", "--sample", "3", "--velocity", "60")
    found = told(capsys, "sweep", cases / "rad.toml", *vary, "--onset", "none")
    gaps = np.array(found["values"]["spring.gap_deg"])
    sizes = np.array(found["values"]["amplitude_deg"]) / gaps
    np.testing.assert_allclose(sizes, sizes[0], rtol=1e-6)  # cycles grow as the gap does
    both = [
        told(capsys, "simulate", cases / f"{unit}.toml", "--sweep", "0.6:0.7:2")["sweeps"][0]
        for unit in ("rad", "m")
    ]
    assert np.radians(both[0]["amplitude_deg"]) == pytest.approx(both[1]["amplitude"], rel=1e-6)
    assert main(["simulate", str(cases / "m.toml"), "--sweep", "0.6:0.7:2"]) == 0
    assert "amplitude (m)" in capsys.readouterr().out


def test_motions_are_sampled_by_their_own_periods(cases):
    """Seconds are not semichords: a tenth of a second would be half a period."""
    case = load_case(cases / "rad.toml")
    found = af.simulate(case, velocity=60.0)
    assert np.diff(found.time[:2])[0] < found.period / 50
    assert 10 * found.period < found.duration < 1000 * found.period
    assert not np.any(np.isfinite(found.heave))
    figure = found.plot()
    assert not any("heave" in axes.get_ylabel() for axes in figure.axes)


def test_a_changed_file_is_read_again(tmp_path):
    given = variables()
    np.savez(tmp_path / "m.npz", **given)
    table = {"model": {"kind": "state-space", "file": str(tmp_path / "m.npz")}}
    first = load_case(table)
    assert load_case(table).imported is first.imported  # once as long as it stays the same
    np.savez(tmp_path / "m.npz", **(given | {"semichord": 2 * SCALE.b}))
    assert load_case(table).imported.scale.b == 2 * SCALE.b


def test_a_page_tells_metres_as_they_are(cases, tmp_path, monkeypatch):
    """Its numbers are those of the page in degrees, in radians, and no word of it is an angle."""
    from test_report_page import _carried, _quick

    _quick(monkeypatch)
    pages = {}
    for unit, starts in (("rad", np.array([0.5, 2.0])), ("m", np.radians([0.5, 2.0]))):
        out, start = tmp_path / f"{unit}.html", ",".join(map(repr, starts.tolist()))
        words = ["--velocity", "45,60", "--alpha-deg", start, "--periods", "2", "--out", str(out)]
        assert main(["report", str(cases / f"{unit}.toml"), *words]) == 0
        pages[unit] = out.read_text(encoding="utf-8")
    rad, m = _carried(pages["rad"]), _carried(pages["m"])
    assert (m["told"], rad["told"]) == (
        {"unit": "m", "mark": " m", "effort": "force"},
        {"unit": "deg", "mark": "°", "effort": "moment"},
    )
    assert m["map"]["y"]["name"] == "hinge"
    assert m["map"]["state"] == rad["map"]["state"]
    assert {"lco", "damped"} <= {m["map"]["states"][k] for k in np.ravel(m["map"]["state"])}
    for page, whole in ((m, np.radians(1.0)), (rad, 1.0)):  # of a degree in the API's unit
        page["sizes"] = [*page["curves"][0]["amplitude"], page["map"]["amplitude"][1][1]]
        page["sizes"] = np.array([*page["sizes"], *page["view"]["y"], *page["spring"]["pitch"]])
        page["sizes"] = page["sizes"] / whole
        sizes = np.array(page["motions"]["headers"])[:, [2, 4]]
        page["headers"] = np.where(sizes == 1.0, 1.0, sizes / whole)  # 1: the spring rests
    np.testing.assert_allclose(m["sizes"], rad["sizes"], rtol=1e-5)
    np.testing.assert_allclose(m["headers"], rad["headers"], rtol=1e-3)
    shown = pages["m"].split('<script type="application/json"')[0]
    assert "amplitude (m)" in shown
    assert "Restoring force of the spring against hinge" in shown
    assert "°" not in shown
    assert "(deg)" not in shown


def test_a_model_of_one_speed_has_no_map(tmp_path, capsys):
    one = variables()
    np.savez(tmp_path / "o.npz", **(one | {n: one[n][9] for n in ("speeds", "A", "B")}))
    (tmp_path / "o.toml").write_text('[model]\nkind = "state-space"\nfile = "o.npz"\n')
    assert main(["map", str(tmp_path / "o.toml")]) == 2
    assert "is one speed, so there is no map over it" in capsys.readouterr().err
