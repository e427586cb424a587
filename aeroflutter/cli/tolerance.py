"""`aeroflutter tolerance`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from aeroflutter.cli.common import CaseName, CaseOptions, Output, show_facts
from aeroflutter.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from aeroflutter.case import Case
    from aeroflutter.studies.tolerance import Tolerance


def tolerance(
    case: CaseName,
    *,
    speed_ratio: Annotated[
        float, Parameter(help="Highest airspeed over the linear flutter speed.")
    ],
    amplitude_deg: Annotated[float, Parameter(help="Largest amplitude of a stable limit cycle.")],
    vary: Annotated[
        Literal["size", "friction"],
        Parameter(
            help="size: how large the whole spring may be, its shape kept. friction: the least "
            "delta_v at the case's delta_h."
        ),
    ] = "size",
    options: CaseOptions = CaseOptions(),
    output: Output = Output(),
) -> None:
    """The largest gap, or the least friction, that keeps limit cycles small enough.

    Every stable limit cycle up to --speed-ratio is to stay below --amplitude-deg, half peak to
    peak. A piecewise-linear spring is scale-free, so one branch answers for its size.
    """
    from aeroflutter.studies.tolerance import least_friction
    from aeroflutter.studies.tolerance import tolerance as largest_size

    output.check()
    problems = [
        f"{name}: must be a positive number, not {value}"
        for name, value in (("--speed-ratio", speed_ratio), ("--amplitude-deg", amplitude_deg))
        if not (math.isfinite(value) and value > 0.0)
    ]
    if problems:
        raise InputError(problems)
    loaded = options.load(case)
    ask = largest_size if vary == "size" else least_friction
    result = ask(loaded.family(), loaded.spring, speed_ratio, math.radians(amplitude_deg))
    output.result(
        loaded,
        lambda: result,
        facts={"vary": vary},
        text=lambda: _print(loaded, result, vary),
        figure=lambda: _figure(loaded, result),
    )


def _print(case: Case, result: Tolerance, vary: str) -> None:
    from aeroflutter.results.cycles import spring_record

    print(case.title)
    limit = f"{math.degrees(result.amplitude):.6g} deg up to U*/U*_L = {result.speed_ratio:g}"
    if result.spring is None:
        print(f"any size keeps stable limit cycles below {limit}: there are none up to there")
    else:
        what = "largest spring" if vary == "size" else "least friction"
        print(f"{what} that keeps stable limit cycles below {limit}:")
        show_facts(spring_record(result.spring) or {})
        if math.isfinite(result.factor):
            part = "the case's own size" if vary == "size" else "the case's own delta_v"
            print(f"that is {result.factor:.6g} times {part}")
    worst = result.worst
    if worst is None and result.spring is not None:
        print("with it there is no stable limit cycle up to that speed")
    elif worst is not None:
        own = "of the case as it stands" if vary == "size" else "with that friction"
        print(
            f"largest stable limit cycle {own}: {math.degrees(worst.amplitude):.6g} deg at "
            f"U*/U*_L = {worst.speed_ratio:.6g}"
        )
    for note in result.notes:
        print(f"note: {note}")


def _figure(case: Case, result: Tolerance) -> Figure:
    from aeroflutter.plots.cycles import plot_tolerance

    return plot_tolerance(result, case.title)
