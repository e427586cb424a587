"""What every command shows, on a terminal of 80 columns and in a pipe, as it was last looked at.

The screens are in ``tests/screens``, the piped text below the screen. Words and lines are compared
as they stand, numbers by value, since their last digits are the machine's; times are left out.
After a change that is meant: ``AEROFLUTTER_SCREENS=write pytest tests/test_screens.py``, and read
the difference.
"""

import contextlib
import io
import os
import re
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from bah import FILE, MACH, K
from test_engineering import TAILPLANE

from aeroflutter.cli import COMMANDS, main

KEPT = Path(__file__).with_name("screens")
MARK = "═══ piped ═══\n"
QUICK = "--simulations 0 --depth 0 --points 12"
WING = f"""\
title = "BAH wing"

[model]
kind = "modal"
file = "{FILE}"
semichord = 2.0
density = 1.225
k = {K}
mach = {MACH}
at_mach = 0.2
M = {[1.0] * 10}
K = [0.0, 0.0, 237.7467, 556.3491, 2989.911, 3199.282, 8308.047, 19385.00, 67106.59, 126280.9]
lags = 3
speed_range = [300.0, 500.0]
"""
SCREENS = {
    "cases": "cases",
    "init": "init new.toml",
    "validate": "validate tail.toml",
    "rootlocus": "rootlocus tail.toml",
    "rootlocus-vary": "rootlocus run14 --vary section.mu=90,100,110",
    "df": "df run14 --points 20",
    "df-si": "df tail.toml --points 12",
    "lco": f"lco tail.toml {QUICK}",
    "lco-at": f"lco run14 {QUICK} --speed-ratio 0.95",
    "hb": "hb run14 --harmonics 3",
    "loop": "loop run14 --speed-ratio 0.95",
    "onset": "onset naca496",
    "onset-chart": "onset run14 --chart 0.85",
    "tolerance": "tolerance run14 --speed-ratio 0.96 --amplitude-deg 1",
    "spring": "spring tail.toml",
    "simulate": "simulate tail.toml --velocity 157.3",
    "simulate-sweep": "simulate run14 --sweep 0.94:0.96:2",
    "chaos": "chaos run14 --speed-ratio 0.95 --cycles 50 --transient 10",
    "map": "map run14 --speed-ratio 0.9,0.95 --alpha-deg 2,8",
    "sweep": "sweep run14 --vary section.mu=normal(100,5) --sample 2",
    "report": "report naca496 --velocity 40,50 --alpha-deg 1 --periods 2 --out r.html",
    "reproduce": "reproduce --only 4.12 --folder made --workers 1 --again",
    "warmup": "warmup",
    "import": "import ss.npz --out ss.toml --set time_unit=s",
    "pk": "pk wing.toml --points 9",
}
CHANGES = re.compile(r"^(CPU|wall) time:")  # lines that differ from run to run
MADE = ("new.toml", "r.html", "ss.toml")
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?")


