"""Certificates of two springs at one speed: the checker, by formulas of this file, and mutants."""

from dataclasses import replace

import numpy as np
import pytest

from aeroflutter import TypicalSection, load_case
from aeroflutter.errors import InputError
from aeroflutter.guarantees.absence import several_at
from aeroflutter.guarantees.absence.certificate import Joint, Loop, Static
from aeroflutter.linear.rootlocus import flutter_speed
from aeroflutter.model.family import SectionModel
from aeroflutter.springs import Bilinear, Freeplay, Hysteresis

joint = pytest.importorskip("aeroflutter.guarantees.absence.joint_checker")
flint = pytest.importorskip("flint")

FLUTTER = flutter_speed(load_case("run14").family())
BOTH = SectionModel(TypicalSection(omega_bar=0.8), springs=("pitch", "heave"))
HALF = Bilinear(0.0, 0.5, -0.005, 0.01)  # half the slope inside a gap of 0.01 semi-chords


@pytest.fixture(scope="module")
def claim():
    found = several_at(BOTH.at(0.85 * FLUTTER), [Hysteresis(1.0, 0.25), HALF])
    assert found.certified
    return found.certificate


def refused(claim, why):
    with pytest.raises(joint.Refused, match=why):
        joint.check_joint(claim, 20_000)


def matrix(claim, omega):
    """The Hermitian matrix of Theorem 3, from the state matrices."""
    A, B, C = (np.array(one) for one in claim.matrices)
    p, q = np.array(
        [(0.0, 1.0) if isinstance(s, Loop) else (s.low, s.high) for s in claim.springs]
    ).T
    closed = A - B @ np.diag(q) @ C
    H = C @ np.linalg.solve(1j * omega * np.eye(len(A)) - closed, B * (q - p))
    D, K = np.array(claim.w) / (1j * omega) + claim.lam, np.zeros(2)
    for i, terms in enumerate(claim.terms):
        for t, c in terms:
            if isinstance(claim.springs[i], Loop):
                K[i] += c * np.sin(omega * t) / omega
            else:
                D[i] += c * (1.0 - np.exp(1j * omega * t) + 1j * omega * t) / omega**2
    M = D[:, None] * (H - np.eye(2))
    return 0.5 * (M + M.conj().T) - np.diag(K)


def test_it_accepts_run_14_with_a_gap_in_heave(claim):
    """Friction over gap 4.0 at 0.85 of the flutter speed, where marching finds rest."""
    assert joint.check_joint(claim) > 0
    for omega in np.geomspace(1e-3, 50.0, 400):
        assert np.linalg.eigvalsh(matrix(claim, omega)).max() < 0.0


@pytest.mark.parametrize("springs", [(Hysteresis(1.0, 0.25), HALF), (HALF, Hysteresis(1.0, 0.25)),
                                     (Freeplay(1.0), HALF)])  # fmt: skip
