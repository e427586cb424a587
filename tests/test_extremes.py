"""What random attacks found: numbers next to zero, names that obey, files of another shape."""

from __future__ import annotations

import contextlib
import json
import logging
import os
import signal
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from aeroflutter import cli
from aeroflutter.analysis import analysis
from aeroflutter.case import load_case
from aeroflutter.cli import main
from aeroflutter.cli.streams import LONGEST, say
from aeroflutter.disk import ABANDONED
from aeroflutter.errors import AeroflutterError, ConvergenceError, InputError
from aeroflutter.files import replacing
from aeroflutter.guarantees.absence import Certificate
from aeroflutter.model.elsewhere.rational import FitOptions
from aeroflutter.model.elsewhere.variables import read_variables
from aeroflutter.model.section import TypicalSection
from aeroflutter.motion.response import SimulateOptions, simulate
from aeroflutter.reproduce import choose, reproduce
from aeroflutter.studies.maps import cluster, ownership

PROOF = Path(__file__).parent / "data" / "absence_run14.json"


def last_line(capsys: pytest.CaptureFixture[str]) -> str:
    return capsys.readouterr().err.splitlines()[-1]


def test_samples_next_to_nothing_apart_are_as_many_as_are_kept() -> None:
    options = SimulateOptions(dt=1e-320, duration=20.0, record=False)
    assert simulate(load_case("run14"), speed=3.0, options=options).state == "undecided"


@pytest.mark.parametrize("key", ["section.omega_bar", "spring.delta_h_deg"])
def test_a_number_whose_square_is_nothing_is_refused(capsys, key: str) -> None:
    assert main(["validate", "run14", "--set", f"{key}=1e-320"]) == 2
    line = last_line(capsys)
    assert f"{key}: 1e-320 is too small to compute with" in line
    assert "of size 1e-30 or more" in line
    assert main(["validate", "run14", "--set", f"{key}=1e-20"]) == 0


def test_a_singular_matrix_is_said_of_the_analysis() -> None:
    @analysis(spring=False)
    def inverse(family: object) -> object:
        return np.linalg.inv(np.zeros((2, 2)))

    with pytest.raises(ConvergenceError, match=r"^inverse: singular matrix; some number"):
        inverse(TypicalSection(omega_bar=0.5))


def test_a_name_with_control_characters_is_spelt_out(capsys, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["init", "\x1b[2J.toml"]) == 0
    assert capsys.readouterr().out == "written: \\x1b[2J.toml\n"
    assert main(["validate", "\x1b[2J.toml"]) == 0
    assert main(["rootlocus", "\x1b[2J.toml", "--plot", "\x07.png"]) == 0
    assert "\x1b" not in (out := capsys.readouterr().out)
    assert "written: \\x07.png\n" in out


def test_a_refusal_is_one_line_that_can_be_read(capsys) -> None:
    assert main(["rootlocus", "run14", "--out", "a\nb.pdf"]) == 2
    assert last_line(capsys) == "aeroflutter: --out a\\nb.pdf: must end in .nc"
    say("--x " + "1" * 9000 + ": give a number")
    line = last_line(capsys)
    assert len(line) < LONGEST + 30
    assert line.startswith("aeroflutter: --x 1")
    assert line.endswith("1: give a number")


