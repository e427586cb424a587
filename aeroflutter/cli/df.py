"""`aeroflutter df`."""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from aeroflutter.cli.common import (
    CaseName,
    CaseOptions,
    Output,
    lowest,
    numbers,
    show_facts,
    show_fields,
)
from aeroflutter.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from aeroflutter.case import Case
    from aeroflutter.guarantees import Guarantees
    from aeroflutter.orbits.describing import DescribingCurve

_ROUND_OFF = 1e-10  # expected error below which a motion is sinusoidal


def df(
    case: CaseName,
    *,
    amplitudes_deg: Annotated[
        str | None,
        Parameter(help="Cycles of exactly these amplitudes, as A:B:N or a,b,c, every family."),
    ] = None,
    amplitude_range_deg: Annotated[
        str | None, Parameter(help="Lowest and highest amplitude searched, as low,high.")
    ] = None,
    speed_ratio_range: Annotated[
        str, Parameter(help="Lowest and highest speed ratio searched, as low,high.")
    ] = "0.05,3",
    points: Annotated[int, Parameter(help="Points on every family.")] = 200,
    options: CaseOptions = CaseOptions(),
    output: Output = Output(),
) -> None:
    """Amplitude of limit cycles against airspeed by describing functions.

    Every family of cycles in the range is followed over all amplitudes, with its bias where the
    spring has one. By default amplitudes run from where the spring becomes nonlinear to a hundred
    times its size. Every point says in which band of speed and amplitude a true cycle is proved to
    lie, or why there is no such guarantee and what error its distortion lets expect.
    """
    from aeroflutter.orbits.describing import DescribingOptions, describing_at, describing_curve
    from aeroflutter.results.cycles import Proved

    output.check()
    loaded = options.load(case)
    settings = DescribingOptions(
        amplitude_range=_amplitude_range(amplitude_range_deg),
        speed_ratio_range=_pair("--speed-ratio-range", speed_ratio_range),
        points=points,
    )
    if amplitudes_deg is None:
        result = describing_curve(loaded.family(), loaded.spring, settings)
    else:
        wanted = numbers("--amplitudes-deg", amplitudes_deg)
        if (wanted <= 0).any():
            raise InputError("--amplitudes-deg: every amplitude must be positive")
        result = describing_at(loaded.family(), loaded.spring, wanted * math.pi / 180, settings)
    verdict = functools.cache(  # once, and only if asked for
        lambda: _guarantees(loaded, result, single=amplitudes_deg is not None)
    )
    output.result(
        loaded,
        lambda: Proved(curve=result, guarantees=verdict()),
        text=lambda: _print(loaded, result, every=amplitudes_deg is not None),
        figure=lambda: _figure(loaded, result, verdict()),
    )


def _guarantees(
    case: Case, result: DescribingCurve, only: list[int] | None = None, *, single: bool = False
) -> Guarantees:
    """The guarantee of every point, or of some, the latter without bands of amplitude.

    Points that are not a curve are `single`: none bounds its neighbour's amplitude.
    """
    from aeroflutter.guarantees import cut, guarantees, guarantees_at

    if only is None and not single:
        return guarantees(case.family(), case.spring, result)
    chosen = slice(None) if only is None else only
    points = {
        "amplitude": result.amplitude[chosen],
        "bias": result.bias[chosen],
        "speed": result.speed[chosen],
        "omega": result.k[chosen],
    }
    distortion = result.distortion[chosen]
    found = guarantees_at(case.family(), case.spring, **points, distortion=distortion)
    if single:
        cut(case.family(), case.spring, found, **points, slope=result.slope[chosen])
    return found


def _pair(option: str, text: str) -> tuple[float, float]:
    values = numbers(option, text)
    if values.size != 2 or not 0 < values[0] < values[1]:
        raise InputError(f'{option}: "{text}" must be low,high with 0 < low < high')
    return float(values[0]), float(values[1])


def _amplitude_range(text: str | None) -> tuple[float, float] | None:
    if text is None:
        return None
    low, high = _pair("--amplitude-range-deg", text)
    return math.radians(low), math.radians(high)


def _print(case: Case, result: DescribingCurve, *, every: bool) -> None:
    from aeroflutter.results import fields_of

    print(case.title)
    fields = fields_of(result)
    facts: dict[str, Any] = {"linear flutter speed U*": result.flutter_speed}
    for name in ("onset", "stable_onset"):
        facts[name.replace("_", " ")] = fields[name] and lowest(fields[name])
    show_facts(facts)
    for note in result.notes:
        print(f"note: {note}")
    if result.amplitude.size:
        chosen = _chosen(result, every)
        _print_points([fields["branch"][i] for i in chosen], _guarantees(case, result, chosen))
        if not every:
            print("a selection of the points; --json and --out give them all")


def _print_points(points: list[dict[str, Any]], found: Guarantees) -> None:
    rows = [
        point
        | {
            "family": str(point["family"]),
            "distortion": f"{point['distortion']:.2%}",
            "error of U*": _error(found, i, point["speed"]),
        }
        for i, point in enumerate(points)
    ]
    names = "family amplitude bias speed_ratio k stable distortion"
    show_fields(names, rows, "error of U*")
    for reason in sorted({reason.split(" (")[0] for reason in found.reason if reason}):
        print(f"no proof where {reason}")


def _error(found: Guarantees, i: int, speed: float) -> str:
    """What is known of the relative error of a point's speed."""
    if found.guaranteed[i]:
        return f"< {float(abs(found.speed[i] - speed).max()) / speed:.1e} (proved)"
    if found.expected_error[i] < _ROUND_OFF:
        return "~ 0"
    doubt = " (doubtful)" if found.doubtful[i] else ""
    return f"~ {found.expected_error[i]:.1e}{doubt}"


def _chosen(result: DescribingCurve, every: bool, count: int = 12) -> list[int]:
    """Indices to print: all, or a few of every family."""
    if every:
        return list(range(result.amplitude.size))
    chosen: list[int] = []
    for one in result.families:
        mine = [i for i in range(result.family.size) if result.family[i] == one.number]
        step = max(1, (len(mine) - 1) // (count - 1))
        chosen += mine[::step]
    return chosen


def _figure(case: Case, result: DescribingCurve, found: Guarantees) -> Figure:
    from aeroflutter.plots.describing import plot_describing

    return plot_describing(result, case.title, found)
