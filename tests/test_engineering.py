"""Cases in the words of engineers: what the keys become, what is said of it, what gives way."""

import json
import math
import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeroflutter.case.case import load_case
from aeroflutter.case.engineering import converted
from aeroflutter.cli import main
from aeroflutter.errors import InputError
from aeroflutter.springs import Freeplay, Hysteresis

DEGREE = math.pi / 180
TAILPLANE = """
[section]
axis_percent_chord = 38
zeta_alpha = 0.015
zeta_xi = 0.015
[section.si]
m = 35
b = 0.45
rho = 1.225
cg_percent_chord = 43
r = 0.23
frequency_h_hz = 9
frequency_alpha_hz = 21
[spring]
kind = "hysteresis"
friction_deg = 0.03
gap_deg = 0.15
"""
SAME = """
[section]
a_h = -0.24
zeta_alpha = 0.015
zeta_xi = 0.015
[section.si]
m = 35
b = 0.45
rho = 1.225
S = 1.575
I_alpha = 1.8515
K_h = 111921.3139
K_alpha = 32234.5820
[spring]
kind = "hysteresis"
delta_v_deg = 0.06
delta_h_deg = 0.15
"""


def loaded(text, **overrides):
    return load_case(tomllib.loads(text), overrides)


def test_both_ways_of_saying_it_are_one_section():
    """K = m ω² by hand: 35 (2π 9)² N/m and 35 0.23² (2π 21)² N m/rad a metre."""
    one, other = loaded(TAILPLANE), loaded(SAME)
    assert one.spring == other.spring == Hysteresis(0.06 * DEGREE, 0.15 * DEGREE)
    for name in ("mu", "a_h", "x_alpha", "r_alpha", "omega_bar", "zeta_alpha"):
        mine, theirs = getattr(one.section, name), getattr(other.section, name)
        assert mine == pytest.approx(theirs, rel=1e-6), name
    assert one.section.a_h == pytest.approx(-0.24, abs=1e-15)
    assert one.section.scale.omega_alpha == pytest.approx(42 * math.pi, rel=1e-15)
    assert load_case(tomllib.loads(one.text)) == one


@given(axis=st.floats(0, 100), cg=st.floats(0, 100), chord=st.floats(0.1, 10))
def test_places_on_the_chord(axis, cg, chord):
    """The distance from axis to centre of mass is that share of the chord."""
    text = TAILPLANE.replace("r = 0.23", f"r = {10 * chord}").replace("0.45", f"{chord / 2}")
    text = text.replace("chord = 38", f"chord = {axis}").replace("chord = 43", f"chord = {cg}")
    section = loaded(text).section
    behind_nose = (1 + section.a_h) / 2 * chord
    assert behind_nose == pytest.approx(axis / 100 * chord, abs=1e-12)
    x_cg = section.x_alpha * chord / 2
    assert behind_nose + x_cg == pytest.approx(cg / 100 * chord, abs=1e-12 * chord)


def test_the_nondimensional_section_takes_per_cent_too():
    section = loaded("[section]\nomega_bar = 0.8\naxis_percent_chord = 25\ncg_percent_chord = 37.5")
    assert (section.section.a_h, section.section.x_alpha) == (-0.5, 0.25)


def test_friction_is_half_the_height_in_heave_as_well():
    text = '[section]\nomega_bar = 0.8\n[spring]\nat = "heave"\nkind = "hysteresis"\n'
    assert loaded(text + "friction = 0.01\ngap = 0.2").spring == Hysteresis(0.02, 0.2)
    with pytest.raises(InputError, match=r"spring.friction_deg"):
        loaded(text + "friction_deg = 0.01\ngap = 0.2")


