"""Matrices of Nastran's OUTPUT4, ASCII or binary, dense or sparse.

A matrix is a header (columns, rows, form, type, name and, in ASCII, the FORTRAN format of its
numbers) and records of columns: number, first row, count of words, then the numbers, real and
imaginary parts in turn. First row 0 announces strings of a sparse column, each with its own first
row, packed into one integer (``row + 65536 (length + 1)``) unless the header's number of rows is
negative. A last record numbered one beyond the columns ends the matrix. The layout is documented in
the MSC Nastran DMAP Programmer's Guide under OUTPUT4.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from aeroflutter.errors import InputError

__all__ = ["read_op4"]

Matrix = NDArray[Any]

_FORMAT = re.compile(r"(?:1P,)?(\d+)[ED](\d+)\.\d+", re.IGNORECASE)
_MOST = 20_000  # rows or columns: generalised matrices have tens
_TYPES = {1: "f", 2: "d", 3: "f", 4: "d"}  # single or double precision


@dataclass(frozen=True)
class _Header:
    columns: int
    rows: int
    type: int
    name: str
    big: bool

    @classmethod
    def of(cls, columns: int, rows: int, kind: int, name: str) -> _Header:
        """A header whose numbers make sense."""
        label = name.strip()
        if kind not in _TYPES:
            raise InputError([f"matrix {label!r}: is of type {kind}; those known are 1 to 4"])
        if not (0 < columns <= _MOST and 0 < abs(rows) <= _MOST):
            raise InputError([f"matrix {label!r}: has {abs(rows)} rows and {columns} columns"])
        if not label.isprintable() or not label:
            raise InputError(["a matrix has no name; is the file an OP4 file?"])
        return cls(columns, abs(rows), kind, label, rows < 0)

    @property
    def complex(self) -> bool:
        return self.type > 2

    def empty(self) -> Matrix:
        return np.zeros((self.rows, self.columns), dtype=complex if self.complex else float)

    def place(self, matrix: Matrix, column: int, row: int, numbers: Matrix) -> None:
        """Write numbers down a column from a row on, both counted from 1."""
        values = numbers[::2] + 1j * numbers[1::2] if self.complex else numbers
        if not (1 <= column <= self.columns and 1 <= row <= self.rows - len(values) + 1):
            raise InputError(
                [f"matrix {self.name!r}: column {column} goes from row {row} beyond its size"]
            )
        matrix[row - 1 : row - 1 + len(values), column - 1] = values


def read_op4(path: str | Path) -> list[tuple[str, Matrix]]:
    """All matrices of an OP4 file with their names, in their order.

    Raises
    ------
    InputError
        If the file is none, or ends inside a matrix.
    """
    file = Path(path)
    try:
        with file.open("rb") as stream:
            ascii_file = stream.read(32).strip(b" 0123456789-\r\n\t") == b"" and file.stat().st_size
            stream.seek(0)
            found = list(_ascii(stream) if ascii_file else _binary(stream))
    except InputError as error:
        raise InputError([f"{file.name}: {problem}" for problem in error.problems]) from None
    if not found:
        raise InputError([f"{file.name}: holds no matrix"])
    return found


# --- ASCII ---------------------------------------------------------------------------------------


class _Lines:
    """Lines of an ASCII file, counted."""

    def __init__(self, stream: BinaryIO) -> None:
        try:
            self.lines = stream.read().decode("ascii").splitlines()
        except UnicodeDecodeError:
            raise InputError(["is neither ASCII nor a binary OP4 file"]) from None
        self.at = 0

    def done(self) -> bool:
        """Whether nothing but blanks is left."""
        return not any(line.strip() for line in self.lines[self.at :])

    def next(self) -> str:
        if self.at >= len(self.lines):
            raise InputError(["ends inside a matrix; it is truncated"])
        self.at += 1
        return self.lines[self.at - 1]

    def integers(self, count: int) -> list[int]:
        line = self.next()
        try:
            values = [int(word) for word in line.split()]
        except ValueError:
            values = []
        if len(values) != count:
            raise InputError(
                [f"line {self.at}: {count} integers are due, not {line.strip()!r:.60}"]
            )
        return values

    def numbers(self, count: int, width: int) -> Matrix:
        values: list[float] = []
        while len(values) < count:
            line = self.next().rstrip()
            words = [line[i : i + width] for i in range(0, len(line), width)]
            try:
                values += [float(word.replace("D", "E").replace("d", "e")) for word in words]
            except ValueError:
                raise InputError([f"line {self.at}: numbers are due, not {line!r:.60}"]) from None
            if not words:
                raise InputError([f"line {self.at}: is blank inside a matrix"])
        if len(values) > count:
            raise InputError([f"line {self.at}: holds more numbers than its record says"])
        return np.array(values)


def _ascii(stream: BinaryIO) -> Iterator[tuple[str, Matrix]]:
    lines = _Lines(stream)
    while not lines.done():
        line = lines.next()
        where = lines.at
        try:
            columns, rows, _, kind = (int(line[i : i + 8]) for i in range(0, 32, 8))
        except ValueError:
            raise InputError([f"line {where}: the header of a matrix is due"]) from None
        layout = _FORMAT.search(line[40:])
        if layout is None:
            raise InputError([f"line {where}: the format of the numbers is missing"])
        header = _Header.of(columns, rows, kind, line[32:40])
        yield header.name, _ascii_matrix(lines, header, int(layout[2]))


def _ascii_matrix(lines: _Lines, header: _Header, width: int) -> Matrix:
    matrix = header.empty()
    if not 1 <= width <= 64:
        raise InputError([f"line {lines.at}: numbers of {width} characters"])
    while True:
        column, row, words = lines.integers(3)
        if words < 0:
            raise InputError([f"line {lines.at}: a record of {words} words"])
        if column > header.columns:
            lines.next()  # a number that stands for nothing
            return matrix
        if row > 0:
            header.place(matrix, column, row, lines.numbers(words, width))
        else:
            _ascii_strings(lines, header, matrix, (column, words, width))


def _ascii_strings(
    lines: _Lines, header: _Header, matrix: Matrix, record: tuple[int, int, int]
) -> None:
    """Strings of a sparse column; lengths are in words of single precision."""
    column, left, width = record
    single = 1 if header.type in (1, 3) else 2
    while left > 0:
        if header.big:
            length, row = lines.integers(2)
            length, left = length - 1, left - 2
        else:
            (packed,) = lines.integers(1)
            length = packed // 65536 - 1
            row, left = packed - 65536 * (length + 1), left - 1
        if length <= 0 or length > left:
            raise InputError([f"line {lines.at}: a string of {length} words in a record of {left}"])
        header.place(matrix, column, row, lines.numbers(length // single, width))
        left -= length


# --- binary --------------------------------------------------------------------------------------


class _Records:
    """FORTRAN records of a binary file, framed by their lengths."""

    def __init__(self, stream: BinaryIO) -> None:
        self.data = stream.read()
        self.at = 0
        if len(self.data) < 8:
            raise InputError(["is too short to be an OP4 file"])
        lengths = {order: struct.unpack(f"{order}i", self.data[:4])[0] for order in "<>"}
        found = [order for order, length in lengths.items() if length in (24, 48)]
        if not found:
            raise InputError(["is neither an ASCII nor a binary OP4 file"])
        self.order = found[0]

    def done(self) -> bool:
        return self.at >= len(self.data)

    def next(self) -> bytes:
        """The next record."""
        start = self.at + 4
        if start > len(self.data):
            raise InputError(["ends inside a matrix; it is truncated"])
        (length,) = struct.unpack(f"{self.order}i", self.data[self.at : start])
        end = start + length
        if length < 0 or end + 4 > len(self.data):
            raise InputError(["ends inside a matrix; it is truncated"])
        if self.data[end : end + 4] != self.data[self.at : start]:
            raise InputError([f"byte {end}: a record does not end where it says; it is damaged"])
        self.at = end + 4
        return self.data[start:end]


def _binary(stream: BinaryIO) -> Iterator[tuple[str, Matrix]]:
    records = _Records(stream)
    while not records.done():
        head = records.next()
        if len(head) not in (24, 48):
            raise InputError([f"byte {records.at}: the header of a matrix is due"])
        layout = "4i8s" if len(head) == 24 else "4q16s"
        columns, rows, _, kind, name = struct.unpack(records.order + layout, head)
        header = _Header.of(columns, rows, kind, name.decode("ascii", "replace"))
        yield header.name, _binary_matrix(records, header, 4 if len(head) == 24 else 8)


def _binary_matrix(records: _Records, header: _Header, word: int) -> Matrix:
    matrix = header.empty()
    integers, size = ("i", 4) if word == 4 else ("q", 8)
    number = _TYPES[header.type] if word == 4 else "d"
    kind = np.dtype(f"{records.order}{'f4' if number == 'f' else 'f8'}")
    while True:
        data = records.next()
        if len(data) < 3 * size:
            raise InputError([f"byte {records.at}: a record of a column is due"])
        column, row, words = struct.unpack(f"{records.order}3{integers}", data[: 3 * size])
        body = data[3 * size :]
        if column > header.columns:
            return matrix
        if words < 0 or len(body) < words * word:
            raise InputError([f"byte {records.at}: a record shorter than it says"])
        body = body[: words * word]
        if row > 0:
            header.place(matrix, column, row, _values(body, kind))
        else:
            for first, part in _binary_strings(body, records.order, integers, size, header.big):
                header.place(matrix, column, first, _values(part, kind))


def _binary_strings(
    body: bytes, order: str, integers: str, size: int, big: bool
) -> Iterator[tuple[int, bytes]]:
    at = 0
    while at < len(body):
        heads = 2 if big else 1
        if at + heads * size > len(body):
            raise InputError(["a string is cut off; the file is damaged"])
        values = struct.unpack(f"{order}{heads}{integers}", body[at : at + heads * size])
        if big:
            length, row = values[0] - 1, values[1]
        else:
            length = values[0] // 65536 - 1
            row = values[0] - 65536 * (length + 1)
        at += heads * size
        end = at + length * size
        if length <= 0 or end > len(body):
            raise InputError([f"a string of {length} words goes beyond its record"])
        yield row, body[at:end]
        at = end


def _values(data: bytes, kind: np.dtype[Any]) -> Matrix:
    if len(data) % kind.itemsize:
        raise InputError(["a number is cut off; the file is damaged"])
    return np.frombuffer(data, dtype=kind).astype(float)
