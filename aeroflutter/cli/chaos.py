"""`aeroflutter chaos`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from aeroflutter.cli.airspeed import EXACTLY_ONE, Airspeeds
from aeroflutter.cli.common import (
    CaseName,
    CaseOptions,
    Output,
    initial_motion,
    numbers,
    say,
    show_facts,
    show_table,
)
from aeroflutter.cli.progress import late_bar
from aeroflutter.errors import InputError
from aeroflutter.results.unit import spoken_unit, start_unit, told

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from aeroflutter.case import Case
    from aeroflutter.model.lure import AnySystem
    from aeroflutter.model.section import Scale
    from aeroflutter.motion.chaos import Band, ChaosOptions, ChaosResult, ChaosScan, Edge
    from aeroflutter.motion.response import Initial

HALVINGS = 10


def chaos(
    case: CaseName,
    *,
    airspeeds: Airspeeds = Airspeeds(),
    alpha_deg: Annotated[
        float | None, Parameter(help="Initial pitch in degrees; the case's own by default.")
    ] = None,
    zeta_alpha: Annotated[
        str | None,
        Parameter(help="Structural damping in pitch, Z or A:B:N, at the one speed given."),
    ] = None,
    zeta_xi: Annotated[
        str | None,
        Parameter(help="The same in heave; as many values as --zeta-alpha, or one."),
    ] = None,
    follow: Annotated[
        bool,
        Parameter(
            negative=(),
            show_default=False,
            help="In a scan, start each motion where the one before ended.",
        ),
    ] = False,
    edges: Annotated[
        bool,
        Parameter(
            negative=(),
            show_default=False,
            help="After a scan, halve the gaps at the edges of chaotic bands ten times.",
        ),
    ] = False,
    cycles: Annotated[
        int | None,
        Parameter(help="Oscillations measured (default 20000)."),
    ] = None,
    transient: Annotated[int, Parameter(help="Oscillations left out before.")] = 500,
    exponents: Annotated[int, Parameter(help="Lyapunov exponents, largest first.")] = 3,
    options: CaseOptions = CaseOptions(),
    output: Output = Output(),
) -> None:
    """Say whether the motion is periodic, quasi-periodic or chaotic, by its Lyapunov exponents.

    Give --speed-ratio, --speed or --velocity. A range of speeds, or of damping at one speed,
    gives the peaks of pitch and the exponents against it, and the bands of chaos.
    """
    from aeroflutter.motion.chaos import ChaosOptions

    output.check()
    if follow and edges:
        raise InputError("--edges: excludes --follow; edges are sought from the initial motion")
    loaded = options.load(case)
    scale = output.begin(loaded, "chaos")
    study = _Study.of(loaded, airspeeds, (zeta_alpha, zeta_xi), alpha_deg, scale)
    settings = ChaosOptions(cycles=cycles, transient=transient, exponents=exponents)
    if study.values.size == 1:
        _one(study, settings, output)
    else:
        _scan(study, settings, follow, edges, output)


@dataclass(frozen=True)
class _Study:
    """What is asked for: a case over speeds, or over damping at one speed."""

    case: Case
    start: Initial
    flutter: float | None
    speeds: NDArray[np.float64]
    damping: tuple[tuple[str, NDArray[np.float64]], ...]
    scale: Scale | None = None

    @classmethod
    def of(
        cls,
        case: Case,
        airspeeds: Airspeeds,
        zetas: tuple[str | None, str | None],
        alpha_deg: float | None,
        scale: Scale | None,
    ) -> _Study:
        """Check what was given together."""
        from aeroflutter.linear.rootlocus import flutter_speed

        speeds = airspeeds.speeds(case, EXACTLY_ONE)
        assert speeds is not None  # or it is refused
        flutter = flutter_speed(case.loop()[0])
        given = tuple(zip(("zeta_alpha", "zeta_xi"), zetas, strict=True))
        damping = tuple(
            (name, numbers("--" + name.replace("_", "-"), text))
            for name, text in given
            if text is not None
        )
        sizes = {values.size for _, values in damping} - {1}
        if len(sizes) > 1:
            raise InputError("--zeta-alpha, --zeta-xi: give as many values of one as of the other")
        if sizes and speeds.size > 1:
            raise InputError("--zeta-alpha, --zeta-xi: a range needs a single speed")
        return cls(case, initial_motion(case, alpha_deg), flutter, speeds, damping, scale)

    @property
    def varied(self) -> str:
        """The parameter of a scan."""
        names = [name for name, values in self.damping if values.size > 1]
        return names[0] if names else "speed_ratio" if self.flutter else "speed"

    @property
    def values(self) -> NDArray[np.float64]:
        """Its values."""
        if self.varied == "speed_ratio" and self.flutter:
            return self.speeds / self.flutter
        return dict(self.damping).get(self.varied, self.speeds)

    def case_at(self, value: float) -> Case:
        """The case with its damping at a value of the parameter."""
        case = self.case
        for name, values in self.damping:
            share = values[-1] if values.size == 1 else self._beside(values, value)
            case = case.replace(f"section.{name}", float(share))
        return case

    def _beside(self, values: NDArray[np.float64], value: float) -> float:
        """The value of one damping that goes with that of the parameter."""
        import numpy as np

        order = np.argsort(self.values)
        return float(np.interp(value, self.values[order], values[order]))

    def speed_at(self, value: float) -> float:
        """U* at a value of the parameter."""
        if self.speeds.size == 1:
            return float(self.speeds[0])
        return value * self.flutter if self.varied == "speed_ratio" and self.flutter else value

    def system(self, value: float) -> AnySystem:
        """The section at a value of the parameter."""
        return self.case_at(value).loop()[0].at(self.speed_at(value))

    def known(self) -> dict[str, Any]:
        """What is the same at every value."""
        return {"flutter_speed": self.flutter, "alpha_deg": self.start.alpha * start_unit().factor}

    def facts(self, value: float) -> dict[str, Any]:
        """Speed, its ratio and the damping at a value."""
        case = self.case_at(value)
        section = case.section if case.imported is None else None
        speed = self.speed_at(value)
        scale = self.case.scale
        si = {} if scale is None else {"velocity_m_s": scale.velocity(speed)}
        return {
            "speed": speed,
            **si,
            "speed_ratio": speed / self.flutter if self.flutter else None,
            "zeta_alpha": section and section.zeta_alpha,
            "zeta_xi": section and section.zeta_xi,
        }


def _one(study: _Study, settings: ChaosOptions, output: Output) -> None:
    from aeroflutter.motion.chaos import chaos as analyse

    value = float(study.values[0])
    system, spring = study.system(value), study.case.loop()[1]
    with late_bar("following the motion") as tick:
        result = analyse(system, spring, study.start, settings, tick)
    facts = {**study.known(), **study.facts(value)}
    output.result(
        study.case,
        lambda: result,
        text=lambda: _show(study, facts, result),
        facts=facts,
        figure=lambda: _figure(study, value, system, result),
        command="chaos",
    )


def _show(study: _Study, facts: dict[str, Any], result: ChaosResult) -> None:
    """Print one motion for people."""
    from aeroflutter.results import fields_of

    found = facts | fields_of(result)
    if study.scale is None:
        found.pop("velocity_m_s", None)
    else:  # a motion holds no speed of its own
        found |= _in_si(result, study.scale, facts["speed"])
    say(study.case.title)
    lists = ("lyapunov", "lyapunov_error", "statistical_error", "drift")
    hidden = (*lists, "name", "verdict", "peaks" + spoken_unit().suffix)
    show_facts({"verdict": found["name"]} | {k: one for k, one in found.items() if k not in hidden})
    rows = zip(*(list(found[name]) for name in lists), strict=True)
    show_table(
        ("exponent", "per unit tau", "error", "statistical", "drift"),
        [(i, *map(float, row)) for i, row in enumerate(rows, 1)],
    )


def _in_si(result: ChaosResult, scale: Scale, speed: float) -> dict[str, Any]:
    """Times and rates of a motion in s and 1/s."""
    second = scale.seconds(1.0, speed)
    return {
        "period_s": result.period * second,
        "return_time_s": result.return_time * second,
        "largest_lyapunov_per_s": float(result.exponents.values[0]) / second,
    }


def _scan(study: _Study, settings: ChaosOptions, follow: bool, edges: bool, output: Output) -> None:
    from aeroflutter.motion.chaos import chaos_scan
    from aeroflutter.results import fields_of, to_dataset

    with late_bar("scanning") as tick:
        scan = chaos_scan(
            study.system, study.values, study.case.loop()[1], study.start, settings,
            follow=follow, progress=tick,
        )  # fmt: skip
        bands = [_band(study, band, settings, edges) for band in scan.bands]
    points = fields_of(scan, study.case)["points"]
    at = [study.facts(float(value)) for value in scan.values]
    output.deliver(
        {
            "title": study.case.title,
            **study.known(),
            "parameter": study.varied,
            "points": [
                facts | point | _rates(study, result, facts["speed"])
                for facts, point, result in zip(at, points, scan.results, strict=True)
            ],
            "bands": [band | _edges_in_metres(study, band) for band in bands],
        },
        text=lambda: _show_scan(study, scan, bands),
        dataset=lambda: _with_velocities(
            study, to_dataset(scan, case=study.case).rename({"value": study.varied}), scan
        ),
        figure=lambda: _scan_figure(study, scan),
        command="chaos",
    )


def _rates(study: _Study, result: ChaosResult, speed: float) -> dict[str, Any]:
    """Times and rates in s, where the case has SI data."""
    scale = study.case.scale
    return {} if scale is None else _in_si(result, scale, speed)


def _velocity(study: _Study) -> float | None:
    """m/s of one unit of what is scanned; None if that is no airspeed, or there are no SI data."""
    scale = study.case.scale
    if scale is None or study.varied not in ("speed", "speed_ratio"):
        return None
    return scale.velocity(study.speed_at(1.0))


def _edges_in_metres(study: _Study, band: dict[str, Any]) -> dict[str, Any]:
    """The ends of a band in m/s beside those in the unit of the scan."""
    metres = _velocity(study)
    if metres is None:
        return {}
    edges = {name: band[name] for name in ("lower_edge", "upper_edge")}
    return {f"{name}_m_s": edge and [metres * one for one in edge] for name, edge in edges.items()}


def _with_velocities(study: _Study, dataset: xr.Dataset, scan: ChaosScan) -> xr.Dataset:
    """The Dataset with m/s beside the airspeeds and exponents per second."""
    import numpy as np

    scale = study.case.scale
    if scale is None:
        return dataset
    speeds = np.array([study.speed_at(float(value)) for value in scan.values])
    seconds = np.array([scale.seconds(1.0, float(speed)) for speed in speeds])
    about = {"units": "s-1", "long_name": "largest Lyapunov exponent"}
    found = dataset.assign(
        largest_lyapunov_per_s=(study.varied, scan.exponents[:, 0] / seconds, about)
    )
    metres = scale.velocity(1.0) * speeds
    about = {"units": "m s-1", "long_name": "airspeed V"}
    return found.assign_coords(velocity_m_s=(study.varied, metres, about))


def _band(study: _Study, band: Band, settings: ChaosOptions, halve: bool) -> dict[str, Any]:
    """A band of chaos, its edges as [value without chaos, value with it]."""
    from aeroflutter.motion.chaos import band_edge

    def refined(edge: Edge | None) -> list[float] | None:
        if edge is None:
            return None
        if halve:
            edge = band_edge(
                study.system, edge, study.case.loop()[1], study.start, settings, HALVINGS
            )
        return [float(edge.outside), float(edge.inside)]

    return {
        "first": band.first,
        "last": band.last,
        "lower_edge": refined(band.lower),
        "upper_edge": refined(band.upper),
    }


def _show_scan(study: _Study, scan: ChaosScan, bands: list[dict[str, Any]]) -> None:
    say(study.case.title)
    name = {"speed_ratio": "U*/U*_L", "speed": "U*"}.get(study.varied, study.varied)
    rows = []
    for value, result in zip(scan.values, scan.results, strict=True):
        found, second = result.exponents, None
        if found.values.size > 1:
            second = float(found.values[1])
        si, rate = list[float](), 1.0
        if study.scale:
            speed = study.speed_at(float(value))
            si, rate = [study.scale.velocity(speed)], 1.0 / study.scale.seconds(1.0, speed)
        rows.append(
            (*si, float(value), result.name, rate * float(found.values[0]),
             rate * float(found.error[0]), second and rate * second, told(result.amplitude))
        )  # fmt: skip
    units, per = (("V (m/s)",), " (1/s)") if study.scale else ((), "")
    names = (f"lambda 1{per}", "error", f"lambda 2{per}", "amplitude (deg)")
    show_table((*units, name, "motion", *names), rows)
    for band in bands:
        unit = _velocity(study) if study.scale else None
        say(f"chaos from {_place(band, 'lower', unit)} to {_place(band, 'upper', unit)}")
    if not bands:
        say("no chaos")


def _place(band: dict[str, Any], side: str, metres: float | None = None) -> str:
    edge, one, word = band[f"{side}_edge"], metres or 1.0, " m/s" if metres else ""
    if edge is None:
        end = one * band["first" if side == "lower" else "last"]
        return f"{end:.6g}{word} (where the scan ends)"
    low, high = sorted(edge)
    return f"between {one * low:.6g} and {one * high:.6g}{word}"


def _figure(study: _Study, value: float, system: AnySystem, result: ChaosResult) -> Figure:
    from aeroflutter.plots.chaos import plot_chaos
    from aeroflutter.plots.style import Clock, literal

    if result.section.pitch.size == 0:
        raise InputError(f"--plot: the motion is {result.verdict}, there is no attractor to draw")
    response = result.trace(system, study.case.loop()[1])
    title = f"{literal(study.case.title)}, {_at(study, value)}: {result.name}"
    return plot_chaos(result, response, title, Clock.of(study.speed_at(value), study.scale))


def _at(study: _Study, value: float) -> str:
    """The speed, as titles write it."""
    facts = study.facts(value)
    if study.scale is not None:
        return f"{facts['velocity_m_s']:.5g} m/s"
    if facts["speed_ratio"]:
        return f"$U^*/U^*_L$ = {facts['speed_ratio']:.4g}"
    return f"$U^*$ = {facts['speed']:.4g}"


def _scan_figure(study: _Study, scan: ChaosScan) -> Figure:
    import numpy as np

    from aeroflutter.plots import style
    from aeroflutter.plots.chaos import plot_chaos_scan

    labels = {
        "speed_ratio": style.SPEED_RATIO,
        "speed": style.SPEED,
        "zeta_alpha": r"damping ratio $\zeta_\alpha$",
        "zeta_xi": r"damping ratio $\zeta_\xi$",
    }
    label = labels[study.varied]
    if sum(values.size > 1 for _, values in study.damping) > 1:
        label = r"damping ratio $\zeta_\alpha$, with $\zeta_\xi$ along"
    title, unit, rates = style.literal(study.case.title), 1.0, None
    if study.scale is not None:
        speeds = [study.speed_at(float(value)) for value in scan.values]
        rates = np.array([1.0 / study.scale.seconds(1.0, speed) for speed in speeds])
    if study.scale is not None and study.varied in ("speed", "speed_ratio"):
        label = style.VELOCITY
        unit = study.scale.speed(1.0) / study.speed_at(1.0)
    if study.speeds.size == 1:
        title += f", {_at(study, float(scan.values[0]))}"
    return plot_chaos_scan(scan, label, title, unit, rates)
