"""The one door of the analyses: a linear system with one scalar feedback.

``x' = A(U) x - b(U) F(c x)``, where ``F`` is the restoring moment of a spring, possibly with
memory. Nothing behind this door knows how many states there are or that ``c x`` is a pitch angle.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aeroflutter.errors import InputError
from aeroflutter.generated import quasi_steady as _quasi_steady
from aeroflutter.generated import section as _section
from aeroflutter.model.aerodynamics import Aerodynamics, QuasiSteady, Wagner
from aeroflutter.model.section import TypicalSection

if TYPE_CHECKING:
    import control

Real = NDArray[np.float64]
Complex = NDArray[Any]  # of complex numbers


@dataclass(frozen=True, eq=False)
class LureSystem:
    """Linear system with one scalar feedback, ``x' = A x - b F(c x)``.

    Parameters
    ----------
    A : array (n, n)
    b, c : array (n,)
    state_names : tuple of str, optional
        Defaults to ``x1 … xn``.

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

    def transfer(self, s: ArrayLike) -> Complex:
        """``G(s) = c (sI - A)^-1 b`` at every ``s`` (any shape)."""
        at = np.asarray(s, dtype=complex)
        resolvent = at[..., None, None] * np.eye(self.order) - self.A
        forcing = np.broadcast_to(self.b[:, None], (*at.shape, self.order, 1))
        return np.asarray(np.linalg.solve(resolvent, forcing)[..., 0] @ self.c)

    def inverse_transfer(self, s: ArrayLike) -> Complex:
        """``1/G(s)`` at every ``s`` (any shape), finite at the poles of ``G``."""
        return inverse_transfer(self.A, self.b, self.c, s)

    def static_gain_inverse(self) -> float:
        """``1/G(0)``: minus the static load per unit of steady ``y = c x``."""
        return float(self.inverse_transfer(0.0).real)

    def closed(self, stiffness: complex) -> NDArray[Any]:
        """``A - N b c``: the system with the spring replaced by a linear one of stiffness N."""
        return np.asarray(self.A - stiffness * np.outer(self.b, self.c))

    def to_control(self) -> control.StateSpace:
        """The system from moment to ``y``, ``G(s)``, as a python-control StateSpace."""
        import control

        return control.ss(self.A, self.b[:, None], self.c[None, :], [[0.0]])

    @classmethod
    def from_control(cls, system: control.StateSpace) -> LureSystem:
        """The loop in which a python-control system is closed by ``-F(y)``.

        Raises
        ------
        InputError
            If the system has not one input and one output, is in discrete time, or has direct
            feedthrough (the loop would be algebraic).
        """
        problems = []
        if system.ninputs != 1 or system.noutputs != 1:
            problems.append("system: must have one input and one output")
        elif np.any(system.D):
            problems.append("system: D must be zero, or the loop with the spring is algebraic")
        if system.isdtime(strict=True):
            problems.append("system: must be in continuous time")
        if problems:
            raise InputError(problems)
        return cls(system.A, system.B[:, 0], system.C[0])


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


