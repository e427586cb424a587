"""What a report shows, as one plain dictionary: gathered from the results, in its case's unit."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from itertools import chain
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeroflutter.motion.response import Initial, SimulateOptions, simulate
from aeroflutter.report.analyses import period
from aeroflutter.report.motions import Motions, beside, harmonic_motion, marched
from aeroflutter.results import fields_of
from aeroflutter.results.proofs import free_words
from aeroflutter.results.studies import spoken
from aeroflutter.results.unit import spoken_unit, start_unit, told, told_of
from aeroflutter.springs import respond
from aeroflutter.verdicts import STATES

if TYPE_CHECKING:
    from aeroflutter.model.section import Scale
    from aeroflutter.orbits.cycles import Cycle
    from aeroflutter.report.analyses import Analyses
    from aeroflutter.results.unit import Unit
    from aeroflutter.studies.maps import FlutterMap, Grid

__all__ = ["gather"]

Array = NDArray[np.float64]

POINTS = 60  # of a curve that are shown, each with its motion
MOST_CURVES = 8  # a method
ARRIVED = 1e-6  # of its first distance at which a motion counts as on its cycle
SUPERCRITICAL = 1e-3  # nearer to flutter than this a branch starts there, and goes up from it
DEEPEST = 100.0  # of the largest amplitude in view to the smallest, on a logarithmic axis
CROWDED = 0.6  # of the points in the lowest quarter of the figure
FIGURES = 7  # significant, of the numbers on the page


def gather(found: Analyses) -> dict[str, Any]:
    """All that the page shows, in JSON's types.

    Parameters
    ----------
    found : Analyses

    Returns
    -------
    dict
        title, case, facts, notes, section, axis, told, beside, free, locus, spring, curves,
        events, map, motions.
    """
    with told_of(found.case):
        return _gathered(found)


def _gathered(found: Analyses) -> dict[str, Any]:
    model = found.case.model()
    motions = Motions(beside=beside(model))
    by_method = (_described(found, motions), _balanced(found, motions), _exact(found, motions))
    curves = [_drawn(found, one, motions) for one in chain(*by_method)]
    page = {
        "title": found.case.title,
        "case": found.case.text,
        "facts": _facts(found),
        "notes": [*found.notes, *_unshown(found, curves)],
        "section": _section(found),
        "axis": _axis(found),
        "free": _free(found),
        "locus": _locus(found),
        "spring": _spring(found),
        "curves": [curve for curve, _ in curves],
        "events": [event for _, events in curves for event in events],
        "view": _view(found),
        "coordinate": model.names[0],
        "told": _unit(spoken_unit()),
        "beside": None if motions.beside is None else motions.beside._asdict(),
        "map": None if found.map is None else _map(found, found.map, motions),
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


def _unit(unit: Unit) -> dict[str, str]:
    """How the page writes numbers in a unit, and what a spring of it does."""
    return {"unit": unit.name, "mark": unit.mark, "effort": unit.effort}


def _size(fields: dict[str, Any], name: str) -> Any:
    """A number of a record that is in the unit which is told."""
    return fields[name + spoken_unit().suffix]


def _axis(found: Analyses) -> dict[str, Any]:
    """What speeds are on this page."""
    flutter = {} if found.flutter is None else {"flutter": found.flutter / found.unit}
    if found.case.scale is not None:
        flutter |= _clock(found.case.scale)
        return {"key": "velocity", "label": "airspeed V (m/s)", "unit": found.unit, **flutter}
    if found.flutter is None:
        return {"key": "speed", "label": "airspeed U*", "unit": 1.0}
    return {
        "key": "speed_ratio", "label": "airspeed ratio U*/U*_L", "unit": found.unit, **flutter,
    }  # fmt: skip


def _clock(scale: Scale) -> dict[str, float]:
    """What turns a page's times into seconds: b/V of tau, or nothing where they are seconds."""
    one, two = scale.seconds(1.0, 1.0), scale.seconds(1.0, 2.0)
    if not math.isfinite(one):
        return {}
    return {"semichord": scale.b} if one != two else {"seconds": 1.0}


