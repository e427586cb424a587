"""Motions as a page keeps them: samples of an engine, thinned and coded in few bytes.

A motion is a choice of an engine's own uniform samples; nothing is interpolated. Chosen are a few a
period, every turn of both signals, and the samples before and after each switch of the spring,
so that straight lines between them show the path of a piecewise-linear spring as it is.
"""

from __future__ import annotations

import base64
import gzip
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeroflutter.model.lure import as_system
from aeroflutter.motion.response import Initial, Response, SimulateOptions, simulate
from aeroflutter.orbits.harmonic.moment import waveform
from aeroflutter.results.unit import DEGREE, told
from aeroflutter.springs import each, respond

if TYPE_CHECKING:
    from aeroflutter.model.elsewhere.placed import PlacedModel
    from aeroflutter.model.family import SectionModel
    from aeroflutter.model.lure import AnySystem
    from aeroflutter.model.system import System
    from aeroflutter.springs import Springs

__all__ = ["Beside", "Motions", "beside", "harmonic_motion", "marched"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

DENSE = 300  # samples a period from which is chosen
EVERY, EVERY_SMOOTH = 20, 6  # of which one is kept, besides switches and turns
BETWEEN_TURNS = 5  # samples kept from one turn of pitch to the next, at least
LEVELS = 32767  # of the 16 bits of a sample
FAR = 30.0  # times its start at which the trace of a divergent motion ends


class Beside(NamedTuple):
    """The state that is drawn below the coordinate of the first spring, and how it is told."""

    state: str
    name: str
    label: str
    mark: str = ""
    factor: float = 1.0


HEAVE = Beside("xi", "heave", "heave ξ = h/b")
PITCH = Beside("alpha", "pitch", "pitch (deg)", DEGREE.mark, DEGREE.factor)


def beside(model: SectionModel | PlacedModel) -> Beside | None:
    """Heave, or pitch where the spring is in heave; None where the model has no such state."""
    found = PITCH if model.names[0] == "heave" else HEAVE
    return found if found.state in model.state_names else None


def marched(
    system: AnySystem, spring: Springs, start: Initial, period: float, duration: float
) -> Response:
    """A march over a duration with `DENSE` samples a period, whatever comes of it."""
    options = SimulateOptions(duration=duration, dt=period / DENSE, decide=False)
    return simulate(system, spring, start, options)


def harmonic_motion(
    system: AnySystem, spring: Springs, Y: Complex, omega: float, second: Beside | None = HEAVE
) -> tuple[Array, Array, Array, Array]:
    """Time, coordinate, what is beside it and moment over one period given by its harmonics.

    Parameters
    ----------
    system, spring
        The loop.
    Y
        Harmonics 0 … H of y = Re Σ Y_k e^(jkωτ), in the unit of the API; 0 and 1 for
        a describing function. Of several springs (m, H+1), one row the coordinate of each; what is
        told is the first's.
    omega
        Reduced frequency.
    second
        The state beside the coordinate.

    Returns
    -------
    arrays (m,)
        The state is the system's answer to harmonics 0 … H of the spring's moment; where the
        system has a pole there, the one that goes with Y_k. NaN where there is no such state.
    """
    whole, every = as_system(system), np.atleast_2d(Y)
    count = every.shape[1]
    samples = max(DENSE, 4 * count)
    samples += samples % 2
    outputs = [waveform(row, samples) for row in every]
    moments = [  # the second period has forgotten the start
        respond(one, np.tile(y, 2))[0][samples:]
        for one, y in zip(each(spring), outputs, strict=True)
    ]
    F = np.fft.rfft(moments)[:, :count] * (2.0 / samples)
    F[:, 0] *= 0.5
    other = np.full(samples, np.nan)
    if second is not None:
        place = whole.state_names.index(second.state)
        other = waveform(_states(whole, every, F, omega)[:, place], samples)
    time = np.linspace(0.0, 2.0 * np.pi / omega, samples + 1)
    drawn = np.array([outputs[0], other, moments[0]])
    closed = drawn[:, np.arange(samples + 1) % samples]
    return time, closed[0], closed[1], closed[2]


def _states(system: System, Y: Complex, F: Complex, omega: float) -> Complex:
    """Harmonics of all states, (H+1, n), from (sI - A) x = -B F together with C x = Y."""
    found = np.empty((Y.shape[1], system.order), dtype=complex)
    for k in range(Y.shape[1]):
        rows = np.vstack((1j * k * omega * np.eye(system.order) - system.A, system.C))
        right = np.append(-system.B @ F[:, k], Y[:, k])
        found[k] = np.linalg.lstsq(rows, right, rcond=None)[0]
    return found


@dataclass(eq=False)
class Motions:
    """The motions of a page, numbered in the order in which they are added.

    Attributes
    ----------
    beside
        The state that is drawn below the coordinate of the first spring.
    """

    beside: Beside | None = HEAVE
    headers: list[list[float]] = field(default_factory=list)
    parts: list[bytes] = field(default_factory=list)

    def add_response(self, response: Response, *, divergent: bool = False) -> int:
        """Add a march; a divergent one ends when it is `FAR` from where it began."""
        end = _departure(response.pitch) if divergent else response.time.size
        step = response.time[1] - response.time[0]
        every = EVERY_SMOOTH if response.engine == "smooth" else EVERY
        other = np.full(response.time.size, np.nan)
        if self.beside is not None:
            other = response.states[:, response.state_names.index(self.beside.state)]
        shown = [one[:end] for one in (response.pitch, other)]
        chosen = _chosen(shown, response.events[:, 0] / step, every)
        return self.add(response.time, response.pitch, other, response.moment, chosen)

    def add(
        self, time: Array, pitch: Array, other: Array, moment: Array, chosen: NDArray[np.intp]
    ) -> int:
        """Add the chosen samples of a motion; its number is returned.

        Parameters
        ----------
        time, pitch, other, moment
            Uniform samples: τ, the coordinate of the first spring, what is beside it, and the
            moment of that spring; in the units of the API.
        chosen
            Places of the samples to keep, ascending, below 65 536.
        """
        header: list[float] = [chosen.size, float(time[1] - time[0])]
        part = [chosen.astype("<u2").tobytes()]
        factor = 1.0 if self.beside is None else self.beside.factor
        for values in (told(pitch), factor * other, told(moment)):
            kept = np.nan_to_num(values[chosen])
            unit = float(np.max(np.abs(kept))) / LEVELS or 1.0
            header.append(unit)
            part.append(np.rint(kept / unit).astype("<i2").tobytes())
        self.headers.append(header)
        self.parts.append(b"".join(part))
        return len(self.headers) - 1

    def add_periodic(self, time: Array, pitch: Array, other: Array, moment: Array) -> int:
        """Add one period of a motion whose switches are not known: keep more of it."""
        chosen = np.unique(np.append(np.arange(0, time.size, 4), time.size - 1))
        return self.add(time, pitch, other, moment, chosen)

    def coded(self) -> dict[str, Any]:
        """Headers (count, spacing in τ, units of the three signals), and the samples.

        The samples are, motion by motion, `count` places (16 bits, unsigned) and three times
        `count` values (16 bits, signed, to be multiplied by their unit), little-endian, all of it
        gzipped and in base64.
        """
        packed = gzip.compress(b"".join(self.parts), 9, mtime=0)
        headers = [[count, *(float(f"{x:.9g}") for x in rest)] for count, *rest in self.headers]
        return {"headers": headers, "samples": base64.b64encode(packed).decode("ascii")}


def _departure(pitch: Array) -> int:
    """Number of samples before a motion is far from its first period."""
    far = np.flatnonzero(~(np.abs(pitch) < FAR * np.abs(pitch[:DENSE]).max()))
    return max(2, int(far[0])) if far.size else pitch.size


def _chosen(signals: list[Array], switches: Array, every: int) -> NDArray[np.intp]:
    """Places kept of uniform samples of two signals; a moment turns with the first or at a switch.

    One in `every`, or more where the motion turns more often than in a period of flutter; the ends,
    turns of either, and the samples on both sides of a switch.
    """
    size = signals[0].size
    turns = [np.flatnonzero(np.diff(one)[1:] * np.diff(one)[:-1] <= 0.0) + 1 for one in signals]
    between = size / max(1, turns[0].size)  # samples from one turn of pitch to the next
    every = int(np.clip(between / BETWEEN_TURNS, 1, every))
    before = np.floor(switches[switches < size - 1]).astype(np.intp)
    regular = np.arange(0, size, every, dtype=np.intp)
    return np.unique(np.concatenate((regular, *turns, before, before + 1, [size - 1])))
