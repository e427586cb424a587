"""`aeroflutter reproduce`."""

from __future__ import annotations

import html
import itertools
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from aeroflutter.cli.common import Json, print_json, say
from aeroflutter.cli.progress import progress
from aeroflutter.errors import ConvergenceError, InputError
from aeroflutter.limits import within

if TYPE_CHECKING:
    from aeroflutter.reproduce import Printed


def reproduce(
    *,
    only: Annotated[
        list[str],
        Parameter(
            negative=(),
            show_default=False,
            help="Numbers of the thesis: 4.10, 5.7 (its parts a, b and c), 5.7a, table-5.1; may "
            "be repeated.",
        ),
    ] = [],  # noqa: B006 - never changed; cyclopts shows it as a list
    folder: Annotated[Path, Parameter(help="Where the figures go.")] = Path("out/reproduce"),
    format: Annotated[  # noqa: A002 - the option's name
        Literal["svg", "pdf", "png"], Parameter(help="Format of the figures.")
    ] = "svg",
    workers: Annotated[
        int | None, Parameter(help="Processes side by side; by default one a core.")
    ] = None,
    again: Annotated[
        bool,
        Parameter(negative=(), show_default=False, help="Make also those that are there already."),
    ] = False,
    json: Json = False,
) -> None:
    """The figures and tables of Brooking's thesis, by their own numbers.

    What is there from the same code is kept, so an interrupted run goes on where it stopped.
    """
    from aeroflutter.files import replacing
    from aeroflutter.reproduce import choose
    from aeroflutter.reproduce import reproduce as make
    from aeroflutter.studies.maps import Progress

    if workers is not None and workers < 1:
        raise InputError(f"--workers: must be at least 1, not {workers}")
    within("workers", workers or 1, "--workers")
    exhibits = choose(only)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"--folder {folder}: cannot be made: {error.strerror}") from None
    with progress("exhibits") as report:
        counted = itertools.count(1)
        printed = make(
            exhibits,
            folder,
            suffix=f".{format}",
            workers=workers or os.cpu_count() or 1,
            again=again,
            progress=lambda one: report(Progress("reproducing", next(counted), 0, len(exhibits))),
        )
    failed = [f"{one.exhibit.title}: {one.problem}" for one in printed if one.problem]
    made = [one for one in printed if not one.problem]
    page = folder / "index.html"
    with replacing(page) as part:
        part.write_text(_page(made), encoding="utf-8")
    if json:
        print_json({"folder": folder, "exhibits": [_payload(one) for one in made]})
    else:
        for one in made:
            say(one.caption)
        say(f"written: {len(made)} exhibits in {folder}, all on {page}")
    if failed:
        raise ConvergenceError("; ".join(failed))


def _payload(one: Printed) -> dict[str, object]:
    return {
        "number": one.exhibit.number,
        "file": one.file,
        "caption": one.caption,
        "facts": one.facts,
        "fresh": one.fresh,
    }


_PAGE = """<!doctype html>
<html lang="en"><meta charset="utf-8"><title>Brooking 1998, reproduced</title>
<style>
body {{ font: 16px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto }}
figure {{ margin: 2.5rem 0 }} img {{ max-width: 100% }} figcaption {{ color: #444 }}
pre {{ overflow-x: auto; font-size: 13px }}
</style>
<h1>Brooking 1998, reproduced</h1>
<p>Figures and tables of <cite>Flutter Analysis of a Two-Dimensional Airfoil Containing Structural
Hysteresis Nonlinearities</cite> (Carleton University), by <code>aeroflutter reproduce</code>.</p>
{figures}
</html>
"""


def _page(made: list[Printed]) -> str:
    """All exhibits under each other."""
    return _PAGE.format(figures="\n".join(map(_figure, made)))


def _figure(one: Printed) -> str:
    caption, name = html.escape(one.caption), html.escape(one.file.name)
    if one.file.suffix == ".md":
        body = f"<pre>{html.escape(one.file.read_text(encoding='utf-8'))}</pre>"
    elif one.file.suffix == ".pdf":
        body = f'<a href="{name}">{name}</a>'
    else:
        body = f'<img src="{name}" alt="{caption}" loading="lazy">'
    return f"<figure>{body}<figcaption>{caption}</figcaption></figure>"
