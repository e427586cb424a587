"""One system a speed, and the section as such a family."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from aeroflutter.errors import InputError
from aeroflutter.model.aerodynamics import Aerodynamics, Wagner
from aeroflutter.model.equations import COORDINATES, SectionTerms, coordinates, state_terms
from aeroflutter.model.section import Scale, TypicalSection
from aeroflutter.model.system import Real, System

__all__ = ["Family", "FixedModel", "SampledModel", "SectionModel"]

ROUND_OFF = 1e-9
"""By which a speed may lie beyond the samples, relative."""

SLOWEST = 1e-30
"""Speed below which the section's matrices, polynomials in 1/U, are not looked at."""


def too_slow(speed: float) -> None:
    """Refuse a speed next to nothing."""
    if speed < SLOWEST:
        raise InputError([f"speed: {speed:g} is too slow; give {SLOWEST:g} or more"])


Matrices = tuple[Real, Real, Real, Real]


class Family(Protocol):
    """One System a speed. Obligations:

    1. ``at(U)`` returns the system at the speed ``U``; the number of states and of outputs, their
       names and their units never change, nor does ``C``.
    2. ``stack`` returns ``A`` (…, n, n), ``B`` (…, n, m), ``C`` (…, m, n) and ``d`` (…, n) at
       speeds of any shape.
    3. ``derivative`` returns their derivatives with respect to the speed, of the same shapes.
    4. ``search_range`` is the default (low, high) of analyses that search over speed.
    5. ``scale`` turns speeds into m/s and reduced frequencies into Hz, or is None.

    Reference implementation: :class:`SectionModel`. A family of systems with one spring and
    without a load may be a :class:`~aeroflutter.model.lure.LureFamily` instead.
    """

    @property
    def names(self) -> tuple[str, ...]: ...

    @property
    def units(self) -> tuple[str, ...]: ...

    @property
    def state_names(self) -> tuple[str, ...]: ...

    @property
    def search_range(self) -> tuple[float, float]: ...

    @property
    def scale(self) -> Scale | None: ...

    def at(self, speed: float) -> System: ...

    def stack(self, speeds: ArrayLike) -> Matrices: ...

    def derivative(self, speeds: ArrayLike) -> Matrices: ...


