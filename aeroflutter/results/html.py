"""Results in notebooks: their facts as a small table."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from html import escape
from typing import Any

from aeroflutter.results import to_json

__all__ = ["html"]

MOST = 40  # rows


def html(result: object) -> str:
    """The facts of a result as an HTML table; lists are counted, and `to_dataframe` has them.

    Parameters
    ----------
    result : object
        A result object of any analysis.
    """
    rows = list(_rows(to_json(result)))[:MOST]
    lines = [
        f"<tr><th style='text-align:left'>{escape(name)}</th><td>{escape(text)}</td></tr>"
        for name, text in rows
    ]
    name = escape(type(result).__name__)
    return f"<table><caption>{name}</caption>{''.join(lines)}</table>"


def _rows(found: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    for name, value in found.items():
        if isinstance(value, Mapping):
            yield from _rows(value, f"{prefix}{name}.")
        else:
            yield prefix + name, _words(value)


def _words(value: Any) -> str:
    if value is None:
        return "-"
    if isinstance(value, float):
        return f"{value:.6g}" if math.isfinite(value) else "-"
    if isinstance(value, list):
        few = len(value) <= 3 and all(isinstance(one, (int, float, str)) for one in value)
        return ", ".join(map(_words, value)) if few else f"{len(value)} of them"
    return str(value)
