"""Harmonic balance against exact cycles: error over the number of harmonics, drawn into out/.

For a spring with kinks the waveform should converge with H⁻³ and the period with H⁻⁵; for a cubic
spring exponentially. Cycles are compared at their speed with the exact one by shooting; the cubic's
with one of 81 harmonics.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from aeroflutter.model.lure import SectionFamily
from aeroflutter.model.section import TypicalSection
from aeroflutter.orbits.cycles import cycle_near
from aeroflutter.orbits.cycles.loop import Loop
from aeroflutter.orbits.describing import DescribingOptions, describing_curve
from aeroflutter.orbits.harmonic import Cycle, HarmonicOptions, sinusoid, solve_cycle
from aeroflutter.orbits.harmonic.moment import waveform
from aeroflutter.springs import Cubic, Freeplay, Hysteresis, Spring
from benchmarks import Measurement

COUNTS = (1, 3, 5, 7, 9, 11, 15, 21, 27, 35, 45, 61, 81, 101)
SAMPLES = 4096
FIGURE = Path("out/harmonic-convergence.png")


class Place(NamedTuple):
    """A stable cycle of the describing function to start from."""

    name: str
    omega_bar: float
    spring: Spring
    ratio: float


PLACES = (
    Place("run 14 at 0.95", 0.8, Hysteresis(1.0, 0.2), 0.95),
    Place("run 103 at 0.85", 0.2, Hysteresis(1.0, 1.0), 0.85),
    Place("freeplay at 0.5", 0.2, Freeplay(1.0), 0.5),
    Place("cubic at 1.5", 0.2, Cubic(1.0, 3.0), 1.5),
)


class Errors(NamedTuple):
    """Relative errors, one for each of COUNTS."""

    period: np.ndarray
    wave: np.ndarray


def errors(place: Place) -> Errors:
    """Of the period, and of pitch at any time over the first harmonic."""
    family = SectionFamily(TypicalSection(omega_bar=place.omega_bar))
    cycles = [start(family, place)]
    for count in COUNTS[1:]:
        options = HarmonicOptions(harmonics=count)
        cycles.append(solve_cycle(family, place.spring, cycles[-1], options=options))
    period, wave, y = reference(family, place, cycles[-1])
    return Errors(
        np.array([abs(c.period / period - 1) for c in cycles]),
        np.array([np.max(np.abs(waveform(c.Y, SAMPLES) - y)) / wave for c in cycles]),
    )


def start(family: SectionFamily, place: Place) -> Cycle:
    df = describing_curve(family, place.spring, DescribingOptions(points=60))
    rows = np.flatnonzero((df.bias == 0) & df.stable)
    i = rows[np.argmin(np.abs(df.speed_ratio[rows] - place.ratio))]
    guess = sinusoid(df.amplitude[i], 0.0, df.k[i], place.ratio * df.flutter_speed)
    return solve_cycle(family, place.spring, guess, options=HarmonicOptions(harmonics=1))


def reference(family: SectionFamily, place: Place, cycle: Cycle) -> tuple[float, float, np.ndarray]:
    """Period, first harmonic and samples of the true cycle, its first harmonic a rising sine."""
    if isinstance(place.spring, Cubic):
        fine = solve_cycle(family, place.spring, cycle, options=HarmonicOptions(harmonics=141))
        return fine.period, fine.first_harmonic, waveform(fine.Y, SAMPLES)
    exact = cycle_near(family, place.spring, cycle.Y, cycle.omega, cycle.speed)
    z = exact.state
    if isinstance(place.spring, Hysteresis):
        z = np.append(z, exact.memory)
    trace = Loop(family, place.spring).at(exact.speed).trace(z, exact.period, SAMPLES)
    spectrum = np.fft.rfft(trace.states @ family.c)
    spectrum *= (-1j * np.conj(spectrum[1]) / abs(spectrum[1])) ** np.arange(spectrum.size)
    return exact.period, exact.first_harmonic, np.fft.irfft(spectrum)


def order(error: np.ndarray) -> float:
    """Fitted power of H⁻¹ from 9 harmonics on, as far as round-off lets it be seen."""
    seen = (np.array(COUNTS) >= 9) & (error > 1e-12)
    return float(-np.polyfit(np.log(np.array(COUNTS)[seen]), np.log(error[seen]), 1)[0])


def measure() -> Iterator[Measurement]:
    """Orders of convergence; the figure."""
    found = {place.name: errors(place) for place in PLACES}
    draw(found)
    for name, error in found.items():
        if name.startswith("cubic"):
            rate = error.period[COUNTS.index(11)] / error.period[COUNTS.index(7)]
            yield Measurement(f"{name}: error of the period, 11 over 7 harmonics", rate, "")
            continue
        yield Measurement(f"{name}: order of the period (theory 5)", order(error.period), "")
        yield Measurement(f"{name}: order of the waveform (theory 3)", order(error.wave), "")
        yield Measurement(f"{name}: error of the period, 101 harmonics", error.period[-1], "")


def draw(found: dict[str, Errors]) -> None:
    from aeroflutter.plots import style as look

    with look.style():
        figure, axes = look.figure(1, 2, width=9.0, height=3.9)
        counts = np.array(COUNTS)
        for axis, field, power in zip(axes, ("period", "wave"), (5, 3), strict=True):
            for i, (name, error) in enumerate(found.items()):
                values = np.maximum(getattr(error, field), 1e-15)
                axis.loglog(counts, values, "o-", color=look.CYCLE[i], label=name, markersize=3)
            guide = 3e-1 * (counts / 3.0) ** -power
            axis.loglog(counts[2:], guide[2:], ":", color=look.GREY, label=f"$H^{{-{power}}}$")
            axis.set_xlabel("highest harmonic $H$")
            axis.set_ylim(1e-15, 1)
        axes[0].set_ylabel("relative error")
        axes[0].set_title("period")
        axes[1].set_title("pitch at any time, over the first harmonic")
        axes[0].legend(loc="lower left")
        axes[1].legend(loc="lower left")
    FIGURE.parent.mkdir(exist_ok=True)
    figure.savefig(FIGURE)