def test_the_form_is_the_determinant(springs):
    """For a multiplier of any numbers, whichever spring is the loop."""
    swapped = isinstance(springs[0], Bilinear)
    names = ("heave", "pitch") if swapped else ("pitch", "heave")
    system = SectionModel(TypicalSection(omega_bar=0.8, a_h=-0.4), springs=names).at(3.0)
    laws = tuple(
        Loop(delta_v=1.0, delta_h=0.25)
        if isinstance(one, Hysteresis)
        else Static(low=0.0, high=1.0)
        for one in springs
    )
    closed = system.closed(np.ones(2)).real
    H0 = -system.C @ np.linalg.solve(closed, system.B)
    w = (1.0, H0[0, 1] / H0[1, 0]) if not swapped else (H0[1, 0] / H0[0, 1], 1.0)
    A, B, C = (tuple(map(tuple, M.tolist())) for M in (system.A, system.B, system.C))
    few, signed = ((2.0, 0.01), (5.0, 0.02)), ((-3.0, 0.1), (0.4, 0.2))
    terms = tuple(few if isinstance(one, Loop) else signed for one in laws)
    claim = Joint(A=A, B=B, C=C, springs=laws, w=w, lam=(0.3, 0.2), terms=terms)
    form = joint._Form(claim)
    cap, flint.ctx.cap = flint.ctx.cap, 2
    try:
        for omega in (1e-3, 0.02, 0.3, 0.9, 2.0, 7.0):
            g = form._g(flint.arb_series([flint.arb(omega), 1]))
            E = float(form.forms[0](flint.arb(omega) ** 2).mid())
            expected = -np.linalg.det(matrix(claim, omega)).real
            assert float(g[0].mid()) / E**2 == pytest.approx(expected, rel=1e-6)
            step = 1e-6 * omega
            up, down = (form._g(flint.arb_series([flint.arb(omega + one), 1]))[0]
                        for one in (step, -step))  # fmt: skip
            assert float(g[1].mid()) == pytest.approx(
                float((up - down).mid()) / (2 * step), rel=1e-4
            )
            wide = form._g(flint.arb_series([flint.arb(omega, 0.2 * omega), 1]))
            assert wide[1].contains(g[1])
            assert wide[0].contains(up)
    finally:
        flint.ctx.cap = cap


def test_false_claims_are_refused(claim):
    (first, second), C = claim.terms, claim.C
    largest = max(range(len(first)), key=lambda i: abs(first[i][1]))
    t, c = first[largest]
    without = (*first[:largest], *first[largest + 1 :])
    for wrong, why in (
        ({"lam": (-claim.lam[0], claim.lam[1])}, "λ is not positive"),
        ({"lam": (claim.lam[0], 0.0)}, "λ is not positive"),
        ({"lam": (float("nan"), 1.0)}, "not finite"),
        ({"lam": (30.0 * claim.lam[0], claim.lam[1])}, "not negative"),
        ({"terms": (((-t, c), *without), second)}, "t > 0"),
        ({"terms": (((float("inf"), c), *without), second)}, "not finite"),
        ({"terms": (((t, -c), *without), second)}, "not negative"),
        ({"terms": (without, second)}, "not negative"),
        ({"terms": (first, ((2.0, -0.1), *second))}, "z ≥ 0"),
        ({"terms": (first,)}, "two springs"),
        ({"w": (-1.0, claim.w[1])}, "below w ΔV"),
        ({"w": (1.0, 0.1)}, "differ"),
        ({"springs": (Loop(delta_v=1.0, delta_h=0.26), claim.springs[1])}, "below w ΔV"),
        ({"springs": (claim.springs[0], Static(low=0.0, high=1.0))}, "not negative|differ"),
        ({"springs": (claim.springs[0], Static(low=1.0, high=0.5))}, "ordered slopes"),
        ({"C": C[:1]}, "two springs"),
    ):
        refused(replace(claim, **wrong), why)


def test_a_multiplier_of_one_speed_is_none_of_another(claim):
    for ratio, why in ((0.87, "not negative"), (1.01, "not Hurwitz")):
        system = BOTH.at(ratio * FLUTTER)
        A, B = (tuple(map(tuple, M.tolist())) for M in (system.A, system.B))
        refused(replace(claim, A=A, B=B), why)


def test_high_frequencies_are_looked_at(claim):
    """Terms that outweigh λ far beyond where the section moves."""
    refused(replace(claim, lam=(1e-9, claim.lam[1])), "not")


def test_round_trip_and_altered(claim, tmp_path):
    path = tmp_path / "two.json"
    claim.save(path)
    assert Joint.load(path) == claim
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("0.25", "0.24", 1), encoding="utf-8")
    with pytest.raises(InputError, match="altered"):
        Joint.load(path)


def test_three_springs_are_not_certified():
    from aeroflutter.model.system import System

    A = -np.diag([1.0, 2.0, 3.0])
    system = System(A, 0.1 * np.eye(3), np.eye(3), np.zeros(3), ("a", "b", "c"))
    found = several_at(system, [Freeplay(1.0)] * 3)
    assert found.holds
    assert not found.certified
