"""A commented case file with every key, its default and its meaning, written from the schema."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from pydantic_core import PydanticUndefined

from aeroflutter.case import schema

_WIDTH = 31
_TAGS = ("model", "kind")


def template(kind: str = "hysteresis", *, dimensional: bool = False) -> str:
    """Text of a case file that loads as it stands.

    Parameters
    ----------
    kind
        Kind of the spring; the other kinds follow as comments.
    dimensional
        Give the section in SI units, and the nondimensional keys as comments.
    """
    return "\n".join(
        [
            "# A case of aeroflutter. A key left out takes its default, which is the value shown,",
            "# except where the comment says that it must be given. Angles are in degrees.",
            'title = "untitled"',
            "",
            *_section(dimensional),
            "",
            *_flap(),
            "",
            "[aerodynamics]",
            '# model = "quasi-steady"'.ljust(_WIDTH) + "# lift without lag, of pitch alone; or:",
            '# model = "quasi-steady-rates"'.ljust(_WIDTH) + " # lift without lag, rates too; or:",
            *_wagner(),
            "",
            "[spring]",
            *_springs(kind),
            "",
            f"[initial]{'':<{_WIDTH - 9}}# the motion at tau = 0",
            *_keys(schema.Initial, leave=schema.Start.model_fields),
            *(f"# {line}" for line in _keys(schema.FlapInitial, leave=schema.Initial.model_fields)),
            *(f"# {line}" for line in _keys(schema.Start)),
            "",
        ]
    )


def _section(dimensional: bool) -> Iterator[str]:
    shared = schema.DimensionalSection.model_fields
    yield "[section]"
    for name, line in zip(schema.Section.model_fields, _keys(schema.Section), strict=True):
        own = (name in shared or not dimensional) and "# or: " not in line
        yield line if own else f"# {line}"
    yield ""
    stated = schema.Section.model_fields.items()
    replaced = ", ".join(n for n, key in stated if n not in shared and key.default is not None)
    yield f"# Or per unit span in SI units, in the place of {replaced};"
    yield "# of the keys that begin with 'or' and the one before them give one."
    mark = "" if dimensional else "# "
    yield f"{mark}[section.si]"
    for line in _keys(schema.Dimensional, leave=shared):
        yield f"# {line}" if "# or: " in line or not dimensional else line


def _wagner() -> Iterator[str]:
    for line in _keys(schema.WagnerKeys, 'model = "wagner"'):
        yield f"# {line}" if line.startswith(("a = ", "b = ")) else line


def _flap() -> Iterator[str]:
    yield "# A trailing-edge flap; with [section.si], [flap.si] may take the place of all but"
    yield "# hinge and zeta_beta."
    yield "# [flap]"
    yield from (f"# {line}" for line in _keys(schema.FlapKeys))
    yield "# [flap.si]"
    yield from (f"# {line}" for line in _keys(schema.DimensionalFlap))


def _springs(kind: str) -> Iterator[str]:
    for line in (
        'at = "pitch"'.ljust(_WIDTH) + '# or "heave" (semi-chords: keys without _deg), "flap"',
        "stiffness = 1.0".ljust(_WIDTH) + "# of its unit slope, over the nominal stiffness",
    ):
        yield f"# {line}"
    for line in _keys(schema.SPRINGS[kind], f'kind = "{kind}"'):
        yield f"# {line}" if "# or: " in line else line
    for other, model in schema.SPRINGS.items():
        if other != kind:
            yield "#"
            yield from (f"# {line}" for line in _keys(model, f'kind = "{other}"'))


def _keys(model: type[schema.Table], tag: str = "", leave: Collection[str] = ()) -> Iterator[str]:
    if tag:
        meaning = (model.__doc__ or "").strip().rstrip(".")
        line = f"{tag:<{_WIDTH}}# {meaning[:1].lower()}{meaning[1:]}"
        yield line if meaning else tag  # `python -OO` has no docstrings
    for name, field in model.model_fields.items():
        if name in _TAGS or name in leave:
            continue
        about = schema.metadata(model, name)
        default = field.default
        given = default is PydanticUndefined or default is None
        value = about["example"] if given else default
        line = f"{name} = {value}" if given or not isinstance(value, str) else f'{name} = "{value}"'
        note = "; must be given" if default is PydanticUndefined else ""
        yield f"{line:<{_WIDTH}}# {about['meaning']}{note}"
