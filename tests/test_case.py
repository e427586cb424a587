"""Case files: what loads, what it means, and what every kind of bad file is told."""

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from mangled import VALID, mangled_bytes

from aeroflutter.case import schema
from aeroflutter.case.case import Case, ModelMotion, builtin_names, load_case
from aeroflutter.case.source import parse_override
from aeroflutter.case.template import template
from aeroflutter.errors import InputError
from aeroflutter.model.aerodynamics import QuasiSteady, Wagner
from aeroflutter.springs import (
    Bilinear,
    Cubic,
    DeadZone,
    Freeplay,
    Friction,
    Hysteresis,
    Linear,
    Play,
    Polynomial,
    Relay,
    Saturation,
    Table,
)

DEGREE = math.pi / 180
SECTION = "[section]\nomega_bar = 0.8\n"


def problems(tmp_path: Path, text: str | bytes) -> list[str]:
    """What the loader says about a file, without the file's name."""
    file = tmp_path / "bad.toml"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(InputError) as caught:
        load_case(file)
    assert all(problem.startswith(f"{file}: ") for problem in caught.value.problems)
    return [problem.removeprefix(f"{file}: ") for problem in caught.value.problems]


# Built-in cases


@pytest.mark.parametrize("name", builtin_names())
def test_built_in_case_loads_and_its_text_gives_it_back(name: str) -> None:
    case = load_case(name)
    again = load_case(tomllib.loads(case.text))
    assert (again.section, again.aerodynamics) == (case.section, case.aerodynamics)
    assert (again.spring, again.initial, again.text) == (case.spring, case.initial, case.text)
    assert case.family().c.shape == ((6,) if case.section.flap is None else (8,))


# Brooking 1998, Table 5.1: omega_bar and the ratio of width to height; run 100 has no height.
TABLE_5_1 = {
    "run6": (0.8, 5.0),
    "run10": (0.8, 1.0),
    "run14": (0.8, 0.2),
    "run15": (0.8, 0.1),
    "run16": (0.8, 10.0),
    "run101": (0.2, 5.0),
    "run102": (0.2, 2.5),
    "run103": (0.2, 1.0),
    "run111": (0.2, 0.2),
}


@pytest.mark.parametrize(("name", "row"), TABLE_5_1.items())
def test_runs_are_those_of_the_thesis(name: str, row: tuple[float, float]) -> None:
    case = load_case(name)
    assert isinstance(case.spring, Hysteresis)
    assert case.section.omega_bar == row[0]
    assert case.spring.delta_h / case.spring.delta_v == pytest.approx(row[1], rel=1e-14)
    assert (case.section.mu, case.section.a_h) == (100.0, -0.5)
    assert (case.section.x_alpha, case.section.r_alpha) == (0.25, 0.5)
    assert ("inferred" in case.title) == (name != "run14")


def test_run_100_has_a_loop_without_height() -> None:
    spring = load_case("run100").spring
    assert isinstance(spring, Hysteresis)
    assert spring.delta_v == 0.0
    assert spring.delta_h == pytest.approx(DEGREE)


def test_built_in_names_are_listed_in_natural_order() -> None:
    runs = [name for name in builtin_names() if name.startswith("run")]
    assert runs == sorted(runs, key=lambda name: int(name.removeprefix("run")))


def test_si_section_is_converted() -> None:
    """NACA TR 496 case: mu = 10, x_alpha = 0.2, r_alpha = 0.5, omega_bar = 0.5, b = 1 ft."""
    section = load_case("naca496").section
    assert section.mu == pytest.approx(10.0, rel=1e-6)  # the file gives the mass to seven digits
    assert section.x_alpha == pytest.approx(0.2, rel=1e-14)
    assert section.r_alpha == pytest.approx(0.5, rel=1e-14)
    assert section.omega_bar == pytest.approx(0.5, rel=1e-14)
    assert section.a_h == -0.4
    assert section.scale is not None
    assert section.scale.velocity(1.0) == pytest.approx(30.48)


def test_axis_and_damping_may_stand_beside_or_in_the_si_table() -> None:
    tables = load_case("naca496", {"section.zeta_xi": 0.01}).tables
    outside = load_case(tables)
    for name in ("a_h", "zeta_alpha", "zeta_xi"):
        tables["section"]["si"][name] = tables["section"].pop(name)
    assert load_case(tables).section == outside.section
    assert load_case(tables).text == outside.text
    assert (outside.section.a_h, outside.section.zeta_xi) == (-0.4, 0.01)


