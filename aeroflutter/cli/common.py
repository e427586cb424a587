"""What the commands share: the case, the ways of output, numbers in and out."""

from __future__ import annotations

import json
import math
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from aeroflutter.cli.numbers import numbers
from aeroflutter.cli.show import (
    flutter_facts,
    lowest,
    say,
    show_facts,
    show_fields,
    show_swings,
    show_table,
    shown,
)
from aeroflutter.errors import AeroflutterError, InputError
from aeroflutter.results.plain import plain
from aeroflutter.results.unit import speak, start_unit

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from aeroflutter.case import Case
    from aeroflutter.model.section import Scale
    from aeroflutter.motion.response import Initial

PLOT_SUFFIXES = (".png", ".svg", ".pdf")

__all__ = [
    "CaseName",
    "CaseOptions",
    "Json",
    "Output",
    "Plot",
    "PlotWidth",
    "Units",
    "flutter_facts",
    "initial_motion",
    "lowest",
    "numbers",
    "plain",
    "print_json",
    "say",
    "show_facts",
    "show_fields",
    "show_swings",
    "show_table",
    "shown",
    "shown_scale",
    "target_problems",
]

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


Plot = Annotated[
    Path | None, Parameter(name="--plot", help="Draw into this file (.png, .svg or .pdf).")
]
PlotWidth = Annotated[
    float | None,
    Parameter(
        name="--plot-width",
        help="Width of the figure in mm, as 85 or 180 for the columns of a journal; text has the "
        "size in which it is read there.",
    ),
]
Units = Annotated[
    Literal["si", "nondimensional"] | None,
    Parameter(
        name="--units",
        help="Units of tables and figures: si (m/s, Hz, s) is the default where the case has SI "
        "data. Files and --json hold both.",
    ),
]


def shown_scale(units: str | None, case: Case) -> Scale | None:
    """What turns tables and figures into SI units; None where they stay nondimensional.

    Raises
    ------
    InputError
        If SI units are asked for and the case has no SI data.
    """
    scale = case.scale
    if units == "si" and scale is None:
        raise InputError(
            f"--units si: {case.source} has no SI data; give the section in a table [section.si]"
        )
    return None if units == "nondimensional" else scale


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
        """The case with the changes of `--set`; what follows is told in its unit.

        That is the unit of its first spring; where an angle is asked for, one in an angle is put
        first, if there is one.

        Raises
        ------
        InputError
            If it is no case.
        """
        from aeroflutter.case import load_case
        from aeroflutter.case.source import parse_override

        case = load_case(name, dict(map(parse_override, self.set)))
        if angle:
            case = case.led_by_an_angle()
        speak(case)
        return case


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class Output:
    """Where results go."""

    json: Json = False
    out: Annotated[
        Path | None, Parameter(name="--out", help="Save the result in this NetCDF file (.nc).")
    ] = None
    plot: Plot = None
    plot_width: PlotWidth = None
    units: Units = None
    overwrite: Annotated[
        bool,
        Parameter(
            name="--overwrite",
            negative=(),
            show_default=False,
            help="Let --out replace a file that holds anything but an earlier result of this "
            "command and case.",
        ),
    ] = False

    def check(self) -> None:
        """Refuse targets that cannot be written before any work is done.

        Raises
        ------
        InputError
            If a suffix is unknown or a folder does not exist.
        """
        problems = target_problems("--out", self.out, (".nc",))
        problems += target_problems("--plot", self.plot, PLOT_SUFFIXES)
        if self.plot_width is not None:
            problems += _width_problems(self.plot_width, drawn=self.plot is not None)
        if problems:
            raise InputError(problems)

    def begin(self, case: Case, command: str) -> Scale | None:
        """Before a command computes: what its tables and figures are scaled by, None in U* and tau.

        Raises
        ------
        InputError
            If there are no SI data to show, or `--out` holds something else.
        """
        if self.out is not None and self.out.exists() and not self.overwrite:
            other = _other(self.out, case, command)
            if other:
                raise InputError(
                    f"--out {self.out}: exists and {other}; give another name, or --overwrite to "
                    "replace it"
                )
        return shown_scale(self.units, case)

    def deliver(
        self,
        payload: Mapping[str, Any],
        *,
        text: Callable[[], None],
        dataset: Callable[[], xr.Dataset] | None = None,
        figure: Callable[[], Figure] | None = None,
        command: str = "",
    ) -> None:
        """Print, save and draw, each only if asked for; what fails takes nothing else with it.

        Parameters
        ----------
        payload
            What `--json` prints.
        text
            Prints the result for people.
        dataset, figure
            Make what `--out` saves and `--plot` draws.
        command
            Noted in what is saved.
        """
        failed: list[Exception] = []
        try:
            print_json(payload) if self.json else text()
        except OSError as error:  # a reader that has gone takes no file with it
            failed.append(error)
        targets: list[tuple[str, Path | None, Any, Callable[[Path, Any, str], None]]] = [
            ("--out", self.out, dataset, _saved),
            ("--plot", self.plot, figure, _drawn),
        ]
        for option, path, make, write in targets:
            if path is None or make is None:
                continue
            earlier = option == "--out" and path.exists()
            try:
                with self._wide():
                    write(path, make, command)
            except FAILURES as error:
                failed.append(_worded(f"{option} {path}", error))
            else:
                if not (self.json or failed):
                    say(f"{'replaced' if earlier else 'written'}: {path}")
        if len(failed) > 1 and not isinstance(failed[0], OSError):
            raise AeroflutterError("; ".join(map(str, failed)))
        if failed:
            raise failed[0]

    def _wide(self) -> AbstractContextManager[None]:
        """Figures of the width that is asked for, if one is."""
        if self.plot_width is None:
            return nullcontext()
        from aeroflutter.plots.style import sized

        return sized(self.plot_width)

    def result(
        self,
        case: Case,
        made: Callable[[], object],
        *,
        text: Callable[[], None],
        figure: Callable[[], Figure] | None = None,
        facts: Mapping[str, Any] | None = None,
        command: str = "",
    ) -> None:
        """Deliver the result of an analysis in the encodings that every result has.

        Parameters
        ----------
        case
            What it was computed of.
        made
            Gives the result; called only if it is printed as JSON or saved.
        text, figure, command
            As for `deliver`.
        facts
            What the command knows besides: printed before the result, and saved as attributes.
        """
        from aeroflutter.results import fields_of, to_dataset

        known = dict(facts or {})
        saved = {
            key: int(value) if isinstance(value, bool) else value  # NetCDF has no truth values
            for key, value in known.items()
            if value is not None
        }
        self.deliver(
            {"title": case.title, **known, **fields_of(made(), case)} if self.json else {},
            text=text,
            dataset=lambda: to_dataset(made(), case=case).assign_attrs(saved),
            figure=figure and (lambda: spoken(figure(), case)),
            command=command,
        )


