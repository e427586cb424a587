"""The table [model] of a case: a model from a file in place of a section."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from json import dumps, loads
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.case.check import check_variant
from aeroflutter.case.model_keys import MODELS
from aeroflutter.errors import InputError

if TYPE_CHECKING:
    from aeroflutter.model.elsewhere.modal import ModalModel
    from aeroflutter.model.family import Family
    from aeroflutter.model.section import Scale

__all__ = ["BuiltModel", "Imported", "build_model"]


@dataclass(frozen=True, eq=False)
class Imported:
    """A model from a file.

    Attributes
    ----------
    kind : str
        ``"state-space"`` or ``"modal"``.
    family : Family
        Every output open.
    digest : str
        SHA-256 of its files.
    notes : tuple of str
        What was done to it and what is to be said of it.
    one_speed : bool
        Whether it is given at one speed only.
    """

    kind: str
    family: Family
    digest: str
    notes: tuple[str, ...] = ()
    one_speed: bool = False

    @property
    def scale(self) -> Scale | None:
        """What its speeds, times and frequencies are in SI units."""
        return self.family.scale

    @property
    def modal(self) -> ModalModel | None:
        """The modal model that it is, if it is one."""
        from aeroflutter.model.elsewhere.modal import ModalModel

        return self.family if isinstance(self.family, ModalModel) else None

    @property
    def places(self) -> dict[str, str]:
        """Unit of every output by its name."""
        return dict(zip(self.family.names, self.family.units, strict=True))


@dataclass(frozen=True)
class BuiltModel:
    """The model of a case, its table with the whole path of its file, and what is wrong."""

    model: Imported | None = None
    values: dict[str, Any] = field(default_factory=dict)
    problems: list[str] = field(default_factory=list)


def build_model(given: Any, folder: Path) -> BuiltModel:
    """The model that a table [model] describes; its file is looked for beside the case."""
    table = check_variant("model", "kind", MODELS, given)
    if table.problems:
        return BuiltModel(None, table.values, table.problems)
    values = dict(table.values)
    problems = [
        f"model.{name}: must hold words, numbers, lists or tables, not a date or a time"
        for name, value in values.items()
        if not _plain(value)
    ]
    if problems:
        return BuiltModel(None, values, problems)
    try:
        files = _files(values.get("file"), folder)
        values["file"] = [str(file) for file in files] if len(files) > 1 else str(files[0])
        model = _kept(dumps(values, sort_keys=True), tuple(map(_state, files)))
    except InputError as error:
        return BuiltModel(None, values, [f"model.{problem}" for problem in error.problems])
    return BuiltModel(model, values)


def _plain(value: Any) -> bool:
    """Whether a value is of JSON's kinds: TOML has others."""
    try:
        dumps(value)
    except TypeError:
        return False
    return True


@lru_cache(maxsize=8)
def _kept(table: str, states: tuple[tuple[str, int, int], ...]) -> Imported:
    """The model of a table, read and approximated once as long as its files stay the same."""
    return _built(loads(table), [Path(name) for name, _, _ in states])


def _state(file: Path) -> tuple[str, int, int]:
    try:
        found = file.stat()
    except (OSError, ValueError):
        return str(file), 0, 0
    return str(file), found.st_mtime_ns, found.st_size


def _files(given: Any, folder: Path) -> list[Path]:
    names = given if isinstance(given, list) else [given]
    if not names or not all(isinstance(name, str) and name and "\0" not in name for name in names):
        raise InputError(["file: must be the name of a file, or a list of them"])
    return [(folder / name).resolve() for name in names]


def _built(values: Mapping[str, Any], files: Sequence[Path]) -> Imported:
    from aeroflutter.model.elsewhere.read_modes import modal_model
    from aeroflutter.model.elsewhere.read_states import state_space
    from aeroflutter.model.elsewhere.variables import read_variables

    try:
        stored = [read_variables(file) for file in files]
    except InputError as error:
        raise InputError([f"file: {problem}" for problem in error.problems]) from None
    chosen = {name: value for name, value in values.items() if name not in ("kind", "file")}
    make = state_space if values["kind"] == "state-space" else modal_model
    with np.errstate(all="ignore"):
        try:
            family, notes, one_speed = make(chosen, stored)
        except (ArithmeticError, np.linalg.LinAlgError, ValueError) as error:
            words = " ".join(str(error).split())[:120]
            raise InputError([f"file: its numbers cannot be computed with ({words})"]) from None
    digest = hashlib.sha256()
    for file in files:
        digest.update(file.read_bytes())
    made = Imported(values["kind"], family, digest.hexdigest(), tuple(notes), one_speed)
    _check_names(made)
    return made


def _check_names(made: Imported) -> None:
    names = made.family.names
    problems = []
    if len(set(names)) < len(names):
        twice = sorted({name for name in names if names.count(name) > 1})
        problems.append(f"names: every output needs its own; {', '.join(twice)} comes twice")
    bad = [name for name in names if not name.replace("_", "").replace("-", "").isalnum()]
    if bad or not all(name.isascii() for name in names):
        problems.append("names: must be words of letters, digits, _ and -")
    if any(name.isdigit() for name in names):
        problems.append("names: must not be numbers")
    unknown = sorted({unit for unit in made.family.units if unit not in ("rad", "m", "semichord")})
    if unknown:
        problems.append(f'units: must be "rad" or "m", not {", ".join(unknown)[:60]}')
    if problems:
        raise InputError(problems)


def with_notes(model: Imported, *notes: str) -> Imported:
    """The same with more to be said of it."""
    return replace(model, notes=(*model.notes, *notes))
