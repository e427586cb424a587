"""How a result is laid out: values, records within it, and lists of records; and what reads it.

A `Layout` says which fields of the table a result has and where they are read. `record` makes the
plain values that the command line prints; `columns` makes what Datasets and DataFrames are built
of. Both walk the same layout, so a field that is added to it is in all of them.

In a Dataset one record within another is flattened: `onset` with `speed` is `onset_speed`. A list
of records becomes variables along a dimension of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from aeroflutter.results.fields import COUNT, FIELDS, FLAG, NUMBER, Field, Kind

if TYPE_CHECKING:
    from aeroflutter.model.section import Scale

__all__ = [
    "Above",
    "Column",
    "Entry",
    "Layout",
    "Many",
    "One",
    "Value",
    "View",
    "columns",
    "in_files",
    "layout",
    "record",
]

Read = Callable[[Any], Any]
SAME = "="  # the name itself


@dataclass(frozen=True)
class Entry:
    """One part of a result.

    Attributes
    ----------
    name
        Without the suffix of its unit.
    of
        Where it is read: a dotted path, numbers being places of a sequence, or a function of the
        object; its name by default.
    key, label
        Its name in records and in Datasets; None where it is left out of them. A label that is
        given goes without the prefix of the record that it is in.
    """

    name: str
    of: str | Read = SAME
    key: str | None = SAME
    label: str | None = SAME

    def read(self, source: Any) -> Any:
        """Its value in an object; None where there is no object."""
        if source is None:
            return None
        if callable(self.of):
            return self.of(source)
        for part in (self.name if self.of == SAME else self.of).split("."):
            source = source[int(part)] if part.isdigit() else getattr(source, part)
        return source

    @property
    def called(self) -> str | None:
        """Its name in records."""
        return self.name if self.key == SAME else self.key

    def labelled(self, prefix: str) -> str | None:
        """Its name in Datasets, below a prefix."""
        return prefix + self.name if self.label == SAME else self.label


@dataclass(frozen=True)
class Value(Entry):
    """A number, a text, or an array of them.

    Attributes
    ----------
    dims
        Dimensions; those of the field by default.
    optional
        Whether it is left out of records where there is none.
    meaning
        What it is; by default what the table knows by its label, or else by its name.
    """

    dims: tuple[str, ...] | None = None
    optional: bool = False
    meaning: Field | None = None

    def field(self, label: str = "") -> Field:
        """What it is, of the dimensions that it has here."""
        found = self.meaning or FIELDS.get(label) or FIELDS.get(self.name) or Field("")
        return found if self.dims is None else replace(found, dims=self.dims)


@dataclass(frozen=True, kw_only=True)
class One(Entry):
    """A record within the result, or None; without a name its entries are the result's own."""

    layout: Layout


@dataclass(frozen=True, kw_only=True)
class Many(Entry):
    """A list of records.

    Attributes
    ----------
    layout
        Of one record.
    dim
        Dimension of Datasets along which they lie.
    prefix
        Before their names there.
    scale
        What turns a record into SI units, where each has its own.
    """

    layout: Layout
    dim: str
    prefix: str = ""
    scale: Callable[[Any], Scale | None] | None = None


@dataclass(frozen=True)
class Layout:
    """The parts of a result, in order.

    Attributes
    ----------
    entries
        Its parts.
    frame
        Dimensions of its DataFrame.
    coordinates
        Labels that are coordinates though they do not name a dimension.
    """

    entries: tuple[Entry, ...]
    frame: tuple[str, ...] = ("point",)
    coordinates: tuple[str, ...] = ()

    def speed(self, source: Any, above: Any = None) -> Any:
        """U* that reduced frequencies and times of a record refer to: its own, or that above."""
        own = [e for e in self.entries if isinstance(e, Value) and e.name == "speed"]
        return own[0].read(source) if own else above


def layout(*entries: str | Entry, **settings: Any) -> Layout:
    """A layout whose plain values are given by their names, `name=path` where that is another."""
    return Layout(tuple(entry for one in entries for entry in _made(one)), **settings)


def _made(one: str | Entry, **settings: Any) -> Iterator[Entry]:
    if isinstance(one, Entry):
        yield one
    else:
        for name, _, path in (word.partition("=") for word in one.split()):
            yield Value(name, path or SAME, **settings)


class View:
    """An object with further attributes, or place `at` of one that holds arrays, as a record.

    Parameters
    ----------
    of
        The object.
    at
        The place, if it holds arrays.
    more
        Further attributes, taken as they are.
    """

    def __init__(self, of: Any, at: int | None = None, **more: Any) -> None:
        self.__dict__.update(more, _of=of, _at=at)

    def __getattr__(self, name: str) -> Any:
        value = getattr(self._of, name)
        return value if self._at is None else value[self._at]


def record(
    source: Any, layout: Layout, scale: Scale | None = None, speed: Any = None
) -> dict[str, Any]:
    """An object as a dictionary in the units of files, SI units beside them if there is a scale.

    Parameters
    ----------
    source
        What the layout reads.
    layout : Layout
    scale : Scale, optional
        Of the section.
    speed : float, optional
        U* where the record has none of its own.
    """
    found: dict[str, Any] = {}
    speed = layout.speed(source, speed)
    for entry in layout.entries:
        key, value = entry.called, entry.read(source)
        if key is None:
            continue
        if isinstance(entry, Value):
            if value is not None or not entry.optional:
                found |= _named(key, value, entry.field(), scale, speed)
        elif isinstance(entry, One):
            inner = None if value is None else record(value, entry.layout, scale, speed)
            found |= {key: inner} if key else inner or {}
        elif isinstance(entry, Many):
            own = entry.scale or (lambda _: scale)
            found[key] = [record(row, entry.layout, own(row), speed) for row in value]
    return found


