"""`aeroflutter loop`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from aeroflutter.cli.airspeed import Airspeed
from aeroflutter.cli.common import CaseName, CaseOptions, Output, say, show_facts, show_table
from aeroflutter.cli.which import Which, place_of
from aeroflutter.results.unit import spoken_unit, told

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from aeroflutter.case import Case
    from aeroflutter.guarantees.looptest import LoopTest
    from aeroflutter.model.section import Scale


def loop(
    case: CaseName,
    *,
    airspeed: Airspeed = Airspeed(),
    harmonics: Annotated[int, Parameter(help="Highest harmonic looked at.")] = 9,
    spoils: Annotated[
        float, Parameter(help="Predicted harmonic over the first from which it is marked.")
    ] = 0.01,
    spring: Which = None,
    options: CaseOptions = CaseOptions(),
    output: Output = Output(),
) -> None:
    """Whether the describing function can be believed at one speed.

    Bode and Nyquist plots of the loop with the locus -1/N, the harmonics that spoil each cycle,
    and the verdict: bands of speed and amplitude that are proved to hold the true cycle, or the
    reason why there are none. Of several springs the loop of one is shown, the others being their
    describing functions on the first cycle; harmonics are those of the whole loop.
    """
    from aeroflutter.guarantees.looptest import LoopTestOptions, loop_test
    from aeroflutter.orbits.describing import describing_curve

    output.check()
    settings = LoopTestOptions(harmonics=harmonics, spoils=spoils)
    loaded = options.load(case)
    scale = output.begin(loaded, "loop")
    at = airspeed.one(loaded, "--speed-ratio, --speed: give one of them, or --velocity")
    assert at is not None  # or it is refused
    curve = describing_curve(*loaded.loop())
    result = loop_test(*loaded.loop(), at, settings, curve, place_of(spring, loaded))
    output.result(
        loaded,
        lambda: result,
        text=lambda: _print(loaded, result, scale),
        figure=lambda: _figure(loaded, result, scale),
        command="loop",
    )


def _print(case: Case, result: LoopTest, scale: Scale | None) -> None:
    from aeroflutter.results import to_json

    say(case.title)
    own = case if scale else None
    si = {"V (m/s)": scale.velocity(result.speed)} if scale else {}
    show_facts({"speed U*": result.speed, "U*/U*_L": result.speed_ratio, **si})
    if not result.cycles:
        say("the describing function has no cycle at this speed")
    for one, fields in zip(result.cycles, to_json(result, case=own)["cycles"], strict=True):
        spoiling = [str(order) for order in one.orders[one.spoiling]]
        print()
        hertz = f" ({scale.frequency_hz(one.k, result.speed):.5g} Hz)" if scale else ""
        show_facts(
            {
                "cycle": f"{told(one.amplitude):.5g} {spoken_unit().name}, k = {one.k:.5g}{hertz}",
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
    name = spoken_unit().words(name)
    said = f"proved: a cycle of this first harmonic at {name} from {band[0]:.5f} to {band[1]:.5f}"
    if fields.get("velocity_m_s") is not None:
        low, high = map(float, fields["velocity_m_s"])
        said += f" ({low:.5g} to {high:.5g} m/s)"
    section = fields["amplitude" + spoken_unit().suffix]
    if section is None:
        return said
    exists = "a cycle" if fields["exists_at_speed"] else "any cycle nearby"
    between = f"{section[0]:.4g} to {section[1]:.4g} {spoken_unit().name}"
    return f"{said}; at this speed {exists} of {between}"


def _figure(case: Case, result: LoopTest, scale: Scale | None) -> Figure:
    from aeroflutter.plots.loop import plot_loop
    from aeroflutter.plots.style import literal

    ratio = result.speed_ratio
    at = f"$U^*/U^*_L$ = {ratio:.4g}" if math.isfinite(ratio) else f"$U^*$ = {result.speed:.4g}"
    if scale is not None:
        at = f"{scale.velocity(result.speed):.5g} m/s"
    return plot_loop(result, f"{literal(case.title)}; {at}", scale=scale)
