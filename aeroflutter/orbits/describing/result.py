"""Typed results of the describing-function analysis."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aeroflutter.analysis import Result
from aeroflutter.motion.swings import Swing
from aeroflutter.orbits.result import Branch as CycleFamily
from aeroflutter.orbits.result import Onset

__all__ = ["CycleFamily", "DescribingCurve", "Onset"]

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]


def _unmeasured(_: int) -> tuple[tuple[Swing, ...], tuple[Swing, ...]]:
    return (), ()


@dataclass(frozen=True, kw_only=True, eq=False)
class DescribingCurve(Result):
    """Amplitude against airspeed by the describing function.

    Attributes
    ----------
    amplitude, bias
        Amplitude A and mean B of the assumed sinusoid, radians, shape (m,).
    speed, speed_ratio, k
        U*, U*/U*_L (NaN without a flutter speed) and reduced frequency, shape (m,).
    n_p, n_q
        Describing function, shape (m,).
    family
        Number of each point's family, shape (m,).
    stable
        Quasi-static stability, shape (m,): `drift` < 0, no `others`, `bias_stable`.
    drift, slope, others, bias_stable, rules_agree
        See `aeroflutter.orbits.describing.stability.Stability`, shape (m,).
    distortion
        Norm of the predicted harmonics 2 … K over the amplitude, shape (m,).
    harmonics
        Those harmonics over the amplitude, complex, shape (m, K - 1).
    in_thesis_range
        Whether the motion covers the whole nonlinearity, shape (m,).
    families
        What is known of every family.
    flutter_speed
        U*_L, or None if there is none in the family's range.
    onset, stable_onset
        The lowest cycle of all, and the lowest stable one; None where there is none.
    amplitude_range, speed_range
        Where cycles were looked for (radians, U*).
    notes
        What a reader should know: curves that could not be followed, why there are no cycles.
    swings
        How far coordinates and springs move at point i.
    """

    amplitude: Array
    bias: Array
    speed: Array
    speed_ratio: Array
    k: Array
    n_p: Array
    n_q: Array
    family: NDArray[np.int64]
    stable: Flags
    drift: Array
    slope: Array
    others: NDArray[np.int64]
    bias_stable: Flags
    rules_agree: Flags
    distortion: Array
    harmonics: NDArray[np.complex128]
    in_thesis_range: Flags
    families: tuple[CycleFamily, ...]
    flutter_speed: float | None
    onset: Onset | None
    stable_onset: Onset | None
    amplitude_range: tuple[float, float]
    speed_range: tuple[float, float]
    notes: tuple[str, ...] = ()
    swings: Callable[[int], tuple[tuple[Swing, ...], tuple[Swing, ...]]] = _unmeasured
