"""What a report shows, as one plain dictionary: gathered from the results, in degrees."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from aeroflutter.motion.response import STATES, Initial, SimulateOptions, simulate
from aeroflutter.report.analyses import period
from aeroflutter.report.motions import Motions, harmonic_motion, marched
from aeroflutter.springs import respond

if TYPE_CHECKING:
    from aeroflutter.orbits.cycles import CycleFamily
    from aeroflutter.orbits.harmonic import HarmonicBranch
    from aeroflutter.report.analyses import Analyses

__all__ = ["gather"]

Array = NDArray[np.float64]

POINTS = 60  # of a curve that are shown, each with its motion
MOST_CURVES = 8  # a method
ARRIVED = 1e-6  # of its first distance at which a motion counts as on its cycle
FIGURES = 7  # significant, of the numbers on the page


def gather(found: Analyses) -> dict[str, Any]:
    """All that the page shows, in JSON's types.

    Parameters
    ----------
    found : Analyses

    Returns
    -------
    dict
        title, case, facts, notes, section, axis, locus, spring, curves, events, map, motions.
    """
    motions = Motions()
    curves = [*_described(found, motions), *_balanced(found, motions), *_exact(found, motions)]
    page = {
        "title": found.case.title,
        "case": found.case.text,
        "facts": _facts(found),
        "notes": [*found.notes, *_unshown(found, curves)],
        "section": _section(found),
        "axis": _axis(found),
        "locus": _locus(found),
        "spring": _spring(found),
        "curves": [curve for curve, _ in curves],
        "events": [event for _, events in curves for event in events],
        "view": _view(found),
        "map": _map(found, motions),
        "motions": motions.coded(),
    }
    return {key: _plain(value) for key, value in page.items()}


def _plain(value: Any) -> Any:
    """The value in JSON's types: numbers to `FIGURES` digits, what is not finite as None."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, float):
        return float(f"{value:.{FIGURES}g}") if math.isfinite(value) else None
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value


def _axis(found: Analyses) -> dict[str, Any]:
    """What speeds are on this page."""
    if found.flutter is None:
        return {"key": "speed", "label": "airspeed U*", "unit": 1.0}
    return {"key": "speed_ratio", "label": "airspeed ratio U*/U*_L", "unit": found.flutter}


def _facts(found: Analyses) -> list[tuple[str, str]]:
    """What stands at the top: label and value."""
    flutter, divergence = found.locus.flutter, found.locus.divergence
    facts = [
        ("linear flutter speed U*_L", "none" if flutter is None else f"{flutter.speed:.6g}"),
        ("reduced frequency there", "-" if flutter is None else f"{flutter.k:.5g}"),
        ("divergence speed U*_D", "none" if divergence is None else f"{divergence:.5g}"),
    ]
    scale = found.case.section.scale
    if flutter is not None and scale is not None:
        hertz = scale.frequency_hz(flutter.k, flutter.speed)
        facts.append(("flutter", f"{scale.velocity(flutter.speed):.5g} m/s at {hertz:.4g} Hz"))
    for name, onset in _onsets(found):
        facts.append((f"lowest cycle, {name}", onset))
    return facts


def _onsets(found: Analyses) -> Iterable[tuple[str, str]]:
    """The lowest cycle of each method, in words."""
    curve, cycles = found.curve, found.cycles
    if curve is not None and curve.onset is not None:
        one = curve.onset
        yield "describing function", _cycle(found, one.speed, one.amplitude, one.kind)
    if found.branches:
        first = min((branch.onset for branch in found.branches), key=lambda o: o.cycle.speed)
        yield "harmonic balance", _cycle(found, first.cycle.speed, first.amplitude, first.kind)
    if cycles is not None and cycles.onset is not None:
        edge = cycles.onset.cycle
        yield "exact", _cycle(found, edge.speed, edge.amplitude, cycles.onset.kind)


def _cycle(found: Analyses, speed: float, amplitude: float, kind: str) -> str:
    return f"{speed / found.unit:.6g}, {math.degrees(amplitude):.4g}° ({kind})"


def _section(found: Analyses) -> dict[str, float | None]:
    section = found.case.section
    names = ("mu", "a_h", "x_alpha", "r_alpha", "omega_bar", "zeta_alpha", "zeta_xi")
    return {name: getattr(section, name) for name in names}


