"""Machine code on disk: never stale, never in the way, and nobody else's files are touched."""

import ast
import os
import re
import shutil
import subprocess
import sys
import time
from importlib import import_module
from pathlib import Path

import pytest

import aeroflutter
from aeroflutter.kernels import folders, notice
from aeroflutter.kernels.decorator import ENTRIES, kernel
from aeroflutter.kernels.store import is_kernel_module, sources, state_hash

PACKAGE = Path(aeroflutter.__file__).parent

CONSTANTS = """
FACTOR = 2.0
"""
CALLER = """
from __future__ import annotations

from typing import Annotated, NamedTuple

from aeroflutter._kernel_constants import FACTOR
from aeroflutter.kernels import kernel
from aeroflutter.kernels.arrays import Given1, Real1

@kernel
def scaled(x):
    return FACTOR * x

class Pair(NamedTuple):
    few: Real1
    many: Annotated[tuple[float, ...], 3]

@kernel(inner=True)
def total(pair):
    return pair.few.sum() + len(pair.many)

@kernel(entry=True)
def one_version(x: float, given: Given1, pair: Pair, flag: bool) -> float:
    return total(pair) + scaled(x) + given[0] if flag else 0.0
"""
SCALE = """
from aeroflutter._kernel_caller import scaled
print(scaled(3.0), sum(scaled.stats.cache_hits.values()))
"""
PATIENT = """
from aeroflutter.kernels import kernel

@kernel(entry=True, patience=0.001)
def slow(x: float) -> float:
    total = 0.0
    for _ in range(3_000_000):
        total += x
    return total
"""
APART = """
from __future__ import annotations
import numpy as np
from aeroflutter.kernels import kernel
from aeroflutter.kernels.arrays import Real1

@kernel(inner=True)
def doubled(x: float) -> float:
    if x < 0.0:
        raise ValueError("below zero")
    return 2.0 * x

@kernel(entry=True, apart=True)
def shared(x: float, values: Real1) -> tuple[float, int]:
    values[0] += doubled(x)
    return values[0], values.size

@kernel(entry=True)
def caller(x: int, values: Real1) -> float:
    total, size = shared(x, values)
    return total + 10.0 * size + doubled(x)
"""
APART_CALLS = """
import numpy as np
from aeroflutter._kernel_apart import caller, shared
print(caller(3, np.zeros(2)), shared(1.0, np.ones(1)), end=" ")
for of in (caller, shared.dispatcher):
    print(sum(of.stats.cache_hits.values()), len(of.signatures), end=" ")
try:
    caller(-1, np.zeros(2))
except ValueError as error:
    print(error)
"""
ONCE = """
from aeroflutter._kernel_patient import slow
print(slow(1.0), len(slow.dispatcher.signatures))
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
    code = f"{SCALE}\nscaled(1)"
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


def test_a_patient_kernel_remembers_what_it_has_taken_uncompiled(copy, tmp_path):
    """Short commands are never kept waiting for it, and many of them pay for it once."""
    (copy / "_kernel_patient.py").write_text(PATIENT)
    cache = {"NUMBA_CACHE_DIR": str(tmp_path)}
    assert run(copy, ONCE, **cache) == ("3000000.0 0\n", "")
    (spent,) = tmp_path.glob("aeroflutter/*/_kernel_patient.slow.spent")
    assert run(copy, ONCE, **cache) == ("3000000.0 1\n", "")
    spent.write_text("lost")
    next(spent.parent.glob("_kernel_patient.slow-*.code")).unlink()
    assert run(copy, ONCE, **cache) == ("3000000.0 0\n", "")


def test_a_kernel_apart_is_in_no_other_and_there_before_them(copy, tmp_path):
    """Each process learns its address before it loads what calls it, also where that is lost."""
    (copy / "_kernel_apart.py").write_text(APART)
    answers = "32.0 (3.0, 1) {} 1 {} 1 below zero\n"
    for hits in ((0, 0), (1, 1)):
        assert run(copy, APART_CALLS, NUMBA_CACHE_DIR=tmp_path)[0] == answers.format(*hits)
    (lost,) = tmp_path.glob("aeroflutter/*/_kernel_apart.shared-*.code")
    lost.unlink()
    assert run(copy, APART_CALLS, NUMBA_CACHE_DIR=tmp_path)[0] == answers.format(1, 0)


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


ONE_VERSION = """
import numpy as np
from aeroflutter._kernel_caller import Pair, one_version, scaled
few = np.ones(2)
read_only = np.ones(2)
read_only.flags.writeable = False
pair = Pair(few, (1.0, 2.0, 3.0))
"""


def test_an_entry_has_one_version_made_at_the_first_call(copy, tmp_path):
    code = f"""{ONE_VERSION}
print(len(one_version.signatures), one_version(3, few, pair, 1),
      one_version(True, read_only, pair, True), one_version(0.5, few, pair, False),
      len(one_version.signatures), len(scaled.signatures))
"""
    out, err = run(copy, code, NUMBA_CACHE_DIR=str(tmp_path))
    assert (out, err) == ("0 12.0 8.0 0.0 1 1\n", "")


def test_an_entry_refuses_what_is_not_of_its_types(copy, tmp_path):
    """At its first call as at every other: numba would read a strided array as if it were not."""
    code = f"""{ONE_VERSION}
