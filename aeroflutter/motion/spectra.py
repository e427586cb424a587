"""What a trace shows: power spectral density (Welch), Poincaré section."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from aeroflutter.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from aeroflutter.motion.response import Response

    Array = NDArray[np.float64]

__all__ = ["PoincareSection", "Spectrum", "poincare_section", "power_spectrum", "steady_part"]

LEAST_SAMPLES = 64


@dataclass(frozen=True, kw_only=True)
class Spectrum:
    """One-sided power spectral density of a trace.

    Attributes
    ----------
    k
        Reduced frequency ωb/V, that is angular frequency per unit τ, shape (m,).
    density
        Power per unit k, shape (m,): its integral over k is the mean square about the mean.
    peaks
        k of the peaks that stand out of the spectrum, strongest first.
    """

    k: Array
    density: Array = field(repr=False)
    peaks: Array


@dataclass(frozen=True, kw_only=True)
class PoincareSection:
    """States at successive pitch maxima, c x' = 0 from above.

    Attributes
    ----------
    time
        τ of each, shape (m,).
    pitch
        Pitch there, rad, shape (m,).
    states
        All states there, shape (m, n).
    state_names
        Their names.
    """

    time: Array
    pitch: Array
    states: Array = field(repr=False)
    state_names: tuple[str, ...] = ()


def steady_part(response: Response, fraction: float = 0.5) -> slice:
    """The samples of the last part of a trace, where transients are taken to be over.

    Raises
    ------
    InputError
        If the fraction is not in (0, 1], or too few samples are left.
    """
    if not 0.0 < fraction <= 1.0:
        raise InputError(f"fraction: {fraction!r} is not in (0, 1]")
    count = response.time.size
    keep = int(np.ceil(fraction * count))
    if keep < LEAST_SAMPLES:
        raise InputError(
            f"response: its last part has {keep} samples, at least {LEAST_SAMPLES} are needed; "
            "march longer, with record=True"
        )
    return slice(count - keep, count)


def power_spectrum(
    response: Response, signal: str = "pitch", fraction: float = 0.5, segments: int = 4
) -> Spectrum:
    """Power spectral density of a trace by Welch's method (thesis figs 5.1-5.4).

    Parameters
    ----------
    response
        A response with its trace recorded.
    signal
        "pitch", "heave" or "moment".
    fraction
        Last part of the trace that is used.
    segments
        Hann-windowed segments, overlapping by half, that are averaged.

    Returns
    -------
    Spectrum

    Raises
    ------
    InputError
        If the signal is unknown or the trace too short.
    """
    from scipy.signal import find_peaks, welch

    if signal not in ("pitch", "heave", "moment"):
        raise InputError(f"signal: {signal!r} is unknown; one of pitch, heave, moment")
    part = steady_part(response, fraction)
    values = getattr(response, signal)[part]
    spacing = response.time[1] - response.time[0]
    length = max(LEAST_SAMPLES // 2, 2 * values.size // (segments + 1))
    frequency, density = welch(values, 1.0 / spacing, "hann", length, detrend="constant")
    k, density = 2.0 * np.pi * frequency, density / (2.0 * np.pi)
    found, _ = find_peaks(density, prominence=1e-4 * float(density.max(initial=0.0)) or None)
    order = np.argsort(density[found])[::-1]
    return Spectrum(k=k, density=density, peaks=k[found[order]])


def poincare_section(response: Response, fraction: float = 0.5) -> PoincareSection:
    """States at pitch maxima over the last part of a trace.

    Between samples the trace is a cubic spline, and the maxima are roots of its derivative.

    Parameters
    ----------
    response
        A response with its trace recorded.
    fraction
        Last part of the trace that is used.

    Raises
    ------
    InputError
        If the trace is too short.
    """
    from scipy.interpolate import CubicSpline

    part = steady_part(response, fraction)
    time, states = response.time[part], response.states[part]
    curve = CubicSpline(time, response.pitch[part])
    turns = curve.derivative().roots(extrapolate=False)
    tops = turns[curve(turns, 2) < 0.0]
    return PoincareSection(
        time=tops,
        pitch=curve(tops),
        states=CubicSpline(time, states)(tops),
        state_names=response.state_names,
    )
