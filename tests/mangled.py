"""Case files gone wrong in every way a file can, and what files of models may hold instead."""

import io
from collections.abc import Callable

import numpy as np
import scipy.io
from hypothesis import strategies as st

from aeroflutter.case.source import builtin_names, read_case
from aeroflutter.case.template import template

VALID = [read_case(name) for name in builtin_names()]
VALID += [template("table"), template("bilinear", dimensional=True), template("hysteresis")]

NASTY = [
    "nan", "-inf", "1e400", "-1e308", "1e-320", "0", "-1", "true", '""', '"text"', "[]", "{}",
    "[1, [2, [3]]]", "1979-05-27", "0x" + "f" * 400, "1" + "0" * 400, "1" * 5000, "'a\tb'",
    '"""a\nb"""', '"\\u0000"', '"\\U0010ffff"', "[nan, inf]", "{a = 1}", "", "'", "#", "=", "\0",
    "[" * 3000, "1.", ".5", "1_000", "[1.0, -1.0, 0.5]", '"hysteresis"', '"wagner"', "\u2028",
]  # fmt: skip

Lines = list[str]


def _drop(lines: Lines, i: int, j: int) -> Lines:
    return lines[:i] + lines[i + 1 :]


def _repeat(lines: Lines, i: int, j: int) -> Lines:
    return [*lines[:i], lines[j % len(lines)], *lines[i:]]


def _new_value(lines: Lines, i: int, j: int) -> Lines:
    name = lines[i].partition("=")[0]
    return [*lines[:i], f"{name}= {NASTY[j % len(NASTY)]}", *lines[i + 1 :]]


def _new_key(lines: Lines, i: int, j: int) -> Lines:
    return [*lines[:i], f"extra = {NASTY[j % len(NASTY)]}", *lines[i:]]


def _new_line(lines: Lines, i: int, j: int) -> Lines:
    return [*lines[:i], NASTY[j % len(NASTY)], *lines[i:]]


def _misspell(lines: Lines, i: int, j: int) -> Lines:
    line, place = lines[i], j % 30
    return [*lines[:i], line[:place] + chr(j % 0xD800) + line[place + 1 :], *lines[i + 1 :]]


def _lose_letter(lines: Lines, i: int, j: int) -> Lines:
    line, place = lines[i], j % (len(lines[i]) or 1)
    return [*lines[:i], line[:place] + line[place + 1 :], *lines[i + 1 :]]


def _truncate(lines: Lines, i: int, j: int) -> Lines:
    return [*lines[:i], lines[i][: j % 40]]


def _uncomment(lines: Lines, i: int, j: int) -> Lines:
    return [*lines[:i], lines[i].lstrip("# "), *lines[i + 1 :]]


def _carriage_returns(lines: Lines, i: int, j: int) -> Lines:
    return [line + "\r" for line in lines]


MUTATIONS: list[Callable[[Lines, int, int], Lines]] = [
    _drop, _repeat, _new_value, _new_value, _new_key, _new_line, _misspell, _lose_letter,
    _truncate, _uncomment, _uncomment, _carriage_returns,
]  # fmt: skip

_STEP = st.tuples(st.integers(0, len(MUTATIONS) - 1), st.integers(0, 99), st.integers(0, 0x2FFF))
_FLIP = st.tuples(st.integers(0, 0xFFFF), st.integers(0, 255))


def _mangle(text: str, steps: list[tuple[int, int, int]], flips: list[tuple[int, int]]) -> bytes:
    lines = text.split("\n")
    for kind, i, j in steps:
        lines = MUTATIONS[kind](lines, i % len(lines), j) or [""]
    data = bytearray("\n".join(lines).encode())
    for place, value in flips if data else []:
        data[place % len(data)] = value
    return bytes(data)


mangled_bytes = st.one_of(
    st.builds(
        _mangle, st.sampled_from(VALID), st.lists(_STEP, min_size=1, max_size=4), st.just([])
    ),
    st.builds(
        _mangle, st.sampled_from(VALID), st.lists(_STEP, max_size=3), st.lists(_FLIP, max_size=3)
    ),
    st.binary(max_size=200),
)

RNG = np.random.default_rng(11)
A = RNG.normal(size=(3, 4, 4)) - 3 * np.eye(4)
STATE_SPACE = {
    "speeds": np.array([10.0, 20.0, 30.0]), "A": A, "B": RNG.normal(size=(3, 4, 1)),
    "C": np.eye(4)[:1], "names": np.array(["tail"]), "time_unit": np.array("s"),
}  # fmt: skip
K = np.array([0.0, 0.2, 0.5, 1.0])
MODAL = {
    "M": np.eye(2), "K": np.diag([3.0, 9.0]), "k": K, "semichord": 0.5, "density": 1.2,
    "Q": (0.1 + 0.2j * K)[:, None, None] * RNG.normal(size=(2, 2)),
}  # fmt: skip
NASTY_ARRAYS = [
    np.nan, np.inf, 0, -1, 1e308, 1e-308, 1j, "text", [], [[]], [1.0, np.nan], np.zeros((2, 2)),
    np.ones((4, 4, 4)), np.eye(3), np.array(["a", "b"]), True, np.ones(3, dtype=complex) * 1j,
    np.arange(24.0).reshape(2, 3, 4), np.array(b"bytes"), np.float32(3), 10**9, -K, K[::-1],
]  # fmt: skip


def npz(given):
    stream = io.BytesIO()
    np.savez(stream, **given)
    return stream.getvalue()


def mat(given):
    stream = io.BytesIO()
    scipy.io.savemat(stream, given)
    return stream.getvalue()
