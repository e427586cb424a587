"""Case files: a section, its aerodynamics, a spring and a starting motion, checked as a whole.

Files speak degrees in keys that end in `_deg`; everything here is in radians.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from aeroflutter.case.source import (
    apply_overrides,
    builtin_names,
    dump_case,
    one_line,
    parse_case,
    plain,
    read_case,
)
from aeroflutter.errors import InputError
from aeroflutter.model.aerodynamics import Aerodynamics
from aeroflutter.model.section import TypicalSection

if TYPE_CHECKING:
    from aeroflutter.model.lure import SectionFamily
    from aeroflutter.springs import Spring

__all__ = ["Case", "InitialMotion", "builtin_names", "load_case"]


class InitialMotion(NamedTuple):
    """Motion at tau = 0: pitch (rad), heave (semi-chords) and their rates per unit of tau."""

    alpha: float
    alpha_rate: float = 0.0
    xi: float = 0.0
    xi_rate: float = 0.0


@dataclass(frozen=True)
class Case:
    """A case, validated; made by :func:`load_case`.

    Attributes
    ----------
    title : str
        One line for people.
    section : TypicalSection
    aerodynamics : Wagner or QuasiSteady
    spring : Spring
        In radians.
    initial : InitialMotion
        In radians and semi-chords.
    text : str
        The case as TOML with every key, changes included; :func:`load_case` of it gives an
        equal case.
    source : str
        Where it came from: a file, or the name of a built-in case.
    """

    title: str
    section: TypicalSection
    aerodynamics: Aerodynamics
    spring: Spring
    initial: InitialMotion
    text: str
    source: str

    @property
    def digest(self) -> str:
        """SHA-256 of `text`, for provenance."""
        return hashlib.sha256(self.text.encode()).hexdigest()

    @property
    def tables(self) -> dict[str, Any]:
        """The tables of the file, in its units, completed by the defaults."""
        return parse_case(self.text, self.source)

    def family(self) -> SectionFamily:
        """The section at every airspeed, as the analyses see it."""
        from aeroflutter.model.lure import SectionFamily

        return SectionFamily(self.section, self.aerodynamics)

    def replace(self, key: str, value: Any) -> Case:
        """The case with one key changed, as in ``case.replace("section.zeta_alpha", 0.02)``."""
        return self.with_overrides({key: value})

    def with_overrides(self, overrides: Mapping[str, Any]) -> Case:
        """The case with several keys changed, each named by its dotted path.

        Raises
        ------
        InputError
            If the result is no valid case.
        """
        return build_case(parse_case(self.text, self.source), self.source, overrides)


def load_case(
    source: str | Path | Mapping[str, Any], overrides: Mapping[str, Any] | None = None
) -> Case:
    """Load and check a case.

    Parameters
    ----------
    source : str, Path or mapping
        Name of a built-in case, path of a TOML file, or the tables themselves.
    overrides : mapping, optional
        Values by dotted path, as in ``{"section.mu": 50}``, in the units of the file.

    Raises
    ------
    InputError
        All problems at once, each naming its key and what may stand there.

    Examples
    --------
    >>> load_case("run14", {"section.mu": 50}).section.mu
    50.0
    """
    if isinstance(source, Mapping):
        return build_case(plain(source), "case", overrides)
    label = one_line(str(source))
    return build_case(parse_case(read_case(source), label), label, overrides)


def build_case(
    tables: dict[str, Any], label: str, overrides: Mapping[str, Any] | None = None
) -> Case:
    """Case from parsed tables; `label` begins every problem's line."""
    from aeroflutter.case.build import build

    try:
        built = build(apply_overrides(tables, overrides or {}))
    except InputError as error:
        raise InputError([f"{label}: {problem}" for problem in error.problems]) from None
    motion = built.initial
    title = built.tables["title"] or label
    return Case(
        title=title,
        section=built.section,
        aerodynamics=built.aerodynamics,
        spring=built.spring,
        initial=InitialMotion(
            alpha=math.radians(motion["alpha_deg"]),
            alpha_rate=math.radians(motion["alpha_rate_deg"]),
            xi=motion["xi"],
            xi_rate=motion["xi_rate"],
        ),
        text=dump_case(built.tables | {"title": title}),
        source=label,
    )
