"""Files of models gone wrong in every way: a case, or lines that say why, and no traceback."""

import bah
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from aeroflutter.cli import main
from tests.mangled import MODAL, NASTY_ARRAYS, STATE_SPACE, mat, npz


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
                variables[name] = draw(st.sampled_from(NASTY_ARRAYS))
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
