"""Results for people: facts, sentences and tables that fit the terminal and are plain in a pipe."""

from __future__ import annotations

import math
import shutil
import sys
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from aeroflutter.cli.streams import printable
from aeroflutter.results.unit import spoken_unit

if TYPE_CHECKING:
    from aeroflutter.model.section import Scale

__all__ = [
    "flutter_facts",
    "lowest",
    "say",
    "show_facts",
    "show_fields",
    "show_table",
    "shown",
    "width",
]

LONGEST = 8  # numbers of a list that are printed for people
GAPS = (3, 2)  # spaces between columns: where there is room, and where there is little
NARROWEST = 16  # of a column of text whose lines are broken

# What a table loses first where it is too wide: the last of these, and before them all others.
KEPT = (
    *("U*/U*_L", "V (m/s)", "amplitude (deg)", "stable", "state", "f (Hz)", "family"),
    *("error of U*", "bias (deg)", "k", "period", "period (s)", "largest multiplier"),
)


def width() -> int | None:
    """Columns of the terminal; None where the output goes to a file or a pipe, without an edge."""
    return shutil.get_terminal_size().columns if sys.stdout.isatty() else None


def say(text: str) -> None:
    """Print a sentence, broken between words where the terminal ends."""
    edge = width()
    for line in printable(text).split("\n"):
        print(line if edge is None else "\n".join(_broken(line, edge)))


def _broken(text: str, edge: int, indent: str = "") -> list[str]:
    """Lines of a text: a word, and so a number, is never split."""
    return textwrap.wrap(
        text,
        max(edge, len(indent) + NARROWEST),
        subsequent_indent=indent,
        break_long_words=False,
        break_on_hyphens=False,
    ) or [""]


def show_facts(facts: Mapping[str, Any]) -> None:
    """Print one `label: value` a line, values aligned."""
    facts = {spoken_unit().words(label): value for label, value in facts.items()}
    longest = max(map(len, facts), default=0) + 1
    edge = width()
    for label, value in facts.items():
        text = printable(shown(value))
        line = f"{label + ':':<{longest}} {text}"
        indent = " " * (longest + 1)
        if edge is None or len(line) <= edge:
            print(line)
            continue
        first = f"{label + ':':<{longest}}".replace(" ", "\0")  # spaces that are no place to break
        lines = _broken(f"{first} {text}", edge, indent)
        print("\n".join(lines).replace("\0", " "))


