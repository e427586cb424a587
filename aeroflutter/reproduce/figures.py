"""How each kind of figure is made: from a case to a drawing, its facts and its data."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.linear.rootlocus import flutter_against_stiffness, flutter_speed, root_locus
from aeroflutter.motion.response import Initial, Response, SimulateOptions, simulate
from aeroflutter.orbits.cycles import LimitCycles, limit_cycles
from aeroflutter.orbits.describing import DescribingCurve, describing_curve
from aeroflutter.springs import respond
from aeroflutter.studies.maps import Axis, FlutterMap, Grid, SpeedPitch, flutter_map
from aeroflutter.verdicts import STATES

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from aeroflutter.case import Case

RATIOS = np.linspace(0.1, 1.0, 91)  # the thesis's range of airspeeds
PITCHES_DEG = np.linspace(1.0, 15.0, 29)
SHOWN = 600.0  # duration of a trace, tau
LATE = 4000.0  # duration of a run whose spectrum or loop is drawn


@dataclass(frozen=True, kw_only=True)
class Drawn:
    """A figure with the numbers that its caption quotes; a table has text instead."""

    figure: Figure | None = None
    facts: dict[str, Any] = field(default_factory=dict)
    table: str = ""


def traces(case: Case, title: str, *, speed_ratio: float) -> Drawn:
    """Pitch and heave against time (figures 4.1-4.7, 5.1, 5.3)."""
    from aeroflutter.plots.timemarch import plot_response

    facts, response = _motion(case, speed_ratio, SHOWN)
    return Drawn(figure=plot_response(response, "traces", title), facts=facts)


def spectrum(case: Case, title: str, *, speed_ratio: float) -> Drawn:
    """Power spectral density of pitch (figures 5.2, 5.4)."""
    from aeroflutter.plots.timemarch import plot_response

    facts, response = _motion(case, speed_ratio, LATE)
    return Drawn(figure=plot_response(response, "psd", title), facts=facts)


def loop_path(case: Case, title: str) -> Drawn:
    """The spring's path on a limit cycle (the 'b' figures), from the middle of those of the map."""
    from aeroflutter.plots.timemarch import plot_response

    found = _map(case)
    columns, rows = np.nonzero(found.state == STATES.index("lco"))
    if columns.size == 0:
        ratio, alpha_deg = 0.95, 6.0
    else:
        middle = columns.size // 2
        ratio, alpha_deg = found.grid.x.values[columns[middle]], found.grid.y.values[rows[middle]]
    facts, response = _motion(case, float(ratio), LATE, alpha_deg=float(alpha_deg))
    return Drawn(figure=plot_response(response, "spring", title), facts=facts)


def _motion(
    case: Case, speed_ratio: float, duration: float, alpha_deg: float | None = None
) -> tuple[dict[str, Any], Response]:
    """How a run ends, and the same run for as long as is drawn."""
    speed = speed_ratio * _flutter(case)
    system = case.family().at(speed)
    motion = case.initial._asdict()
    if alpha_deg is not None:
        motion["alpha"] = np.radians(alpha_deg)
    start = Initial(**motion)
    end = simulate(system, case.spring, start, SimulateOptions(record=False))
    drawn = SimulateOptions(duration=duration, decide=False)
    facts: dict[str, Any] = {
        "speed_ratio": speed_ratio,
        "speed": speed,
        "alpha_deg": float(np.degrees(start.alpha)),
        "state": end.state,
        "engine": end.engine,
    }
    if end.state == "lco":
        facts |= {"amplitude_deg": float(np.degrees(end.amplitude)), "period": end.period}
    response = simulate(system, case.spring, start, drawn)
    return facts, replace(response, state=end.state, period=end.period)


def reversals(case: Case, title: str, *, turns_deg: Sequence[float]) -> Drawn:
    """Moment along a prescribed motion (figures 3.2, 3.4, 4.8, 4.9)."""
    from aeroflutter.plots.spring import plot_path

    turns = np.radians(turns_deg)
    at = np.linspace(0, turns.size - 1, 200 * (turns.size - 1) + 1)
    pitch = np.interp(at, np.arange(turns.size), turns)
    moment, _ = respond(case.spring, pitch)
    return Drawn(figure=plot_path(pitch, moment, title))


def locus(case: Case, title: str) -> Drawn:
    """Roots against airspeed (figure 4.10)."""
    from aeroflutter.plots.rootlocus import plot_root_locus

    found = root_locus(case.family())
    assert found.flutter is not None  # a built-in case
    facts = {"flutter_speed": found.flutter.speed, "k": found.flutter.k}
    return Drawn(figure=plot_root_locus(found, title), facts=facts)


