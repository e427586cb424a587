"""Cases whose model comes from a file: what is read, and what is refused."""

import json
from datetime import date

import bah
import netCDF4
import numpy as np
import pytest
import scipy.io

from aeroflutter.case import load_case
from aeroflutter.cli import main
from aeroflutter.errors import InputError
from aeroflutter.linear.rootlocus import root_locus
from aeroflutter.model.family import SectionModel
from aeroflutter.model.section import Scale, TypicalSection
from aeroflutter.orbits.describing import describing_curve
from aeroflutter.springs import Freeplay

SECTION = TypicalSection(omega_bar=0.6, zeta_alpha=0.01, scale=Scale(0.5, 40.0))
MODEL = SectionModel(SECTION, springs=("pitch", "heave"))
U = np.linspace(1.0, 7.0, 61)


def variables(seconds=True):
    """The section as a state space in s, or in semichords, its speeds in m/s."""
    A, B, C, _ = MODEL.stack(U)
    rate = SECTION.scale.velocity(U)[:, None, None] / SECTION.scale.b if seconds else 1.0
    return {
        "speeds": SECTION.scale.velocity(U),
        "A": A * rate,
        "B": B * rate,
        "C": C[0],
        "names": ["pitch", "heave"],
        "units": ["rad", "m"],
        "time_unit": "s" if seconds else "semichord",
        "semichord": SECTION.scale.b,
    }


def npz(path, given):
    np.savez(path, **given)


def mat(path, given):
    scipy.io.savemat(path, given | {"names": np.array(given["names"], dtype=object)})


def matlab(path, given):
    """As MATLAB keeps systems: their number in the last dimension."""
    last = {name: np.moveaxis(given[name], 0, 2) for name in ("A", "B")}
    mat(path, given | last)


def nc(path, given):
    with netCDF4.Dataset(path, "w") as file:
        for name, value in given.items():
            if isinstance(value, str):
                file.setncattr(name, value)
                continue
            array = np.asarray(value)
            kind = str if array.dtype.kind == "U" else array.dtype
            dims = [f"{name}{i}" for i in range(array.ndim)]
            for dim, size in zip(dims, array.shape, strict=True):
                file.createDimension(dim, size)
            variable = file.createVariable(name, kind, dims)
            variable[...] = array.astype(object) if kind is str else array


def case_of(tmp_path, write, name, **more):
    write(tmp_path / name, variables())
    return load_case({"model": {"kind": "state-space", "file": str(tmp_path / name)} | more})


@pytest.mark.parametrize(
    ("write", "name"), [(npz, "a.npz"), (mat, "a.mat"), (matlab, "b.mat"), (nc, "a.nc")]
)
def test_a_state_space_is_read_from_every_kind_of_file(tmp_path, write, name):
    case = case_of(tmp_path, write, name)
    family = case.imported.family
    assert family.names == ("pitch", "heave")
    assert family.units == ("rad", "m")
    speed = 3.3
    V = SECTION.scale.velocity(speed)
    direct = MODEL.at(speed)
    s = 0.3j
    np.testing.assert_allclose(
        family.at(V).transfer(s * V / SECTION.scale.b), direct.transfer(s), rtol=1e-6
    )
    assert case.scale.velocity(V) == V
    assert case.scale.frequency_hz(2 * np.pi, V) == pytest.approx(1.0)


def test_flutter_and_cycles_are_those_of_the_section(tmp_path):
    case = case_of(tmp_path, npz, "a.npz").with_overrides(
        {"spring.kind": "freeplay", "spring.gap_deg": 1.0}
    )
    section = SectionModel(SECTION, springs=("pitch",))
    expected = root_locus(section)
    flutter = root_locus(case.family()).flutter
    assert flutter.speed == pytest.approx(SECTION.scale.velocity(expected.flutter.speed), rel=1e-6)
    curve = describing_curve(case.family(), case.spring)
    direct = describing_curve(section_family(), Freeplay(np.radians(1.0)))
    assert curve.onset.speed_ratio == pytest.approx(direct.onset.speed_ratio, rel=1e-5)


def section_family():
    from aeroflutter.model.lure import SectionFamily

    return SectionFamily(SECTION)


