"""Slow sweeps of airspeed that carry the state over, up and down, and the jumps on the way."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from aeroflutter.analysis import Result, analysis
from aeroflutter.errors import InputError
from aeroflutter.model.lure import as_system
from aeroflutter.motion.response import Initial, Response, SimulateOptions, simulate
from aeroflutter.springs import each

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from aeroflutter.model.lure import AnyFamily, AnySystem
    from aeroflutter.model.system import System
    from aeroflutter.springs import Springs

    Array = NDArray[np.float64]

__all__ = ["Jump", "Sweep", "sweep", "there_and_back"]

JUMP = 0.25  # relative change of amplitude between neighbouring speeds that no slope explains


@dataclass(frozen=True, kw_only=True)
class Jump:
    """A discontinuity between two neighbouring speeds of a sweep.

    Attributes
    ----------
    before, after
        The two speeds U*, in the order of the sweep.
    amplitude_before, amplitude_after
        Pitch amplitude at either, rad.
    """

    before: float
    after: float
    amplitude_before: float
    amplitude_after: float


@dataclass(frozen=True, kw_only=True)
class Sweep(Result):
    """One pass over the speeds, in the order in which they were visited.

    Attributes
    ----------
    speeds
        U*, shape (m,); after a divergent run the pass ends, so m may be less than was asked for.
    state
        End state at each speed.
    amplitude, bias, period, rest, first_harmonic
        As in `Response`, shape (m,), rad and τ.
    jumps
        Where the motion changes its kind, or its amplitude out of proportion.
    reason
        Why each run ended as it did.
    end
        Where the last run ended, for a sweep that goes on from there.
    """

    speeds: Array
    state: tuple[str, ...]
    amplitude: Array = field(repr=False)
    bias: Array = field(repr=False)
    period: Array = field(repr=False)
    rest: Array = field(repr=False)
    first_harmonic: Array = field(repr=False)
    jumps: tuple[Jump, ...] = ()
    reason: tuple[str, ...] = field(default=(), repr=False)
    end: Initial = field(default_factory=Initial, repr=False)

    @property
    def upward(self) -> bool:
        """Whether speeds rise along the sweep."""
        return bool(self.speeds[-1] >= self.speeds[0])


@analysis(speed="speeds")
def sweep(
    family: AnyFamily,
    spring: Springs,
    speeds: ArrayLike,
    initial: Initial | None = None,
    options: SimulateOptions | None = None,
    kick: float = 0.0,
) -> Sweep:
    """Simulate at one speed after another, each run starting where the last one ended.

    A run that is certain to come to rest is carried over to its rest, however early that was
    known.

    Parameters
    ----------
    family
        The linear model at every speed.
    spring
        The restoring moment.
    speeds
        U* in the order of the sweep, monotone, shape (m,).
    initial
        Motion before the first run.
    options
        As for one run; `progress` sees the fraction of the whole sweep.
    kick
        Added to the pitch rate (per unit τ, rad) at every speed after the first, so that a
        section at rest notices that its rest has become unstable.

    Returns
    -------
    Sweep

    Raises
    ------
    InputError
        If the speeds are not positive, finite and monotone.

    Examples
    --------
    >>> from aeroflutter import Hysteresis, SectionFamily, TypicalSection
    >>> family = SectionFamily(TypicalSection(omega_bar=0.8))
    >>> loop = Hysteresis(delta_v=0.0174533, delta_h=0.0034907)
    >>> down = sweep(family, loop, [3.95, 3.9, 3.85, 3.8, 3.75], Initial(alpha=0.1))
    >>> down.state[0], down.state[-1]
    ('lco', 'damped')
    """
    visited = _checked(speeds)
    options = options or SimulateOptions()
    initial = initial or Initial()
    runs: list[Response] = []
    for i, speed in enumerate(visited):
        system = family.at(float(speed))
        part = replace(options, record=False, progress=_share(options.progress, i, visited.size))
        runs.append(simulate(system, spring, initial, part))
        if runs[-1].state == "divergent":
            break
        initial = _carried(runs[-1], system, spring, kick)
    end = _carried(runs[-1], system, spring)
    return _gathered(visited[: len(runs)], runs, end)


@analysis(speed="speeds")
def there_and_back(
    family: AnyFamily,
    spring: Springs,
    speeds: ArrayLike,
    initial: Initial | None = None,
    options: SimulateOptions | None = None,
    kick: float = 0.0,
) -> tuple[Sweep, Sweep]:
    """Sweep over the speeds and back again.

    The way back starts where the way out ended, unless that run left its cycle or never came to
    one: a section that has stayed at rest, or has diverged, starts once more from `initial`.

    Parameters
    ----------
    family, spring, speeds, initial, options, kick
        As for `sweep`.
    """
    visited = _checked(speeds)
    if visited.size < 2:
        raise InputError("speeds: a sweep there and back needs at least two")
    options = options or SimulateOptions()
    halves = [replace(options, progress=_share(options.progress, i, 2)) for i in (0, 1)]
    out = sweep(family, spring, visited, initial, halves[0], kick)
    turned = out.speeds[::-1]
    begin = out.end if out.state[-1] in ("lco", "aperiodic") else initial
    return out, sweep(family, spring, turned, begin, halves[1], kick)


def _carried(last: Response, system: AnySystem, spring: Springs, kick: float = 0.0) -> Initial:
    """The end of one run as the start of the next: at rest, if it was to come to rest."""
    whole, springs = as_system(system), each(spring)
    state, memory = last.final_state.copy(), np.array(last.final_memory, dtype=float, ndmin=1)
    if last.state == "damped":
        rests = [last.rest, *(one.bias for one in last.springs[1:])]
        moments = np.empty(len(springs))
        for i, (one, rest) in enumerate(zip(springs, rests, strict=True)):
            memory[i] = one.advance(memory[i], rest)
            moments[i] = one.moment(rest, memory[i])
        state = _equilibrium(whole, np.array(rests), moments, state)
    if kick and "alpha_rate" in last.state_names:
        state[last.state_names.index("alpha_rate")] += kick
    elif kick:
        state += kick * whole.C[0]
    return Initial(state=state, memory=memory)


def _equilibrium(system: System, rests: Array, moments: Array, near: Array) -> Array:
    """State at rest at y = `rests` under the springs' moments there, the nearest to `near`.

    A x + d = B F and C x = y; of a state that neither fixes (a free coordinate) the value is kept.
    """
    rows = np.vstack((system.A, system.C))
    wanted = np.append(system.B @ moments - system.load, rests)
    return np.asarray(near + np.linalg.lstsq(rows, wanted - rows @ near, rcond=None)[0])


def _checked(speeds: ArrayLike) -> Array:
    visited = np.atleast_1d(np.asarray(speeds, dtype=float))
    steps = np.diff(visited)
    if visited.ndim != 1 or visited.size == 0:
        raise InputError("speeds: give at least one speed")
    if not np.all(np.isfinite(visited) & (visited > 0.0)):
        raise InputError("speeds: every speed must be a positive number")
    if not (np.all(steps > 0.0) or np.all(steps < 0.0)):
        raise InputError("speeds: must rise or fall all the way")
    return visited


def _share(progress: object, i: int, count: int) -> object:
    """Progress of one run of `count` as progress of the whole."""
    if not callable(progress):
        return None
    return lambda fraction: progress((i + fraction) / count)


def _gathered(speeds: Array, runs: list[Response], end: Initial) -> Sweep:
    amplitude = np.array([run.amplitude for run in runs])
    state = tuple(run.state for run in runs)
    return Sweep(
        speeds=speeds,
        state=state,
        amplitude=amplitude,
        bias=np.array([run.bias for run in runs]),
        period=np.array([run.period for run in runs]),
        rest=np.array([run.rest for run in runs]),
        first_harmonic=np.array([run.first_harmonic for run in runs]),
        jumps=_jumps(speeds, state, amplitude),
        reason=tuple(run.reason for run in runs),
        end=end,
    )


def _jumps(speeds: Array, state: tuple[str, ...], amplitude: Array) -> tuple[Jump, ...]:
    """Changes of kind, and changes of amplitude that dwarf those on either side."""
    change = np.abs(np.diff(amplitude))
    size = np.maximum(np.abs(amplitude[1:]), np.abs(amplitude[:-1]))
    found = []
    for i, step in enumerate(change):
        beside = [change[j] for j in (i - 1, i + 1) if 0 <= j < change.size]
        sudden = len(beside) == 2 and step > JUMP * size[i] and step > 3.0 * max(beside)
        kinds = {state[i], state[i + 1]} - {"undecided"}
        if sudden or len(kinds) == 2:
            found.append(
                Jump(
                    before=float(speeds[i]),
                    after=float(speeds[i + 1]),
                    amplitude_before=float(amplitude[i]),
                    amplitude_after=float(amplitude[i + 1]),
                )
            )
    return tuple(found)
