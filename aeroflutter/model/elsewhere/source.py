"""What a case says and what its file holds, by name; one line for what is wrong with it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from aeroflutter.errors import InputError
from aeroflutter.model.family import Family

__all__ = ["Read", "Source", "Variables", "check_count"]

Variables = Mapping[str, Any]
Read = tuple[Family, Sequence[str], bool]
"""A family, what is to be said of it, whether it is given at one speed only."""


class Source:
    """What the case says, and else the file."""

    def __init__(self, said: Variables, stored: Variables) -> None:
        self.said, self.stored = said, stored

    def get(self, name: str) -> Any:
        """A value by its name, None where there is none."""
        value = self.said.get(name)
        return self.stored.get(name) if value is None else value

    def array(self, name: str, *, dims: int, complex_too: bool = False) -> Any:
        """Numbers, with as many dimensions; None where there are none.

        Raises
        ------
        InputError
            If they are none, or complex where real numbers are due.
        """
        value = self.get(name)
        if value is None:
            return None
        try:
            array = np.asarray(value)
        except ValueError:
            array = np.asarray("ragged")
        if array.dtype.kind not in "iufcb" or array.dtype.kind == "b":
            raise InputError([f"{name}: must be numbers"])
        if array.dtype.kind == "c" and not complex_too:
            if np.any(array.imag != 0):
                raise InputError([f"{name}: is complex; real numbers are due"])
            array = array.real
        if not np.all(np.isfinite(array)):
            raise InputError([f"{name}: holds NaN or infinity; every entry must be finite"])
        array = array.astype(complex if complex_too else float)
        return _squeezed(array, dims)

    def number(self, name: str) -> float | None:
        """One number; None where there is none."""
        array = self.array(name, dims=1)
        if array is None:
            return None
        if array.size != 1:
            raise InputError([f"{name}: must be one number, not {array.size}"])
        return float(array.ravel()[0])

    def texts(self, name: str) -> tuple[str, ...]:
        """Texts; none where there are none."""
        value = self.get(name)
        if value is None:
            return ()
        if isinstance(value, str):
            value = [value]
        if not isinstance(value, list) or not all(isinstance(one, str) for one in value):
            raise InputError([f"{name}: must be a list of texts"])
        return tuple(one.strip() for one in value)

    def word(self, name: str, allowed: Sequence[str]) -> str | None:
        """One of some words; None where there is none."""
        texts = self.texts(name)
        if not texts:
            return None
        if len(texts) != 1 or texts[0] not in allowed:
            words = " or ".join(f'"{word}"' for word in allowed)
            raise InputError([f"{name}: must be {words}, not {', '.join(texts)[:40]!r}"])
        return texts[0]

    @property
    def listed(self) -> str:
        """Names of what the file holds."""
        names = [name for name in self.stored if name.isprintable()][:12]
        return ", ".join(names)[:120] or "nothing"

    def pair(self, name: str) -> tuple[float, float] | None:
        """Two ascending numbers; None where there are none."""
        array = self.array(name, dims=1)
        if array is None:
            return None
        if array.shape != (2,) or not 0 <= array[0] < array[1]:
            raise InputError([f"{name}: must be two ascending numbers, none negative"])
        return float(array[0]), float(array[1])


def _squeezed(array: Any, dims: int) -> Any:
    """MATLAB makes every vector a matrix: dimensions of one entry go, from the front first."""
    while array.ndim > dims and 1 in array.shape:
        array = array.squeeze(axis=array.shape.index(1))
    while array.ndim < min(dims, 2):
        array = array[None]
    return array


def check_count(labels: Mapping[str, tuple[str, ...]], outputs: int) -> None:
    """Refuse texts that are not one an output.

    Raises
    ------
    InputError
        If their number is another.
    """
    problems = [
        f"{key}: need {outputs}, one an output, got {len(words)}"
        for key, words in labels.items()
        if words and len(words) != outputs
    ]
    if problems:
        raise InputError(problems)