def _free(found: Analyses) -> dict[str, Any] | None:
    """The airspeeds at which nothing can oscillate, in units of the page."""
    free = found.free
    if free is None:
        return None
    return {
        "low": free.low / found.unit,
        "high": free.high / found.unit,
        "certified": free.certified,
    }


def _facts(found: Analyses) -> list[tuple[str, str]]:
    """What stands at the top: label and value."""
    flutter, divergence = found.locus.flutter, found.locus.divergence
    scale, imported = found.case.scale, found.case.imported is not None
    facts: list[tuple[str, str]] = []
    if not imported:
        facts = [
            ("linear flutter speed U*_L", "none" if flutter is None else f"{flutter.speed:.6g}"),
            ("reduced frequency there", "-" if flutter is None else f"{flutter.k:.5g}"),
            ("divergence speed U*_D", "none" if divergence is None else f"{divergence:.5g}"),
        ]
    if scale is not None:
        if flutter is not None:
            hertz = scale.frequency_hz(flutter.k, flutter.speed)
            facts.append(("flutter", f"{scale.velocity(flutter.speed):.5g} m/s at {hertz:.4g} Hz"))
        if divergence is not None:
            facts.append(("divergence", f"{scale.velocity(divergence):.5g} m/s"))
    if found.free is not None:
        facts.append(("nothing oscillates", free_words(found.free, found.flutter, scale)))
    for name, onset in _onsets(found):
        facts.append((f"lowest cycle, {name}", onset))
    return facts


def _onsets(found: Analyses) -> Iterable[tuple[str, str]]:
    """The lowest cycle of each method, in words."""
    for name, result in _results(found).items():
        one = fields_of(result)["onset"]
        if one is not None:
            metres = "" if found.case.scale is None else " m/s"
            size = f"{_size(one, 'amplitude'):.4g}{spoken_unit().mark}"
            where = f"{one['speed'] / found.unit:.6g}{metres}, {size}"
            yield name, f"{where} ({one['kind']})"


def _results(found: Analyses) -> dict[str, Any]:
    """What the methods found of limit cycles."""
    results = {
        "describing function": found.curve,
        "harmonic balance": found.branches or None,
        "exact": found.cycles,
    }
    return {name: result for name, result in results.items() if result is not None}


def _section(found: Analyses) -> dict[str, float | None]:
    if found.case.imported is not None:
        return {"states": float(len(found.case.model().state_names))}
    section = found.case.section
    names = ("mu", "a_h", "x_alpha", "r_alpha", "omega_bar", "zeta_alpha", "zeta_xi")
    flap = {} if section.flap is None else vars(section.flap)
    supports = {} if section.heave_mass == 1.0 else {"heave_mass": section.heave_mass}
    return {name: getattr(section, name) for name in names} | supports | flap


def _locus(found: Analyses) -> dict[str, Any]:
    """Roots mode by mode, the oscillating ones by frequency; a root on the real axis has none."""
    locus = found.locus
    imag = locus.roots.imag
    modes = [j for j in range(imag.shape[1]) if imag[:, j].max() > 1e-9]
    modes.sort(key=lambda j: float(np.median(imag[:, j] * locus.speeds)))
    size = np.maximum(np.abs(locus.roots), 1e-300)
    up, scale = imag > 0, found.case.scale
    speed, frequency = 1.0, imag * locus.speeds[:, None]
    if scale is not None:
        speed = scale.velocity(1.0)
        frequency = np.asarray(scale.frequency_hz(imag, locus.speeds[:, None]))  # type: ignore[arg-type]
    crossings = [{**one, "speed": speed * one["speed"]} for one in fields_of(locus)["crossings"]]
    return {
        "speeds": speed * locus.speeds,
        "speed": "airspeed U*" if scale is None else "airspeed V (m/s)",
        "frequency": "frequency ω/ω_α" if scale is None else "frequency (Hz)",
        "modes": [
            {
                "re": np.where(up[:, j], locus.roots[:, j].real, np.nan),
                "im": np.where(up[:, j], imag[:, j], np.nan),
                "frequency": np.where(up[:, j], frequency[:, j], np.nan),
                "damping": np.where(up[:, j], -locus.roots[:, j].real / size[:, j], np.nan),
            }
            for j in modes
        ],
        "crossings": crossings,
        "flutter": None if found.flutter is None else speed * found.flutter,
        "divergence": None if locus.divergence is None else speed * locus.divergence,
    }


