"""Systems and families with one spring: ``x' = A(U) x - b(U) F(c x)``.

A :class:`~aeroflutter.model.system.System` whose ``B`` has one column, as vectors. Every analysis
that takes systems and families takes these as well (see :func:`as_system`, :func:`as_family`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aeroflutter.errors import InputError
from aeroflutter.model import system as _system
from aeroflutter.model.aerodynamics import Aerodynamics, Wagner
from aeroflutter.model.family import (
    Family,
    FixedModel,
    Matrices,
    SampledModel,
    SectionModel,
)
from aeroflutter.model.section import Scale, TypicalSection
from aeroflutter.model.system import Complex as Complex
from aeroflutter.model.system import Real as Real
from aeroflutter.model.system import System

if TYPE_CHECKING:
    import control


_ROUND_OFF = 1e-12


@dataclass(frozen=True, eq=False)
class LureSystem:
    """Linear system with one scalar feedback, ``x' = A x - b F(c x)``.

    Parameters
    ----------
    A : array (n, n)
    b, c : array (n,)
    state_names : tuple of str, optional
        Defaults to ``x1 … xn``.
    name, unit : str
        Of the nonlinear coordinate ``y = c x``.

    Raises
    ------
    InputError
        If the shapes do not fit or an entry is not finite.

    Examples
    --------
    >>> import numpy as np
    >>> system = LureSystem(np.array([[0.0, 1.0], [-1.0, -0.2]]), np.array([0.0, 1.0]),
    ...                     np.array([1.0, 0.0]))
    >>> complex(system.transfer(0.0))
    (1+0j)
    """

    A: Real
    b: Real
    c: Real
    state_names: tuple[str, ...] = ()
    name: str = "y"
    unit: str = "rad"

    def __post_init__(self) -> None:
        for name in ("A", "b", "c"):
            value = np.array(getattr(self, name), dtype=float)
            value.flags.writeable = False
            object.__setattr__(self, name, value)
        problems = _shape_problems(self.A, self.b, self.c)
        names = tuple(self.state_names) or tuple(f"x{i + 1}" for i in range(self.b.size))
        object.__setattr__(self, "state_names", names)
        if len(names) != self.b.size:
            problems.append(f"state_names: need {self.b.size} names, got {len(names)}")
        if problems:
            raise InputError(problems)

    @property
    def order(self) -> int:
        """Number of states."""
        return int(self.b.size)

    @cached_property
    def system(self) -> System:
        """The same system as every analysis takes it."""
        return System(
            self.A,
            self.b[:, None],
            self.c[None, :],
            names=(self.name,),
            units=(self.unit,),
            state_names=self.state_names,
        )

    @classmethod
    def of(cls, system: System) -> LureSystem:
        """A system with one output as vectors.

        Raises
        ------
        InputError
            If the system has another number of outputs, or a constant load.
        """
        if system.outputs != 1:
            raise InputError([f"system: must have one output, got {system.outputs}"])
        if np.any(system.load):
            raise InputError(["system: must have no constant load; use System"])
        (name,), (unit,) = system.names, system.units
        made = cls(system.A, system.B[:, 0], system.C[0], system.state_names, name, unit)
        made.__dict__["system"] = system  # not to be put together again
        return made

    def transfer(self, s: ArrayLike) -> Complex:
        """``G(s) = c (sI - A)^-1 b`` at every ``s`` (any shape)."""
        return self.system.transfer(s)[..., 0, 0]

    def inverse_transfer(self, s: ArrayLike) -> Complex:
        """``1/G(s)`` at every ``s`` (any shape), finite at the poles of ``G``."""
        return self.system.inverse_transfer(s)[..., 0, 0]

    def static_gain_inverse(self) -> float:
        """``1/G(0)``: minus the static load per unit of steady ``y = c x``."""
        return float(self.inverse_transfer(0.0).real)

    def closed(self, stiffness: complex) -> NDArray[Any]:
        """``A - N b c``: the system with the spring replaced by a linear one of stiffness N."""
        return self.system.closed([stiffness])

    def to_control(self) -> control.StateSpace:
        """The system from moment to ``y``, ``G(s)``, as a python-control StateSpace."""
        return self.system.to_control()

    @classmethod
    def from_control(cls, system: control.StateSpace) -> LureSystem:
        """The loop in which a python-control system is closed by ``-F(y)``.

        Raises
        ------
        InputError
            If the system has not one input and one output, is in discrete time, or has direct
            feedthrough (the loop would be algebraic).
        """
        if system.ninputs != 1 or system.noutputs != 1:
            raise InputError(["system: must have one input and one output"])
        return cls.of(System.from_control(system))


def _shape_problems(A: Real, b: Real, c: Real) -> list[str]:
    n = b.size
    problems = []
    if b.ndim != 1 or c.shape != b.shape or A.shape != (n, n) or n == 0:
        problems.append(
            f"A, b, c: need shapes (n, n), (n,), (n,), got {A.shape}, {b.shape}, {c.shape}"
        )
    if not all(np.all(np.isfinite(value)) for value in (A, b, c)):
        problems.append("A, b, c: every entry must be finite")
    return problems


def inverse_transfer(A: Real, b: Real, c: Real, s: ArrayLike) -> Complex:
    """``1/G(s)`` for stacked systems.

    Parameters
    ----------
    A : array (..., n, n)
    b : array (..., n)
    c : array (n,)
    s : complex array, broadcast against the stack

    Returns
    -------
    array (...)
        Finite at the poles of ``G``.
    """
    return _system.inverse_transfer(A, b[..., None], c[None, :], s)[..., 0, 0]


def inverse_transfer_gradient(
    A: Real, b: Real, c: Real, dA: Real, db: Real, s: ArrayLike
) -> tuple[Complex, Complex, Complex]:
    """``1/G(s)`` with its derivatives with respect to ``s`` and to the speed.

    Parameters
    ----------
    A, dA : array (..., n, n)
        System matrices and their derivative with respect to the speed.
    b, db : array (..., n)
    c : array (n,)
    s : complex array, broadcast against the stack

    Returns
    -------
    value, d_ds, d_dU : arrays (...)
    """
    zero = np.zeros((1, c.size))
    found = _system.inverse_transfer_gradient(
        A, b[..., None], c[None, :], dA, db[..., None], zero, s
    )
    value, d_ds, d_dU = (matrix[..., 0, 0] for matrix in found)
    return value, d_ds, d_dU


class LureFamily(Protocol):
    """One LureSystem a speed. Obligations:

    1. ``at(U)`` returns the system at the speed ``U``; the number of states and ``c`` never change.
    2. ``stack`` returns ``A`` (m, n, n) and ``b`` (m, n) for ``m`` speeds at once.
    3. ``derivative`` returns ``dA/dU`` and ``db/dU``, stacked as ``stack`` does.
    4. ``search_range`` is the default (low, high) of analyses that search over speed.

    Reference implementation: :class:`SectionFamily`.
    """

    @property
    def c(self) -> Real: ...

    @property
    def state_names(self) -> tuple[str, ...]: ...

    @property
    def search_range(self) -> tuple[float, float]: ...

    def at(self, speed: float) -> LureSystem: ...

    def stack(self, speeds: ArrayLike) -> tuple[Real, Real]: ...

    def derivative(self, speeds: ArrayLike) -> tuple[Real, Real]: ...


class _OneSpring:
    """A family with one output in the vectors of a LureFamily; ``model`` is the family itself."""

    @cached_property
    def model(self) -> Family:
        """The same family as every analysis takes it."""
        raise NotImplementedError

    @cached_property
    def c(self) -> Real:
        """Row (n,) that picks the nonlinear coordinate from the state."""
        row: Real = self.model.stack(self.search_range[0])[2][0]
        return row

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the states, in order."""
        return self.model.state_names

    @property
    def search_range(self) -> tuple[float, float]:
        """Default range of speeds (low, high)."""
        return self.model.search_range

    @property
    def scale(self) -> Scale | None:
        """What turns results into SI units, where there is such a thing."""
        return self.model.scale

    def at(self, speed: float) -> LureSystem:
        """The system at one speed.

        Raises
        ------
        InputError
            If the speed is none at which the family is given.
        """
        return LureSystem.of(self.model.at(speed))

    def stack(self, speeds: ArrayLike) -> tuple[Real, Real]:
        """``A`` (…, n, n) and ``b`` (…, n) at speeds of any shape."""
        A, B, _, _ = self.model.stack(speeds)
        return A, B[..., 0]

    def derivative(self, speeds: ArrayLike) -> tuple[Real, Real]:
        """``dA/dU`` (…, n, n) and ``db/dU`` (…, n)."""
        dA, dB, _, _ = self.model.derivative(speeds)
        return dA, dB[..., 0]