# What the keys mean

SPRINGS = {
    'kind = "linear"': Linear(),
    'kind = "cubic"\nbeta3 = 3': Cubic(1.0, 3.0),
    'kind = "cubic"\nbeta1 = 0\nbeta3 = -3.5': Cubic(0.0, -3.5),
    'kind = "table"\npitch_deg = [-1, 0, 2]\nmoment_deg = [-1, 0, 1.5]': Table(
        (-DEGREE, 0.0, 2 * DEGREE), (-DEGREE, 0.0, 1.5 * DEGREE)
    ),
    'kind = "bilinear"\nm0_deg = 0.25\nm_f = 0.05\nalpha_f_deg = 0.5\ndelta_deg = 1': Bilinear(
        0.25 * DEGREE, 0.05, 0.5 * DEGREE, DEGREE
    ),
    'kind = "freeplay"\ngap_deg = 0.5\ncentre_deg = -1': Freeplay(0.5 * DEGREE, -DEGREE),
    'kind = "hysteresis"\ndelta_v_deg = 1\ndelta_h_deg = 2\nv_off_deg = 3\nh_off_deg = 4': (
        Hysteresis(DEGREE, 2 * DEGREE, 3 * DEGREE, 4 * DEGREE)
    ),
    'kind = "polynomial"\nbeta = [1, -0.5, 3]': Polynomial((1.0, -0.5, 3.0)),
    'kind = "saturation"\nlimit_deg = 2': Saturation(2 * DEGREE),
    'kind = "dead-zone"\ngap_deg = 2\nslope = 0.5': DeadZone(2 * DEGREE, 0.5),
    'kind = "relay"\nmoment_deg = 2\nwidth_deg = 0.5': Relay(2 * DEGREE, 0.5 * DEGREE),
    'kind = "play"\ndelta_v_deg = 2': Play(2 * DEGREE),
    'kind = "friction"\nfriction_deg = 0.5\nbeta1 = 0': Friction(0.5 * DEGREE, 0.0),
}


@pytest.mark.parametrize("keys", SPRINGS)
def test_springs_are_built_in_radians(keys: str) -> None:
    spring = load_case(tomllib.loads(f"{SECTION}[spring]\n{keys}")).spring
    assert spring == SPRINGS[keys]


def test_every_kind_of_spring_is_tried_above() -> None:
    assert {spring.kind for spring in SPRINGS.values()} == set(schema.SPRINGS)


def test_least_case_takes_the_defaults() -> None:
    case = load_case(tomllib.loads(SECTION))
    assert case.spring == Linear()
    assert case.aerodynamics == Wagner()
    assert case.initial == (6 * DEGREE, 0.0, 0.0, 0.0)


def test_initial_motion_is_in_radians_and_semichords() -> None:
    keys = "[initial]\nalpha_deg = -2\nalpha_rate_deg = 0.5\nxi = 0.1\nxi_rate = -0.2"
    initial = load_case(tomllib.loads(SECTION + keys)).initial
    assert initial == pytest.approx((-2 * DEGREE, 0.5 * DEGREE, 0.1, -0.2))


def test_initial_motion_by_states_and_memories() -> None:
    """A state says all; memories are one a spring that remembers, in the order of the springs."""
    loop = 'kind = "hysteresis"\ndelta_v_deg = 1\ndelta_h_deg = 2'
    cubic = 'kind = "cubic"\nbeta3 = 3\nat = "heave"'
    springs = f"[[spring]]\n{cubic}\n[[spring]]\n{loop}\n[initial]\n"
    held = load_case(tomllib.loads(f"{SECTION}{springs}alpha_deg = 1\nmemory = [0.004]"))
    assert held.initial.memory == (0.0, 0.004)
    assert held.initial.alpha == DEGREE
    states = [0.1, 0.02, 0.0, 0.0, 0.0, -0.01]
    whole = load_case(tomllib.loads(f"{SECTION}{springs}state = {states}"))
    assert whole.initial == ModelMotion(tuple(states))
    assert whole.displaced(0.3).state == (0.1, 0.3, 0.0, 0.0, 0.0, -0.01)
    assert held.replace("initial.state", states).initial == ModelMotion(tuple(states), (0.0, 0.004))
    for case in (held, whole):
        assert load_case(tomllib.loads(case.text)) == case
    with pytest.raises(InputError) as caught:
        load_case(tomllib.loads(f"{SECTION}{springs}alpha_deg = 1\nstate = [0]\nmemory = [0, 0]"))
    assert [problem.partition(" ")[2] for problem in caught.value.problems] == [
        "initial.state: needs 6 numbers, one a state (xi, alpha, xi_rate, alpha_rate, z1, z2), "
        "not 1",
        "initial.alpha_deg: excludes initial.state; remove one",
        "initial.memory: needs 1 numbers, one a spring that remembers (pitch), not 2",
    ]


