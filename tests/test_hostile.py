"""Closed streams, endless files, slips of the finger, faults of the program: one line each."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

import aeroflutter
from aeroflutter import cli
from aeroflutter.cli import main
from aeroflutter.cli.streams import printable
from aeroflutter.errors import InputError
from aeroflutter.limits import LIMITS, VARIABLE, limit, within
from aeroflutter.reproduce import choose, press, reproduce

Capture = pytest.CaptureFixture[str]
SMALL = ("--speed-ratio", "0.5,0.6", "--alpha-deg", "1,2")
VARY = ("--vary", "section.mu=normal(100,5)")


def refused(capsys: Capture, *words: str, code: int = 2) -> str:
    """The one line with which a command ends."""
    assert main(words) == code
    err = capsys.readouterr().err
    assert err.count("\n") == 1, err
    return err.removeprefix("aeroflutter: ").rstrip("\n")


@pytest.mark.parametrize("closed", ["<&-", ">&-", "2>&-", ">&- 2>&-", "<&- >&- 2>&-"])
@pytest.mark.parametrize(("words", "code"), [("cases", 0), ("validate nosuch", 2)])
def test_closed_streams_are_no_error(closed: str, words: str, code: int) -> None:
    command = f"{sys.executable} -m aeroflutter {words} {closed}"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False)
    assert done.returncode == code
    assert "Traceback" not in done.stdout + done.stderr
    if "2>&-" in closed:
        assert done.stderr == ""
    if code and ">&-" in closed:
        assert done.stdout == ""  # no line of stderr strays there


def test_a_file_does_not_take_the_place_of_a_closed_stream(tmp_path: Path) -> None:
    out = tmp_path / "x.nc"
    command = f"{sys.executable} -m aeroflutter rootlocus linear-02 --out {out} >&- 2>&-"
    assert subprocess.run(["bash", "-c", command], check=False).returncode == 0
    assert out.read_bytes()[:4] in (b"\x89HDF", b"CDF\x01")


@pytest.mark.parametrize("where", ["2> /dev/full", "> /dev/full 2>&1"])
def test_a_full_stderr_keeps_the_exit_code(where: str) -> None:
    command = f"{sys.executable} -m aeroflutter validate nosuch {where}"
    assert subprocess.run(["bash", "-c", command], check=False).returncode == 2


def test_what_is_said_aside_ends_nothing_on_a_full_stderr() -> None:
    """Progress, notices and warnings are lines on stderr as well."""
    script = (
        "from aeroflutter.stderr import aside\n"
        "from aeroflutter.kernels.notice import _NOTICE\n"
        "_NOTICE.active = True\n"
        "aside('one'); _NOTICE.speak(); aside('two'); print('done')"
    )
    command = f'{sys.executable} -c "{script}" 2> /dev/full'
    done = subprocess.run(["bash", "-c", command], check=False, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, "done\n")


def test_nothing_else_prints_on_stderr() -> None:
    root = Path(aeroflutter.__file__).parent
    apart = {"stderr.py", "variables.py"}  # the other process of a reader has its parent to hear it
    loud = [
        file.name
        for file in root.rglob("*.py")
        if file.name not in apart and "file=sys.stderr" in file.read_text()
    ]
    assert loud == []


def test_control_characters_of_the_input_are_spelt_out(capsys: Capture) -> None:
    assert "\\x1b]0;owned\\x07" in refused(capsys, "validate", "\x1b]0;owned\x07")
    assert printable("a\tb\x9bc\u202e") == "a\\tb\\x9bc\\u202e"
    assert printable("α = 3°") == "α = 3°"


def test_a_fault_of_the_program_is_one_line_and_a_file(
    monkeypatch: pytest.MonkeyPatch, capsys: Capture, tmp_path: Path
) -> None:
    def fail(words: list[str]) -> None:
        raise IndexError("index 3\nis out of bounds")

    monkeypatch.setattr(cli, "_call", fail)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    line = refused(capsys, "cases", "--json", code=70)
    [file] = tmp_path.iterdir()
    assert line == (
        "this is a fault of the program (IndexError: index 3 is out of bounds); "
        f"please report it with the file {file}"
    )
    story = file.read_text()
    assert "['cases', '--json']" in story
    assert 'raise IndexError("index 3' in story

    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "none"))
    assert main(["cases"]) == 70
    assert "Traceback (most recent call last)" in capsys.readouterr().err


def test_too_little_memory_is_no_fault(monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    def fail(words: list[str]) -> None:
        raise MemoryError

    monkeypatch.setattr(cli, "_call", fail)
    assert "not enough memory" in refused(capsys, "cases", code=1)


@pytest.mark.parametrize(
    ("words", "name"),
    [
        (("map", "run14", "--speed-ratio", "0.1:1:10000000", "--alpha-deg", "1:9:9999"), "cells"),
        (("map", "run14", "--speed-ratio", "0.1:1:100000000", "--alpha-deg", "1"), "numbers"),
        (("map", "run14", *SMALL, "--workers", "1000000000"), "workers"),
        (("map", "run14", *SMALL, "--engine", "houbolt", "--dt", "1e-300"), "steps"),
        (("simulate", "run14", "--speed", "3", "--engine", "houbolt", "--dt", "1e-300"), "steps"),
        (("sweep", "run14", *VARY, "--sample", "1" + 12 * "0"), "samples"),
        (("hb", "run14", "--harmonics", "1000000000"), "harmonics"),
        (("hb", "run14", "--max-harmonics", "1000000000"), "harmonics"),
        (("chaos", "run14", "--speed-ratio", "0.95", "--cycles", "1" + 12 * "0"), "cycles"),
        (("df", "run14", "--points", "1" + 12 * "0"), "numbers"),
        (("lco", "run14", "--points", "1" + 12 * "0"), "numbers"),
        (("reproduce", "--workers", "1000000000"), "workers"),
        (("lco", "run14", "--plot", "x.png", "--points-csv", "/dev/zero"), "bytes"),
    ],
)  # fmt: skip
def test_what_is_too_large_is_refused_before_it_begins(
    capsys: Capture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: list[str], name: str
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv(VARIABLE, "bytes=1000000")
    assert name in refused(capsys, *words)
    assert list(tmp_path.iterdir()) == []


def test_limits_are_raised_in_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    within("cells", LIMITS["cells"], "map")
    with pytest.raises(InputError, match=r"map: 1e\+14 cells.*AEROFLUTTER_LIMITS=cells=1e\+14"):
        within("cells", 1e14, "map")
    monkeypatch.setenv(VARIABLE, " cells = 1e14 , workers=7")
    within("cells", 1e14, "map")
    assert (limit("workers"), limit("samples")) == (7, LIMITS["samples"])
    for text in ("cells", "cells=many", "cells=0", "cells=inf", "sheep=3"):
        monkeypatch.setenv(VARIABLE, text)
        with pytest.raises(InputError, match=VARIABLE):
            limit("cells")


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("map", "run14", *SMALL, "--duration", "0"), "duration: "),
        (("sweep", "run14", "--vary", "spring.kind=choice(1,2)"), "spring.kind"),
        (("sweep", "run14", "--vary", "title=choice(1,2)"), "title"),
        (("df", "run14", "--out", "a" * 260 + ".nc"), "--out aaa"),
        (("df", "run14", "--plot", "a" * 260 + ".png"), "--plot aaa"),
        (("map", "run14", *SMALL, "--out", "a" * 260 + ".zarr"), "--out aaa"),
        (("reproduce", "--folder", "/dev/null/figures"), "--folder /dev/null/figures: "),
        (("reproduce", "--folder", "/dev/null"), "--folder /dev/null: "),
        (("map", "run14", *SMALL, "--scheduler", "http://localhost:80"), "--scheduler http"),
        (("map", "run14", *SMALL, "--scheduler", "tls://localhost:80"), "--scheduler tls"),
    ],
)
def test_options_that_cannot_be_name_themselves(
    capsys: Capture, words: list[str], line: str
) -> None:
    assert line in refused(capsys, *words)


def test_a_name_of_the_greatest_length_is_written(capsys: Capture, tmp_path: Path) -> None:
    out = tmp_path / ("a" * 252 + ".nc")
    assert main(["rootlocus", "linear-02", "--out", str(out)]) == 0
    assert out.stat().st_size > 0
    store = tmp_path / ("b" * 250 + ".zarr")
    assert main(["map", "linear-02", *SMALL, "--out", str(store)]) == 0
    assert (store / "zarr.json").is_file()


def test_a_truncated_figure_is_made_again(tmp_path: Path) -> None:
    [one] = reproduce(choose(["3.2"]), tmp_path, workers=1)
    data = one.file.read_bytes()
    one.file.write_bytes(data[:-100])
    [again] = reproduce(choose(["3.2"]), tmp_path, workers=1)
    assert again.fresh
    assert again.file.read_bytes() == data


class Deadly(press._Press):
    """Workers die at one exhibit."""

    def compute(self, task):
        if any(exhibit.number == "5.1" for exhibit in self.jobs[task.number]):
            os.kill(os.getpid(), signal.SIGKILL)
        return super().compute(task)


def test_a_killed_worker_costs_its_own_exhibits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(press, "_Press", Deadly)
    made = reproduce(choose(["3.2", "5.1"]), tmp_path, workers=2)
    problems = {one.exhibit.number: one.problem for one in made}
    assert problems["3.2"] == ""
    assert "3 workers died" in problems["5.1"]
