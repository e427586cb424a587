"""Names of 0.1.0 go on working and say what they are today."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec

import pytest

from aeroflutter import _former


@pytest.mark.parametrize("package", ["aeroflutter.cycles", "aeroflutter.orbits.cycles"])
def test_the_tolerance_study_is_still_found_among_the_cycles(package: str) -> None:
    today = import_module("aeroflutter.studies.tolerance")
    with pytest.warns(DeprecationWarning, match=r"aeroflutter\.studies\.tolerance now"):
        assert import_module("aeroflutter.orbits.cycles").least_friction is today.least_friction
    with pytest.warns(DeprecationWarning, match=r"aeroflutter\.(studies\.tol|orbits\.cyc)"):
        assert import_module(f"{package}.tolerance") is today


def test_a_name_that_never_was_is_not_found() -> None:
    with pytest.raises(AttributeError, match="nothing"):
        _ = import_module("aeroflutter.orbits.cycles").nothing
    with pytest.raises(ModuleNotFoundError):
        import_module("aeroflutter.cycles.nothing")
    with pytest.raises(ModuleNotFoundError):
        import_module("aeroflutter.nothing.tolerance")


def test_modules_of_others_keep_their_names() -> None:
    spec = find_spec("derive.describing")
    assert spec is not None
    assert spec.name == "derive.describing"
    assert _former.FormerNames().find_spec("others.describing", None) is None
