"""The typical section with a trailing-edge flap: what a third degree of freedom takes.

One more mode shape, with a corner at the hinge, one more inertia and one more spring. The air's
part, Theodorsen's T functions (NACA Report 496, 1935), follows from the mode shape.
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
OMEGA_BETA_BAR = sp.Symbol("omega_beta_bar", nonnegative=True)
ZETA_BETA = sp.Symbol("zeta_beta", real=True)

S_BETA, I_BETA, K_BETA, C_BETA = sp.symbols("S_beta I_beta K_beta C_beta", positive=True)
_MASS = TYPICAL_SECTION.groups[s.MASS]
_FLAP_INERTIA = _MASS * s.SEMICHORD**2 * R_BETA**2
_FREQUENCY = OMEGA_BETA_BAR * s.VELOCITY / (s.SEMICHORD * s.SPEED)

FLAP = Coordinate(
    name="beta",
    latex=r"\beta",
    shape=Shape(s.X - C_HINGE, start=C_HINGE),
    length=sp.Integer(1),
    scale=_FLAP_INERTIA * s.VELOCITY**2 / s.SEMICHORD**2,
    equation="flap equation",
)

_h, _alpha = (coordinate.displacement for coordinate in TYPICAL_SECTION.coordinates)
_beta = FLAP.displacement
_CARRIED = dict(TYPICAL_SECTION.parameters)
_LAST = {symbol: _CARRIED.pop(symbol) for symbol in TYPICAL_SECTION.defaults}

SECTION_WITH_FLAP: Configuration = replace(
    TYPICAL_SECTION,
    name="typical section with a flap",
    coordinates=(*TYPICAL_SECTION.coordinates, FLAP),
    kinetic=TYPICAL_SECTION.kinetic
    + S_BETA * _h.diff() * _beta.diff()
    + (I_BETA + s.SEMICHORD * (C_HINGE - s.A_H) * S_BETA) * _alpha.diff() * _beta.diff()
    + I_BETA * _beta.diff() ** 2 / 2,
    stiffness=(*TYPICAL_SECTION.stiffness, K_BETA),
    dissipation=TYPICAL_SECTION.dissipation + C_BETA * _beta.diff() ** 2 / 2,
    nonlinear=2,
    parameters={
        **_CARRIED,
        C_HINGE: "Flap hinge behind midchord, in semichords.",
        X_BETA: "Static moment of the flap about its hinge over m b.",
        R_BETA: "Radius of gyration sqrt(I_beta / m) of the flap about its hinge, in semichords.",
        OMEGA_BETA_BAR: "Uncoupled flap frequency over uncoupled pitch frequency.",
        ZETA_BETA: "Damping ratio of the flap.",
        **_LAST,
    },
    groups={
        **TYPICAL_SECTION.groups,
        S_BETA: _MASS * s.SEMICHORD * X_BETA,
        I_BETA: _FLAP_INERTIA,
        K_BETA: _FLAP_INERTIA * _FREQUENCY**2,
        C_BETA: 2 * ZETA_BETA * _FLAP_INERTIA * _FREQUENCY,
    },
    abbreviations={
        sp.Symbol("arc", positive=True): sp.acos(C_HINGE),
        sp.Symbol("root", positive=True): sp.sqrt(1 - C_HINGE**2),
    },
)
