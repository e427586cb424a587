"""`aeroflutter tolerance`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from aeroflutter.cli.airspeed import EXACTLY_ONE, Airspeed, unit
from aeroflutter.cli.common import CaseName, CaseOptions, Output, say, show_facts
from aeroflutter.cli.progress import late_bar
from aeroflutter.cli.proving import Harmless, harmless
from aeroflutter.cli.which import Which, place_of
from aeroflutter.errors import InputError
from aeroflutter.results.unit import native, spoken_unit, told

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from aeroflutter.case import Case
    from aeroflutter.model.section import Scale
    from aeroflutter.studies.tolerance import Tolerance


def tolerance(
    case: CaseName,
    *,
    airspeed: Airspeed = Airspeed(),
    amplitude_deg: Annotated[float, Parameter(help="Largest amplitude of a stable limit cycle.")],
    vary: Annotated[
        Literal["size", "gap", "friction"],
        Parameter(
            help="size: how large the whole spring may be, its shape kept. gap: the largest gap "
            "at the case's friction. friction: the least friction at the case's gap."
        ),
    ] = "size",
    spring: Which = None,
    options: CaseOptions = CaseOptions(),
    output: Output = Output(),
) -> None:
    """The largest gap, or the least friction, that keeps limit cycles small enough.

    Every stable limit cycle up to the airspeed is to stay below --amplitude-deg, half peak to
    peak. A piecewise-linear spring is scale-free, so one branch answers for its size; gap or
    friction alone change the shape of the loop, so they take a branch a trial, and so does
    anything of one of several springs, while the others stay as they are.
    """
    from aeroflutter.studies.tolerance import largest_gap, least_friction
    from aeroflutter.studies.tolerance import tolerance as largest_size

    output.check()
    if not (math.isfinite(amplitude_deg) and amplitude_deg > 0.0):
        raise InputError(f"--amplitude-deg: must be a positive number, not {amplitude_deg}")
    loaded = options.load(case)
    scale = output.begin(loaded, "tolerance")
    at = airspeed.one(loaded, EXACTLY_ONE)
    assert at is not None  # or it is refused
    ask = {"size": largest_size, "gap": largest_gap, "friction": least_friction}[vary]
    ratio = at / unit("--speed-ratio", loaded)
    family, springs = loaded.loop()
    which = place_of(spring, loaded)
    with late_bar("following limit cycles"):
        result = ask(family, springs, ratio, native(amplitude_deg), which=which)
    proved = None if isinstance(springs, tuple) else harmless(loaded, at, vary)
    output.result(
        loaded,
        lambda: result,
        text=lambda: _print(loaded, result, scale, proved),
        figure=lambda: _figure(loaded, result, scale),
        facts={} if proved is None else proved.facts(),
        command="tolerance",
    )


WHAT = {"size": "largest spring", "gap": "largest gap", "friction": "least friction"}
OF_CASE = {"size": "the case's own size", "gap": "the case's own gap", "friction": "the case's own"}


def _print(case: Case, result: Tolerance, scale: Scale | None, proved: Harmless | None) -> None:
    from aeroflutter.results.cycles import spring_record
    from aeroflutter.results.words import spring_words

    say(case.title)
    _say_which(case, result)
    unit = spoken_unit().name
    limit = f"{told(result.amplitude):.6g} {unit} up to {_at(result.speed, result, scale)}"
    if result.unlimited:
        word = "gap" if result.vary == "gap" else "size"
        say(f"any {word} keeps stable limit cycles below {limit}: there are none up to there")
    elif result.spring is None:
        say(f"any gap that was tried keeps stable limit cycles below {limit}")
    else:
        say(f"{WHAT[result.vary]} that keeps stable limit cycles below {limit}:")
        words = spring_words(result.spring)
        if words:
            say(f"  {words}")
        show_facts(spring_record(result.spring) or {})
        if math.isfinite(result.factor):
            say(f"that is {result.factor:.6g} times {OF_CASE[result.vary]}")
    worst = result.worst
    if worst is None and result.spring is not None:
        say("with it there is no stable limit cycle up to that speed")
    elif worst is not None:
        as_it_is = result.vary == "size" and result.which is None
        own = "of the case as it stands" if as_it_is else f"with that {result.vary}"
        at = _at(worst.speed, result, scale)
        say(f"largest stable limit cycle {own}: {told(worst.amplitude):.6g} {unit} at {at}")
    if proved is not None:
        say(_proved(proved, result, scale))
    for note in result.notes:
        say(f"note: {note}")


def _say_which(case: Case, result: Tolerance) -> None:
    """What the spring is that varies."""
    from aeroflutter.results.words import spring_words

    which = result.which or 0
    own = spring_words(case.loop_springs[which])
    if own:
        say(f"the case: {own}")
    if result.which is not None:
        say(f"of the spring in {case.model().names[which]}, the others as they are:")


def _proved(proved: Harmless, result: Tolerance, scale: Scale | None) -> str:
    """From which size on nothing oscillates at all."""
    from aeroflutter.results.words import spring_words

    how = "by proof" if proved.certified else "as far as samples go"
    said = f"{how}, nothing at all oscillates at {_at(result.speed, result, scale)} with"
    if proved.ratio == 0.0:
        return f"{said} any friction and any gap"
    if proved.loop is not None:
        bound = "least" if result.vary == "friction" else "most"
        return f"{said} a {result.vary} of at {bound} this: {spring_words(proved.loop)}"
    return f"{said} delta_v of at least {proved.ratio:.6g} delta_h, whatever the size"


def _at(speed: float, result: Tolerance, scale: Scale | None) -> str:
    """A speed in words."""
    ratio = spoken_unit().words(f"U*/U*_L = {speed / (result.speed / result.speed_ratio):.6g}")
    return ratio if scale is None else f"{scale.velocity(speed):.5g} m/s ({ratio})"


def _figure(case: Case, result: Tolerance, scale: Scale | None) -> Figure:
    from aeroflutter.plots.style import literal
    from aeroflutter.plots.tolerance import plot_tolerance

    return plot_tolerance(result, literal(case.title), scale)
