"""Symbols of the derivation, made once so that their assumptions agree everywhere."""

from __future__ import annotations

import sympy as sp

# nondimensional parameters of the typical section (thesis, equations 3.5 to 3.8)
MU = sp.Symbol("mu", positive=True)
A_H = sp.Symbol("a_h", real=True)
X_ALPHA = sp.Symbol("x_alpha", real=True)
R_ALPHA = sp.Symbol("r_alpha", positive=True)
OMEGA_BAR = sp.Symbol("omega_bar", nonnegative=True)
ZETA_ALPHA = sp.Symbol("zeta_alpha", real=True)
ZETA_XI = sp.Symbol("zeta_xi", real=True)
HEAVE_MASS = sp.Symbol("heave_mass", positive=True)
SPEED = sp.Symbol("speed", positive=True)

# dimensional quantities
TIME = sp.Symbol("t", real=True)
MASS = sp.Symbol("m", positive=True)
MASS_IN_HEAVE = sp.Symbol("m_h", positive=True)
STATIC_MOMENT = sp.Symbol("S", real=True)
INERTIA = sp.Symbol("I_alpha", positive=True)
SEMICHORD = sp.Symbol("b", positive=True)
K_H, K_ALPHA, C_H, C_ALPHA = sp.symbols("K_h K_alpha C_h C_alpha", positive=True)
DENSITY = sp.Symbol("rho", positive=True)
VELOCITY = sp.Symbol("V", positive=True)

# chordwise coordinate in semichords from midchord, positive aft, and its angle: x = cos(theta)
X = sp.Symbol("x", real=True)
THETA = sp.Symbol("theta", real=True)

# Laplace variable on nondimensional time, pitch stiffness N, and Phi(p) = p L{phi}
P = sp.Symbol("p")
STIFFNESS = sp.Symbol("stiffness")
PHI = sp.Symbol("Phi")
TAU = sp.Symbol("tau", nonnegative=True)