def test_the_text_of_a_case_gives_an_equal_case_from_anywhere(tmp_path, monkeypatch):
    npz(tmp_path / "a.npz", variables())
    file = tmp_path / "case.toml"
    file.write_text('[model]\nkind = "state-space"\nfile = "a.npz"\n')
    monkeypatch.chdir("/")
    case = load_case(file)
    again = load_case(case.tables)
    assert again.text == case.text
    assert again.digest == case.digest
    npz(tmp_path / "a.npz", variables() | {"B": variables()["B"] * 1.001})
    assert load_case(file).digest != case.digest


def test_a_second_spring_and_the_linear_one(tmp_path):
    npz(tmp_path / "a.npz", variables())
    case = load_case(
        {
            "model": {"kind": "state-space", "file": str(tmp_path / "a.npz")},
            "spring": [
                {"at": "pitch", "kind": "freeplay", "gap_deg": 1.0},
                {"at": "heave", "kind": "freeplay", "gap": 0.01, "stiffness": 0.5},
            ],
        }
    )
    family, springs = case.loop()
    assert len(springs) == 2
    assert springs[1].gap == 0.01
    V = SECTION.scale.velocity(3.0)
    both = family.at(V)
    direct = SectionModel(SECTION, springs=("pitch", "heave"), stiffness=(1.0, 0.5)).at(3.0)
    rate = V / SECTION.scale.b
    np.testing.assert_allclose(both.B, direct.B * rate, rtol=1e-6, atol=1e-9)
    one = case_of(tmp_path, npz, "a.npz").model().at(V)  # heave linear, in A
    np.testing.assert_allclose(
        one.A, SectionModel(SECTION, springs=("pitch",)).at(3.0).A * rate, rtol=1e-5, atol=1e-6
    )


def test_a_modal_model_from_op4():
    case = load_case({"model": bah.MODEL})
    assert case.imported.modal is not None
    assert case.model().names == ("mode3",)
    locus = root_locus(case.family())
    assert locus.flutter.speed == pytest.approx(394.0, rel=2.5e-3)
    notes = "\n".join(case.imported.notes)
    assert "237.747 N/m taken out of K for the spring at mode3" in notes
    assert "warning: the approximation is off by" in notes


def test_a_polynomial_of_the_inverse_speed(tmp_path):
    terms = MODEL.terms
    omega = SECTION.scale.omega_alpha * SECTION.scale.b
    A = [terms.A0, terms.A1 * omega, terms.A2 * omega**2]
    B = [0 * terms.B2, 0 * terms.B2, terms.B2 * omega**2]
    np.savez(tmp_path / "p.npz", A=A, B=B, C=terms.C, names=["pitch", "heave"])
    case = load_case(
        {
            "model": {
                "kind": "state-space",
                "file": str(tmp_path / "p.npz"),
                "variable": "1/V",
                "time_unit": "semichord",
                "speed_range": [5.0, 200.0],
            }
        }
    )
    V = SECTION.scale.velocity(3.0)
    np.testing.assert_allclose(case.imported.family.at(V).A, MODEL.at(3.0).A, atol=1e-12)
    dA = case.imported.family.derivative(V)[0] * SECTION.scale.velocity(1.0)
    np.testing.assert_allclose(dA, MODEL.derivative(3.0)[0], atol=1e-12)
    flutter = root_locus(case.family()).flutter
    expected = root_locus(SectionModel(SECTION, springs=("pitch",))).flutter
    assert flutter.speed == pytest.approx(SECTION.scale.velocity(expected.speed), rel=1e-9)


def test_one_file_a_speed_and_one_speed_alone(tmp_path):
    given = variables()
    names = []
    for i in range(0, 61, 3):
        names.append(f"v{i}.npz")
        part = {name: given[name][i] for name in ("A", "B")} | {"C": given["C"], "D": np.zeros(1)}
        np.savez(tmp_path / names[-1], speeds=given["speeds"][i], **part)
    table = {"kind": "state-space", "time_unit": "s", "file": [str(tmp_path / n) for n in names]}
    many = load_case({"model": table}).imported
    assert len(many.family.speeds) == 21
    one = load_case({"model": table | {"file": str(tmp_path / names[5])}}).imported
    assert one.one_speed
    np.testing.assert_array_equal(one.family.at(1.0).A, given["A"][15])


