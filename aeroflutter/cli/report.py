"""`aeroflutter report`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from aeroflutter.cli.airspeed import section_only
from aeroflutter.cli.common import (
    CaseName,
    CaseOptions,
    Json,
    numbers,
    print_json,
    target_problems,
)
from aeroflutter.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Range = Annotated[str | None, Parameter(allow_leading_hyphen=True)]


def report(
    case: CaseName,
    *,
    out: Annotated[
        Path, Parameter(name=("--out", "-o"), help="Write the page into this file (.html).")
    ] = Path("report.html"),
    speed_ratio: Annotated[
        Range,
        Parameter(help="Speed ratios of the map, A:B:N or a,b,c; by default around the onset."),
    ] = None,
    speed: Annotated[Range, Parameter(help="Airspeeds U* of the map instead.")] = None,
    alpha_deg: Annotated[
        Range,
        Parameter(help="Initial pitches of the map in degrees; by default to twice the case's."),
    ] = None,
    periods: Annotated[
        float, Parameter(help="Length of the traces, in periods of linear flutter.")
    ] = 12.0,
    options: CaseOptions = CaseOptions(),
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
    settings = ReportOptions(
        speed_ratios=_values("--speed-ratio", speed_ratio),
        speeds=_values("--speed", speed),
        pitches_deg=_values("--alpha-deg", alpha_deg),
        periods=periods,
    )
    loaded = options.load(case)
    section_only(loaded, "report")
    plotly = plotly_source()
    found = analyse(loaded, settings, progress=lambda step: print(f"{step} …", file=sys.stderr))
    print("motions …", file=sys.stderr)
    content = gather(found)
    with replacing(out) as part:
        part.write_text(render(loaded, content, plotly), encoding="utf-8")
    payload: dict[str, Any] = {
        "title": loaded.title,
        "out": out,
        "bytes": out.stat().st_size,
        "curves": len(content["curves"]),
        "bifurcations": len(content["events"]),
        "cells": found.map.grid.cells,
        "motions": len(content["motions"]["headers"]),
        "notes": content["notes"],
    }
    if json:
        print_json(payload)
        return
    print(loaded.title)
    for note in content["notes"]:
        print(f"note: {note}")
    print(f"written: {out}")


def _values(option: str, text: str | None) -> NDArray[np.float64] | None:
    """Positive or negative, but in order: what an axis may be."""
    if text is None:
        return None
    values = numbers(option, text)
    if any(values[1:] <= values[:-1]):
        raise InputError(f"{option}: must be ascending, not {text}")
    return values