def test_aerodynamics() -> None:
    quasi = load_case(tomllib.loads(f'{SECTION}[aerodynamics]\nmodel = "quasi-steady"'))
    assert quasi.aerodynamics == QuasiSteady()
    three = load_case(
        tomllib.loads(f"{SECTION}[aerodynamics]\na = [0.1, 0.2, 0.1]\nb = [0.1, 0.3, 1]")
    )
    assert three.aerodynamics == Wagner((0.1, 0.2, 0.1), (0.1, 0.3, 1.0))


@pytest.mark.parametrize("prefix", [b"", b"\xef\xbb\xbf"])
@pytest.mark.parametrize("ending", ["\n", "\r\n"])
def test_byte_order_mark_and_line_endings_do_not_matter(
    tmp_path: Path, prefix: bytes, ending: str
) -> None:
    file = tmp_path / "case.toml"
    file.write_bytes(prefix + SECTION.replace("\n", ending).encode())
    assert load_case(file).section.omega_bar == 0.8


@pytest.mark.parametrize("dimensional", [False, True])
@pytest.mark.parametrize("kind", schema.SPRINGS)
def test_template_loads_and_names_every_key(kind: str, dimensional: bool) -> None:
    text = template(kind, dimensional=dimensional)
    case = load_case(tomllib.loads(text))
    assert case.spring.kind == kind
    assert (case.section.scale is not None) == dimensional
    for models in schema.TABLES.values():
        for model in models:
            for key in model.model_fields:
                assert f"{key} = " in text
    assert max(map(len, text.splitlines())) <= 100


# Changes


def test_replace_and_overrides_agree() -> None:
    changed = load_case("run14", {"section.mu": 50, "initial.alpha_deg": 2})
    assert changed.section.mu == 50.0
    assert changed.initial.alpha == 2 * DEGREE
    replaced = load_case("run14").replace("section.mu", np.float64(50))
    assert replaced.replace("initial.alpha_deg", np.int64(2)) == changed
    assert changed.digest != load_case("run14").digest


def test_another_kind_starts_its_table_afresh() -> None:
    case = load_case("run14", {"spring.kind": "freeplay", "spring.gap_deg": 1.0})
    assert case.spring == Freeplay(DEGREE)
    same = load_case("run14", {"spring.kind": "hysteresis"})
    assert same == load_case("run14")
    quasi = load_case("run14").replace("aerodynamics.model", "quasi-steady")
    assert quasi.aerodynamics == QuasiSteady()


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        ({"section.mu": -1}, ["section.mu", "positive"]),
        ({"section.muu": 1}, ["section.muu", 'did you mean "mu"']),
        ({"section.omega_bar.x": 1}, ["section.omega_bar is not a table"]),
        ({"section": 3}, ["section: must be a table"]),
        ({"": 3}, ["is no key"]),
        ({"section..mu": 3}, ["is no key"]),
        ({"section.mu": object()}, ["section.mu", "positive number"]),
    ],
)
def test_bad_changes_are_refused(overrides: dict[str, object], words: list[str]) -> None:
    with pytest.raises(InputError) as caught:
        load_case("run14", overrides)
    [problem] = caught.value.problems
    assert all(word in problem for word in words)


