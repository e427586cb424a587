"""Types of a kernel's arguments: the annotations that say what an entry point is compiled for.

`float`, `int`, `bool` and `complex` are doubles, 64-bit integers, Booleans and pairs of doubles; a
`NamedTuple` is the tuple of its fields, `Annotated[tuple[float, ...], 4]` one of four doubles.
Arrays are contiguous in C order; the names here say their kind and their rank.
"""

from __future__ import annotations

from collections.abc import Callable
from types import NoneType
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import numpy as np
from numba import types
from numpy.typing import NDArray

__all__ = [
    "Complex1",
    "Complex2",
    "Complex3",
    "Given1",
    "Given2",
    "Real1",
    "Real2",
    "Real3",
    "Whole1",
    "Whole2",
    "argument_types",
]


def _array(scalar: Any, rank: int, *, given: bool = False) -> Any:
    return types.Array(scalar, rank, "C", readonly=given)


Real1 = Annotated[NDArray[np.float64], _array(types.float64, 1)]
Real2 = Annotated[NDArray[np.float64], _array(types.float64, 2)]
Real3 = Annotated[NDArray[np.float64], _array(types.float64, 3)]
Given1 = Annotated[NDArray[np.float64], _array(types.float64, 1, given=True)]
"""A kernel only reads it: an array that is not to be written will do as well, as for `Given2`."""
Given2 = Annotated[NDArray[np.float64], _array(types.float64, 2, given=True)]
Whole1 = Annotated[NDArray[np.int64], _array(types.int64, 1)]
Whole2 = Annotated[NDArray[np.int64], _array(types.int64, 2)]
Complex1 = Annotated[NDArray[np.complex128], _array(types.complex128, 1)]
Complex2 = Annotated[NDArray[np.complex128], _array(types.complex128, 2)]
Complex3 = Annotated[NDArray[np.complex128], _array(types.complex128, 3)]

SCALARS = {float: types.float64, int: types.int64, bool: types.boolean, complex: types.complex128}


def argument_types(function: Callable[..., Any]) -> tuple[Any, ...]:
    """numba's types of the arguments, by the annotations.

    Raises
    ------
    TypeError
        If an annotation says no type, as `NDArray` does, whose rank is open.
    """
    hints = get_type_hints(function, include_extras=True)
    names = function.__code__.co_varnames[: function.__code__.co_argcount]
    return tuple(
        _type_of(hints.get(name, NoneType), f"{function.__qualname__}({name})") for name in names
    )


def _type_of(hint: Any, where: str) -> Any:
    if hint in SCALARS:
        return SCALARS[hint]
    if get_origin(hint) is Annotated:
        for note in get_args(hint)[1:]:
            if isinstance(note, types.Type):
                return note
            if isinstance(note, int):
                return types.UniTuple(_type_of(get_args(get_args(hint)[0])[0], where), note)
    if get_origin(hint) is tuple and Ellipsis not in get_args(hint):
        return types.Tuple([_type_of(part, where) for part in get_args(hint)])
    if isinstance(hint, type) and issubclass(hint, tuple) and hasattr(hint, "_fields"):
        hints = get_type_hints(hint, include_extras=True)
        parts = [_type_of(hints[name], f"{hint.__name__}.{name}") for name in hint._fields]
        return types.BaseTuple.from_types(parts, hint)
    raise TypeError(
        f"{where}: {hint!r} says no one type to compile for; see aeroflutter.kernels.arrays"
    )