@dataclass(frozen=True, eq=False)
class SectionFamily(_OneSpring):
    """The typical section at every airspeed: ``A(U) = A0 + A1/U + A2/U^2``, ``b(U) = b2/U^2``.

    Its nonlinear spring is the one in pitch; :class:`~aeroflutter.model.family.SectionModel` takes
    springs in any coordinate.

    Parameters
    ----------
    section : TypicalSection
    aerodynamics : Wagner or QuasiSteady

    Notes
    -----
    States are (xi, alpha, xi', alpha', z_1 … z_n), primes being derivatives with respect to
    tau = V t/b; z_i are the lag states of the indicial lift. Quasi-steady sections have no z_i.
    The default search covers speeds from 0.02 to 20 times ``r_alpha sqrt(mu)``, the speed whose
    dynamic pressure balances the pitch stiffness.
    """

    section: TypicalSection
    aerodynamics: Aerodynamics = field(default_factory=Wagner)

    @cached_property
    def model(self) -> SectionModel:
        """The same family as every analysis takes it."""
        return SectionModel(self.section, self.aerodynamics, ("pitch",))

    @property
    def terms(self) -> tuple[Real, Real, Real, Real, Real]:
        """``(A0, A1, A2, b2, c)``."""
        A0, A1, A2, B2, C = self.model.terms
        return A0, A1, A2, B2[:, 0], C[0]


