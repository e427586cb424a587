"""Which of several springs an answer is about: `--spring`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, TypeAlias

from cyclopts import Parameter

from aeroflutter.case.placed import outputs
from aeroflutter.errors import InputError

if TYPE_CHECKING:
    from aeroflutter.case import Case

__all__ = ["Which", "place_of"]

Which: TypeAlias = Annotated[
    str | None,
    Parameter(
        name="--spring",
        help="Of several springs the one that is meant, by its coordinate or its number from 0; "
        "the first by default.",
    ),
]


def place_of(name: str | None, case: Case) -> int:
    """Place of the spring among those that are not linear.

    Raises
    ------
    InputError
        If there is no such spring, or more than one.
    """
    at = [item.at for item in outputs(case.springs)]
    if name is None:
        return 0
    if name.isdigit() and int(name) < len(at):
        return int(name)
    if at.count(name) == 1:
        return at.index(name)
    known = ", ".join(f"{i} ({one})" for i, one in enumerate(at))
    raise InputError(f"--spring: {name} names no one spring; those there are: {known}")
