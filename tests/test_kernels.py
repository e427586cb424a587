"""Machine code on disk: never stale, never in the way, and nobody else's files are touched."""

import ast
import os
import shutil
import subprocess
import sys
import time
from importlib import import_module
from pathlib import Path

import pytest

import aeroflutter
from aeroflutter.kernels import folders
from aeroflutter.kernels.decorator import kernel
from aeroflutter.kernels.store import is_kernel_module, sources, state_hash

PACKAGE = Path(aeroflutter.__file__).parent

CONSTANTS = """
FACTOR = 2.0
"""
CALLER = """
from aeroflutter._kernel_constants import FACTOR
from aeroflutter.kernels import kernel

@kernel
def scaled(x):
    return FACTOR * x

@kernel(signature="f8(f8)")
def one_version(x):
    return scaled(x)
"""
SCALE = """
from aeroflutter._kernel_caller import scaled
print(scaled(3.0), sum(scaled.stats.cache_hits.values()))
"""


@pytest.fixture
def copy(tmp_path):
    """A copy of the package with two kernels of the test's own, one with the other's constant."""
    package = tmp_path / "copy" / "aeroflutter"
    shutil.copytree(PACKAGE, package, ignore=shutil.ignore_patterns("__pycache__"))
    (package / "_kernel_constants.py").write_text(CONSTANTS)
    (package / "_kernel_caller.py").write_text(CALLER)
    return package


