"""`aeroflutter lco`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from aeroflutter.cli.common import (
    CaseName,
    CaseOptions,
    Output,
    lowest,
    numbers,
    show_facts,
    show_fields,
    show_table,
)
from aeroflutter.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from aeroflutter.case import Case
    from aeroflutter.orbits.cycles import Cycle, CycleFamily, CyclesAt, LimitCycles
    from aeroflutter.plots.cycles import Overlay

SHOWN = 12  # cycles of a family that are printed


def lco(
    case: CaseName,
    *,
    speed_ratio: Annotated[
        float | None, Parameter(help="List every cycle at this airspeed over the flutter speed.")
    ] = None,
    speed: Annotated[float | None, Parameter(help="The same at an airspeed U*.")] = None,
    speed_ratio_range: Annotated[
        str, Parameter(help="Lowest and highest speed ratio, as low,high.")
    ] = "0.05,1.5",
    points: Annotated[int, Parameter(help="Cycles on every family.")] = 200,
    largest: Annotated[
        float, Parameter(help="Largest amplitude, in units of the spring's own size.")
    ] = 50.0,
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
        Parameter(help="With --plot: simulated end states at speed ratios A:B:N, up and down."),
    ] = None,
    points_csv: Annotated[
        Path | None,
        Parameter(help="With --plot: your points; columns amplitude_deg and speed_ratio or speed."),
    ] = None,
    figure: Annotated[
        Literal["branch", "multipliers"], Parameter(help="What --plot draws.")
    ] = "branch",
    options: CaseOptions = CaseOptions(),
    output: Output = Output(),
) -> None:
    """Every limit cycle, stable or not, of a piecewise-linear spring, exactly.

    Families of cycles are followed in airspeed through folds and unstable stretches, whatever the
    order in which the spring switches; bifurcations are located and named. With --speed-ratio or
    --speed every cycle at one airspeed is listed instead.
    """
    from aeroflutter.cli.overlays import overlays
    from aeroflutter.cli.progress import counting
    from aeroflutter.orbits.cycles import CycleOptions, cycles_at, limit_cycles

    output.check()
    loaded = options.load(case)
    settings = CycleOptions(
        speed_ratio_range=_pair(speed_ratio_range),
        points=points,
        largest=largest,
        depth=depth,
        simulations=simulations,
    )
    at = _speed(loaded, speed, speed_ratio)
    drawn = overlays(
        loaded, plot=bool(output.plot), df=df, simulate=simulate, points_csv=points_csv
    )
    family, spring = loaded.family(), loaded.spring
    with counting("cycles") as tick:
        if at is None:
            result, here = limit_cycles(family, spring, settings, tick), None
        else:
            here = cycles_at(family, spring, at, settings, tick)
            result = here.branch
    output.result(
        loaded,
        lambda: result if here is None else here,
        text=lambda: _print(loaded, result, here),
        figure=lambda: _figure(loaded, result, here, figure, drawn()),
    )


def _pair(text: str) -> tuple[float, float]:
    values = numbers("--speed-ratio-range", text)
    if values.size != 2:
        raise InputError(f'--speed-ratio-range: "{text}" must be low,high')
    return float(values[0]), float(values[1])


def _speed(case: Case, speed: float | None, ratio: float | None) -> float | None:
    """The one speed U* asked for, None for the whole branch."""
    from aeroflutter.linear.rootlocus import flutter_speed

    if speed is not None and ratio is not None:
        raise InputError("--speed, --speed-ratio: give one of the two, not both")
    name, value = ("--speed", speed) if ratio is None else ("--speed-ratio", ratio)
    if value is None:
        return None
    if not (math.isfinite(value) and value > 0.0):
        raise InputError(f"{name}: must be a positive number, not {value}")
    if ratio is None:
        return value
    reference = flutter_speed(case.family())
    if reference is None:
        raise InputError(
            "--speed-ratio: the section has no linear flutter speed to refer to; give --speed"
        )
    return ratio * reference


def _print(case: Case, result: LimitCycles, here: CyclesAt | None) -> None:
    from aeroflutter.results import fields_of

    print(case.title)
    facts: dict[str, Any] = {"linear flutter speed U*": result.flutter_speed}
    fields = fields_of(result)
    for name in ("onset", "stable_onset"):
        onset = fields[name]
        facts[name.replace("_", " ")] = onset and lowest(onset, digits=8, figures=5)
    show_facts(facts)
    for note in result.notes:
        print(f"note: {note}")
    if here is not None:
        _print_at(here, mirrored=result.odd)
        return
    for family in result.families:
        _print_family(family, mirrored=result.odd)
    if result.families:
        print("\na selection of the cycles; --json and --out give them all")


def _print_at(here: CyclesAt, *, mirrored: bool) -> None:
    ratio = f", U*/U*_L = {here.speed_ratio:.6g}" if math.isfinite(here.speed_ratio) else ""
    print(f"\nat U* = {here.speed:.6g}{ratio}: {len(here.cycles) or 'no'} limit cycles")
    if here.cycles:
        _show_cycles(here.cycles)
    if mirrored and not all(cycle.symmetric for cycle in here.cycles):
        print("the mirror image of every cycle that is not symmetric is a cycle as well")


def _print_family(family: CycleFamily, *, mirrored: bool) -> None:
    kind = "symmetric" if family.symmetric else "not symmetric" if mirrored else "general"
    print(f"\nfamily {family.number}: {kind}, from the {family.origin}")
    show_facts({"begins": family.stopped[0], "ends": family.stopped[1]})
    if family.bifurcations:
        show_table(
            ("bifurcation", "U*/U*_L", "U*", "amplitude (deg)", "period", "stable before, after"),
            [
                (
                    event.kind,
                    _digits(event.cycle.speed_ratio),
                    _digits(event.cycle.speed),
                    math.degrees(event.cycle.amplitude),
                    event.cycle.period,
                    ", ".join("yes" if flag else "no" for flag in event.stable_beside),
                )
                for event in family.bifurcations
            ],
        )
    step = max(1, (len(family.cycles) - 1) // (SHOWN - 1))
    _show_cycles(family.cycles[::step])


def _digits(value: float) -> str:
    return f"{value:.8f}" if math.isfinite(value) else "-"


def _show_cycles(cycles: Sequence[Cycle]) -> None:
    from aeroflutter.results.cycles import CYCLE
    from aeroflutter.results.schema import record

    rows = [record(cycle, CYCLE) | {"largest multiplier": _largest(cycle)} for cycle in cycles]
    for row in rows:
        row["bias_deg"] = round(row["bias_deg"], 9) + 0.0
        if not math.isfinite(row["speed_ratio"]):
            row["speed_ratio"] = row["speed"]
    names = "speed_ratio amplitude first_harmonic bias period stable"
    show_fields(names, rows, "largest multiplier")


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
) -> Figure:
    from aeroflutter.plots.cycles import plot_cycles, plot_multipliers

    at = None if here is None else here.cycles
    if kind == "multipliers":
        return plot_multipliers(result, case.title, at)
    return plot_cycles(result, case.title, at, drawn)
