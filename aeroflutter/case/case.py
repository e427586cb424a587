"""Case files: a section, its aerodynamics, a spring and a starting motion, checked as a whole.

Files speak degrees in keys that end in `_deg`; everything here is in radians.
"""

from __future__ import annotations

import dataclasses
import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from aeroflutter.case.placed import outputs, remembers
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
from aeroflutter.model.section import Scale, TypicalSection

if TYPE_CHECKING:
    from aeroflutter.case.build import Built
    from aeroflutter.case.imported import Imported
    from aeroflutter.case.placed import PlacedSpring
    from aeroflutter.model.elsewhere.placed import PlacedModel
    from aeroflutter.model.family import Family, SectionModel
    from aeroflutter.model.lure import AnyFamily, FixedFamily, SectionFamily, SpringFamily
    from aeroflutter.springs import Spring, Springs

__all__ = ["Case", "InitialMotion", "ModelMotion", "builtin_names", "load_case"]

DISPLACEMENT = 1.0
"""Of the first spring of a model at time 0 where the case says nothing: degrees, or m."""


class InitialMotion(NamedTuple):
    """Motion at tau = 0: pitch (rad), heave (semi-chords) and their rates per unit of tau."""

    alpha: float
    alpha_rate: float = 0.0
    xi: float = 0.0
    xi_rate: float = 0.0


class SectionMotion(NamedTuple):
    """The same with more to say: flap angle (rad) and its rate, memories of the springs."""

    alpha: float
    alpha_rate: float = 0.0
    xi: float = 0.0
    xi_rate: float = 0.0
    beta: float = 0.0
    beta_rate: float = 0.0
    memory: tuple[float, ...] | None = None


class ModelMotion(NamedTuple):
    """Motion at time 0 by all states, and the memories of the springs if they are given.

    What is displaced is in the states, so `alpha` is none of its own.
    """

    state: tuple[float, ...]
    memory: tuple[float, ...] | None = None

    @property
    def alpha(self) -> float:
        """Nothing beside the states."""
        return 0.0


@dataclass(frozen=True)
class Case:
    """A case, validated; made by :func:`load_case`.

    Attributes
    ----------
    title : str
        One line for people.
    imported : Imported or None
        The model from a file that stands in place of a section.
    spring : Spring
        The one that is not linear, or the first of several; in the unit of its coordinate, radians
        or semi-chords.
    springs : tuple of PlacedSpring
        All that the file names, with their coordinates; any other coordinate is linear.
    initial : InitialMotion, SectionMotion or ModelMotion
        In radians and semi-chords.
    text : str
        The case as TOML with every key, changes included; :func:`load_case` of it gives an
        equal case.
    source : str
        Where it came from: a file, or the name of a built-in case.
    """

    title: str
    spring: Spring
    springs: tuple[PlacedSpring, ...]
    initial: InitialMotion | SectionMotion | ModelMotion
    text: str
    source: str
    imported: Imported | None = None
    _section: TypicalSection | None = None
    _aerodynamics: Aerodynamics | None = None

    @property
    def section(self) -> TypicalSection:
        """The section.

        Raises
        ------
        InputError
            If a model from a file stands in its place.
        """
        if self._section is None:
            raise InputError([f"{self.source}: section: is not there, [model] is in its place"])
        return self._section

    @property
    def aerodynamics(self) -> Aerodynamics:
        """Wagner or QuasiSteady, of the section.

        Raises
        ------
        InputError
            If a model from a file stands in its place.
        """
        if self._aerodynamics is None:
            raise InputError(
                [f"{self.source}: aerodynamics: is not there, [model] is in its place"]
            )
        return self._aerodynamics

    @property
    def scale(self) -> Scale | None:
        """What turns results into SI units, where there is such a thing."""
        return self.section.scale if self.imported is None else self.imported.scale

    @property
    def own_units(self) -> dict[str, str]:
        """Units of speeds and times where they are not U* and semichords travelled."""
        from aeroflutter.model.elsewhere.scale import ModelScale

        if not isinstance(self.scale, ModelScale):
            return {}
        return {"speed_unit": "m/s", "time_unit": self.scale.time_unit}

    @property
    def one_speed(self) -> bool:
        """Whether it is a model of one speed."""
        return self.imported is not None and self.imported.one_speed

    @property
    def digest(self) -> str:
        """SHA-256 of `text`, and of the file of a model if it has one, for provenance."""
        file = "" if self.imported is None else self.imported.digest
        return hashlib.sha256((self.text + file).encode()).hexdigest()

    @property
    def tables(self) -> dict[str, Any]:
        """The tables of the file, in its units, completed by the defaults."""
        return parse_case(self.text, self.source)

    def model(self) -> SectionModel | PlacedModel:
        """The section, or the model from a file, a spring that is not linear an output.

        Linear springs are part of it, except where there are no others: then the first
        one is an output.
        """
        from aeroflutter.model.family import SectionModel

        outside = outputs(self.springs)
        linear: dict[str, float] = {}
        for item in self.springs:
            if item not in outside:
                linear[item.at] = linear.get(item.at, 0.0) + item.stiffness
        at = [item.at for item in outside]
        stiffness = [item.stiffness for item in outside]
        if self.imported is not None:
            from aeroflutter.model.elsewhere.placed import PlacedModel

            return PlacedModel(self.imported.family, at, stiffness, linear)
        return SectionModel(self.section, self.aerodynamics, at, stiffness, linear)

    @property
    def loop_springs(self) -> tuple[Spring, ...]:
        """The springs that close the loop, one an output of `model`."""
        return tuple(item.spring for item in outputs(self.springs))

    def family(self) -> SectionFamily | SpringFamily | FixedFamily:
        """The section at every airspeed, as the analyses of one spring see it.

        Raises
        ------
        InputError
            If there are several springs that are not linear; `loop` is for any number.
        """
        from aeroflutter.model.lure import FixedFamily, LureSystem, SectionFamily, SpringFamily

        outside = outputs(self.springs)
        if len(outside) > 1:
            places = " and ".join(item.at for item in outside)
            raise InputError(
                [f"spring: there are {len(outside)} that are not linear ({places}); this takes one"]
            )
        model = self.model()
        if self.one_speed:
            speed = model.search_range
            return FixedFamily(LureSystem.of(model.at(speed[0])), speed)
        placed = (model.springs, model.stiffness, model.linear)
        if self.imported is None and placed == (("pitch",), (1.0,), {}):
            return SectionFamily(self.section, self.aerodynamics)
        return SpringFamily(model)

    def loop(self) -> tuple[AnyFamily, Springs]:
        """The section at every airspeed, and what closes it.

        Returns
        -------
        family, spring
            `family` and `spring`, where one spring is not linear; else the `model`, and as many
            springs as it has outputs.
        """
        outside = self.loop_springs
        return (self.family(), outside[0]) if len(outside) == 1 else (self.model(), outside)

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

    def led_by_an_angle(self) -> Case:
        """The case with a spring in an angle before the others, if it has one.

        What is told as the amplitude is that of the first spring; degrees are for angles.
        """
        outside = outputs(self.springs)
        units = self.model().units
        if units[0] == "rad" or "rad" not in units:
            return self
        lead = next(i for i, one in enumerate(self.springs) if one is outside[units.index("rad")])
        order = [lead, *(i for i in range(len(self.springs)) if i != lead)]
        tables = self.tables
        tables["spring"] = [tables["spring"][i] for i in order]
        initial = tables.get("initial", {})
        if "memory" in initial:  # one a spring that remembers, in the order of the springs
            rest = iter(initial["memory"])
            held = {i: next(rest) for i, one in enumerate(self.springs) if remembers(one.spring)}
            initial["memory"] = [held[i] for i in order if i in held]
        return build_case(tables, self.source)

    def displaced(self, alpha: float) -> InitialMotion | SectionMotion | ModelMotion:
        """The initial motion with another pitch, or displacement of the first spring of a model.

        Parameters
        ----------
        alpha : float
            In radians, or in the unit of that spring.
        """
        if not isinstance(self.initial, ModelMotion):
            return self.initial._replace(alpha=alpha)
        if self.imported is not None:
            return self.initial._replace(state=displaced_state(self.model(), alpha))
        pitch = self.model().state_names.index("alpha")
        state = (*self.initial.state[:pitch], alpha, *self.initial.state[pitch + 1 :])
        return self.initial._replace(state=state)


