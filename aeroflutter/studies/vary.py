"""One analysis over the values of one key of a case: a family of results."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Protocol

from aeroflutter.analysis import Result
from aeroflutter.errors import AeroflutterError, ConvergenceError, InputError

__all__ = ["Changeable", "Member", "Members", "vary"]


class Changeable(Protocol):
    """What has keys that can be changed: a case."""

    def replace(self, key: str, value: Any) -> Any:
        """The same with one key changed; raises `InputError` where that is no case."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Member:
    """One value, the case there, and what came of it.

    Attributes
    ----------
    value
        Of the key, in the units of the file.
    case
        The case with that value.
    result
        Of the analysis; None where it failed.
    problem
        Why it did; empty where it did not.
    """

    value: float
    case: Any
    result: Any = None
    problem: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class Members(Result):
    """A family of results over the values of a key.

    Attributes
    ----------
    key
        Dotted path of what varies.
    every
        One a value, in the order of the values.
    """

    key: str
    every: tuple[Member, ...]

    @property
    def members(self) -> tuple[Member, ...]:
        """Those that have a result."""
        return tuple(member for member in self.every if not member.problem)

    @property
    def problems(self) -> tuple[str, ...]:
        """Why the others have none."""
        return tuple(
            f"{self.key} = {one.value:g}: {one.problem}" for one in self.every if one.problem
        )


def vary(
    case: Changeable, key: str, values: Iterable[float], analyse: Callable[[Any], Any]
) -> Members:
    """The result of an analysis for every value of a key; one that fails takes no other with it.

    Parameters
    ----------
    case
        A case.
    key
        Dotted path of a key, as in ``spring.gap_deg``.
    values
        In the units of the file.
    analyse
        Called with the case of every value.

    Raises
    ------
    InputError
        If a value makes no valid case: before anything is computed.
    ConvergenceError
        If no value has a result.

    Examples
    --------
    >>> from aeroflutter import load_case
    >>> from aeroflutter.linear.rootlocus import root_locus
    >>> case = load_case("run14")
    >>> found = vary(case, "section.mu", [50, 100], lambda one: root_locus(one.family()))
    >>> [round(member.result.flutter.speed, 4) for member in found.members]
    [3.0746, 4.1145]
    """
    cases = [(float(value), case.replace(key, float(value))) for value in values]
    if not cases:
        raise InputError(f"{key}: give at least one value")
    every = []
    for value, one in cases:
        try:
            every.append(Member(value=value, case=one, result=analyse(one)))
        except AeroflutterError as error:
            every.append(Member(value=value, case=one, problem=" ".join(str(error).split())))
    found = Members(key=key, every=tuple(every))
    if not found.members:
        raise ConvergenceError("; ".join(found.problems), found)
    return found.about(case=case)
