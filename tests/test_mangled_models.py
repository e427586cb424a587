"""Files of models gone wrong in every way: a case, or lines that say why, and no traceback."""

import io

import bah
import numpy as np
import pytest
import scipy.io
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from aeroflutter.cli import main

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
NASTY = [
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


def cut_op4():
    """The first four matrices: enough to be read, few enough to be mangled often."""
    text = bah.FILE.read_text().splitlines()
    heads = [i for i, line in enumerate(text) if "QHH" in line]
    return "\n".join(text[: heads[4]]).encode()


OP4 = cut_op4()
WRITERS = {"npz": npz, "mat": mat}


@st.composite
def files(draw):
    """Suffix, kind and bytes."""
    kind = draw(st.sampled_from(["state-space", "modal", "op4"]))
    if kind == "op4":
        data, suffix, kind = OP4, "op4", "modal"
    else:
        variables = dict(STATE_SPACE if kind == "state-space" else MODAL)
        for _ in range(draw(st.integers(0, 2))):
            name = draw(st.sampled_from([*variables, "D", "dt", "units", "rows", "stiffness"]))
            if draw(st.booleans()):
                variables.pop(name, None)
            else:
                variables[name] = draw(st.sampled_from(NASTY))
        suffix = draw(st.sampled_from(list(WRITERS)))
        data = WRITERS[suffix](variables)
    data = bytearray(data)
    for _ in range(draw(st.integers(0, 4))):
        place = draw(st.integers(0, max(0, len(data) - 1)))
        kind_of = draw(st.integers(0, 3))
        if kind_of == 0 and data:
            data[place] = draw(st.integers(0, 255))
        elif kind_of == 1:
            data = data[:place]
        elif kind_of == 2:
            data[place:place] = draw(st.binary(max_size=8))
        else:
            data[place : place + draw(st.integers(0, 40))] = b""
    if draw(st.integers(0, 9)) == 0:
        suffix = draw(st.sampled_from(["npz", "mat", "op4", "nc", "h5", "txt"]))
    return suffix, kind, bytes(data)


def check(folder, file, capsys):
    suffix, kind, data = file
    (folder / f"model.{suffix}").write_bytes(data)
    more = ""
    if suffix == "op4":
        more = "k = [0.1, 0.2, 0.5, 1.0]\nM = [" + "1.0, " * 10 + "]\nK = [" + "5.0, " * 10 + "]\n"
        more += "semichord = 2.0\ndensity = 1.2\n"
    lags = "lags = 1\n" if kind == "modal" else ""
    case = folder / "case.toml"
    case.write_text(f'[model]\nkind = "{kind}"\nfile = "model.{suffix}"\n{lags}{more}')
    code = main(["validate", str(case)])
    out, err = capsys.readouterr()
    assert code in (0, 2), err
    if code == 2:
        lines = err.splitlines()
        assert lines
        assert all(line.startswith("aeroflutter: ") for line in lines)
        assert out == ""
    else:
        assert "ok" in out


@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(file=files())
def test_a_mangled_file_gives_a_case_or_lines(file, tmp_path_factory, capsys):
    check(tmp_path_factory.getbasetemp(), file, capsys)


@pytest.mark.slow  # two thousand files
@settings(max_examples=2000, deadline=None, suppress_health_check=list(HealthCheck))
@given(file=files())
def test_two_thousand_mangled_files(file, tmp_path_factory, capsys):
    check(tmp_path_factory.getbasetemp(), file, capsys)


def test_the_untouched_files_are_read(tmp_path, capsys):
    """Or the mangled ones would prove nothing."""
    for kind, variables in (("state-space", STATE_SPACE), ("modal", MODAL)):
        for suffix, write in WRITERS.items():
            check(tmp_path, (suffix, kind, write(variables)), capsys)
            assert main(["validate", str(tmp_path / "case.toml")]) == 0
            capsys.readouterr()
    check(tmp_path, ("op4", "modal", OP4), capsys)
    assert main(["validate", str(tmp_path / "case.toml")]) == 0