def displaced_state(family: Family, alpha: float) -> tuple[float, ...]:
    """The smallest state in which the first output is `alpha` and nothing moves."""
    row = family.stack(family.search_range[0])[2][0]
    return tuple(float(value) for value in alpha * row / float(row @ row))


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
    tables = parse_case(read_case(source), label)
    return build_case(tables, label, overrides, Path(source).parent)


def build_case(
    tables: dict[str, Any],
    label: str,
    overrides: Mapping[str, Any] | None = None,
    folder: Path | None = None,
) -> Case:
    """Case from parsed tables.

    `label` begins every problem's line; `folder` is where the file of a model is looked for, the
    current one by default.
    """
    from aeroflutter.case.build import build

    try:
        built = build(apply_overrides(tables, overrides or {}), folder or Path())
    except InputError as error:
        raise InputError([f"{label}: {problem}" for problem in error.problems]) from None
    title = built.tables["title"] or label
    made = Case(
        title=title,
        spring=outputs(built.springs)[0].spring,
        springs=built.springs,
        initial=_initial(built),
        text=dump_case(built.tables | {"title": title}),
        source=label,
        imported=built.model,
        _section=built.section,
        _aerodynamics=built.aerodynamics,
    )
    if built.model is None or "state" in built.initial:
        return made
    displacement = built.initial.get("alpha_deg", DISPLACEMENT)
    angle = made.model().units[0] == "rad"
    moved = made.displaced(math.radians(displacement) if angle else displacement)
    return dataclasses.replace(made, initial=moved)


def _initial(built: Built) -> InitialMotion | SectionMotion | ModelMotion:
    said = dict(built.initial)
    memory = _memories(said.pop("memory", None), built.springs)
    if built.model is not None or "state" in said:
        return ModelMotion(tuple(said.get("state", ())), memory)
    values = {
        name.removesuffix("_deg"): math.radians(value) if name.endswith("_deg") else value
        for name, value in said.items()
    }
    assert built.section is not None  # there is one or the other
    if built.section.flap is None and memory is None:
        return InitialMotion(**values)
    return SectionMotion(**values, memory=memory)


def _memories(
    given: Sequence[float] | None, springs: Sequence[PlacedSpring]
) -> tuple[float, ...] | None:
    """One number a spring of the loop; the file has one a spring that remembers."""
    if given is None:
        return None
    rest = iter(given)
    return tuple(next(rest) if remembers(one.spring) else 0.0 for one in outputs(springs))
