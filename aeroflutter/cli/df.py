"""`aeroflutter df`."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from aeroflutter.cli.airspeed import AirspeedRange, pair, several_speeds
from aeroflutter.cli.common import (
    CaseName,
    CaseOptions,
    Output,
    flutter_facts,
    lowest,
    numbers,
    say,
    show_facts,
    show_fields,
)
from aeroflutter.cli.former import former
from aeroflutter.cli.varying import Vary, lowest_rows
from aeroflutter.errors import InputError
from aeroflutter.results.unit import native, told

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from aeroflutter.case import Case
    from aeroflutter.guarantees import Guarantees
    from aeroflutter.model.section import Scale
    from aeroflutter.orbits.describing import DescribingCurve

_ROUND_OFF = 1e-10  # expected error below which a motion is sinusoidal


def df(
    case: CaseName,
    *,
    amplitudes_deg: Annotated[
        str | None,
        Parameter(help="Cycles of exactly these amplitudes, as A:B:N or a,b,c, every family."),
    ] = None,
    smallest_deg: Annotated[float | None, Parameter(help="Smallest amplitude searched.")] = None,
    largest_deg: Annotated[float | None, Parameter(help="Largest amplitude searched.")] = None,
    between: AirspeedRange = AirspeedRange(),
    points: Annotated[int, Parameter(help="Points on every family.")] = 200,
    vary: Vary = Vary(),
    amplitude_range_deg: Annotated[str | None, Parameter(show=False)] = None,
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
    several_speeds(loaded)
    scale = output.begin(loaded, "df")
    former({"--amplitude-range-deg": amplitude_range_deg}, "--smallest-deg and --largest-deg")
    amplitudes = _amplitude_range(amplitude_range_deg, smallest_deg, largest_deg)
    wanted = None if amplitudes_deg is None else numbers("--amplitudes-deg", amplitudes_deg)
    if wanted is not None and (wanted <= 0).any():
        raise InputError("--amplitudes-deg: every amplitude must be positive")

    def analyse(one: Case) -> DescribingCurve:
        settings = DescribingOptions(
            amplitude_range=amplitudes(one),
            speed_ratio_range=between.ratios(one, (0.05, 3.0)),
            points=points,
        )
        if wanted is None:
            return describing_curve(*one.loop(), settings)
        return describing_at(*one.loop(), wanted * math.pi / 180, settings)

    if vary.vary is not None:
        vary.deliver(loaded, "df", analyse, output, rows=lowest_rows)
        return
    result = analyse(loaded)
    verdict = functools.cache(  # once, and only if asked for
        lambda: _guarantees(loaded, result, single=wanted is not None)
    )
    output.result(
        loaded,
        lambda: Proved(curve=result, guarantees=verdict()),
        text=lambda: _print(loaded, result, scale, every=wanted is not None),
        figure=lambda: _figure(loaded, result, verdict(), scale),
        command="df",
    )


def _guarantees(
    case: Case, result: DescribingCurve, only: list[int] | None = None, *, single: bool = False
) -> Guarantees:
    """The guarantee of every point, or of some, the latter without bands of amplitude.

    Points that are not a curve are `single`: none bounds its neighbour's amplitude.
    """
    from aeroflutter.guarantees import cut, guarantees, guarantees_at

    if only is None and not single:
        return guarantees(*case.loop(), result)
    chosen = slice(None) if only is None else only
    points = {
        "amplitude": result.amplitude[chosen],
        "bias": result.bias[chosen],
        "speed": result.speed[chosen],
        "omega": result.k[chosen],
    }
    distortion = result.distortion[chosen]
    family, spring = case.loop()
    found = guarantees_at(family, spring, **points, distortion=distortion)
    if single and found.guaranteed.any():
        cut(case.family(), case.spring, found, **points, slope=result.slope[chosen])
    return found


def _amplitude_range(
    text: str | None, smallest: float | None, largest: float | None
) -> Callable[[Case], tuple[float, float] | None]:
    """Lowest and highest amplitude searched in a case, None where both are left open."""
    if text is not None:
        low, high = pair("--amplitude-range-deg", text)
        return lambda _: (native(low), native(high))
    if smallest is None and largest is None:
        return lambda _: None
    for name, value in (("--smallest-deg", smallest), ("--largest-deg", largest)):
        if value is not None and not (math.isfinite(value) and value > 0.0):
            raise InputError(f"{name}: must be a positive number of degrees, not {value}")
    return lambda one: _open_range(one, smallest, largest)


def _open_range(case: Case, smallest: float | None, largest: float | None) -> tuple[float, float]:
    from aeroflutter.orbits.describing import DescribingOptions
    from aeroflutter.springs import simplify

    low, high = DescribingOptions().amplitudes(simplify(case.spring))
    found = (
        low if smallest is None else native(smallest),
        high if largest is None else native(largest),
    )
    if not found[0] < found[1]:
        raise InputError(
            f"--smallest-deg, --largest-deg: {told(found[0]):g} must be below {told(found[1]):g}"
        )
    return found


def _print(case: Case, result: DescribingCurve, scale: Scale | None, *, every: bool) -> None:
    from aeroflutter.results import fields_of

    say(case.title)
    fields = fields_of(result, case if scale else None)
    facts: dict[str, Any] = flutter_facts(result.flutter_speed, scale)
    for name in ("onset", "stable_onset"):
        facts[name.replace("_", " ")] = fields[name] and lowest(fields[name])
    show_facts(facts)
    for note in result.notes:
        say(f"note: {note}")
    if result.amplitude.size:
        chosen = _chosen(result, every)
        _print_points([fields["branch"][i] for i in chosen], _guarantees(case, result, chosen))
        if not every:
            say("a selection of the points; --json and --out give them all")


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
        say(f"no proof where {reason}")


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


def _figure(case: Case, result: DescribingCurve, found: Guarantees, scale: Scale | None) -> Figure:
    from aeroflutter.plots.describing import plot_describing
    from aeroflutter.plots.style import literal

    return plot_describing(result, literal(case.title), found, scale)