def _bordered(A: Real, b: Real, c: Real, s: Complex) -> Complex:
    """``[[sI - A, b], [c, 0]]``, regular at the poles of G, for stacked A, b and s."""
    n = c.size
    shape = np.broadcast_shapes(A.shape[:-2], s.shape)
    matrix = np.zeros((*shape, n + 1, n + 1), dtype=complex)
    matrix[..., :n, :n] = s[..., None, None] * np.eye(n) - A
    matrix[..., :n, n] = b
    matrix[..., n, :n] = c
    return matrix


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
        Solves ``(sI - A) x + g b = 0, c x = 1``, so that ``g = -1/G``; no pole of G interferes.
    """
    matrix = _bordered(A, b, c, np.asarray(s, dtype=complex))
    unit = np.zeros((*matrix.shape[:-1], 1), dtype=complex)
    unit[..., -1, 0] = 1.0
    result: Complex = -np.linalg.solve(matrix, unit)[..., -1, 0]
    return result


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
    n = c.size
    inverse = np.linalg.inv(_bordered(A, b, c, np.asarray(s, dtype=complex)))
    column, row = inverse[..., :, n], inverse[..., n, :]
    d_ds = np.einsum("...i,...i->...", row[..., :n], column[..., :n])
    forcing = -np.einsum("...ij,...j->...i", dA, column[..., :n]) + db * column[..., n, None]
    d_dU = np.einsum("...i,...i->...", row[..., :n], forcing)
    return -column[..., n], d_ds, d_dU


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


@dataclass(frozen=True, eq=False)
class SectionFamily:
    """The typical section at every airspeed: ``A(U) = A0 + A1/U + A2/U^2``, ``b(U) = b2/U^2``.

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

    def __post_init__(self) -> None:
        values = {
            name: getattr(self.section, name)
            for name in (
                "mu",
                "a_h",
                "x_alpha",
                "r_alpha",
                "omega_bar",
                "zeta_alpha",
                "zeta_xi",
            )
        }
        if isinstance(self.aerodynamics, QuasiSteady):
            terms = _quasi_steady.state_terms(**values)
        else:
            lags = np.array(self.aerodynamics.a), np.array(self.aerodynamics.b)
            terms = _section.state_terms(**values, a=lags[0], b=lags[1])
        object.__setattr__(self, "_terms", terms)

    @property
    def terms(self) -> tuple[Real, Real, Real, Real, Real]:
        """``(A0, A1, A2, b2, c)``."""
        return self._terms  # type: ignore[attr-defined]

    @property
    def c(self) -> Real:
        """Row (n,) that picks pitch from the state."""
        return self.terms[4]

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the states, in order."""
        lags = self.c.size - 4
        return ("xi", "alpha", "xi_rate", "alpha_rate", *(f"z{i + 1}" for i in range(lags)))

    @property
    def search_range(self) -> tuple[float, float]:
        """Default range of speeds (low, high)."""
        reference = self.section.r_alpha * np.sqrt(self.section.mu)
        return 0.02 * reference, 20.0 * reference

    def at(self, speed: float) -> LureSystem:
        """The section at one speed U*."""
        _require_positive(speed)
        A, b = self.stack(speed)
        return LureSystem(A, b, self.c, self.state_names)

    def stack(self, speeds: ArrayLike) -> tuple[Real, Real]:
        """``A`` (…, n, n) and ``b`` (…, n) at speeds of any shape."""
        A0, A1, A2, b2, _ = self.terms
        v = 1.0 / np.asarray(speeds, dtype=float)
        w = v[..., None, None]
        return A0 + w * A1 + w**2 * A2, v[..., None] ** 2 * b2

    def derivative(self, speeds: ArrayLike) -> tuple[Real, Real]:
        """``dA/dU`` (…, n, n) and ``db/dU`` (…, n)."""
        _, A1, A2, b2, _ = self.terms
        v = 1.0 / np.asarray(speeds, dtype=float)
        w = v[..., None, None]
        return -(w**2) * A1 - 2 * w**3 * A2, -2 * v[..., None] ** 3 * b2


@dataclass(frozen=True, eq=False)
class SampledFamily:
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
        from scipy.interpolate import make_interp_spline

        speeds = np.array(self.speeds, dtype=float)
        problems = []
        if speeds.ndim != 1 or speeds.size < 2 or speeds.size != len(self.systems):
            problems.append("speeds: need one speed a system, at least two")
        elif not (np.all(np.isfinite(speeds)) and np.all(np.diff(speeds) > 0)):
            problems.append("speeds: must be finite and strictly increasing")
        first = self.systems[0]
        if any(s.order != first.order or not np.array_equal(s.c, first.c) for s in self.systems):
            problems.append("systems: must all have the same states and the same c")
        if problems:
            raise InputError(problems)
        columns = np.array([np.column_stack([s.A, s.b]) for s in self.systems])
        spline = make_interp_spline(speeds, columns, k=min(3, speeds.size - 1))
        object.__setattr__(self, "_spline", spline)
        object.__setattr__(self, "_slope", spline.derivative())

    @property
    def c(self) -> Real:
        """Row (n,) that picks the nonlinear coordinate from the state."""
        return self.systems[0].c

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the states, in order."""
        return self.systems[0].state_names

    @property
    def search_range(self) -> tuple[float, float]:
        """First and last of the given speeds."""
        return float(self.speeds[0]), float(self.speeds[-1])

    def at(self, speed: float) -> LureSystem:
        """The interpolated system at one speed.

        Raises
        ------
        InputError
            If the speed lies outside the samples.
        """
        low, high = self.search_range
        if not low <= speed <= high:
            raise InputError([f"speed: must lie between {low:g} and {high:g}, got {speed!r}"])
        A, b = self.stack(speed)
        return LureSystem(A, b, self.c, self.state_names)

    def stack(self, speeds: ArrayLike) -> tuple[Real, Real]:
        """``A`` (…, n, n) and ``b`` (…, n) at speeds of any shape."""
        columns = self._spline(np.asarray(speeds, dtype=float))  # type: ignore[attr-defined]
        return columns[..., :-1], columns[..., -1]

    def derivative(self, speeds: ArrayLike) -> tuple[Real, Real]:
        """``dA/dU`` (…, n, n) and ``db/dU`` (…, n)."""
        columns = self._slope(np.asarray(speeds, dtype=float))  # type: ignore[attr-defined]
        return columns[..., :-1], columns[..., -1]


@dataclass(frozen=True, eq=False)
class FixedFamily:
    """A system that does not depend on speed, for analyses at one condition."""

    system: LureSystem
    search_range: tuple[float, float] = (0.0, 1.0)

    @property
    def c(self) -> Real:
        """Row (n,) that picks the nonlinear coordinate from the state."""
        return self.system.c

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the states, in order."""
        return self.system.state_names

    def at(self, speed: float) -> LureSystem:
        """The system, whatever the speed."""
        return self.system

    def stack(self, speeds: ArrayLike) -> tuple[Real, Real]:
        """``A`` (…, n, n) and ``b`` (…, n), the same at every speed."""
        shape = np.shape(speeds)
        n = self.system.order
        return (
            np.broadcast_to(self.system.A, (*shape, n, n)),
            np.broadcast_to(self.system.b, (*shape, n)),
        )

    def derivative(self, speeds: ArrayLike) -> tuple[Real, Real]:
        """Zeros of the shapes of ``stack``."""
        shape = np.shape(speeds)
        n = self.system.order
        return np.zeros((*shape, n, n)), np.zeros((*shape, n))


def _require_positive(speed: float) -> None:
    if not (np.isfinite(speed) and speed > 0):
        raise InputError([f"speed: must be a positive finite number, got {speed!r}"])