class Terminal(io.StringIO):
    """A terminal."""

    def isatty(self):
        return True


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A folder with the files that the commands name."""
    from aeroflutter.kernels import warmup

    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    (tmp_path / "tail.toml").write_text('title = "a tailplane"\n' + TAILPLANE)
    (tmp_path / "wing.toml").write_text(WING)
    A = np.array([[0.0, 1.0], [-4.0, -0.1]])
    np.savez(
        tmp_path / "ss.npz", speeds=[10.0, 20.0], A=np.array([A, A]), B=np.ones((2, 2, 1)),
        C=np.array([[1.0, 0.0]]), names=["flap"], units=["rad"],
    )  # fmt: skip
    made = warmup.Warmed(compiled=3, kept=38, seconds=12.34, folder="/cache/aeroflutter")
    monkeypatch.setattr(warmup, "warm_up", lambda: made)


@pytest.fixture
def once(monkeypatch):
    """Analyses that take long are run for the screen alone; the pipe shows the same result."""
    for module, name in (
        ("aeroflutter.guarantees.chart", "friction_chart"),
        ("aeroflutter.orbits.cycles", "limit_cycles"),
        ("aeroflutter.studies.tolerance", "tolerance"),
    ):
        analysis = getattr(import_module(module), name)
        monkeypatch.setattr(f"{module}.{name}", _kept(analysis))


def _kept(analysis):
    found = []

    def first(*words, **more):
        if not found:
            found.append(analysis(*words, **more))
        return found[0]

    return first


def shown(words, stream):
    for name in MADE:
        Path(name).unlink(missing_ok=True)
    with contextlib.redirect_stdout(stream), contextlib.redirect_stderr(io.StringIO()) as err:
        code = main(words)
    assert code == 0, err.getvalue()
    return stream.getvalue()


def lines(text):
    """Lines without what differs from run to run, and their words."""
    return [line.split() for line in text.splitlines() if not CHANGES.search(line)]


def alike(one, other):
    """Whether two words are the same, numbers in them by value."""
    if NUMBER.sub("#", one) != NUMBER.sub("#", other):
        return False
    pairs = zip(NUMBER.findall(one), NUMBER.findall(other), strict=True)
    return all(
        abs(float(a) - float(b)) <= 2e-3 * max(abs(float(a)), abs(float(b))) + 1e-9
        for a, b in pairs
    )


def differences(now, then):
    if len(now) != len(then):
        return [f"{len(now)} lines, not {len(then)}"]
    return [
        f"{' '.join(a)}  is not  {' '.join(b)}"
        for a, b in zip(now, then, strict=True)
        if len(a) != len(b) or not all(map(alike, a, b))
    ]


@pytest.mark.parametrize("name", SCREENS)
def test_a_screen_is_as_it_was(name, place, once):
    words = SCREENS[name].split()
    screen, piped = shown(words, Terminal()), shown(words, io.StringIO())
    assert max(map(len, screen.splitlines())) <= 80
    assert all(line == line.rstrip() for line in piped.splitlines())
    known = {word for line in lines(piped) for word in line} | {"(no", "room", "for"}
    cut = [
        w for line in lines(screen) for w in line if w not in known and w.strip(",;") not in known
    ]
    cut = [word for word in cut if set(word) != {"─"} and not _of_note(word, screen)]
    assert cut == []
    file = KEPT / f"{name}.txt"
    if os.environ.get("AEROFLUTTER_SCREENS") == "write":
        KEPT.mkdir(exist_ok=True)
        file.write_text(screen + MARK + piped, encoding="utf-8")
    kept_screen, kept_piped = file.read_text(encoding="utf-8").split(MARK)
    assert differences(lines(piped), lines(kept_piped)) == []
    assert differences(lines(screen), lines(kept_screen)) == []


def _of_note(word, screen):
    """Whether a word stands in the sentence on columns that are left out, as screens have it."""
    notes = re.findall(r"\(no room for .*?have all\s+columns\)", screen, re.DOTALL)
    return any(word in note.split() for note in notes)


def test_every_command_has_a_screen():
    assert {words.split()[0] for words in SCREENS.values()} == set(COMMANDS)


def test_the_comparison_sees_what_matters():
    assert alike("0.921263", "0.921264")
    assert not alike("0.921", "0.941")
    assert not alike("stable", "unstable")
    assert not alike("(3)", "3")
    assert differences([["a", "1"]], [["a"]])
    assert differences([["a"]], [["a"], ["b"]])


@pytest.mark.parametrize("command", COMMANDS)
def test_help_fits_and_has_one_vocabulary(command, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert main([command, "--help"]) == 0
    text = capsys.readouterr().out
    assert max(map(len, text.splitlines())) <= 80
    options = set(re.findall(r"(?<![\w-])--?[a-z][a-z-]*", text))
    former = {"-o", "--output", "--low", "--high", "--largest", "--speeds", "--no-onset"}
    assert not options & former
    assert not {one for one in options if re.fullmatch(r"-[a-z]", one)} - {"-h"}
