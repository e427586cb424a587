"""States of a model from elsewhere: hidden ones, others at every speed, one speed alone."""

import json

import bah
import control
import numpy as np
import pytest

from aeroflutter.case import load_case
from aeroflutter.cli import main
from aeroflutter.cli.import_ import _detuned
from aeroflutter.errors import InputError
from aeroflutter.linear.pk import PKOptions, pk_method
from aeroflutter.linear.rootlocus import root_locus
from aeroflutter.model.elsewhere.polynomial import PolynomialModel
from aeroflutter.model.elsewhere.sampled import SplinedModel
from aeroflutter.model.elsewhere.still import still_states
from aeroflutter.model.elsewhere.tracked import outputs_first, tracked
from aeroflutter.model.family import SectionModel
from aeroflutter.model.section import Scale, TypicalSection
from aeroflutter.model.system import System, inverse_transfer, inverse_transfer_gradient
from aeroflutter.orbits.describing import DescribingOptions, describing_curve

SCALE = Scale(0.5, 40.0)
SECTION = TypicalSection(omega_bar=0.6, zeta_alpha=0.01, zeta_xi=0.01, scale=SCALE)
MODEL = SectionModel(SECTION, springs=("pitch",))
U = np.linspace(1.0, 7.0, 41)
OSCILLATOR = np.array([[0.0, 1.0], [-900.0, 0.0]])
RIGID = np.array([[0.0, 1.0], [0.0, 0.0]])
FEW = DescribingOptions(points=12)


def variables():
    """The section in s, its speeds in m/s."""
    A, B, C, _ = MODEL.stack(U)
    rate = SCALE.velocity(U)[:, None, None] / SCALE.b
    return {
        "speeds": SCALE.velocity(U), "A": A * rate, "B": B * rate, "C": C[0], "time_unit": "s",
        "names": ["pitch"], "units": ["rad"], "semichord": SCALE.b,
    }  # fmt: skip


def joined(given, block, *, drive=0.0, show=0.0):
    """With a block of states that the spring drives, or that show in its twist."""
    k, n, m = *given["A"].shape[:2], len(block)
    A = np.zeros((k, n + m, n + m))
    A[:, :n, :n], A[:, n:, n:] = given["A"], block
    B, C = np.zeros((k, n + m, 1)), np.zeros((1, n + m))
    B[:, :n], B[:, -1], C[:, :n], C[:, n] = given["B"], drive, given["C"], show
    return given | {"A": A, "B": B, "C": C}


def case_of(tmp_path, given, **more):
    np.savez(tmp_path / "m.npz", **given)
    model = {"kind": "state-space", "file": str(tmp_path / "m.npz")} | more
    return load_case({"model": model, "spring": {"kind": "freeplay", "gap_deg": 1.0}})


@pytest.fixture(scope="module")
def onset():
    """Of the section by describing functions, m/s."""
    speed = describing_curve(case_of_section(), FEW).onset.speed
    return SCALE.velocity(speed)


def case_of_section():
    return load_case(
        {
            "section": {"omega_bar": 0.6, "zeta_alpha": 0.01, "zeta_xi": 0.01},
            "spring": {"kind": "freeplay", "gap_deg": 1.0},
        }
    )


@pytest.mark.parametrize(
    ("block", "ends"),
    [
        (OSCILLATOR, {}),
        (OSCILLATOR, {"drive": 3.0}),
        (OSCILLATOR, {"show": 0.5}),
        (RIGID, {"drive": 3.0}),
        (RIGID, {"show": 0.5}),
        (np.zeros((1, 1)), {}),
    ],
    ids=["apart", "driven", "shown", "rigid driven", "rigid shown", "constant"],
)
def test_neutral_states_off_the_loop_are_left_out(tmp_path, block, ends, onset):
    case = case_of(tmp_path, joined(variables(), block, **ends))
    assert len(case.model().state_names) == 6
    assert "have no part in the loop of the springs: left out" in case.imported.notes[-1]
    curve = describing_curve(case, FEW)
    assert curve.onset.speed == pytest.approx(onset, rel=1e-5)


@pytest.mark.parametrize(
    ("block", "ends"),
    [
        (OSCILLATOR, {"drive": 3.0, "show": 0.5}),
        (OSCILLATOR - 0.1 * np.eye(2), {"drive": 3.0}),
        (OSCILLATOR + 0.1 * np.eye(2), {}),
    ],
    ids=["on the loop", "damped", "growing"],
)
def test_all_other_states_stay(tmp_path, block, ends):
    case = case_of(tmp_path, joined(variables(), block, **ends))
    assert case.model().state_names == tuple(f"x{i + 1}" for i in range(8))
    assert case.imported.notes == ()


