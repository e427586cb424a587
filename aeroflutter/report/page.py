"""The page itself: a template, its style and script, and the data of a report put into it."""

from __future__ import annotations

import base64
import gzip
import hashlib
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from importlib.resources import files
from string import Template
from typing import TYPE_CHECKING, Any

from aeroflutter import __version__
from aeroflutter.errors import InputError
from aeroflutter.plots import meaning
from aeroflutter.report.sketch import sketch
from aeroflutter.results.unit import spoken_unit, start_unit, told_of

if TYPE_CHECKING:
    from aeroflutter.case import Case

__all__ = ["plotly_source", "render"]

METHODS = {"df": "describing function", "hb": "harmonic balance", "exact": "exact"}
LETTERS = {
    "damped": "d",
    "lco": "L",
    "aperiodic": "a",
    "divergent": "D",
    "undecided": "?",
    "neutral": "n",
    "failed": "!",
}


def plotly_source() -> str:
    """The text of plotly.js, from the package that brings it.

    Raises
    ------
    InputError
        If plotly is not installed.
    """
    try:
        from plotly.offline import get_plotlyjs
    except ImportError:
        raise InputError(
            'plotly: is not installed, and a report needs it; pip install "aeroflutter[report]"'
        ) from None
    return str(get_plotlyjs())


def render(case: Case, content: Mapping[str, Any], plotly: str) -> str:
    """The whole page as text.

    Parameters
    ----------
    case : Case
    content : mapping
        From `gather`.
    plotly : str
        From `plotly_source`; it is put in compressed, for it is by far the largest part.
    """
    with told_of(case):
        return _rendered(case, content, plotly)


def _rendered(case: Case, content: Mapping[str, Any], plotly: str) -> str:
    text = {name: files(__package__).joinpath(name).read_text(encoding="utf-8") for name in _PARTS}
    library = _HINT + plotly
    packed = gzip.compress(library.encode(), 9, mtime=0)
    script = text["figures.js"] + text["page.js"]
    drawn = {key: content[key] for key in content if key not in _WRITTEN}
    return Template(text["page.html"]).substitute(
        title=escape(content["title"]),
        version=escape(__version__),
        style=_colours() + text["page.css"],
        policy=_policy(script, library),
        script=script,
        plotly=base64.b64encode(packed).decode("ascii"),
        data=_json(drawn),
        layout="three" if case.imported is None else "three modelled",
        sketch=_sketch(case),
        made=_made(case),
        facts=_facts(content["facts"]),
        notes=_notes(content["notes"]),
        parameters=_facts((name, f"{value:g}") for name, value in content["section"].items()),
        case=escape(content["case"]),
        curves=_curves(content),
        cells=_cells(content) if content["map"] else "",
        words=_words(content["map"]) if content["map"] else "",
        mapless="" if content["map"] else " hidden",
        what="section" if case.imported is None else "model",
        coordinate=escape(content["coordinate"]),
        unit=spoken_unit().name,
        effort=spoken_unit().effort,
        start=escape(content["map"]["y"]["name"]) if content["map"] else "",
        modes=_modes(content["locus"]),
        period="period (s)" if {"semichord", "seconds"} & set(content["axis"]) else "period τ",
        counts=_counts(content["map"]["counts"]) if content["map"] else "",
    )


def _sketch(case: Case) -> str:
    """The section to scale; a model from a file has no shape."""
    if case.imported is not None:
        return ""
    drawn = sketch(case.section, case.spring.kind, case.model().names[0])
    said = "The section, to scale. Lengths in semi-chords b."
    return f"<figure>{drawn}<figcaption>{said}</figcaption></figure>\n"


def _made(case: Case) -> str:
    """What a model from a file is made of."""
    if case.imported is None:
        return ""
    model = case.model()
    places = f"springs in {', '.join(model.names)}"
    if len(model.names) == 1:
        places = f"a spring in {model.names[0]}"
    said = f"A model from a file: {len(model.state_names)} states, with {places}."
    return f'<p class="hint">{escape(said)}</p>\n'


_PARTS = ("page.html", "page.css", "figures.js", "page.js")
MOST_ROWS = 40  # of the table of the linear modes
_SHOWN = 3  # notes that are never folded
_WRITTEN = ("facts", "notes", "section", "case")  # in the page's text, not in its data


# It saves Chromium a second parse of most of plotly; elsewhere it is a comment.
_HINT = "//# allFunctionsCalledOnLoad\n"


def _policy(*scripts: str) -> str:
    """What the page may do: run these scripts and no others, and fetch nothing from anywhere."""
    digests = (hashlib.sha256(script.encode()).digest() for script in scripts)
    allowed = " ".join(f"'sha256-{base64.b64encode(digest).decode()}'" for digest in digests)
    return (
        f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; "
        "img-src data: blob:; base-uri 'none'; form-action 'none'"
    )


