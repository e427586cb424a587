"""What the commands share: numbers in, JSON out, files written whole or not at all."""

import json
import math
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeroflutter.cli.common import (
    CaseOptions,
    Output,
    numbers,
    plain,
    print_json,
    show_facts,
    show_table,
)
from aeroflutter.errors import InputError
from aeroflutter.files import replacing

Capture = pytest.CaptureFixture[str]


# A:B:N


@given(
    low=st.floats(-1e6, 1e6),
    high=st.floats(-1e6, 1e6),
    count=st.integers(2, 50),
)
def test_range_includes_both_ends(low: float, high: float, count: int) -> None:
    values = numbers("--speeds", f"{low!r}:{high!r}:{count}")
    assert values.shape == (count,)
    assert (values[0], values[-1]) == (low, high)
    np.testing.assert_allclose(np.diff(values), (high - low) / (count - 1), atol=1e-9)


def test_lists_and_single_numbers() -> None:
    assert numbers("--speeds", "1,2.5, -3e-1").tolist() == [1.0, 2.5, -0.3]
    assert numbers("--speeds", "4").tolist() == [4.0]
    assert numbers("--speeds", "4:5:1").tolist() == [4.0]


@pytest.mark.parametrize(
    "text",
    ["", "a", "1,", "1:2", "1:2:3:4", "1:2:0", "1:2:-3", "1:2:2.5", "1:2:x", "nan:2:3", "1:inf:3",
     "1,nan", "1:2:99999999999", "::"],
)  # fmt: skip
def test_bad_numbers_name_the_option(text: str) -> None:
    with pytest.raises(InputError, match="--speeds: ") as caught:
        numbers("--speeds", text)
    assert len(caught.value.problems) == 1


# JSON


def test_json_types(capsys: Capture) -> None:
    print_json(
        {
            "complex": 1 - 2j,
            "array": np.array([[1.0, math.nan], [math.inf, -0.5]]),
            "roots": np.array([1j, 2.0]),
            "scalar": np.float32(0.5),
            "integer": np.int64(3),
            "flag": np.bool_(True),
            "plain flag": False,
            "none": None,
            "nan": math.nan,
            "tuple": (1, "x", None),
            "path": Path("a/b"),
            "nested": {1: {"set": {2}}},
        }
    )
    out = capsys.readouterr().out
    assert out.count("\n") == 1
    assert json.loads(out) == {
        "complex": [1.0, -2.0],
        "array": [[1.0, None], [None, -0.5]],
        "roots": [[0.0, 1.0], [2.0, 0.0]],
        "scalar": 0.5,
        "integer": 3,
        "flag": True,
        "plain flag": False,
        "none": None,
        "nan": None,
        "tuple": [1, "x", None],
        "path": "a/b",
        "nested": {"1": {"set": [2]}},
    }


@given(
    st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats() | st.complex_numbers() | st.text(),
        lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
        max_leaves=10,
    )
)
def test_anything_becomes_strict_json(value: Any) -> None:
    json.dumps(plain(value), allow_nan=False)


# Output


@pytest.mark.parametrize(
    ("output", "words"),
    [
        (Output(plot=Path("x.gif")), ["--plot x.gif", ".png or .svg or .pdf"]),
        (Output(plot=Path("x")), ["--plot x", ".png"]),
        (Output(out=Path("x.csv")), ["--out x.csv", ".nc"]),
        (Output(out=Path("no/such/x.nc")), ["--out", "no folder no/such"]),
    ],
)
def test_targets_are_checked_before_any_work(output: Output, words: list[str]) -> None:
    with pytest.raises(InputError) as caught:
        output.check()
    [problem] = caught.value.problems
    assert all(word in problem for word in words)


def test_directory_is_no_target(tmp_path: Path) -> None:
    (tmp_path / "x.nc").mkdir()
    with pytest.raises(InputError, match="is a directory"):
        Output(out=tmp_path / "x.nc").check()


def test_good_targets_pass(tmp_path: Path) -> None:
    Output().check()
    Output(out=tmp_path / "x.nc", plot=tmp_path / "x.PNG").check()


def test_deliver_prints_saves_and_draws(tmp_path: Path, capsys: Capture) -> None:
    import xarray as xr
    from matplotlib.figure import Figure

    out, plot = tmp_path / "x.nc", tmp_path / "x.png"
    dataset = xr.Dataset({"speed": ("i", [1.0, 2.0])})
    output = Output(out=out, plot=plot, json=True)
    output.deliver({"a": 1}, text=lambda: print("text"), dataset=lambda: dataset, figure=Figure)
    assert json.loads(capsys.readouterr().out) == {"a": 1}
    with xr.open_dataset(out) as saved:
        assert saved.identical(dataset)
    assert plot.read_bytes().startswith(b"\x89PNG")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["x.nc", "x.png"]

    Output(plot=plot).deliver({"a": 1}, text=lambda: print("text"), figure=Figure)
    assert capsys.readouterr().out == f"text\nwritten: {plot}\n"


def test_failure_leaves_the_older_file_alone(tmp_path: Path) -> None:
    file = tmp_path / "x.txt"
    file.write_text("old")

    def fail() -> None:
        with replacing(file) as part:
            part.write_text("half")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert file.read_text() == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["x.txt"]
    with replacing(file) as part:
        part.write_text("new")
    assert file.read_text() == "new"
    umask = os.umask(0)
    os.umask(umask)
    assert file.stat().st_mode & 0o777 == 0o666 & ~umask


def test_text_for_people(capsys: Capture) -> None:
    show_facts({"speed": 6.2851234, "mode": "flutter", "none": None, "nan": math.nan, "ok": True})
    assert capsys.readouterr().out.splitlines() == [
        "speed: 6.28512",
        "mode:  flutter",
        "none:  -",
        "nan:   -",
        "ok:    yes",
    ]
    show_table(("name", "U*"), [("[bold]a", 1.0), ("b", 1234567.0)])
    heading, rule, *rows = capsys.readouterr().out.splitlines()
    assert heading.split() == ["name", "U*"]
    assert set(rule) <= {"─", " "}
    assert [row.split() for row in rows] == [["[bold]a", "1"], ["b", "1.23457e+06"]]


def test_set_changes_the_case() -> None:
    case = CaseOptions(set=["section.mu=50", "spring.delta_v_deg=0"]).load("run14")
    assert case.section.mu == 50.0
    assert case.tables["spring"]["delta_v_deg"] == 0.0
