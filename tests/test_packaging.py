"""What is installed: the wheel's contents, the public names, the locked requirements."""

import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from importlib import metadata
from pathlib import Path

import pytest

import aeroflutter

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Names of the files in a wheel built from a copy of the sources."""
    copy = tmp_path_factory.mktemp("sources")
    skip = shutil.ignore_patterns("__pycache__", "*.egg-info")
    for name in ("aeroflutter", "generated", "derive", "tests"):
        shutil.copytree(ROOT / name, copy / name, ignore=skip)
    for name in ("pyproject.toml", "setup.py", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, copy)
    build = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation"]
    subprocess.run([*build, "--wheel-dir", "dist", "."], cwd=copy, check=True, capture_output=True)
    [file] = (copy / "dist").iterdir()
    return zipfile.ZipFile(file).namelist()


def test_wheel_holds_the_package_and_nothing_else(wheel: list[str]) -> None:
    tops = {name.partition("/")[0] for name in wheel}
    assert tops == {"aeroflutter", f"aeroflutter-{aeroflutter.__version__}.dist-info"}


def test_wheel_holds_every_module_and_case(wheel: list[str]) -> None:
    expected = {
        path.relative_to(ROOT).as_posix()
        for pattern in ("*.py", "*.toml", "py.typed")
        for path in (ROOT / "aeroflutter").rglob(pattern)
    }
    generated = (ROOT / "generated").rglob("*.py")
    expected |= {f"aeroflutter/{path.relative_to(ROOT).as_posix()}" for path in generated}
    assert expected <= set(wheel)
    assert "aeroflutter/generated/section.py" in expected


def test_sources_are_shipped_whole(tmp_path: Path) -> None:
    """What is shipped can derive, test and document itself: everything but what git ignores."""
    unwanted = shutil.ignore_patterns(
        "__pycache__", "*.egg-info", ".git", ".venv*", ".*_cache", ".hypothesis", "_build",
        "gallery", "build", "dist", "out", ".coverage*", "sg_execution_times.rst",
    )  # fmt: skip
    copy = tmp_path / "sources"
    shutil.copytree(ROOT, copy, ignore=unwanted)
    (copy / "docs" / "_build").mkdir()
    (copy / "docs" / "_build" / "page.html").write_text("made")
    expected = {
        path.relative_to(copy).as_posix()
        for path in copy.rglob("*")
        if path.is_file() and "_build" not in path.parts
    }
    build = [sys.executable, "-m", "build", "--sdist", "--no-isolation", "--outdir", tmp_path, copy]
    subprocess.run(build, check=True, capture_output=True)
    [file] = tmp_path.glob("*.tar.gz")
    with tarfile.open(file) as archive:
        shipped = {name.partition("/")[2] for name in archive.getnames()}
    assert {"derive/__main__.py", "Makefile", "tests/test_packaging.py"} <= expected
    assert expected <= shipped
    assert "docs/_build/page.html" not in shipped


def test_version_is_stated_once() -> None:
    assert metadata.version("aeroflutter") == aeroflutter.__version__
    assert f"version: {aeroflutter.__version__}\n" in (ROOT / "CITATION.cff").read_text()
    assert f"## [{aeroflutter.__version__}]" in (ROOT / "CHANGELOG.md").read_text()


@pytest.mark.parametrize("name", aeroflutter.__all__)
def test_public_name_can_be_imported(name: str) -> None:
    assert getattr(aeroflutter, name) is not None
    assert name in dir(aeroflutter)


def test_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="nonsense"):
        _ = aeroflutter.nonsense


def test_importing_the_package_is_light() -> None:
    code = "import sys, aeroflutter; assert 'numpy' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_generated_is_a_module_of_the_package_only(tmp_path: Path) -> None:
    code = (
        "import importlib.util as u, aeroflutter.generated.section;"
        "assert not any(map(u.find_spec, ('generated', 'derive', 'tests')))"
    )
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=True)


# Locked requirements

PINNED = re.compile(r"^([a-z0-9-]+)==(\S+)", re.MULTILINE)


def pins(name: str) -> set[tuple[str, str]]:
    """Names and versions of a lock file."""
    return set(PINNED.findall((ROOT / "requirements" / f"{name}.txt").read_text()))


@pytest.mark.parametrize("name", ["dev", "runtime", "reference"])
def test_lock_files_pin_and_hash_everything(name: str) -> None:
    text = (ROOT / "requirements" / f"{name}.txt").read_text()
    blocks = re.split(r"\n(?=\S)", text.partition("\n#    make lock\n")[2].strip())
    assert blocks
    for block in blocks:
        assert PINNED.match(block), block.splitlines()[0]
        assert "--hash=sha256:" in block
    assert not re.search(r"://|^-", text, re.MULTILINE)  # no index, no path, no option


def test_locks_agree_and_cover_the_dependencies() -> None:
    assert pins("runtime") <= pins("dev")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    locked = {name for name, _ in pins("runtime")}
    for requirement in project["dependencies"]:
        assert re.split(r"[><=]", requirement)[0] in locked