def _spring(found: Analyses) -> dict[str, Any]:
    """The law under a motion that swings between two limits well beyond it."""
    spring = found.case.spring
    low, high = np.array(spring.span())
    reach = 1.6 * max(0.5 * (high - low), 0.0) or abs(found.case.initial.alpha) or 0.1
    swing = 0.5 * (low + high) + reach * np.sin(np.linspace(0.0, 5.0 * np.pi, 1201))
    moment, _ = respond(spring, swing)
    last = slice(-482, None)
    return {"pitch": told(swing[last]), "moment": told(moment[last])}


def _thinned(m: int, extra: Iterable[int] = (), most: int = POINTS) -> list[int]:
    """Places of at most about `most` of m points, both ends and some others among them."""
    regular = np.linspace(0, m - 1, min(m, most)).round().astype(int)
    return sorted({*regular.tolist(), *extra})


class _Curve(NamedTuple):
    """A family of cycles by one method: its points and bifurcations as files write them."""

    method: str
    family: int
    points: list[dict[str, Any]]
    events: list[dict[str, Any]]
    motions: Sequence[Callable[[], object]]  # each adds the motion of a point, or of an event
    more: Callable[[list[int]], dict[str, Any]] = lambda shown: {}


def _drawn(found: Analyses, one: _Curve, added: Motions) -> tuple[dict[str, Any], list[Any]]:
    """A curve as the page draws it, and its bifurcations."""
    lowest = int(np.argmin([point["speed"] for point in one.points]))
    shown = _thinned(len(one.points), [lowest])
    first, count = len(added.headers), len(one.points)
    for i in [*shown, *range(count, count + len(one.events))]:
        one.motions[i]()
    points = [_place(found, one.points[i]) for i in shown]
    curve = {
        "method": one.method,
        "family": one.family,
        **{name: [point[name] for point in points] for name in points[0]},
        "stable": [one.points[i]["stable"] for i in shown],
        "motion": first,
        **one.more(shown),
    }
    events = [
        {"kind": event["kind"], "method": one.method, **_place(found, event), "motion": n}
        for n, event in enumerate(one.events, first + len(shown))
    ]
    return curve, events


def _place(found: Analyses, point: dict[str, Any]) -> dict[str, float]:
    """Where a cycle is drawn, its bias without round-off."""
    bias, amplitude = _size(point, "bias"), _size(point, "amplitude")
    return {
        "x": point["speed"] / found.unit,
        "amplitude": amplitude,
        "bias": 0.0 if abs(bias) < 1e-9 * abs(amplitude) else bias,
        "period": point.get("period", 2.0 * math.pi / point.get("k", math.nan)),
    }


def _described(found: Analyses, added: Motions) -> Iterator[_Curve]:
    """Curves of the describing function: sinusoids, with the band that is proved."""
    curve = found.curve
    if curve is None:
        return
    points = fields_of(curve)["branch"]

    several = isinstance(found.loop[1], Sequence)

    def add(i: int, Y: Any = None) -> None:
        Y = np.array([curve.bias[i], -1j * curve.amplitude[i]]) if Y is None else Y
        _add_harmonic(found, added, float(curve.speed[i]), Y, float(curve.k[i]))

    for one in curve.families[:MOST_CURVES]:
        mine = np.flatnonzero(curve.family == one.number)
        places = mine.tolist()
        known = [cycle.motions for cycle in one.cycles] if several else [None] * len(places)
        yield _Curve(
            "df",
            one.number,
            [points[i] for i in places],
            [],
            [partial(add, i, Y) for i, Y in zip(places, known, strict=True)],
            lambda shown, mine=mine: _proved(found, mine, mine[shown]),  # type: ignore[misc]
        )