def test_a_block_is_off_the_loop_by_the_ways_through_all_others():
    chain = np.zeros((1, 4, 4))  # 1 drives 2 and 3, 3 shows; 4 drives 3 and nothing drives it
    chain[0, 1, 0] = chain[0, 2, 0] = chain[0, 2, 3] = 1.0
    B, C = np.eye(4)[None, :, :1], np.eye(4)[None, 2:3]
    assert still_states(chain, B, C).tolist() == [False, True, False, True]
    later = np.concatenate([chain, chain])
    later[1, 0, 1] = 1.0  # at the second speed 2 acts on 1
    assert still_states(later, np.repeat(B, 2, 0), np.repeat(C, 2, 0)).tolist()[1] is False


def test_the_inverse_transfer_is_finite_at_a_hidden_root():
    """Equal to that without the hidden mode: the mean over a circle is as good as round-off."""
    rng = np.random.default_rng(4)
    A, dA = rng.normal(size=(2, 4, 4))
    B, dB = rng.normal(size=(2, 4, 1))
    C = rng.normal(size=(1, 4))
    for block, s in ((OSCILLATOR, 30j), (RIGID, 0.0)):
        for drive, show in ((3.0, 0.0), (0.0, 0.5)):
            A2, dA2 = (np.zeros((6, 6)) for _ in range(2))
            A2[:4, :4], A2[4:, 4:], dA2[:4, :4] = A, block, dA
            B2, dB2 = np.vstack([B, [[0.0], [drive]]]), np.vstack([dB, np.zeros((2, 1))])
            C2 = np.hstack([C, [[show, 0.0]]])
            found = inverse_transfer_gradient(A2, B2, C2, dA2, dB2, 0 * C2, s)
            wanted = inverse_transfer_gradient(A, B, C, dA, dB, 0 * C, s)
            for ours, theirs in zip(found, wanted, strict=True):
                assert ours == pytest.approx(theirs, rel=1e-8)
            assert inverse_transfer(A2, B2, C2, s) == pytest.approx(wanted[0], rel=1e-8)


def test_the_inverse_transfer_of_nothing_is_no_number():
    C = np.array([[0.0, 1.0]])
    assert np.isnan(inverse_transfer(-np.eye(2), np.array([[1.0], [0.0]]), C, 1j)).all()


def turned(given, turn):
    """In other states at every speed."""
    A, B, C = [], [], []
    for i, (a, b) in enumerate(zip(given["A"], given["B"], strict=True)):
        T = turn(i, len(a))
        A.append(T @ a @ np.linalg.inv(T))
        B.append(T @ b)
        C.append(given["C"] @ np.linalg.inv(T))
    return given | {"A": A, "B": B, "C": C}


def test_any_states_give_the_cycles_of_the_section(tmp_path, onset):
    """The row of the twist differs from speed to speed, and every analysis takes one."""
    rng = np.random.default_rng(1)
    turn = {
        "permuted": lambda _, n: np.eye(n)[rng.permutation(n)],
        "any": lambda _, n: rng.normal(size=(n, n)),
        "slowly": lambda i, n: np.eye(n) + 0.01 * i * np.eye(n, k=1),  # entries are splined here
    }
    given = joined(variables(), 3.0 * OSCILLATOR, drive=3.0)  # of which the twist knows nothing
    for name, of in turn.items():
        case = case_of(tmp_path, turned(given if name == "any" else variables(), of))
        assert len(case.model().state_names) == 6
        found = describing_curve(case, FEW).onset
        assert found.speed == pytest.approx(onset, rel=1e-4), name
        C = case.imported.family.stack(np.array([25.0, 90.0]))[2]
        assert np.array_equal(C[0], C[1])


def test_outputs_first_keep_the_transfer_functions_and_refuse_rows_that_depend():
    rng = np.random.default_rng(2)
    A, B, C = rng.normal(size=(3, 5, 5)), rng.normal(size=(3, 5, 2)), rng.normal(size=(3, 2, 5))
    C += 4.0 * rng.normal(size=(2, 5))
    A2, B2, C2 = outputs_first(A, B, C)
    for one in zip(A, B, C, A2, B2, C2, strict=True):
        wanted, found = (inverse_transfer(*one[i : i + 3], 0.7j) for i in (0, 3))
        np.testing.assert_allclose(found, wanted, rtol=1e-9)
    with pytest.raises(InputError, match="rows depend on one another"):
        outputs_first(A, B, np.repeat(C[:, :1], 2, axis=1))
    with pytest.raises(InputError, match="C: must be the same at every speed"):
        SplinedModel([1.0, 2.0, 3.0], A, B, C)
    with pytest.raises(InputError, match="C: must not depend on the speed"):
        PolynomialModel(A=A, B=B, C=C, search_range=(1.0, 2.0))


