"""What a section is made of, as data: coordinates, energies, mode shapes and nondimensional groups.

A trailing-edge flap, or any other degree of freedom, is one more :class:`Coordinate` in a
:class:`Configuration` (see ``derive/flap.py``); the derivation itself never counts them.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import sympy as sp

from derive import symbols as s
from derive.thin_airfoil import Shape


@dataclass(frozen=True)
class Coordinate:
    """One generalised coordinate q(t) = length q(tau).

    ``shape`` is the downward displacement of the chord line, in semichords, a unit of q(tau);
    ``scale`` the energy its equation is divided by; ``equation`` what that equation is called.
    """

    name: str
    latex: str
    shape: Shape
    length: sp.Expr
    scale: sp.Expr
    equation: str

    @property
    def displacement(self) -> sp.Function:
        """Dimensional displacement as a function of time."""
        return sp.Function(f"{self.name}_t", real=True)(s.TIME)


@dataclass(frozen=True)
class Load:
    """An aerodynamic coefficient: ``factor`` times what one equation has on its left-hand side."""

    name: str
    title: str
    coefficient: str
    row: int
    factor: sp.Expr
    equation: str


@dataclass(frozen=True)
class Configuration:
    """Energies in terms of ``coordinates``, each of which has a spring of its own.

    ``stiffness`` holds the nominal stiffness of every spring. A spring of another law gives the
    moment ``stiffness`` times F of its coordinate, so that F is the coordinate itself where it is
    linear; ``nonlinear`` counts the coordinate whose spring is nonlinear where nothing else is
    said. Every equation is divided by its ``scale``. ``groups`` turns the dimensional quantities
    into the nondimensional ``parameters``, given with what they mean; those with ``defaults`` come
    last. ``abbreviations`` are names for expressions that recur in the emitted source.
    """

    name: str
    coordinates: tuple[Coordinate, ...]
    kinetic: sp.Expr
    stiffness: tuple[sp.Expr, ...]
    dissipation: sp.Expr
    nonlinear: int
    parameters: dict[sp.Symbol, str]
    groups: dict[sp.Symbol, sp.Expr]
    defaults: dict[sp.Symbol, float] = field(default_factory=dict)
    abbreviations: dict[sp.Symbol, sp.Expr] = field(default_factory=dict)
    loads: tuple[Load, ...] = ()

    @property
    def potential(self) -> sp.Expr:
        """Potential energy with every spring linear."""
        springs = zip(self.stiffness, self.coordinates, strict=True)
        return sum((k * item.displacement**2 / 2 for k, item in springs), sp.Integer(0))


_MASS = s.MU * sp.pi * s.DENSITY * s.SEMICHORD**2
_INERTIA = _MASS * s.SEMICHORD**2 * s.R_ALPHA**2
_OMEGA_ALPHA = s.VELOCITY / (s.SEMICHORD * s.SPEED)
_OMEGA_XI = s.OMEGA_BAR * _OMEGA_ALPHA

HEAVE = Coordinate(
    name="xi",
    latex=r"\xi",
    shape=Shape(sp.Integer(1)),
    length=s.SEMICHORD,
    scale=_MASS * s.VELOCITY**2,
    equation="heave equation",
)
PITCH = Coordinate(
    name="alpha",
    latex=r"\alpha",
    shape=Shape(s.X - s.A_H),
    length=sp.Integer(1),
    scale=_INERTIA * s.VELOCITY**2 / s.SEMICHORD**2,
    equation="pitch equation",
)
_h, _alpha = HEAVE.displacement, PITCH.displacement

TYPICAL_SECTION = Configuration(
    name="typical section in pitch and heave",
    coordinates=(HEAVE, PITCH),
    kinetic=s.MASS_IN_HEAVE * _h.diff() ** 2 / 2
    + s.STATIC_MOMENT * _h.diff() * _alpha.diff()
    + s.INERTIA * _alpha.diff() ** 2 / 2,
    stiffness=(s.K_H, s.K_ALPHA),
    dissipation=s.C_H * _h.diff() ** 2 / 2 + s.C_ALPHA * _alpha.diff() ** 2 / 2,
    nonlinear=1,
    parameters={
        s.MU: "Mass ratio m / (pi rho b^2).",
        s.A_H: "Elastic axis behind midchord, in semichords.",
        s.X_ALPHA: "Centre of mass behind the elastic axis, in semichords.",
        s.R_ALPHA: "Radius of gyration about the elastic axis, in semichords.",
        s.OMEGA_BAR: "Uncoupled heave frequency over uncoupled pitch frequency.",
        s.ZETA_ALPHA: "Damping ratio in pitch.",
        s.ZETA_XI: "Damping ratio in heave.",
        s.HEAVE_MASS: "Mass that moves in heave, supports included, over m.",
    },
    defaults={s.HEAVE_MASS: 1.0},
    groups={
        s.MASS: _MASS,
        s.MASS_IN_HEAVE: s.HEAVE_MASS * _MASS,
        s.STATIC_MOMENT: _MASS * s.SEMICHORD * s.X_ALPHA,
        s.INERTIA: _INERTIA,
        s.K_H: s.HEAVE_MASS * _MASS * _OMEGA_XI**2,
        s.K_ALPHA: _INERTIA * _OMEGA_ALPHA**2,
        s.C_H: 2 * s.ZETA_XI * s.HEAVE_MASS * _MASS * _OMEGA_XI,
        s.C_ALPHA: 2 * s.ZETA_ALPHA * _INERTIA * _OMEGA_ALPHA,
    },
    loads=(
        Load("lift_coefficient", "lift coefficient", "C_L", 0, sp.pi * s.MU, "3.21"),
        Load(
            "moment_coefficient",
            "moment coefficient about the elastic axis",
            "C_M",
            1,
            -sp.pi * s.MU * s.R_ALPHA**2 / 2,
            "3.22",
        ),
    ),
)