def test_setting_a_key_takes_the_place_of_the_same_in_other_words():
    case = load_case("run14", {"spring.friction_deg": 0.2, "spring.gap_deg": 0.7})
    assert case.spring == Hysteresis(0.4 * DEGREE, 0.7 * DEGREE)
    back = case.with_overrides({"spring.delta_v_deg": 1.0, "spring.delta_h_deg": 0.2})
    assert back.spring == load_case("run14").spring
    tail = loaded(TAILPLANE)
    stiff = tail.replace("section.si.K_alpha", 40_000.0).section
    assert stiff.scale.omega_alpha == pytest.approx(math.sqrt(40_000 / (35 * 0.23**2)))
    assert tail.replace("section.a_h", -0.3).section.a_h == -0.3
    assert tail.replace("section.si.a_h", -0.3).section.a_h == -0.3
    assert tail.replace("section.si.x_cg", 0.0).section.x_alpha == 0.0
    free = load_case("run14", {"spring.kind": "freeplay", "spring.gap_deg": 1.0})
    assert free.spring == Freeplay(DEGREE)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ("delta_v_deg = 1", ["spring.friction_deg: says the same as spring.delta_v_deg"]),
        ("delta_h_deg = 1", ["spring.gap_deg: says the same as spring.delta_h_deg"]),
    ],
)
def test_what_is_said_twice_is_refused(more, words):
    with pytest.raises(InputError) as caught:
        loaded(TAILPLANE + more)
    [problem] = caught.value.problems
    assert all(word in problem for word in words)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("frequency_h_hz = 9", "frequency_h_hz = 9\nomega_h = 56", "frequency_h_hz"),
        ("frequency_h_hz = 9", "frequency_h_hz = 9\nK_h = 56", "frequency_h_hz"),
        ("frequency_h_hz = 9", "frequency_h_hz = -9", "section.si.frequency_h_hz: must be a pos"),
        ("frequency_h_hz = 9", 'frequency_h_hz = "9"', "section.si.frequency_h_hz: must be a pos"),
        ("cg_percent_chord = 43", "cg_percent_chord = 43\nS = 1", "section.si.cg_percent_chord"),
        ("axis_percent_chord = 38", "axis_percent_chord = 38\na_h = 0", "axis_percent_chord: says"),
        ("friction_deg = 0.03", "friction_deg = -0.03", "spring.friction_deg: "),
        ("friction_deg = 0.03", "", "spring.delta_v_deg: is missing"),
    ],
)
def test_problems_name_the_key_of_the_file(old, new, words):
    with pytest.raises(InputError) as caught:
        loaded(TAILPLANE.replace(old, new))
    assert len(caught.value.problems) == 1, caught.value.problems
    assert words in caught.value.problems[0]


def test_validate_says_what_became_of_it(tmp_path, capsys):
    file = tmp_path / "tail.toml"
    file.write_text(TAILPLANE)
    assert main(["validate", str(file)]) == 0
    text = " ".join(capsys.readouterr().out.split())
    for line in (
        "section.axis_percent_chord = 38 is section.a_h = -0.24",
        "section.si.cg_percent_chord = 43 is section.si.x_cg = 0.045 m",
        "section.si.frequency_alpha_hz = 21 is section.si.omega_alpha = 131.947 rad/s",
        "spring.friction_deg = 0.03 is spring.delta_v_deg = 0.06 deg",
        "friction ± 0.03 deg (delta_v = 0.06 deg, twice the friction), gap 0.15 deg (delta_h)",
    ):
        assert line in text
    assert main(["validate", str(file), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["converted"]
    assert len(found) == 6
    assert found[-2] == {
        "key": "spring.friction_deg", "given": 0.03, "into": "spring.delta_v_deg", "value": 0.06,
        "unit": "deg",
    }  # fmt: skip
    assert converted(load_case("run14").tables) == []


def test_validate_shortens_a_long_table(tmp_path, capsys):
    file = tmp_path / "table.toml"
    pitch = [round(-3 + 0.025 * i, 6) for i in range(241)]
    file.write_text(
        f'[section]\nomega_bar = 0.8\n[spring]\nkind = "table"\npitch_deg = {pitch}\n'
        f"moment_deg = {pitch}\n"
    )
    assert main(["validate", str(file)]) == 0
    text = capsys.readouterr().out
    assert "[-3, -2.975, -2.95, ..., 2.975, 3] (241 numbers)" in text
    assert len(text) < 1000
