"""`aeroflutter map`."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from aeroflutter.cli.airspeed import several_speeds, unit
from aeroflutter.cli.common import (
    CaseName,
    CaseOptions,
    Json,
    Output,
    Plot,
    PlotWidth,
    Units,
    numbers,
    say,
    show_facts,
    shown_scale,
    spoken,
)
from aeroflutter.cli.keeping import Keeping, compute
from aeroflutter.errors import InputError
from aeroflutter.results.unit import start_unit, told

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from aeroflutter.case import Case
    from aeroflutter.model.section import Scale
    from aeroflutter.studies.cases import CaseCells
    from aeroflutter.studies.maps import Axis, Executor, FlutterMap, Grid

SMALL = 20_000  # cells up to which threads of this process are as fast as processes
SPEED_RATIO, ALPHA_DEG = "0.1:1:91", "1:15:29"  # the former where there is no onset
COLUMNS = 91
TOLERANCE = 1e-6

Range = Annotated[str | None, Parameter(allow_leading_hyphen=True)]


def map(  # noqa: A001 - the command's name
    case: CaseName,
    *,
    speed_ratio: Annotated[
        Range,
        Parameter(
            help="Speed ratios U*/U*_L, A:B:N or a,b,c; by default from below the describing "
            f"function's onset to above flutter, or {SPEED_RATIO} where it has none."
        ),
    ] = None,
    speed: Annotated[Range, Parameter(help="Airspeeds U* instead, A:B:N or a,b,c.")] = None,
    velocity: Annotated[
        Range,
        Parameter(help="Airspeeds V in m/s instead, where the case has SI data, A:B:N or a,b,c."),
    ] = None,
    alpha_deg: Annotated[
        Range, Parameter(help=f"Initial pitch in degrees, A:B:N or a,b,c; default {ALPHA_DEG}.")
    ] = None,
    x: Annotated[
        Range,
        Parameter(help="Any key of the case along x instead: section.zeta_alpha=0:0.05:50."),
    ] = None,
    y: Annotated[
        Range, Parameter(help="Any key of the case along y instead: spring.delta_h_deg=0.1:1:10.")
    ] = None,
    engine: Annotated[
        Literal["exact", "houbolt"],
        Parameter(help="exact has no time-step error (cubic springs run on Taylor series)."),
    ] = "exact",
    dt: Annotated[float, Parameter(help="Houbolt's step in tau.")] = 0.1,
    duration: Annotated[
        float | None, Parameter(help="Longest time in tau that a cell may take to be decided.")
    ] = None,
    thesis: Annotated[
        bool,
        Parameter(
            negative=(),
            show_default=False,
            help="The thesis's settings: Houbolt, 50 000 steps of 0.1, its end states.",
        ),
    ] = False,
    refine: Annotated[
        bool,
        Parameter(
            negative=(),
            show_default=False,
            help="Refine the boundaries between the regions by bisection.",
        ),
    ] = False,
    tolerance: Annotated[
        float, Parameter(help="Width to which --refine goes, in units of either axis.")
    ] = TOLERANCE,
    plot: Plot = None,
    plot_width: PlotWidth = None,
    json: Json = False,
    units: Units = None,
    options: CaseOptions = CaseOptions(),
    keeping: Keeping = Keeping(),
) -> None:
    """Flutter map: how the motion ends for every airspeed and initial pitch.

    Cells are damped, lco, aperiodic, divergent, neutral or undecided. With --out the map is written
    block by block; an interrupted run goes on with the same command and --resume.
    """
    from aeroflutter.results import fields_of, to_dataset
    from aeroflutter.studies.cases import CaseCells

    keeping.check()
    output = Output(json=json, out=keeping.netcdf, plot=plot, plot_width=plot_width)
    output.check()
    loaded = options.load(case)
    several_speeds(
        loaded,
        "there is no map over it: `map` starts motions by the pitch of a section, or by the first "
        "spring of a model, at several; `simulate` takes one",
    )
    scale = shown_scale(units, loaded)
    grid, fixed = axes(
        speed_ratio, speed, alpha_deg, x, y, velocity,
        usual=lambda: around_onset(loaded), sizes=sizes(loaded),
    )  # fmt: skip
    cells = CaseCells(loaded.text, loaded.source, grid, fixed)
    settings = _settings(engine, dt, duration, thesis, tolerance if refine else None)
    executor = keeping.executor(threads=grid.cells <= SMALL)
    begin = time.monotonic()
    found = _run(loaded, cells, settings, executor, keeping)
    wall = time.monotonic() - begin
    output.deliver(
        {
            "title": loaded.title,
            "engine": settings.march.engine,
            **fields_of(found, loaded),
            **_velocities(loaded, found),
            "wall_seconds": wall,
            "store": keeping.store and str(keeping.store),
        },
        text=lambda: _print(loaded, found, wall, keeping.store),
        dataset=lambda: _in_metres(to_dataset(found, case=loaded), loaded, found),
        figure=lambda: spoken(_figure(loaded, cells, found, scale), loaded),
        command="map",
    )


def _unit(case: Case, found: FlutterMap) -> float | None:
    """m/s of one unit of the map's axis of speeds, None where it has none or the case no scale."""
    kinds = {axis.key for axis in (found.grid.x, found.grid.y)}
    scale = case.scale
    if scale is None or not kinds & {"speed", "speed_ratio"} or _rescaled(kinds):
        return None
    option = "--speed-ratio" if "speed_ratio" in kinds else "--speed"
    return scale.velocity(unit(option, case))


