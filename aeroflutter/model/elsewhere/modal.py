"""Modal models: masses, springs and tabulated air forces of a few modes, as a family.

``M q'' + C q' + K q = ½ rho V² Q(ik) q`` at one density and Mach number. With a rational
approximation of ``Q`` and ``tau = V t/b``

    (M - ½ρb² A2) q'' + (b C/V - ½ρb² A1) q' + (b² K/V² - ½ρb² A0) q = ½ρb² D z,
    z' = -b_j z + E q'

is first order and quadratic in ``1/V``, as the section is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aeroflutter.errors import InputError
from aeroflutter.model.elsewhere.forces import TabulatedForces
from aeroflutter.model.elsewhere.polynomial import PolynomialModel
from aeroflutter.model.elsewhere.rational import Fit, FitOptions, fit
from aeroflutter.model.elsewhere.scale import ModelScale
from aeroflutter.model.family import Matrices
from aeroflutter.model.section import Scale
from aeroflutter.model.system import Real, System

__all__ = ["ModalModel", "Modes"]

_ROUND_OFF = 1e-9


@dataclass(frozen=True, eq=False, kw_only=True)
class Modes:
    """The structure and the air of a few generalised coordinates, in SI units.

    Parameters
    ----------
    mass, stiffness : array (n, n), or (n,) for their diagonals
        ``M`` symmetric and positive definite, ``K`` symmetric.
    damping : array (n, n), or (n,), optional
        ``C``; zero by default.
    forces : TabulatedForces
        Of the same coordinates.
    semichord : float
        The length ``b`` in ``k = omega b/V``, m.
    density : float
        Of the air, kg/m³.

    Raises
    ------
    InputError
        If shapes do not fit, an entry is not finite, or ``M`` is singular or not symmetric.
    """

    mass: Real
    stiffness: Real
    forces: TabulatedForces
    semichord: float
    density: float
    damping: Real | None = None

    def __post_init__(self) -> None:
        n = self.forces.modes
        given = {"mass": self.mass, "damping": self.damping, "stiffness": self.stiffness}
        problems = []
        for name, value in given.items():
            matrix = np.zeros((n, n)) if value is None else np.array(value, dtype=float)
            matrix = np.diag(matrix) if matrix.ndim == 1 else matrix
            object.__setattr__(self, name, matrix)
            if matrix.shape != (n, n):
                problems.append(
                    f"{name}: must be {n} by {n}, as the forces are, got {matrix.shape}"
                )
            elif not np.all(np.isfinite(matrix)):
                problems.append(f"{name}: every entry must be finite")
            elif name != "damping" and not _symmetric(matrix):
                problems.append(f"{name}: must be symmetric")
        for name in ("semichord", "density"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                problems.append(f"{name}: must be a positive finite number, got {value!r}")
        if not problems:
            problems += _definite("mass", self.M)
        if problems:
            raise InputError(problems)

    @property
    def M(self) -> Real:
        """Generalised masses (n, n)."""
        return self.mass

    @property
    def K(self) -> Real:
        """Generalised stiffness (n, n)."""
        return self.stiffness

    @property
    def C(self) -> Real:
        """Generalised damping (n, n)."""
        assert self.damping is not None  # filled in by __post_init__
        return self.damping

    @cached_property
    def wind_off(self) -> Real:
        """Frequencies without air or damping (n,), rad/s, ascending; zero of rigid modes."""
        from scipy.linalg import eigh

        squares = eigh(self.K, self.M, eigvals_only=True)
        squares[np.abs(squares) <= _ROUND_OFF * np.abs(squares).max()] = 0.0
        return np.asarray(np.sqrt(np.maximum(squares, 0.0)))

    @property
    def speeds(self) -> tuple[float, float]:
        """Airspeeds (low, high), m/s, over which the table speaks of these modes.

        From where the highest frequency has the largest ``k`` of the table to where it has the
        smallest, but none below 0.1. Modes that no air force touches do not count.

        Raises
        ------
        InputError
            If no mode with air forces has stiffness.
        """
        from scipy.linalg import eigh

        felt = np.any(self.forces.Q, axis=(0, 2)) | np.any(self.forces.Q, axis=(0, 1))
        part = np.ix_(felt, felt)
        top = float(eigh(self.K[part], self.M[part], eigvals_only=True)[-1])
        if top <= 0:
            raise InputError(
                ["stiffness: is zero, so no range of speeds follows; give speed_range"]
            )
        k = self.forces.k
        reach = self.semichord * float(np.sqrt(top))
        return reach / float(k[-1]), reach / min(max(0.1, float(k[0])), 0.5 * float(k[-1]))


@dataclass(frozen=True, eq=False, kw_only=True)
class ModalModel:
    """Modes with a rational approximation of their air and springs in chosen places, as a family.

    Parameters
    ----------
    modes : Modes
        The springs, with their nominal stiffness, are part of ``K``.
    rows : array (m, n)
        Twist of every spring a unit of each coordinate.
    stiffness : sequence of float
        Nominal stiffness of each, which is taken out of ``K``: N m/rad, or N/m.
    in_stiffness : sequence of bool, optional
        Whether ``K`` holds each of them; it does by default. One that it does not hold is not
        taken out, and is there beside ``K``.
    names, units : tuple of str, optional
        Of the springs; ``"rad"`` or ``"m"``.
    approximation : FitOptions or Fit, optional
    speed_range : tuple of float, optional
        Airspeeds searched, m/s; those of which the table speaks by default.

    Raises
    ------
    InputError
        If shapes do not fit, ``K`` has less stiffness than is taken out of it, or the mass with
        that of the air, ``M - ½ rho b² A2``, is not positive definite.

    Notes
    -----
    Speeds are in m/s, times in semichords travelled. States are the coordinates, their rates and
    the lag states; a coordinate that no air force, no spring and no other touches is none of them.
    A spring of unit slope has its nominal stiffness.
    """

    modes: Modes
    rows: Real
    stiffness: ArrayLike
    in_stiffness: Sequence[bool] | None = None
    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    approximation: FitOptions | Fit | None = None
    speed_range: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        rows = np.atleast_2d(np.array(self.rows, dtype=float))
        object.__setattr__(self, "rows", rows)
        problems = self._problems()
        if problems:
            raise InputError(problems)
        made = self._assembled()
        object.__setattr__(self, "_family", made)
        for name in ("names", "units"):
            object.__setattr__(self, name, getattr(made, name))

    def _problems(self) -> list[str]:
        n, m = self.modes.forces.modes, len(self.rows)
        problems = []
        if self.rows.shape != (m, n):
            problems.append(f"rows: need one number a coordinate ({n}), got {self.rows.shape[1]}")
        elif not np.all(np.isfinite(self.rows)) or not np.all(np.any(self.rows, axis=1)):
            problems.append("rows: must be finite, and none may be zero")
        values = self._stiffness
        if values.shape != (m,) or not np.all(np.isfinite(values) & (values > 0)):
            problems.append(f"stiffness: need {m} positive numbers, one a row")
        if len(self.held) != m:
            problems.append(f"in_stiffness: need {m} flags, one a row")
        return problems

    @property
    def held(self) -> Sequence[bool]:
        """Whether ``K`` holds each spring."""
        return [True] * len(self.rows) if self.in_stiffness is None else self.in_stiffness

    @cached_property
    def fit(self) -> Fit:
        """The rational approximation."""
        given = self.approximation
        return given if isinstance(given, Fit) else fit(self.modes.forces, given)

    @property
    def _stiffness(self) -> Real:
        return np.asarray(self.stiffness, dtype=float)

    @cached_property
    def free_stiffness(self) -> Real:
        """``K`` without its springs (n, n).

        Raises
        ------
        InputError
            If there is less stiffness than is taken out.
        """
        K = self.modes.K
        held = np.asarray(self.held, dtype=bool)
        taken = self.rows[held].T * self._stiffness[held]
        free = K - taken @ self.rows[held]
        least, size = np.linalg.eigvalsh(free).min(), np.abs(K).max()
        if least < min(np.linalg.eigvalsh(K).min(), 0.0) - 1e-6 * size:
            raise InputError(
                ["stiffness: K has less than is taken out of it (what remains is not positive "
                 "semidefinite); give the stiffness that the model was made with, or rows as they "
                 "are in its coordinates"]
            )  # fmt: skip
        return np.asarray(free)

    def whole(self) -> Modes:
        """The modes with every spring linear, of its nominal stiffness: what p-k takes."""
        K = self.free_stiffness + (self.rows.T * self._stiffness) @ self.rows
        modes = self.modes
        return Modes(
            mass=modes.M,
            damping=modes.C,
            stiffness=K,
            forces=modes.forces,
            semichord=modes.semichord,
            density=modes.density,
        )

    @cached_property
    def moving(self) -> NDArray[np.bool_]:
        """Coordinates that are states (n,): those that an air force, a spring or another touches.

        What is left out oscillates for ever by itself and moves nothing.
        """
        Q = self.modes.forces.Q
        touched = np.any(Q, axis=(0, 2)) | np.any(Q, axis=(0, 1)) | np.any(self.rows, axis=0)
        for matrix in (self.modes.M, self.modes.C, self.free_stiffness):
            apart = matrix - np.diag(np.diag(matrix))
            touched |= np.any(apart, axis=0) | np.any(apart, axis=1)
        return np.asarray(touched)

    def _assembled(self) -> PolynomialModel:
        modes, air = self.modes, self.fit
        kept = np.ix_(self.moving, self.moving)
        b, n, lags = modes.semichord, int(self.moving.sum()), len(air.roots)
        pressure = 0.5 * modes.density * b**2
        mass = (modes.M - pressure * air.A2)[kept]
        rows = self.rows[:, self.moving]
        problems = _definite("mass with that of the air, M - ½ρb²A2,", 0.5 * (mass + mass.T))
        if problems:
            raise InputError(
                [f"{line}; fit without apparent mass, or with other lags" for line in problems]
            )
        rate, z = slice(n, 2 * n), slice(2 * n, None)
        A = np.zeros((3, 2 * n + lags, 2 * n + lags))
        A[0, :n, rate] = np.eye(n)
        A[0, rate, :n] = pressure * np.linalg.solve(mass, air.A0[kept])
        A[0, rate, rate] = pressure * np.linalg.solve(mass, air.A1[kept])
        A[0, rate, z] = pressure * np.linalg.solve(mass, air.D[self.moving])
        A[0, z, rate] = air.E[:, self.moving]
        A[0, z, z] = -np.diag(air.roots)
        A[1, rate, rate] = -b * np.linalg.solve(mass, modes.C[kept])
        A[2, rate, :n] = -(b**2) * np.linalg.solve(mass, self.free_stiffness[kept])
        B = np.zeros((3, len(A[0]), len(self.rows)))
        B[2, rate] = b**2 * np.linalg.solve(mass, rows.T * self._stiffness)
        C = np.zeros((len(self.rows), len(A[0])))
        C[:, :n] = rows
        coordinates = [f"q{i + 1}" for i in np.flatnonzero(self.moving)]
        return PolynomialModel(
            A=A,
            B=B,
            C=C,
            variable="1/V",
            search_range=self.modes.speeds if self.speed_range is None else self.speed_range,
            names=self.names,
            units=self.units,
            state_names=(
                *coordinates,
                *(f"{name}_rate" for name in coordinates),
                *(f"z{i + 1}" for i in range(lags)),
            ),
            scale=ModelScale.of(b, "semichord"),
        )

    @property
    def polynomial(self) -> PolynomialModel:
        """The same as polynomials in 1/V."""
        return self._made

    @property
    def _made(self) -> PolynomialModel:
        return self._family  # type: ignore[attr-defined]

    @property
    def search_range(self) -> tuple[float, float]:
        """Airspeeds (low, high) of analyses that search, m/s."""
        return self._made.search_range

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the states, in order."""
        return self._made.state_names

    @property
    def scale(self) -> Scale | None:
        """Speeds are in m/s already; times and reduced frequencies are turned into s and Hz."""
        return self._made.scale

    def at(self, speed: float) -> System:
        """The system at one airspeed in m/s.

        Raises
        ------
        InputError
            If the speed is not positive and finite.
        """
        return self._made.at(speed)

    def stack(self, speeds: ArrayLike) -> Matrices:
        """``A`` (…, n, n), ``B`` (…, n, m), ``C`` (…, m, n), ``d`` (…, n), speeds of any shape."""
        return self._made.stack(speeds)

    def derivative(self, speeds: ArrayLike) -> Matrices:
        """Derivatives of ``stack`` with respect to the speed."""
        return self._made.derivative(speeds)


def _symmetric(matrix: Real) -> bool:
    return bool(np.all(np.abs(matrix - matrix.T) <= 1e-6 * np.abs(matrix).max(initial=0.0)))


def _definite(name: str, matrix: Real) -> list[str]:
    """Why a symmetric matrix cannot be divided by."""
    size = np.sqrt(np.abs(np.diag(matrix)))
    size[size == 0] = 1.0
    values = np.linalg.eigvalsh(matrix / size / size[:, None])
    if values.min() > 1e-12 * max(values.max(), 1e-300):
        return []
    return [f"{name} must be positive definite; it is singular or has a negative eigenvalue"]
