"""A followed curve as a result: amplitudes, multipliers, bifurcations, onset."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aeroflutter.orbits.continuation import Event, State
from aeroflutter.orbits.harmonic.balance import Balance, Cycle
from aeroflutter.orbits.harmonic.result import Bifurcation, HarmonicBranch, HarmonicOnset
from aeroflutter.orbits.harmonic.stability import Stability
from aeroflutter.orbits.harmonic.walk import CORNERS, Curve
from aeroflutter.orbits.spectrum import FLIP, FOLD, TORUS

__all__ = ["assemble"]

Real = NDArray[np.float64]

_GRAZING = 1e-3  # margin over the amplitude below which a switch is about to appear or vanish


def assemble(
    balance: Balance,
    curve: Curve,
    stability: Stability | None,
    flutter: float | None,
    tolerance: float,
    number: int,
) -> HarmonicBranch:
    """The result of a followed curve."""
    cycles = tuple(balance.unpack(state.x) for state in curve.states)
    speed = np.array([cycle.speed for cycle in cycles])
    ratio = speed / flutter if flutter else np.full(speed.shape, np.nan)
    truncation = np.array([balance.truncation(state.x) for state in curve.states])
    answers = [balance.answer(state.x) for state in curve.states]
    ends = np.array([answer.extremes for answer in answers])
    if balance.symmetric:  # but for round-off
        ends = 0.5 * (ends - ends[:, ::-1])
    first = np.array([cycle.first_harmonic for cycle in cycles])
    margin = np.array([answer.margin for answer in answers]) / first
    multipliers, error, is_stable, certain = _stability(balance, curve.states, stability, margin)
    amplitude = 0.5 * (ends[:, 1] - ends[:, 0])
    bifurcations = _bifurcations(balance, curve, stability, flutter)
    onsets = _Onsets(cycles, ratio, amplitude, is_stable, bifurcations, stability is not None)
    return HarmonicBranch(
        cycles=cycles,
        speed=speed,
        speed_ratio=ratio,
        omega=np.array([cycle.omega for cycle in cycles]),
        period=np.array([cycle.period for cycle in cycles]),
        amplitude=amplitude,
        bias=0.5 * (ends[:, 1] + ends[:, 0]),
        first_harmonic=first,
        truncation=truncation,
        margin=margin,
        multipliers=multipliers,
        multiplier_error=error,
        stable=is_stable,
        certain=certain,
        symmetric=balance.symmetric,
        harmonics=int(balance.ks[-1]),
        converged=bool(np.all(truncation <= tolerance)),
        bifurcations=bifurcations,
        onset=onsets.lowest(),
        stable_onset=onsets.lowest_stable(),
        flutter_speed=flutter,
        stops=curve.stops,
        closed=curve.closed,
        family=number,
    )


def _stability(
    balance: Balance, states: tuple[State, ...], stability: Stability | None, margin: Real
) -> tuple[NDArray[np.complex128], Real, NDArray[np.bool_], NDArray[np.bool_]]:
    """Multipliers (m, n), their errors, stable and certain (m,)."""
    if stability is None:
        m, n = len(states), balance.family.c.size
        no = np.zeros(m, dtype=bool)
        return np.full((m, n), np.nan + 0j), np.full(m, np.nan), no, no
    found = [stability.at(state.x) for state in states]
    error = np.array([one.error_of_all for one in found])
    spectra = [stability.spectrum(state.x) for state in states]
    distance = np.array([one.distance for one in spectra])
    certain = distance > np.array([one.error for one in found])
    return (
        np.array([one.all for one in found]),
        error,
        np.array([one.stable for one in spectra]),
        certain & (margin > _GRAZING),
    )


def _bifurcations(
    balance: Balance, curve: Curve, stability: Stability | None, flutter: float | None
) -> tuple[Bifurcation, ...]:
    arclength = np.array([state.arclength for state in curve.states])
    corners = [event.arclength for event in curve.events if event.name in CORNERS]
    found = []
    for event in sorted(curve.events, key=lambda event: event.arclength):
        kind = _kind(event, stability)
        if not kind or not arclength[0] <= event.arclength <= arclength[-1]:
            continue
        if kind == "grazing" and any(abs(event.arclength - at) < 1e-6 for at in corners):
            continue  # the multipliers jump because of the corner
        cycle = balance.unpack(event.x)
        low, high = balance.answer(event.x).extremes
        found.append(
            Bifurcation(
                kind=kind,
                cycle=cycle,
                speed_ratio=cycle.speed / flutter if flutter else np.nan,
                amplitude=0.5 * (high - low),
                bias=0.5 * (high + low),
                index=int(np.searchsorted(arclength, event.arclength)),
            )
        )
    return tuple(found)


def _kind(event: Event, stability: Stability | None) -> str:
    if event.name in (FLIP, TORUS):
        return stability.kind(event) if stability else ""
    if event.name == FOLD:
        return "" if event.jump else FOLD
    return "corner"


class _Onsets:
    """Where the speed is lowest, and of what kind that place is."""

    def __init__(
        self,
        cycles: tuple[Cycle, ...],
        ratio: Real,
        amplitude: Real,
        is_stable: NDArray[np.bool_],
        bifurcations: tuple[Bifurcation, ...],
        known: bool,
    ) -> None:
        self.known, self.last = known, len(cycles) - 1
        self.is_stable = is_stable
        self.places: list[tuple[str, Cycle, float, float, tuple[int, int]]] = [
            (b.kind, b.cycle, b.speed_ratio, b.amplitude, (max(b.index - 1, 0), b.index))
            for b in bifurcations
        ]
        self.places += [
            ("edge", cycle, r, a, (i, i))
            for i, (cycle, r, a) in enumerate(zip(cycles, ratio, amplitude, strict=True))
        ]

    def lowest(self) -> HarmonicOnset:
        return self._onset(min(self.places, key=lambda place: place[1].speed))

    def lowest_stable(self) -> HarmonicOnset | None:
        stable = [place for place in self.places if any(self._beside(place[4]))]
        if not stable or not self.known:
            return None
        return self._onset(min(stable, key=lambda place: place[1].speed))

    def _beside(self, ends: tuple[int, int]) -> list[bool]:
        return [bool(self.is_stable[min(i, self.last)]) for i in ends]

    def _onset(self, place: tuple[str, Cycle, float, float, tuple[int, int]]) -> HarmonicOnset:
        kind, cycle, ratio, amplitude, ends = place
        return HarmonicOnset(
            kind=kind if kind in ("fold", "corner") else "edge",
            cycle=cycle,
            speed_ratio=float(ratio),
            amplitude=float(amplitude),
            stable=any(self._beside(ends)) if self.known else None,
        )
