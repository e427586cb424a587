"""Keys in the words of engineers: Hz, per cent of the chord, ± friction; what each of them becomes.

A case keeps what its file says. The keys below are turned into those of the section and the springs
when these are built, and `converted` says what became of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping
from typing import Any, NamedTuple

from aeroflutter.case.schema import FlapInitial, Start

__all__ = ["SECTION", "SECTION_SI", "SPRINGS", "Conversion", "Rule", "convert", "converted"]

AXIS = -0.5  # of a section that gives none


class Rule(NamedTuple):
    """A key, the one that it becomes, the unit of that one, and (value, table) -> its value."""

    key: str
    into: str
    unit: str
    of: Callable[[float, Mapping[str, Any]], float]


class Conversion(NamedTuple):
    """What became of one key of a case: dotted names, numbers, and the unit of the second."""

    key: str
    given: float
    into: str
    value: float
    unit: str


def _behind_axis(percent: float, table: Mapping[str, Any]) -> float:
    """Semi-chords behind the elastic axis of a point in per cent of the chord."""
    return percent / 50.0 - 1.0 - float(table.get("a_h", AXIS))


def _radians_a_second(hertz: float, _: Mapping[str, Any]) -> float:
    return 2.0 * math.pi * hertz


_OF_AXIS = Rule("axis_percent_chord", "a_h", "semi-chords", lambda p, _: p / 50.0 - 1.0)

SECTION = (_OF_AXIS, Rule("cg_percent_chord", "x_alpha", "semi-chords", _behind_axis))
SECTION_SI = (
    _OF_AXIS,
    Rule("cg_percent_chord", "x_cg", "m", lambda p, t: _behind_axis(p, t) * t["b"]),
    Rule("frequency_h_hz", "omega_h", "rad/s", _radians_a_second),
    Rule("frequency_alpha_hz", "omega_alpha", "rad/s", _radians_a_second),
)
_FRICTION = (
    Rule("friction_deg", "delta_v_deg", "deg", lambda friction, _: 2.0 * friction),
    Rule("gap_deg", "delta_h_deg", "deg", lambda gap, _: gap),
)
SPRINGS = {"hysteresis": _FRICTION}
"""Rules by the kind of spring; in heave the names go without `_deg`."""

_ALTERNATIVES = {
    "section": (
        ("a_h", "axis_percent_chord"),
        ("x_alpha", "x_cg", "S", "cg_percent_chord"),
        ("I_alpha", "r"),
        ("K_h", "omega_h", "frequency_h_hz"),
        ("K_alpha", "omega_alpha", "frequency_alpha_hz"),
        ("zeta_xi", "c_h"),
        ("zeta_alpha", "c_alpha"),
    ),
    "flap": (("K_beta", "omega_beta"),),
    "spring": (("delta_v", "friction"), ("delta_h", "gap")),
}


def spring_rules(kind: str, *, angle: bool = True) -> tuple[Rule, ...]:
    """Rules of a kind of spring, in an angle or in heave."""
    rules = SPRINGS.get(kind, ())
    if angle:
        return rules
    bare = [(rule.key.removesuffix("_deg"), rule.into.removesuffix("_deg")) for rule in rules]
    return tuple(
        Rule(key, into, "semi-chords", rule.of)
        for (key, into), rule in zip(bare, rules, strict=True)
    )


def convert(values: Mapping[str, Any], rules: Collection[Rule]) -> dict[str, Any]:
    """A table in which keys have become those of the model."""
    found = dict(values)
    for rule in rules:
        if rule.key in found:
            found[rule.into] = rule.of(found.pop(rule.key), found)
    return found


def clashes(path: str, given: Collection[str], rules: Collection[Rule]) -> list[str]:
    """Problems of what is given in both of its ways."""
    return [
        f"{path}.{rule.key}: says the same as {path}.{rule.into}; remove one of the two"
        for rule in rules
        if rule.key in given and rule.into in given
    ]


def named(path: str, given: Collection[str], rules: Collection[Rule]) -> dict[str, str]:
    """Dotted key under which the file gives what the model calls by its own name."""
    return {rule.into: f"{path}.{rule.key}" for rule in rules if rule.key in given}


def converted(tables: Mapping[str, Any]) -> list[Conversion]:
    """What became of the keys of a valid case, table by table."""
    section = dict(tables.get("section", {}))
    si = section.pop("si", {})
    places = {**dict.fromkeys(section, "section"), **dict.fromkeys(si, "section.si")}
    found = [*_of_table({**section, **si}, SECTION_SI if si else SECTION, places)]
    springs = tables["spring"] if isinstance(tables["spring"], list) else [tables["spring"]]
    coordinates = [str(spring.get("at", "pitch")) for spring in springs]
    for number, (at, spring) in enumerate(zip(coordinates, springs, strict=True)):
        name = at if coordinates.count(at) == 1 else str(number)
        path = "spring" if len(springs) == 1 else f"spring.{name}"
        rules = spring_rules(spring["kind"], angle=at != "heave")
        found += _of_table(spring, rules, dict.fromkeys(spring, path))
    return found


def _of_table(
    table: Mapping[str, Any], rules: Collection[Rule], places: Mapping[str, str]
) -> Iterator[Conversion]:
    result = convert(table, rules)
    for rule in rules:
        if rule.key in table:
            key = f"{places[rule.key]}.{rule.key}"
            into = f"{places[rule.key]}.{rule.into}"
            yield Conversion(key, table[rule.key], into, result[rule.into], rule.unit)


def displaced(path: str) -> set[str]:
    """Keys that say in other words what a key says, and give way where it is set."""
    if path == "initial.state":
        return set(FlapInitial.model_fields) - set(Start.model_fields)
    table, _, last = path.partition(".")
    key = last.rpartition(".")[2]
    suffix = "_deg" if table == "spring" and key.endswith("_deg") else ""
    for group in _ALTERNATIVES.get(table, ()):
        if key.removesuffix(suffix) in group:
            return {name + suffix for name in group} - {key}
    return set()
