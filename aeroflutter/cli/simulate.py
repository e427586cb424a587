"""`aeroflutter simulate`."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from aeroflutter.cli.common import (
    CaseName,
    CaseOptions,
    Output,
    initial_motion,
    numbers,
    show_facts,
    show_fields,
    show_swings,
)
from aeroflutter.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure

    from aeroflutter.case import Case
    from aeroflutter.motion.response import Initial, SimulateOptions
    from aeroflutter.results.motions import Run

PATIENCE = 2.0  # seconds before a progress bar appears


def simulate(
    case: CaseName,
    *,
    speed_ratio: Annotated[
        float | None, Parameter(help="Airspeed over the linear flutter speed.")
    ] = None,
    speed: Annotated[float | None, Parameter(help="Airspeed U* = V/(b omega_alpha).")] = None,
    alpha_deg: Annotated[
        float | None, Parameter(help="Initial pitch in degrees; the case's own by default.")
    ] = None,
    engine: Annotated[
        Literal["auto", "exact", "houbolt"],
        Parameter(
            help="auto is exact: matrix exponentials from switch to switch, or Taylor series for "
            "cubic springs."
        ),
    ] = "auto",
    dt: Annotated[
        float, Parameter(help="Houbolt's step in tau; with exact, the spacing of the samples.")
    ] = 0.1,
    duration: Annotated[
        float | None,
        Parameter(
            help="Longest time in tau; a run ends once its end is certain. By default 20000, and "
            "as long as it takes with exact on piecewise-linear springs."
        ),
    ] = None,
    thesis: Annotated[
        bool,
        Parameter(
            negative=(),
            show_default=False,
            help="The thesis's settings: Houbolt, 50 000 steps of 0.1, end states at 0.001 and "
            "100 degrees.",
        ),
    ] = False,
    sweep: Annotated[
        str | None,
        Parameter(
            help="Speed ratios A:B:N visited up and then down again, each run starting where the "
            "last one ended."
        ),
    ] = None,
    kick_deg: Annotated[
        float, Parameter(help="With --sweep: pitch rate, in degrees per tau, added at each speed.")
    ] = 0.0,
    figure: Annotated[
        Literal["overview", "traces", "spring", "phase", "psd", "poincare"],
        Parameter(help="What --plot draws of a single run."),
    ] = "overview",
    options: CaseOptions = CaseOptions(),
    output: Output = Output(),
) -> None:
    """March the section in time and say how its motion ends: damped, LCO, aperiodic, divergent.

    Give --speed-ratio or --speed, or --sweep. With --plot or --out the march goes on beyond the
    decision, to --duration or to twice the time that the decision took.
    """
    from aeroflutter.results import fields_of, to_dataset

    output.check()
    loaded = options.load(case)
    settings = _settings(engine, dt, duration, thesis)
    start = initial_motion(loaded, alpha_deg)
    flutter = _flutter_speed(loaded)
    if sweep is not None:
        if speed is not None or speed_ratio is not None:
            raise InputError("--sweep: excludes --speed and --speed-ratio; give one of the three")
        ratios = numbers("--sweep", sweep)
        _sweeps(loaded, start, settings, ratios, flutter, kick_deg, output)
        return
    if kick_deg != 0.0:
        raise InputError(
            "--kick-deg: only with --sweep; for one run --set initial.alpha_rate_deg=3"
        )
    run = _single(loaded, start, settings, _speed(speed, speed_ratio, flutter), flutter)
    shown = run
    if output.plot or output.out:
        shown = _continued(loaded, run, settings, duration)
    output.deliver(
        {"title": loaded.title, **fields_of(run, loaded)},
        text=lambda: _shown(loaded, run),
        dataset=lambda: to_dataset(shown, case=loaded),
        figure=lambda: _figure(loaded, shown, figure),
    )


def _shown(case: Case, run: Run) -> None:
    """Print a run for people."""
    from aeroflutter.results import fields_of

    names = {"speed": "speed U*", "speed_ratio": "U*/U*_L", "flutter_speed": "U*_L"}
    print(case.title)
    fields = fields_of(run, case)
    moving, springs = fields.pop("coordinates"), fields.pop("springs")
    show_facts({names.get(key, key): value for key, value in fields.items()})
    if len(springs) > 1:
        show_swings(moving)


def _continued(case: Case, run: Run, settings: SimulateOptions, duration: float | None) -> Run:
    """The same run, marched on past its decision so that there is something to see."""
    length, found = settings.limit, run.response
    if duration is None and settings.criteria != "thesis":
        steady = 40.0 * found.period if found.state == "lco" else 0.0
        length = min(length, max(2.0 * found.duration, steady, 5000.0 * settings.dt))
    part = replace(settings, duration=length, decide=False)
    return _single(case, run.start, part, run.speed, run.flutter_speed)


def _settings(engine: str, dt: float, duration: float | None, thesis: bool) -> SimulateOptions:
    from aeroflutter.motion.response import SimulateOptions

    if thesis:
        if engine == "exact":
            raise InputError("--thesis: marches by Houbolt's scheme; drop it or --engine exact")
        return SimulateOptions.thesis(dt=dt, duration=5000.0 if duration is None else duration)
    given: dict[str, Any] = {} if duration is None else {"duration": duration}
    return SimulateOptions(engine=engine, dt=dt, **given)


def _flutter_speed(case: Case) -> float | None:
    from aeroflutter.linear.rootlocus import flutter_speed

    return flutter_speed(case.loop()[0])


def _speed(speed: float | None, ratio: float | None, flutter: float | None) -> float:
    if (speed is None) == (ratio is None):
        raise InputError("--speed-ratio or --speed: give exactly one of the two")
    name, value = ("--speed", speed) if ratio is None else ("--speed-ratio", ratio)
    if value is None or not (math.isfinite(value) and value > 0.0):
        raise InputError(f"{name}: must be a positive number, not {value}")
    if name == "--speed":
        return value
    return value * _needed(flutter)


def _needed(flutter: float | None) -> float:
    """The flutter speed that ratios refer to."""
    if flutter is None:
        raise InputError(
            "--speed-ratio: the section has no linear flutter speed to refer to; give --speed"
        )
    return flutter


def _single(
    case: Case, start: Initial, settings: SimulateOptions, speed: float, flutter: float | None
) -> Run:
    from aeroflutter.motion.response import simulate as march
    from aeroflutter.results.motions import Run

    with late_bar("simulating") as tick:
        family, spring = case.loop()
        response = march(family.at(speed), spring, start, replace(settings, progress=tick))
    return Run(speed=speed, flutter_speed=flutter, start=start, response=response)


def _figure(case: Case, run: Run, kind: str) -> Figure:
    from aeroflutter.plots.timemarch import plot_response

    ratio = run.speed_ratio
    at = f"$U^*$ = {run.speed:.4g}" if ratio is None else f"$U^*/U^*_L$ = {ratio:.4g}"
    title = f"{case.title}, {at}: {run.response.state}"
    return plot_response(run.response, kind, title)


def _sweeps(
    case: Case,
    start: Initial,
    settings: SimulateOptions,
    ratios: Any,
    flutter: float | None,
    kick_deg: float,
    output: Output,
) -> None:
    """Up and down again; the way down starts where the way up ended, or from `start` if it left."""
    from aeroflutter.motion.sweeps import there_and_back
    from aeroflutter.plots.timemarch import plot_sweeps
    from aeroflutter.results import fields_of, to_dataset
    from aeroflutter.results.dataset import side_by_side
    from aeroflutter.results.motions import Pass

    reference = _needed(flutter)
    with late_bar("sweeping") as tick:
        passes = there_and_back(
            *case.loop(),
            ratios * reference,
            start,
            replace(settings, progress=tick),
            math.radians(kick_deg),
        )
    made = [Pass(one, reference) for one in passes]
    found = [fields_of(one, case) for one in made]
    output.deliver(
        {
            "title": case.title,
            "flutter_speed": reference,
            "alpha_deg": math.degrees(start.alpha),
            "sweeps": found,
        },
        text=lambda: _show_sweeps(case, found),
        dataset=lambda: side_by_side(
            {one["direction"]: to_dataset(p, case=case) for one, p in zip(found, made, strict=True)}
        ).assign_attrs(flutter_speed=reference),
        figure=lambda: plot_sweeps(passes, reference, case.title),
    )


def _show_sweeps(case: Case, passes: list[dict[str, Any]]) -> None:
    print(case.title)
    for found in passes:
        print(f"\nspeed {'rising' if found['direction'] == 'up' else 'falling'}")
        columns = {key: one for key, one in found.items() if key not in ("direction", "jumps")}
        rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
        show_fields("speed_ratio state amplitude bias period", rows)
        for jump in found["jumps"]:
            speeds, sizes = jump["speed_ratio"], jump["amplitude_deg"]
            print(
                f"jump between {speeds[0]:.5g} and {speeds[1]:.5g}: "
                f"{sizes[0]:.4g} to {sizes[1]:.4g} deg"
            )


@contextmanager
def late_bar(label: str) -> Iterator[Callable[[float], None]]:
    """A progress bar on a terminal that appears when the work takes longer than `PATIENCE`.

    It appears by the clock: the first use of an engine compiles it, which tells nothing of its
    progress.

    Yields
    ------
    callable
        To be called now and then with the fraction done.
    """
    from threading import Timer

    bars: list[Any] = []

    def show() -> None:
        bar = _bar()
        bar.add_task(label, total=1.0)
        bar.start()
        bars.append(bar)

    def tick(fraction: float) -> None:
        for bar in bars:
            bar.update(bar.task_ids[0], completed=fraction)

    timer = Timer(PATIENCE, show)
    timer.daemon = True
    if sys.stderr.isatty():
        timer.start()
    try:
        yield tick
    finally:
        timer.cancel()
        if timer.is_alive():
            timer.join()  # it may be about to show the bar
        for bar in bars:
            bar.stop()


def _bar() -> Any:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeRemainingColumn(),
        console=Console(stderr=True),
        transient=True,
    )
