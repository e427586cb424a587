"""From energies and pressures to the nondimensional second-order equations.

    M q'' + (C0 + C1/U) q' + K0 q + g W + S F/U^2 = 0,   w = w_q q + w_v q'

W is w filtered by Wagner's function. F holds the moment of every coordinate's spring over its
nominal stiffness, the coordinate itself where the spring is linear.
"""

from __future__ import annotations

from collections.abc import Sequence
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
    S: sp.Matrix
    g: sp.Matrix
    w_q: sp.Matrix
    w_v: sp.Matrix

    @property
    def M(self) -> sp.Matrix:
        """Structural and apparent mass together."""
        return self.structural_mass + self.apparent_mass

    @property
    def n(self) -> int:
        """Number of degrees of freedom."""
        return int(self.structural_mass.rows)

    def linear_springs(self, free: Sequence[int]) -> sp.Matrix:
        """S of the springs that are linear: all but those of the coordinates ``free``."""
        return self.S * sp.diag(*(int(i not in free) for i in range(self.n)))


@dataclass(frozen=True)
class Structure:
    """Nondimensional structural matrices, before the air is added.

    ``stiffness`` is that of linear springs, out of the potential energy; ``springs`` what the
    moment of every spring, over its nominal stiffness, adds to the equations.
    """

    mass: sp.Matrix
    damping: sp.Matrix
    stiffness: sp.Matrix
    springs: sp.Matrix


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

    moments = [
        sp.simplify((stiffness * item.length**2 / item.scale).subs(configuration.groups))
        for stiffness, item in zip(configuration.stiffness, coordinates, strict=True)
    ]
    return Structure(matrix(2), matrix(1), matrix(0), sp.diag(*moments))


def second_order(configuration: Configuration) -> SecondOrder:
    """Structure and unsteady thin-airfoil forces together (equations 3.9 with 3.23-3.24)."""
    solid = structure(configuration)
    shapes = tuple(coordinate.shape for coordinate in configuration.coordinates)
    air = generalised_forces(shapes)
    pressure = s.DENSITY * s.VELOCITY**2 * s.SEMICHORD**2
    rows = sp.diag(*(pressure / coordinate.scale for coordinate in configuration.coordinates))
    return SecondOrder(
        structural_mass=_tidy(solid.mass),
        apparent_mass=_tidy(rows * air.mass),
        C0=_tidy(rows * air.damping),
        C1=_tidy(s.SPEED * solid.damping),
        K0=_tidy(rows * air.stiffness),
        S=_tidy(s.SPEED**2 * solid.springs),
        g=_tidy(rows * air.lag),
        w_q=air.w_q,
        w_v=air.w_v,
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
