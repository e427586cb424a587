"""Generalised forces of unsteady thin-airfoil theory on any set of chordwise mode shapes.

The chord line is displaced downwards by z(x, t) = b sum_j Z_j(x) q_j(t), x in semichords from
midchord. Its downwash is w(x)/V = sum_j (Z_j' q_j + Z_j dq_j/dtau). Two flows make up the pressure:

- without circulation: a potential phi = V b sum_n A_n sin(n theta) on the upper surface, with
  n A_n = (2/pi) int w sin(theta) sin(n theta) dtheta, and the pressure difference
  2 rho (dphi/dt + (V/b) dphi/dx);
- with circulation: Theodorsen's wake (NACA Report 496, 1935), (x0 + x) = x0 (1 - x) + x (1 + x0),
  gives 2 rho V^2 [W sqrt((1 - x)/(1 + x)) + w_eff x/sqrt(1 - x^2)], W being the effective downwash
  w_eff = (1/pi) int w (1 + cos(theta)) dtheta filtered by Wagner's function.

A new degree of freedom is one more mode shape; nothing here is specific to pitch and heave.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import sympy as sp

from derive.symbols import THETA, X

Pairings = Mapping[tuple[str, str], sp.Expr]


@dataclass(frozen=True)
class Shape:
    """A polynomial in x on the part of the chord behind ``start`` and zero ahead of it."""

    polynomial: sp.Expr
    start: sp.Expr = field(default=sp.Integer(-1))
    name: str = ""

    def slope(self) -> Shape:
        """Chordwise derivative; the shape is continuous at ``start``, so no impulse appears."""
        name = f"{self.name}'" if self.name else ""
        return Shape(sp.diff(self.polynomial, X), self.start, name)

    @property
    def whole_chord(self) -> bool:
        """Whether the shape is one polynomial over the chord."""
        return self.start == -1

    def integrate(self, weight: sp.Expr) -> sp.Expr:
        """Integral of Z(cos theta) weight(theta) over the part of the chord it covers."""
        integrand = sp.expand(self.polynomial.subs(X, sp.cos(THETA)) * weight)
        if self.whole_chord:
            return _trigonometric_integral(integrand, sp.pi)
        return _trigonometric_integral(integrand, sp.acos(self.start))


def _trigonometric_integral(integrand: sp.Expr, upper: sp.Expr) -> sp.Expr:
    """Integral from 0 to ``upper`` of a polynomial in sines and cosines of multiples of theta.

    Complex exponentials turn every product into a sum; what is left is real.
    """
    z = sp.Symbol("z")
    exponential = sp.expand(integrand.rewrite(sp.exp)).subs(sp.exp(sp.I * THETA), z)
    total = sp.Integer(0)
    for power, coefficient in _powers(sp.expand(exponential), z).items():
        if power == 0:
            total += coefficient * upper
            continue
        sine = sp.expand_trig(sp.sin(power * upper))
        cosine = sp.expand_trig(sp.cos(power * upper))
        total += coefficient * (sine - sp.I * (cosine - 1)) / power
    return sp.expand(total)


def _powers(expression: sp.Expr, z: sp.Symbol) -> dict[int, sp.Expr]:
    """Coefficients of a Laurent polynomial in z."""
    polynomial = sp.Poly(expression, z, 1 / z)
    return {up - down: coefficient for (up, down), coefficient in polynomial.terms()}


def potential(shape: Shape) -> sp.Expr:
    """Noncirculatory potential, over V b, of the downwash ``shape`` (a polynomial in x)."""
    degree = sp.Poly(shape.polynomial, X).degree() if shape.polynomial != 0 else 0
    orders = range(1, max(int(degree), 0) + 2)
    return sum(
        (
            shape.integrate(2 * sp.sin(THETA) * sp.sin(n * THETA) / (n * sp.pi)) * sp.sin(n * THETA)
            for n in orders
        ),
        sp.Integer(0),
    )


def pairing(source: Shape, receiver: Shape, known: Pairings) -> sp.Expr:
    """Integral of phi[source] receiver over x, symmetric in its arguments (reciprocity).

    Where both shapes start behind the leading edge the potential is an infinite series whose sum
    is a matter of record (Theodorsen's T constants): it is looked up in ``known``.
    """
    if source.polynomial == 0 or receiver.polynomial == 0:
        return sp.Integer(0)
    if source.whole_chord:
        return receiver.integrate(potential(source) * sp.sin(THETA))
    if receiver.whole_chord:
        return pairing(receiver, source, known)
    first, second = sorted((source.name, receiver.name))
    return known[first, second]


@dataclass(frozen=True)
class ThinAirfoilForces:
    """Q / (rho V^2 b^2) = -(mass q'' + damping q' + stiffness q + lag W), w = w_q q + w_v q'."""

    mass: sp.Matrix
    damping: sp.Matrix
    stiffness: sp.Matrix
    lag: sp.Matrix
    w_q: sp.Matrix
    w_v: sp.Matrix


def generalised_forces(shapes: tuple[Shape, ...], known: Pairings) -> ThinAirfoilForces:
    """Virtual work of the two pressure fields on every mode shape (Fung 1955, section 6)."""
    n = len(shapes)
    slopes = [shape.slope() for shape in shapes]
    rear = (1 + sp.cos(THETA)) / sp.pi
    w_q = sp.Matrix([[slope.integrate(rear) for slope in slopes]])
    w_v = sp.Matrix([[shape.integrate(rear) for shape in shapes]])
    lag = sp.Matrix([2 * shape.integrate(1 - sp.cos(THETA)) for shape in shapes])
    wake = sp.Matrix([2 * shape.integrate(sp.cos(THETA)) for shape in shapes])

    def pairs(sources: list[Shape] | tuple[Shape, ...], receivers: list[Shape]) -> sp.Matrix:
        return sp.Matrix(n, n, lambda i, j: 2 * pairing(sources[j], receivers[i], known))

    whole = list(shapes)
    damping = pairs(slopes, whole) - pairs(whole, slopes) + wake * w_v
    stiffness = -pairs(slopes, slopes) + wake * w_q
    return ThinAirfoilForces(
        mass=pairs(whole, whole).applyfunc(sp.expand),
        damping=damping.applyfunc(sp.expand),
        stiffness=stiffness.applyfunc(sp.expand),
        lag=lag.applyfunc(sp.expand),
        w_q=w_q,
        w_v=w_v,
    )
