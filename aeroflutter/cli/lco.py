"""`aeroflutter lco`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from aeroflutter.cli.airspeed import Airspeed, AirspeedRange
from aeroflutter.cli.common import (
    CaseName,
    CaseOptions,
    Output,
    flutter_facts,
    lowest,
    say,
    show_facts,
    show_fields,
    show_table,
)
from aeroflutter.cli.largest import largest_of
from aeroflutter.cli.proving import free_range
from aeroflutter.cli.varying import Vary, lowest_rows
from aeroflutter.errors import InputError
from aeroflutter.results.unit import spoken_unit, told

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from aeroflutter.case import Case
    from aeroflutter.guarantees.absence import Absence
    from aeroflutter.model.section import Scale
    from aeroflutter.orbits.cycles import Cycle, CycleFamily, CyclesAt, LimitCycles
    from aeroflutter.plots.cycles import Overlay

SHOWN = 12  # cycles of a family that are printed


def lco(
    case: CaseName,
    *,
    airspeed: Airspeed = Airspeed(),
    between: AirspeedRange = AirspeedRange(),
    points: Annotated[int, Parameter(help="Cycles on every family.")] = 200,
    largest_deg: Annotated[
        float | None,
        Parameter(help="Largest amplitude followed; by default 50 times the spring's own size."),
    ] = None,
    depth: Annotated[
        int,
        Parameter(help="Rounds of switching to the branches at broken symmetry, doubled period."),
    ] = 2,
    simulations: Annotated[
        int,
        Parameter(help="Motions, at each of sixty speeds, that look for isolated families."),
    ] = 60,
    df: Annotated[
        bool, Parameter(negative=(), help="With --plot: the describing function as well.")
    ] = False,
    simulate: Annotated[
        str | None,
        Parameter(
            help="With --plot: simulated end states at speed ratios A:B:N, or at velocity=A:B:N."
        ),
    ] = None,
    points_csv: Annotated[
        Path | None,
        Parameter(
            help="With --plot: your points; columns amplitude_deg and speed_ratio, speed or "
            "velocity_m_s."
        ),
    ] = None,
    figure: Annotated[
        Literal["branch", "multipliers"], Parameter(help="What --plot draws.")
    ] = "branch",
    proved: Annotated[
        bool,
        Parameter(
            negative=(), help="Look as far as `onset` does for speeds that are proved empty."
        ),
    ] = False,
    vary: Vary = Vary(),
    largest: Annotated[float | None, Parameter(show=False)] = None,
    options: CaseOptions = CaseOptions(),
    output: Output = Output(),
) -> None:
    """Every limit cycle, stable or not, of a piecewise-linear spring, exactly.

    Families of cycles are followed in airspeed through folds and unstable stretches, whatever the
    order in which the spring switches; bifurcations are located and named. With --speed-ratio,
    --speed or --velocity every cycle at one airspeed is listed instead.
    """
    from aeroflutter.cli.overlays import overlays
    from aeroflutter.cli.progress import counting
    from aeroflutter.orbits.cycles import CycleOptions, cycles_at, limit_cycles
    from aeroflutter.results.proofs import free_facts

    output.check()
    loaded = options.load(case)
    scale = output.begin(loaded, "lco")

    def chosen(one: Case) -> CycleOptions:
        return CycleOptions(
            speed_ratio_range=between.ratios(one, (0.05, 1.5)),
            points=points,
            largest=largest_of(one, largest_deg, largest),
            depth=depth,
            simulations=simulations,
        )

    if vary.vary is not None:
        if airspeed.given() is not None:
            raise InputError("--vary: excludes --speed-ratio, --speed and --velocity here")
        if proved:
            raise InputError("--vary: excludes --proved; see `aeroflutter onset --vary`")
        vary.deliver(
            loaded, "lco", lambda one: limit_cycles(*one.loop(), chosen(one)), output,
            rows=lowest_rows,
        )  # fmt: skip
        return
    settings, at = chosen(loaded), airspeed.one(loaded)
    drawn = overlays(
        loaded, plot=bool(output.plot), df=df, simulate=simulate, points_csv=points_csv
    )
    family, spring = loaded.loop()
    with counting("cycles") as tick:
        if at is None:
            result, here = limit_cycles(family, spring, settings, tick), None
        else:
            here = cycles_at(family, spring, at, settings, tick)
            result = here.branch
    free = free_range(loaded, terms=proved)
    known = free_facts(free, result.flutter_speed)
    output.result(
        loaded,
        lambda: result if here is None else here,
        text=lambda: _print(loaded, result, here, scale, free),
        figure=lambda: _figure(
            loaded, result, here, figure, drawn(), scale, free if proved else None
        ),
        facts=known,
        command="lco",
    )


def _print(
    case: Case,
    result: LimitCycles,
    here: CyclesAt | None,
    scale: Scale | None,
    free: Absence | None,
) -> None:
    from aeroflutter.results import fields_of
    from aeroflutter.results.proofs import free_words

    say(case.title)
    facts: dict[str, Any] = flutter_facts(result.flutter_speed, scale)
    told = replace(result, families=())  # a record of each would cost a tenth of finding them
    fields = fields_of(told, case if scale else None)
    for name in ("onset", "stable_onset"):
        onset = fields[name]
        facts[name.replace("_", " ")] = onset and lowest(onset, digits=8, figures=5)
    facts["proved empty"] = free and free_words(free, result.flutter_speed, scale)
    show_facts(facts)
    for note in result.notes:
        say(f"note: {note}")
    if here is not None:
        _print_at(here, scale, mirrored=result.odd)
        return
    for family in result.families:
        _print_family(family, scale, mirrored=result.odd)
    if result.families:
        say("\na selection of the cycles; --json and --out give them all")


def _print_at(here: CyclesAt, scale: Scale | None, *, mirrored: bool) -> None:
    words = spoken_unit().words
    ratio = f", U*/U*_L = {here.speed_ratio:.6g}" if math.isfinite(here.speed_ratio) else ""
    si = f", {scale.velocity(here.speed):.5g} m/s" if scale else ""
    say(words(f"\nat U* = {here.speed:.6g}{ratio}{si}: {len(here.cycles) or 'no'} limit cycles"))
    if here.cycles:
        _show_cycles(here.cycles, scale)
    if mirrored and not all(cycle.symmetric for cycle in here.cycles):
        say("the mirror image of every cycle that is not symmetric is a cycle as well")


def _print_family(family: CycleFamily, scale: Scale | None, *, mirrored: bool) -> None:
    kind = "symmetric" if family.symmetric else "not symmetric" if mirrored else "general"
    say(f"\nfamily {family.number}: {kind}, from the {family.origin}")
    show_facts({"begins": family.stopped[0], "ends": family.stopped[1]})
    if family.bifurcations:
        _show_events(family, scale)
    step = max(1, (len(family.cycles) - 1) // (SHOWN - 1))
    _show_cycles(family.cycles[::step], scale)


def _show_events(family: CycleFamily, scale: Scale | None) -> None:
    rows = []
    for event in family.bifurcations:
        cycle = event.cycle
        si = [scale.velocity(cycle.speed)] if scale else []
        rows.append(
            (
                *(event.kind, *si, _digits(cycle.speed_ratio), _digits(cycle.speed)),
                *(told(cycle.amplitude), cycle.period),
                ", ".join("yes" if flag else "no" for flag in event.stable_beside),
            )
        )
    units = ("V (m/s)",) if scale else ()
    show_table(
        ("bifurcation", *units, "U*/U*_L", "U*", "amplitude (deg)", "period",
         "stable before, after"),
        rows,
    )  # fmt: skip


def _digits(value: float) -> str:
    return f"{value:.8f}" if math.isfinite(value) else "-"


def _show_cycles(cycles: Sequence[Cycle], scale: Scale | None) -> None:
    from aeroflutter.results.cycles import CYCLE
    from aeroflutter.results.schema import record

    rows = [
        record(cycle, CYCLE, scale) | {"largest multiplier": _largest(cycle)} for cycle in cycles
    ]
    for row in rows:
        bias = "bias" + spoken_unit().suffix
        row[bias] = round(row[bias], 9) + 0.0
        if scale is None and not math.isfinite(row["speed_ratio"]):
            row["speed_ratio"] = row["speed"]
    names = "speed_ratio amplitude first_harmonic bias period stable"
    show_fields(f"{names} k" if scale else names, rows, "largest multiplier")


def _largest(cycle: Cycle) -> str:
    """The largest multiplier but those that are one by nature."""
    others = cycle.multipliers[2 if cycle.continuum else 1 :]
    if not others.size:
        return "-"
    value = others[abs(others).argmax()]
    if abs(value.imag) < 1e-9 * abs(value):
        return f"{value.real:.5g}"
    return f"{value.real:.5g} ± {abs(value.imag):.5g}i"


def _figure(
    case: Case,
    result: LimitCycles,
    here: CyclesAt | None,
    kind: str,
    drawn: Sequence[Overlay],
    scale: Scale | None,
    free: Absence | None,
) -> Figure:
    from aeroflutter.plots.cycles import plot_cycles
    from aeroflutter.plots.multipliers import plot_multipliers
    from aeroflutter.plots.style import literal

    at, title = None if here is None else here.cycles, literal(case.title)
    if kind == "multipliers":
        return plot_multipliers(result, title, at, scale)
    return plot_cycles(result, title, at, drawn, scale=scale, free=free)
