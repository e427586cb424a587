"""The command line as a whole: answers, exit codes, and never a traceback."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mangled import mangled_bytes

from aeroflutter import __version__, cli
from aeroflutter.case.case import builtin_names, load_case
from aeroflutter.cli import COMMANDS, main
from aeroflutter.errors import ConvergenceError, InputError

Capture = pytest.CaptureFixture[str]


def refused(capsys: Capture, *words: str) -> list[str]:
    """Lines of stderr of a command line that is refused, without the program's name."""
    assert main(words) == 2
    out, err = capsys.readouterr()
    assert out == ""
    lines = err.splitlines()
    assert lines
    assert all(line.startswith("aeroflutter: ") for line in lines)
    return [line.removeprefix("aeroflutter: ") for line in lines]


def test_help_and_version_import_nothing_heavy() -> None:
    code = (
        "import sys; from aeroflutter.cli import main;"
        "assert main(['--help']) == main(['--version']) == main([]) == 0;"
        "print(*{'numpy', 'cyclopts', 'rich', 'pydantic'} & set(sys.modules), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.strip() == ""
    assert __version__ in done.stdout
    assert all(f"  {name} " in done.stdout for name in COMMANDS)


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_describes_itself(capsys: Capture, name: str) -> None:
    assert main([name, "--help"]) == 0
    assert f"aeroflutter {name}" in capsys.readouterr().out


def test_wrong_words_are_refused(capsys: Capture) -> None:
    for words, expected in [
        (["valdate", "run14"], 'did you mean "validate"'),
        (["frobnicate"], "the commands are"),
        (["--frobnicate"], "no such command"),
        (["validate"], "CASE"),
        (["validate", "run14", "--frobnicate"], "--frobnicate"),
        (["validate", "run14", "run15"], "run15"),
        (["init", "--kind", "rubber"], "hysteresis"),
        (["validate", "run14", "--set", "mu"], "KEY=VALUE"),
        (["validate", "run14", "--set", "section.mu=-1"], "section.mu: must be positive"),
        (["validate", "run17"], 'did you mean "run1'),
    ]:
        [line] = refused(capsys, *words)
        assert expected in line


def test_values_may_be_negative(capsys: Capture) -> None:
    assert main(["rootlocus", "linear-02", "--stiffness", "-0.5", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["stiffness"] == -0.5
    [line] = refused(capsys, "df", "linear-02", "--amplitudes-deg", "-1:2:3")
    assert "--amplitudes-deg: " in line
    assert "positive" in line


def test_every_problem_has_its_line(capsys: Capture, tmp_path: Path) -> None:
    file = tmp_path / "bad.toml"
    file.write_text("[section]\nmu = -3\nnu = 2\n")
    lines = refused(capsys, "validate", str(file))
    assert len(lines) == 3
    assert all(line.startswith(f"{file}: section.") for line in lines)


@pytest.mark.parametrize(
    ("error", "code", "line"),
    [
        (ConvergenceError("no root above U* = 3", partial=[1.0]), 3, "no root above U* = 3"),
        (KeyboardInterrupt(), 130, "interrupted"),
        (OSError(28, "No space left on device"), 1, "No space left"),
    ],
)
def test_exit_codes(
    monkeypatch: pytest.MonkeyPatch, capsys: Capture, error: BaseException, code: int, line: str
) -> None:
    def fail(words: list[str]) -> None:
        raise error

    monkeypatch.setattr(cli, "_call", fail)
    assert main(["cases"]) == code
    err = capsys.readouterr().err
    assert err.startswith("aeroflutter: ")
    assert line in err
    assert err.count("\n") == 1


def test_a_reader_that_leaves_is_no_error() -> None:
    command = f"{sys.executable} -m aeroflutter cases --json | true; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False)
    assert done.stderr == ""
    assert done.returncode in (0, 141)  # 0 where the text fitted into the pipe before it closed


def test_a_full_disk_is_said_in_one_line() -> None:
    command = f"{sys.executable} -m aeroflutter cases > /dev/full"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr == "aeroflutter: cannot go on: No space left on device\n"


def test_cases(capsys: Capture) -> None:
    assert main(["cases", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)["cases"]
    assert [row["name"] for row in listed] == list(builtin_names())
    assert {"title", "omega_bar", "mu", "spring"} <= listed[0].keys()
    assert main(["cases"]) == 0
    text = capsys.readouterr().out
    assert all(name in text for name in builtin_names())


def test_validate(capsys: Capture, tmp_path: Path) -> None:
    assert main(["validate", "run14", "--set", "section.mu=50"]) == 0
    text = capsys.readouterr().out
    assert text.startswith("run14: ok\n")
    assert "mu = 50" in text

    assert main(["validate", "naca496", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["valid"] is True
    assert found["digest"] == load_case("naca496").digest
    assert load_case(found["case"]).section == load_case("naca496").section

    file = tmp_path / "bad.toml"
    file.write_text("")
    assert main(["validate", str(file), "--json"]) == 2
    out, err = capsys.readouterr()
    assert json.loads(out) == {"valid": False, "problems": [err.strip()[len("aeroflutter: ") :]]}


def test_init_writes_a_file_that_loads(capsys: Capture, tmp_path: Path) -> None:
    assert main(["init"]) == 0
    text = capsys.readouterr().out
    file = tmp_path / "case.toml"
    assert main(["init", str(file)]) == 0
    assert file.read_text() == text
    assert main(["validate", str(file)]) == 0
    capsys.readouterr()

    [line] = refused(capsys, "init", str(file))
    assert "--overwrite" in line
    assert main(["init", str(file), "--kind", "table", "--si", "--overwrite"]) == 0
    case = load_case(file)
    assert (case.spring.kind, case.section.scale is not None) == ("table", True)
    capsys.readouterr()

    [line] = refused(capsys, "init", str(tmp_path / "no" / "case.toml"))
    assert "cannot be written" in line
    [line] = refused(capsys, "init", str(tmp_path), "--overwrite")
    assert "is a directory" in line
    assert sorted(path.name for path in tmp_path.iterdir()) == ["case.toml"]


@settings(max_examples=100)
@given(data=mangled_bytes, as_json=st.booleans())
def test_mangled_file_ends_in_ok_or_in_lines(
    tmp_path_factory: pytest.TempPathFactory, data: bytes, as_json: bool
) -> None:
    file = tmp_path_factory.getbasetemp() / "mangled-cli.toml"
    file.write_bytes(data)
    code, out, err = run("validate", str(file), *(["--json"] if as_json else []))
    try:
        load_case(file)
    except InputError as error:
        assert code == 2
        assert err.splitlines() == [f"aeroflutter: {problem}" for problem in error.problems]
    else:
        assert (code, err) == (0, "")
        assert out
    if as_json:
        assert json.loads(out)["valid"] == (code == 0)


WORDS = ["cases", "validate", "run14", "--set", "section.mu=2", "--json", "--help", "-1", "--"]


@settings(max_examples=200)
@given(st.lists(st.sampled_from(WORDS) | st.text(), max_size=4))
def test_no_words_at_all_raise(words: list[str]) -> None:
    code, _, err = run(*words)
    assert code in (0, 2)
    assert all(line.startswith("aeroflutter: ") for line in err.splitlines())


def run(*words: str) -> tuple[int, str, str]:
    """Exit code, stdout and stderr; capsys is not for use inside hypothesis."""
    import contextlib
    import io

    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main(words)
    return code, out.getvalue(), err.getvalue()
