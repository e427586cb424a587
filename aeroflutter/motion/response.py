"""One interface to the three time-marching engines: `simulate(system, spring, initial, options)`.

Every engine is one module with one function of the same signature,

    march(system, spring, state, memory, options) -> Response

given an initial state (n,) and an initial spring memory that are finite and fit the system:

- `exact`: matrix exponentials between switches, for piecewise-linear springs;
- `houbolt`: the scheme of the thesis, section 3.2.1 and appendix A;
- `smooth`: Taylor series for cubic springs, SciPy's DOP853 for any other law without pieces.

Angles are radians, times are the nondimensional τ = V t / b.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.analysis import Result
from aeroflutter.errors import InputError
from aeroflutter.limits import within
from aeroflutter.model.lure import as_system
from aeroflutter.motion.entry import at_a_speed
from aeroflutter.verdicts import STATES, State

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from aeroflutter.model.lure import AnySystem
    from aeroflutter.motion.swings import Swing
    from aeroflutter.springs import Spring, Springs

__all__ = [
    "ENGINES",
    "STATES",
    "Initial",
    "Response",
    "SimulateOptions",
    "State",
    "simulate",
    "traces",
]

ENGINES = ("auto", "exact", "houbolt")
CRITERIA = ("scale-free", "thesis")
DURATION = 20_000.0  # τ, where none is given
MOST_SAMPLES = 2_000_000  # kept of one march; longer ones are sampled more sparsely
MOTION = ("alpha", "alpha_rate", "xi", "xi_rate", "beta", "beta_rate")


def _empty(*shape: int) -> NDArray[np.float64]:
    return np.empty(shape)


@dataclass(frozen=True, kw_only=True)
class Initial:
    """Motion at τ = 0.

    Parameters
    ----------
    alpha, alpha_rate, xi, xi_rate, beta, beta_rate
        Pitch (rad), heave ξ = h/b, flap angle (rad) and their rates per unit τ; lag states start at
        zero, which is the Wagner integral's own initial condition. They are matched with the names
        of the system's states.
    state
        All states at once, shape (n,), in the order of the system; for systems from elsewhere,
        and to go on from the end of another run. Excludes those above.
    memory
        Memory of the spring, or of each of several, shape (m,), any number for one that has none;
        None takes `spring.initial_memory(c x)`.
    """

    alpha: float = 0.0
    alpha_rate: float = 0.0
    xi: float = 0.0
    xi_rate: float = 0.0
    beta: float = 0.0
    beta_rate: float = 0.0
    state: ArrayLike | None = None
    memory: ArrayLike | None = None

    def __post_init__(self) -> None:
        problems = [
            f"initial.{name}: {getattr(self, name)!r} is not finite; give a number"
            for name in MOTION
            if not np.isfinite(getattr(self, name))
        ]
        if self.memory is not None and not np.all(np.isfinite(np.asarray(self.memory, float))):
            problems.append(f"initial.memory: {self.memory!r} is not finite; give a number or none")
        if self.state is not None:
            if not np.all(np.isfinite(np.asarray(self.state, dtype=float))):
                problems.append("initial.state: holds NaN or infinity; give finite states")
            if any(getattr(self, name) != 0.0 for name in MOTION):
                problems.append(f"initial.state: excludes {', '.join(MOTION)}; drop one")
        if problems:
            raise InputError(problems)

    def vector(self, system: AnySystem) -> NDArray[np.float64]:
        """State of `system` at τ = 0, shape (n,).

        Raises
        ------
        InputError
            If `state` has another length, or a motion is given that the system has no state for.
        """
        names = tuple(system.state_names)
        if self.state is not None:
            state = np.array(self.state, dtype=float)
            if state.shape != (len(names),):
                raise InputError(
                    f"initial.state: has shape {state.shape}, the system has {len(names)} states "
                    f"({', '.join(names)})"
                )
            return state
        state = np.zeros(len(names))
        missing = []
        for name in MOTION:
            value = float(getattr(self, name))
            if name in names:
                state[names.index(name)] = value
            elif value != 0.0:
                missing.append(
                    f"initial.{name}: the system has no state of that name "
                    f"({', '.join(names)}); give initial.state"
                )
        if missing:
            raise InputError(missing)
        return state

    def start(self, system: AnySystem, spring: Springs) -> tuple[NDArray[np.float64], Any]:
        """Initial state (n,) and memory, made to fit the initial pitch.

        The memory is a number, or where there is a sequence of springs one of each, (m,).

        Raises
        ------
        InputError
            If the motion does not fit the system, or the memories the springs.
        """
        state = self.vector(system)
        if not isinstance(spring, Sequence):
            return state, self._held(spring, float(as_system(system).C[0] @ state), self.memory)
        given = [None] * len(spring) if self.memory is None else np.atleast_1d(self.memory)
        if len(given) != len(spring):
            raise InputError(
                f"initial.memory: needs {len(spring)} numbers, one a spring, not {len(given)}"
            )
        pitches = as_system(system).C @ state
        held = [
            self._held(one, float(y), memory)
            for one, y, memory in zip(spring, pitches, given, strict=True)
        ]
        return state, np.array(held)

    @staticmethod
    def _held(spring: Spring, pitch: float, memory: Any) -> float:
        if memory is None:
            return float(spring.initial_memory(pitch))
        return float(spring.advance(float(np.squeeze(memory)), pitch))


@dataclass(frozen=True, kw_only=True)
class SimulateOptions:
    """How to march and when to stop.

    Parameters
    ----------
    engine
        "houbolt"; "exact" or "auto": matrix exponentials for springs that are piecewise linear or
        simplify to one, Taylor series for cubic ones.
    duration
        Longest time to march, τ; None is 20 000, and as long as it takes where the march may stop
        at its decision, Houbolt's apart.
    dt
        Houbolt's step; for the other engines only the spacing of the samples.
    criteria
        "scale-free": sizes are measured against the spring's own scale, and a run ends as soon as
        its end is certain. "thesis": damped below 0.001° of pitch, divergent above 100°, limit
        cycle when the time is up (section 4.2).
    decide
        Stop once the end state is known; False marches for the whole duration.
    record
        Keep uniform samples of the motion; False keeps the end only.
    cycles
        A bounded motion that has not settled after this many cycles is aperiodic.
    growth
        A motion is divergent beyond this multiple of the larger of spring scale and initial pitch.
    step_cap
        Longest internal step of the exact engine, τ; None leaves it to the engine. Results do not
        depend on it.
    progress
        Called now and then with the fraction of the duration done, between 0 and 1.

    Raises
    ------
    InputError
        Naming every option that is out of range.
    """

    engine: str = "auto"
    duration: float | None = None
    dt: float = 0.1
    criteria: str = "scale-free"
    decide: bool = True
    record: bool = True
    cycles: int = 400
    growth: float = 1e3
    step_cap: float | None = None
    progress: Any = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        problems = []
        if self.engine not in ENGINES:
            problems.append(f"engine: {self.engine!r} is unknown; one of {', '.join(ENGINES)}")
        if self.criteria not in CRITERIA:
            problems.append(f"criteria: {self.criteria!r} is unknown; one of {', '.join(CRITERIA)}")
        for name in ("dt", "growth"):
            problems += _not_positive(name, getattr(self, name))
        for name in ("duration", "step_cap"):
            if getattr(self, name) is not None:
                problems += _not_positive(name, getattr(self, name))
        if self.cycles < 1:
            problems.append(f"cycles: {self.cycles!r} is less than one; give a whole number above")
        if not problems and 4 * self.dt > self.limit:
            problems.append(
                f"dt: {self.dt!r} leaves fewer than four steps in a duration of "
                f"{self.limit!r}; take a smaller dt or a longer duration"
            )
        if problems:
            raise InputError(problems)
        within("steps", self.limit / self.dt if self.engine == "houbolt" else 0, "dt")

    @property
    def limit(self) -> float:
        """Time after which a march ends that nothing else has ended, τ."""
        return DURATION if self.duration is None else self.duration

    @classmethod
    def thesis(cls, **changes: Any) -> SimulateOptions:
        """The settings of the thesis: Houbolt, Δτ = 0.1, 50 000 steps, its three end states."""
        settings: dict[str, Any] = {
            "engine": "houbolt",
            "criteria": "thesis",
            "dt": 0.1,
            "duration": 5000.0,
        }
        return cls(**(settings | changes))


def _not_positive(name: str, value: float) -> list[str]:
    if np.isfinite(value) and value > 0.0:
        return []
    return [f"{name}: {value!r} is not a positive number; give one above zero"]


@dataclass(frozen=True, kw_only=True)
class Response(Result):
    """What a run came to, and its trace.

    Attributes
    ----------
    state
        One of `STATES`.
    reason
        One line: how the state was decided, or why it could not be.
    engine
        Engine that ran: "exact", "houbolt" or "smooth".
    duration
        Time marched, τ.
    amplitude
        Half the peak-to-peak pitch over one steady period, rad; 0 for a damped motion, NaN for a
        divergent one. For motions that did not settle, over the last part of the run.
    bias
        Midrange of pitch over the same stretch, rad; the rest pitch for a damped motion.
    period
        Period of the whole motion, τ (all n loops of a period-n motion); NaN unless `lco`.
    first_harmonic
        Amplitude of the fundamental of pitch over one steady period, rad; NaN unless `lco`.
    rest
        Pitch at which a damped motion comes to rest, rad; NaN otherwise.
    time, pitch, heave, moment, memory
        Uniform samples, shape (m,): τ, y of the first spring (rad, pitch where it is in pitch), h/b
        (NaN if the system has no such state), that spring's moment (rad of the unit spring) and
        its memory (rad).
    states
        The same samples of all states, shape (m, n).
    final_state, final_memory
        Where the run ended, shape (n,), and the memory there, of several springs (m,): the start
        of a run that goes on from there.
    events
        Shape (k, 2): time and kind of what happened; the meaning of the kinds is in
        `extras["event_kinds"]`.
    coordinates, springs
        How far every named coordinate moves, and every spring, see `Swing`; over the same stretch
        as `amplitude` and `bias`, which are those of the first spring.
    extras
        What only one engine knows.
    """

    state: State
    reason: str
    engine: str
    duration: float
    amplitude: float = float("nan")
    bias: float = float("nan")
    period: float = float("nan")
    first_harmonic: float = float("nan")
    rest: float = float("nan")
    time: NDArray[np.float64] = field(default_factory=lambda: _empty(0), repr=False)
    pitch: NDArray[np.float64] = field(default_factory=lambda: _empty(0), repr=False)
    heave: NDArray[np.float64] = field(default_factory=lambda: _empty(0), repr=False)
    moment: NDArray[np.float64] = field(default_factory=lambda: _empty(0), repr=False)
    memory: NDArray[np.float64] = field(default_factory=lambda: _empty(0), repr=False)
    states: NDArray[np.float64] = field(default_factory=lambda: _empty(0, 0), repr=False)
    state_names: tuple[str, ...] = ()
    final_state: NDArray[np.float64] = field(default_factory=lambda: _empty(0), repr=False)
    final_memory: Any = 0.0
    events: NDArray[np.float64] = field(default_factory=lambda: _empty(0, 2), repr=False)
    coordinates: tuple[Swing, ...] = field(default=(), repr=False)
    springs: tuple[Swing, ...] = field(default=(), repr=False)
    extras: Mapping[str, Any] = field(default_factory=dict, repr=False)


@at_a_speed
def simulate(
    system: AnySystem,
    spring: Springs,
    initial: Initial | None = None,
    options: SimulateOptions | None = None,
) -> Response:
    """March a system in time and say how its motion ends.

    Parameters
    ----------
    system
        x' = A x - b F(c x) at one speed, or x' = A x - B F(C x).
    spring
        The restoring moment F, possibly with memory; of several springs a sequence, one a column
        of B.
    initial
        Motion at τ = 0; at rest where it says nothing.
    options
        Engine, duration, step and criteria; without any, a system that is no section is sampled so
        that its fastest oscillation shows.

    Returns
    -------
    Response
        End state, amplitude, bias, period, rest and the trace.

    Raises
    ------
    InputError
        If the initial motion does not fit the system, the step is too large for its fastest
        oscillation, or the engine cannot take the system.

    Examples
    --------
    >>> from aeroflutter import Hysteresis, SectionFamily, TypicalSection, Wagner
    >>> from aeroflutter.motion import Initial, simulate
    >>> system = SectionFamily(TypicalSection(omega_bar=0.8), Wagner()).at(3.9)
    >>> spring = Hysteresis(delta_v=0.0174533, delta_h=0.0034907)
    >>> simulate(system, spring, Initial(alpha=0.1)).state
    'lco'
    """
    from aeroflutter.motion.settling import sample_spacing
    from aeroflutter.springs import alone

    initial = initial or Initial()
    if options is None:
        section = "alpha" in system.state_names
        options = SimulateOptions() if section else SimulateOptions(dt=sample_spacing(system))
    spring = alone(spring)
    state, memory = initial.start(system, spring)
    return _engine(spring, options)(system, spring, state, memory, options)


def _engine(spring: Springs, options: SimulateOptions) -> Callable[..., Response]:
    """The `march` of the engine that fits; each is imported only when it is wanted."""
    from aeroflutter.springs import each, straight

    engine: Any
    if isinstance(spring, Sequence) and (
        options.engine == "houbolt" or options.criteria == "thesis"
    ):
        raise InputError(
            f"engine: Houbolt's scheme and the thesis's criteria take one spring, not "
            f"{len(spring)}; use engine exact"
        )
    if options.engine == "houbolt":
        from aeroflutter.motion import houbolt as engine
    elif all(map(straight, each(spring))):
        from aeroflutter.motion import exact as engine
    else:
        from aeroflutter.motion import smooth as engine
    march: Callable[..., Response] = engine.march
    return march


def traces(
    system: AnySystem,
    spring: Spring,
    time: NDArray[np.float64],
    states: NDArray[np.float64],
    memory: NDArray[np.float64],
) -> dict[str, Any]:
    """The fields of a Response that hold samples.

    Parameters
    ----------
    time, states, memory
        Samples, shapes (m,), (m, n) and (m,).
    spring
        The first one.
    """
    whole = as_system(system)
    names = whole.state_names
    if time.size == 0:
        return {"states": states, "state_names": names}
    with np.errstate(over="ignore", invalid="ignore"):
        pitch = states @ whole.C[0]
        moment = np.asarray(spring.moment(pitch, memory))
    heave = states[:, names.index("xi")] if "xi" in names else np.full(time.size, np.nan)
    return {
        "time": time,
        "pitch": pitch,
        "heave": heave,
        "moment": moment,
        "memory": memory,
        "states": states,
        "state_names": names,
    }
