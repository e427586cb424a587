"""The text of a case: found, read, parsed, changed and written."""

from __future__ import annotations

import difflib
import re
import tomllib
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Any

from aeroflutter.case.engineering import displaced
from aeroflutter.errors import InputError

SIZE_LIMIT = 1 << 20
"""Bytes; a measured table of ten thousand points needs a fifth of it."""

_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_POSITION = re.compile(r"\s*\(at (.*)\)$")
_TOML_MESSAGES = {
    "Cannot overwrite a value": "a key or a table is given twice",
    "Cannot declare": "a table is given twice, or is a value elsewhere",
    "Invalid value": "a value is missing or malformed; text needs quotes, numbers a leading digit",
    "Invalid initial character for a key part": "a key is missing or malformed",
}


def builtin_names() -> tuple[str, ...]:
    """Names of the built-in cases, `run6` before `run10`."""
    folder = resources.files("aeroflutter.case.cases")
    names = (Path(entry.name) for entry in folder.iterdir())
    return tuple(sorted((n.stem for n in names if n.suffix == ".toml"), key=_natural))


def _natural(name: str) -> list[tuple[int, str]]:
    return [(int(part), "") if part.isdigit() else (0, part) for part in re.split(r"(\d+)", name)]


def read_case(source: str | Path) -> str:
    """Text of a built-in case or of a file.

    Raises
    ------
    InputError
        If there is no such case or file, or it is not readable UTF-8 text of reasonable size.
    """
    label = one_line(str(source))
    if str(source) in builtin_names():
        return (resources.files("aeroflutter.case.cases") / f"{source}.toml").read_text("utf-8")
    try:
        with open(source, "rb") as stream:
            data = stream.read(SIZE_LIMIT + 1)
    except FileNotFoundError:
        raise InputError(f"{label}: {_not_found(source)}") from None
    except IsADirectoryError:
        raise InputError(f"{label}: is a directory; give a TOML file or a built-in case") from None
    except PermissionError:
        raise InputError(f"{label}: cannot be read; you lack the permission") from None
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"{label}: cannot be read: {one_line(reason)}") from None
    return _decode(label, data)


def _not_found(source: str | Path) -> str:
    close = difflib.get_close_matches(str(source), builtin_names(), n=1)
    hint = f'did you mean "{close[0]}"?' if close else "`aeroflutter cases` lists those there are"
    return f"no such file, and no built-in case of that name; {hint}"


def _decode(label: str, data: bytes) -> str:
    if len(data) > SIZE_LIMIT:
        raise InputError(f"{label}: is larger than {SIZE_LIMIT} bytes, so it is no case file")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        byte = f"byte 0x{data[error.start]:02x} at offset {error.start}"
        raise InputError(f"{label}: is not UTF-8 text ({byte}); save it as UTF-8") from None
    if "\0" in text:
        raise InputError(f"{label}: holds NUL bytes, so it is a binary file, not a case file")
    return text


def parse_case(text: str, label: str) -> dict[str, Any]:
    """Tables of a case from its TOML text.

    Raises
    ------
    InputError
        If the text is empty or not TOML; the message says where.
    """
    try:
        tables = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{label}: {_toml_problem(str(error))}") from None
    except (ValueError, RecursionError) as error:  # a number of thousands of digits, deep nesting
        deep = isinstance(error, RecursionError)
        reason = "is nested too deeply" if deep else "holds a number of too many digits"
        raise InputError(f"{label}: {reason} to be a case file") from None
    if not tables:
        raise InputError(f"{label}: is empty; `aeroflutter init` writes a case file to start from")
    return tables


def _toml_problem(message: str) -> str:
    found = _POSITION.search(message)
    where = f"{found[1]}: " if found else ""
    what = message[: found.start()] if found else message
    for start, plain in _TOML_MESSAGES.items():
        if what.startswith(start):
            what = plain
    return f"{where}not valid TOML: {one_line(what)}"


def apply_overrides(tables: dict[str, Any], overrides: Mapping[str, Any]) -> dict[str, Any]:
    """Tables with some keys replaced, each named by its dotted path.

    A new `spring.kind` or `aerodynamics.model` starts its table afresh, since the other keys
    belonged to the old one; where a spring is, and what it weighs, stay. Of several springs one is
    named by its coordinate, or by its number from 0 on where that is not enough:
    `spring.flap.gap_deg`, `spring.0.gap_deg`; the only one that is not linear needs no name.

    Raises
    ------
    InputError
        If a path is malformed or leads through something that is not a table.
    """
    result = _copy(tables)
    problems = []
    for path, value in sorted(overrides.items(), key=lambda item: not _is_tag(item[0])):
        *folders, last = path.split(".")
        if not all(_BARE_KEY.fullmatch(part) for part in (*folders, last)):
            problems.append(f"{one_line(path)}: is no key; write it as in section.mu")
            continue
        table = _table(result, folders)
        if isinstance(table, str):
            problems.append(f"{path}: {table}")
            continue
        if _is_tag(path) and table.get(last) != value:
            _clear(table)
        for other in displaced(path) - {p.rpartition(".")[2] for p in overrides}:
            for place in (table, *_neighbours(result, folders)):
                place.pop(other, None)
        table[last] = plain(value)
    if problems:
        raise InputError(problems)
    return result


