"""`aeroflutter simulate`."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from aeroflutter.cli.common import (
    CaseName,
    CaseOptions,
    Output,
    initial_motion,
    numbers,
    show_facts,
    show_table,
)
from aeroflutter.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable

    import xarray as xr
    from matplotlib.figure import Figure

    from aeroflutter.case import Case
    from aeroflutter.motion.response import Initial, Response, SimulateOptions
    from aeroflutter.motion.sweeps import Sweep

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
        shown = run.continued(settings, duration)
    output.deliver(
        run.payload(),
        text=run.show,
        dataset=lambda: _dataset(shown.response, loaded, shown.speeds()),
        figure=lambda: _figure(shown, figure),
    )


@dataclass(frozen=True)
class _Run:
    """One response with what it belongs to."""

    case: Case
    start: Initial
    response: Response
    speed: float
    flutter: float | None

    def speeds(self) -> dict[str, float]:
        """Speed and, where there is a linear flutter speed, its ratio to it."""
        found = {"speed": self.speed}
        if self.flutter is not None:
            found |= {"speed_ratio": self.speed / self.flutter, "flutter_speed": self.flutter}
        if self.case.section.scale is not None:
            found["velocity_m_s"] = self.case.section.scale.velocity(self.speed)
        return found

    def payload(self) -> dict[str, Any]:
        """What --json prints."""
        found = self.response
        k = 2.0 * math.pi / found.period
        payload: dict[str, Any] = {
            "title": self.case.title,
            **self.speeds(),
            "alpha_deg": math.degrees(self.start.alpha),
            "engine": found.engine,
            "state": found.state,
            "reason": found.reason,
            "amplitude_deg": math.degrees(found.amplitude),
            "bias_deg": math.degrees(found.bias),
            "first_harmonic_deg": math.degrees(found.first_harmonic),
            "period": found.period,
            "k": k,
            "rest_deg": math.degrees(found.rest),
            "duration": found.duration,
        }
        if self.case.section.scale is not None:
            payload["frequency_hz"] = self.case.section.scale.frequency_hz(k, self.speed)
        return payload

    def show(self) -> None:
        """Print the result for people."""
        found = self.payload()
        print(found.pop("title"))
        names = {"speed": "speed U*", "speed_ratio": "U*/U*_L", "flutter_speed": "U*_L"}
        show_facts({names.get(key, key): value for key, value in found.items()})

    def continued(self, settings: SimulateOptions, duration: float | None) -> _Run:
        """The same run, marched on past its decision so that there is something to see."""
        length = settings.limit
        if duration is None and settings.criteria != "thesis":
            steady = 40.0 * self.response.period if self.response.state == "lco" else 0.0
            length = min(length, max(2.0 * self.response.duration, steady, 5000.0 * settings.dt))
        part = replace(settings, duration=length, decide=False)
        return _single(self.case, self.start, part, self.speed, self.flutter)


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

    return flutter_speed(case.family())


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
) -> _Run:
    from aeroflutter.motion.response import simulate as march

    with late_bar("simulating") as tick:
        system = case.family().at(speed)
        response = march(system, case.spring, start, replace(settings, progress=tick))
    return _Run(case, start, response, speed, flutter)


def _dataset(result: Response | Sweep, case: Case, extra: dict[str, float]) -> xr.Dataset:
    from aeroflutter.results.timemarch import to_dataset

    return to_dataset(result, case=case).assign_attrs(extra)


def _figure(run: _Run, kind: str) -> Figure:
    from aeroflutter.plots.timemarch import plot_response

    speeds = run.speeds()
    at = f"$U^*$ = {run.speed:.4g}"
    if "speed_ratio" in speeds:
        at = f"$U^*/U^*_L$ = {speeds['speed_ratio']:.4g}"
    title = f"{run.case.title}, {at}: {run.response.state}"
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

    reference = _needed(flutter)
    with late_bar("sweeping") as tick:
        passes = there_and_back(
            case.family(),
            case.spring,
            ratios * reference,
            start,
            replace(settings, progress=tick),
            math.radians(kick_deg),
        )
    output.deliver(
        {
            "title": case.title,
            "flutter_speed": reference,
            "alpha_deg": math.degrees(start.alpha),
            "sweeps": [_sweep_payload(one, reference) for one in passes],
        },
        text=lambda: _show_sweeps(case, passes, reference),
        dataset=lambda: _sweep_dataset(passes, case, reference),
        figure=lambda: plot_sweeps(passes, reference, case.title),
    )


def _sweep_payload(one: Sweep, reference: float) -> dict[str, Any]:
    import numpy as np

    return {
        "direction": "up" if one.upward else "down",
        "speed_ratio": one.speeds / reference,
        "speed": one.speeds,
        "state": one.state,
        "amplitude_deg": np.degrees(one.amplitude),
        "bias_deg": np.degrees(one.bias),
        "first_harmonic_deg": np.degrees(one.first_harmonic),
        "period": one.period,
        "rest_deg": np.degrees(one.rest),
        "jumps": [
            {
                "speed_ratio": [jump.before / reference, jump.after / reference],
                "amplitude_deg": [
                    math.degrees(jump.amplitude_before),
                    math.degrees(jump.amplitude_after),
                ],
            }
            for jump in one.jumps
        ],
    }


def _show_sweeps(case: Case, passes: tuple[Sweep, ...], reference: float) -> None:
    print(case.title)
    for one in passes:
        found = _sweep_payload(one, reference)
        columns = ("speed_ratio", "state", "amplitude_deg", "bias_deg", "period")
        print(f"\nspeed {'rising' if one.upward else 'falling'}")
        rows = zip(*(list(found[name]) for name in columns), strict=True)
        show_table(("U*/U*_L", "state", "amplitude (deg)", "bias (deg)", "period"), list(rows))
        for jump in found["jumps"]:
            speeds, sizes = jump["speed_ratio"], jump["amplitude_deg"]
            print(
                f"jump between {speeds[0]:.5g} and {speeds[1]:.5g}: "
                f"{sizes[0]:.4g} to {sizes[1]:.4g} deg"
            )


def _sweep_dataset(passes: tuple[Sweep, ...], case: Case, reference: float) -> xr.Dataset:
    """Both passes in one Dataset, told apart by a suffix: NetCDF has no list of Datasets."""
    import xarray as xr

    parts = []
    for one in passes:
        suffix = "up" if one.upward else "down"
        part = _dataset(one, case, {"flutter_speed": reference})
        names = {str(name): f"{name}_{suffix}" for name in (*part.variables, *part.sizes)}
        parts.append(part.rename({name: names[name] for name in names if name in names}))
    return xr.merge(parts, combine_attrs="drop_conflicts")


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
