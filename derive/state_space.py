"""Lag states, the first-order form and the characteristic polynomial.

With W = w(0) phi + int phi w' integrated by parts, every exponential term of phi is one state:

    z_i' = -b_i z_i + w,  z_i(0) = 0,   W = (1 - sum a_i) w + sum a_i b_i z_i

In the Laplace domain the same W is Phi(p) w with Phi = p L{phi} = 1 - sum a_i p/(p + b_i). The
circulatory part of B(p) is the product of one column and one row, so det B is linear in Phi.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp

from derive import symbols as s
from derive.equations import SecondOrder


def indicial_symbols(terms: int) -> tuple[list[sp.Symbol], list[sp.Symbol]]:
    """Coefficients a_i and rates b_i of an indicial function with so many exponential terms."""
    a = [sp.Symbol(f"a_{i + 1}", real=True) for i in range(terms)]
    b = [sp.Symbol(f"b_{i + 1}", positive=True) for i in range(terms)]
    return a, b


def indicial(tau: sp.Expr, a: list[sp.Symbol], b: list[sp.Symbol]) -> sp.Expr:
    """Lift after a step of downwash, over its final value (equation 3.20)."""
    return 1 - sum((ai * sp.exp(-bi * tau) for ai, bi in zip(a, b, strict=True)), sp.Integer(0))


def deficiency(p: sp.Expr, a: list[sp.Symbol], b: list[sp.Symbol]) -> sp.Expr:
    """Phi(p) = p L{phi}: what multiplies the downwash in the Laplace domain."""
    return 1 - sum((ai * p / (p + bi) for ai, bi in zip(a, b, strict=True)), sp.Integer(0))


@dataclass(frozen=True)
class FirstOrder:
    """x' = A x - B F(C x), x = (q, q', z), at one speed; one column of B and row of C a spring."""

    A: sp.Matrix
    B: sp.Matrix
    C: sp.Matrix

    def closed(self, slopes: Sequence[sp.Expr]) -> sp.Matrix:
        """A - B diag(slopes) C: every free spring replaced by a linear one."""
        return self.A - self.B * sp.diag(*slopes) * self.C


def mass_inverse(mass: sp.Matrix) -> tuple[sp.Expr, sp.Matrix]:
    """Determinant and adjugate of the mass matrix."""
    return mass.det(method="berkowitz"), mass.adjugate()


def first_order(
    equations: SecondOrder,
    a: list[sp.Symbol],
    b: list[sp.Symbol],
    speed: sp.Expr = s.SPEED,
    free: Sequence[int] = (1,),
) -> FirstOrder:
    """State matrices with any number of lag states and the springs of ``free`` outside of A."""
    n, lags = equations.n, len(a)
    determinant, adjugate = mass_inverse(equations.M)
    inverse = adjugate / determinant
    damping = equations.C0 + equations.C1 / speed
    stiffness = equations.K0 + equations.linear_springs(free) / speed**2
    direct = 1 - sum(a, sp.Integer(0))
    matrix = sp.zeros(2 * n + lags, 2 * n + lags)
    matrix[:n, n : 2 * n] = sp.eye(n)
    matrix[n : 2 * n, :n] = -inverse * (stiffness + direct * equations.g * equations.w_q)
    matrix[n : 2 * n, n : 2 * n] = -inverse * (damping + direct * equations.g * equations.w_v)
    for i in range(lags):
        matrix[n : 2 * n, 2 * n + i] = -inverse * equations.g * a[i] * b[i]
        matrix[2 * n + i, :n] = equations.w_q
        matrix[2 * n + i, n : 2 * n] = equations.w_v
        matrix[2 * n + i, 2 * n + i] = -b[i]
    columns = sp.zeros(2 * n + lags, len(free))
    columns[n : 2 * n, :] = inverse * equations.S[:, list(free)] / speed**2
    rows = sp.eye(2 * n + lags)[list(free), :]
    return FirstOrder(matrix, columns, rows)


def closed_springs(equations: SecondOrder, nonlinear: int, stiffness: sp.Expr) -> sp.Matrix:
    """S with the spring of one coordinate of stiffness N and the others linear."""
    slopes = [stiffness if i == nonlinear else sp.Integer(1) for i in range(equations.n)]
    return equations.S * sp.diag(*slopes)


def impedance(
    equations: SecondOrder,
    phi: sp.Expr = s.PHI,
    speed: sp.Expr = s.SPEED,
    stiffness: sp.Expr = s.STIFFNESS,
    nonlinear: int = 1,
) -> sp.Matrix:
    """B(p) for F = N q_nonlinear, with Phi left as a symbol unless it is given."""
    return (
        equations.M * s.P**2
        + (equations.C0 + equations.C1 / speed) * s.P
        + equations.K0
        + closed_springs(equations, nonlinear, stiffness) / speed**2
        + phi * equations.g * (equations.w_q + s.P * equations.w_v)
    )


@dataclass(frozen=True)
class CharacteristicParts:
    """det B = P0(p) + Phi P1(p), in named entries: definitions and descending coefficients."""

    entries: list[tuple[sp.Symbol, sp.Expr]]
    without_circulation: list[sp.Expr]
    with_circulation: list[sp.Expr]


def characteristic_parts(equations: SecondOrder, nonlinear: int = 1) -> CharacteristicParts:
    """Coefficients of P0 and P1 in terms of the entries of M, C, K, g and w."""
    n = equations.n
    entries: list[tuple[sp.Symbol, sp.Expr]] = []

    def named(letter: str, matrix: sp.Matrix) -> sp.Matrix:
        def entry(i: int, j: int) -> sp.Expr:
            expression = matrix[i, j]
            if expression.is_Number or expression.is_Symbol:
                return expression
            index = f"{i + 1}{j + 1}" if min(matrix.shape) > 1 else str(max(i, j) + 1)
            symbol = sp.Symbol(f"{letter}_{index}")
            entries.append((symbol, expression))
            return symbol

        return sp.Matrix(*matrix.shape, entry)

    springs = closed_springs(equations, nonlinear, s.STIFFNESS)
    M = named("m", equations.M)
    C = named("c", equations.C0 + equations.C1 / s.SPEED)
    K = named("k", equations.K0 + springs / s.SPEED**2)
    g = named("g", equations.g)
    row = named("w_q", equations.w_q) + s.P * named("w_v", equations.w_v)
    plain = M * s.P**2 + C * s.P + K
    first = sp.Poly(plain.det(method="berkowitz"), s.P)
    second = sp.Poly((row * plain.adjugate() * g)[0, 0], s.P)
    return CharacteristicParts(
        entries,
        [first.coeff_monomial(s.P**k) for k in range(2 * n, -1, -1)],
        [second.coeff_monomial(s.P**k) for k in range(2 * n - 1, -1, -1)],
    )