def _rescaled(keys: set[str]) -> bool:
    """Whether another axis changes what U* is worth in m/s, or the flutter speed itself."""
    return any(key.split(".")[0] in ("section", "flap", "aerodynamics") for key in keys)


def _velocities(case: Case, found: FlutterMap) -> dict[str, Any]:
    """The speeds of the map in m/s, where they are not already."""
    metres = _unit(case, found)
    if metres is None:
        return {}
    [axis] = [one for one in (found.grid.x, found.grid.y) if one.key in ("speed", "speed_ratio")]
    return {"velocities_m_s": metres * axis.values}


def _in_metres(dataset: xr.Dataset, case: Case, found: FlutterMap) -> xr.Dataset:
    """The Dataset with the speeds in m/s beside them."""
    for values in _velocities(case, found).values():
        axis = "speed" if "speed" in dataset.dims else "speed_ratio"
        about = {"units": "m s-1", "long_name": "airspeed V"}
        return dataset.assign_coords(velocity_m_s=(axis, values, about))
    return dataset


def axes(
    speed_ratio: str | None,
    speed: str | None,
    alpha_deg: str | None,
    x: str | None,
    y: str | None,
    velocity: str | None = None,
    usual: Callable[[], NDArray[np.float64]] | None = None,
    sizes: str = ALPHA_DEG,
) -> tuple[Grid, tuple[str, float] | None]:
    """The grid that the options ask for, and the airspeed where it does not vary.

    `usual` gives the speed ratios where nothing says any, `sizes` says where motions start then.

    Raises
    ------
    InputError
        If they ask for more or fewer than two axes.
    """
    from aeroflutter.studies.maps import Axis, Grid

    airspeeds = {"speed_ratio": speed_ratio, "speed": speed, "velocity": velocity}
    chosen_speeds = {key: text for key, text in airspeeds.items() if text is not None}
    if len(chosen_speeds) > 1:
        first, *others = (f"--{key.replace('_', '-')}" for key in chosen_speeds)
        raise InputError(f"{', '.join(others)}: excludes {first}; give one of the two")
    given = [_keyed(option, text) for option, text in (("--x", x), ("--y", y)) if text is not None]
    keys = [axis.key for axis in given]
    flow = None
    for key, text in chosen_speeds.items():
        flow = Axis(key, numbers(f"--{key.replace('_', '-')}", text))
    pitch = (
        None if alpha_deg is None else Axis("initial.alpha_deg", numbers("--alpha-deg", alpha_deg))
    )
    varies = set(airspeeds) & set(keys)
    if flow is None and not varies and len(given) < 2:
        flow = Axis("speed_ratio", usual() if usual else numbers("--speed-ratio", SPEED_RATIO))
    fixed = None
    if flow is not None and len(flow) == 1 and given:
        fixed, flow = (flow.key, float(flow.values[0])), None
    if pitch is None and len(given) + (flow is not None) < 2:
        pitch = Axis("initial.alpha_deg", numbers("--alpha-deg", sizes))
    chosen = ([flow] if flow else []) + given + ([pitch] if pitch else [])
    if y is not None and x is None and len(chosen) == 2 and chosen[0] is given[0]:
        chosen.reverse()
    if len(chosen) != 2:
        listed = ", ".join(axis.key for axis in chosen)
        which = "two axes" if len(chosen) > 2 else "two axes and has only one"
        raise InputError(
            f"axes: a map takes {which}: {listed}; give --x or --y for any other key, and one "
            "airspeed to hold it fixed"
        )
    if varies and fixed is not None:
        raise InputError(f"{varies.pop()}: stands on an axis; drop the fixed airspeed")
    return Grid(*chosen), fixed


def sizes(case: Case) -> str:
    """Where motions start if nothing is said: of what is no angle, by the size of the spring."""
    if start_unit().suffix:
        return ALPHA_DEG
    size = told(case.spring.scale)
    return f"{size:.3g}:{15.0 * size:.3g}:29"


