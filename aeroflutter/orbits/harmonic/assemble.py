"""A followed curve as a result: amplitudes, multipliers, bifurcations, onset."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from aeroflutter.orbits.continuation import Event, State
from aeroflutter.orbits.harmonic.balance import Balance
from aeroflutter.orbits.harmonic.result import HarmonicBranch
from aeroflutter.orbits.harmonic.stability import Stability
from aeroflutter.orbits.harmonic.swings import harmonic_swings
from aeroflutter.orbits.harmonic.walk import Curve, is_corner
from aeroflutter.orbits.result import (
    CORNER,
    EDGE,
    Cycle,
    Onset,
    Spot,
    bifurcations,
    onset,
    stable_onset,
)
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
    unit = flutter or np.nan
    truncation = np.array([balance.truncation(state.x) for state in curve.states])
    plain = [_measured(balance, state.x, unit, number) for state in curve.states]
    first = np.array([cycle.first_harmonic for cycle in plain])
    margin = np.array([balance.margin(state.x) for state in curve.states]) / first
    multipliers, error, is_stable, certain = _stability(balance, curve.states, stability, margin)
    cycles = tuple(
        replace(cycle, multipliers=values, stable=bool(flag))
        for cycle, values, flag in zip(plain, multipliers, is_stable, strict=True)
    )
    found = _events(balance, curve, stability, unit, number)
    places: list[Spot] = []
    for i, cycle in enumerate(cycles):
        places += [Spot(event, kind) for kind, event, index in found if index == i]
        places.append(Spot(cycle))
    known = stability is not None
    lowest_stable = stable_onset(places) if known else None
    return HarmonicBranch(
        number=number,
        cycles=cycles,
        bifurcations=bifurcations(places, [not place.kind for place in places]),
        ends=curve.stops,
        closed=curve.closed,
        onset=_plainly(onset(places), known=known),
        stable_onset=lowest_stable and _plainly(lowest_stable),
        symmetric=balance.symmetric,
        truncation=truncation,
        margin=margin,
        multiplier_error=error,
        certain=certain,
        harmonics=int(balance.ks[-1]),
        converged=bool(np.all(truncation <= tolerance)),
        flutter_speed=flutter,
    )


def _measured(balance: Balance, x: Real, unit: float, number: int) -> Cycle:
    """The cycle of unknowns x with what is measured on its motion."""
    cycle = balance.unpack(x)
    low, high = balance.answers(x)[0].extremes
    if balance.symmetric:  # but for round-off
        high = 0.5 * (high - low)
        low = -high
    return replace(
        cycle,
        speed_ratio=cycle.speed / unit,
        amplitude=0.5 * (high - low),
        bias=0.5 * (high + low),
        symmetric=balance.symmetric,
        family=number,
        swings=partial(harmonic_swings, balance.family, cycle),
    )


def _plainly(found: Onset, *, known: bool = True) -> Onset:
    """An onset whose kind is fold, corner or edge, and whose stability may be unknown."""
    kind = found.kind if found.kind in (FOLD, CORNER) else EDGE
    return replace(found, kind=kind, stable=found.stable if known else None)


def _stability(
    balance: Balance, states: tuple[State, ...], stability: Stability | None, margin: Real
) -> tuple[NDArray[np.complex128], Real, NDArray[np.bool_], NDArray[np.bool_]]:
    """Multipliers (m, n), their errors, stable and certain (m,)."""
    if stability is None:
        m, n = len(states), len(balance.family.state_names)
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


def _events(
    balance: Balance, curve: Curve, stability: Stability | None, unit: float, number: int
) -> list[tuple[str, Cycle, int]]:
    """What happens along a curve, in order: kind, cycle, and the state before which it lies."""
    arclength = np.array([state.arclength for state in curve.states])
    corners = [event.arclength for event in curve.events if is_corner(event.name)]
    found = []
    for event in sorted(curve.events, key=lambda event: event.arclength):
        kind = _kind(event, stability)
        if not kind or not arclength[0] <= event.arclength <= arclength[-1]:
            continue
        if kind == "grazing" and any(abs(event.arclength - at) < 1e-6 for at in corners):
            continue  # the multipliers jump because of the corner
        cycle = _measured(balance, event.x, unit, number)
        found.append((kind, cycle, int(np.searchsorted(arclength, event.arclength))))
    return found


def _kind(event: Event, stability: Stability | None) -> str:
    if event.name in (FLIP, TORUS):
        return stability.kind(event) if stability else ""
    if event.name == FOLD:
        return "" if event.jump else FOLD
    return CORNER
