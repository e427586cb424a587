"""The hash of a study covers what computes its numbers, and nothing that only shows them."""

import ast
import json
import shutil
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest

import aeroflutter
import generated
from aeroflutter.studies.maps import fingerprint
from aeroflutter.studies.maps.fingerprint import KEEPING, closure, code_hash

MAP = ("aeroflutter.studies.maps.flutter_map", "aeroflutter.studies.cases")
SWEEP = ("aeroflutter.studies.maps.sweep", "aeroflutter.studies.sampled")
EXHIBITS = ("aeroflutter.reproduce.press",)

PRESENTING = ("aeroflutter.cli", "aeroflutter.plots", "aeroflutter.results", "aeroflutter.files")
"""Packages that parse, print, draw and save what a map or a sweep has found."""

DATA = {"aeroflutter.case.cases"}
"""Packages that hold text: that of a case is in the identity of its study as it is."""

MAPPED = """
from aeroflutter.case import load_case
from aeroflutter.motion import SimulateOptions
from aeroflutter.studies.cases import CaseCells
from aeroflutter.studies.maps import Axis, Grid
from aeroflutter.studies.maps.flutter_map import MapOptions, MapStudy
case = load_case({0!r})
grid = Grid(Axis("speed_ratio", [0.95, 0.96]), Axis({1!r}, {2}))
options = MapOptions(march=SimulateOptions(engine={3!r}, duration=50.0), refine=0.01)
study = MapStudy(CaseCells(case.text, case.source, grid), options)
study.warm_up()
"""
SWEPT = """
from aeroflutter.case import load_case
from aeroflutter.studies.maps.sampling import parse_distribution, sample
from aeroflutter.studies.maps.sweep import SweepOptions, SweepStudy
from aeroflutter.studies.sampled import CaseModel
case = load_case({0!r})
values = sample({{{1!r}: parse_distribution({2!r})}}, 2, 0, "random")
model = CaseModel(case.text, case.source, "speed_ratio", 0.97)
study = SweepStudy(model, values, SweepOptions())
study.warm_up()
"""
MADE = """
from pathlib import Path
from aeroflutter.reproduce.catalogue import EXHIBITS
from aeroflutter.reproduce.press import reproduce
chosen = [exhibit for exhibit in EXHIBITS if exhibit.number == {0!r}]
(made,) = reproduce(chosen, Path({1!r}))
assert made.file.is_file()
"""


@pytest.mark.parametrize(
    ("text", "roots"),
    [
        (MAPPED.format("run14", "initial.alpha_deg", [1.0, 2.0], "exact"), MAP),
        (MAPPED.format("freeplay-02", "section.mu", [99.0, 100.0], "houbolt"), MAP),
        (MAPPED.format("cubic-02", "initial.alpha_deg", [1.0, 2.0], "exact"), MAP),
        (SWEPT.format("run14", "section.mu", "uniform(90,110)"), SWEEP),
        (SWEPT.format("cubic-02", "speed_ratio", "uniform(0.9,1)"), SWEEP),
        (MADE.format("4.1", "out"), EXHIBITS),
    ],
    ids=["exact", "houbolt", "smooth", "sampled section", "sampled speed", "exhibit"],
)
def test_all_that_is_imported_while_computing_is_in_the_hash(text, roots, tmp_path):
    """An import that reading does not find, as by a name that is put together, is missed here."""
    text += "\nimport json, sys\nprint(json.dumps(list(sys.modules)))"
    words = [sys.executable, "-c", text]
    done = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    imported = {name for name in json.loads(done.stdout) if name.split(".")[0] == "aeroflutter"}
    assert imported > set(roots)
    assert imported - set(closure(*roots)[0]) <= DATA


@pytest.mark.parametrize("roots", [MAP, SWEEP])
def test_what_only_shows_is_not_in_the_hash_of_a_study(roots):
    shows = (*PRESENTING, "aeroflutter.report", "aeroflutter.reproduce")
    assert [name for name in closure(*roots)[0] if name.startswith(shows)] == []