def start(package, code, **environment):
    """Start Python on some code, with the copy of the package and only these variables."""
    kept = {name: value for name, value in os.environ.items() if name == "PATH"}
    kept |= {"PYTHONPATH": str(package.parent), "PYTHONDONTWRITEBYTECODE": "1"}
    return subprocess.Popen(
        [sys.executable, "-c", code],
        env=kept | environment,
        cwd=package.parent,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def run(package, code, **environment):
    """What the code prints on stdout and on stderr."""
    process = start(package, code, **environment)
    out, err = process.communicate(timeout=300)
    assert process.returncode == 0, err
    return out, err


def test_a_changed_constant_reaches_the_callers_in_other_files(copy, tmp_path):
    """numba's own cache looks at the caller's file alone and would print 6.0 at last."""
    cache = {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    assert run(copy, SCALE, **cache) == ("6.0 0\n", "")
    assert run(copy, SCALE, **cache) == ("6.0 1\n", "")
    (copy / "_kernel_constants.py").write_text(CONSTANTS.replace("2.0", "5.0"))
    assert run(copy, SCALE, **cache) == ("15.0 0\n", "")


@pytest.mark.parametrize("home", ["/dev/null/none", ""])
def test_without_a_home_it_compiles_each_time_and_says_so_in_one_line(copy, home):
    code = f"{SCALE}\nfrom aeroflutter._kernel_caller import one_version\none_version(1.0)"
    before = sorted(copy.parent.iterdir())
    out, err = run(copy, code, HOME=home, XDG_CACHE_HOME=home, LOCALAPPDATA=home)
    assert out == "6.0 0\n"
    assert err.startswith("aeroflutter: machine code cannot be kept")
    assert "NUMBA_CACHE_DIR" in err
    assert err.count("\n") == 1
    assert sorted(copy.parent.iterdir()) == before


def test_the_cache_is_where_the_user_wants_it(copy, tmp_path):
    chosen, home, xdg = tmp_path / "chosen", tmp_path / "home", tmp_path / "xdg"
    run(copy, SCALE, NUMBA_CACHE_DIR=str(chosen), HOME=str(home), XDG_CACHE_HOME=str(xdg))
    assert [path.name for path in chosen.iterdir()] == ["aeroflutter"]
    assert not home.exists()
    assert not xdg.exists()
    run(copy, SCALE, HOME=str(home), XDG_CACHE_HOME=str(xdg))
    assert not home.exists() or not (home / ".cache").exists()
    (kept,) = (xdg / "aeroflutter").iterdir()
    assert folders.OURS.fullmatch(kept.name)
    assert (kept / folders.MARKER).exists()
    assert list(kept.glob("_kernel_caller.scaled-*.code"))
    assert not list(copy.rglob("*.nbi")), "nothing is left beside the sources"


def test_a_lost_or_broken_file_is_made_again(copy, tmp_path):
    cache = {"NUMBA_CACHE_DIR": str(tmp_path)}
    run(copy, SCALE, **cache)
    (file,) = tmp_path.glob("aeroflutter/*/_kernel_caller.scaled-*.code")
    file.write_bytes(file.read_bytes()[:-100])
    assert run(copy, SCALE, **cache) == ("6.0 0\n", "")
    assert run(copy, SCALE, **cache) == ("6.0 1\n", "")
    file.write_bytes(b"")
    assert run(copy, SCALE, **cache) == ("6.0 0\n", "")


def test_two_processes_fill_one_cache_with_different_versions(copy, tmp_path):
    """Each saves its own version of one kernel; either must then find its own, not the other's."""
    cache = {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    code = "from aeroflutter._kernel_caller import scaled\n"
    code += "for _ in range(20): value = scaled({0})\n"
    code += "print(value, sum(scaled.stats.cache_hits.values()))"
    calls = ["3.0", "3", "3j", "True"]
    answers = ["6.0", "6.0", "6j", "2.0"]
    for hits in (0, 1):
        processes = [start(copy, code.format(call), **cache) for call in calls]
        for process, answer in zip(processes, answers, strict=True):
            out, err = process.communicate(timeout=300)
            assert (out, err) == (f"{answer} {hits}\n", "")
    assert len(list((tmp_path / "cache").glob("aeroflutter/*/*scaled-*.code"))) == len(calls)
    assert not list((tmp_path / "cache").rglob("*.part"))


def test_with_a_signature_there_is_one_version_made_at_the_first_call(copy, tmp_path):
    code = """
from aeroflutter._kernel_caller import one_version, scaled
print(len(one_version.signatures), one_version(3), one_version(True), one_version(0.5),
      one_version.signatures, len(scaled.signatures))
"""
    out, err = run(copy, code, NUMBA_CACHE_DIR=str(tmp_path))
    assert (out, err) == ("0 6.0 2.0 1.0 [(float64,)] 1\n", "")


def test_without_compilation_a_kernel_is_the_function_it_was(copy):
    code = """
from aeroflutter._kernel_caller import scaled, one_version
print(type(scaled).__name__, type(one_version).__name__, one_version([1]) if 0 else scaled(1.5))
"""
    out, err = run(copy, code, NUMBA_DISABLE_JIT="1", HOME="/dev/null/none")
    assert (out, err) == ("function function 3.0\n", "")


def test_the_package_and_its_help_need_no_compiler(copy):
    code = """
import sys
import aeroflutter, aeroflutter.kernels
from aeroflutter.cli import main
main(["--help"])
assert "numba" not in sys.modules and "numpy" not in sys.modules
"""
    run(copy, code)


def make(parent, name, age, files=("a.code", "b.code.12.part"), marker=True):
    """A folder of machine code that was last used `age` seconds ago."""
    folder = parent / name
    folder.mkdir(parents=True)
    for file in files:
        (folder / file).write_text("code")
    if marker:
        (folder / folders.MARKER).write_text("ours")
        when = time.time() - age
        os.utime(folder / folders.MARKER, (when, when))
    return folder


DAY = 86400.0


def name(number):
    return f"{number:032x}"


def test_old_folders_go_when_a_new_one_is_made(tmp_path):
    old = make(tmp_path, name(1), 31 * DAY)
    used = make(tmp_path, name(2), 29 * DAY)
    folders.touch(old)
    folders.claim(tmp_path / name(3))
    assert old.exists(), "what is in use counts as new"
    make(tmp_path, name(4), 31 * DAY)
    folders.claim(tmp_path / name(3))
    assert (tmp_path / name(4)).exists(), "nothing is looked for where the folder is there"
    folders.claim(tmp_path / name(5))
    assert not (tmp_path / name(4)).exists()
    assert used.exists()


def test_the_least_recently_used_go_but_none_that_may_be_filling(tmp_path):
    ages = [age * DAY for age in range(1, folders.MOST_FOLDERS + 3)]
    made = [make(tmp_path, name(int(age)), age) for age in ages]
    folders.claim(tmp_path / name(0))
    assert [folder.exists() for folder in made] == [True] * (folders.MOST_FOLDERS - 1) + [False] * 3
    busy = [make(tmp_path, name(number), 60.0) for number in range(10, 30)]
    folders.claim(tmp_path / name(1))
    assert all(folder.exists() for folder in busy)


def test_nothing_foreign_is_deleted(tmp_path):
    age = 100 * DAY
    elsewhere = make(tmp_path / "elsewhere", name(9), age)
    cache = tmp_path / "cache"
    kept = [
        make(cache, "numba_0123", age),
        make(cache, name(1) + "0", age),
        make(cache, name(2), age, marker=False),
    ]
    mixed = make(cache, name(3), age, files=("a.code", "thesis.txt"))
    nested = make(cache, name(4), age)
    (nested / "deeper").mkdir()
    (nested / "deeper" / "b.code").write_text("not ours")
    (cache / name(5)).symlink_to(elsewhere)
    (cache / "file.code").write_text("not ours")
    gone = make(cache, name(6), age)
    folders.claim(cache / name(7))
    assert not gone.exists()
    for folder in (*kept, elsewhere):
        assert (folder / "a.code").exists()
    assert (mixed / "thesis.txt").exists()
    assert (mixed / folders.MARKER).exists()
    assert (nested / "deeper" / "b.code").exists()
    assert (cache / "file.code").exists()


def test_the_key_covers_every_kernel_and_what_it_imports():
    """A kernel may take from the package only what is in the hash; else its code goes stale."""
    covered = dict(sources())
    assert "aeroflutter.kernels.store" in covered
    kernels = {module for module in covered if is_kernel_module(module)}
    assert {path.stem for path in PACKAGE.rglob("_kernel*.py")} == {
        module.rpartition(".")[2] for module in kernels
    }
    for module in kernels:
        for node in ast.walk(ast.parse(covered[module].read_bytes())):
            if isinstance(node, ast.Import):
                taken = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                assert node.level == 0, f"{module} imports relatively"
                taken = [node.module or ""]
                taken += [f"{node.module}.{alias.name}" for alias in node.names]
                taken = [found for found in taken if found in covered] or taken[:1]
            else:
                continue
            for found in taken:
                if found.startswith(("aeroflutter", "generated")):
                    assert found in covered or found == "aeroflutter.kernels", (module, found)
                else:
                    assert found.split(".")[0] in {*sys.stdlib_module_names, "numpy"}, (
                        f"{module} imports {found}, whose version is not in the key"
                    )


def test_the_key_changes_with_any_kernel_and_any_setting(copy, tmp_path):
    code = "from aeroflutter.kernels.store import state_hash\nprint(state_hash())"
    states = [run(copy, code)[0], run(copy, code, NUMBA_BOUNDSCHECK="1")[0]]
    for path in (copy / "_kernel_caller.py", copy / "motion" / "_kernel_settle.py"):
        path.write_text(path.read_text() + "\n")
        states.append(run(copy, code)[0])
    assert len(set(states)) == 4
    (copy / "springs" / "base.py").write_text("")
    assert run(copy, code)[0] == states[-1]
    assert folders.OURS.fullmatch(state_hash())


def test_a_kernel_of_another_file_is_refused():
    with pytest.raises(ValueError, match=r"_kernel\*\.py"):
        kernel(run)


def test_every_compiled_function_carries_the_decorator():
    for module, file in sources():
        if is_kernel_module(module):
            assert "numba" not in file.read_text(encoding="utf-8"), module
            import_module(module)