def test_a_damaged_result_is_none_of_ours(capsys, tmp_path, monkeypatch) -> None:
    def damaged(*_: object, **__: object) -> None:
        raise AttributeError("NetCDF: Can't open HDF5 attribute")

    (tmp_path / "a.nc").write_bytes(b"")
    monkeypatch.setattr(xr, "open_dataset", damaged)
    assert main(["rootlocus", "run14", "--out", str(tmp_path / "a.nc")]) == 2
    assert "is no file of this program" in last_line(capsys)


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (("model", "A"), [[[1.0]]]),
        (("model", "A", 0), 3.0),
        (("model", "b", 0), [1.0, 2.0]),
        (("model", "c"), 1.0),
        (("model", "c"), [1.0]),
        (("pieces", 0, "low"), [1.0]),
        (("pieces", 0, "terms"), 1.0),
        (("pieces", 0, "terms"), [[1.0, 2.0, 3.0]]),
        (("pieces", 0, "terms"), [1.0]),
        (("spring", "delta_v"), 10**400),
    ],
)
def test_a_certificate_of_another_shape_is_none(tmp_path, place: tuple, value: object) -> None:
    content = json.loads(PROOF.read_text())
    *way, last = place
    holder = content
    for step in way:
        holder = holder[step]
    holder[last] = value
    (tmp_path / "proof.json").write_text(json.dumps(content))
    with pytest.raises(InputError, match="holds no certificate of this program") as refusal:
        Certificate.load(tmp_path / "proof.json")
    assert len(str(refusal.value)) < 400


def test_a_record_of_other_types_is_made_again(tmp_path: Path) -> None:
    [one] = reproduce(choose(["3.2"]), tmp_path, workers=1)
    record = one.file.with_suffix(".json")
    kept = json.loads(record.read_text())
    for name, other in (("caption", 1), ("facts", []), ("facts", {"\ud800": 1})):
        record.write_text(json.dumps({**kept, name: other}))
        [again] = reproduce(choose(["3.2"]), tmp_path, workers=1)
        assert again.fresh
        assert json.loads(record.read_text()) == kept


def test_forces_given_as_numbers_make_a_modal_model(capsys, tmp_path: Path) -> None:
    np.savez(tmp_path / "m.npz", A=np.eye(2))
    words = ["import", str(tmp_path / "m.npz"), "--out", str(tmp_path / "m.toml")]
    assert main([*words, "--set", "Q=[1, [2, [3]]]"]) == 2
    assert "model" in last_line(capsys)


def test_a_damaged_archive_is_closed(tmp_path: Path) -> None:
    """A file that is left open is a ResourceWarning, and an error here."""
    file = tmp_path / "m.npz"
    np.savez(file, A=np.eye(2))
    data = bytearray(file.read_bytes())
    place = data.index(zipfile.stringCentralDir)
    data[place + 6] = 79  # version that is needed to read it
    file.write_bytes(data)
    with pytest.raises(InputError, match="damaged"):
        read_variables(file)


def test_a_batch_system_may_end_a_run(monkeypatch, capsys) -> None:
    def long_run(words: list[str]) -> None:
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(10.0)

    monkeypatch.setattr(cli, "_call", long_run)
    before = signal.getsignal(signal.SIGTERM)
    assert main(["cases"]) == 143
    assert last_line(capsys) == "aeroflutter: terminated"
    assert signal.getsignal(signal.SIGTERM) is before


def test_who_answers_sigterm_goes_on_to(monkeypatch) -> None:
    heard = []
    monkeypatch.setattr(cli, "_call", lambda words: os.kill(os.getpid(), signal.SIGTERM))
    before = signal.signal(signal.SIGTERM, lambda *_: heard.append(1))
    try:
        assert main(["cases"]) == 0
    finally:
        signal.signal(signal.SIGTERM, before)
    assert heard == [1]


@pytest.mark.parametrize("which", [signal.SIGINT, signal.SIGTERM])
def test_a_write_is_ended_before_the_run_is(tmp_path: Path, which: signal.Signals) -> None:
    done = []

    def answer(*_: object) -> None:
        raise KeyboardInterrupt

    def write() -> None:
        with ownership.writing(tmp_path):
            os.kill(os.getpid(), which)
            done.append(1)

    before = signal.signal(which, answer)
    try:
        with pytest.raises(KeyboardInterrupt):
            write()
    finally:
        signal.signal(which, before)
    assert done == [1]


