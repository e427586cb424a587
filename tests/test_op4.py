"""OUTPUT4 files: as Nastran writes them in ASCII, and binary ones packed here by the layout."""

import struct

import bah
import numpy as np
import pytest

from aeroflutter.errors import InputError
from aeroflutter.model.elsewhere.op4 import read_op4

# Strings of a sparse matrix with 64-bit rows (a negative number of them), as MSC Nastran wrote
# them: complex of double precision, real of double precision.
BIG = """\
       2      -5       6       4EYE2CD  1P,3E22.15
       1       0       6
       5       1
-1.000000000000000E+00 1.000000000000000E+00
       2       0       6
       5       2
-1.000000000000000E+00 1.000000000000000E+00
       3       1       1
 1.000000000000000E+00
       3      -5       2       2LOW     1P,3E23.16
       1       0      10
       9       2
 1.0000000000000000E+00 1.0000000000000000E+00 1.0000000000000000E+00
 1.0000000000000000E+00
       3       0       8
       3       1
 2.0000000000000000E+00
       3       5
 3.0000000000000000E+00
       4       1       1
 1.0000000000000000E+00
"""


def test_the_wing_of_nastran():
    matrices = read_op4(bah.FILE)
    assert [name for name, _ in matrices] == ["QHH"] * 30
    assert matrices[0][1].shape == (10, 10)
    assert matrices[0][1][0, 0] == -7.207785778e-04 - 2.555991306e-05j
    assert matrices[0][1][1, 0] == 3.935060068e-03 + 8.960430340e-06j


def test_strings_of_sparse_columns(tmp_path):
    (tmp_path / "big.op4").write_text(BIG)
    (eye, first), (low, second) = read_op4(tmp_path / "big.op4")
    assert (eye, low) == ("EYE2CD", "LOW")
    np.testing.assert_array_equal(first[:2], (-1 + 1j) * np.eye(2))
    assert not first[2:].any()
    expected = np.zeros((5, 3))
    expected[1:, 0], expected[0, 2], expected[4, 2] = 1.0, 2.0, 3.0
    np.testing.assert_array_equal(second, expected)
    packed = BIG.replace("      -5", "       5").replace(
        "       5       1\n", f"{1 + 65536 * 5:8d}\n"
    )
    packed = packed.replace("       5       2\n", f"{2 + 65536 * 5:8d}\n").split(
        "       3       5"
    )[0]
    small = packed.replace("       1       0       6", "       1       0       5").replace(
        "       2       0       6", "       2       0       5"
    )
    (tmp_path / "small.op4").write_text(small.split("       3       5       2")[0])
    ((_, third),) = read_op4(tmp_path / "small.op4")
    np.testing.assert_array_equal(third, first)


def record(order, data):
    length = struct.pack(f"{order}i", len(data))
    return length + data + length


def binary(order, name, matrix, sparse=False, single=False):
    """One matrix as FORTRAN records; a sparse column as strings of its runs."""
    rows, columns = matrix.shape
    kind = {(False, True): 1, (False, False): 2, (True, True): 3, (True, False): 4}[
        np.iscomplexobj(matrix), single
    ]
    number = np.dtype(f"{order}f{4 if single else 8}")
    out = record(order, struct.pack(f"{order}4i8s", columns, rows, 2, kind, name.ljust(8).encode()))
    for j in range(columns):
        column = matrix[:, j]
        flat = column.view(float) if np.iscomplexobj(matrix) else column
        data = np.ascontiguousarray(flat).astype(number).tobytes()
        if sparse:
            width = len(data) // rows
            parts = b""
            for i in np.flatnonzero(column):
                words = width // 4
                parts += struct.pack(f"{order}i", i + 1 + 65536 * (words + 1))
                parts += data[i * width : (i + 1) * width]
            head = struct.pack(f"{order}3i", j + 1, 0, len(parts) // 4)
            out += record(order, head + parts)
        else:
            out += record(order, struct.pack(f"{order}3i", j + 1, 1, len(data) // 4) + data)
    end = struct.pack(f"{order}3i", columns + 1, 1, 1) + np.ones(1).astype(number).tobytes()
    return out + record(order, end)


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("single", [False, True])
@pytest.mark.parametrize("sparse", [False, True])
def test_binary_files(tmp_path, order, single, sparse):
    rng = np.random.default_rng(7)
    real = rng.normal(size=(4, 3)).round(2)
    both = np.asfortranarray(rng.normal(size=(3, 3)) + 1j * rng.normal(size=(3, 3))).round(2)
    real[1] = both[2] = 0.0
    both = np.ascontiguousarray(both.T).T  # columns contiguous
    written = binary(order, "REAL", real, sparse, single) + binary(
        order, "BOTH", both, sparse, single
    )
    (tmp_path / "b.op4").write_bytes(written)
    found = dict(read_op4(tmp_path / "b.op4"))
    tolerance = 1e-6 if single else 0.0
    np.testing.assert_allclose(found["REAL"], real, rtol=tolerance)
    np.testing.assert_allclose(found["BOTH"], both, rtol=tolerance)
    (tmp_path / "cut.op4").write_bytes(written[:-9])
    with pytest.raises(InputError, match="truncated"):
        read_op4(tmp_path / "cut.op4")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda text: text.replace("1P,3E22.15", "free"), "the format of the numbers is missing"),
        (lambda text: text.replace("-1.000000000000000E+00", "-1.0000000x0000000E+00"), "due"),
        (
            lambda text: text.replace("       2      -5       6       4", "       2       x"),
            "neither",
        ),
        (lambda text: text.replace("       5       2\n", "       5       9\n"), "beyond its size"),
        (lambda text: text[:120], "truncated"),
        (lambda text: text.replace("       6       4EYE", "       6       7EYE"), "is of type 7"),
    ],
)
def test_damaged_files_say_where(tmp_path, change, words):
    (tmp_path / "bad.op4").write_text(change(BIG))
    with pytest.raises(InputError, match=words) as caught:
        read_op4(tmp_path / "bad.op4")
    assert len(caught.value.problems) == 1
    assert caught.value.problems[0].startswith("bad.op4: ")
