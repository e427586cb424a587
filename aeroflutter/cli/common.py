"""What the commands share: the case, the ways of output, numbers in and out."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from aeroflutter.errors import InputError
from aeroflutter.limits import within
from aeroflutter.results.plain import plain

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from aeroflutter.case import Case
    from aeroflutter.motion.response import Initial

PLOT_SUFFIXES = (".png", ".svg", ".pdf")
LONGEST = 8  # numbers of a list that are printed for people

CaseName = Annotated[str, Parameter(help="TOML file or name of a built-in case.")]
Json = Annotated[
    bool,
    Parameter(
        name="--json",
        negative=(),
        show_default=False,
        help="Print one JSON object instead of text.",
    ),
]


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class CaseOptions:
    """Changes to the case."""

    set: Annotated[
        list[str],
        Parameter(
            name="--set",
            negative=(),
            show_default=False,
            help="Change a key of the case, as in --set section.mu=50; may be repeated.",
        ),
    ] = field(default_factory=list)

    def load(self, name: str, *, angle: bool = True) -> Case:
        """The case with the changes of `--set`.

        Raises
        ------
        InputError
            If it is no case, or `angle` is asked for and its nonlinear spring is not in one.
        """
        from aeroflutter.case import load_case
        from aeroflutter.case.source import parse_override

        case = load_case(name, dict(map(parse_override, self.set)))
        if angle and case.imported is None and case.model().units[0] != "rad":
            raise InputError(
                f'{case.source}: spring.at: amplitudes are reported in degrees, which "heave" has '
                "not; the Python interface takes it"
            )
        return case


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class Output:
    """Where results go."""

    json: Json = False
    out: Annotated[
        Path | None, Parameter(name="--out", help="Save the result in this NetCDF file (.nc).")
    ] = None
    plot: Annotated[
        Path | None, Parameter(name="--plot", help="Draw into this file (.png, .svg or .pdf).")
    ] = None

    def check(self) -> None:
        """Refuse targets that cannot be written before any work is done.

        Raises
        ------
        InputError
            If a suffix is unknown or a folder does not exist.
        """
        problems = target_problems("--out", self.out, (".nc",))
        problems += target_problems("--plot", self.plot, PLOT_SUFFIXES)
        if problems:
            raise InputError(problems)

    def deliver(
        self,
        payload: Mapping[str, Any],
        *,
        text: Callable[[], None],
        dataset: Callable[[], xr.Dataset] | None = None,
        figure: Callable[[], Figure] | None = None,
    ) -> None:
        """Print, save and draw, each only if asked for.

        Parameters
        ----------
        payload
            What `--json` prints.
        text
            Prints the result for people.
        dataset, figure
            Make what `--out` saves and `--plot` draws.
        """
        from aeroflutter.files import replacing

        if self.out and dataset:
            with replacing(self.out) as part:
                dataset().to_netcdf(part, engine="netcdf4")
        if self.plot and figure:
            from aeroflutter.plots.style import save

            with replacing(self.plot) as part:
                save(figure(), part)
        if self.json:
            print_json(payload)
            return
        text()
        for path in (self.out, self.plot):
            if path:
                print(f"written: {path}")

    def result(
        self,
        case: Case,
        made: Callable[[], object],
        *,
        text: Callable[[], None],
        figure: Callable[[], Figure] | None = None,
        facts: Mapping[str, Any] | None = None,
    ) -> None:
        """Deliver the result of an analysis in the encodings that every result has.

        Parameters
        ----------
        case
            What it was computed of.
        made
            Gives the result; called only if it is printed as JSON or saved.
        text, figure
            As for `deliver`.
        facts
            What the command knows besides: printed before the result, and saved as attributes.
        """
        from aeroflutter.results import fields_of, to_dataset

        known = dict(facts or {})
        saved = {key: value for key, value in known.items() if value is not None}
        self.deliver(
            {"title": case.title, **known, **fields_of(made(), case)} if self.json else {},
            text=text,
            dataset=lambda: to_dataset(made(), case=case).assign_attrs(saved),
            figure=figure,
        )


def target_problems(option: str, path: Path | None, suffixes: Sequence[str]) -> list[str]:
    """Why a file cannot be written, line by line; nothing if it can, or is None."""
    if path is None:
        return []
    problems = name_problems(option, path)
    if problems:
        return problems
    if path.suffix.lower() not in suffixes:
        problems.append(f"{option} {path}: must end in {' or '.join(suffixes)}")
    if path.is_dir():
        problems.append(f"{option} {path}: is a directory; name a file in it")
    elif not path.parent.is_dir():
        problems.append(f"{option} {path}: there is no folder {path.parent}; create it first")
    return problems


def name_problems(option: str, path: Path) -> list[str]:
    """Why nothing can have this name: it is too long, a loop of links, holds a NUL."""
    try:
        path.stat()
    except FileNotFoundError:
        pass
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        return [f"{option} {path}: cannot be a file: {reason}; give another name"]
    return []


def print_json(payload: Mapping[str, Any]) -> None:
    """Print one JSON object on one line of stdout."""
    json.dump(plain(payload), sys.stdout, allow_nan=False)
    sys.stdout.write("\n")


def initial_motion(case: Case, alpha_deg: float | None) -> Initial:
    """The initial motion of a case, its pitch as --alpha-deg says if it says anything.

    Raises
    ------
    InputError
        If the pitch is not finite.
    """
    from aeroflutter.motion.response import Initial

    if alpha_deg is None:
        return Initial(**case.initial._asdict())
    if not math.isfinite(alpha_deg):
        raise InputError(f"--alpha-deg: {alpha_deg!r} is not finite; give a number of degrees")
    return Initial(**case.displaced(math.radians(alpha_deg))._asdict())


def numbers(option: str, text: str) -> NDArray[np.float64]:
    """Numbers of an option: `A:B:N` (N of them, both ends included) or a list `a,b,c`.

    Parameters
    ----------
    option
        Name of the option, for messages.
    text
        What was given.

    Returns
    -------
    array (N,)

    Raises
    ------
    InputError
        If the text is neither, or a number is not finite.

    Examples
    --------
    >>> numbers("--speeds", "1:2:3")
    array([1. , 1.5, 2. ])
    """
    import numpy as np

    if ":" not in text:
        return np.array([_number(option, part) for part in text.split(",")])
    parts = text.split(":")
    if len(parts) != 3:
        raise InputError(f'{option}: "{text}" must be A:B:N or a list a,b,c')
    low, high = _number(option, parts[0]), _number(option, parts[1])
    return np.linspace(low, high, _count(option, parts[2]))


def _number(option: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise InputError(f'{option}: "{text.strip()}" is not a number') from None
    if not math.isfinite(value):
        raise InputError(f'{option}: "{text.strip()}" is not finite')
    return value


def _count(option: str, text: str) -> int:
    try:
        count = int(text)
    except ValueError:
        count = 0
    if count < 1:
        raise InputError(f'{option}: N of A:B:N must be a whole number from 1 on, not "{text}"')
    within("numbers", count, option)
    return count


def show_table(headings: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Print rows under headings; numbers to six digits, aligned right."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    rows = list(rows)
    table = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False)
    for index, heading in enumerate(headings):
        numeric = bool(rows) and all(isinstance(row[index], (int, float)) for row in rows)
        table.add_column(heading, justify="right" if numeric else "left", overflow="fold")
    for row in rows:
        table.add_row(*map(shown, row))
    width = None if sys.stdout.isatty() else 200  # a file or a pipe has no edge to wrap at
    Console(markup=False, highlight=False, emoji=False, width=width).print(table)


def show_fields(names: str, rows: Iterable[Mapping[str, Any]], *more: str) -> None:
    """Print records as a table: the fields of these names, then what else the rows have."""
    from aeroflutter.results.fields import FIELDS

    shown = [(FIELDS[name].heading, name + FIELDS[name].kind.suffix) for name in names.split()]
    keys = [key for _, key in shown] + [*more]
    headings = [heading for heading, _ in shown] + [*more]
    show_table(headings, [[row[key] for key in keys] for row in rows])


def show_swings(swings: Sequence[Mapping[str, Any]]) -> None:
    """Print how far every coordinate moves."""
    show_table(
        ("coordinate", "amplitude", "bias", "unit"),
        [tuple(one[key] for key in ("name", "amplitude", "bias", "unit")) for one in swings],
    )


def lowest(onset: Mapping[str, Any], *, digits: int = 6, figures: int = 4) -> str:
    """The record of a lowest cycle as a sentence."""
    ratio, beside = onset["speed_ratio"], "stable" if onset["stable"] else "unstable"
    where = f"U* = {onset['speed']:.{digits}f}"
    if math.isfinite(ratio):
        where = f"U*/U*_L = {ratio:.{digits}f}"
    kind = f"{onset['kind']}, {beside} cycles beside it"
    return f"{where} at {onset['amplitude_deg']:.{figures}g} deg ({kind})"


def show_facts(facts: Mapping[str, Any]) -> None:
    """Print one `label: value` a line, values aligned."""
    width = max(map(len, facts), default=0) + 1
    for label, value in facts.items():
        print(f"{label + ':':<{width}} {shown(value)}")


def shown(value: Any) -> str:
    """A value for people: numbers to six digits, a dash for what does not exist."""
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}" if math.isfinite(value) else "-"
    if isinstance(value, list) and len(value) > LONGEST:
        ends = ", ".join(map(shown, value[:3])), ", ".join(map(shown, value[-2:]))
        return f"[{ends[0]}, ..., {ends[1]}] ({len(value)} numbers)"
    return str(value)