@dataclass(frozen=True, eq=False)
class SampledFamily(_OneSpring):
    """A linear model from elsewhere, given at several speeds and splined between them.

    Parameters
    ----------
    speeds : sequence of float
        Strictly increasing, at least two.
    systems : sequence of LureSystem
        One a speed, all with the same states and the same ``c``.

    Raises
    ------
    InputError
        If the speeds do not increase or the systems do not match.

    Notes
    -----
    Entries of ``A`` and ``b`` are interpolated by a spline of degree three, or lower where there
    are fewer than four speeds. ``search_range`` is the range of the samples.
    """

    speeds: Sequence[float]
    systems: Sequence[LureSystem]

    def __post_init__(self) -> None:
        self.model  # noqa: B018  # what does not fit is refused at once

    @cached_property
    def model(self) -> SampledModel:
        """The same family as every analysis takes it."""
        return SampledModel(self.speeds, [item.system for item in self.systems])


@dataclass(frozen=True, eq=False)
class FixedFamily(_OneSpring):
    """A system that does not depend on speed, for analyses at one condition."""

    system: LureSystem
    search_range: tuple[float, float] = (0.0, 1.0)

    @cached_property
    def model(self) -> FixedModel:
        """The same family as every analysis takes it."""
        return FixedModel(self.system.system, self.search_range)


@dataclass(frozen=True, eq=False)
class SpringFamily(_OneSpring):
    """A family with one output, such as a section with a spring in heave, as a LureFamily.

    Parameters
    ----------
    model : Family
        With one output and without a load.
    """

    model: Family

    def __post_init__(self) -> None:
        LureSystem.of(self.model.at(self.search_range[0]))  # what does not fit is refused at once


@dataclass(frozen=True, eq=False)
class _Matrices:
    """A LureFamily of the user's own as a Family."""

    family: LureFamily

    @cached_property
    def _first(self) -> System:
        return self.at(self.search_range[0])

    @property
    def names(self) -> tuple[str, ...]:
        return self._first.names

    @property
    def units(self) -> tuple[str, ...]:
        return self._first.units

    @property
    def state_names(self) -> tuple[str, ...]:
        return self.family.state_names

    @property
    def search_range(self) -> tuple[float, float]:
        return self.family.search_range

    @property
    def scale(self) -> Scale | None:
        return getattr(self.family, "scale", None)

    def at(self, speed: float) -> System:
        return as_system(self.family.at(speed))

    def stack(self, speeds: ArrayLike) -> Matrices:
        return self._columns(*self.family.stack(speeds), self.family.c)

    def derivative(self, speeds: ArrayLike) -> Matrices:
        return self._columns(*self.family.derivative(speeds), np.zeros(self.family.c.size))

    @staticmethod
    def _columns(A: Real, b: Real, c: Real) -> Matrices:
        C = np.broadcast_to(c[None, :], (*A.shape[:-2], 1, c.size))
        return A, b[..., None], C, np.zeros(b.shape)


AnySystem: TypeAlias = System | LureSystem
AnyFamily: TypeAlias = Family | LureFamily
"""Systems and families, given by matrices or, with one spring, by vectors."""


def as_system(system: AnySystem) -> System:
    """The system itself, whether it is given by matrices or, with one spring, by vectors."""
    return system.system if isinstance(system, LureSystem) else system


def as_family(family: AnyFamily) -> Family:
    """The family itself, whether its systems are given by matrices or, with one spring, by vectors.

    A LureFamily is known by its row ``c``.
    """
    if isinstance(family, _OneSpring):
        return family.model
    return _Matrices(cast("LureFamily", family)) if hasattr(family, "c") else family


def as_lure(family: AnyFamily) -> LureFamily:
    """A family of one output as vectors, whichever way it is written."""
    return cast("LureFamily", family) if hasattr(family, "c") else SpringFamily(family)


def static_stiffness(family: LureFamily) -> Real:
    """``1/G(0)`` at five speeds over the family's range: minus the load per unit of steady y."""
    speeds = np.linspace(*family.search_range, 5)
    A, b = family.stack(speeds)
    return np.asarray(inverse_transfer(A, b, family.c, np.zeros(speeds.size)).real)


def integrators(family: AnyFamily) -> NDArray[np.bool_]:
    """For each output whether its y can rest anywhere, all springs being without moment, (m,).

    A section's heave is one where its own spring stands outside: nothing else depends on it.
    """
    whole = as_family(family)
    speeds = np.linspace(*whole.search_range, 5)
    A, B, C, _ = whole.stack(speeds)
    m = B.shape[-1]
    if len(np.unique(C[0], axis=0)) < m:  # springs that share a coordinate hold one another
        return np.zeros(m, dtype=bool)
    static = _system.inverse_transfer(A, B, C, np.zeros(speeds.size)).real
    return np.asarray(np.all(np.abs(static) <= _ROUND_OFF, axis=(0, 1)))


def integrates(family: LureFamily) -> bool:
    """Whether y can rest anywhere without a moment at every speed, ``1/G(0) = 0``.

    The spring's slopes are of order one, and so is what 1/G(0) is compared with.
    """
    return bool(np.all(np.abs(static_stiffness(family)) <= _ROUND_OFF))
