"""`aeroflutter report`."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from aeroflutter.cli.airspeed import unit
from aeroflutter.cli.common import (
    CaseName,
    CaseOptions,
    Json,
    numbers,
    print_json,
    say,
    target_problems,
)
from aeroflutter.errors import InputError
from aeroflutter.stderr import aside

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from aeroflutter.case import Case

Range = Annotated[str | None, Parameter(allow_leading_hyphen=True)]


def report(
    case: CaseName,
    *,
    out: Annotated[
        Path, Parameter(name="--out", help="Write the page into this file (.html).")
    ] = Path("report.html"),
    speed_ratio: Annotated[
        Range,
        Parameter(help="Speed ratios of the map, A:B:N or a,b,c; by default around the onset."),
    ] = None,
    speed: Annotated[Range, Parameter(help="Airspeeds U* of the map instead.")] = None,
    velocity: Annotated[
        Range, Parameter(help="Airspeeds V of the map in m/s instead, where there are SI data.")
    ] = None,
    alpha_deg: Annotated[
        Range,
        Parameter(
            help="Initial pitches of the map in degrees; by default to twice the case's. Of a "
            "model, displacements of its first spring, in m if that is in m."
        ),
    ] = None,
    periods: Annotated[
        float, Parameter(help="Length of the traces, in periods of linear flutter.")
    ] = 12.0,
    options: CaseOptions = CaseOptions(),
    overwrite: Annotated[
        bool,
        Parameter(
            name="--overwrite",
            negative=(),
            show_default=False,
            help="Let --out replace a file that holds anything but an earlier result of this "
            "command and case.",
        ),
    ] = False,
    json: Json = False,
) -> None:
    """One page to click through: section, root locus, limit cycles, flutter map and motions.

    The page holds all it needs and loads nothing. What does not apply to the case is said on it.
    """
    from aeroflutter.files import replacing
    from aeroflutter.report import ReportOptions, analyse, gather, plotly_source, render

    problems = target_problems("--out", out, (".html",))
    if problems:
        raise InputError(problems)
    loaded = options.load(case)
    earlier = out.exists()
    if earlier and not overwrite and not _same(out, loaded):
        raise InputError(
            f"--out {out}: exists and is no report of this case; give another name, or "
            "--overwrite to replace it"
        )
    speeds = _values("--speed", speed)
    if velocity is not None:
        if speed is not None or speed_ratio is not None:
            raise InputError("--velocity: excludes --speed and --speed-ratio; give one of them")
        speeds = _values("--velocity", velocity)
        speeds = None if speeds is None else speeds * unit("--velocity", loaded)
    settings = ReportOptions(
        speed_ratios=_values("--speed-ratio", speed_ratio),
        speeds=speeds,
        pitches_deg=_values("--alpha-deg", alpha_deg),
        periods=periods,
    )
    plotly = plotly_source()
    found = analyse(loaded, settings, progress=lambda step: aside(f"{step} …"))
    aside("motions …")
    content = gather(found)
    with replacing(out) as part:
        part.write_text(render(loaded, content, plotly), encoding="utf-8")
    payload: dict[str, Any] = {
        "title": loaded.title,
        "out": out,
        "bytes": out.stat().st_size,
        "curves": len(content["curves"]),
        "bifurcations": len(content["events"]),
        "cells": found.map and found.map.grid.cells,
        "motions": len(content["motions"]["headers"]),
        "notes": content["notes"],
    }
    if json:
        print_json(payload)
        return
    say(loaded.title)
    for note in content["notes"]:
        say(f"note: {note}")
    say(f"{'replaced' if earlier else 'written'}: {out}")


def _same(page: Path, case: Case) -> bool:
    """Whether a file is an earlier report of a case."""
    try:
        text = page.read_text(encoding="utf-8")
    except (OSError, ValueError):
        return False
    return 'name="generator" content="aeroflutter' in text and escape(case.text) in text


def _values(option: str, text: str | None) -> NDArray[np.float64] | None:
    """Positive or negative, but in order: what an axis may be."""
    if text is None:
        return None
    values = numbers(option, text)
    if any(values[1:] <= values[:-1]):
        raise InputError(f"{option}: must be ascending, not {text}")
    return values
