"""Case files of sections with a flap, and of springs in other coordinates than pitch."""

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest

from aeroflutter.case.case import load_case
from aeroflutter.errors import InputError
from aeroflutter.linear.rootlocus import root_locus
from aeroflutter.model.lure import SectionFamily
from aeroflutter.model.section import Flap
from aeroflutter.springs import Freeplay, Hysteresis, Linear, Table

DEGREE = math.pi / 180
SECTION = "[section]\nomega_bar = 0.8\n"

FLAP = """
[flap]
hinge = 0.5
x_beta = 0.02
r_beta = 0.1
omega_beta = 2.0
"""

WING_SI = """
[section.si]
m = 2.0
b = 0.2
rho = 1.2
x_cg = 0.03
r = 0.1
K_h = 3000
K_alpha = 60
"""

FLAP_SI = """
[flap]
hinge = 0.5
[flap.si]
S_beta = 0.004
I_beta = 0.0004
K_beta = 4.0
"""


def test_flap_of_a_case_and_its_motion() -> None:
    keys = "zeta_beta = 0.01\n[initial]\nbeta_deg = 3\nbeta_rate_deg = -1"
    case = load_case(tomllib.loads(SECTION + FLAP + keys))
    assert case.section.flap == Flap(
        hinge=0.5, x_beta=0.02, r_beta=0.1, omega_beta=2.0, zeta_beta=0.01
    )
    assert case.initial.beta == 3 * DEGREE
    assert case.initial.beta_rate == -1 * DEGREE
    assert load_case(tomllib.loads(case.text)) == case
    assert case.family().at(2.0).system.names == ("pitch",)


def test_conner() -> None:
    case = load_case("conner")
    system = case.family().at(2.0)
    assert (system.name, system.unit) == ("flap", "rad")
    assert case.spring == Freeplay(4.24 * DEGREE)
    assert case.section.damping == "modal"
    assert case.section.heave_mass == pytest.approx((1.558 + 2 * 0.47485 / 0.52) / 1.558, rel=1e-6)
    flutter = root_locus(case.family()).flutter
    assert case.section.scale.velocity(flutter.speed) == pytest.approx(23.947, abs=5e-4)


def test_si_flap_and_dampers() -> None:
    text = FLAP_SI + WING_SI + "c_h = 3.0\nc_alpha = 0.02\nc_beta = 0.001"
    case = load_case(tomllib.loads(text))
    section = case.section
    assert section.zeta_xi == pytest.approx(3.0 / (2 * math.sqrt(3000 * 2.0)))
    assert section.zeta_alpha == pytest.approx(0.02 / (2 * math.sqrt(60 * 0.02)))
    assert section.flap.zeta_beta == pytest.approx(0.001 / (2 * math.sqrt(4.0 * 0.0004)))
    assert section.flap.x_beta == pytest.approx(0.004 / (2.0 * 0.2))
    assert load_case(tomllib.loads(case.text)).section == section


def test_springs_in_their_coordinates() -> None:
    text = f"""{SECTION}{FLAP}
        [[spring]]
        at = "heave"
        kind = "freeplay"
        gap = 0.02
        [[spring]]
        at = "flap"
        kind = "hysteresis"
        delta_v_deg = 1
        delta_h_deg = 0.5
        stiffness = 0.8
        [[spring]]
        kind = "linear"
        stiffness = 0.5
    """
    case = load_case(tomllib.loads(text))
    assert [(item.at, item.stiffness) for item in case.springs] == [
        ("heave", 1.0),
        ("flap", 0.8),
        ("pitch", 0.5),
    ]
    assert case.spring == Freeplay(0.02)
    assert case.springs[1].spring == Hysteresis(DEGREE, 0.5 * DEGREE)
    model = case.model()
    assert (model.springs, model.stiffness) == (("heave", "flap"), (1.0, 0.8))
    assert model.linear == {"pitch": 0.5}
    assert load_case(tomllib.loads(case.text)) == case
    with pytest.raises(InputError, match=r"there are 2 that are not linear \(heave and flap\)"):
        case.family()
    changed = case.replace("spring.flap.delta_h_deg", 0.7)
    assert changed.springs[1].spring == Hysteresis(DEGREE, 0.7 * DEGREE)
    assert case.replace("spring.1.delta_h_deg", 0.7) == changed
    other = case.with_overrides({"spring.heave.gap": 3.0, "spring.flap.kind": "linear"})
    assert other.springs[1] == (Linear(), "flap", 0.8)
    assert other.family().at(2.0).name == "heave"
    with pytest.raises(InputError, match=r"spring.gap: there are 3 springs; name one"):
        case.replace("spring.gap", 1.0)
    with pytest.raises(InputError, match=r"is no spring; those there are: spring.heave"):
        case.replace("spring.3.gap", 1.0)


