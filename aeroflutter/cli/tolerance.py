"""`aeroflutter tolerance`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from aeroflutter.cli.common import CaseName, CaseOptions, Output, show_facts
from aeroflutter.errors import InputError

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from aeroflutter.case import Case
    from aeroflutter.orbits.cycles import Tolerance

_SPRING_KEYS = {
    "delta_v": "delta_v_deg",
    "delta_h": "delta_h_deg",
    "v_off": "v_off_deg",
    "h_off": "h_off_deg",
    "gap": "gap_deg",
    "centre": "centre_deg",
    "m0": "m0_deg",
    "alpha_f": "alpha_f_deg",
    "delta": "delta_deg",
    "pitch": "pitch_deg",
    "moments": "moment_deg",
}


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
    from aeroflutter.orbits.cycles import least_friction
    from aeroflutter.orbits.cycles import tolerance as largest_size

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
    output.deliver(
        _payload(loaded, result, vary),
        text=lambda: _print(loaded, result, vary),
        dataset=lambda: _dataset(loaded, result),
        figure=lambda: _figure(loaded, result),
    )


def _payload(case: Case, result: Tolerance, vary: str) -> dict[str, Any]:
    worst = result.worst
    return {
        "title": case.title,
        "vary": vary,
        "speed_ratio": result.speed_ratio,
        "speed": result.speed,
        "amplitude_deg": math.degrees(result.amplitude),
        "unlimited": vary == "size" and result.spring is None,
        "factor": result.factor,
        "spring": _spring(result.spring),
        "worst": None
        if worst is None
        else {
            "amplitude_deg": math.degrees(worst.amplitude),
            "bias_deg": math.degrees(worst.bias),
            "speed_ratio": worst.speed_ratio,
            "speed": worst.speed,
            "period": worst.period,
        },
        "notes": result.notes,
    }


def _spring(spring: Any) -> dict[str, Any] | None:
    """The spring as a case file writes it."""
    from dataclasses import fields

    if spring is None:
        return None
    found: dict[str, Any] = {"kind": spring.kind}
    for entry in fields(spring):
        value = getattr(spring, entry.name)
        key = _SPRING_KEYS.get(entry.name)
        if key is None:
            found[entry.name] = value
        elif isinstance(value, tuple):
            found[key] = [math.degrees(one) for one in value]
        else:
            found[key] = math.degrees(value)
    return found


def _print(case: Case, result: Tolerance, vary: str) -> None:
    print(case.title)
    limit = f"{math.degrees(result.amplitude):.6g} deg up to U*/U*_L = {result.speed_ratio:g}"
    if result.spring is None:
        print(f"any size keeps stable limit cycles below {limit}: there are none up to there")
    else:
        what = "largest spring" if vary == "size" else "least friction"
        print(f"{what} that keeps stable limit cycles below {limit}:")
        show_facts(_spring(result.spring) or {})
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


def _dataset(case: Case, result: Tolerance) -> xr.Dataset:
    from aeroflutter.results.cycles import to_dataset

    return to_dataset(result, case=case)


def _figure(case: Case, result: Tolerance) -> Figure:
    from aeroflutter.plots.cycles import plot_tolerance

    return plot_tolerance(result, case.title)
