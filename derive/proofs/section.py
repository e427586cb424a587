"""Proofs about the section: loads, lag states, state matrices, polynomial, quasi-steady limit."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import sympy as sp
from sympy.polys.matrices import DomainMatrix

from derive import symbols as s
from derive.coalescence import coalescence
from derive.configuration import TYPICAL_SECTION
from derive.equations import SecondOrder, quasi_steady, second_order, structure
from derive.proofs.same import Proof, check_same
from derive.state_space import (
    characteristic_parts,
    deficiency,
    first_order,
    impedance,
    indicial,
    indicial_symbols,
)

HALF = sp.Rational(1, 2)


@cache
def _equations() -> SecondOrder:
    return second_order(TYPICAL_SECTION)


def published_equations() -> None:
    """Compare with equations 3.9 and 3.23-3.24 as they are printed (Fung 1955).

    In print all the mass pitches; supports add to the inertia, and to what a heave frequency and a
    damping ratio mean, in heave alone.
    """
    xi, alpha, W = (sp.Function(name)(s.TAU) for name in ("xi", "alpha", "W"))
    F = sp.Symbol("F")
    arm = HALF - s.A_H
    C_L = sp.pi * (xi.diff(s.TAU, 2) - s.A_H * alpha.diff(s.TAU, 2) + alpha.diff(s.TAU))
    C_L += 2 * sp.pi * W
    inertia = s.A_H * (xi.diff(s.TAU, 2) - s.A_H * alpha.diff(s.TAU, 2))
    C_M = sp.pi * (HALF + s.A_H) * W
    C_M += sp.pi / 2 * (inertia - arm * alpha.diff(s.TAU) - alpha.diff(s.TAU, 2) / 8)
    ratio = s.OMEGA_BAR / s.SPEED
    heave = xi.diff(s.TAU, 2) + 2 * s.ZETA_XI * ratio * xi.diff(s.TAU) + ratio**2 * xi
    heave = s.HEAVE_MASS * heave + s.X_ALPHA * alpha.diff(s.TAU, 2) + C_L / (sp.pi * s.MU)
    pitch = s.X_ALPHA / s.R_ALPHA**2 * xi.diff(s.TAU, 2) + alpha.diff(s.TAU, 2)
    pitch += 2 * s.ZETA_ALPHA / s.SPEED * alpha.diff(s.TAU) + F / s.SPEED**2
    pitch -= 2 * C_M / (sp.pi * s.MU * s.R_ALPHA**2)

    eq, q = _equations(), sp.Matrix([xi, alpha])
    derived = (
        eq.M * q.diff(s.TAU, 2)
        + (eq.C0 + eq.C1 / s.SPEED) * q.diff(s.TAU)
        + eq.K0 * q
        + eq.g * W
        + eq.S * sp.Matrix([xi, F]) / s.SPEED**2
    )
    check_same("equations of motion", derived, sp.Matrix([heave, pitch]))
    downwash = alpha + xi.diff(s.TAU) + arm * alpha.diff(s.TAU)
    check_same("downwash", eq.w_q * q + eq.w_v * q.diff(s.TAU), downwash)


def indicial_transform() -> None:
    """Integrate phi exp(-p tau) over all time."""
    a, b = indicial_symbols(2)
    p = sp.Symbol("p", positive=True)
    integrand = sp.expand(indicial(s.TAU, a, b) * sp.exp(-p * s.TAU))
    transform = sum(sp.integrate(sp.powsimp(term), (s.TAU, 0, sp.oo)) for term in integrand.args)
    check_same("p L{phi}", p * transform, deficiency(p, a, b))


def lag_states() -> None:
    """Compare Duhamel's integral with the lag states, and both with Phi(p).

    A downwash exp(r tau) starts at w(0) = 1. Its rate r is any complex number, so by superposition
    the identity holds for every downwash that has a transform.
    """
    a, b = indicial_symbols(2)
    r, sigma = sp.Symbol("r", positive=True), sp.Symbol("sigma", positive=True)
    w = sp.exp(r * s.TAU)

    def integral(integrand: sp.Expr) -> sp.Expr:
        terms = sp.Add.make_args(sp.expand(integrand))
        parts = [sp.integrate(sp.powsimp(term), (sigma, 0, s.TAU)) for term in terms]
        return sum(parts, sp.Integer(0))

    rate = w.diff(s.TAU).subs(s.TAU, sigma)
    duhamel = w.subs(s.TAU, 0) * indicial(s.TAU, a, b)
    duhamel += integral(indicial(s.TAU - sigma, a, b) * rate)
    z = [integral(sp.exp(-bi * (s.TAU - sigma)) * w.subs(s.TAU, sigma)) for bi in b]
    lagged = (1 - sum(a)) * w + sum(ai * bi * zi for ai, bi, zi in zip(a, b, z, strict=True))
    check_same("W by lag states", sp.powsimp(sp.expand(lagged - duhamel)), 0)
    check_same("W at the start", lagged.subs(s.TAU, 0), 1 - sum(a))
    for zi, bi in zip(z, b, strict=True):
        check_same("lag state", sp.powsimp(sp.expand(zi.diff(s.TAU) + bi * zi - w)), 0)
        check_same("lag state at the start", zi.subs(s.TAU, 0), 0)
    transformed = 1 - sum(a) + sum(ai * bi / (s.P + bi) for ai, bi in zip(a, b, strict=True))
    check_same("W over w in the Laplace domain", transformed, deficiency(s.P, a, b))


def rank_one() -> None:
    """Expand det B with every parameter a symbol."""
    eq = _equations()
    parts = characteristic_parts(eq)
    values = dict(parts.entries)
    without = sum(c * s.P**k for k, c in enumerate(reversed(parts.without_circulation)))
    lagged = sum(c * s.P**k for k, c in enumerate(reversed(parts.with_circulation)))
    whole = impedance(eq).det(method="berkowitz")
    check_same("P0 + Phi P1", (without + s.PHI * lagged).subs(values), whole)


def characteristic_polynomial() -> None:
    """Compare det(pE - A') with det B (p + b_1)(p + b_2) det(mass), all of them symbols.

    E = diag(I, M, I) takes the inverse of the mass matrix out of A, so both are polynomials.
    """
    general = _symbolic_entries(_equations())
    a, b = indicial_symbols(2)
    # one over the speed, so that everything is a polynomial
    speed = 1 / sp.Symbol("inverse_speed")
    n, size = general.n, 2 * general.n + len(a)
    state = first_order(general, a, b, speed)
    closed = state.closed([s.STIFFNESS])
    E = sp.eye(size)
    E[n : 2 * n, n : 2 * n] = general.M
    plain = (E * closed).applyfunc(sp.cancel)
    pencil = DomainMatrix.from_Matrix((s.P * E - plain).applyfunc(sp.expand))
    determinant = pencil.domain.to_sympy((-1) ** size * pencil.charpoly()[-1])
    lags = sp.prod([s.P + bi for bi in b])
    laplace = sp.Poly(impedance(general, s.PHI, speed).det(method="berkowitz"), s.PHI)
    lagged = sp.cancel(lags * deficiency(s.P, a, b))
    without, circulation = laplace.coeff_monomial(1), laplace.coeff_monomial(s.PHI)
    check_same("det(pE - A') and det B", determinant, without * lags + circulation * lagged)


def _symbolic_entries(eq: SecondOrder) -> SecondOrder:
    """The same equations with a symbol for every entry that is not a number."""

    def named(name: str) -> sp.Matrix:
        matrix = getattr(eq, name)

        def entry(i: int, j: int) -> sp.Expr:
            value = matrix[i, j]
            return value if value.is_Number else sp.Symbol(f"{name}_{i}{j}")

        return sp.Matrix(*matrix.shape, entry)

    names = ("apparent_mass", "C0", "C1", "K0", "S", "g", "w_q", "w_v")
    return SecondOrder(structural_mass=sp.zeros(2, 2), **{name: named(name) for name in names})


def springs_closed() -> None:
    """Close springs of every choice of coordinates; S against the potential energy.

    With all springs linear the stiffness in A has to be the one of the potential energy, in which
    no spring stands outside.
    """
    solid = structure(TYPICAL_SECTION)
    check_same("S and the potential energy", solid.springs, solid.stiffness)
    eq = _equations()
    a, b = indicial_symbols(2)
    for air in (eq, quasi_steady(eq)):
        linear = replace(air, K0=air.K0 + solid.stiffness, S=sp.zeros(air.n, air.n))
        whole = first_order(linear, a, b, free=())
        pitch = first_order(air, a, b, free=(1,))
        both = first_order(air, a, b, free=(0, 1))
        check_same("both springs closed", both.closed([1, 1]), whole.A)
        check_same("pitch spring closed", pitch.closed([1]), whole.A)
        heave_closed = both.A - both.B[:, 0] * both.C[0, :]
        check_same("heave spring closed", heave_closed, pitch.A)
        check_same("what pitch is pushed by", both.B[:, 1], pitch.B)
        check_same("what pitch is", both.C[1, :], pitch.C)


def static_gain() -> None:
    """Put p = 0 into B: the moment that holds a mean pitch against the mean lift."""
    B = impedance(_equations(), sp.Integer(1)).subs(s.P, 0)
    balance = sp.Poly(sp.numer(sp.together(B.det(method="berkowitz"))), s.STIFFNESS)
    slope, constant = balance.all_coeffs()
    expected = (1 + 2 * s.A_H) * s.SPEED**2 / (s.MU * s.R_ALPHA**2)
    check_same("mean moment over mean pitch", -constant / slope, expected)


def steady_loads() -> None:
    """Compare the quasi-steady stiffness with C_L = 2 pi alpha, C_M = (1/2 + a_h) C_L/2."""
    air = quasi_steady(_equations())
    C_L = 2 * sp.pi
    C_M = (HALF + s.A_H) * C_L / 2
    column = [C_L / (sp.pi * s.MU), -2 * C_M / (sp.pi * s.MU * s.R_ALPHA**2)]
    check_same("quasi-steady stiffness", air.K0, sp.Matrix([[0, column[0]], [0, column[1]]]))
    check_same("quasi-steady damping", air.C0, sp.zeros(2, 2))
    check_same("quasi-steady mass of air", air.apparent_mass, sp.zeros(2, 2))


def quasi_steady_flutter() -> None:
    """Put the closed form into the discriminant, and compare it with the formula in print."""
    forms = coalescence(quasi_steady(_equations()))
    values = dict(forms.closed_form)
    squared = values[sp.Symbol("squared")]
    for symbol, value in reversed(forms.closed_form[:-1]):
        squared = squared.subs(symbol, value)
    X = 1 / squared
    terms = {name: value.subs(s.A_H, -HALF) for name, value in forms.terms}
    at_flutter = sum(c * X**k for k, c in enumerate(reversed(forms.discriminant)))
    check_same("discriminant at flutter", sp.simplify(at_flutter.subs(terms)), 0)
    ratio = sp.sqrt(1 - s.X_ALPHA**2 / s.R_ALPHA**2)
    printed = 1 + s.OMEGA_BAR**2 - 2 * s.OMEGA_BAR * ratio
    printed *= s.MU * s.R_ALPHA**2 / (2 * s.X_ALPHA)
    check_same("flutter speed squared", squared.subs(s.STIFFNESS, 1), printed)


PROOFS = (
    Proof(
        "published equations",
        "The general derivation gives the equations of motion and the loads as they are printed.",
        published_equations,
    ),
    Proof(
        "indicial transform",
        r"$\Phi(\bar p) = \bar p\,\mathcal{L}\{\phi\}$, by integration over all time.",
        indicial_transform,
    ),
    Proof(
        "lag states",
        "The lag states give Duhamel's integral with its initial value, and $\\Phi$ in the Laplace "
        "domain.",
        lag_states,
    ),
    Proof(
        "rank one",
        r"$\det B = P_0(\bar p) + \Phi\,P_1(\bar p)$.",
        rank_one,
    ),
    Proof(
        "characteristic polynomial",
        r"$\det(\bar p I - A + N b c)\,\det M = (\bar p + b_1)(\bar p + b_2)\det B(\bar p)$.",
        characteristic_polynomial,
    ),
    Proof(
        "springs",
        r"$A - B\,C$ is the matrix of linear springs, whichever of them stand outside of $A$.",
        springs_closed,
    ),
    Proof(
        "static gain",
        r"A mean pitch $B$ needs $F_0 = (1 + 2 a_h)\,U^2 B/(\mu r_\alpha^2)$; $1/G(0) = -F_0/B$.",
        static_gain,
    ),
    Proof(
        "steady loads",
        r"The quasi-steady loads are $C_L = 2\pi\alpha$ and $C_M = (1/2 + a_h)\,C_L/2$.",
        steady_loads,
    ),
    Proof(
        "quasi-steady flutter",
        "The closed-form flutter speed is a root of the discriminant.",
        quasi_steady_flutter,
    ),
)