def _neighbours(tables: dict[str, Any], folders: list[str]) -> list[dict[str, Any]]:
    """The other table in which a section may state the same: `[section]` or `[section.si]`."""
    section = tables.get("section") if folders[:1] == ["section"] else None
    inner = section.get("si") if isinstance(section, dict) else None
    return [table for table in (section, inner) if isinstance(table, dict)]


def _table(tables: dict[str, Any], folders: list[str]) -> dict[str, Any] | str:
    """The table that a path leads to, made where it is not there, or why there is none."""
    if folders[:1] == ["spring"] and tables.get("spring"):
        return _spring(tables["spring"], folders[1:])
    table: Any = tables
    for depth, part in enumerate(folders):
        table = table.setdefault(part, {})
        if not isinstance(table, dict):
            return f"{'.'.join(folders[: depth + 1])} is not a table"
    found: dict[str, Any] = table
    return found


def _spring(springs: Any, name: list[str]) -> dict[str, Any] | str:
    """The table of one spring, by its coordinate or number, or the only one, or only bent one."""
    entries = springs if isinstance(springs, list) else [springs]
    if not all(isinstance(entry, dict) for entry in entries):
        return "spring is not a table"
    places = [str(entry.get("at", "pitch")) for entry in entries]
    known = [at if places.count(at) == 1 else str(i) for i, at in enumerate(places)]
    if len(name) > 1 or (name and name[0] not in (*known, *map(str, range(len(known))))):
        return f"is no spring; those there are: {', '.join(f'spring.{k}' for k in known)}"
    bent = [i for i, entry in enumerate(entries) if entry.get("kind") != "linear"]
    if not name and len(entries) > 1 and len(bent) != 1:
        return f"there are {len(entries)} springs; name one, as in spring.{known[0]}"
    number = bent[0] if len(bent) == 1 else 0
    if name:
        number = known.index(name[0]) if name[0] in known else int(name[0])
    found: dict[str, Any] = entries[number]
    return found


def _is_tag(path: str) -> bool:
    """Whether the other keys of a table depend on this one."""
    parts = path.split(".")
    return (parts[0], parts[-1]) in (("spring", "kind"), ("aerodynamics", "model"))


def _clear(table: dict[str, Any]) -> None:
    """Another kind or model has other keys; where a spring is, and what it weighs, stay."""
    for key in [key for key in table if key not in ("at", "stiffness")]:
        del table[key]


def _copy(value: Any) -> Any:
    if isinstance(value, list) and _is_table(value):
        return [_copy(item) for item in value]
    return {k: _copy(v) for k, v in value.items()} if isinstance(value, dict) else value


def plain(value: Any) -> Any:
    """NumPy scalars and arrays, tuples and mappings as the types that TOML knows."""
    if isinstance(value, Mapping):
        return {str(name): plain(item) for name, item in value.items()}
    if hasattr(value, "tolist"):
        return value.tolist()
    return [plain(item) for item in value] if isinstance(value, (tuple, list)) else value


def parse_override(text: str) -> tuple[str, Any]:
    """Path and value of a `section.mu=50` from the command line; bare words are text.

    Raises
    ------
    InputError
        If there is no key or no value.
    """
    path, equals, raw = text.partition("=")
    path, raw = path.strip(), raw.strip()
    if not (equals and path and raw):
        raise InputError(f'--set: "{one_line(text)}" must be KEY=VALUE, as in section.mu=50')
    try:
        parsed = tomllib.loads(f"value = {raw}")
    except (ValueError, RecursionError):
        return path, raw
    return path, parsed["value"] if set(parsed) == {"value"} else raw


def dump_case(tables: Mapping[str, Any]) -> str:
    """TOML text of validated tables: scalars, lists of numbers and of tables, two levels deep."""
    lines = [f"{name} = {_literal(v)}" for name, v in tables.items() if not _is_table(v)]
    for name, table in tables.items():
        if isinstance(table, dict):
            lines += _dump_table(name, table)
        elif _is_table(table):
            for entry in table:
                lines += [f"[[{name}]]", *(f"{k} = {_literal(v)}" for k, v in entry.items())]
    return "\n".join(lines) + "\n"


def _is_table(value: Any) -> bool:
    """Whether a value is a table, or a list of them."""
    return isinstance(value, dict) or (
        isinstance(value, list) and bool(value) and all(isinstance(v, dict) for v in value)
    )


def _dump_table(name: str, table: Mapping[str, Any]) -> list[str]:
    lines = [f"[{name}]"]
    lines += [f"{k} = {_literal(v)}" for k, v in table.items() if not isinstance(v, dict)]
    for key, inner in table.items():
        if isinstance(inner, dict):
            lines += _dump_table(f"{name}.{key}", inner)
    return lines


def _literal(value: Any) -> str:
    if isinstance(value, list):
        return f"[{', '.join(map(_literal, value))}]"
    if isinstance(value, str):
        return '"' + "".join(_escape(c) for c in value) + '"'
    return repr(value)


def _escape(character: str) -> str:
    if character in '"\\':
        return "\\" + character
    return character if character.isprintable() else f"\\U{ord(character):08x}"


def one_line(text: str, width: int = 200) -> str:
    """Text with everything unprintable escaped, cut to `width` characters."""
    shown = text[: width + 1].encode("utf-8", "backslashreplace").decode("utf-8")
    safe = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in shown)
    return safe if len(safe) <= width else safe[: width - 1] + "…"