def _locus(found: Analyses) -> dict[str, Any]:
    """Roots mode by mode, the oscillating ones by frequency; a root on the real axis has none."""
    locus = found.locus
    imag = locus.roots.imag
    modes = [j for j in range(imag.shape[1]) if imag[:, j].max() > 1e-9]
    modes.sort(key=lambda j: float(np.median(imag[:, j] * locus.speeds)))
    size = np.maximum(np.abs(locus.roots), 1e-300)
    up = imag > 0
    return {
        "speeds": locus.speeds,
        "modes": [
            {
                "re": np.where(up[:, j], locus.roots[:, j].real, np.nan),
                "im": np.where(up[:, j], imag[:, j], np.nan),
                "frequency": np.where(up[:, j], imag[:, j] * locus.speeds, np.nan),
                "damping": np.where(up[:, j], -locus.roots[:, j].real / size[:, j], np.nan),
            }
            for j in modes
        ],
        "crossings": [
            {"speed": one.speed, "k": one.k, "growing": one.growing} for one in locus.crossings
        ],
        "flutter": found.flutter,
        "divergence": locus.divergence,
    }


def _spring(found: Analyses) -> dict[str, Any]:
    """The law under a pitch that swings between two limits well beyond it."""
    spring = found.case.spring
    low, high = np.array(spring.span())
    reach = 1.6 * max(0.5 * (high - low), 0.0) or abs(found.case.initial.alpha) or 0.1
    swing = 0.5 * (low + high) + reach * np.sin(np.linspace(0.0, 5.0 * np.pi, 1201))
    moment, _ = respond(spring, swing)
    last = slice(-482, None)
    return {"pitch": np.degrees(swing[last]), "moment": np.degrees(moment[last])}


def _thinned(m: int, extra: Iterable[int] = (), most: int = POINTS) -> list[int]:
    """Places of at most about `most` of m points, both ends and some others among them."""
    regular = np.linspace(0, m - 1, min(m, most)).round().astype(int)
    return sorted({*regular.tolist(), *extra})


Curves = list[tuple[dict[str, Any], list[dict[str, Any]]]]


def _described(found: Analyses, motions: Motions) -> Curves:
    """Curves of the describing function: sinusoids, with the band that is proved."""
    curve, family = found.curve, found.case.family()
    if curve is None:
        return []
    curves: Curves = []
    for one in curve.families[:MOST_CURVES]:
        mine = np.flatnonzero(curve.family == one.number)
        shown = mine[_thinned(mine.size, [int(np.argmin(curve.speed[mine]))])]
        first = len(motions.headers)
        for i in shown:
            Y = np.array([curve.bias[i], -1j * curve.amplitude[i]])
            system = family.at(float(curve.speed[i]))
            motions.add_periodic(*harmonic_motion(system, found.case.spring, Y, float(curve.k[i])))
        drawn = {
            "method": "df",
            "family": one.number,
            "x": curve.speed[shown] / found.unit,
            "amplitude": np.degrees(curve.amplitude[shown]),
            "bias": list(map(_rounded, *np.degrees((curve.bias[shown], curve.amplitude[shown])))),
            "period": 2.0 * np.pi / curve.k[shown],
            "stable": curve.stable[shown],
            "motion": first,
            **_proved(found, mine, shown),
        }
        curves.append((drawn, []))
    return curves


def _proved(found: Analyses, mine: NDArray[np.intp], shown: NDArray[np.intp]) -> dict[str, Any]:
    """The proved bands: limits of the points shown, and the outline along the whole family."""
    proof, curve = found.guaranteed, found.curve
    if proof is None or curve is None:
        return {"band": None, "outline": None}
    x: list[float] = []
    y: list[float] = []
    amplitude, speed = np.degrees(curve.amplitude[mine]), proof.speed[mine] / found.unit
    runs = np.split(np.arange(mine.size), np.flatnonzero(np.diff(proof.guaranteed[mine])) + 1)
    for run in runs:
        if run.size and proof.guaranteed[mine[run[0]]]:
            x += [*speed[run, 0], *speed[run[::-1], 1], speed[run[0], 0], math.nan]
            y += [*amplitude[run], *amplitude[run[::-1]], amplitude[run[0]], math.nan]
    return {"band": proof.speed[shown] / found.unit, "outline": {"x": x, "y": y}}


