"""Offset loops and damping: the describing function against the exact engine, drawn into out/.

Offset: run 103 with V_off from 0 to 0.5°, the stable cycle with bias at one speed, and the onset.
Damping: onset of limit cycles over the damping ratio in pitch of runs 14 and 102.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from aeroflutter.case import load_case
from aeroflutter.errors import ConvergenceError
from aeroflutter.orbits.cycles import Cycle, CycleOptions, LimitCycles, cycle_near, limit_cycles
from aeroflutter.orbits.describing import DescribingCurve, DescribingOptions, describing_curve
from aeroflutter.orbits.harmonic import HarmonicOptions, sinusoid, solve_cycle
from benchmarks import Measurement

OFFSETS = np.linspace(0.0, 0.5, 6)  # V_off, degrees
DAMPING = np.array([0.0, 0.005, 0.01, 0.02, 0.03, 0.05])
RUNS, SPEEDS = ("run10", "run103"), (0.95, 0.85)
DAMPED = ("run14", "run102")
FIGURE = Path("out/offset-loops.png")
_EXACT = CycleOptions(simulations=0, points=40, depth=0)


class Offset(NamedTuple):
    """One offset: the stable cycle's amplitude and bias (degrees), NaN if there is none.

    The describing function's bias is the mean; the exact one is the midrange, beside which `mean`
    is that of harmonic balance.
    """

    df: tuple[float, float]
    exact: tuple[float, float]
    mean: float


def offset(run: str, ratio: float, v_off: float) -> Offset:
    case = load_case(run, {"spring.v_off_deg": float(v_off)})
    family, spring = case.family(), case.spring
    curve = describing_curve(family, spring, DescribingOptions(points=80))
    rows = np.flatnonzero(curve.stable)
    above = curve.speed_ratio[rows] > ratio
    nan = (np.nan, np.nan)
    found = [rows[i] for i in np.flatnonzero(above[:-1] != above[1:]) if rows[i + 1] == rows[i] + 1]
    if not found:
        return Offset(nan, nan, np.nan)
    i = max(found, key=lambda j: curve.amplitude[j])
    guess = sinusoid(curve.amplitude[i], curve.bias[i], curve.k[i], ratio * curve.flutter_speed)
    one = solve_cycle(
        family, spring, guess, options=HarmonicOptions(harmonics=1), symmetric=False
    )  # fmt: skip
    df = (np.degrees(one.first_harmonic), np.degrees(one.Y[0].real))
    try:
        cycle = one
        for harmonics in (3, 7, 15, 31):
            options = HarmonicOptions(harmonics=harmonics)
            cycle = solve_cycle(family, spring, cycle, options=options, symmetric=False)
        exact: Cycle = cycle_near(family, spring, cycle.Y, cycle.omega, cycle.speed)
    except ConvergenceError:
        return Offset(df, nan, np.nan)
    mean = float(np.degrees(cycle.Y[0].real))
    return Offset(df, (np.degrees(exact.amplitude), np.degrees(exact.bias)), mean)


def onsets(run: str, zeta: float) -> tuple[float, float]:
    """Onset over the flutter speed of the damped section: describing function and exact."""
    case = load_case(run, {"section.zeta_alpha": float(zeta)})
    curve: DescribingCurve = describing_curve(
        case.family(), case.spring, DescribingOptions(points=20)
    )
    cycles: LimitCycles = limit_cycles(case.family(), case.spring, _EXACT)
    return (
        curve.onset.speed_ratio if curve.onset else np.nan,
        cycles.onset.cycle.speed_ratio if cycles.onset else np.nan,
    )


def measure() -> Iterator[Measurement]:
    """Largest differences; the tables and the figure."""
    offsets = {
        run: [offset(run, ratio, v) for v in OFFSETS]
        for run, ratio in zip(RUNS, SPEEDS, strict=True)
    }
    for run, ratio in zip(RUNS, SPEEDS, strict=True):
        print(
            f"  {run} at {ratio}: V_off, DF amplitude and mean, exact amplitude, bias, mean (deg)"
        )
        for v, one in zip(OFFSETS, offsets[run], strict=True):
            print(
                "   ", f"{v:.1f} ", "  ".join(f"{x:.4f}" for x in (*one.df, *one.exact, one.mean))
            )
        ratios = np.array([one.df[0] / one.exact[0] - 1 for one in offsets[run]])
        yield Measurement(
            f"{run}: amplitude, largest relative difference", np.nanmax(abs(ratios)), ""
        )
        apart = np.array([one.df[1] - one.mean for one in offsets[run]])
        yield Measurement(f"{run}: mean pitch, largest difference", np.nanmax(abs(apart)), "deg")
    damped = {run: np.array([onsets(run, zeta) for zeta in DAMPING]) for run in DAMPED}
    for run, values in damped.items():
        print(f"  {run}: zeta_alpha, onset by DF and exact, over the flutter speed")
        for zeta, (df, exact) in zip(DAMPING, values, strict=True):
            print(f"    {zeta:.3f}  {df:.5f}  {exact:.5f}")
        apart = np.nanmax(np.abs(values[:, 0] / values[:, 1] - 1))
        yield Measurement(f"{run}: onset over damping, largest relative difference", apart, "")
    draw(offsets, damped)


def draw(offsets: dict[str, list[Offset]], damped: dict[str, np.ndarray]) -> None:
    from aeroflutter.plots import style as look

    with look.style():
        figure, axes = look.figure(1, 3, width=11.0, height=3.7)
        for i, (run, found) in enumerate(offsets.items()):
            colour, label = look.CYCLE[i], f"{run} at {SPEEDS[i]}"
            for axis, part in zip(axes, (0, 1), strict=False):
                axis.plot(OFFSETS, [one.exact[part] for one in found], color=colour, label=label)
                axis.plot(OFFSETS, [one.df[part] for one in found], "o", color=colour)
            axes[1].plot(OFFSETS, [one.mean for one in found], "--", color=colour)
        for i, (run, values) in enumerate(damped.items()):
            axes[2].plot(DAMPING, values[:, 1], color=look.CYCLE[i], label=run)
            axes[2].plot(DAMPING, values[:, 0], "o", color=look.CYCLE[i])
        for axis, label in zip(
            axes,
            ("pitch amplitude (deg)", "midrange, mean dashed (deg)", "onset $U^*/U^*_L$"),
            strict=True,
        ):
            axis.set_ylabel(label)
            axis.set_xlabel(r"$V_\mathrm{off}$ (deg)")
            axis.legend()
        axes[2].set_xlabel(r"damping ratio in pitch $\zeta_\alpha$")
        figure.suptitle("exact (lines) and describing function with bias (dots)", fontsize=10)
    FIGURE.parent.mkdir(exist_ok=True)
    figure.savefig(FIGURE)
