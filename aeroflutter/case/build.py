"""Build what the tables of a case describe, with every problem of every table reported."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.case import schema
from aeroflutter.case.check import (
    OVERFLOW,
    CheckedTable,
    check_names,
    check_table,
    check_variant,
    show,
)
from aeroflutter.case.engineering import SECTION, SECTION_SI, Rule, clashes, convert, named
from aeroflutter.case.flaps import build_flap
from aeroflutter.case.placed import PlacedSpring, build_springs, outputs, places, remembers
from aeroflutter.errors import InputError
from aeroflutter.model.aerodynamics import Aerodynamics, QuasiSteady, Wagner
from aeroflutter.model.lure import SectionFamily
from aeroflutter.model.section import Flap, FlapSI, TypicalSection

if TYPE_CHECKING:
    from aeroflutter.case.imported import Imported

TOP_LEVEL = ("title", "section", "flap", "aerodynamics", "spring", "initial", "model")


@dataclass(frozen=True)
class Built:
    """What a case holds, and its tables completed by their defaults."""

    section: TypicalSection | None
    aerodynamics: Aerodynamics | None
    springs: tuple[PlacedSpring, ...]
    initial: dict[str, Any]
    tables: dict[str, Any]
    model: Imported | None = None


def build(given: Mapping[str, Any], folder: Path) -> Built:
    """Check all tables and build what they describe.

    Parameters
    ----------
    given
        The tables.
    folder
        Where the file of a model is looked for.

    Raises
    ------
    InputError
        All problems of all tables at once.
    """
    problems = check_names(given, TOP_LEVEL)
    title = given.get("title", "")
    if not isinstance(title, str) or not title.isprintable():
        problems.append(f"title: must be one line of text, not {show(title)}")
    if "model" in given:
        return _with_model(given, title, problems, folder)
    flap = build_flap(given)
    section, section_values, section_problems = _section(given.get("section", {}), flap.flap)
    aerodynamics, aerodynamics_table = _aerodynamics(given.get("aerodynamics", {}))
    placed = build_springs(
        given.get("spring", {"kind": "linear"}), places(with_flap="flap" in given)
    )
    motion = schema.FlapInitial if "flap" in given else schema.Initial
    initial = check_table("initial", motion, given.get("initial", {}))
    problems += section_problems + flap.problems
    problems += aerodynamics_table.problems + placed.problems + initial.problems
    if problems or section is None or aerodynamics is None:
        raise InputError(problems)
    _refuse_overflow(section, aerodynamics)
    states = SectionFamily(section, aerodynamics).state_names
    if problems := _initial_problems(given.get("initial", {}), states, placed.springs):
        raise InputError(problems)
    if "state" in initial.values:  # what the defaults say of pitch and heave is no second statement
        initial.values = _only(initial.values, schema.Start.model_fields)
    tables = {
        "title": title,
        "section": section_values,
        **({"flap": flap.values} if "flap" in given else {}),
        "aerodynamics": aerodynamics_table.values,
        "spring": placed.values,
        "initial": initial.values,
    }
    return Built(section, aerodynamics, placed.springs, initial.values, tables)


def _with_model(given: Mapping[str, Any], title: Any, problems: list[str], folder: Path) -> Built:
    """A case whose model comes from a file."""
    from aeroflutter.case.imported import build_model
    from aeroflutter.case.model_keys import ModelInitial

    problems += [
        f"{name}: goes with a section; [model] stands in its place, remove one of the two"
        for name in ("section", "flap", "aerodynamics")
        if name in given
    ]
    built = build_model(given["model"], folder)
    initial = check_table("initial", ModelInitial, given.get("initial", {}))
    problems += built.problems + initial.problems
    if built.model is None:
        raise InputError(problems)
    known = built.model.places
    placed = build_springs(_placed_somewhere(given.get("spring"), known), known)
    states = built.model.family.state_names
    problems += placed.problems + _initial_problems(initial.values, states, placed.springs)
    if problems:
        raise InputError(problems)
    tables = {
        "title": title,
        "model": built.values,
        "spring": placed.values,
        "initial": initial.values,
    }
    return Built(None, None, placed.springs, initial.values, tables, built.model)


def _placed_somewhere(given: Any, known: Mapping[str, str]) -> Any:
    """Springs that do not say where, in the first output; a linear one where there is none."""
    first = next(iter(known))
    if given is None:
        return {"at": first, "kind": "linear"}
    if isinstance(given, dict):
        return {"at": first} | given
    if isinstance(given, list):
        return [{"at": first} | one if isinstance(one, dict) else one for one in given]
    return given


def _initial_problems(
    given: Mapping[str, Any], states: Sequence[str], springs: tuple[PlacedSpring, ...]
) -> list[str]:
    problems = []
    state, memory = given.get("state"), given.get("memory")
    if state is not None:
        if len(state) != len(states):
            problems.append(
                f"initial.state: needs {len(states)} numbers, one a state ({', '.join(states)}), "
                f"not {len(state)}"
            )
        motion = [name for name in given if name not in schema.Start.model_fields]
        problems += [f"initial.{name}: excludes initial.state; remove one" for name in motion]
    own = [item.at for item in outputs(springs) if remembers(item.spring)]
    if memory is not None and len(memory) != len(own):
        which = ", ".join(own) or "none here"
        problems.append(
            f"initial.memory: needs {len(own)} numbers, one a spring that remembers ({which}), "
            f"not {len(memory)}"
        )
    return problems


def _section(
    given: Any, flap: Flap | FlapSI | None
) -> tuple[TypicalSection | None, dict[str, Any], list[str]]:
    if isinstance(given, dict) and "si" in given:
        return _dimensional(given, flap)
    table = check_table("section", schema.Section, given)
    if isinstance(given, dict):
        table.problems += clashes("section", given, SECTION)
        table.values = _stated(table.values, given, SECTION)
    stand_ins = dict.fromkeys(schema.Section.model_fields, 1.0) | {"x_alpha": 0.0}
    arguments = convert(table.values | _only(stand_ins, table.wrong), SECTION) | {"flap": flap}
    if "damping" in table.wrong:
        arguments["damping"] = "coordinate"
    keys = {name: f"section.{name}" for name in schema.Section.model_fields} | {"flap": "flap"}
    keys |= named("section", table.values, SECTION)
    section = table.build(TypicalSection, arguments, keys)
    return section, table.values, table.problems


def _stated(
    values: dict[str, Any], given: Mapping[str, Any], rules: tuple[Rule, ...]
) -> dict[str, Any]:
    """Values without the defaults of what is given in other words."""
    other = {rule.into for rule in rules if rule.key in given} - set(given)
    return {key: value for key, value in values.items() if key not in other}


def _dimensional(
    given: dict[str, Any], flap: Flap | FlapSI | None
) -> tuple[TypicalSection | None, dict[str, Any], list[str]]:
    own = schema.DimensionalSection.model_fields  # keys that may stand in either of the tables
    si = given["si"] if isinstance(given["si"], dict) else {}
    follow = [name for name in schema.Section.model_fields if name in given and name not in own]
    rest = {name: value for name, value in given.items() if name not in ("si", *follow)}
    outer = check_table("section", schema.DimensionalSection, rest)
    outer.problems += [f"section.{n}: follows from [section.si]; remove one" for n in follow]
    outer.problems += [
        f"section.{n}: is given in [section.si] too; remove one"
        for n in own
        if n in rest and n in si
    ]
    for ratio, damper in (("zeta_xi", "c_h"), ("zeta_alpha", "c_alpha")):
        if damper in si and ratio not in given:
            outer.values.pop(ratio, None)  # a default is no second statement
    both = {**{name: value for name, value in given.items() if name != "si"}, **si}
    outer.problems += clashes("section.si", both, SECTION_SI)
    outer.values = _stated(outer.values, both, SECTION_SI)
    inner = check_table("section.si", schema.Dimensional, given["si"])
    stand_ins = dict.fromkeys(schema.Dimensional.model_fields, 1.0)
    keys = {name: f"section.si.{name}" for name in stand_ins}
    keys |= {name: f"section.{name}" for name in own if name not in si} | {"flap": "flap"}
    keys |= named("section", rest, SECTION_SI) | named("section.si", si, SECTION_SI)
    arguments = outer.values | inner.values | _only(stand_ins, inner.wrong)
    arguments = convert(arguments, SECTION_SI) | {"flap": flap}
    arguments.pop("c_beta", None)  # the flap has it
    if "damping" in outer.wrong:
        arguments["damping"] = "coordinate"
    section = inner.build(TypicalSection.from_si, arguments, keys)
    values = outer.values | _only(inner.values, own)
    values["si"] = {name: value for name, value in inner.values.items() if name not in own}
    return section, values, outer.problems + inner.problems


def _aerodynamics(given: Any) -> tuple[Aerodynamics | None, CheckedTable]:
    if isinstance(given, dict):
        given = {"model": "wagner"} | given
    table = check_variant("aerodynamics", "model", schema.AERODYNAMICS, given)
    if table.values.get("model") == "quasi-steady":
        return QuasiSteady(), table
    if table.values.get("model") == "quasi-steady-rates":
        return Wagner(a=(), b=()), table
    lists = _only(table.values, ("a", "b"))
    if len(lists) == 1 and not table.wrong:
        missing = "b" if "a" in lists else "a"
        table.problems.append(f"aerodynamics.{missing}: is missing; a and b are given together")
        return None, table
    if "indicial" in table.values:
        if lists:
            table.problems.append("aerodynamics.indicial: names the terms; remove a and b, or it")
            return None, table
        return Wagner.named(table.values["indicial"]), table
    count = max(map(len, lists.values()), default=0)
    stand_ins = {"a": [0.0] * count, "b": [1.0] * count}
    keys = {name: f"aerodynamics.{name}" for name in stand_ins}
    wagner = table.build(Wagner, lists | _only(stand_ins, table.wrong), keys)
    if wagner and "model" in table.values:
        table.values |= {"a": list(wagner.a), "b": list(wagner.b)}
    return wagner, table


def _only(values: Mapping[str, Any], names: Any) -> dict[str, Any]:
    return {name: value for name, value in values.items() if name in names}


def _refuse_overflow(section: TypicalSection, aerodynamics: Aerodynamics) -> None:
    """Numbers that are valid one by one may together leave double precision."""
    with np.errstate(all="ignore"):
        try:
            terms = SectionFamily(section, aerodynamics).terms
            sound = all(np.all(np.isfinite(term)) for term in terms)
        except (ArithmeticError, np.linalg.LinAlgError):
            sound = False
    if not sound:
        raise InputError(f"section: {OVERFLOW}")
