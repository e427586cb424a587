"""`aeroflutter loop`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from aeroflutter.cli.common import CaseName, CaseOptions, Output, show_facts, show_table
from aeroflutter.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from aeroflutter.case import Case
    from aeroflutter.guarantees.looptest import LoopTest
    from aeroflutter.orbits.describing import DescribingCurve


def loop(
    case: CaseName,
    *,
    speed_ratio: Annotated[
        float | None, Parameter(help="Speed over the linear flutter speed.")
    ] = None,
    speed: Annotated[float | None, Parameter(help="Speed U*, instead.")] = None,
    harmonics: Annotated[int, Parameter(help="Highest harmonic looked at.")] = 9,
    spoils: Annotated[
        float, Parameter(help="Predicted harmonic over the first from which it is marked.")
    ] = 0.01,
    options: CaseOptions = CaseOptions(),
    output: Output = Output(),
) -> None:
    """Whether the describing function can be believed at one speed.

    Bode and Nyquist plots of the loop with the locus -1/N, the harmonics that spoil each cycle,
    and the verdict: bands of speed and amplitude that are proved to hold the true cycle, or the
    reason why there are none.
    """
    from aeroflutter.guarantees.looptest import LoopTestOptions, loop_test
    from aeroflutter.orbits.describing import describing_curve

    output.check()
    settings = LoopTestOptions(harmonics=harmonics, spoils=spoils)
    _check(speed_ratio, speed)
    loaded = options.load(case)
    curve = describing_curve(loaded.family(), loaded.spring)
    at = speed if speed is not None else _speed(speed_ratio, curve)
    result = loop_test(loaded.family(), loaded.spring, at, settings, curve)
    output.result(
        loaded,
        lambda: result,
        text=lambda: _print(loaded, result),
        figure=lambda: _figure(loaded, result),
    )


def _check(speed_ratio: float | None, speed: float | None) -> None:
    if (speed_ratio is None) == (speed is None):
        raise InputError("--speed-ratio, --speed: give one of them")
    name, value = ("--speed", speed) if speed is not None else ("--speed-ratio", speed_ratio)
    if value is not None and not (math.isfinite(value) and value > 0):
        raise InputError(f"{name}: must be positive and finite, not {value!r}")


def _speed(speed_ratio: float | None, curve: DescribingCurve) -> float:
    if curve.flutter_speed is None or speed_ratio is None:
        raise InputError("--speed-ratio: the section has no flutter speed; give --speed")
    return speed_ratio * curve.flutter_speed


def _print(case: Case, result: LoopTest) -> None:
    from aeroflutter.results import to_json

    print(case.title)
    show_facts({"speed U*": result.speed, "U*/U*_L": result.speed_ratio})
    if not result.cycles:
        print("the describing function has no cycle at this speed")
    for one, fields in zip(result.cycles, to_json(result)["cycles"], strict=True):
        spoiling = [str(order) for order in one.orders[one.spoiling]]
        print()
        show_facts(
            {
                "cycle": f"{math.degrees(one.amplitude):.5g} deg, k = {one.k:.5g}",
                "spoiled by harmonics": ", ".join(spoiling) or "none",
                "verdict": _verdict(fields["guarantee"]),
            }
        )
        show_table(
            ("harmonic", "answer of the spring", "gain of the loop", "predicted"),
            [
                (str(h["order"]), h["answer"], h["gain"], f"{h['predicted']:.2%}")
                for h in fields["harmonics"]
                if h["answer"] > 1e-12
            ],
        )


def _verdict(fields: dict[str, Any]) -> str:
    if not fields["guaranteed"]:
        doubt = "doubtful" if fields["doubtful"] else "its distortion raises no doubt"
        return (
            f"no guarantee: {fields['reason']}; {doubt} "
            f"(error of the speed up to {fields['expected_error']:.2%} expected)"
        )
    ratio = fields["speed_ratio"]
    name, band = ("U*/U*_L", ratio) if ratio else ("U*", fields["speed"])
    said = f"proved: a cycle of this first harmonic at {name} from {band[0]:.5f} to {band[1]:.5f}"
    section = fields["amplitude_deg"]
    if section is None:
        return said
    exists = "a cycle" if fields["exists_at_speed"] else "any cycle nearby"
    return f"{said}; at this speed {exists} of {section[0]:.4g} to {section[1]:.4g} deg"


def _figure(case: Case, result: LoopTest) -> Figure:
    from aeroflutter.plots.loop import plot_loop

    ratio = result.speed_ratio
    at = f"$U^*/U^*_L$ = {ratio:.4g}" if math.isfinite(ratio) else f"$U^*$ = {result.speed:.4g}"
    return plot_loop(result, f"{case.title}; {at}")
