"""Arrays by name from npz, mat, NetCDF, HDF5 and OP4 files; nothing in them is ever executed."""

from __future__ import annotations

import io
import subprocess
import sys
import warnings
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from aeroflutter.errors import InputError

__all__ = ["SUFFIXES", "read_variables"]

SIZE_LIMIT = 1 << 30
"""Bytes; a state space of a hundred states at a hundred speeds takes eight million."""
PATIENCE = 120
"""Seconds that reading a file may take."""
_REFUSED = 2


def read_variables(path: str | Path) -> dict[str, Any]:
    """Variables of a file: arrays, and texts as ``str`` or lists of ``str``.

    Of an OP4 file each value is the list of all matrices of that name, in their order.

    Parameters
    ----------
    path
        Ends in ``.npz``, ``.mat``, ``.nc``, ``.h5`` or ``.op4``.

    Raises
    ------
    InputError
        If the file is not there, not what its name says, damaged or empty.
    """
    file = Path(path)
    read = SUFFIXES.get(file.suffix.lower())
    if read is None:
        raise InputError([f"{file.name}: must end in {', '.join(SUFFIXES)}"])
    try:
        size = file.stat().st_size
        if not file.is_file():
            raise InputError([f"{file.name}: is no file"])
        if size > SIZE_LIMIT:
            raise InputError([f"{file.name}: is larger than {SIZE_LIMIT} bytes"])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what a library thinks of a damaged file
            found = read(file)
    except InputError:
        raise
    except FileNotFoundError:
        raise InputError([f"{file.name}: no such file in {file.parent}"]) from None
    except PermissionError:
        raise InputError([f"{file.name}: cannot be read; you lack the permission"]) from None
    except MemoryError:
        raise InputError(
            [f"{file.name}: asks for more memory than there is; is it damaged?"]
        ) from (None)
    except Exception as error:  # noqa: BLE001  # readers meet damaged files in every way there is
        words = " ".join(str(error).split())[:120] or type(error).__name__
        kind = file.suffix.lower().lstrip(".")
        raise InputError(
            [f"{file.name}: is no {kind} file that can be read, or is damaged ({words})"]
        ) from None
    if not found:
        raise InputError([f"{file.name}: holds no variables"])
    return found


def _npz(file: Path) -> dict[str, Any]:
    if not zipfile.is_zipfile(file):
        raise InputError([f"{file.name}: is no npz file; write it with numpy.savez"])
    return _stored(io.BytesIO(file.read_bytes()))  # NumPy leaves a damaged file open


def _stored(source: BinaryIO) -> dict[str, Any]:
    with np.load(source, allow_pickle=False) as stored:
        return {name: _plain(stored[name]) for name in stored.files}


def _apart(file: Path) -> dict[str, Any]:
    """A file read by another process: on damaged ones readers in C crash the one they are in.

    The process writes what it found as npz.
    """
    words = [sys.executable, "-P", "-m", __name__, str(file.resolve())]
    try:
        done = subprocess.run(words, capture_output=True, timeout=PATIENCE, check=False)
    except subprocess.TimeoutExpired:
        raise InputError([f"{file.name}: takes longer to read than {PATIENCE} s"]) from None
    if done.returncode == _REFUSED:
        raise InputError(done.stderr.decode("utf-8", "replace").splitlines()[-1:])
    if done.returncode != 0:
        kind = file.suffix.lower().lstrip(".")
        raise InputError([f"{file.name}: is no {kind} file that can be read, or is damaged"])
    return _stored(io.BytesIO(done.stdout))


def _told(file: Path) -> int:
    """What the other process does."""
    try:
        found = _IN_C[file.suffix.lower()](file)
        if not found:
            raise InputError([f"{file.name}: holds no variables"])
        np.savez(sys.stdout.buffer, **found)
    except InputError as error:
        line = str(error)
        named = line if line.startswith(file.name) else f"{file.name}: {line}"
        print(" ".join(named.split()), file=sys.stderr)
        return _REFUSED
    return 0