def spoken(figure: Figure, case: Case) -> Figure:
    """The figure in the words of the coordinate that the first spring of a case is in."""
    from aeroflutter.plots.style import named_after

    return named_after(figure, case.model().names[0])


FAILURES = (
    *(AeroflutterError, OSError, ValueError, TypeError, LookupError, ArithmeticError),
    *(RuntimeError, AttributeError, AssertionError),
)
"""What saving or drawing may end in, with the result already told."""


def _saved(path: Path, make: Callable[[], xr.Dataset], command: str) -> None:
    from aeroflutter.files import replacing

    with replacing(path) as part:
        dataset = make().assign_attrs({"command": command} if command else {})
        try:
            dataset.to_netcdf(part, engine="netcdf4")
        except (OSError, RuntimeError):
            _tried(part)
            raise


def _tried(file: Path) -> None:
    """Say what stops a write: of a full disk the library tells that permission is denied."""
    with open(file, "wb") as probe:
        probe.write(bytes(1 << 16))
        probe.flush()
        os.fsync(probe.fileno())


def _drawn(path: Path, make: Callable[[], Figure], _: str) -> None:
    from aeroflutter.files import replacing
    from aeroflutter.plots.style import save

    with replacing(path) as part:
        save(make(), part)


def _worded(target: str, error: Exception) -> Exception:
    """What became of a file, in a line; bad input stays what it is."""
    if isinstance(error, InputError | OSError):
        return error
    reason = " ".join(str(error).split()) or type(error).__name__
    return AeroflutterError(f"{target}: cannot be made: {reason}; the result is above")


def _other(path: Path, case: Case, command: str) -> str:
    """What else than the result of this command and case a file holds; nothing if it holds that."""
    import xarray as xr

    try:
        with xr.open_dataset(path, engine="netcdf4") as held:
            found = held.attrs
    except FAILURES:  # a damaged file may raise anything
        return "is no file of this program"
    if found.get("command") != command:
        return f"holds a result of {found.get('command') or 'another command'}"
    return "" if found.get("case") == case.text else f"holds {found.get('title', 'another case')}"


def _width_problems(width: float, *, drawn: bool) -> list[str]:
    from aeroflutter.plots.style import WIDTHS

    if not drawn:
        return ["--plot-width: belongs to --plot; name the file of the figure"]
    low, high = WIDTHS
    if not low <= width <= high:
        return [f"--plot-width: must be {low:g} to {high:g} mm, not {width:g}"]
    return []


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
    return Initial(**case.displaced(alpha_deg / start_unit().factor)._asdict())