def show_table(headings: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Print rows under headings; numbers to six digits, aligned right.

    On a terminal that is too narrow columns are left out, by their rank in `KEPT`, and named below;
    the first column stays. Numbers are never split, text is broken between words.
    """
    rows = [list(row) for row in rows]
    columns = [
        _Column(heading, [row[place] for row in rows]) for place, heading in enumerate(headings)
    ]
    edge, gap, lost = width(), GAPS[0], list[str]()
    if edge is not None:
        while _wide(columns, gap) > edge and gap > GAPS[-1]:
            gap = GAPS[-1]
        _narrowed(columns, gap, edge)
        while _wide(columns, gap) > edge and len(columns) > 1:
            worst = max(columns[1:], key=lambda one: one.rank)
            lost.append(worst.heading)
            columns.remove(worst)
            for one in columns:
                one.limit = None
            _narrowed(columns, gap, edge)
    _print(columns, gap)
    if lost:
        say(f"(no room for {', '.join(lost)}; a pipe and --json have all columns)")


class _Column:
    """A column of a table as text."""

    def __init__(self, heading: str, values: Sequence[Any]) -> None:
        self.heading = spoken_unit().words(heading)
        self.right = bool(values) and all(isinstance(value, (int, float)) for value in values)
        self.cells = [shown(value) for value in values]
        self.rank = KEPT.index(heading) if heading in KEPT else len(KEPT)
        self.limit: int | None = None

    @property
    def width(self) -> int:
        """Of its widest line."""
        lines = [self.heading, *(line for cell in self.cells for line in self.lines(cell))]
        return max(map(len, lines))

    @property
    def breakable(self) -> bool:
        """Whether it is text of several words."""
        return not self.right and any(len(cell) > NARROWEST and " " in cell for cell in self.cells)

    def lines(self, cell: str) -> list[str]:
        """A cell, on as many lines as it takes."""
        return [cell] if self.limit is None else _broken(cell, self.limit)

    def put(self, text: str) -> str:
        """A line of a cell in its place."""
        return f"{text:>{self.width}}" if self.right else f"{text:<{self.width}}"


def _wide(columns: Sequence[_Column], gap: int) -> int:
    return sum(one.width for one in columns) + gap * (len(columns) - 1)


def _narrowed(columns: Sequence[_Column], gap: int, edge: int) -> None:
    """Break the widest column of text so that the table fits, if that leaves it room."""
    texts = [one for one in columns if one.breakable]
    if not texts or _wide(columns, gap) <= edge:
        return
    widest = max(texts, key=lambda one: one.width)
    room = widest.width - (_wide(columns, gap) - edge)
    if room >= max(NARROWEST, len(widest.heading)):
        widest.limit = room


def _print(columns: Sequence[_Column], gap: int) -> None:
    between = " " * gap
    print(between.join(one.put(one.heading) for one in columns).rstrip())
    print("─" * _wide(columns, gap))
    for place in range(len(columns[0].cells) if columns else 0):
        cells = [one.lines(one.cells[place]) for one in columns]
        for line in range(max(map(len, cells))):
            parts = [
                one.put(lines[line] if line < len(lines) else "")
                for one, lines in zip(columns, cells, strict=True)
            ]
            print(between.join(parts).rstrip())


def show_fields(names: str, rows: Iterable[Mapping[str, Any]], *more: str) -> None:
    """Print records as a table: the fields of these names, then what else the rows have.

    Where the records carry SI units, these stand beside: a velocity before everything else.
    """
    from aeroflutter.results.fields import FIELDS

    rows = list(rows)
    present = {key for row in rows for key in row}
    shown, first = [], []
    for name in names.split():
        field = FIELDS[name]
        shown.append((field.heading, name + field.kind.told.suffix))
        if (si := field.kind.si) is not None and si.named(name) in present:
            shown.append((si.headed(field.heading), si.named(name)))
    if "velocity_m_s" in present:
        first.append((FIELDS["speed"].kind.si.headed(""), "velocity_m_s"))  # type: ignore[union-attr]
    shown = first + [one for one in shown if one not in first] + [(key, key) for key in more]
    show_table(
        [heading for heading, _ in shown], [[row.get(key) for _, key in shown] for row in rows]
    )


def show_swings(swings: Sequence[Mapping[str, Any]]) -> None:
    """Print how far every coordinate moves; a bias that is round-off is none."""
    rows = []
    for one in swings:
        bias = one["bias"] if abs(one["bias"]) > 1e-9 * abs(one["amplitude"]) else 0.0
        rows.append((one["name"], one["amplitude"], bias, one["unit"]))
    show_table(("coordinate", "amplitude", "bias", "unit"), rows)


def lowest(onset: Mapping[str, Any], *, digits: int = 6, figures: int = 4) -> str:
    """The record of a lowest cycle as a sentence."""
    ratio, beside = onset["speed_ratio"], "stable" if onset["stable"] else "unstable"
    where = f"{spoken_unit().speed} = {onset['speed']:.{digits}f}"
    if math.isfinite(ratio):
        where = spoken_unit().words(f"U*/U*_L = {ratio:.{digits}f}")
    if onset.get("velocity_m_s") is not None:
        where = f"{float(onset['velocity_m_s']):.5g} m/s, {where}"
    kind, unit = f"{onset['kind']}, {beside} cycles beside it", spoken_unit()
    size = onset["amplitude" + unit.suffix]
    return f"{where} at {size:.{figures}g} {unit.name} ({kind})"


def flutter_facts(speed: float | None, scale: Scale | None) -> dict[str, Any]:
    """The linear flutter speed, in m/s as well where there is a scale."""
    name = f"linear flutter speed {'U*' if scale is None else scale.speed_name}"
    if speed is None or scale is None:
        return {name: speed}
    return {name: f"{speed:.6g} ({scale.velocity(speed):.5g} m/s)"}


def shown(value: Any) -> str:
    """A value for people: numbers to six digits, a dash for what does not exist."""
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if hasattr(value, "tolist"):
        return shown(value.tolist())
    if isinstance(value, float):
        return f"{value:.6g}" if math.isfinite(value) else "-"
    if isinstance(value, list) and len(value) > LONGEST:
        ends = ", ".join(map(shown, value[:3])), ", ".join(map(shown, value[-2:]))
        return f"[{ends[0]}, ..., {ends[1]}] ({len(value)} numbers)"
    return str(value)
