"""Quasi-steady flutter of the undamped section without supports: two real frequencies meet.

det B = J p^4 + (s/U^2 + f) p^2 + (k2/U^2 + k1)/U^2 is a quadratic in p^2. Its discriminant is a
quadratic in 1/U^2, and for a_h = -1/2 the lower flutter speed has a short closed form.
"""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from derive import symbols as s
from derive.equations import SecondOrder
from derive.state_space import impedance

Definitions = list[tuple[sp.Symbol, sp.Expr]]


@dataclass(frozen=True)
class Coalescence:
    """Named terms of det B, the discriminant in 1/U^2 (descending), and U^2 for a_h = -1/2."""

    terms: Definitions
    discriminant: list[sp.Expr]
    closed_form: Definitions


def coalescence(equations: SecondOrder, nonlinear: int = 1) -> Coalescence:
    """Discriminant and closed form from the quasi-steady B(p)."""
    undamped = {s.ZETA_ALPHA: 0, s.ZETA_XI: 0, s.HEAVE_MASS: 1}
    X = sp.Symbol("X", positive=True)
    matrix = impedance(equations, sp.Integer(0), nonlinear=nonlinear).subs(undamped)
    determinant = sp.expand(matrix.det(method="berkowitz").subs(s.SPEED, 1 / sp.sqrt(X)))
    polynomial = sp.Poly(determinant, s.P)
    quartic, quadratic, constant = (polynomial.coeff_monomial(s.P**k) for k in (4, 2, 0))
    names = sp.symbols("inertia spring air k_2 k_1")
    values = (
        quartic,
        sp.Poly(quadratic, X).coeff_monomial(X),
        sp.Poly(quadratic, X).coeff_monomial(1),
        sp.Poly(constant, X).coeff_monomial(X**2),
        sp.Poly(constant, X).coeff_monomial(X),
    )
    tidy = [sp.factor_terms(sp.together(value)) for value in values]
    terms = list(zip(names, tidy, strict=True))
    inertia, spring, air, k_2, k_1 = names
    general = (spring * X + air) ** 2 - 4 * inertia * (k_2 * X + k_1) * X
    discriminant = [sp.Poly(sp.expand(general), X).coeff_monomial(X**k) for k in (2, 1, 0)]
    return Coalescence(terms, discriminant, _closed_form(dict(terms)))


def _closed_form(terms: dict[sp.Symbol, sp.Expr]) -> Definitions:
    """Lower speed squared for a_h = -1/2, where k_1 vanishes.

    The frequencies meet where spring X + air = +-2 sqrt(J k_2) X; the upper sign has the larger
    X = 1/U^2 = -air/(spring - 2 sqrt(J k_2)) of the two.
    """
    quarter = {name: value.subs(s.A_H, -sp.Rational(1, 2)) for name, value in terms.items()}
    inertia, spring, air, k_2, k_1 = terms
    ratio = 1 - s.X_ALPHA**2 / s.R_ALPHA**2
    if sp.simplify(quarter[inertia] - ratio) != 0 or sp.simplify(quarter[k_1]) != 0:
        raise ValueError("the air has a stiffness about the quarter chord: no closed form")
    lower, squared = sp.symbols("lower squared")
    root = sp.sqrt(sp.factor(quarter[k_2]) * inertia)
    return [
        (inertia, ratio),
        (lower, sp.expand(quarter[spring]) - 2 * root),
        (squared, lower * sp.simplify(-1 / quarter[air])),
    ]
