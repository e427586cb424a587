"""`aeroflutter simulate`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from aeroflutter.cli.airspeed import EXACTLY_ONE, Airspeed, axis_of_speeds, unit
from aeroflutter.cli.common import (
    CaseName,
    CaseOptions,
    Output,
    initial_motion,
    say,
    show_facts,
    show_fields,
    show_swings,
    spoken,
)
from aeroflutter.cli.progress import late_bar
from aeroflutter.errors import InputError
from aeroflutter.results.unit import native, spoken_unit, start_unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from aeroflutter.case import Case
    from aeroflutter.model.section import Scale
    from aeroflutter.motion.response import Initial, SimulateOptions
    from aeroflutter.motion.sweeps import Sweep
    from aeroflutter.results.motions import Run


def simulate(
    case: CaseName,
    *,
    airspeed: Airspeed = Airspeed(),
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
        float | None,
        Parameter(
            help="Houbolt's step in tau; with exact, the spacing of the samples. By default 0.1; "
            "of a model from a file what shows its fastest oscillation."
        ),
    ] = None,
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
            help="Speed ratios A:B:N, or velocity=A:B:N in m/s, visited up and then down again, "
            "each run starting where the last one ended; the way down starts once more from the "
            "initial motion where the way up ended at rest or diverged, and says so."
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

    Give --speed-ratio, --speed or --velocity, or --sweep. With --plot or --out the march goes on
    beyond the decision, to --duration or to twice the time that the decision took.
    """
    from aeroflutter.linear.rootlocus import flutter_speed
    from aeroflutter.motion.settling import sample_spacing
    from aeroflutter.results import fields_of, to_dataset

    output.check()
    loaded = options.load(case)
    scale = output.begin(loaded, "simulate")
    settings = _settings(engine, 0.1 if dt is None else dt, duration, thesis)
    start = initial_motion(loaded, alpha_deg)
    if sweep is not None:
        if airspeed.given() is not None:
            raise InputError(
                "--sweep: excludes --speed, --speed-ratio and --velocity; give one of them"
            )
        _sweeps(loaded, start, settings, axis_of_speeds("--sweep", sweep, loaded), kick_deg, output)
        return
    if kick_deg != 0.0:
        raise InputError(
            "--kick-deg: only with --sweep; for one run --set initial.alpha_rate_deg=3"
        )
    speed = airspeed.one(loaded, EXACTLY_ONE)
    assert speed is not None  # or it is refused
    if dt is None and loaded.imported is not None:
        settings = replace(settings, dt=sample_spacing(loaded.loop()[0].at(speed)))
    run = _single(loaded, start, settings, speed, flutter_speed(loaded.loop()[0]))
    shown = run
    if output.plot or output.out:
        shown = _continued(loaded, run, settings, duration)
    lasts = {} if shown is run else _lasts(shown, loaded)
    output.deliver(
        {"title": loaded.title, **fields_of(run, loaded), **lasts},
        text=lambda: _shown(loaded, run, scale, lasts),
        dataset=lambda: to_dataset(shown, case=loaded).assign_attrs(
            {**_decided(run, loaded), **lasts}
        ),
        figure=lambda: spoken(_figure(loaded, shown, figure, scale), loaded),
        command="simulate",
    )


def _decided(run: Run, case: Case) -> dict[str, float]:
    """After what time the end was certain, in tau and s: the same number wherever it stands."""
    from aeroflutter.results import to_json

    found = to_json(run, case=case)
    return {key: found[key] for key in ("duration", "duration_s") if key in found}


def _lasts(shown: Run, case: Case) -> dict[str, float]:
    """How long the trace is that is drawn and saved."""
    return {f"trace_{key}": value for key, value in _decided(shown, case).items()}


def _shown(case: Case, run: Run, scale: Scale | None, lasts: dict[str, float]) -> None:
    """Print a run for people."""
    from aeroflutter.results import fields_of

    names = {"speed": "speed U*", "speed_ratio": "U*/U*_L", "flutter_speed": "U*_L"}
    say(case.title)
    fields = spoken_unit().shown(fields_of(run, case if scale else None))
    moving, springs = fields.pop("coordinates"), fields.pop("springs")
    show_facts({names.get(key, key): value for key, value in {**fields, **lasts}.items()})
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


