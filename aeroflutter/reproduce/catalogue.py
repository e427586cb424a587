"""What there is to reproduce: B. Brooking's figures 3.2 to 5.31c and Table 5.1, as data.

Where the scan has lost a value, the one used here is in `note`, which the caption repeats.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from aeroflutter.errors import InputError

__all__ = ["EXHIBITS", "Exhibit", "choose"]


@dataclass(frozen=True, kw_only=True)
class Exhibit:
    """One figure or table.

    Attributes
    ----------
    number
        As the thesis has it: "4.10", "5.7a", "table-5.1".
    caption
        What it shows.
    kind
        Name of the function in `figures` that makes it.
    case
        Built-in case.
    changes
        Keys of the case that differ, as `--set` has them.
    settings
        Keywords of the function.
    note
        What is known of its parameters.
    """

    number: str
    caption: str
    kind: str
    case: str
    changes: Mapping[str, float] = field(default_factory=dict)
    settings: Mapping[str, Any] = field(default_factory=dict)
    note: str = ""

    @property
    def name(self) -> str:
        """Stem of its files: figures sort by number."""
        found = re.fullmatch(r"(\d+)\.(\d+)(\w*)", self.number)
        if found is None:
            return self.number
        chapter, figure, part = found.groups()
        return f"figure-{chapter}.{int(figure):02d}{part}"

    @property
    def title(self) -> str:
        """Heading: number and caption."""
        number = self.number.replace("table-", "Table ")
        return f"{number if number.startswith('Table') else f'Figure {number}'}: {self.caption}"

    def sentence(self, facts: Mapping[str, Any]) -> str:
        """Title, the numbers of the figure, and what is known of its parameters."""
        numbers = ", ".join(f"{name.replace('_', ' ')} {_short(facts[name])}" for name in facts)
        return " ".join(
            part for part in (f"{self.title}.", f"{numbers}." if numbers else "", self.note) if part
        )


def _short(value: Any) -> str:
    if isinstance(value, list | tuple):
        return " / ".join(map(_short, value))
    return f"{value:.6g}" if isinstance(value, float) else str(value)


_SPEED_LOST = "The thesis does not print the speed; this one gives the motion of its caption."
_TRACES = (
    ("4.1", "Pitch and heave of a limit cycle", 0.95),
    ("4.2", "Damped pitch response", 0.88),
    ("4.3", "Limit-cycle pitch response", 0.93),
    ("4.4", "Damped pitch response above a speed with a limit cycle", 0.975),
    ("4.5", "Limit-cycle pitch response", 0.985),
    ("4.6", "Limit-cycle pitch response close to flutter", 0.995),
    ("4.7", "Unstable pitch response", 1.005),
)

_LOST = {"5.14": 104, "5.15": 105, "5.16": 110}
_RUNS = dict(
    zip(
        ("5.5", "5.6", "5.7", "5.8", "5.9", "5.10", "5.11", "5.12", "5.13", "5.17"),
        (6, 10, 14, 15, 16, 100, 101, 102, 103, 111),
        strict=True,
    )
)
_INFERRED = "Sizes inferred from the ratio in Table 5.1; only the ratio matters."

_OFFSETS_LOST = (
    "The values of the offset runs are lost in the scan; the offsets here are 0.25 and 0.5, the "
    "first and second of the listing, over the loop of the case named."
)
# Runs 25, 27-33 at omega_bar = 0.8 and 120, 121, 130-133 at 0.2, in the order of the figures.
_OFFSETS = (
    *(("run14", run, v, h) for run, v, h in ((25, 0.25, 0.0), (27, 0.5, 0.0), (28, 0.0, 0.25))),
    *(("run14", run, v, h) for run, v, h in ((29, 0.0, 0.5), (30, 0.25, 0.5))),
    *(("run10", run, v, h) for run, v, h in ((31, 0.25, 0.0), (32, 0.5, 0.0), (33, 0.25, 0.5))),
    *(("run102", run, v, h) for run, v, h in ((120, 0.25, 0.0), (121, 0.5, 0.0))),
    *(("run111", run, v, h) for run, v, h in ((130, 0.25, 0.0), (131, 0.5, 0.0))),
    *(("run111", run, v, h) for run, v, h in ((132, 0.0, 0.5), (133, 0.25, 0.5))),
)

_PARTS = (
    ("a", "map", "Flutter map"),
    ("b", "loop", "Restoring moment against pitch"),
    ("c", "amplitudes", "Limit-cycle amplitude against airspeed"),
)


def _chapters_3_and_4() -> Iterable[Exhibit]:
    yield Exhibit(
        number="3.2",
        caption="Restoring moment of the hysteresis spring",
        kind="reversals",
        case="run14",
        settings={"turns_deg": (-1.5, 1.5, -1.5)},
    )
    yield Exhibit(
        number="3.4",
        caption="Restoring moment of the bilinear spring with freeplay and preload",
        kind="reversals",
        case="preload-02",
        settings={"turns_deg": (-1.0, 1.5)},
    )
    for number, caption, ratio in _TRACES:
        yield Exhibit(
            number=number,
            caption=f"{caption}, run 14",
            kind="traces",
            case="run14",
            settings={"speed_ratio": ratio},
            note=_SPEED_LOST,
        )
    for number, caption, turns in (
        ("4.8", "Reversal of pitch on the slope", (1.0, 0.0, 1.0, -1.0, 0.0, -1.0)),
        ("4.9", "Reversal of pitch on the flat", (1.0, -0.5, 1.0, -1.0, 0.5, -1.0)),
    ):
        yield Exhibit(
            number=number,
            caption=caption,
            kind="reversals",
            case="run14",
            settings={"turns_deg": turns},
        )
    yield Exhibit(number="4.10", caption="Root locus", kind="locus", case="linear-02")
    yield Exhibit(
        number="4.11",
        caption="Flutter speed against pitch stiffness",
        kind="stiffness",
        case="linear-02",
    )
    yield Exhibit(
        number="4.12",
        caption="Describing function against amplitude",
        kind="gains",
        case="run14",
        note="The thesis does not say for which run.",
    )


def _chapter_5() -> Iterable[Exhibit]:
    sinusoid = "Values of run 105 are lost; run 111 is as nearly sinusoidal."
    for number, caption, kind, case, ratio, note in (
        ("5.1", "Sinusoidal pitch response", "traces", "run111", 0.95, sinusoid),
        ("5.2", "Spectrum of the sinusoidal response", "spectrum", "run111", 0.95, sinusoid),
        ("5.3", "Pitch response with harmonics, run 102", "traces", "run102", 0.8, _SPEED_LOST),
        ("5.4", "Spectrum of the response with harmonics", "spectrum", "run102", 0.8, _SPEED_LOST),
    ):
        yield Exhibit(
            number=number,
            caption=caption,
            kind=kind,
            case=case,
            settings={"speed_ratio": ratio},
            note=note,
        )
    for figure, run in _RUNS.items():
        for part, kind, caption in _PARTS:
            yield Exhibit(
                number=f"{figure}{part}",
                caption=f"{caption}, run {run}",
                kind=kind,
                case=f"run{run}",
                note="" if run == 14 else _INFERRED,
            )
    for place, (case, run, v_off, h_off) in enumerate(_OFFSETS):
        for part, kind, caption in _PARTS:
            yield Exhibit(
                number=f"5.{18 + place}{part}",
                caption=f"{caption}, run {run}: {case} with V_off = {v_off:g}°, H_off = {h_off:g}°",
                kind=kind,
                case=case,
                note=_OFFSETS_LOST,
                changes={"spring.v_off_deg": v_off, "spring.h_off_deg": h_off},
            )
    yield Exhibit(
        number="table-5.1",
        caption="Speed ratio at which limit cycles start",
        kind="onsets",
        case="run14",
    )


EXHIBITS: tuple[Exhibit, ...] = (*_chapters_3_and_4(), *_chapter_5())
"""All of them, in the order of the thesis."""


def choose(only: Iterable[str] = ()) -> tuple[Exhibit, ...]:
    """The exhibits of these numbers: "4.10", "5.7" (all its parts), "5.7a", "table-5.1".

    Raises
    ------
    InputError
        Naming each number that there is no exhibit for, and why.
    """
    wanted = [number.lower().removeprefix("figure-") for number in only]
    if not wanted:
        return EXHIBITS
    known = {number: [e for e in EXHIBITS if _is(e, number)] for number in wanted}
    problems = [f"--only {number}: {_why_not(number)}" for number in known if not known[number]]
    if problems:
        raise InputError(problems)
    return tuple(e for e in EXHIBITS if any(_is(e, number) for number in wanted))


def _is(exhibit: Exhibit, number: str) -> bool:
    return number in (exhibit.number, exhibit.number.rstrip("abc"), exhibit.name)


def _why_not(number: str) -> str:
    run = _LOST.get(number.rstrip("abc"))
    if run is not None:
        return f"the parameters of run {run} are lost, so its figure cannot be made"
    return "no such figure; give a number from 3.2 to 5.31, as 4.10, 5.7 or 5.7a, or table-5.1"