def test_states_that_differ_are_followed_by_mode(tmp_path):
    given = variables()
    rng = np.random.default_rng(5)
    n = given["A"].shape[1]
    A, B, C = [], [], []
    for a, b in zip(given["A"], given["B"], strict=True):
        T = rng.normal(size=(n, n))
        A.append(T @ a @ np.linalg.inv(T))
        B.append(T @ b)
        C.append(given["C"] @ np.linalg.inv(T))
    np.savez(tmp_path / "t.npz", **(given | {"A": A, "B": B, "C": C}))
    case = load_case({"model": {"kind": "state-space", "file": str(tmp_path / "t.npz")}})
    assert "modes were followed" in case.imported.notes[0]
    V = SECTION.scale.velocity(3.33)
    s = np.array([0.2j, 0.7j]) * V / SECTION.scale.b
    expected = MODEL.at(3.33).transfer(s * SECTION.scale.b / V)
    np.testing.assert_allclose(case.imported.family.at(V).transfer(s), expected, rtol=2e-4)


BAD = {
    "D": ({"D": np.ones((2, 2))}, "D: must be zero"),
    "dt": ({"dt": 0.01}, "dt: the system is in discrete time"),
    "nan": ({"A": np.full((61, 6, 6), np.nan)}, "A: holds NaN"),
    "complex": ({"B": np.ones((61, 6, 2)) * 1j}, "B: is complex; real numbers are due"),
    "shape": ({"C": np.ones((2, 5))}, r"need shapes \(k, n, n\)"),
    "order": ({"speeds": variables()["speeds"][::-1]}, "strictly increasing"),
    "names": ({"names": ["pitch", "pitch"]}, "pitch comes twice"),
    "count": ({"names": ["pitch"]}, "names: need 2, one an output, got 1"),
    "unit": ({"units": ["rad", "furlong"]}, 'units: must be "rad" or "m"'),
    "time": ({"time_unit": "minute"}, 'must be "s" or "semichord"'),
    "text": ({"A": np.array(["x"])}, "A: must be numbers"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_state_spaces_give_one_line(tmp_path, name, capsys):
    change, words = BAD[name]
    np.savez(tmp_path / "bad.npz", **(variables() | change))
    file = tmp_path / "bad.toml"
    file.write_text('[model]\nkind = "state-space"\nfile = "bad.npz"\n')
    assert main(["rootlocus", str(file)]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert len(err.splitlines()) == 1
    with pytest.raises(InputError, match=words):
        load_case(file)


BAD_MODAL = {
    "k": ({"k": [0.5] * 30}, "strictly increasing"),
    "count": ({"k": [0.5, 1.0]}, "need shapes"),
    "mach": ({"at_mach": 0.7}, "there is no Q at 0.7, only at 0, 0.2"),
    "singular": ({"M": [1.0] * 9 + [0.0]}, "M: mass must be positive definite"),
    "size": ({"K": [1.0] * 9}, "K: must be 10 by 10"),
    "missing": ({"semichord": None}, "semichord: is missing"),
    "matrix": ({"Q": "QKK"}, "Q: there is no 'QKK' in the file; it has QHH"),
    "ragged": ({"K": [[1.0], [1.0, 2.0]]}, "K: must be numbers"),
    "taken": (
        {"rows": [[0, 0, 0, 1, 0, 0, 0, 0, 0, 0]], "stiffness": [600.0]},
        "K has less than is taken out of it",
    ),
    "lags": ({"lags": [0.1, 0.1]}, "no root may come twice"),
    "exact": ({"exact": [0.12]}, "k = 0.12 is not in the table"),
    "date": ({"Q": date(2026, 12, 1)}, "model.Q: must hold words, numbers, lists or tables"),
}


@pytest.mark.parametrize("name", BAD_MODAL)
def test_bad_modal_models_give_one_line(name):
    change, words = BAD_MODAL[name]
    table = {key: value for key, value in (bah.MODEL | change).items() if value is not None}
    with pytest.raises(InputError, match=words) as caught:
        load_case({"model": table})
    assert len(caught.value.problems) == 1


@pytest.mark.parametrize("keep", [0, 10, 50, 1000, 50_000, 109_000])
def test_a_truncated_op4_gives_one_line(tmp_path, keep):
    (tmp_path / "cut.op4").write_bytes(bah.FILE.read_bytes()[:keep])
    with pytest.raises(InputError) as caught:
        load_case({"model": bah.MODEL | {"file": str(tmp_path / "cut.op4")}})
    assert len(caught.value.problems) == 1
    assert "cut.op4" in caught.value.problems[0] or "k, Q" in caught.value.problems[0]


def test_what_clashes_with_a_model(tmp_path):
    npz(tmp_path / "a.npz", variables())
    model = {"kind": "state-space", "file": str(tmp_path / "a.npz")}
    with pytest.raises(InputError, match=r"section: goes with a section; \[model\] stands in"):
        load_case({"model": model, "section": {"omega_bar": 1.0}})
    with pytest.raises(InputError, match=r'at: must be one of "pitch", "heave", not "flap"'):
        load_case({"model": model, "spring": {"at": "flap", "kind": "linear"}})
    with pytest.raises(InputError, match=r"initial\.state: needs 6 numbers"):
        load_case({"model": model, "initial": {"state": [0.0]}})
    with pytest.raises(InputError, match=r"model.gap: is not a known key"):
        load_case({"model": model | {"gap": 1}})
    case = load_case({"model": model})
    with pytest.raises(InputError, match=r"\[model\] is in its place"):
        _ = case.section


def test_simulate_and_rootlocus_speak_of_a_model(tmp_path, capsys):
    npz(tmp_path / "a.npz", variables())
    file = tmp_path / "c.toml"
    file.write_text(
        '[model]\nkind = "state-space"\nfile = "a.npz"\n[spring]\nkind = "freeplay"\ngap_deg = 1\n'
        "[initial]\nalpha_deg = 3\n"
    )
    assert main(["validate", str(file)]) == 0
    assert "state-space, 6 states, 20 to 140 m/s" in capsys.readouterr().out
    assert main(["rootlocus", str(file), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["flutter"]["velocity_m_s"] == pytest.approx(found["flutter"]["speed"])
    assert main(["simulate", str(file), "--speed-ratio", "0.4", "--json"]) == 0
    run = json.loads(capsys.readouterr().out)
    assert run["state"] in ("damped", "lco", "aperiodic")
    assert run["springs"][0]["at"] == "pitch"


def test_numbers_of_a_model_are_in_its_own_units(tmp_path, capsys):
    """k is omega b/V whatever the model's time; nothing refers to an uncoupled pitch frequency."""
    file = tmp_path / "c.toml"
    file.write_text('[model]\nkind = "state-space"\nfile = "a.npz"\n')
    expected = root_locus(SectionModel(SECTION, springs=("pitch",))).flutter
    hertz = SECTION.scale.frequency_hz(expected.k, expected.speed)
    for seconds, known in ((True, True), (False, True), (True, False)):
        given = variables(seconds)
        if not known:
            del given["semichord"]
        npz(tmp_path / "a.npz", given)
        assert main(["rootlocus", str(file), "--json"]) == 0
        found = json.loads(capsys.readouterr().out)
        assert found["speed_unit"] == "m/s"
        assert found["time_unit"] == ("s" if seconds else "semichord")
        flutter = found["flutter"]
        assert flutter["omega_ratio"] is None
        assert flutter["frequency_hz"] == pytest.approx(hertz, rel=1e-5)
        assert flutter["k"] == (pytest.approx(expected.k, rel=1e-5) if known else None)


def test_a_model_of_one_speed_takes_no_speed_option(tmp_path, capsys):
    given = variables()
    part = {name: given[name][20] for name in ("speeds", "A", "B")}
    npz(tmp_path / "a.npz", given | part)
    file = tmp_path / "c.toml"
    file.write_text(
        '[model]\nkind = "state-space"\nfile = "a.npz"\n[spring]\nkind = "freeplay"\ngap_deg = 1\n'
    )
    assert main(["simulate", str(file), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["speed"] == given["speeds"][20]
    assert main(["rootlocus", str(file), "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)["roots"]) == 1
    assert main(["simulate", str(file), "--speed", "3"]) == 2
    assert "is given at one speed; remove it" in capsys.readouterr().err
    assert main(["df", str(file)]) == 2
    assert "so there is no curve over it" in capsys.readouterr().err
    assert main(["map", str(file)]) == 2
    assert "starts motions by the pitch of a section" in capsys.readouterr().err


def test_amplitudes_that_are_no_angles_are_not_told_as_such(tmp_path, capsys):
    npz(tmp_path / "a.npz", variables())
    file = tmp_path / "c.toml"
    file.write_text(
        '[model]\nkind = "state-space"\nfile = "a.npz"\n'
        '[spring]\nat = "heave"\nkind = "freeplay"\ngap = 0.01\n'
    )
    assert main(["df", str(file), "--points", "8", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["onset"]["amplitude_deg"] is None
    assert found["onset"]["amplitude"] == pytest.approx(found["branch"][0]["amplitude"], rel=100)
    assert found["branch"][0]["springs"][0]["unit"] == "m"
    assert main(["rootlocus", str(file)]) == 0