def _single(
    case: Case, start: Initial, settings: SimulateOptions, speed: float, flutter: float | None
) -> Run:
    from aeroflutter.motion.response import simulate as march
    from aeroflutter.results.motions import Run

    with late_bar("simulating") as tick:
        family, spring = case.loop()
        response = march(family.at(speed), spring, start, replace(settings, progress=tick))
    return Run(speed=speed, flutter_speed=flutter, start=start, response=response)


def _figure(case: Case, run: Run, kind: str, scale: Scale | None) -> Figure:
    from aeroflutter.plots.style import Clock, literal
    from aeroflutter.plots.timemarch import plot_response

    ratio = run.speed_ratio
    at = f"$U^*$ = {run.speed:.4g}" if ratio is None else f"$U^*/U^*_L$ = {ratio:.4g}"
    if scale is not None:
        at = f"{scale.velocity(run.speed):.5g} m/s"
    title = f"{literal(case.title)}, {at}: {run.response.state}"
    return plot_response(run.response, kind, title, Clock.of(run.speed, scale))


def _sweeps(
    case: Case,
    start: Initial,
    settings: SimulateOptions,
    speeds: Any,
    kick_deg: float,
    output: Output,
) -> None:
    """Up and down again; the way down starts where the way up ended, or from `start` if it left."""
    from aeroflutter.motion.sweeps import there_and_back
    from aeroflutter.results import fields_of, to_dataset
    from aeroflutter.results.dataset import side_by_side
    from aeroflutter.results.motions import Pass

    scale = output.begin(case, "simulate")
    reference = unit("--speed-ratio", case)
    with late_bar("sweeping") as tick:
        passes = there_and_back(
            *case.loop(),
            speeds,
            start,
            replace(settings, progress=tick),
            native(kick_deg),
        )
    made = [Pass(one, reference) for one in passes]
    starts = _starts(passes, start)
    found = [
        {**fields_of(one, case), "starts": words} for one, words in zip(made, starts, strict=True)
    ]
    output.deliver(
        {
            "title": case.title,
            "flutter_speed": reference,
            "alpha_deg": start.alpha * start_unit().factor,
            "sweeps": found,
        },
        text=lambda: _show_sweeps(case, found, scale),
        dataset=lambda: side_by_side(
            {one["direction"]: to_dataset(p, case=case) for one, p in zip(found, made, strict=True)}
        ).assign_attrs(
            flutter_speed=reference,
            **{f"starts_{one['direction']}": one["starts"] for one in found},
        ),
        figure=lambda: spoken(_sweeps_figure(case, passes, reference, scale), case),
        command="simulate",
    )


def _starts(passes: Sequence[Sweep], start: Initial) -> tuple[str, str]:
    """Where either pass starts: the second from the first one's end, if that was a cycle."""
    unit = start_unit()
    initial = f"from the initial motion, {start.alpha * unit.factor:.6g} {unit.name}"
    last = passes[0].state[-1]
    if last in ("lco", "aperiodic"):
        return initial, "from where the way out ended"
    why = "it came to rest" if last == "damped" else f"it ended {last}"
    return initial, f"{initial}, once more: at the end of the way out {why}"


def _sweeps_figure(
    case: Case, passes: Sequence[Sweep], reference: float, scale: Scale | None
) -> Figure:
    from aeroflutter.plots.style import Airspeed, literal
    from aeroflutter.plots.timemarch import plot_sweeps

    across = Airspeed.of(reference, scale)
    return plot_sweeps(passes, across.unit, literal(case.title), label=across.label)


def _show_sweeps(case: Case, passes: list[dict[str, Any]], scale: Scale | None) -> None:
    say(case.title)
    for found in passes:
        print()
        rising = "rising" if found["direction"] == "up" else "falling"
        say(f"speed {rising}, {found['starts']}")
        alone = ("direction", "jumps", "starts")
        columns = {
            key: one
            for key, one in found.items()
            if key not in alone
            and not (one is None or isinstance(one, str))
            and (scale or not key.endswith(("_m_s", "_hz", "_s")))
        }
        rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
        show_fields("speed_ratio state amplitude bias period", rows)
        for jump in found["jumps"]:
            speeds, sizes = jump["speed_ratio"], jump["amplitude" + spoken_unit().suffix]
            say(
                f"jump between {speeds[0]:.5g} and {speeds[1]:.5g}: "
                f"{sizes[0]:.4g} to {sizes[1]:.4g} {spoken_unit().name}"
            )
