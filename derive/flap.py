"""The typical section with a trailing-edge flap: what a third degree of freedom takes.

One more mode shape, one more inertia and spring, and Theodorsen's constants T2, T3 and T5 for the
pressure that the flap's own motion puts on the flap (NACA Report 496, 1935); the other constants
follow from the mode shapes. The nonlinear spring sits in the flap hinge.
"""

from __future__ import annotations

from dataclasses import replace

import sympy as sp

from derive import symbols as s
from derive.configuration import TYPICAL_SECTION, Configuration, Coordinate
from derive.thin_airfoil import Shape

C_HINGE = sp.Symbol("c_h", real=True)
X_BETA = sp.Symbol("x_beta", real=True)
R_BETA = sp.Symbol("r_beta", positive=True)
OMEGA_BETA_BAR = sp.Symbol("omega_beta_bar", positive=True)
ZETA_BETA = sp.Symbol("zeta_beta", real=True)

_S_BETA, _I_BETA, _K_BETA, _C_BETA = sp.symbols("S_beta I_beta K_beta C_beta", positive=True)
_MASS = TYPICAL_SECTION.groups[s.MASS]
_FLAP_INERTIA = _MASS * s.SEMICHORD**2 * R_BETA**2
_OMEGA_BETA = OMEGA_BETA_BAR * s.VELOCITY / (s.SEMICHORD * s.SPEED)

FLAP = Coordinate(
    name="beta",
    latex=r"\beta",
    shape=Shape(s.X - C_HINGE, start=C_HINGE),
    length=sp.Integer(1),
    scale=_FLAP_INERTIA * s.VELOCITY**2 / s.SEMICHORD**2,
    equation="flap equation",
)


def theodorsen_constants(c: sp.Expr) -> tuple[sp.Expr, sp.Expr, sp.Expr]:
    """Theodorsen's T2, T3 and T5 for a hinge at c."""
    root, arc = sp.sqrt(1 - c**2), sp.acos(c)
    T2 = c * root**2 - root * (1 + c**2) * arc + c * arc**2
    T3 = (
        -(c**2 + sp.Rational(1, 8)) * arc**2
        + c * root * arc * (7 + 2 * c**2) / 4
        - root**2 * (5 * c**2 + 4) / 8
    )
    T5 = -(root**2) - arc**2 + 2 * c * root * arc
    return T2, T3, T5


_T2, _T3, _T5 = theodorsen_constants(C_HINGE)
_h, _alpha = (coordinate.displacement for coordinate in TYPICAL_SECTION.coordinates)
_beta = FLAP.displacement

SECTION_WITH_FLAP: Configuration = replace(
    TYPICAL_SECTION,
    name="typical section with a trailing-edge flap",
    coordinates=(*TYPICAL_SECTION.coordinates, FLAP),
    kinetic=TYPICAL_SECTION.kinetic
    + _S_BETA * _h.diff() * _beta.diff()
    + (_I_BETA + s.SEMICHORD * (C_HINGE - s.A_H) * _S_BETA) * _alpha.diff() * _beta.diff()
    + _I_BETA * _beta.diff() ** 2 / 2,
    stiffness=(*TYPICAL_SECTION.stiffness, _K_BETA),
    dissipation=TYPICAL_SECTION.dissipation + _C_BETA * _beta.diff() ** 2 / 2,
    nonlinear=2,
    parameters={
        **TYPICAL_SECTION.parameters,
        C_HINGE: "Flap hinge behind midchord, in semichords.",
        X_BETA: "Static moment of the flap about its hinge over m b.",
        R_BETA: "Radius of gyration of the flap about its hinge, in semichords of all the mass.",
        OMEGA_BETA_BAR: "Uncoupled flap frequency over uncoupled pitch frequency.",
        ZETA_BETA: "Damping ratio of the flap hinge.",
    },
    groups={
        **TYPICAL_SECTION.groups,
        _S_BETA: _MASS * s.SEMICHORD * X_BETA,
        _I_BETA: _FLAP_INERTIA,
        _K_BETA: _FLAP_INERTIA * _OMEGA_BETA**2,
        _C_BETA: 2 * ZETA_BETA * _FLAP_INERTIA * _OMEGA_BETA,
    },
    pairings={
        ("beta", "beta"): -_T3 / (2 * sp.pi),
        ("beta", "beta'"): -_T2 / (2 * sp.pi),
        ("beta'", "beta'"): -_T5 / (2 * sp.pi),
    },
)