def _balanced(found: Analyses, added: Motions) -> Iterator[_Curve]:
    """Curves of the harmonic balance; exact bifurcations, if there are any, stand for its own."""
    exact = found.cycles is not None and found.cycles.families
    for branch in found.branches[:MOST_CURVES]:
        fields, located = fields_of(branch), () if exact else branch.bifurcations
        cycles = [*branch.cycles, *(event.cycle for event in located)]
        yield _Curve(
            "hb",
            branch.family,
            fields["branch"],
            [
                {**event, "period": one.cycle.period}
                for event, one in zip(fields["bifurcations"], located, strict=False)
            ],
            [
                partial(_add_harmonic, found, added, one.speed, one.motions, one.omega)
                for one in cycles
            ],
            lambda shown, top=branch.harmonics: {"harmonics": top},  # type: ignore[misc]
        )


def _exact(found: Analyses, added: Motions) -> Iterator[_Curve]:
    """Curves of the exact cycles."""
    if found.cycles is None:
        return
    fields = fields_of(found.cycles)

    def add(cycle: Cycle) -> None:
        start = Initial(state=cycle.state, memory=cycle.memory)
        family, spring = found.loop
        period = cycle.period
        added.add_response(marched(family.at(cycle.speed), spring, start, period, period))

    for family in found.cycles.families[:MOST_CURVES]:
        cycles = [*family.cycles, *(event.cycle for event in family.bifurcations)]
        number = family.number
        points, events = (
            [one for one in fields[name] if one["family"] == number]
            for name in ("branch", "bifurcations")
        )
        yield _Curve("exact", number, points, events, [partial(add, cycle) for cycle in cycles])


def _add_harmonic(found: Analyses, added: Motions, speed: float, Y: Any, omega: float) -> None:
    """Add one period of a motion that is given by its harmonics."""
    family, spring = found.loop
    added.add_periodic(*harmonic_motion(family.at(speed), spring, Y, omega, added.beside))


def _proved(found: Analyses, mine: NDArray[np.intp], shown: NDArray[np.intp]) -> dict[str, Any]:
    """The proved bands: limits of the points shown, and the outline along the whole family."""
    proof, curve = found.guaranteed, found.curve
    if proof is None or curve is None:
        return {"band": None, "outline": None}
    x: list[float] = []
    y: list[float] = []
    amplitude, speed = told(curve.amplitude[mine]), proof.speed[mine] / found.unit
    runs = np.split(np.arange(mine.size), np.flatnonzero(np.diff(proof.guaranteed[mine])) + 1)
    for run in runs:
        if run.size and proof.guaranteed[mine[run[0]]]:
            x += [*speed[run, 0], *speed[run[::-1], 1], speed[run[0], 0], math.nan]
            y += [*amplitude[run], *amplitude[run[::-1]], amplitude[run[0]], math.nan]
    return {"band": proof.speed[shown] / found.unit, "outline": {"x": x, "y": y}}


def _unshown(found: Analyses, curves: Sequence[Any]) -> Iterator[str]:
    """What a reader would miss in the figure of the curves."""
    if not curves:
        yield "No method found a limit cycle."
    for name, result in _results(found).items():
        every = result if isinstance(result, tuple) else result.families
        if len(every) > MOST_CURVES:
            yield (
                f"Of {len(every)} families ({name}) the first {MOST_CURVES} are shown; "
                "the commands df, hb and lco give all."
            )