from aeroflutter.kernels import kernel
for wrong in [
    (1.0, np.ones(6)[::2], pair, True),
    (1.0, np.ones((2, 2)), pair, True),
    (1.0, np.ones(2, dtype=int), pair, True),
    (1.0, few, Pair(read_only, pair.many), True),
    (1.0, few, (few, pair.many), True),
    (1j, few, pair, True),
]:
    new = kernel(entry=True)(one_version.py_func)
    for call in "first", "second":
        try:
            print(call, "is taken:", wrong, new(*wrong))
        except TypeError:
            pass
    assert new(1.0, few, pair, True) == 8.0
"""
    assert run(copy, code, NUMBA_CACHE_DIR=str(tmp_path)) == ("", "")


def test_an_entry_says_its_types_whole(copy):
    caller = copy / "_kernel_caller.py"
    caller.write_text(caller.read_text().replace("given: Given1", "given: NDArray"))
    code = """
from aeroflutter._kernel_caller import one_version
try:
    one_version(1.0, 2.0, 3.0, True)
except (TypeError, NameError) as error:
    print(error)
"""
    assert "NDArray" in run(copy, code, HOME="/dev/null/none")[0]


WARM_UP = """
from aeroflutter.cli import main
from aeroflutter.kernels import notice
notice.LONG = {0}
raise SystemExit(main(["warmup"]))
"""


@pytest.fixture
def small(copy):
    """The copy without any kernels but the test's own."""
    for path in copy.rglob("_kernel*.py"):
        if path.parent != copy:
            path.unlink()
    return copy


def test_warmup_compiles_every_entry_once(small, tmp_path):
    cache = {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    out, err = run(small, WARM_UP.format("60.0"), **cache)
    assert re.match(r"1 of 1 kernels compiled in \d+\.\d s\nkept in .*/cache/aeroflutter/", out)
    assert err == ""
    out, err = run(small, WARM_UP.format("0.0"), **cache)
    assert out.startswith("all 1 kernels are there already")
    assert err == ""
    code = f"{ONE_VERSION}\none_version(1, few, pair, True)\nprint(one_version.stats.cache_misses)"
    assert run(small, code, **cache)[0] == "Counter()\n"


def test_warmup_says_where_nothing_can_be_kept_or_nothing_is_compiled(small):
    out, err = run(small, WARM_UP.format("60.0"), HOME="/dev/null/none")
    assert out.startswith("1 of 1 kernels compiled")
    assert "kept" not in out
    assert err.startswith("aeroflutter: machine code cannot be kept")
    out, err = run(small, WARM_UP.format("60.0"), HOME="/dev/null/none", NUMBA_DISABLE_JIT="1")
    assert (out, err) == ("nothing to compile: NUMBA_DISABLE_JIT is set\n", "")


def test_compiling_for_long_is_announced_once_on_stderr(small, tmp_path):
    out, err = run(small, WARM_UP.format("0.0"), NUMBA_CACHE_DIR=str(tmp_path))
    assert "first use" not in out
    assert err == f"{notice.LINE}\n"


@pytest.fixture
def hurry(monkeypatch):
    monkeypatch.setattr(notice, "LONG", 0.2)
    return notice._NOTICE


def test_the_announcement_comes_while_it_compiles(hurry, capsys):
    with notice.noticing():
        hurry.begin()
        hurry.begin()
        time.sleep(0.5)
        assert capsys.readouterr() == ("", f"{notice.LINE}\n")
        hurry.end()
        hurry.end()
        hurry.begin()
        time.sleep(0.5)
        hurry.end()
    assert capsys.readouterr() == ("", "")


def test_the_time_of_many_kernels_adds_up(hurry, capsys):
    with notice.noticing():
        for _ in range(8):
            hurry.begin()
            time.sleep(0.05)
            hurry.end()
    assert capsys.readouterr() == ("", f"{notice.LINE}\n")


def test_short_compiling_and_waiting_are_not_announced(hurry, capsys):
    with notice.noticing():
        hurry.begin()
        hurry.end()
        time.sleep(0.5)
    hurry.begin()
    time.sleep(0.5)
    hurry.end()
    assert capsys.readouterr() == ("", ""), "outside a command the library is silent"


def test_without_compilation_a_kernel_is_the_function_it_was(copy):
    code = """
from aeroflutter._kernel_caller import scaled, one_version, total
print(*(type(each).__name__ for each in (scaled, one_version, total)), scaled(1.5))
"""
    out, err = run(copy, code, NUMBA_DISABLE_JIT="1", HOME="/dev/null/none")
    assert (out, err) == ("function function function 3.0\n", "")


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


def called_from(tree):
    """(module, name) of what a module takes from kernel modules."""
    modules, taken = {}, set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                if is_kernel_module(node.module):
                    taken.add((node.module, alias.name))
                elif is_kernel_module(f"{node.module}.{alias.name}"):
                    modules[alias.asname or alias.name] = f"{node.module}.{alias.name}"
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            taken |= {(modules[node.value.id], node.attr)} if node.value.id in modules else set()
    return taken


def test_every_kernel_that_the_package_calls_is_an_entry():
    """Else `aeroflutter warmup` leaves it out, and literals may make many versions of it."""
    taken = set()
    for path in PACKAGE.rglob("*.py"):
        if not path.name.startswith("_kernel"):
            taken |= called_from(ast.parse(path.read_bytes()))
    assert taken
    kernels = {
        f"{module}.{name}"
        for module, name in taken
        if hasattr(getattr(import_module(module), name), "py_func")
    }
    assert kernels - set(ENTRIES) == set()
    assert set(ENTRIES) - kernels == set(), "an entry that nobody calls"
