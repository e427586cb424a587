"""Houbolt's finite-difference scheme, as in the thesis (section 3.2.1 and appendix A).

Backward differences over four points for q' and q'', a four-point recurrence for the Duhamel
integrals, the spring as slope·y + offset taken at the pitch extrapolated linearly to the new
time. Between changes of branch the scheme is a fixed linear recurrence, see `houbolt_scheme`.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from aeroflutter.errors import InputError
from aeroflutter.generated.houbolt import VELOCITY, start_values
from aeroflutter.motion._kernel_houbolt import HYSTERESIS, PIECES, POLYNOMIAL, advance, tangent
from aeroflutter.motion._kernel_houbolt import march as march_kernel
from aeroflutter.motion._kernel_settle import survey
from aeroflutter.motion.houbolt_scheme import Scheme
from aeroflutter.motion.response import MOST_SAMPLES, Response, traces
from aeroflutter.motion.settling import OVERFLOW, Verdict, Watch, closed_slopes, period_range
from aeroflutter.springs._kernel_columns import (
    CEILING,
    FLOOR,
    HELD,
    HIGH,
    LOW,
    OFFSET,
    SLOPE,
    STICK,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from aeroflutter.model.lure import LureSystem
    from aeroflutter.motion.response import SimulateOptions
    from aeroflutter.springs import PieceTable, Spring

    Array = NDArray[np.float64]

__all__ = ["march"]

STEPS_A_PERIOD = 8  # fewer do not resolve an oscillation at all
STEPS_IN_TRUTH = 50  # fewer damp one by over 0.001 of critical, which is much beside the air
PERIODS_A_WINDOW = 4
LEAST_WINDOW = 6000  # steps; the buffers then stay in the cache, and the looks cost little
RECURRENCE = 2e-3  # switches fall anywhere within a step, so a cycle never repeats exactly
DRIFT = 1e-4


def march(
    system: LureSystem,
    spring: Spring,
    state: Array,
    memory: float,
    options: SimulateOptions,
    frozen: bool = False,
) -> Response:
    """March with Houbolt's scheme; see `motion.response.simulate`.

    Parameters
    ----------
    system, spring, state, memory, options
        As for every engine.
    frozen
        Take the moment at the old pitch, for the study of the scheme's order.

    Raises
    ------
    InputError
        If the system has no second-order form, the spring is unknown to the scheme, or the step
        leaves fewer than `STEPS_A_PERIOD` steps for the fastest oscillation.
    """
    scheme = _scheme(system, options.dt, frozen)
    slopes = closed_slopes(spring, float(system.c @ state))
    shortest, longest = _periods(system, slopes)
    if options.dt * STEPS_A_PERIOD > shortest:
        raise InputError(
            f"dt: {options.dt!r} takes {shortest / options.dt:.2g} steps for the fastest "
            f"oscillation (period {shortest:.4g}); take at most {shortest / STEPS_A_PERIOD:.3g}"
        )
    window = PERIODS_A_WINDOW * longest if np.isfinite(longest) else 0.0
    run = _Run(system, spring, scheme, state, memory, options, window)
    if options.dt * STEPS_IN_TRUTH > shortest:
        run.warning = (
            f"; dt = {options.dt:g} damps the fastest oscillation (period {shortest:.4g}) by "
            f"{numerical_damping(2 * np.pi * options.dt / shortest):.2g} of critical by itself: "
            f"take at most {shortest / STEPS_IN_TRUTH:.2g}"
        )
    run.go()
    return run.response()


def numerical_damping(theta: float) -> float:
    """Damping ratio that the scheme gives to q'' + ω² q = 0, for θ = ω Δτ.

    It solves (2 + θ²) z³ - 5 z² + 4 z - 1 = 0 instead, and q goes as zⁿ.
    """
    roots = np.roots([2.0 + theta**2, -5.0, 4.0, -1.0])
    z = max(roots[roots.imag > 0.0], key=abs)
    return float(-np.log(abs(z)) / np.angle(z))


@lru_cache(maxsize=16)
def _scheme(system: LureSystem, dt: float, frozen: bool) -> Scheme:
    """The scheme, shared by all marches of one system (systems are equal only to themselves)."""
    return Scheme.build(system, dt, frozen)


@lru_cache(maxsize=16)
def _periods(system: LureSystem, slopes: tuple[float, ...]) -> tuple[float, float]:
    return period_range(system, slopes)


def spring_law(spring: Spring) -> tuple[int, Array]:
    """Kind and parameters of a spring for the compiled loop.

    Raises
    ------
    InputError
        If the spring is of none of the kinds the loop knows.
    """
    table = spring.piece_table()
    if table is not None and not _known(spring, table):
        raise InputError(
            f"spring.kind: {spring.kind!r} is not for Houbolt's scheme, which takes laws without "
            "jumps and hinges only; use engine exact"
        )
    if table is not None and table.memory:
        return HYSTERESIS, table.rows[STICK, [HIGH, LOW, FLOOR, CEILING]][None]
    if table is not None:
        return PIECES, table.rows[:, [HIGH, SLOPE, OFFSET]].T.copy()
    powers = spring.polynomial()
    if powers is not None:
        return POLYNOMIAL, np.array([powers])
    raise InputError(f"spring.kind: {spring.kind!r} is unknown to houbolt; use engine exact")


def _known(spring: Spring, table: PieceTable) -> bool:
    """Whether a law of pieces is one that the loop knows: static and continuous, or a hinge."""
    return not (
        table.jumps or spring.rate_table() or (table.memory and table.rows[STICK, HELD] != 1.0)
    )


@dataclass
class _Buffers:
    """The window of motion that the compiled loop writes; rows 0 to 2 are its history."""

    Q: Array
    L: Array
    J: Array
    Y: Array
    H: Array

    @classmethod
    def start(
        cls, scheme: Scheme, law: tuple[int, Array], system: LureSystem, state: Array, memory: float
    ) -> tuple[_Buffers, Array]:
        """History at -Δτ, 0, +Δτ from Taylor series up to the fourth derivative of q.

        Returns
        -------
        buffers, states
            The history, and the states at 0 and +Δτ, shape (2, n).
        """
        form, dt = scheme.form, scheme.dt
        pitch, rate = float(system.c @ state), float(system.c @ (system.A @ state))
        slope, offset = tangent(*law, memory, pitch + 1e-6 * dt * rate)
        first = system.A @ state - system.b * (slope * pitch + offset)
        closed = system.closed(slope)
        second = closed @ first
        third = closed @ second
        q0 = state[form.positions]
        derivatives = np.array([q0, *(x[form.rates] for x in (state, first, second, third))])
        q, v, a = start_values(derivatives, dt)
        lam = v @ form.d0 + a @ form.d1
        before = lam[2] - 3.0 * lam[1] + 3.0 * lam[0]  # the same quadratic at -2Δτ
        n = form.lag_rate.size
        J = np.zeros((3, len(scheme.step.j_j)))
        J[1, :n] = form.duhamel(state)
        J[2] = scheme.decay * J[1] + scheme.weights @ (before, *lam)
        Y = q @ form.c
        H = np.array([memory, memory, advance(*law, memory, Y[2])])
        states = np.array([state, form.state(q[2], v[2], J[2, :n])])
        return cls(q, lam, J, Y, H), states

    def grown(self, steps: int) -> _Buffers:
        """The same history with room for so many steps."""
        return _Buffers(
            *(_longer(part, steps) for part in (self.Q, self.L, self.J, self.Y, self.H))
        )


def _longer(part: Array, steps: int) -> Array:
    """The three rows of a history, with room for so many more behind them."""
    room = np.empty((3 + steps, *part.shape[1:]))
    room[:3] = part
    return room


class _Run:
    """One march: the compiled loop window by window, the judge, and what is kept."""

    def __init__(
        self,
        system: LureSystem,
        spring: Spring,
        scheme: Scheme,
        state: Array,
        memory: float,
        options: SimulateOptions,
        window: float,
    ) -> None:
        self.system, self.spring, self.scheme, self.options = system, spring, scheme, options
        self.law = spring_law(spring)
        self.total = int(np.ceil(options.limit / options.dt - 1e-9))
        self.window = int(np.clip(window / options.dt, LEAST_WINDOW, 100_000))
        start, states = _Buffers.start(scheme, self.law, system, state, memory)
        self.buffers = start.grown(self.window)
        self.turns = np.empty(self.window + 2), np.empty(self.window + 2)
        self.watch = Watch.over(system, spring, state, options, RECURRENCE, DRIFT)
        self.floor = 1e-14 * self.watch.size
        self.verdict: Verdict | None = None
        self.warning = ""
        self.done = 1  # the start-up reaches +Δτ
        self.stride = 1 + self.total // MOST_SAMPLES
        self.last = 0
        self.kept = [(np.arange(2), states, start.H[1:].copy())]
        self.tail: deque[Array] = deque([start.Y[1:].copy()], maxlen=64)

    def go(self) -> None:
        """March until the end state is certain or the time is up."""
        while self.done < self.total and not (self.verdict and self.options.decide):
            part = self.buffers
            steps = min(self.window, self.total - self.done)
            march_kernel(
                steps,
                self.last,
                self.scheme.step,
                *self.law,
                part.Q.reshape(-1),
                part.L,
                part.J.reshape(-1),
                part.Y,
                part.H,
            )
            fine, turns, low, high = survey(
                part.Y[1 : steps + 3],
                (self.done - 1) * self.options.dt,
                self.options.dt,
                self.floor,
                self.watch.bound,
                *self.turns,
            )
            reached = part.Y[fine + 2]
            left = not abs(reached) <= self.watch.bound
            fine -= not abs(reached) < OVERFLOW  # a step that has overflowed is not kept
            self.done += fine
            self._keep(fine)
            if left:
                self.verdict = self.watch.diverged(reached)
                return
            verdict = self._judge(turns, low, high)
            self.verdict = self.verdict or verdict  # what is decided stays so
            if self.options.progress:
                self.options.progress(self.done / self.total)

    def _judge(self, turns: int, low: float, high: float) -> Verdict | None:
        """Show the window to the watch."""
        times, values = self.turns
        verdict = self.watch.add(times[:turns].copy(), values[:turns].copy(), low, high)
        return verdict or self.watch.trapped(*self._end())

    def _states(self, first: int, last: int) -> Array:
        """States after the steps `first` to `last` of the window, shape (last - first, n)."""
        form, Q = self.scheme.form, self.buffers.Q
        with np.errstate(over="ignore", invalid="ignore"):
            old = (weight * Q[first + k : last + k] for k, weight in enumerate(VELOCITY))
            rates = np.asarray(sum(old)) / self.options.dt
            J = self.buffers.J[first + 3 : last + 3, : form.lag_rate.size]
            return form.state(Q[first + 3 : last + 3], rates, J)

    def _keep(self, steps: int) -> None:
        """Remember every `stride`-th sample of the window and how it went."""
        self.last = steps
        self.tail.append(self.buffers.Y[3 : steps + 3].copy())
        if self.options.record:
            index = np.arange(self.done - steps + 1, self.done + 1)
            pick = index % self.stride == 0
            memory = self.buffers.H[3 : steps + 3][pick].copy()
            self.kept.append((index[pick], self._states(0, steps)[pick], memory))

    def _end(self) -> tuple[Array, float]:
        """State and memory after the last step, while the window still holds it."""
        if self.last == 0:
            return self.kept[-1][1][-1], float(self.kept[-1][2][-1])
        last, part, form = self.last, self.buffers, self.scheme.form
        with np.errstate(over="ignore", invalid="ignore"):
            rate = VELOCITY @ part.Q[last - 1 : last + 3] / self.options.dt
            state = form.state(part.Q[last + 2], rate, part.J[last + 2, : form.lag_rate.size])
        return state, float(part.H[last + 2])

    def _last(self, count: int) -> Array:
        """The last so many samples of pitch, or as many as are kept."""
        parts: list[Array] = []
        for part in reversed(self.tail):
            parts.insert(0, part)
            if sum(map(len, parts)) >= count:
                break
        return np.concatenate(parts)[-count:]

    def response(self) -> Response:
        """The result, once the march is over."""
        dt = self.options.dt
        duration = self.done * dt
        final_state, final_memory = self._end()
        verdict = self.verdict or self.watch.last(duration, final_state, final_memory)
        index, states, memory = (np.concatenate(parts) for parts in zip(*self.kept, strict=True))
        record = slice(None) if self.options.record else slice(0)
        return Response(
            state=verdict.state,
            reason=verdict.reason + self.warning,
            engine="houbolt",
            duration=duration,
            final_state=final_state,
            final_memory=final_memory,
            extras={"dt": dt, "loops": verdict.loops},
            **self.watch.measures(verdict, self._last, dt),
            **traces(self.system, self.spring, dt * index[record], states[record], memory[record]),
        )
