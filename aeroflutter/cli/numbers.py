"""Numbers of an option: `A:B:N` or `a,b,c`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from aeroflutter.errors import InputError
from aeroflutter.limits import within

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = ["numbers"]


def numbers(option: str, text: str) -> NDArray[np.float64]:
    """Numbers of an option: `A:B:N` (N of them, both ends included) or a list `a,b,c`.

    Parameters
    ----------
    option
        Name of the option, for messages.
    text
        What was given.

    Returns
    -------
    array (N,)

    Raises
    ------
    InputError
        If the text is neither, or a number is not finite.

    Examples
    --------
    >>> numbers("--speeds", "1:2:3")
    array([1. , 1.5, 2. ])
    """
    import numpy as np

    if ":" not in text:
        return np.array([_number(option, part) for part in text.split(",")])
    parts = text.split(":")
    if len(parts) != 3:
        raise InputError(f'{option}: "{text}" must be A:B:N or a list a,b,c')
    low, high = _number(option, parts[0]), _number(option, parts[1])
    return np.linspace(low, high, _count(option, parts[2]))


def _number(option: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise InputError(f'{option}: "{text.strip()}" is not a number') from None
    if not math.isfinite(value):
        raise InputError(f'{option}: "{text.strip()}" is not finite')
    return value


def _count(option: str, text: str) -> int:
    try:
        count = int(text)
    except ValueError:
        count = 0
    if count < 1:
        raise InputError(f'{option}: N of A:B:N must be a whole number from 1 on, not "{text}"')
    within("numbers", count, option)
    return count
