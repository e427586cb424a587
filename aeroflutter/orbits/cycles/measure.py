"""What is measured on a cycle: where it starts, how large it is, whether it closes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aeroflutter.errors import ConvergenceError
from aeroflutter.orbits.cycles.centre import Centre
from aeroflutter.orbits.cycles.loop import Loop, Trace
from aeroflutter.orbits.cycles.result import Cycle
from aeroflutter.orbits.cycles.shooting import Shooting
from aeroflutter.orbits.cycles.spectrum import Spectra

__all__ = ["Frame", "anchored", "cycle_at", "sizes_of", "switches_of", "trace_of"]

Array = NDArray[np.float64]

_SAMPLES = 512
_HARMONICS = 16  # of a cycle that are kept
_MOVED = 1e-9  # of the spring's size, that the memory of a nonlinear cycle moves
_FLOOR = 1e-6  # least size of a state, relative to the largest


@dataclass(frozen=True, eq=False)
class Frame:
    """What all cycles of a search share.

    Attributes
    ----------
    loop
        The loop about its centre.
    centre
        Where that is.
    flutter
        U*_L, or None.
    reference
        Speed that is the unit of the continuation: U*_L, or the top of the family's range.
    period
        Period of linear flutter; infinite without one.
    """

    loop: Loop
    centre: Centre
    flutter: float | None
    reference: float
    period: float


def trace_of(shooting: Shooting, q: Array) -> Trace:
    """One whole period of the cycle at q."""
    z, period, _ = shooting.unpack(q)
    return shooting.flow(q).trace(z, period, _SAMPLES)


def sizes_of(shooting: Shooting, trace: Trace) -> Array:
    """Half the peak-to-peak of every state over a period; of y for the memory, (m,)."""
    ranges = 0.5 * np.ptp(trace.states, axis=0)
    if shooting.loop.memory:
        ranges = np.append(ranges, 0.5 * np.ptp(trace.states @ shooting.loop.family.c))
    largest = float(ranges.max())
    if not (np.isfinite(largest) and largest > 0.0):
        raise ConvergenceError("the motion is at rest")
    return np.asarray(np.maximum(ranges, _FLOOR * largest))


def anchored(
    shooting: Shooting, q: Array, tangent: Array | None = None
) -> tuple[Array, Array | None]:
    """The same cycle from the best place to start, and the tangent carried there.

    With memory that is the steepest fall of the moment through the middle of the loop; without,
    the global maximum of y.
    """
    z, period, speed = shooting.unpack(q)
    trace = trace_of(shooting, q)
    time = _fall(shooting, trace, period) if shooting.loop.memory else _top(shooting, z, trace)
    if time == 0.0:
        return q, tangent
    flow = shooting.flow(q)
    moved = flow.passage(z, time)
    new = shooting.pack(moved.end, period, speed)
    if tangent is None:
        return new, None
    m = z.size
    carried = tangent.copy()
    carried[:m] = moved.jacobian @ np.append(tangent[:m], tangent[-1] * shooting.reference)
    # sliding along the orbit restores the phase condition
    phase = shooting.jacobian(new)[-1]
    along = np.append(flow.rate(moved.end), [0.0, 0.0])
    return new, carried - along * (phase @ carried) / (phase @ along)


def _fall(shooting: Shooting, trace: Trace, period: float) -> float:
    """Time at which the moment falls fastest through the middle of the loop."""
    spring = shooting.loop.spring
    moment = trace.states @ shooting.loop.family.c - trace.memory - spring.v_off  # type: ignore[union-attr]
    ahead = np.roll(moment, -1)
    falls = np.flatnonzero((moment > 0) & (ahead <= 0))
    if falls.size == 0:
        return 0.0
    first = falls[np.argmin(ahead[falls] - moment[falls])]
    fraction = moment[first] / (moment[first] - ahead[first])
    return float((first + fraction) * period / moment.size)


def _top(shooting: Shooting, z: Array, trace: Trace) -> float:
    """Time of the global maximum of y."""
    tops = trace.turns[trace.turns[:, 2] > 0]
    start = float(shooting.loop.family.c @ z[: shooting.loop.n])
    if tops.size == 0:
        return 0.0
    best = tops[np.argmax(tops[:, 1])]
    amplitude = float(np.ptp(trace.states @ shooting.loop.family.c))
    return 0.0 if best[1] <= start + 1e-9 * amplitude else float(best[0])


def switches_of(loop: Loop, trace: Trace) -> int:
    """Number of switches; none where the memory hardly moves: round-off can touch a stop."""
    moved = not loop.memory or np.ptp(trace.memory) > _MOVED * loop.spring.scale
    return int(trace.events.shape[0]) if moved else 0


def cycle_at(frame: Frame, shooting: Shooting, q: Array, spectra: Spectra | None = None) -> Cycle:
    """Everything that is reported of the cycle at q."""
    z, period, speed = shooting.unpack(q)
    loop, centre = frame.loop, frame.centre
    trace = trace_of(shooting, q)
    sizes = sizes_of(shooting, trace)
    y = trace.states @ loop.family.c
    high = max(float(y.max()), float(np.max(trace.turns[:, 1], initial=-np.inf)))
    low = min(float(y.min()), float(np.min(trace.turns[:, 1], initial=np.inf)))
    spec = (spectra or Spectra(shooting, sizes))(q)
    Y = 2 * np.fft.rfft(y)[:_HARMONICS] / y.size
    Y[0] = 0.5 * Y[0].real + centre.pitch
    return Cycle(
        Y,
        2 * np.pi / period,
        speed,
        method="exact",
        speed_ratio=speed / frame.flutter if frame.flutter else float("nan"),
        amplitude=0.5 * (high - low),
        bias=0.5 * (high + low) + centre.pitch,
        multipliers=spec.multipliers,
        stable=spec.stable,
        symmetric=shooting.symmetric,
        continuum=spec.drift is not None,
        state=z[: loop.n] + centre.rest(loop.family, speed),
        memory=(float(z[loop.n]) if loop.memory else 0.0) + centre.memory,
        closure=float(np.max(np.abs(trace.end - z) / sizes)),
        switches=switches_of(loop, trace),
    )