def test_values_of_set_are_toml_or_bare_words() -> None:
    assert parse_override("section.mu=50") == ("section.mu", 50)
    assert parse_override(" a.b = [1, 2] ") == ("a.b", [1, 2])
    assert parse_override("spring.kind=freeplay") == ("spring.kind", "freeplay")
    assert parse_override('title="a = b"') == ("title", "a = b")
    assert parse_override("title=1\nother=2") == ("title", "1\nother=2")
    for text in ("", "=", "section.mu", "section.mu=", "=5"):
        with pytest.raises(InputError, match="KEY=VALUE"):
            parse_override(text)


# Bad files

BAD = {
    # unknown names
    "[section]\nomega_bar = 1\nmuu = 3": ["section.muu", 'did you mean "mu"'],
    "[section]\nomega_bar = 1\nqqqqq = 3": ["section.qqqqq", "not a known key"],
    "omega_bar = 1\n[section]\nomega_bar = 1": ["omega_bar", "belongs in [section]"],
    f"{SECTION}[springs]\nkind = 'linear'": ["springs", 'did you mean "spring"'],
    f"{SECTION}[initial]\nalpha = 3": ["initial.alpha", "alpha_deg"],
    # missing
    "title = 'x'": ["section.omega_bar", "missing"],
    f"{SECTION}[spring]\ndelta_v_deg = 1": ["spring.kind", "missing", '"freeplay"'],
    f"{SECTION}[spring]\nkind = 'cubic'": ["spring.beta3", "missing", "per rad^2"],
    f"{SECTION}[aerodynamics]\na = [0.1]": ["aerodynamics.b", "missing"],
    # types
    "[section]\nomega_bar = '0.8'": ["section.omega_bar", "positive number", '"0.8"'],
    "[section]\nomega_bar = true": ["section.omega_bar", "true"],
    "[section]\nomega_bar = [1]": ["section.omega_bar", "a list"],
    "[section]\nomega_bar = 1979-05-27": ["section.omega_bar", "1979-05-27"],
    "section = 3": ["section", "must be a table"],
    "[[section]]\nomega_bar = 1": ["section", "must be a table"],
    f"{SECTION}[spring]\nkind = 3": ["spring.kind", "must be one of", '"linear"'],
    f"{SECTION}[spring]\nkind = 'hysterisis'": ["spring.kind", 'did you mean "hysteresis"'],
    f"{SECTION}[aerodynamics]\nmodel = 'theodorsen'": ["aerodynamics.model", '"quasi-steady"'],
    f"title = 3\n{SECTION}": ["title", "text"],
    f'title = "a\\nb"\n{SECTION}': ["title", "one line"],
    # values
    "[section]\nomega_bar = nan": ["section.omega_bar", "positive number", "nan"],
    "[section]\nomega_bar = 1e400": ["section.omega_bar", "inf"],
    "[section]\nomega_bar = 1e308": ["section.omega_bar", "1e+12"],
    f"[section]\nomega_bar = 1{'0' * 400}": ["section.omega_bar", "digits"],
    f"[section]\nomega_bar = 0x{'f' * 6000}": ["section.omega_bar", "digits"],
    "[section]\nomega_bar = 0": ["section.omega_bar", "positive"],
    f"{SECTION}mu = -3": ["section.mu", "positive", "-3"],
    f"{SECTION}mu = 1e-320": ["section", "too small"],
    f"{SECTION}r_alpha = 0.25": ["section.r_alpha", "mass matrix", "definiteness"],
    f"{SECTION}x_alpha = -0.6": ["section.r_alpha", "0.6", "definiteness"],
    f"{SECTION}zeta_alpha = -0.1": ["section.zeta_alpha", "negative"],
    f"{SECTION}[aerodynamics]\na = [0.6, 0.4]\nb = [1, 2]": ["aerodynamics.a", "below 1"],
    f"{SECTION}[aerodynamics]\na = [0.6]\nb = [0]": ["aerodynamics.b", "positive"],
    f"{SECTION}[aerodynamics]\na = [0.6]\nb = [1, 2]": ["aerodynamics.a", "1 and 2"],
    f"{SECTION}[aerodynamics]\na = ['x']\nb = [1]": ["aerodynamics.a, value 1", '"x"'],
    f"{SECTION}[spring]\nkind = 'hysteresis'\ndelta_v_deg = -1\ndelta_h_deg = 1": [
        "spring.delta_v_deg",
        "-1",
    ],
    f"{SECTION}[spring]\nkind = 'freeplay'\ngap_deg = -0.1": ["spring.gap_deg", "-0.1"],
    f"{SECTION}[spring]\nkind = 'bilinear'\nalpha_f_deg = 1\ndelta_deg = -2": ["spring.delta_deg"],
    f"{SECTION}[spring]\nkind = 'table'\npitch_deg = [1, 0]\nmoment_deg = [1, 2]": [
        "spring.pitch_deg",
        "ascend",
    ],
    f"{SECTION}[spring]\nkind = 'table'\npitch_deg = [1, 1]\nmoment_deg = [1, 2]": [
        "spring.pitch_deg",
        "ascend",
    ],
    f"{SECTION}[spring]\nkind = 'table'\npitch_deg = [0, 1]\nmoment_deg = [1]": [
        "spring.moment_deg",
        "one moment a pitch",
    ],
    f"{SECTION}[spring]\nkind = 'table'\npitch_deg = [0]\nmoment_deg = [1]": [
        "spring.pitch_deg",
        "two",
    ],
    # another kind's keys
    f"{SECTION}[spring]\nkind = 'linear'\ngap_deg = 1": ["spring.gap_deg", 'kind = "freeplay"'],
    f"{SECTION}[aerodynamics]\nmodel = 'quasi-steady'\na = [0.1]": [
        "aerodynamics.a",
        'model = "wagner"',
    ],
    # SI
    f"{SECTION}[section.si]\nm = 1\nb = 1\nrho = 1\nx_cg = 0\nr = 0.5\nomega_h = 1\n"
    "omega_alpha = 1": ["section.omega_bar", "follows from [section.si]"],
    "[section]\na_h = 0\n[section.si]\nm = 1\nb = 1\nrho = 1\nx_cg = 0\nr = 0.5\nomega_h = 1\n"
    "omega_alpha = 1\na_h = 0": ["section.a_h", "[section.si] too"],
    "[section.si]\nm = 1\nb = 1\nrho = 1\nx_cg = 0\nr = 0.5\nomega_h = 1\nomega_alpha = 1\n"
    "zeta_xi = -1": ["section.si.zeta_xi", "negative"],
    "[section.si]\nm = 1\nb = 1\nrho = 1\nx_cg = 1\nr = 0.5\nomega_h = 1\nomega_alpha = 1": [
        "section.si",
        "r_alpha",
        "definiteness",
    ],
    "[section.si]\nm = 1\nb = 1\nrho = 1\nx_cg = 0\nS = 0\nr = 1\nomega_h = 1\nomega_alpha = 1": [
        "section.si.x_cg and section.si.S",
        "both",
    ],
    "[section.si]\nm = 1\nb = 1e-200\nrho = 1\nx_cg = 0\nr = 1\nomega_h = 1\nomega_alpha = 1": [
        "section.si",
        "too small",
    ],
    "[section.si]\nm = -1\nb = 1\nrho = 1\nx_cg = 0\nr = 1\nomega_h = 1\nomega_alpha = 1": [
        "section.si.m",
        "positive",
    ],
    # not TOML
    "": ["is empty", "aeroflutter init"],
    "# nothing\n": ["is empty"],
    "[section": ["end of document", "not valid TOML"],
    "[section\n": ["line 1", "not valid TOML"],
    f"{SECTION}omega_bar = 1": ["given twice"],
    f"{SECTION}[section]\nmu = 1": ["line 3", "given twice"],
    "x = .5": ["line 1, column 5", "leading digit"],
    f"x = {'[' * 30000}": ["nested too deeply"],
    f"x = {'1' * 5000}": ["too many digits"],
    '"a\\nb" = 1\n[section]\nomega_bar = 1': ["a\\nb"],
}


