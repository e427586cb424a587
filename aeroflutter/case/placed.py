"""The springs of a case: one table [spring], or several [[spring]], each in a coordinate."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from aeroflutter import springs
from aeroflutter.case import schema
from aeroflutter.case.check import CheckedTable, check_variant, show
from aeroflutter.case.engineering import clashes, convert, named, spring_rules
from aeroflutter.model.equations import COORDINATES

__all__ = ["PlacedSpring", "PlacedSprings", "build_springs", "outputs", "places", "remembers"]

SPRINGS: dict[str, Callable[..., springs.Spring]] = {
    "linear": springs.Linear,
    "cubic": springs.Cubic,
    "table": springs.Table,
    "bilinear": springs.Bilinear,
    "freeplay": springs.Freeplay,
    "hysteresis": springs.Hysteresis,
    "polynomial": springs.Polynomial,
    "saturation": springs.Saturation,
    "dead-zone": springs.DeadZone,
    "relay": springs.Relay,
    "play": springs.Play,
    "friction": springs.Friction,
}

_FIELDS = {
    "table": {"moment": "moments", "displacement": "pitch", "force": "moments"},
    "relay": {"moment": "level"},
}
"""Fields of springs that are not their key without `_deg`."""


class PlacedSpring(NamedTuple):
    """A spring, its coordinate, and what its unit slope is worth over the nominal stiffness."""

    spring: springs.Spring
    at: str = "pitch"
    stiffness: float = 1.0


@dataclass(frozen=True)
class PlacedSprings:
    """All springs of a case, their tables completed, and what is wrong with them."""

    springs: tuple[PlacedSpring, ...]
    values: dict[str, Any] | list[dict[str, Any]]
    problems: list[str]


def outputs(springs: Sequence[PlacedSpring]) -> list[PlacedSpring]:
    """The springs that stand outside of the linear system: those that are not linear, or one."""
    return [item for item in springs if item.spring.kind != "linear"] or list(springs[:1])


def remembers(spring: springs.Spring) -> bool:
    """Whether a motion depends on what has become of the spring before."""
    table = spring.piece_table()
    return table is not None and table.remembers


def places(*, with_flap: bool) -> dict[str, str]:
    """Coordinates of a section that may carry springs, and their units."""
    return {
        name: COORDINATES[name].unit
        for name in ("pitch", "heave", "flap")
        if name != "flap" or with_flap
    }


def build_springs(given: Any, places: Mapping[str, str]) -> PlacedSprings:
    """The springs that `spring` of a case describes, a table or a list of tables.

    Parameters
    ----------
    given
        The table or the list.
    places
        Unit of every coordinate that may carry a spring, by its name.
    """
    if not isinstance(given, list):
        placed, table = _build("spring", given, places)
        return PlacedSprings((placed,) if placed else (), table.values, table.problems)
    if not given:
        return PlacedSprings((), [], ["spring: is an empty list; give a table [spring]"])
    names = _names(given)
    built = [_build(name, one, places) for name, one in zip(names, given, strict=True)]
    return PlacedSprings(
        tuple(placed for placed, _ in built if placed),
        [table.values for _, table in built],
        [problem for _, table in built for problem in table.problems],
    )


def _names(entries: list[Any]) -> list[str]:
    """How each spring is spoken of: by its coordinate, by its number where it shares that one."""
    if len(entries) == 1:
        return ["spring"]
    places = [entry.get("at", "pitch") if isinstance(entry, dict) else None for entry in entries]
    return [
        f"spring.{at}" if isinstance(at, str) and places.count(at) == 1 else f"spring.{i}"
        for i, at in enumerate(places)
    ]


def _build(
    name: str, given: Any, places: Mapping[str, str]
) -> tuple[PlacedSpring | None, CheckedTable]:
    if not isinstance(given, dict):
        return None, check_variant(name, "kind", schema.SPRINGS, given)
    place = {key: given[key] for key in ("at", "stiffness") if key in given}
    problems = _place_problems(name, place, places)
    at = place.get("at", "pitch")
    angle = not isinstance(at, str) or places.get(at, "rad") == "rad"
    variants = schema.SPRINGS
    if not angle:
        variants = {kind: schema.in_heave(model) for kind, model in variants.items()}
    rest = {key: value for key, value in given.items() if key not in place}
    spring, table = _law(name, variants, rest)
    table.problems[:0] = problems
    if spring is None or table.problems:
        return None, table
    table.values = place | table.values
    return PlacedSpring(spring, place.get("at", "pitch"), float(place.get("stiffness", 1.0))), table


def _place_problems(name: str, place: Mapping[str, Any], places: Mapping[str, str]) -> list[str]:
    problems = []
    at, stiffness = place.get("at", "pitch"), place.get("stiffness", 1.0)
    section = places.get("heave") == "semichord"
    if not (isinstance(at, str) and at in places):
        known = ("pitch", "heave", "flap") if section else places
        allowed = ", ".join(f'"{one}"' for one in known)
        problems.append(
            f'{name}.at: "flap" needs a flap; add a table [flap]'
            if section and at == "flap"
            else f"{name}.at: must be one of {allowed}, not {show(at)}"
        )
    number = isinstance(stiffness, int | float) and not isinstance(stiffness, bool)
    if not (number and 0 < stiffness <= schema.LARGEST):
        problems.append(f"{name}.stiffness: must be {schema.POSITIVE}, not {show(stiffness)}")
    return problems


def _law(
    label: str, variants: Mapping[str, type[schema.Table]], given: dict[str, Any]
) -> tuple[springs.Spring | None, CheckedTable]:
    table = check_variant(label, "kind", variants, given)
    kind = table.values.get("kind")
    if kind is None:
        return None, table
    names = [name for name in variants[kind].model_fields if name != "kind"]
    values = {name: value for name, value in table.values.items() if name in names}
    count = max((len(v) for v in values.values() if isinstance(v, list)), default=0)
    stand_in: Any = {"table": list(range(count)), "polynomial": [1.0]}.get(kind, 1.0)
    values |= {name: stand_in for name in names if name in table.wrong}
    rules = spring_rules(kind, angle=variants is schema.SPRINGS)
    table.problems += clashes(label, given, rules)
    for rule in rules:
        if rule.key not in given and rule.into not in given:
            about = schema.metadata(variants[kind], rule.into)
            problem = f"is missing; give {about['allowed']} ({about['meaning']})"
            table.problems.append(f"{label}.{rule.into}: {problem}")
            values[rule.into] = 1.0  # so that the others are checked
    keys = {_field(kind, name): f"{label}.{name}" for name in names}
    keys |= {_field(kind, into): key for into, key in named(label, given, rules).items()}
    values = convert(values, rules)
    # Piecewise-linear laws are scale-free: built in degrees first, they complain in degrees.
    table.build(SPRINGS[kind], {_field(kind, n): value for n, value in values.items()}, keys)
    if table.problems:
        return None, table
    return SPRINGS[kind](
        **{_field(kind, n): _radians(n, value) for n, value in values.items()}
    ), table


def _field(kind: str, key: str) -> str:
    bare = key.removesuffix("_deg")
    return _FIELDS.get(kind, {}).get(bare, bare)


def _radians(key: str, value: Any) -> Any:
    if not key.endswith("_deg"):
        return value
    return [math.radians(v) for v in value] if isinstance(value, list) else math.radians(value)