def test_springs_that_share_a_coordinate() -> None:
    one = '[[spring]]\nkind = "freeplay"\ngap_deg = 1\nstiffness = 0.4\n'
    case = load_case(tomllib.loads(f'{SECTION}{one}[[spring]]\nkind = "linear"\nstiffness = 0.6'))
    assert (case.model().springs, case.model().linear) == (("pitch",), {"pitch": 0.6})
    closed = case.family().at(2.0).closed(1.0)
    plain_section = load_case(tomllib.loads(SECTION)).family().at(2.0).closed(1.0)
    np.testing.assert_allclose(closed, plain_section, atol=1e-14)
    assert case.replace("spring.0.gap_deg", 2).spring == Freeplay(2 * DEGREE)


def test_one_spring_as_a_list_is_the_table() -> None:
    keys = 'kind = "freeplay"\ngap_deg = 1'
    table = load_case(tomllib.loads(f"{SECTION}[spring]\n{keys}"))
    entry = load_case(tomllib.loads(f"{SECTION}[[spring]]\n{keys}"))
    assert entry.springs == table.springs
    assert entry.replace("spring.gap_deg", 2) == entry.replace("spring.pitch.gap_deg", 2)
    assert isinstance(entry.family(), SectionFamily)


def test_table_of_a_heave_spring() -> None:
    keys = 'at = "heave"\nkind = "table"\ndisplacement = [-1, 0, 1]\nforce = [-2, 0, 2]'
    case = load_case(tomllib.loads(f"{SECTION}[spring]\n{keys}"))
    assert case.spring == Table((-1.0, 0.0, 1.0), (-2.0, 0.0, 2.0))


BAD_FLAPS = {
    f'{SECTION}[spring]\nat = "flap"\nkind = "linear"': ["spring.at", "add a table [flap]"],
    f'{SECTION}[spring]\nat = "yaw"\nkind = "linear"': ["spring.at", '"pitch", "heave", "flap"'],
    f'{SECTION}[spring]\nstiffness = 0\nkind = "linear"': ["spring.stiffness", "positive"],
    f'{SECTION}[spring]\nat = "heave"\nkind = "freeplay"\ngap_deg = 1\ngap = 1': ["spring.gap_deg"],
    f"spring = []\n{SECTION}": ["spring", "empty list"],
    f"{SECTION}[initial]\nbeta_deg = 1": ["initial.beta_deg"],
    f"{SECTION}heave_mass = 0.5": ["section.heave_mass", "at least 1"],
    f'{SECTION}damping = "rayleigh"': ["section.damping", '"coordinate" or "modal"'],
    SECTION + FLAP.replace("0.5", "1.5"): ["flap.hinge", "between -1 and 1"],
    SECTION + FLAP.replace("0.02", "0.2"): ["flap", "no flap of this section"],
    SECTION + FLAP.replace("omega_beta = 2.0", ""): ["flap.omega_beta", "missing"],
    SECTION + FLAP_SI: ["flap.si", "needs the section in [section.si]"],
    FLAP_SI + "[section.si]\nc_beta = 1\n" + WING_SI[14:] + "zeta_xi = 'a'": ["section.si.zeta_xi"],
    WING_SI + "c_beta = 0.1": ["section.si.c_beta", "add a table [flap]"],
    FLAP_SI.replace("hinge = 0.5", "hinge = 0.5\nr_beta = 1") + WING_SI: ["flap.r_beta", "follows"],
    FLAP_SI.replace("K_beta = 4.0", "") + WING_SI: ["flap.si.K_beta and flap.si.omega_beta"],
    FLAP_SI + WING_SI + "m_heave = 1": ["section.si.m_heave", "at least m"],
    WING_SI + "c_h = 1\nzeta_xi = 1": ["zeta_xi", "c_h", "got both"],
    FLAP_SI + WING_SI + "c_h = 1\n[section]\ndamping = 'modal'": ["damping", "no dampers"],
}


@pytest.mark.parametrize(("text", "words"), BAD_FLAPS.items(), ids=range(len(BAD_FLAPS)))
def test_bad_flap_is_told_what_is_wrong(tmp_path: Path, text: str, words: list[str]) -> None:
    file = tmp_path / "bad.toml"
    file.write_text(text)
    with pytest.raises(InputError) as caught:
        load_case(file)
    [problem] = caught.value.problems
    assert all(word in problem for word in words), problem