def _named(key: str, value: Any, field: Field, scale: Scale | None, speed: Any) -> dict[str, Any]:
    """One value of a record, and its companion in SI units."""
    told = field.kind.of(value, scale, speed)
    suffix = field.kind.told.suffix
    found = {key + suffix: in_files(told, field)}
    if suffix != field.kind.suffix:  # what is no angle has no degrees
        found[key + field.kind.suffix] = None
    if scale is not None and field.kind.si is not None:
        converted = field.kind.si.of(value, scale, speed)
        if converted is not None:
            found[field.kind.si.named(key)] = in_files(converted, replace(field, kind=NUMBER))
    return found


def in_files(value: Any, field: Field) -> Any:
    """A value of a record in the units of files: no empty text, and no band without an end."""
    if value is None or isinstance(value, str):
        return value or None
    kind = field.kind.told
    if kind.factor != 1.0:
        value = np.asarray(value) * kind.factor
    if "band" in field.dims:
        return value if np.isfinite(value).all() else None
    if np.ndim(value) == 0 and kind in (FLAG, COUNT):
        return bool(value) if kind is FLAG else int(value)
    return value


class Above(NamedTuple):
    """What a record takes from those above it: U*, and what turns it into SI units."""

    speed: Any = None
    scale: Scale | None = None


@dataclass(frozen=True)
class Column:
    """A field of a whole result, as Datasets hold it.

    Attributes
    ----------
    label
        Its name, with the suffix of its unit.
    field
        What it is, with all its dimensions; without dimensions it is a fact.
    read
        (result, what is above it) -> value, or nested lists of values along the dimensions.
    derived
        Whether it only says another field in SI units.
    """

    label: str
    field: Field
    read: Callable[[Any, Above], Any]
    derived: bool = False


def columns(layout: Layout, scale: Scale | None = None, prefix: str = "") -> Iterator[Column]:
    """Every field of a result that a Dataset holds, SI units beside them if there is a scale.

    Parameters
    ----------
    layout : Layout
    scale : Scale, optional
        Of the section.
    prefix : str
        Before labels.
    """
    for entry in layout.entries:
        label = entry.labelled(prefix)
        if label is None:
            continue
        if isinstance(entry, Value):
            yield from _of_value(entry, label, layout, scale)
        elif isinstance(entry, One):
            for one in columns(entry.layout, scale, f"{label}_" if entry.name else prefix):
                yield _within(one, entry, layout)
        elif isinstance(entry, Many):
            inner = list(columns(entry.layout, scale, entry.prefix))
            labels = {one.label for one in inner}
            for one in inner:
                yield _along(one, entry, layout, labels)


def _of_value(entry: Value, label: str, layout: Layout, scale: Scale | None) -> Iterator[Column]:
    field = entry.field(label)
    kind = field.kind
    yield Column(
        label + kind.told.suffix,
        field,
        lambda source, above: kind.of(
            entry.read(source), above.scale or scale, layout.speed(source, above.speed)
        ),
    )
    if scale is not None and (si := kind.si) is not None:
        yield Column(
            si.named(label),
            replace(field, kind=Kind(si.units), long_name=si.long_name),
            lambda source, above: si.of(
                entry.read(source), above.scale or scale, layout.speed(source, above.speed)
            ),
            derived=True,
        )


def _within(one: Column, entry: One, layout: Layout) -> Column:
    """A column of a record within a record."""

    def read(source: Any, above: Above) -> Any:
        own = above._replace(speed=layout.speed(source, above.speed))
        return one.read(entry.read(source), own)

    return replace(one, read=read)


def _along(one: Column, entry: Many, layout: Layout, labels: set[str]) -> Column:
    """A column of a list of records; what was a coordinate of each is one of none of them."""

    def read(source: Any, above: Above) -> Any:
        own = above._replace(speed=layout.speed(source, above.speed))
        rows = entry.read(source) or ()
        scales = [entry.scale(row) if entry.scale else own.scale for row in rows]
        return [
            one.read(row, own._replace(scale=scale))
            for row, scale in zip(rows, scales, strict=True)
        ]

    dims = [f"{dim}_place" if dim in labels and entry.scale else dim for dim in one.field.dims]
    pair = ("band",) if one.field.pair else ()
    return replace(one, field=replace(one.field, dims=(entry.dim, *dims, *pair)), read=read)


def within(path: str, names: str) -> Iterator[Entry]:
    """Fields that are read within an attribute."""
    return (Value(name, f"{path}.{name}") for name in names.split())


def bulk(names: str, along: tuple[str, ...] | None = None) -> Iterator[Entry]:
    """Fields that are too much for one line of JSON, and perhaps arrays along some dimensions."""
    return _made(names, key=None, dims=along)


def along(dim: str, names: str) -> Iterator[Entry]:
    """Fields that are arrays along a dimension."""
    return _made(names, dims=(dim,))


def rows(one: Any, count: int, **more: Any) -> list[View]:
    """An object that holds arrays, as records."""
    return [View(one, i, **more) for i in range(count)]