def _json(value: Any) -> str:
    """JSON that no browser takes for the end of a script."""
    return json.dumps(value, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")


def _colours() -> str:
    """The palette of every other figure, as properties of the page."""
    named = {
        "exact": meaning.EXACT,
        "hb": meaning.HARMONIC,
        "df": meaning.DESCRIBING,
        "proved": meaning.PROVED,
        "warning": meaning.WARNING,
        **{f"mode-{n}": colour for n, colour in enumerate(meaning.SERIES)},
    }
    return "".join(
        [":root{"]
        + [f"--{name}:{colour};" for name, colour in named.items()]
        + [f"--cell-{name}:{colour};" for name, colour in meaning.STATES.items()]
        + ["}\n"]
    )


def _facts(pairs: Iterable[Sequence[str]]) -> str:
    rows = "".join(f"<dt>{escape(label)}</dt><dd>{escape(value)}</dd>" for label, value in pairs)
    return re.sub(r"U\*_(\w)", r"U*<sub>\1</sub>", rows)


def _notes(notes: Sequence[str]) -> str:
    """Items of a list, the rest of a long one folded."""
    items = [f"<li>{escape(note)}</li>" for note in notes]
    if len(items) <= _SHOWN:
        return "".join(items)
    rest = f"<details><summary>{len(items) - _SHOWN} more</summary>"
    return f"{''.join(items[:_SHOWN])}<li>{rest}<ul>{''.join(items[_SHOWN:])}</ul></details></li>"


def _counts(counts: Mapping[str, int]) -> str:
    """Legend of the map: how many cells end how."""
    return "".join(
        f'<li><span class="chip {name}"></span>{_state(name)}: {count}</li>'
        for name, count in counts.items()
        if count
    )


def _state(name: str) -> str:
    return "limit cycle" if name == "lco" else name


def _curves(content: Mapping[str, Any]) -> str:
    """Rows of the table of cycles, bifurcations last."""
    rows = []
    for curve in content["curves"]:
        columns = (curve[name] for name in ("x", "amplitude", "bias", "period", "stable"))
        for n, (x, amplitude, bias, period, stable) in enumerate(zip(*columns, strict=True)):
            word = "stable" if stable else "unstable"
            band = _band(curve, n)
            rows.append((_name(curve), x, amplitude, bias, _time(content, period, x), word + band))
    for event in content["events"]:
        name = METHODS[event["method"]]
        numbers = (event[key] for key in ("x", "amplitude", "bias"))
        rows.append((name, *numbers, _time(content, event["period"], event["x"]), event["kind"]))
    return "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in rows)


def _time(content: Mapping[str, Any], tau: float | None, speed: float) -> float | None:
    """A time in s where the page is in m/s, else in tau."""
    semichord = content["axis"].get("semichord")
    return tau if tau is None or not semichord else tau * semichord / speed


def _modes(locus: Mapping[str, Any]) -> str:
    """Frequency and damping of every mode at some of the airspeeds, with a row of headings."""
    speeds, modes = locus["speeds"], locus["modes"]
    heads = [locus["speed"]]
    for n in range(1, len(modes) + 1):
        heads += [f"mode {n}: {locus['frequency']}", f"mode {n}: damping ratio"]
    rows = ["".join(f'<th scope="col">{escape(one)}</th>' for one in heads)]
    for i in range(0, len(speeds), max(1, len(speeds) // MOST_ROWS)):
        cells = [mode[key][i] for mode in modes for key in ("frequency", "damping")]
        first = f'<th scope="row">{speeds[i]:.5g}</th>'
        rows.append(first + "".join(map(_cell, cells)))
    return "".join(f"<tr>{row}</tr>" for row in rows)


def _words(grid: Mapping[str, Any]) -> str:
    """The map as a list: at every start, from which airspeed to which motions end how."""
    speeds = [grid["x"]["scale"] * value for value in grid["x"]["values"]]
    items = []
    for j, pitch in enumerate(grid["y"]["values"]):
        names = [_name_of(grid, column[j]) for column in grid["state"]]
        runs, start = [], 0
        for i in range(1, len(names) + 1):
            if i == len(names) or names[i] != names[start]:
                ends = f"{speeds[start]:.4g}" + (
                    f" to {speeds[i - 1]:.4g}" if i - 1 > start else ""
                )
                runs.append(f"{names[start]} at {ends}")
                start = i
        items.append(f"<li>{pitch:.4g}{start_unit().mark}: {escape('; '.join(runs))}</li>")
    return "".join(reversed(items))


def _name_of(grid: Mapping[str, Any], state: int) -> str:
    return _state(grid["states"][state]) if state >= 0 else "not computed"


def _band(curve: Mapping[str, Any], n: int) -> str:
    if not curve.get("band") or curve["band"][n][0] is None:
        return ""
    low, high = curve["band"][n]
    return f", proved within {low:.6g} to {high:.6g}"


def _name(curve: Mapping[str, Any]) -> str:
    return f"{METHODS[curve['method']]}, family {curve['family']}"


def _cell(value: Any) -> str:
    shown = escape(value) if isinstance(value, str) else "-" if value is None else f"{value:.6g}"
    return f"<td>{shown}</td>"


def _cells(content: Mapping[str, Any]) -> str:
    """The map as a table: a row a start, the farthest first; a letter a cell."""
    grid = content["map"]
    letters = [LETTERS[name] for name in grid["states"]]
    values = (grid["x"]["scale"] * value for value in grid["x"]["values"])
    speeds = "".join(f'<th scope="col">{value:.4g}</th>' for value in values)
    head = escape(f"{grid['y']['name']} ({start_unit().name})")
    rows = [f'<tr><th scope="col">{head}</th>{speeds}</tr>']
    for j in reversed(range(len(grid["y"]["values"]))):
        states = [column[j] for column in grid["state"]]
        cells = "".join(f"<td>{letters[s] if s >= 0 else '!'}</td>" for s in states)
        rows.append(f'<tr><th scope="row">{grid["y"]["values"][j]:.4g}</th>{cells}</tr>')
    return "".join(rows)