def _mat(file: Path) -> dict[str, Any]:
    from scipy.io import loadmat

    with file.open("rb") as stream:
        head = stream.read(128)
    if head.startswith(b"MATLAB 7.3"):
        raise InputError([f"{file.name}: is a MATLAB 7.3 file; save it again with save(…, '-v7')"])
    stored = loadmat(file, squeeze_me=False, struct_as_record=True)
    return _records({name: value for name, value in stored.items() if not name.startswith("__")})


def _records(stored: Mapping[str, Any]) -> dict[str, Any]:
    """Variables, and the fields of structures as variables of their own where no other is so."""
    found: dict[str, Any] = {}
    inner: dict[str, Any] = {}
    for name, value in stored.items():
        array = np.asarray(value)
        if array.dtype.names:
            if array.size == 1:
                inner |= {field: array.ravel()[0][field] for field in array.dtype.names}
        else:
            found[name] = _plain(array)
    for name, value in inner.items():
        if name not in found and not np.asarray(value).dtype.names:
            found[name] = _plain(np.asarray(value))
    return found


def _netcdf(file: Path) -> dict[str, Any]:
    import netCDF4

    with netCDF4.Dataset(file, "r") as stored:
        stored.set_auto_mask(False)
        found = {**_of_group(stored)}
        for group in stored.groups.values():  # SHARPy keeps its matrices in a group
            found = {**_of_group(group), **found}
        found |= {name: _plain(np.asarray(stored.getncattr(name))) for name in stored.ncattrs()}
    return {name: value for name, value in found.items() if not name.startswith("_NC")}


def _of_group(group: Any) -> dict[str, Any]:
    found = {name: _plain(np.asarray(one[...])) for name, one in group.variables.items()}
    return {**_complex_pairs(found)}


def _complex_pairs(found: dict[str, Any]) -> dict[str, Any]:
    """``Q_re`` and ``Q_im``, since NetCDF has no complex numbers, as ``Q``."""
    for name in [name for name in found if name.endswith("_re")]:
        base = name.removesuffix("_re")
        other = found.get(f"{base}_im")
        if base not in found and isinstance(other, np.ndarray):
            real = found[name]
            if np.shape(real) == np.shape(other):
                found[base] = real + 1j * other
    return found


def _op4(file: Path) -> dict[str, Any]:
    from aeroflutter.model.elsewhere.op4 import read_op4

    found: dict[str, list[Any]] = {}
    for name, matrix in read_op4(file):
        found.setdefault(name, []).append(matrix)
    return found


def _plain(value: np.ndarray) -> Any:
    """Numbers as arrays; texts, cells and characters as ``str`` or a list of them."""
    if value.dtype.kind == "V" and value.dtype.names and set(value.dtype.names) == {"r", "i"}:
        return value["r"] + 1j * value["i"]  # how HDF5 libraries write complex numbers
    if value.dtype.kind == "O":
        words = [_text(item) for item in value.ravel()]
        return words[0] if value.ndim == 0 else words
    if value.dtype.kind in "US":
        words = [_text(item) for item in value.ravel()]
        return words[0] if value.ndim == 0 or value.size == 1 else words
    if value.dtype.kind not in "biufc":
        raise InputError([f"holds values of type {value.dtype}; give numbers or texts"])
    return value


def _text(item: Any) -> str:
    if isinstance(item, np.ndarray):
        if item.dtype.kind in "US" and item.size == 1:
            item = item.ravel()[0]
        elif item.dtype.kind not in "US" or item.size != 0:
            raise InputError(["holds cells that are not texts"])
        else:
            item = ""
    if isinstance(item, bytes):
        item = item.decode("utf-8", "replace")
    if not isinstance(item, str):
        raise InputError(["holds objects, which are not read; give numbers or texts"])
    return item.strip()


_IN_C: dict[str, Callable[[Path], dict[str, Any]]] = {
    ".mat": _mat,
    ".nc": _netcdf,
    ".h5": _netcdf,
}
SUFFIXES: dict[str, Callable[[Path], dict[str, Any]]] = {
    ".npz": _npz,
    ".mat": _apart,
    ".nc": _apart,
    ".h5": _apart,
    ".op4": _op4,
}
"""Readers by the end of a file's name."""

if __name__ == "__main__":
    sys.exit(_told(Path(sys.argv[1])))
