"""The committed sets are what the fit finds, and a set that says too much of itself is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from derive import indicial
from derive.proofs.same import ProofError


@pytest.mark.parametrize("terms", [4, 6])
def test_fit_finds_the_committed_set(terms: int) -> None:
    """Rates are flat in the error, so their digits are not what is fitted: the error is."""
    [item] = [one for one in indicial.SETS if len(one.a) == terms]
    a, b = indicial.fit(terms)
    np.testing.assert_allclose(a, np.array(item.a, dtype=float), rtol=0.01)
    np.testing.assert_allclose(b, np.array(item.b, dtype=float), rtol=0.01)
    again = replace(item, a=tuple(map(repr, a)), b=tuple(map(repr, b)))
    committed = indicial.greatest_error(item)
    assert indicial.greatest_error(again) == pytest.approx(committed, rel=5e-3)


@pytest.mark.parametrize(
    "change", [{"greatest_error": "0.0012"}, {"greatest_error": "0.002"}, {"b": ("0.005",) * 4}]
)
def test_wrong_claims_are_noticed(
    change: dict[str, object], monkeypatch: pytest.MonkeyPatch
) -> None:
    wrong = replace(indicial.SETS[1], **change)
    monkeypatch.setattr(indicial, "SETS", (wrong,))
    with pytest.raises(ProofError, match="four-term: error"):
        indicial.check_sets()


def test_wrong_start_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    jones = indicial.SETS[0]
    wrong = replace(jones, a=("0.165", "0.3350001"))
    monkeypatch.setattr(indicial, "SETS", (wrong,))
    with pytest.raises(ProofError, match="not at 1/2"):
        indicial.check_sets()
