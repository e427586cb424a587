"""Check one table of a case: every problem on one line that names the key and the remedy."""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from aeroflutter.case import schema
from aeroflutter.case.source import one_line
from aeroflutter.errors import InputError

T = TypeVar("T")

_NAMED = re.compile(r"(?P<names>\w+(?:(?:, | and | or )\w+)*): (?P<rest>.*)", re.DOTALL)
OVERFLOW = "its numbers are too large or too small to compute with"


@dataclass
class CheckedTable:
    """One table after the check of names and types.

    Attributes
    ----------
    name : str
        Its dotted name.
    values : dict
        What was right, completed by the defaults where everything was.
    wrong : frozenset of str
        Keys missing or of the wrong type; nothing more can be said about their values.
    problems : list of str
        One line each.
    """

    name: str
    values: dict[str, Any] = field(default_factory=dict)
    wrong: frozenset[str] = frozenset()
    problems: list[str] = field(default_factory=list)

    def build(
        self, make: Callable[..., T], arguments: Mapping[str, Any], keys: Mapping[str, str]
    ) -> T | None:
        """Call `make`; put its complaints in the file's words and keep them in `problems`.

        Parameters
        ----------
        make : callable
            A constructor that raises InputError with lines ``field: complaint``.
        arguments : mapping
            By field. For a field in `wrong` any stand-in does: complaints about it are dropped.
        keys : mapping
            Dotted key of every field.
        """
        try:
            return make(**arguments)
        except InputError as error:
            doubtful = {f"{self.name}.{key}" for key in self.wrong}
            for problem in error.problems:
                named, translated = self._translate(problem, keys)
                if not doubtful.intersection(named):
                    self.problems.append(translated)
        except ArithmeticError:
            self.problems.append(f"{self.name}: {OVERFLOW}")
        return None

    def _translate(self, problem: str, keys: Mapping[str, str]) -> tuple[list[str], str]:
        match = _NAMED.fullmatch(problem)
        fields = re.split(", | and | or ", match["names"]) if match else []
        if match is None or not all(name in keys for name in fields):
            return [], f"{self.name}: gives {one_line(problem)}"
        named = [keys[name] for name in fields]
        return named, f"{' and '.join(named)}: {one_line(match['rest'])}"


def check_table(name: str, model: type[schema.Table], given: Any) -> CheckedTable:
    """Check names and types of one table."""
    if not isinstance(given, dict):
        problem = f"{name}: must be a table, not {show(given)}"
        return CheckedTable(name, wrong=frozenset(model.model_fields), problems=[problem])
    try:
        valid = model.model_validate(given)
    except ValidationError as error:
        details = error.errors(include_url=False, include_context=False)
        wrong = frozenset(str(detail["loc"][0]) for detail in details)
        right = {k: v for k, v in given.items() if k in model.model_fields and k not in wrong}
        return CheckedTable(name, right, wrong, [_worded(name, model, d) for d in details])
    return CheckedTable(name, valid.model_dump(exclude_none=True))


def check_variant(
    name: str, tag: str, variants: Mapping[str, type[schema.Table]], given: Any
) -> CheckedTable:
    """Check a table whose keys depend on one of them, the tag.

    The tag is in `values` of the result only if it names one of the variants.
    """
    if not isinstance(given, dict):
        return CheckedTable(name, problems=[f"{name}: must be a table, not {show(given)}"])
    choice = given.get(tag)
    if not isinstance(choice, str) or choice not in variants:
        known = list(dict.fromkeys(k for model in variants.values() for k in model.model_fields))
        unknown = [_unknown(name, key, known) for key in given if key not in known]
        return CheckedTable(name, problems=[_bad_tag(f"{name}.{tag}", choice, variants), *unknown])
    owners = {
        key: [show(variant) for variant, model in variants.items() if key in model.model_fields]
        for key in given
    }
    own = variants[choice].model_fields
    foreign = {key: kinds for key, kinds in owners.items() if kinds and key not in own}
    table = check_table(
        name, variants[choice], {k: v for k, v in given.items() if k not in foreign}
    )
    table.values[tag] = choice
    table.problems += [
        f'{name}.{key}: belongs to {tag} = {" or ".join(kinds)}, not to "{choice}"'
        for key, kinds in foreign.items()
    ]
    return table


def _bad_tag(path: str, choice: Any, variants: Collection[str]) -> str:
    allowed = ", ".join(f'"{variant}"' for variant in variants)
    if choice is None:
        return f"{path}: is missing; give one of {allowed}"
    return f"{path}: must be one of {allowed}, not {show(choice)}{_suggest(choice, variants)}"


def _worded(name: str, model: type[schema.Table], detail: ErrorDetails) -> str:
    key, *index = detail["loc"]
    if detail["type"] == "extra_forbidden":
        return _unknown(name, str(key), list(model.model_fields))
    about = schema.metadata(model, str(key))
    if detail["type"] == "missing":
        return f"{name}.{key}: is missing; give {about['allowed']} ({about['meaning']})"
    allowed = schema.NUMBER if index else about["allowed"]
    if detail["type"] in ("greater_than_equal", "less_than_equal"):
        allowed += f" of size up to {schema.LARGEST:g}"
    where = f"{name}.{key}" + "".join(f", value {int(i) + 1}" for i in index)
    if detail["type"] == "too_small":
        return (
            f"{where}: {show(detail['input'])} is too small to compute with; give {allowed}, of "
            f"size {schema.SMALLEST:g} or more"
        )
    return f"{where}: must be {allowed}, not {show(detail['input'])}"


def check_names(tables: Mapping[str, Any], known: Collection[str]) -> list[str]:
    """Problems of the names at the top level of a file."""
    return [_unknown("", name, known) for name in tables if name not in known]


def _unknown(table: str, key: str, known: Collection[str]) -> str:
    path = one_line(f"{table}.{key}" if table else key, 80)
    homes = [
        f"[{name}]"
        for name, models in schema.TABLES.items()
        if name != table and any(key in model.model_fields for model in models)
    ]
    if homes:
        return f"{path}: is not a key here; it belongs in {' or '.join(homes)}"
    keys = ", ".join(known) if known else "none"
    return f"{path}: is not a known key; those known are {keys}{_suggest(key, known)}"


def _suggest(word: Any, known: Collection[str]) -> str:
    close = difflib.get_close_matches(str(word)[:80], list(known), n=1)
    return f' (did you mean "{close[0]}"?)' if close else ""


def show(value: Any) -> str:
    """A value in words, short and on one line."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int) and value.bit_length() > 64:
        return "an integer of too many digits"
    if isinstance(value, str):
        return f'"{one_line(value, 40)}"'
    if isinstance(value, (list, dict)):
        return "a list" if isinstance(value, list) else "a table"
    return one_line(str(value), 40)
