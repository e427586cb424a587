"""A disk without room: the result is told, one line says what stopped the file, none is left."""

from __future__ import annotations

import resource
import sys
from pathlib import Path

import pytest

from aeroflutter.cli import main


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("rootlocus linear-02 --out {}/a.nc", "flutter speed"),
        ("rootlocus linear-02 --plot {}/a.png", "flutter speed"),
        ("onset run14 --certificate {}/a.json", "proved free"),
    ],
)
def test_the_result_is_told_where_its_file_has_no_room(
    tmp_path: Path, capsys, monkeypatch, words: str, told: str
) -> None:
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (2_000, before[1]))
    try:
        code = main(words.format(tmp_path).split())
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    out, err = capsys.readouterr()
    assert code in (1, 2)
    assert told in out
    [line] = err.splitlines()
    assert "cannot be written: File too large" in line
    assert list(tmp_path.iterdir()) == []