@pytest.mark.parametrize(("text", "words"), BAD.items(), ids=range(len(BAD)))
def test_bad_file_is_told_what_is_wrong(tmp_path: Path, text: str, words: list[str]) -> None:
    [problem] = problems(tmp_path, text)
    assert all(word in problem for word in words), problem
    assert problem.isprintable()


def test_all_problems_are_reported_at_once(tmp_path: Path) -> None:
    text = """
        titel = "x"
        [section]
        mu = -3
        omegabar = 0.8
        x_alpha = 0.5
        r_alpha = 0.3
        zeta_xi = "no"
        zeta_alpha = nan
        [aerodynamics]
        a = [0.5, 0.6]
        b = [0.1, true]
        [spring]
        kind = "hysteresis"
        delta_v_deg = -1
        delta_h_deg = "a"
        gap_deg = 2
        v_off = 2
        [initial]
        alpha_deg = inf
        xi_rate = 1e308
    """
    found = {problem.partition(":")[0] for problem in problems(tmp_path, text)}
    assert found == {
        "titel",
        "section.omega_bar",
        "section.omegabar",
        "section.mu",
        "section.r_alpha",
        "section.zeta_xi",
        "section.zeta_alpha",
        "aerodynamics.a",
        "aerodynamics.b, value 2",
        "spring.delta_v_deg",
        "spring.delta_h_deg",
        "spring.gap_deg",
        "spring.v_off",
        "initial.alpha_deg",
        "initial.xi_rate",
    }