def test_a_file_is_on_the_disk_before_it_has_its_name(tmp_path: Path, monkeypatch) -> None:
    steps: list[str] = []
    fsync, replace = os.fsync, os.replace

    def sync(descriptor: int) -> None:
        path = Path(f"/proc/self/fd/{descriptor}").resolve()
        steps.append(path.suffix if path.is_file() else "folder")
        assert path.is_dir() or path.read_text() == "text"
        fsync(descriptor)

    monkeypatch.setattr(os, "fsync", sync)
    monkeypatch.setattr(os, "replace", lambda *a: (steps.append("named"), replace(*a)))
    with replacing(tmp_path / "a.md") as part:
        part.write_text("text")
    assert steps == [".md", "named", "folder"]


def test_what_a_killed_run_left_is_cleared_an_hour_later(tmp_path: Path) -> None:
    half = ".aeroflutter-" + 32 * "0" + ".part"
    names = [f"{half}.nc", half, f"{half}.a.b", ".aeroflutter-mine.part.nc"]
    for name in names:
        (tmp_path / name).write_text("half")
    for age, left in ((ABANDONED - 60.0, names), (ABANDONED + 60.0, names[2:])):
        for file in tmp_path.glob(".aero*"):
            os.utime(file, (time.time() - age,) * 2)
        with replacing(tmp_path / "a.md") as part:
            part.write_text("text")
        assert sorted(file.name for file in tmp_path.glob(".aero*")) == sorted(left)


@pytest.mark.parametrize("root", [1e-320, 0.0, -1.0, 1e300, float("nan")])
def test_a_lag_root_that_no_number_can_be_computed_with_is_refused(root: float) -> None:
    with pytest.raises(InputError, match=r"^lags: the roots must be positive numbers, 1e-09 to"):
        FitOptions(lags=(0.3, root))


def test_a_scheduler_that_goes_amid_a_question_has_gone(monkeypatch) -> None:
    def broken(*_: object) -> None:
        raise OSError("in <TCP (closed) …>: Stream is closed")

    monkeypatch.setattr(cluster, "_client", contextlib.nullcontext)
    monkeypatch.setattr(cluster, "_check_versions", lambda client: None)
    monkeypatch.setattr(cluster, "_round", broken)
    with pytest.raises(AeroflutterError, match=r"^the Dask scheduler has gone$"):
        list(cluster.Cluster("tcp://127.0.0.1:1").run(None, []))  # type: ignore[arg-type]


def test_what_ails_dask_is_raised_and_not_logged(monkeypatch) -> None:
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(distributed, "Client", lambda address, **_: address)
    logging.getLogger("distributed.client").setLevel(logging.WARNING)  # as Dask leaves it
    assert cluster._client("tcp://127.0.0.1:1") == "tcp://127.0.0.1:1"
    for name in ("distributed", "distributed.client", "distributed.client.x"):
        assert not logging.getLogger(name).isEnabledFor(logging.ERROR)


@pytest.mark.parametrize("command", ["simulate", "loop", "rootlocus"])
def test_a_speed_next_to_nothing_is_refused(capsys, command: str) -> None:
    assert main([command, "run14", "--speed", "1e-320"]) == 2
    assert last_line(capsys) == "aeroflutter: speed: 9.99989e-321 is too slow; give 1e-30 or more"


def test_a_case_file_is_written_without_docstrings(tmp_path: Path) -> None:
    """`python -OO` takes them away."""
    words = [sys.executable, "-OO", "-m", "aeroflutter", "init", str(tmp_path / "a.toml")]
    subprocess.run(words, check=True, capture_output=True)
    assert load_case(tmp_path / "a.toml").spring.kind == "hysteresis"


def test_a_working_directory_that_is_gone_is_named(monkeypatch, capsys, tmp_path: Path) -> None:
    def fail(*_: object) -> None:
        raise FileNotFoundError(2, "No such file or directory")

    monkeypatch.setattr(cli, "_call", fail)
    assert main(["cases"]) == 1
    assert last_line(capsys) == "aeroflutter: cannot go on: No such file or directory"
    monkeypatch.setattr(os, "getcwd", fail)
    assert main(["cases"]) == 1
    assert "the working directory has been removed; change" in last_line(capsys)
