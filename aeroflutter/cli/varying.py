"""`--vary KEY=A:B:N`: an analysis for every value of one key of the case, in one answer."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from aeroflutter.cli.numbers import numbers
from aeroflutter.cli.show import say, show_table
from aeroflutter.errors import ConvergenceError, InputError
from aeroflutter.limits import within
from aeroflutter.results.unit import spoken_unit
from aeroflutter.stderr import aside

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from aeroflutter.case import Case
    from aeroflutter.cli.common import Output
    from aeroflutter.model.section import Scale
    from aeroflutter.studies.vary import Member, Members

__all__ = ["Vary"]

Row = dict[str, Any]


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class Vary:
    """A key of the case and its values."""

    vary: Annotated[
        str | None,
        Parameter(
            help="Once for every value of a key of the case, in one answer: KEY=A:B:N or "
            "KEY=a,b,c, as in spring.gap_deg=0.05,0.15."
        ),
    ] = None

    def deliver(
        self,
        case: Case,
        command: str,
        analyse: Callable[[Case], Any],
        output: Output,
        *,
        rows: Callable[[Member, Scale | None], Row],
        facts: Callable[[Case], Row] | None = None,
    ) -> None:
        """Compute every member, and print, save and draw them.

        Parameters
        ----------
        case, command
            What is varied, and which analysis it is.
        analyse
            The analysis of one case.
        rows
            What a member comes to, a line of a table.
        facts
            What else the command knows of a case, for JSON.
        """
        from aeroflutter.results import fields_of, to_dataset
        from aeroflutter.studies.vary import vary

        key, values = self._parsed()
        scale = output.begin(case, command)
        found = vary(case, key, values, _counted(analyse, len(values)))
        fields = fields_of(found, case)
        if facts is not None:
            for record, member in zip(fields["members"], found.members, strict=True):
                record.update(facts(member.case))
        output.deliver(
            {"title": case.title, **fields},
            text=lambda: _print(case, found, [rows(one, scale) for one in found.members]),
            dataset=lambda: to_dataset(found, case=case),
            figure=lambda: _figure(case, found, scale),
            command=f"{command} --vary",
        )
        if found.problems:
            raise ConvergenceError("; ".join(found.problems), found)

    def _parsed(self) -> tuple[str, list[float]]:
        key, equals, text = (self.vary or "").partition("=")
        key, text = key.strip(), text.strip()
        if not (equals and key and text):
            raise InputError(
                f'--vary: "{self.vary}" must be KEY=A:B:N or KEY=a,b,c, as in '
                "spring.gap_deg=0.05,0.15"
            )
        values = numbers(f"--vary {key}", text).tolist()
        within("members", len(values), "--vary")
        return key, values


def _counted(analyse: Callable[[Case], Any], total: int) -> Callable[[Case], Any]:
    """The analysis, with the number of the member on a terminal's stderr."""
    done = 0

    def one(case: Case) -> Any:
        nonlocal done
        done += 1
        if sys.stderr.isatty():
            aside(f"member {done} of {total}")
        return analyse(case)

    return one


def _print(case: Case, found: Members, rows: Sequence[Row]) -> None:
    say(case.title)
    named = [{found.key: one.value, **row} for one, row in zip(found.members, rows, strict=True)]
    headings = list(dict.fromkeys(heading for row in named for heading in row))
    show_table(headings, [[row.get(heading) for heading in headings] for row in named])


def _figure(case: Case, found: Members, scale: Scale | None) -> Figure:
    from aeroflutter.plots.members import plot_members
    from aeroflutter.plots.style import literal

    return plot_members(found, literal(case.title), si=scale is not None)


def onset_row(onset: Any, scale: Scale | None) -> Row:
    """A lowest cycle as a line of a table; dashes where there is none."""
    row: Row = {} if scale is None else {"V (m/s)": onset and scale.velocity(onset["speed"])}
    return row | {
        "U*/U*_L": onset and onset["speed_ratio"],
        "amplitude (deg)": onset and onset["amplitude" + spoken_unit().suffix],
        "kind": onset and onset["kind"],
        "stable": onset and onset["stable"],
    }


def lowest_rows(member: Member, scale: Scale | None) -> Row:
    """The lowest cycle of a member, and the lowest stable one."""
    from aeroflutter.results import fields_of

    fields = fields_of(member.result)
    stable = onset_row(fields["stable_onset"], scale)
    name = "V (m/s)" if scale is not None else "U*/U*_L"
    return onset_row(fields["onset"], scale) | {f"stable from {name}": stable[name]}