def test_a_wrong_type_hides_no_wrong_value_and_invents_none(tmp_path: Path) -> None:
    si = "[section.si]\nm = 'x'\nb = -1\nrho = 1\nx_cg = 5\nr = 1\nomega_h = 1\nomega_alpha = 1"
    assert {p.partition(":")[0] for p in problems(tmp_path, si)} == {
        "section.si.m",
        "section.si.b",
    }
    table = f"{SECTION}[spring]\nkind = 'table'\npitch_deg = [2, 1, 0]\nmoment_deg = [1, 'a', 3]"
    assert {p.partition(":")[0] for p in problems(tmp_path, table)} == {
        "spring.pitch_deg",
        "spring.moment_deg, value 2",
    }
    offset = f"{SECTION}x_alpha = 'a'\nr_alpha = 0.1"
    assert {p.partition(":")[0] for p in problems(tmp_path, offset)} == {"section.x_alpha"}


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"\x7fELF\x02\x01\x01\x00", "binary"),
        (SECTION.encode("utf-16"), "not UTF-8"),
        ("title = 'é'".encode("latin-1"), "not UTF-8"),
        (b"#" * (2 << 20), "larger than"),
    ],
)
def test_what_is_no_text_is_no_case(tmp_path: Path, data: bytes, words: str) -> None:
    [problem] = problems(tmp_path, data)
    assert words in problem


def test_what_cannot_be_opened(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for source, words in [
        (tmp_path, "is a directory"),
        ("run17", 'did you mean "run1'),
        ("nowhere.toml", "aeroflutter cases"),
        ("", "no such file"),
        ("a\0b", "cannot be read"),
        ("x" * 5000, "cannot be read"),
        ("two\nlines", "two\\nlines"),
        ("\udc80", "no such file"),
    ]:
        with pytest.raises(InputError) as caught:
            load_case(source)
        [problem] = caught.value.problems
        assert words in problem
        assert problem.isprintable()

    def refuse(*args: object) -> None:  # root may read everything, so no real file will do
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("builtins.open", refuse)
    with pytest.raises(InputError, match="permission"):
        load_case("secret.toml")


def test_a_device_without_end_is_read_no_further_than_a_case_can_be() -> None:
    with pytest.raises(InputError, match="larger than"):
        load_case("/dev/zero")


@settings(max_examples=2500)
@given(data=mangled_bytes)
@example(data=b"")
@example(data=VALID[0].encode())
def test_mangled_file_gives_a_case_or_lines_that_say_why(
    tmp_path_factory: pytest.TempPathFactory, data: bytes
) -> None:
    file = tmp_path_factory.getbasetemp() / "mangled.toml"
    file.write_bytes(data)
    try:
        case = load_case(file)
    except InputError as error:
        assert error.problems
        for problem in error.problems:
            assert problem.startswith(f"{file}: ")
            assert problem.isprintable()
    else:
        assert isinstance(case, Case)
        assert load_case(tomllib.loads(case.text)).text == case.text
        assert np.all(np.isfinite(case.family().at(1.0).A))


@given(st.dictionaries(st.text(max_size=8), st.floats() | st.text(max_size=8) | st.booleans()))
def test_overrides_give_a_case_or_lines_that_say_why(overrides: dict[str, object]) -> None:
    try:
        load_case("run14", overrides)
    except InputError as error:
        assert all(problem.isprintable() for problem in error.problems)