def test_a_residue_that_passes_through_zero_is_followed():
    """Of one mode the drive changes its sign: its square root would have an edge."""
    speeds = np.linspace(-1.0, 1.0, 9)
    poles = np.array([[-0.1, 1.0], [-1.0, -0.1]])
    A = np.array([np.kron(np.diag([1.0, 2.0]), poles)] * 9)
    B = np.zeros((9, 4, 1))
    B[:, 0, 0], B[:, 2, 0] = 1.0, speeds
    C = np.broadcast_to([[1.0, 0.0, 1.0, 0.0]], (9, 1, 4))
    model = SplinedModel(speeds + 3.0, *outputs_first(*tracked(speeds, A + B @ C, B, C)))
    for V in (-0.06, 0.04, 0.43):
        b = np.array([[1.0], [0.0], [V], [0.0]])
        wanted = inverse_transfer(A[0] + b @ C[0], b, C[0], 0.5j)
        assert model.at(V + 3.0).inverse_transfer(0.5j) == pytest.approx(wanted, rel=1e-9)


IDLE = {
    "row": ({"C": np.zeros((1, 6))}, "C: the row of pitch is zero at every speed"),
    "column": ({"B": np.zeros((41, 6, 1))}, "B: the column of pitch is zero at every speed"),
    "milliseconds": ({"time_unit": "ms"}, 'time_unit: must be "s" or "semichord", not \'ms\''),
    "modal form": ({"A": 1j * np.ones((41, 6, 6))}, "A: is complex; real numbers are due"),
}


@pytest.mark.parametrize("name", IDLE)
def test_what_cannot_be_meant_gives_one_line(tmp_path, name):
    change, words = IDLE[name]
    with pytest.raises(InputError, match=words) as caught:
        case_of(tmp_path, variables() | change)
    assert len(caught.value.problems) == 1


def test_the_last_speed_is_one_of_the_model(tmp_path):
    """exp(log(V)) may be more than V."""
    family = case_of(tmp_path, variables()).imported.family
    assert np.array_equal(family.at(140.0 * (1 + 1e-12)).A, family.at(140.0).A)
    with pytest.raises(InputError, match="must lie between 20 and 140"):
        family.at(140.1)


def test_speeds_that_are_far_apart_are_told(tmp_path):
    """One speed is left out at a time; of two there is nothing to leave out."""
    given = variables()
    words = {}
    for step in (1, 8, 40):
        few = given | {name: given[name][::step] for name in ("speeds", "A", "B")}
        words[step] = case_of(tmp_path, few).imported.notes
    assert words[1] == ()
    assert "the speeds are far apart: without 68 m/s" in words[8][0]
    assert words[40] == ()


def test_a_model_of_one_speed_tells_its_cycles_there(tmp_path, capsys):
    given = variables()
    case_of(tmp_path, given | {name: given[name][20] for name in ("speeds", "A", "B")})
    file = tmp_path / "c.toml"
    file.write_text(
        '[model]\nkind = "state-space"\nfile = "m.npz"\n[spring]\nkind = "freeplay"\ngap_deg = 1\n'
    )
    quick = ["--depth", "0", "--simulations", "0", "--points", "4", "--json"]
    assert main(["lco", str(file), *quick]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["onset"] is None
    (cycle,) = found["cycles"]
    assert cycle["speed"] == given["speeds"][20]
    assert cycle["k"] == pytest.approx(2 * np.pi / cycle["period"] * SCALE.b / cycle["speed"])
    assert root_locus(load_case(file)).flutter is None


def test_modes_that_no_air_touches_are_no_error_of_an_approximation():
    """They are none of its states, and `import` asks how far its frequencies are off."""
    modal = load_case({"model": bah.MODEL}).imported.modal
    found = pk_method(modal.whole(), PKOptions(low=100.0, high=450.0, points=8))
    assert np.any(np.abs(found.roots.real) < 1e-12)
    assert _detuned(found, modal, 450.0) < 0.02


def test_systems_of_python_control_with_several_springs():
    """There and back; what is none, in discrete time or with feedthrough is one line."""
    rng = np.random.default_rng(7)
    A, B, C = rng.normal(size=(4, 4)), rng.normal(size=(4, 2)), rng.normal(size=(2, 4))
    system = System.from_control(control.ss(A, B, C, 0), ("inner", "outer"), ("rad", "m"))
    again = System.from_control(system.to_control())
    s = np.array([0.3j, 2.0j])
    np.testing.assert_allclose(np.moveaxis(again.to_control()(s), 2, 0), system.transfer(s))
    assert (system.names, system.units) == (("inner", "outer"), ("rad", "m"))
    for bad, words in (
        (control.ss(A, B, C, 0, 0.01), "must be in continuous time"),
        (control.ss(A, B, C, 0, True), "must be in continuous time"),
        (control.ss(A, B, C, np.eye(2)), "D must be zero"),
        (control.ss(A, B[:, :1], C, 0), "as many inputs as outputs"),
        (control.tf([1.0], [1.0, 0.2, 1.0]), "must be a StateSpace"),
    ):
        with pytest.raises(InputError, match=words) as caught:
            System.from_control(bad)
        assert len(caught.value.problems) == 1
