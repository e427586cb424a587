"""From energies and pressures to the nondimensional second-order equations.

    M q'' + (C0 + C1/U) q' + (K0 + K2/U^2) q + g W + e F/U^2 = 0,   w = w_q q + w_v q'

W is w filtered by Wagner's function, F the moment of the spring under study and e its row.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import sympy as sp

from derive import symbols as s
from derive.configuration import Configuration
from derive.thin_airfoil import generalised_forces


@dataclass(frozen=True)
class SecondOrder:
    """Matrices of the second-order equations; see the head of this module."""

    structural_mass: sp.Matrix
    apparent_mass: sp.Matrix
    C0: sp.Matrix
    C1: sp.Matrix
    K0: sp.Matrix
    K2: sp.Matrix
    g: sp.Matrix
    w_q: sp.Matrix
    w_v: sp.Matrix
    e: sp.Matrix

    @property
    def M(self) -> sp.Matrix:
        """Structural and apparent mass together."""
        return self.structural_mass + self.apparent_mass

    @property
    def n(self) -> int:
        """Number of degrees of freedom."""
        return int(self.structural_mass.rows)


@dataclass(frozen=True)
class Structure:
    """Nondimensional structural matrices and spring column, before the air is added."""

    mass: sp.Matrix
    damping: sp.Matrix
    stiffness: sp.Matrix
    spring: sp.Matrix


def lagrange(configuration: Configuration) -> list[sp.Expr]:
    """d/dt dT/dq' - dT/dq + dR/dq' + dV/dq for every coordinate, dimensional (equation 3.1)."""
    rows = []
    for coordinate in configuration.coordinates:
        q = coordinate.displacement
        rate = q.diff(s.TIME)
        inertia = configuration.kinetic.diff(rate).diff(s.TIME) - configuration.kinetic.diff(q)
        forces = configuration.dissipation.diff(rate) + configuration.potential.diff(q)
        rows.append(sp.expand(inertia + forces))
    return rows


def structure(configuration: Configuration) -> Structure:
    """Lagrange's equations on nondimensional time, each over its scale (equations 3.5-3.9)."""
    rows = lagrange(configuration)
    coordinates = configuration.coordinates
    n = len(rows)
    clock = s.VELOCITY / s.SEMICHORD

    def matrix(order: int) -> sp.Matrix:
        def entry(i: int, j: int) -> sp.Expr:
            motion = coordinates[j].displacement
            derivative = motion.diff((s.TIME, order)) if order else motion
            factor = clock**order * coordinates[i].length * coordinates[j].length
            dimensional = rows[i].coeff(derivative) * factor / coordinates[i].scale
            return sp.simplify(dimensional.subs(configuration.groups))

        return sp.Matrix(n, n, entry)

    free = coordinates[configuration.nonlinear]
    moment = configuration.spring * free.length**2 / free.scale
    column = sp.zeros(n, 1)
    column[configuration.nonlinear] = sp.simplify(moment.subs(configuration.groups))
    return Structure(matrix(2), matrix(1), matrix(0), column)


def second_order(configuration: Configuration) -> SecondOrder:
    """Structure and unsteady thin-airfoil forces together (equations 3.9 with 3.23-3.24)."""
    solid = structure(configuration)
    shapes = tuple(coordinate.shape for coordinate in configuration.coordinates)
    air = generalised_forces(shapes, configuration.pairings)
    pressure = s.DENSITY * s.VELOCITY**2 * s.SEMICHORD**2
    rows = sp.diag(*(pressure / coordinate.scale for coordinate in configuration.coordinates))
    return SecondOrder(
        structural_mass=_tidy(solid.mass),
        apparent_mass=_tidy(rows * air.mass),
        C0=_tidy(rows * air.damping),
        C1=_tidy(s.SPEED * solid.damping),
        K0=_tidy(rows * air.stiffness),
        K2=_tidy(s.SPEED**2 * solid.stiffness),
        g=_tidy(rows * air.lag),
        w_q=air.w_q,
        w_v=air.w_v,
        e=_tidy(s.SPEED**2 * solid.spring),
    )


def quasi_steady(equations: SecondOrder) -> SecondOrder:
    """Keep only the steady lift of the present displacement (equations 3.13-3.17).

    The section's rates, the mass of the air and the lag of circulation are all left out, so the
    air is a stiffness, the circulatory column times the steady downwash.
    """
    none = sp.zeros(equations.n, equations.n)
    return replace(
        equations,
        apparent_mass=none,
        C0=none,
        K0=_tidy(equations.K0 + equations.g * equations.w_q),
        g=sp.zeros(equations.n, 1),
        w_v=sp.zeros(1, equations.n),
    )


def _tidy(matrix: sp.Matrix) -> sp.Matrix:
    """Write every entry as an expanded numerator over a denominator without numerical factor."""

    def entry(expression: sp.Expr) -> sp.Expr:
        numerator, denominator = sp.fraction(sp.together(sp.simplify(expression)))
        constant, denominator = sp.factor(denominator).as_coeff_Mul()
        return sp.expand(numerator / constant) / denominator

    return matrix.applyfunc(entry)
