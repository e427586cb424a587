"""`aeroflutter validate`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from aeroflutter.cli.common import CaseName, CaseOptions, Json, print_json, say, show_facts, shown
from aeroflutter.errors import InputError

if TYPE_CHECKING:
    from aeroflutter.case import Case
    from aeroflutter.case.imported import Imported


def validate(
    case: CaseName,
    /,
    *,
    options: CaseOptions = CaseOptions(),
    json: Json = False,
) -> None:
    """Check a case file and say what it describes.

    Every problem is reported at once, one line each, on stderr; the exit code is then 2.
    """
    from aeroflutter.case.engineering import converted

    try:
        loaded = options.load(case, angle=False)
    except InputError as error:
        if json:
            print_json({"valid": False, "problems": error.problems})
        raise
    if json:
        print_json(
            {
                "valid": True,
                "problems": [],
                "digest": loaded.digest,
                "case": loaded.tables,
                "converted": [one._asdict() for one in converted(loaded.tables)],
            }
        )
        return
    say(f"{loaded.source}: ok")
    show_facts(_facts(loaded))


def _facts(case: Case) -> dict[str, Any]:
    from aeroflutter.case.engineering import converted
    from aeroflutter.results.words import spring_words

    facts: dict[str, Any] = {"title": case.title}
    facts |= _section(case) if case.imported is None else _model(case.imported)
    tables = case.tables
    facts["spring"] = _listed(tables["spring"])
    words = [spring_words(item.spring) for item in case.springs if item.at != "heave"]
    facts |= {"loop": "; ".join(filter(None, words))} if any(words) else {}
    facts["initial"] = _listed(tables["initial"]) or "the first spring displaced"
    for number, one in enumerate(converted(tables), 1):
        given, value = shown(one.given), shown(one.value)
        facts[f"converted {number}"] = f"{one.key} = {given} is {one.into} = {value} {one.unit}"
    return facts


def _section(case: Case) -> dict[str, Any]:
    """What there is of a section."""
    facts: dict[str, Any] = {}
    section = {
        name: getattr(case.section, name)
        for name in ("mu", "a_h", "x_alpha", "r_alpha", "omega_bar", "zeta_alpha", "zeta_xi")
    }
    if case.section.heave_mass != 1.0:
        section["heave_mass"] = case.section.heave_mass
    if case.section.damping != "coordinate":
        section["damping"] = case.section.damping
    facts["section"] = _listed(section)
    if case.section.scale:
        facts["scale"] = (
            f"b = {shown(case.section.scale.b)} m, "
            f"omega_alpha = {shown(case.section.scale.omega_alpha)} rad/s"
        )
    if case.section.flap:
        facts["flap"] = _listed(vars(case.section.flap))
    facts["aerodynamics"] = _listed(case.tables["aerodynamics"])
    return facts


def _model(model: Imported) -> dict[str, Any]:
    """What there is of a model from a file, and what was done to it."""
    family = model.family
    low, high = family.search_range
    speeds = f"at {low:g} m/s only" if model.one_speed else f"{low:.6g} to {high:.6g} m/s"
    outputs = ", ".join(f"{name} ({unit})" for name, unit in model.places.items())
    facts: dict[str, Any] = {
        "model": f"{model.kind}, {len(family.state_names)} states, {speeds}",
        "outputs": outputs,
    }
    return facts | {f"note {number}": note for number, note in enumerate(model.notes, 1)}


def _listed(table: dict[str, Any] | list[dict[str, Any]]) -> str:
    if isinstance(table, list):
        return "; ".join(map(_listed, table))
    return ", ".join(f"{name} = {shown(value)}" for name, value in table.items())
