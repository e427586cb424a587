"""`aeroflutter init`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from aeroflutter.cli.show import say
from aeroflutter.errors import InputError

Kind = Literal[
    "linear", "cubic", "table", "bilinear", "freeplay", "hysteresis",
    "polynomial", "saturation", "dead-zone", "relay", "play", "friction",
]  # fmt: skip


def init(
    file: Annotated[Path | None, Parameter(help="File to write; stdout without it.")] = None,
    /,
    *,
    kind: Annotated[Kind, Parameter(help="Kind of the spring.")] = "hysteresis",
    si: Annotated[
        bool, Parameter(negative=(), show_default=False, help="Give the section in SI units.")
    ] = False,
    overwrite: Annotated[
        bool, Parameter(negative=(), show_default=False, help="Replace a file that exists.")
    ] = False,
) -> None:
    """Write a commented case file to start from: every key, its default and its meaning."""
    from aeroflutter.case.template import template
    from aeroflutter.files import replacing

    text = template(kind, dimensional=si)
    if file is None:
        print(text, end="")
        return
    if file.exists() and not overwrite:
        raise InputError(f"{file}: exists; give another name, or --overwrite to replace it")
    if file.is_dir():
        raise InputError(f"{file}: is a directory; name a file in it")
    with replacing(file) as part:
        part.write_text(text, encoding="utf-8")
    say(f"written: {file}")
