"""Starts for the search: sinusoids of the describing function, end states of the exact engine."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from aeroflutter.errors import ConvergenceError
from aeroflutter.model.system import solved
from aeroflutter.motion._kernel_ends import Cycles
from aeroflutter.motion.endstates import EndOptions, EndStates, end_state, end_states
from aeroflutter.motion.flow import Flow
from aeroflutter.orbits.continuation import ContinuationOptions, correct
from aeroflutter.orbits.cycles.centre import static_state
from aeroflutter.orbits.cycles.loop import Loop
from aeroflutter.orbits.cycles.measure import Frame, anchored, sizes_of, switches_of, trace_of
from aeroflutter.orbits.cycles.shooting import Shooting
from aeroflutter.orbits.cycles.smooth import SmoothFlow, settled
from aeroflutter.springs import Hysteresis, respond
from aeroflutter.verdicts import STATES

__all__ = ["converged", "end_seeds", "mirrors", "point_of", "sinusoid", "starts"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_WHOLE = 1e-6  # relative difference below which a fraction of the period is a period
_FRACTIONS = (2, 3, 5, 7)
_SHORTEST = 1e-3  # of the guess's period: what returns sooner still does not move
_MIRROR = 1e-5  # relative difference below which a simulated motion mirrors itself
_SAMPLES = 256
_WAVE = 4096  # of a motion that is known by its harmonics
_SIZES = (0.3, 12.0)  # of motions that are simulated, in units of the spring's scale
_PATIENCE = 200.0  # longest of them, in periods of linear flutter
_UNJUDGED = 4096  # maxima, more than patience allows: what is aperiodic is of no use here
_ALIKE = 1e-9  # relative difference of the measures of one cycle
_SEEN = 1e-6  # least pitch of a mode of unit size that is started in
_PERIOD, _SPEED = 0.3, 0.3  # sizes of ln T and U/U_ref
_NEWTON = 12  # iterations
_REST = 0.05  # of the size of the guess: what shrinks below it has come to rest
_LEFT = 1e-8  # of the residual, in sizes of the cycle
_REACH = 1.0  # of Newton's method, in sizes of the cycle


def sinusoid(loop: Loop, amplitude: float, bias: float, speed: float, k: float) -> Array:
    """Point z of the forced response to the moment of y = bias + amplitude cos kτ.

    Parameters
    ----------
    amplitude, bias, speed, k
        A cycle by the describing function.
    """
    A, B, _, _ = loop.family.stack(speed)
    N = complex(loop.spring.describing(amplitude, bias).N)
    wave = np.linalg.solve(1j * k * np.eye(loop.n) - A, -B[:, 0] * N * amplitude)
    angle, memory = _start(loop, amplitude, bias)
    x = static_state(loop.family, speed, bias) + (wave * np.exp(1j * angle)).real
    return np.append(x, memory) if loop.memory else x


def _start(loop: Loop, amplitude: float, bias: float) -> tuple[float, float]:
    """Angle after the maximum at which shooting starts, and the memory there."""
    spring = loop.spring
    if loop.falls[0]:  # y = B + A cos falls through zero
        slack = spring.scale if loop.memory else 0.0
        return float(np.arccos(np.clip(-bias / amplitude, -1, 1))), min(amplitude - slack, slack)
    if not isinstance(spring, Hysteresis):
        return 0.0, 0.0
    memory = float(np.clip(bias + amplitude - spring.v1, spring.h_low, spring.h_high))
    return float(np.arccos(np.clip((memory + spring.v_off - bias) / amplitude, -1, 1))), memory


def point_of(loop: Loop, Y: Complex, omega: float, speed: float) -> Array:
    """A point z of a motion whose outputs are known by their harmonics (s, H+1).

    With one spring where shooting likes to start: at the top of y or, with memory, where the moment
    falls through the middle of the loop.
    """
    A, B, C, d = loop.family.stack(speed)
    n, m = B.shape
    ks = np.arange(Y.shape[1])
    # C x = Y_k and the moments F_k that it takes, harmonic by harmonic
    matrix: Complex = np.zeros((ks.size, n + m, n + m), dtype=np.complex128)
    matrix[:, :n, :n] = 1j * ks[:, None, None] * omega * np.eye(n) - A
    matrix[:, :n, n:], matrix[:, n:, :n] = B, C
    right: Complex = np.zeros((ks.size, n + m, 1), dtype=np.complex128)
    right[0, :n, 0], right[:, n:, 0] = d, Y.T
    motion = solved(matrix, right)[..., 0]
    theta = 2 * np.pi * np.arange(_WAVE) / _WAVE
    wave = np.exp(1j * np.outer(theta, ks))
    y = (wave @ Y.T).real
    at = int(np.argmax(y[:, 0]))
    if m == 1 and (loop.memory or loop.falls[0]):
        moment = y[:, 0] if loop.falls[0] else (wave @ motion[:, n]).real
        middle = getattr(loop.spring, "v_off", 0.0)
        after = np.roll(moment, -1)
        falls = np.flatnonzero((moment > middle) & (after <= middle))
        at = int(falls[np.argmin((after - moment)[falls])])
    here = (wave[at] @ motion).real
    if m == 1:
        held = here[n] if loop.falls[0] else loop.C[0] @ here[:n] - here[n]
        return np.append(here[:n], held) if loop.memory else here[:n]
    held = [respond(loop.springs[i], np.tile(y[:, i], 2))[1][_WAVE + at] for i in loop.held]
    return np.append(here[:n], held)


def starts(frame: Frame, speed: float, count: int, rng: np.random.Generator) -> Array:
    """Initial states about the centre, (count, n), sizes spread evenly over `_SIZES`.

    One in three is at rest at some y; the others move in the modes that the loop has with a spring
    of unit slope, at any phases. Basins that no start at rest lies in are reached that way.
    """
    loop, C = frame.loop, frame.loop.C
    low, high = np.log(_SIZES)
    sizes = np.exp(low + (high - low) * rng.permutation((np.arange(count) + 0.5) / count))
    still = np.arange(count) % 3 == 0
    A, B, _, _ = loop.family.stack(speed)
    values, modes = np.linalg.eig(A - B @ C)
    seen = np.max(np.abs(C @ modes) / loop.scales[:, None], axis=0)  # in units of each spring
    modes = modes[:, (values.imag > 0) & (seen * loop.scales.min() > _SEEN)]
    outputs = C @ modes / loop.scales[:, None]
    lead = np.argmax(np.abs(outputs), axis=0)
    modes = modes / outputs[lead, np.arange(lead.size)]
    shape = count, modes.shape[1]
    weights = rng.random(shape) * np.exp(2j * np.pi * rng.random(shape))
    sides = np.where(rng.random((count, len(loop.springs))) < 0.5, -1.0, 1.0)
    pick = np.linalg.pinv(C).T
    rest = (sides * loop.scales) @ pick
    moving = (weights @ modes.T).real
    middle = np.array([0.5 * sum(one.span()) for one in loop.springs]) @ pick
    return np.asarray(middle + sizes[:, None] * np.where(still[:, None], rest, moving))


def end_seeds(frame: Frame, speed: float, states: Array) -> Iterator[tuple[Array, float]]:
    """Points and periods of the attracting cycles that motions end on before long.

    Parameters
    ----------
    states : float array (N, n)
        Where the motions start, about the centre.
    """
    loop = frame.loop
    if loop.smooth:
        smooth = SmoothFlow(loop.family, loop.springs, speed)
        yield from settled(smooth, states, _PATIENCE * frame.period)
        return
    flow = Flow(loop.family.at(speed), loop.springs)
    y = (states @ loop.C.T).T
    memory = np.column_stack(
        [one.initial_memory(at) for one, at in zip(loop.springs, y, strict=True)]
    )
    kept = np.concatenate((np.arange(loop.n), loop.n + loop.held))
    options = EndOptions(cycles=_UNJUDGED, duration=_PATIENCE * frame.period)
    ends = end_states(flow, states, memory, options, share=True)
    seen: list[tuple[float, float]] = []
    for cycles in (ends.cycles, *_own(flow, states, memory, options, ends)):
        for j in np.flatnonzero(cycles.loops):
            measures = float(cycles.period[j]), float(cycles.amplitude[j])
            if not any(np.allclose(measures, other, rtol=_ALIKE, atol=0.0) for other in seen):
                seen.append(measures)  # of mirror images, or one cycle from two maxima, one
                yield cycles.z[j][kept], measures[0]


def _own(
    flow: Flow, states: Array, memory: Array, options: EndOptions, ends: EndStates
) -> Iterator[Cycles]:
    """Cycles of a continuum, which motions do not share, one of each amplitude."""
    if flow.m == 1:
        return
    alone = (np.array([STATES[code] for code in ends.state]) == "lco") & (ends.attractor < 0)
    _, first = np.unique(np.round(ends.amplitude[alone], 8), return_index=True)
    for i in np.flatnonzero(alone)[first]:
        end = end_state(flow, states[i], memory[i], options)
        if end.cycle is not None:
            yield end.cycle


def mirrors(frame: Frame, z: Array, period: float, speed: float) -> Array | None:
    """The point of a motion that mirrors itself, moved to the centre; None if it does not.

    In a continuum of bias the motion mirrors itself about some other place.
    """
    flow = frame.loop.at(speed)
    y = flow.trace(z, period, _SAMPLES).states @ frame.loop.C.T
    y -= y.mean(axis=0)
    unlike = np.max(np.abs(y + np.roll(y, _SAMPLES // 2, axis=0)), axis=0)
    if np.any(unlike > _MIRROR * np.max(np.abs(y), axis=0)):
        return None
    return np.asarray(0.5 * (z - flow.passage(z, period / 2).end))


def converged(
    frame: Frame, z: Array, period: float, speed: float, symmetric: bool
) -> tuple[Shooting, Array]:
    """The cycle near a guess, with its equations: at that speed, else the nearest at another.

    A cycle found more than once round is cut down to its own period.

    Raises
    ------
    ConvergenceError
        If there is none, or only one far away.
    """
    shooting = Shooting(frame.loop, symmetric, frame.reference)
    shooting, q, _ = anchored(shooting, shooting.pack(z, period, speed))
    sizes = sizes_of(shooting, trace_of(shooting, q))
    scale = np.concatenate((np.sqrt(sizes.size) * sizes, [_PERIOD, _SPEED]))
    options = ContinuationOptions(scale=scale, max_newton=_NEWTON)
    try:
        found, _ = correct(shooting, q, np.eye(q.size)[-1], options)
    except ConvergenceError:
        found, _ = correct(shooting, q, None, options)
    trace = trace_of(shooting, found)
    shrunk = np.max(sizes_of(shooting, trace) / sizes)
    if not (np.linalg.norm((found - q) / scale) < _REACH and shrunk > _REST):
        raise ConvergenceError("Newton's method led far from where it was started, or to rest")
    left = shooting.residual(found)[: sizes.size] / sizes
    if np.max(np.abs(left)) > _LEFT:
        raise ConvergenceError("Newton's method stopped short of a cycle, at a kink")
    if not frame.loop.smooth and switches_of(frame.loop, trace) == 0:
        raise ConvergenceError("the spring does not switch: a cycle of a linear system")
    return _cut(frame, shooting, found, sizes, _SHORTEST * period)


def _cut(
    frame: Frame, shooting: Shooting, q: Array, sizes: Array, shortest: float
) -> tuple[Shooting, Array]:
    """The same cycle once round, on the half-period map if it mirrors itself."""
    z, period, speed = shooting.unpack(q)
    if period < shortest:
        raise ConvergenceError("the motion returns after any time: it is at rest")
    flow = shooting.flow(q)

    def returns(duration: float, sign: float) -> bool:
        end = flow.passage(z, duration).end
        return bool(np.max(np.abs((end - sign * z) / sizes)) < _WHOLE)

    symmetric = shooting.symmetric
    for count in _FRACTIONS:
        part = period / count
        if symmetric and count % 2 and returns(part / 2, -1.0):
            return _cut(frame, shooting, shooting.pack(z, part, speed), sizes, shortest)
        if not symmetric and returns(part, 1.0):
            return _cut(frame, shooting, shooting.pack(z, part, speed), sizes, shortest)
    if not symmetric and frame.centre.odd and returns(period / 2, -1.0):
        return Shooting(frame.loop, True, frame.reference, phase=shooting.phase), q
    return shooting, q
