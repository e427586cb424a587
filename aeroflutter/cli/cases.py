"""`aeroflutter cases`."""

from __future__ import annotations

from typing import Any

from aeroflutter.cli.common import Json, print_json, show_table


def cases(
    *,
    json: Json = False,
) -> None:
    """List the built-in cases.

    Any command takes one of these names in the place of a file.
    """
    from aeroflutter.case.case import builtin_names

    rows = [_row(name) for name in builtin_names()]
    if json:
        print_json({"cases": rows})
        return
    show_table(
        ("case", "omega_bar", "spring", "title"),
        [(row["name"], row["omega_bar"], _kinds(row["spring"]), row["title"]) for row in rows],
    )


def _row(name: str) -> dict[str, Any]:
    from aeroflutter.case import load_case

    case = load_case(name)
    spring = case.tables["spring"]
    return {
        "name": name,
        "title": case.title,
        "omega_bar": case.section.omega_bar,
        "mu": case.section.mu,
        "spring": spring[0] if isinstance(spring, list) and len(spring) == 1 else spring,
    }


def _kinds(spring: dict[str, Any] | list[dict[str, Any]]) -> str:
    springs = spring if isinstance(spring, list) else [spring]
    return ", ".join(
        item["kind"] + (f" ({item['at']})" if item.get("at", "pitch") != "pitch" else "")
        for item in springs
    )