def stiffness(case: Case, title: str) -> Drawn:
    """Flutter speed against pitch stiffness (figure 4.11)."""
    from aeroflutter.plots.rootlocus import plot_stiffness

    values = np.linspace(0.0, 1.5, 151)
    speeds, _ = flutter_against_stiffness(case.family(), values)
    facts = {"lowest_speed": float(np.nanmin(speeds)), "at": float(values[np.nanargmin(speeds)])}
    return Drawn(figure=plot_stiffness(values, speeds, title), facts=facts)


def gains(case: Case, title: str) -> Drawn:
    """Describing function against amplitude (figure 4.12)."""
    from aeroflutter.plots.spring import plot_gains

    amplitude = case.spring.scale * np.geomspace(0.05, 20.0, 400)
    return Drawn(figure=plot_gains(amplitude, case.spring.describing(amplitude, 0.0), title))


def decided(case: Case, title: str) -> Drawn:
    """Damped, limit cycle or divergent over airspeed and initial pitch (the 'a' figures)."""
    from aeroflutter.plots.maps import plot_map

    found = _map(case)
    counts: dict[str, Any] = {name: found.count(name) for name in STATES}
    onsets = _onsets(case)
    marks = {"linear flutter": 1.0, **onsets}
    if len(onsets) == 2 and abs(onsets["DF onset"] - onsets["exact onset"]) < 0.001:
        marks = {"linear flutter": 1.0, "onset, DF and exact": onsets["exact onset"]}
    return Drawn(figure=plot_map(found, title, marks), facts=counts | onsets)


def amplitudes(case: Case, title: str) -> Drawn:
    """Amplitude against airspeed by every method (the 'c' figures)."""
    from aeroflutter.plots.amplitudes import plot_amplitudes

    curve, found = _curve(case), _map(case)
    settled = found.state == STATES.index("lco")
    ratio = np.broadcast_to(found.grid.x.values[:, None], settled.shape)[settled]
    simulated = ratio, found.amplitude_deg[settled]
    facts: dict[str, Any] = {"simulated_cycles": int(settled.sum())}
    if settled.any():
        facts["first_simulated_cycle"] = float(ratio.min())
    return Drawn(
        figure=plot_amplitudes(curve, _cycles(case), simulated, title), facts=facts | _onsets(case)
    )


def _onsets(case: Case) -> dict[str, float]:
    """The lowest speed ratio of a cycle, by describing function and exactly."""
    found = {}
    approximate, exact = _curve(case).onset, _cycles(case).onset
    if approximate is not None:
        found["DF onset"] = approximate.speed_ratio
    if exact is not None:
        found["exact onset"] = exact.cycle.speed_ratio
    return found


def _flutter(case: Case) -> float:
    speed = flutter_speed(case.family())
    assert speed is not None  # every built-in case has one
    return speed


@functools.lru_cache(maxsize=2)
def _curve(case: Case) -> DescribingCurve:
    return describing_curve(case.family(), case.spring)


@functools.lru_cache(maxsize=2)
def _cycles(case: Case) -> LimitCycles:
    return limit_cycles(case.family(), case.spring)


@functools.lru_cache(maxsize=2)
def _map(case: Case) -> FlutterMap:
    """The map of a case, which its 'a' and 'c' figures share."""
    grid = Grid(Axis("speed_ratio", RATIOS), Axis("initial.alpha_deg", PITCHES_DEG))
    start = Initial(**{**case.initial._asdict(), "alpha": 0.0})
    return flutter_map(SpeedPitch(case.family(), case.spring, grid, _flutter(case), start))


def onsets(_: Case, title: str) -> Drawn:
    """Table 5.1: the thesis's two columns, the complex describing function, the exact onset."""
    from aeroflutter.reproduce.table import onset_table

    table, facts = onset_table(title)
    return Drawn(table=table, facts=facts)


KINDS: dict[str, Callable[..., Drawn]] = {
    "traces": traces,
    "spectrum": spectrum,
    "reversals": reversals,
    "locus": locus,
    "stiffness": stiffness,
    "gains": gains,
    "map": decided,
    "loop": loop_path,
    "amplitudes": amplitudes,
    "onsets": onsets,
}
"""What makes each kind of exhibit: `(case, title, **settings) -> Drawn`."""
