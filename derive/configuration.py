"""What a section is made of, as data: coordinates, energies, mode shapes and nondimensional groups.

A trailing-edge flap, or any other degree of freedom, is one more :class:`Coordinate` in a
:class:`Configuration`; the derivation itself never counts them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from types import MappingProxyType

import sympy as sp

from derive import symbols as s
from derive.thin_airfoil import Pairings, Shape


@dataclass(frozen=True)
class Coordinate:
    """One generalised coordinate q(t) = length * q(tau)."""

    name: str
    latex: str
    shape: Shape
    length: sp.Expr
    scale: sp.Expr
    equation: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "shape", Shape(self.shape.polynomial, self.shape.start, self.name))

    @property
    def displacement(self) -> sp.Function:
        """Dimensional displacement as a function of time."""
        return sp.Function(f"{self.name}_t", real=True)(s.TIME)


@dataclass(frozen=True)
class Configuration:
    """Energies in terms of ``coordinates``; ``nonlinear`` counts the one with the free spring.

    The potential energy leaves out the nonlinear spring: its moment is ``spring`` times F of the
    nonlinear coordinate. Every equation is divided by its ``scale``, an energy. ``groups`` turns
    the dimensional quantities into the nondimensional ``parameters``.
    """

    name: str
    coordinates: tuple[Coordinate, ...]
    kinetic: sp.Expr
    potential: sp.Expr
    dissipation: sp.Expr
    nonlinear: int
    spring: sp.Expr
    parameters: tuple[sp.Symbol, ...]
    groups: dict[sp.Symbol, sp.Expr]
    pairings: Pairings = field(default_factory=lambda: MappingProxyType({}))


_K_H, _K_ALPHA, _C_H, _C_ALPHA = sp.symbols("K_h K_alpha C_h C_alpha", positive=True)
_OMEGA_ALPHA = s.VELOCITY / (s.SEMICHORD * s.SPEED)
_OMEGA_XI = s.OMEGA_BAR * _OMEGA_ALPHA
_MASS = s.MU * sp.pi * s.DENSITY * s.SEMICHORD**2
_INERTIA = _MASS * s.SEMICHORD**2 * s.R_ALPHA**2
_RATE_SQUARED = s.VELOCITY**2 / s.SEMICHORD**2

HEAVE = Coordinate("xi", r"\xi", Shape(sp.Integer(1)), s.SEMICHORD, _MASS * s.VELOCITY**2, "heave")
PITCH = Coordinate(
    "alpha", r"\alpha", Shape(s.X - s.A_H), sp.Integer(1), _INERTIA * _RATE_SQUARED, "pitch"
)
_h, _alpha = HEAVE.displacement, PITCH.displacement

TYPICAL_SECTION = Configuration(
    name="typical section in pitch and heave",
    coordinates=(HEAVE, PITCH),
    kinetic=s.MASS * _h.diff() ** 2 / 2
    + s.STATIC_MOMENT * _h.diff() * _alpha.diff()
    + s.INERTIA * _alpha.diff() ** 2 / 2,
    potential=_K_H * _h**2 / 2,
    dissipation=_C_H * _h.diff() ** 2 / 2 + _C_ALPHA * _alpha.diff() ** 2 / 2,
    nonlinear=1,
    spring=_K_ALPHA,
    parameters=(
        s.MU, s.A_H, s.X_ALPHA, s.R_ALPHA, s.OMEGA_BAR, s.ZETA_ALPHA, s.ZETA_XI,
    ),
    groups={
        s.MASS: _MASS,
        s.STATIC_MOMENT: _MASS * s.SEMICHORD * s.X_ALPHA,
        s.INERTIA: _INERTIA,
        _K_H: _MASS * _OMEGA_XI**2,
        _K_ALPHA: _INERTIA * _OMEGA_ALPHA**2,
        _C_H: 2 * s.ZETA_XI * _MASS * _OMEGA_XI,
        _C_ALPHA: 2 * s.ZETA_ALPHA * _INERTIA * _OMEGA_ALPHA,
    },
)  # fmt: skip
