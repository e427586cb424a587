"""Every step of the derivation is proved, and the proofs notice when a step is wrong."""

from __future__ import annotations

from dataclasses import replace

import pytest
import sympy as sp

from derive import describing, houbolt
from derive.build import PROOFS
from derive.proofs import houbolt as houbolt_proofs
from derive.proofs import section, springs
from derive.proofs.same import Proof, ProofError, check_numbers, check_same

ALL = [proof for group in PROOFS.values() for proof in group]


@pytest.mark.parametrize("proof", ALL, ids=lambda proof: proof.name.replace(" ", "-"))
def test_step_is_proved(proof: Proof) -> None:
    proof.run()


def test_names_are_unique() -> None:
    assert len({proof.name for proof in ALL}) == len(ALL)


def test_a_difference_is_named_and_shown() -> None:
    x, y = sp.symbols("x y")
    check_same("binomial", (x + y) ** 2, x**2 + 2 * x * y + y**2)
    check_same("fractions", 1 / x - 1 / y, (y - x) / (x * y))
    with pytest.raises(ProofError, match=r"binomial: entry \(0, 0\) differs by -?2\*x\*y"):
        check_same("binomial", (x + y) ** 2, x**2 + y**2)
    with pytest.raises(ProofError, match="shapes"):
        check_same("matrices", sp.eye(2), sp.eye(3))
    with pytest.raises(ProofError, match=r"numbers: differs by 0\.1"):
        check_numbers("numbers", [1.0, 2.1], [1, 2])
    with pytest.raises(ProofError, match="2 numbers against 1"):
        check_numbers("numbers", [1.0, 2.1], [1])


def test_wrong_loop_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    right = describing.hysteresis()
    for name in ("F0", "n_p", "n_q"):
        wrong = replace(right, **{name: getattr(right, name) + describing.DELTA_V / 100})
        with monkeypatch.context() as patch:
            patch.setattr(describing, "hysteresis", lambda wrong=wrong: wrong)
            with pytest.raises(ProofError):
                springs.hysteresis_loop()
            with pytest.raises(ProofError):
                springs.published_hysteresis()


def test_wrong_corner_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    right = describing.corner()
    for name in vars(right):
        wrong = replace(right, **{name: 2 * getattr(right, name)})
        with monkeypatch.context() as patch:
            patch.setattr(describing, "corner", lambda wrong=wrong: wrong)
            with pytest.raises(ProofError):
                springs.corner_integrals()


@pytest.mark.parametrize("field", ["slopes", "offsets", "breaks"])
def test_law_that_jumps_is_refused(field: str) -> None:
    law = describing.BILINEAR
    values = list(getattr(law, field))
    values[0] = values[0] + sp.Symbol("error")
    with pytest.raises(ValueError, match="jumps"):
        replace(law, **{field: tuple(values)})


def test_wrong_lag_state_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    def wrong(*arguments: object) -> object:
        state = section_first_order(*arguments)
        return replace(state, A=state.A.subs(sp.Symbol("b_1", positive=True), 1))

    section_first_order = section.first_order
    monkeypatch.setattr(section, "first_order", wrong)
    with pytest.raises(ProofError, match="det"):
        section.characteristic_polynomial()


def test_wrong_difference_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    # the first-order backward difference in place of the third-order one
    monkeypatch.setattr(houbolt, "difference_weights", lambda order: [0, 0, -1, 1])
    with pytest.raises(ProofError, match="order 1"):
        houbolt_proofs.difference_weights()
