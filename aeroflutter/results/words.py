"""What a spring is, in words; apart, for commands that say this and load no table of results."""

from __future__ import annotations

from typing import TYPE_CHECKING

from aeroflutter.results.unit import spoken_unit, told

if TYPE_CHECKING:
    from aeroflutter.springs import Spring

__all__ = ["spring_words"]


def spring_words(spring: Spring | None) -> str:
    """Friction and gap of a loop in words, since delta_v is twice the friction; else nothing."""
    if spring is None or spring.kind != "hysteresis":
        return ""
    height, width = told(spring.delta_v), told(spring.delta_h)  # type: ignore[attr-defined]
    unit = spoken_unit().name
    return (
        f"friction ± {height / 2:.6g} {unit} (delta_v = {height:.6g} {unit}, twice the friction), "
        f"gap {width:.6g} {unit} (delta_h)"
    )
