"""Generalised forces of unsteady thin-airfoil theory on any set of chordwise mode shapes.

The chord line is displaced downwards by z(x, t) = b sum_j Z_j(x) q_j(t), x in semichords from
midchord. Its downwash is w(x)/V = sum_j (Z_j' q_j + Z_j dq_j/dtau). Two flows make up the pressure:

- without circulation: a potential phi = V b sum_n A_n sin(n theta) on the upper surface, with
  n A_n = (2/pi) int w sin(theta) sin(n theta) dtheta, and the pressure difference
  2 rho (dphi/dt + (V/b) dphi/dx);
- with circulation: Theodorsen's wake (NACA Report 496, 1935), (x0 + x) = x0 (1 - x) + x (1 + x0),
  gives 2 rho V^2 [W sqrt((1 - x)/(1 + x)) + w_eff x/sqrt(1 - x^2)], W being the effective downwash
  w_eff = (1/pi) int w (1 + cos(theta)) dtheta filtered by Wagner's function.

A mode shape may begin behind the leading edge, as a flap does, with a corner there. The potential
of such a shape is an infinite series, whose sum by n is

    phi(theta) = (V b/pi) int w sin(theta') L dtheta',  L = sum (2/n) sin(n theta) sin(n theta')
               = ln |sin((theta + theta')/2) / sin((theta - theta')/2)|

At the corner itself it is elementary, because dL/dtheta' = sin(theta)/(cos(theta') - cos(theta))
takes the logarithm out by parts. Where two shapes begin at one corner, the derivative of their
pairing with respect to the corner's place has nothing but the potentials there in it.

A new degree of freedom is one more mode shape; nothing here is specific to pitch and heave.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import sympy as sp

from derive.symbols import THETA, X


@dataclass(frozen=True)
class Shape:
    """A polynomial in x on the part of the chord behind ``start`` and zero ahead of it."""

    polynomial: sp.Expr
    start: sp.Expr = field(default=sp.Integer(-1))

    def slope(self) -> Shape:
        """Chordwise derivative; the shape is continuous at ``start``, so no impulse appears."""
        return Shape(sp.diff(self.polynomial, X), self.start)

    @property
    def whole_chord(self) -> bool:
        """Whether the shape is one polynomial over the chord."""
        return self.start == -1

    def integrate(self, weight: sp.Expr) -> sp.Expr:
        """Integral of Z(cos theta) weight(theta) over the part of the chord it covers."""
        integrand = self.polynomial.subs(X, sp.cos(THETA)) * weight
        return _trigonometric_integral(integrand, sp.acos(self.start))


def _trigonometric_integral(integrand: sp.Expr, upper: sp.Expr) -> sp.Expr:
    """Integral from 0 to ``upper`` of a polynomial in theta and sines and cosines of multiples.

    Complex exponentials turn every product into a sum; what is left is real.
    """
    z = sp.Symbol("z")
    exponential = sp.expand(sp.expand(integrand).rewrite(sp.exp)).subs(sp.exp(sp.I * THETA), z)
    polynomial = sp.Poly(sp.expand(exponential), THETA, z, 1 / z)
    total = sp.Integer(0)
    for (power, up, down), coefficient in polynomial.terms():
        total += coefficient * _exponential_integral(power, up - down, upper)
    return sp.expand(total)


def _exponential_integral(power: int, n: int, upper: sp.Expr) -> sp.Expr:
    """Integral from 0 to ``upper`` of theta^power exp(i n theta), by parts."""
    if n == 0:
        return upper ** (power + 1) / (power + 1)
    end = sp.expand_trig(sp.cos(n * upper)) + sp.I * sp.expand_trig(sp.sin(n * upper))
    if power == 0:
        return (end - 1) / (sp.I * n)
    rest = power * _exponential_integral(power - 1, n, upper)
    return (upper**power * end - rest) / (sp.I * n)


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


def corner_potential(polynomial: sp.Expr, corner: sp.Expr) -> sp.Expr:
    """Potential, over V b, at the corner where the downwash ``polynomial`` begins.

    By parts, with Q a primitive of the polynomial q: sin(corner)/pi times the integral of
    (Q(x) - Q(c))/(x - c) over theta. The logarithm drops out at both ends: it is zero at the
    trailing edge, and Q(x) - Q(c) is at the corner.
    """
    place = sp.Symbol("x_c", real=True)
    primitive = sp.integrate(polynomial, X)
    ratio = sp.cancel((primitive - primitive.subs(X, place)) / (X - place))
    integral = _trigonometric_integral(ratio.subs(X, sp.cos(THETA)), corner)
    return sp.sin(corner) / sp.pi * integral.subs(place, sp.cos(corner))


def pairing(source: Shape, receiver: Shape) -> sp.Expr:
    """Integral of phi[source] receiver over x, symmetric in its arguments (reciprocity).

    Raises
    ------
    NotImplementedError
        If both shapes begin behind the leading edge at two places.
    """
    if source.polynomial == 0 or receiver.polynomial == 0:
        return sp.Integer(0)
    if source.whole_chord:
        return receiver.integrate(potential(source) * sp.sin(THETA))
    if receiver.whole_chord:
        return pairing(receiver, source)
    if source.start != receiver.start:
        raise NotImplementedError("two corners: derive the pairing of flap and tab first")
    return _corner_pairing(source.polynomial, receiver.polynomial, source.start)


def _corner_pairing(first: sp.Expr, second: sp.Expr, start: sp.Expr) -> sp.Expr:
    """Pairing of two shapes that begin at one corner, summed up from the trailing edge.

    Moved ahead by dc, the corner adds to either shape a strip of its value there; so the pairing
    grows by first(c) phi[second](c) + second(c) phi[first](c) a unit of length.
    """
    place = sp.cos(THETA)
    corner = sp.Symbol("corner", real=True)

    def growth(strip: sp.Expr, other: sp.Expr) -> sp.Expr:
        return strip.subs(X, place) * corner_potential(other, corner).subs(corner, THETA)

    integrand = (growth(first, second) + growth(second, first)) * sp.sin(THETA)
    return _trigonometric_integral(integrand, sp.acos(start))


@dataclass(frozen=True)
class ThinAirfoilForces:
    """Q / (rho V^2 b^2) = -(mass q'' + damping q' + stiffness q + lag W), w = w_q q + w_v q'."""

    mass: sp.Matrix
    damping: sp.Matrix
    stiffness: sp.Matrix
    lag: sp.Matrix
    w_q: sp.Matrix
    w_v: sp.Matrix


def generalised_forces(shapes: tuple[Shape, ...]) -> ThinAirfoilForces:
    """Virtual work of the two pressure fields on every mode shape (Fung 1955, section 6)."""
    n = len(shapes)
    slopes = [shape.slope() for shape in shapes]
    rear = (1 + sp.cos(THETA)) / sp.pi
    w_q = sp.Matrix([[slope.integrate(rear) for slope in slopes]])
    w_v = sp.Matrix([[shape.integrate(rear) for shape in shapes]])
    lag = sp.Matrix([2 * shape.integrate(1 - sp.cos(THETA)) for shape in shapes])
    wake = sp.Matrix([2 * shape.integrate(sp.cos(THETA)) for shape in shapes])

    def pairs(sources: list[Shape] | tuple[Shape, ...], receivers: list[Shape]) -> sp.Matrix:
        return sp.Matrix(n, n, lambda i, j: 2 * pairing(sources[j], receivers[i]))

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