def around_onset(case: Case) -> NDArray[np.float64]:
    """Speed ratios around the describing function's onset; all of them where it has none."""
    from aeroflutter.errors import ConvergenceError
    from aeroflutter.orbits.describing import describing_curve
    from aeroflutter.studies.maps.grid import ratios_around

    with contextlib.suppress(InputError, ConvergenceError):
        onset = describing_curve(*case.loop()).onset
        if onset is not None and math.isfinite(onset.speed_ratio):
            return ratios_around(onset.speed_ratio, COLUMNS)
    return numbers("--speed-ratio", SPEED_RATIO)


def _keyed(option: str, text: str) -> Axis:
    from aeroflutter.studies.maps import Axis

    key, equals, values = text.partition("=")
    if not (equals and key.strip() and values.strip()):
        raise InputError(
            f'{option}: "{text}" must be KEY=A:B:N, as in section.zeta_alpha=0:0.05:50'
        )
    return Axis(key.strip(), numbers(option, values.strip()))


def _settings(
    engine: str, dt: float, duration: float | None, thesis: bool, refine: float | None
) -> Any:
    from aeroflutter.motion.response import SimulateOptions
    from aeroflutter.studies.maps import MapOptions

    if thesis:
        march = SimulateOptions.thesis(record=False)
    else:
        longest = 20_000.0 if engine == "houbolt" else 1e7
        march = SimulateOptions(
            engine=engine, dt=dt, duration=longest if duration is None else duration, record=False
        )
    return MapOptions(march=march, refine=refine)


def _run(
    case: Case, cells: CaseCells, settings: Any, executor: Executor, keeping: Keeping
) -> FlutterMap:
    from aeroflutter.studies.maps import MapStudy, collect

    study = MapStudy(cells, settings)
    with keeping.opened(study, case) as results:
        compute(study, results, executor, "cells")
        return collect(study, results)


def _print(case: Case, found: FlutterMap, wall: float, store: Path | None) -> None:
    from aeroflutter.verdicts import STATES

    say(case.title)
    cells = found.grid.cells
    counts = {state: found.count(state) for state in (*STATES, "failed")}
    facts: dict[str, Any] = {"cells": f"{cells} ({len(found.grid.x)} x {len(found.grid.y)})"}
    facts |= {
        state: f"{count} ({100 * count / cells:.1f} %)"
        for state, count in counts.items()
        if count or state in ("damped", "lco", "undecided")
    }
    facts["CPU time"] = (
        f"{found.cpu_seconds:.3g} s ({1e6 * found.cpu_seconds / cells:.0f} us a cell)"
    )
    facts["wall time"] = f"{wall:.3g} s"
    if store is not None:
        facts["store"] = str(store)
    show_facts(facts)
    for failure in found.failures:
        say(f"failed: {failure['block']}: {failure['reason']}")


def _figure(case: Case, cells: CaseCells, found: FlutterMap, scale: Scale | None) -> Figure:
    from aeroflutter.plots.maps import plot_map
    from aeroflutter.plots.style import literal

    metres = None if scale is None else _unit(case, found)
    return plot_map(found, literal(case.title), _marks(case, cells, found), metres)


def _marks(case: Case, cells: CaseCells, found: FlutterMap) -> dict[str, float]:
    """Speeds that mean something, in units of the x axis: flutter and onset of limit cycles."""
    from aeroflutter.errors import ConvergenceError
    from aeroflutter.linear.rootlocus import flutter_speed

    key = found.grid.x.key
    if cells.shared != 0 or key not in ("speed", "speed_ratio", "velocity"):
        return {}
    flutter = flutter_speed(case.loop()[0])
    if flutter is None:
        return {}
    one = unit(f"--{key.replace('_', '-')}", case)
    marks = {"linear flutter": flutter / one}
    for name, onset in (("DF onset", _df_onset), ("exact onset", _exact_onset)):
        with contextlib.suppress(InputError, ConvergenceError):
            speed = onset(case)
            if speed is not None:
                marks[name] = speed / one
    return marks


def _df_onset(case: Case) -> float | None:
    from aeroflutter.orbits.describing import describing_curve

    onset = describing_curve(case.family(), case.spring).onset
    return None if onset is None else onset.speed


def _exact_onset(case: Case) -> float | None:
    """Onset of exact limit cycles; the families that branch off later are not looked for."""
    from aeroflutter.orbits.cycles import CycleOptions, limit_cycles

    onset = limit_cycles(case.family(), case.spring, CycleOptions(depth=0, points=2)).onset
    return None if onset is None else onset.cycle.speed