def _balanced(found: Analyses, motions: Motions) -> Curves:
    """Curves of the harmonic balance."""
    family = found.case.family()
    curves: Curves = []
    for branch in found.branches[:MOST_CURVES]:
        shown = _thinned(branch.speed.size, [int(np.argmin(branch.speed))])
        first = len(motions.headers)
        cycles = [branch.cycles[i] for i in shown]
        for cycle in [*cycles, *(event.cycle for event in branch.bifurcations)]:
            system = family.at(cycle.speed)
            motions.add_periodic(*harmonic_motion(system, found.case.spring, cycle.Y, cycle.omega))
        curve = {
            "method": "hb",
            "family": branch.family,
            "x": branch.speed[shown] / found.unit,
            "amplitude": np.degrees(branch.amplitude[shown]),
            "bias": list(map(_rounded, *np.degrees((branch.bias[shown], branch.amplitude[shown])))),
            "period": branch.period[shown],
            "stable": branch.stable[shown],
            "motion": first,
            "harmonics": branch.harmonics,
        }
        curves.append((curve, _balanced_events(found, branch, first + len(shown))))
    return curves


def _balanced_events(found: Analyses, branch: HarmonicBranch, first: int) -> list[dict[str, Any]]:
    """Bifurcations of a branch; exact ones, where there are any, take their place."""
    if found.cycles is not None and found.cycles.families:
        return []
    return [
        {
            "kind": event.kind,
            "method": "hb",
            "x": event.cycle.speed / found.unit,
            "amplitude": math.degrees(event.amplitude),
            "bias": math.degrees(_rounded(event.bias, event.amplitude)),
            "period": event.cycle.period,
            "motion": first + n,
        }
        for n, event in enumerate(branch.bifurcations)
    ]


def _exact(found: Analyses, motions: Motions) -> Curves:
    """Curves of the exact cycles."""
    if found.cycles is None:
        return []
    curves: Curves = []
    for family in found.cycles.families[:MOST_CURVES]:
        lowest = int(np.argmin([cycle.speed for cycle in family.cycles]))
        shown = [family.cycles[i] for i in _thinned(len(family.cycles), [lowest])]
        first = len(motions.headers)
        for cycle in [*shown, *(event.cycle for event in family.bifurcations)]:
            start = Initial(state=cycle.state, memory=cycle.memory)
            system = found.case.family().at(cycle.speed)
            motions.add_response(
                marched(system, found.case.spring, start, cycle.period, cycle.period)
            )
        curve = {
            "method": "exact",
            "family": family.number,
            "x": [cycle.speed / found.unit for cycle in shown],
            "amplitude": [math.degrees(cycle.amplitude) for cycle in shown],
            "bias": [math.degrees(_rounded(one.bias, one.amplitude)) for one in shown],
            "period": [cycle.period for cycle in shown],
            "stable": [cycle.stable for cycle in shown],
            "motion": first,
        }
        curves.append((curve, _exact_events(found, family, first + len(shown))))
    return curves


def _exact_events(found: Analyses, family: CycleFamily, first: int) -> list[dict[str, Any]]:
    return [
        {
            "kind": event.kind,
            "method": "exact",
            "x": event.cycle.speed / found.unit,
            "amplitude": math.degrees(event.cycle.amplitude),
            "bias": math.degrees(_rounded(event.cycle.bias, event.cycle.amplitude)),
            "period": event.cycle.period,
            "motion": first + n,
        }
        for n, event in enumerate(family.bifurcations)
    ]


def _unshown(found: Analyses, curves: Sequence[Any]) -> Iterator[str]:
    """What a reader would miss in the figure of the curves."""
    if not curves:
        yield "No method found a limit cycle."
    families = {
        "describing function": found.curve.families if found.curve else (),
        "harmonic balance": found.branches,
        "exact": found.cycles.families if found.cycles else (),
    }
    for name, every in families.items():
        if len(every) > MOST_CURVES:
            yield (
                f"Of {len(every)} families ({name}) the first {MOST_CURVES} are shown; "
                "the commands df, hb and lco give all."
            )


def _rounded(bias: float, amplitude: float) -> float:
    """A bias without its round-off."""
    return 0.0 if abs(bias) < 1e-9 * abs(amplitude) else bias