@dataclass(frozen=True, eq=False)
class SectionModel:
    """The typical section with springs in chosen coordinates, at every speed.

    ``A(U) = A0 + A1/U + A2/U^2``, ``B(U) = B2/U^2``; ``C`` picks the coordinates.

    Parameters
    ----------
    section : TypicalSection
    aerodynamics : Wagner or QuasiSteady
    springs : sequence of str
        Coordinates whose springs stand outside of ``A``, one an output, in this order:
        ``"pitch"``, ``"heave"``, ``"flap"``. One that is named twice carries two springs. The
        spring of every other coordinate is linear, of its nominal stiffness.
    stiffness : sequence of float, optional
        What a unit slope of each of these springs is worth, over the nominal stiffness of its
        coordinate; one by default.
    linear : mapping of str to float, optional
        Coordinates that carry a linear spring of another stiffness than the nominal one, over it.
        Where a coordinate is one of ``springs`` too, this spring is there beside that one.

    Raises
    ------
    InputError
        If a coordinate is not one of the section, or a stiffness is not finite.

    Notes
    -----
    A spring of unit slope has the nominal stiffness of its coordinate. Moments are measured in the
    unit of the coordinate: radians of pitch and flap, semi-chords of heave. The default search
    range is 0.02 to 20 times ``r_alpha sqrt(mu)``, the speed at which the dynamic pressure
    balances the pitch stiffness.
    """

    section: TypicalSection
    aerodynamics: Aerodynamics = field(default_factory=Wagner)
    springs: Sequence[str] = ("pitch",)
    stiffness: Sequence[float] | None = None
    linear: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "springs", tuple(self.springs))
        given = [1.0] * len(self.springs) if self.stiffness is None else self.stiffness
        object.__setattr__(self, "stiffness", tuple(float(value) for value in given))
        problems = self._problems()
        if problems:
            raise InputError(problems)
        object.__setattr__(self, "_terms", self._assemble())

    def _problems(self) -> list[str]:
        known = coordinates(self.section)
        allowed = " or ".join(known)
        problems = [
            f"{key}: {name!r} is no coordinate of it; use {allowed}"
            for key, names in (("springs", self.springs), ("linear", self.linear))
            for name in names
            if name not in known
        ]
        if len(self._weights) != len(self.springs):
            counts = f"{len(self.springs)} and {len(self._weights)}"
            problems.append(f"springs and stiffness: need as many of each, got {counts}")
        if not all(np.isfinite([*self._weights, *self.linear.values()])):
            problems.append("stiffness and linear: every number must be finite")
        return problems

    @property
    def _weights(self) -> tuple[float, ...]:
        assert self.stiffness is not None  # filled in by __post_init__
        return tuple(self.stiffness)

    def _assemble(self) -> SectionTerms:
        """Every spring that is not nominal outside of A first, then the linear ones in again."""
        known = coordinates(self.section)
        numbers = tuple(known.index(name) for name in (*self.springs, *self.linear))
        terms = state_terms(self.section, self.aerodynamics, numbers)
        m = len(self.springs)
        slopes = np.array(list(self.linear.values()))
        return terms._replace(
            A2=terms.A2 - (terms.B2[:, m:] * slopes) @ terms.C[m:],
            B2=terms.B2[:, :m] * np.array(self._weights),
            C=terms.C[:m],
        )

    @property
    def terms(self) -> SectionTerms:
        """The matrices that do not depend on speed."""
        return self._terms  # type: ignore[attr-defined]

    @property
    def names(self) -> tuple[str, ...]:
        """Coordinates of the outputs."""
        return tuple(self.springs)

    @property
    def units(self) -> tuple[str, ...]:
        """Units of the outputs."""
        return tuple(COORDINATES[name].unit for name in self.springs)

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the states, in order."""
        positions = [COORDINATES[name].state for name in coordinates(self.section)]
        lags = len(self.terms.A0) - 2 * len(positions)
        rates = (f"{name}_rate" for name in positions)
        return (*positions, *rates, *(f"z{i + 1}" for i in range(lags)))

    @property
    def search_range(self) -> tuple[float, float]:
        """Default range of speeds (low, high)."""
        reference = self.section.r_alpha * np.sqrt(self.section.mu)
        return 0.02 * reference, 20.0 * reference

    @property
    def scale(self) -> Scale | None:
        """What turns results into SI units, where the section has it."""
        return self.section.scale

    def at(self, speed: float) -> System:
        """The section at one speed U*.

        Raises
        ------
        InputError
            If the speed is not positive and finite.
        """
        if not (np.isfinite(speed) and speed > 0):
            raise InputError([f"speed: must be a positive finite number, got {speed!r}"])
        too_slow(speed)
        return System(*self.stack(speed), self.names, self.units, self.state_names)

    def stack(self, speeds: ArrayLike) -> Matrices:
        """``A`` (…, n, n), ``B`` (…, n, m), ``C`` (…, m, n), ``d`` (…, n), speeds of any shape."""
        terms = self.terms
        v = (1.0 / np.asarray(speeds, dtype=float))[..., None, None]
        A = terms.A0 + v * terms.A1 + v**2 * terms.A2
        return (
            A,
            v**2 * terms.B2,
            np.broadcast_to(terms.C, (*v.shape[:-2], *terms.C.shape)),
            (np.zeros(A.shape[:-1])),
        )

    def derivative(self, speeds: ArrayLike) -> Matrices:
        """Derivatives of ``stack`` with respect to the speed."""
        terms = self.terms
        v = (1.0 / np.asarray(speeds, dtype=float))[..., None, None]
        dA = -(v**2) * terms.A1 - 2 * v**3 * terms.A2
        return (
            dA,
            -2 * v**3 * terms.B2,
            np.zeros((*v.shape[:-2], *terms.C.shape)),
            (np.zeros(dA.shape[:-1])),
        )


@dataclass(frozen=True, eq=False)
class SampledModel:
    """A linear model from elsewhere, given at several speeds and splined between them.

    Parameters
    ----------
    speeds : sequence of float
        Strictly increasing, at least two.
    systems : sequence of System
        One a speed, all with the same states and the same ``C``.
    scale : Scale, optional

    Raises
    ------
    InputError
        If the speeds do not increase or the systems do not match.

    Notes
    -----
    Entries of ``A``, ``B`` and ``d`` are interpolated by a spline of degree three, or lower where
    there are fewer than four speeds. ``search_range`` is the range of the samples.
    """

    speeds: Sequence[float]
    systems: Sequence[System]
    scale: Scale | None = None

    def __post_init__(self) -> None:
        from scipy.interpolate import make_interp_spline

        speeds = np.array(self.speeds, dtype=float)
        if speeds.ndim != 1 or speeds.size < 2 or speeds.size != len(self.systems):
            raise InputError(["speeds: need one speed a system, at least two"])
        problems = []
        if not (np.all(np.isfinite(speeds)) and np.all(np.diff(speeds) > 0)):
            problems.append("speeds: must be finite and strictly increasing")
        first = self.systems[0]
        if any(s.order != first.order or not np.array_equal(s.C, first.C) for s in self.systems):
            problems.append("systems: must all have the same states and the same rows of outputs")
        if problems:
            raise InputError(problems)
        columns = np.array([np.column_stack([s.A, s.B, s.load]) for s in self.systems])
        spline = make_interp_spline(speeds, columns, k=min(3, speeds.size - 1))
        object.__setattr__(self, "_spline", spline)
        object.__setattr__(self, "_slope", spline.derivative())

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the outputs."""
        return self.systems[0].names

    @property
    def units(self) -> tuple[str, ...]:
        """Units of the outputs."""
        return self.systems[0].units

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the states, in order."""
        return self.systems[0].state_names

    @property
    def search_range(self) -> tuple[float, float]:
        """First and last of the given speeds."""
        return float(self.speeds[0]), float(self.speeds[-1])

    def at(self, speed: float) -> System:
        """The interpolated system at one speed.

        Raises
        ------
        InputError
            If the speed lies outside the samples.
        """
        low, high = self.search_range
        within = min(max(speed, low), high)
        if not abs(speed - within) <= ROUND_OFF * abs(within):  # exp(log(5)) is more than five
            raise InputError([f"speed: must lie between {low:g} and {high:g}, got {speed!r}"])
        return System(*self.stack(within), self.names, self.units, self.state_names)

    def stack(self, speeds: ArrayLike) -> Matrices:
        """``A`` (…, n, n), ``B`` (…, n, m), ``C`` (…, m, n), ``d`` (…, n), speeds of any shape."""
        columns = self._spline(np.asarray(speeds, dtype=float))  # type: ignore[attr-defined]
        return self._split(columns, self.systems[0].C)

    def derivative(self, speeds: ArrayLike) -> Matrices:
        """Derivatives of ``stack`` with respect to the speed."""
        columns = self._slope(np.asarray(speeds, dtype=float))  # type: ignore[attr-defined]
        return self._split(columns, np.zeros_like(self.systems[0].C))

    @staticmethod
    def _split(columns: Real, C: Real) -> Matrices:
        n = columns.shape[-2]
        rows = np.broadcast_to(C, (*columns.shape[:-2], *C.shape))
        return columns[..., :n], columns[..., n:-1], rows, columns[..., -1]


@dataclass(frozen=True, eq=False)
class FixedModel:
    """A system that does not depend on speed, for analyses at one condition."""

    system: System
    search_range: tuple[float, float] = (0.0, 1.0)
    scale: Scale | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the outputs."""
        return self.system.names

    @property
    def units(self) -> tuple[str, ...]:
        """Units of the outputs."""
        return self.system.units

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the states, in order."""
        return self.system.state_names

    def at(self, speed: float) -> System:
        """The system, whatever the speed."""
        return self.system

    def stack(self, speeds: ArrayLike) -> Matrices:
        """``A`` (…, n, n), ``B`` (…, n, m), ``C`` (…, m, n), ``d`` (…, n), the same everywhere."""
        system = self.system
        A, B, C, d = (
            np.broadcast_to(value, (*np.shape(speeds), *value.shape))
            for value in (system.A, system.B, system.C, system.load)
        )
        return A, B, C, d

    def derivative(self, speeds: ArrayLike) -> Matrices:
        """Zeros of the shapes of ``stack``."""
        A, B, C, d = (np.zeros(value.shape) for value in self.stack(speeds))
        return A, B, C, d
