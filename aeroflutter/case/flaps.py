"""The tables [flap] and [flap.si] of a case."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from aeroflutter.case import schema
from aeroflutter.case.check import check_table
from aeroflutter.model.section import Flap, FlapSI

__all__ = ["BuiltFlap", "build_flap"]


@dataclass(frozen=True)
class BuiltFlap:
    """The flap of a case, if it has one, its table completed, and what is wrong with it."""

    flap: Flap | FlapSI | None = None
    values: dict[str, Any] = field(default_factory=dict)
    problems: list[str] = field(default_factory=list)


def build_flap(tables: Mapping[str, Any]) -> BuiltFlap:
    """The flap that the tables of a case describe."""
    section, given = tables.get("section", {}), tables.get("flap")
    section_si = section.get("si") if isinstance(section, dict) else None
    damper = section_si.get("c_beta") if isinstance(section_si, dict) else None
    if given is None:
        needs = "section.si.c_beta: is the damper of a flap; add a table [flap] or remove it"
        return BuiltFlap(problems=[] if damper is None else [needs])
    if isinstance(given, dict) and "si" in given:
        return _dimensional(given, damper, inside=section_si is not None)
    table = check_table("flap", schema.FlapKeys, given)
    if damper is not None:
        table.problems.append("section.si.c_beta: goes with [flap.si]; give flap.zeta_beta instead")
    stand_ins = {name: 0.5 for name in table.wrong if name in schema.FlapKeys.model_fields}
    keys = {name: f"flap.{name}" for name in schema.FlapKeys.model_fields}
    flap = table.build(Flap, table.values | stand_ins, keys)
    return BuiltFlap(None if table.problems else flap, table.values, table.problems)


def _dimensional(given: dict[str, Any], damper: Any, inside: bool) -> BuiltFlap:
    own = schema.FlapBesideSI.model_fields
    follow = [name for name in schema.FlapKeys.model_fields if name in given and name not in own]
    rest = {name: value for name, value in given.items() if name not in ("si", *follow)}
    outer = check_table("flap", schema.FlapBesideSI, rest)
    outer.problems += [f"flap.{name}: follows from [flap.si]; remove one" for name in follow]
    if not inside:
        outer.problems.append("flap.si: needs the section in [section.si]; or give [flap] alone")
    inner = check_table("flap.si", schema.DimensionalFlap, given["si"])
    values = outer.values | {"si": inner.values}
    arguments = outer.values | inner.values
    if damper is not None:
        arguments["c_beta"] = damper
        if "zeta_beta" not in given:
            values.pop("zeta_beta", None)  # a default is no second statement
            arguments.pop("zeta_beta", None)
    names = (*schema.DimensionalFlap.model_fields, *own)
    arguments |= {name: 0.5 for name in names if name in outer.wrong | inner.wrong}
    keys = {name: f"flap.si.{name}" for name in schema.DimensionalFlap.model_fields}
    keys |= {name: f"flap.{name}" for name in own} | {"c_beta": "section.si.c_beta"}
    flap = inner.build(FlapSI, arguments, keys)
    problems = outer.problems + inner.problems
    return BuiltFlap(None if problems else flap, values, problems)
