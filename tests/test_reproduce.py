"""The thesis's exhibits: chosen by number, kept when nothing changed, made again when it did."""

import json
from pathlib import Path

import pytest

from aeroflutter.case import load_case
from aeroflutter.cli import main
from aeroflutter.errors import InputError
from aeroflutter.reproduce import EXHIBITS, choose, reproduce
from aeroflutter.reproduce.table import THESIS

QUICK = ("3.2", "4.9", "4.12")


def test_every_figure_with_known_parameters_is_there() -> None:
    numbers = {exhibit.number for exhibit in EXHIBITS}
    assert len(numbers) == len(EXHIBITS)
    expected = {f"4.{i}" for i in range(1, 13)} | {f"5.{i}" for i in range(1, 5)} | {"table-5.1"}
    lost = {14, 15, 16}  # runs 104, 105 and 110
    expected |= {f"5.{i}{part}" for i in range(5, 32) if i not in lost for part in "abc"}
    assert expected <= numbers


def test_every_exhibit_has_a_case_that_loads() -> None:
    for exhibit in EXHIBITS:
        load_case(exhibit.case, exhibit.changes)


@pytest.mark.parametrize(
    ("only", "numbers"),
    [
        (["5.7"], ["5.7a", "5.7b", "5.7c"]),
        (["5.7b"], ["5.7b"]),
        (["table-5.1", "4.10"], ["4.10", "table-5.1"]),
        (["4.1"], ["4.1"]),
    ],
)
def test_numbers_choose(only: list[str], numbers: list[str]) -> None:
    assert [exhibit.number for exhibit in choose(only)] == numbers


def test_numbers_that_choose_nothing_say_why() -> None:
    with pytest.raises(InputError) as caught:
        choose(["5.14", "9.9", "4.2"])
    assert len(caught.value.problems) == 2
    assert "run 104 are lost" in caught.value.problems[0]
    assert "--only 9.9: no such figure" in caught.value.problems[1]


def test_what_is_there_is_kept_and_what_is_spoilt_is_made_again(tmp_path: Path) -> None:
    first = reproduce(choose(QUICK), tmp_path, workers=1)
    assert [one.problem for one in first] == ["", "", ""]
    assert all(one.fresh and one.file.stat().st_size > 1000 for one in first)
    again = reproduce(choose(QUICK), tmp_path, workers=1)
    assert not any(one.fresh for one in again)
    assert [one.caption for one in again] == [one.caption for one in first]
    first[0].file.write_bytes(b"")
    record = tmp_path / "figure-4.09.json"
    record.write_text(json.dumps({**json.loads(record.read_text()), "identity": "of other code"}))
    third = reproduce(choose(QUICK), tmp_path, workers=1)
    assert [one.fresh for one in third] == [True, True, False]


def test_two_workers_make_the_same_bytes(tmp_path: Path) -> None:
    one = reproduce(choose(QUICK), tmp_path / "one", workers=1)
    two = reproduce(choose(QUICK), tmp_path / "two", workers=2)
    for a, b in zip(one, two, strict=True):
        assert a.file.name == b.file.name
        assert a.file.read_bytes() == b.file.read_bytes()


def test_one_that_fails_does_not_stop_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from aeroflutter.reproduce import figures

    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError("no such motion")

    monkeypatch.setitem(figures.KINDS, "gains", broken)
    words = [word for number in QUICK for word in ("--only", number)]
    assert main(["reproduce", *words, "--folder", str(tmp_path), "--workers", "1"]) == 3
    told = capsys.readouterr()
    assert "Figure 4.12: Describing function against amplitude: ZeroDivisionError" in told.err
    assert "written: 2 exhibits" in told.out
    page = (tmp_path / "index.html").read_text()
    assert "figure-4.09.svg" in page
    assert "figure-4.12" not in page


def test_the_table_has_the_rows_of_the_thesis() -> None:
    assert [run for run, _, _ in THESIS] == [6, 10, 14, 15, 16, 100, 101, 102, 103, 111]


@pytest.mark.parametrize("number", ["3.2", "4.1", "4.9", "4.10", "4.11", "4.12", "5.2", "5.4"])
def test_every_axis_is_named_and_no_text_leaves_the_page(number: str) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    from aeroflutter.reproduce import figures

    (exhibit,) = choose([number])
    case = load_case(exhibit.case, exhibit.changes)
    drawing = figures.KINDS[exhibit.kind](case, exhibit.title, **exhibit.settings).figure
    assert drawing is not None
    canvas = FigureCanvasAgg(drawing)
    canvas.draw()
    for axes in drawing.axes:
        assert axes.get_ylabel()
        assert axes.get_xlabel() or not axes.xaxis.get_tick_params()["labelbottom"]
    texts = [*drawing.texts, *(a.xaxis.label for a in drawing.axes)]
    texts += [a.yaxis.label for a in drawing.axes] + [a.title for a in drawing.axes]
    boxes = [t.get_window_extent(canvas.get_renderer()) for t in texts if t.get_text()]
    for i, box in enumerate(boxes):
        assert min(box.x0, box.y0) >= 0
        assert max(box.x1 - drawing.bbox.x1, box.y1 - drawing.bbox.y1) <= 0
        assert not any(box.overlaps(other) for other in boxes[:i])