def test_no_module_that_computes_imports_by_a_name_that_is_put_together():
    dynamic = {
        name
        for name, file in closure(*MAP, *SWEEP, *EXHIBITS)[0].items()
        for node in ast.walk(ast.parse(file.read_bytes()))
        if isinstance(node, ast.Name | ast.Attribute)
        and getattr(node, "id", getattr(node, "attr", "")) in ("import_module", "__import__")
    }
    # The lazy names of the package, those of 0.1.0, and what compiles kernels beforehand.
    assert dynamic <= {"aeroflutter", "aeroflutter._former", "aeroflutter.kernels.warmup"}


def test_the_libraries_that_compute_count_with_their_versions(monkeypatch):
    assert closure(*MAP)[1] - KEEPING == {"numpy", "scipy", "numba", "llvmlite", "control"}
    assert closure(*SWEEP)[1] - KEEPING == {"numpy", "scipy", "numba", "llvmlite", "control"}
    assert "matplotlib" in closure(*EXHIBITS)[1] - KEEPING
    version, now = metadata.version, code_hash(*MAP)
    for library, counts in (("scipy", True), ("llvmlite", True), ("zarr", False)):
        other = lambda name, other=library: "0" if name == other else version(name)  # noqa: E731
        monkeypatch.setattr(fingerprint.metadata, "version", other)
        assert (code_hash.__wrapped__(*MAP) != now) is counts


@pytest.fixture
def copy(tmp_path, monkeypatch):
    """A copy of the package as it is installed, of which the hashes are then taken."""
    package = tmp_path / "aeroflutter"
    leave = shutil.ignore_patterns("__pycache__")
    shutil.copytree(Path(aeroflutter.__file__).parent, package, ignore=leave)
    shutil.copytree(Path(generated.__file__).parent, package / "generated", ignore=leave)
    places = {"aeroflutter": package, "aeroflutter.generated": package / "generated"}
    monkeypatch.setattr(fingerprint.resources, "files", places.__getitem__)
    return package


def hashes():
    """The hashes of a map, a sweep and an exhibit."""
    return [code_hash.__wrapped__(*roots) for roots in (MAP, SWEEP, EXHIBITS)]


@pytest.mark.parametrize(
    ("name", "changed"),
    [
        ("linear/modes.py", "map sweep exhibit"),
        ("case/build.py", "map sweep exhibit"),
        ("studies/cases.py", "map sweep"),
        ("studies/sampled.py", "sweep"),
        ("generated/section.py", "map sweep exhibit"),
        ("motion/_kernel_houbolt.py", "map sweep exhibit"),
        ("kernels/decorator.py", "map sweep exhibit"),
        ("orbits/continuation/newton.py", "sweep exhibit"),
        ("orbits/cycles/shooting.py", "exhibit"),
        ("plots/maps.py", "exhibit"),
        ("cli/map.py", ""),
        ("cli/__init__.py", ""),
        ("cli/sweep.py", ""),
        ("results/dataset.py", "exhibit"),  # figures take their headings from the results
        ("report/page.py", ""),
    ],
)
def test_the_hash_changes_with_what_computes_alone(copy, name, changed):
    before = hashes()
    with (copy / name).open("a") as file:
        file.write("\n# changed\n")
    after = hashes()
    names = ("map", "sweep", "exhibit")
    different = [n for n, a, b in zip(names, before, after, strict=True) if a != b]
    assert " ".join(different) == changed


def test_imports_are_found_wherever_they_are(tmp_path, monkeypatch):
    text = """
from typing import TYPE_CHECKING
if TYPE_CHECKING:
    from aeroflutter.plots import maps
else:
    from aeroflutter.linear import modes
def late():
    try:
        import aeroflutter.orbits.continuation.walk as walk, control
    except ImportError:
        from aeroflutter import Hysteresis
    match walk:
        case 1:
            with walk:
                from aeroflutter.model.section import TypicalSection
"""
    (tmp_path / "__init__.py").write_text("")
    (tmp_path / "root.py").write_text(text)
    real = fingerprint._file
    mine = {"": tmp_path / "__init__.py", "root": tmp_path / "root.py"}
    monkeypatch.setattr(fingerprint, "_file", lambda name: mine.get(name) or real(name))
    modules, libraries = closure("aeroflutter.root", "somebody.else")
    for name in ("linear.modes", "orbits.continuation.walk", "orbits", "springs", "model.section"):
        assert f"aeroflutter.{name}" in modules
    assert not [name for name in modules if "plots" in name]
    assert {"control", "somebody"} <= libraries
    assert "typing" not in libraries