def _view(found: Analyses) -> dict[str, Any]:
    """Limits of the amplitude figure: far out every branch runs along its asymptote."""
    points = [one for result in _results(found).values() for one in fields_of(result)["branch"]]
    if not points:
        return {"x": None, "y": None, "log": False}
    x = np.array([one["speed"] for one in points]) / found.unit
    y = np.array([_size(one, "amplitude") for one in points])
    low = float(x.min())
    flutter = (found.flutter or 0.0) / found.unit
    high = float(x.max())
    if found.flutter is not None and low < (1.0 - SUPERCRITICAL) * flutter:
        high = flutter + 0.25 * (flutter - low)
    elif found.flutter is not None:
        high = min(high, max(1.5 * flutter, 1.25 * low))
    pad = 0.12 * (high - low)
    inside = (x >= low) & (x <= high)
    size = float(y[inside][np.argmin(x[inside])])
    top = float(y[inside].max())
    if size > 0.05 * told(found.case.spring.scale):
        top = min(top, 12.0 * size)
    shown = y[inside & (y <= top) & (y > 0.0)]
    least = max(float(shown.min(initial=top)), top / DEEPEST)
    crowded = (shown < 0.25 * top).mean() > CROWDED and least < 0.1 * top
    if crowded:
        return {"x": [low - pad, high], "y": [0.75 * least, 1.3 * top], "log": True}
    return {"x": [low - pad, high], "y": [0.0, 1.05 * top], "log": False}


def _map(found: Analyses, cells: FlutterMap, motions: Motions) -> dict[str, Any]:
    """The cells, the motion from every one of them, and the cycle in which it ends."""
    case = found.case
    grid, (family, spring) = cells.grid, found.loop
    reference = (found.flutter or 1.0) if grid.x.key == "speed_ratio" else 1.0
    first = len(motions.headers)
    settled: dict[tuple[int, int], int] = {}
    for i, x in enumerate(grid.x.values):
        speed = float(x) * reference
        system, unit = family.at(speed), period(found.locus, speed)
        for j, y in enumerate(grid.y.values):
            start = Initial(**case.displaced(y / start_unit().factor)._asdict())
            response = marched(system, spring, start, unit, found.options.periods * unit)
            motions.add_response(response, divergent=cells.state[i, j] == STATES.index("divergent"))
    ends = np.full(cells.state.shape, -1)
    for i, j in zip(*np.nonzero(cells.state == STATES.index("lco")), strict=True):
        key = int(i), int(cells.attractor[i, j])
        if key not in settled:
            settled[key] = _settled(found, grid, motions, key[0], int(j), reference)
        ends[i, j] = settled[key]
    return {
        "x": {"key": grid.x.key, "values": grid.x.values, "scale": reference / found.unit},
        "y": {
            "name": "pitch" if case.imported is None else case.model().names[0],
            **_unit(start_unit()),
            "values": grid.y.values,
        },
        "states": STATES,
        "state": cells.state,
        "amplitude": spoken("amplitude_deg", cells.amplitude_deg),
        "bias": spoken("bias_deg", cells.bias_deg),
        "period": cells.period,
        "rest": spoken("rest_deg", cells.rest_deg),
        "decided": cells.decided_at,
        "motion": first,
        "settled": ends,
        "counts": {name: cells.count(name) for name in (*STATES, "failed")},
    }


def _settled(
    found: Analyses, grid: Grid, motions: Motions, i: int, j: int, reference: float
) -> int:
    """One period of the cycle in which a cell ends."""
    case = found.case
    family, spring = found.loop
    system = family.at(float(grid.x.values[i]) * reference)
    start = Initial(**case.displaced(grid.y.values[j] / start_unit().factor)._asdict())
    end = simulate(system, spring, start, SimulateOptions(record=False))
    near = Initial(state=end.final_state, memory=end.final_memory)
    # The end is certain long before it is reached: march on until it is.
    rate = float(np.clip(abs(end.extras.get("multiplier", 0.0)), 1e-3, 1.0 - 1e-3))
    more = end.period * np.ceil(np.log(ARRIVED) / np.log(rate))
    there = simulate(
        system, spring, near, SimulateOptions(record=False, decide=False, duration=more)
    )
    on_cycle = Initial(state=there.final_state, memory=there.final_memory)
    return motions.add_response(marched(system, spring, on_cycle, end.period, end.period))
