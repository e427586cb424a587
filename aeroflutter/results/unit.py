"""The unit in which what is measured in the coordinate of the first spring is told, and the speed.

Angles are told in degrees, in keys and names that end in ``_deg``. Where the first spring of a case
is in metres or semichords, its numbers are told as they are, in names without an ending.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from aeroflutter.case import Case

__all__ = ["DEGREE", "Unit", "native", "speak", "spoken_unit", "start_unit", "told", "told_of"]


@dataclass(frozen=True)
class Unit:
    """How numbers of a coordinate are told.

    Attributes
    ----------
    name, cf
        For people, and as the CF conventions write it.
    suffix
        Of names in files.
    factor
        From the unit of the API.
    speed
        What an airspeed is called.
    """

    name: str
    cf: str
    suffix: str = ""
    factor: float = 1.0
    speed: str = "U*"

    @property
    def mark(self) -> str:
        """What stands behind a number in a figure."""
        return "°" if self.suffix else f" {self.name}"

    def words(self, text: str) -> str:
        """A heading or a label that speaks of degrees and U*, in this unit and by this name."""
        for star in ("U^*", "U*") if self.speed != "U*" else ():
            text = text.replace(star, self.speed)
        if self.suffix:
            return text
        text = text.replace("restoring moment", f"restoring {self.effort}")
        return re.sub(r"\(deg\b", f"({self.name}", text)

    @property
    def effort(self) -> str:
        """What a spring does: it turns what is an angle, and pushes what is none."""
        return "moment" if self.suffix else "force"

    def shown(self, fields: dict[str, Any]) -> dict[str, Any]:
        """Fields for people: without the degrees of what has none."""
        return {
            name: value
            for name, value in fields.items()
            if self.suffix or value is not None or not name.endswith("_deg")
        }


DEGREE = Unit("deg", "degree", "_deg", 180.0 / np.pi)
_UNITS = {
    "rad": DEGREE,
    "m": Unit("m", "m"),
    "semichord": Unit("semichord", "1"),
}
_SPOKEN: ContextVar[Unit] = ContextVar("unit", default=DEGREE)
_START: ContextVar[Unit] = ContextVar("start", default=DEGREE)


def spoken_unit() -> Unit:
    """The unit that is told now."""
    return _SPOKEN.get()


def start_unit() -> Unit:
    """The unit of where motions start: of a section's pitch, wherever its springs are."""
    return _START.get()


def told(value: Any) -> Any:
    """Numbers of the coordinate as they are told: angles in degrees."""
    return value * _SPOKEN.get().factor


def native(value: Any) -> Any:
    """The other way: what the user says in the unit that is told, in that of the API."""
    return value / _SPOKEN.get().factor


def speak(case: Case) -> None:
    """From now on tell numbers in the unit of the first spring of a case, speeds by its name."""
    unit, scale = _UNITS[case.model().units[0]], case.scale
    _SPOKEN.set(unit if scale is None else replace(unit, speed=scale.speed_name))
    _START.set(DEGREE if case.imported is None else unit)


@contextmanager
def told_of(case: Case | None) -> Iterator[None]:
    """Tell numbers in the unit of a case; as before where there is none."""
    before = _SPOKEN.get(), _START.get()
    if case is not None:
        speak(case)
    try:
        yield
    finally:
        _SPOKEN.set(before[0])
        _START.set(before[1])