def _view(found: Analyses) -> dict[str, Any]:
    """Limits of the amplitude figure: far out every branch runs along its asymptote."""
    points = [
        *_points(found.curve, found.unit),
        *((b.speed / found.unit, np.degrees(b.amplitude)) for b in found.branches),
        *_exact_points(found),
    ]
    if not points:
        return {"x": None, "y": None}
    x, y = (np.concatenate(part) for part in zip(*points, strict=True))
    low = float(x.min())
    high = (
        float(x.max())
        if found.flutter is None
        else (1.0 + 0.25 * (1.0 - low) if low < 0.98 else max(1.5, 1.25 * low))
    )
    pad = 0.12 * (high - low)
    inside = (x >= low) & (x <= high)
    size = float(y[inside][np.argmin(x[inside])])
    top = float(y[inside].max())
    if size > 0.05 * math.degrees(found.case.spring.scale):
        top = min(top, 12.0 * size)
    return {"x": [low - pad, high], "y": [0.0, 1.05 * top]}


def _points(curve: Any, unit: float) -> Sequence[tuple[Array, Array]]:
    if curve is None or not curve.amplitude.size:
        return []
    return [(curve.speed / unit, np.degrees(curve.amplitude))]


def _exact_points(found: Analyses) -> Sequence[tuple[Array, Array]]:
    cycles = found.cycles.cycles if found.cycles else ()
    if not cycles:
        return []
    x, y = np.array([(cycle.speed, cycle.amplitude) for cycle in cycles]).T
    return [(x / found.unit, np.degrees(y))]


def _map(found: Analyses, motions: Motions) -> dict[str, Any]:
    """The cells, the motion from every one of them, and the cycle in which it ends."""
    cells, case = found.map, found.case
    grid = cells.grid
    reference = found.unit if grid.x.key == "speed_ratio" else 1.0
    first = len(motions.headers)
    settled: dict[tuple[int, int], int] = {}
    for i, x in enumerate(grid.x.values):
        speed = float(x) * reference
        system, unit = case.family().at(speed), period(found.locus, speed)
        for j, y in enumerate(grid.y.values):
            start = Initial(**{**case.initial._asdict(), "alpha": math.radians(y)})
            response = marched(system, case.spring, start, unit, found.options.periods * unit)
            motions.add_response(response, divergent=cells.state[i, j] == STATES.index("divergent"))
    ends = np.full(cells.state.shape, -1)
    for i, j in zip(*np.nonzero(cells.state == STATES.index("lco")), strict=True):
        key = int(i), int(cells.attractor[i, j])
        if key not in settled:
            settled[key] = _settled(found, motions, int(i), int(j), reference)
        ends[i, j] = settled[key]
    return {
        "x": {"key": grid.x.key, "values": grid.x.values, "scale": reference / found.unit},
        "y": {"label": "initial pitch (deg)", "values": grid.y.values},
        "states": STATES,
        "state": cells.state,
        "amplitude": cells.amplitude_deg,
        "bias": cells.bias_deg,
        "period": cells.period,
        "rest": cells.rest_deg,
        "decided": cells.decided_at,
        "motion": first,
        "settled": ends,
        "counts": {name: cells.count(name) for name in (*STATES, "failed")},
    }


def _settled(found: Analyses, motions: Motions, i: int, j: int, reference: float) -> int:
    """One period of the cycle in which a cell ends."""
    grid, case = found.map.grid, found.case
    system = case.family().at(float(grid.x.values[i]) * reference)
    start = Initial(**{**case.initial._asdict(), "alpha": math.radians(grid.y.values[j])})
    end = simulate(system, case.spring, start, SimulateOptions(record=False))
    near = Initial(state=end.final_state, memory=end.final_memory)
    # The end is certain long before it is reached: march on until it is.
    rate = float(np.clip(abs(end.extras.get("multiplier", 0.0)), 1e-3, 1.0 - 1e-3))
    more = end.period * np.ceil(np.log(ARRIVED) / np.log(rate))
    there = simulate(
        system, case.spring, near, SimulateOptions(record=False, decide=False, duration=more)
    )
    on_cycle = Initial(state=there.final_state, memory=there.final_memory)
    return motions.add_response(marched(system, case.spring, on_cycle, end.period, end.period))
