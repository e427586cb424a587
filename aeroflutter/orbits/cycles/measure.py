"""What is measured on a cycle: where it starts, how large it is, whether it closes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from aeroflutter.errors import ConvergenceError
from aeroflutter.motion.swings import Lap, Swing, rows_of, swings_of
from aeroflutter.orbits.cycles.centre import Centre
from aeroflutter.orbits.cycles.loop import Loop, Trace
from aeroflutter.orbits.cycles.result import Cycle
from aeroflutter.orbits.cycles.shooting import Phase, Shooting
from aeroflutter.orbits.cycles.smooth import SmoothFlow
from aeroflutter.orbits.cycles.spectrum import Spectra

__all__ = ["Frame", "anchored", "cycle_at", "sizes_of", "switches_of", "trace_of"]

Array = NDArray[np.float64]

_SAMPLES = 512
_SLIDES = 1e-6  # of a spring's size, that its memory moves where it is the one to lead
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
    """Half the peak-to-peak of every state over a period; of its y for a memory, (m,)."""
    ranges = 0.5 * np.ptp(trace.states, axis=0)
    if shooting.loop.memory:
        held = shooting.loop.C[shooting.loop.held]
        ranges = np.append(ranges, 0.5 * np.ptp(trace.states @ held.T, axis=0))
    largest = float(ranges.max())
    if not (np.isfinite(largest) and largest > 0.0):
        raise ConvergenceError("the motion is at rest")
    return np.asarray(np.maximum(ranges, _FLOOR * largest))


def anchored(
    shooting: Shooting, q: Array, tangent: Array | None = None
) -> tuple[Shooting, Array, Array | None]:
    """The same cycle from the best place to start, and the tangent carried there.

    With memory that is the steepest fall of the moment through the middle of the loop; without,
    the global maximum of y. Of several springs the one leads whose memory moves most, or else
    whose y does. The equations are told where the cycle starts, and what its memories are there.
    """
    z, period, speed = shooting.unpack(q)
    trace = trace_of(shooting, q)
    phase = _phase(shooting, trace)
    if phase.memory or phase.falls:
        time = _fall(shooting, trace, period, phase)
    else:
        time = _top(shooting, z, trace, period, phase)
    new = q
    flow = shooting.flow(q)
    if time != 0.0:
        moved = flow.passage(z, time)
        new = shooting.pack(moved.end, period, speed)
    hold = new[shooting.loop.n : -2]
    anchor = Shooting(shooting.loop, shooting.symmetric, shooting.reference, hold, phase)
    if tangent is None or time == 0.0:
        return anchor, new, tangent
    m = z.size
    carried = tangent.copy()
    carried[:m] = moved.jacobian @ np.append(tangent[:m], tangent[-1] * shooting.reference)
    # sliding along the orbit restores the phase condition
    gradient = anchor.jacobian(new)[-1]
    along = np.append(flow.rate(moved.end), [0.0, 0.0])
    return anchor, new, carried - along * (gradient @ carried) / (gradient @ along)


def _phase(shooting: Shooting, trace: Trace) -> Phase:
    """Which spring leads."""
    loop = shooting.loop
    if len(loop.springs) == 1:
        return Phase.of(loop)
    moved = np.ptp(trace.memories[:, : len(loop.springs)], axis=0) / loop.scales
    if np.max(moved) > _SLIDES:
        return Phase.of(loop, int(np.argmax(moved)))
    lead = int(np.argmax(np.ptp(trace.states @ loop.C.T, axis=0) / loop.scales))
    return Phase(lead, False, loop.falls[lead])


def _fall(shooting: Shooting, trace: Trace, period: float, phase: Phase) -> float:
    """Time at which the moment falls fastest through the middle of the loop, or y through zero."""
    loop, lead = shooting.loop, phase.lead
    middle = getattr(loop.springs[lead], "v_off", 0.0)
    moment = trace.states @ loop.C[lead]
    if phase.memory:
        moment = moment - trace.memories[:, lead] - middle
    ahead = np.roll(moment, -1)
    falls = np.flatnonzero((moment > 0) & (ahead <= 0))
    if falls.size == 0:
        return 0.0
    first = falls[np.argmin(ahead[falls] - moment[falls])]
    fraction = moment[first] / (moment[first] - ahead[first])
    return float((first + fraction) * period / moment.size)


def _top(shooting: Shooting, z: Array, trace: Trace, period: float, phase: Phase) -> float:
    """Time of the global maximum of y."""
    c = shooting.loop.C[phase.lead]
    y, start = trace.states @ c, float(c @ z[: shooting.loop.n])
    if phase.lead == 0:
        tops = trace.turns[trace.turns[:, 2] > 0]
        if tops.size == 0:
            return 0.0
        time, top = (float(value) for value in tops[np.argmax(tops[:, 1]), :2])
    else:  # between samples by a parabola; Newton's method does the rest
        i = int(np.argmax(y))
        before, top, after = float(y[i - 1]), float(y[i]), float(y[(i + 1) % y.size])
        bend = before - 2.0 * top + after
        time = (i + (0.5 * (before - after) / bend if bend else 0.0)) * period / y.size
        time %= period
    return 0.0 if top <= start + 1e-9 * float(np.ptp(y)) else time


def switches_of(loop: Loop, trace: Trace) -> int:
    """Number of switches; none where a memory hardly moves: round-off can touch a stop."""
    moves = np.ones(trace.memories.shape[1], dtype=bool)  # friction has a column of its own
    held = loop.held
    moves[held] = np.ptp(trace.memories[:, held], axis=0) > _MOVED * loop.scales[held]
    return int(np.count_nonzero(moves[trace.events[:, 5].astype(int)]))


def cycle_at(frame: Frame, shooting: Shooting, q: Array, spectra: Spectra | None = None) -> Cycle:
    """Everything that is reported of the cycle at q."""
    z, period, speed = shooting.unpack(q)
    loop, centre = frame.loop, frame.centre
    trace = trace_of(shooting, q)
    sizes = sizes_of(shooting, trace)
    y = trace.states @ loop.C.T
    high = max(float(y[:, 0].max()), float(np.max(trace.turns[:, 1], initial=-np.inf)))
    low = min(float(y[:, 0].min()), float(np.min(trace.turns[:, 1], initial=np.inf)))
    spec = (spectra or Spectra(shooting, sizes))(q)
    Y = (2 * np.fft.rfft(y, axis=0)[:_HARMONICS] / len(y)).T
    Y[:, 0] = 0.5 * Y[:, 0].real + centre.pitch
    memory = centre.memory.copy()
    memory[loop.held] += z[loop.n :]
    state = z[: loop.n] + centre.rest(loop.family, speed)
    alone = len(loop.springs) == 1
    return Cycle(
        Y[0],
        2 * np.pi / period,
        speed,
        method="exact",
        speed_ratio=speed / frame.flutter if frame.flutter else float("nan"),
        amplitude=0.5 * (high - low),
        bias=0.5 * (high + low) + float(centre.pitch[0]),
        multipliers=spec.multipliers,
        stable=spec.stable,
        symmetric=shooting.symmetric,
        continuum=spec.drift is not None,
        state=state,
        memory=float(memory[0]) if alone else memory,
        closure=float(np.max(np.abs(trace.end - z) / sizes)),
        switches=switches_of(loop, trace),
        outputs=Y[:0] if alone else Y,
        swings=partial(_swings, frame, z, period, speed),
    )


def _swings(
    frame: Frame, z: Array, period: float, speed: float
) -> tuple[tuple[Swing, ...], tuple[Swing, ...]]:
    """How far every coordinate and every spring moves, from the cycle marched once more."""
    loop, flow = frame.loop, frame.loop.at(speed)
    memory = np.zeros(len(loop.springs))
    memory[loop.held] = z[loop.n :]
    system = loop.family.at(speed)
    rows = rows_of(system)
    if isinstance(flow, SmoothFlow):
        low, high = flow.extremes(z, period, rows)
    else:
        start = np.append(z[: loop.n], memory)
        low, high = Lap.of(flow.exact, start, period, rows).extremes()
    rest = rows @ frame.centre.rest(loop.family, speed)
    coordinates, springs = swings_of(system, low + rest, high + rest)
    return tuple(coordinates), tuple(springs)
