"""Houbolt's scheme from interpolation (section 3.2.1 with equation 3.30, appendix A).

A cubic through the last four displacements is differentiated at the newest one. The Duhamel
integrals I_i = int exp(-b_i (tau - s)) w'(s) ds advance by a cubic through the last four values of
their integrand. Put into the equations of motion at the new time, with
W = w - w(0) sum a_i exp(-b_i tau) - sum a_i I_i, both leave one linear system a step.
"""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

STEP = sp.Symbol("dt", positive=True)
_AGE = sp.Symbol("age", real=True)

MASS, DAMPING, STIFFNESS = sp.symbols("M C K")
G, W_Q, W_V = sp.symbols("g w_q w_v")
LIFT_Q, LIFT_V = sp.symbols("lift_q lift_v")
NEWEST = sp.Symbol("newest")


def _cubic(values: tuple[sp.Symbol, ...]) -> sp.Expr:
    """Cubic through values at ages 0, 1, 2 and 3 steps, as a function of age in steps."""
    points = list(zip(range(4), values, strict=True))
    return sp.interpolate(points, _AGE)


def _weights(expression: sp.Expr, values: tuple[sp.Symbol, ...]) -> list[sp.Expr]:
    """Coefficients of the values, oldest first."""
    expanded = sp.expand(expression)
    return [expanded.coeff(value) for value in reversed(values)]


def difference_weights(order: int) -> list[sp.Expr]:
    """Weights of q(n-2), q(n-1), q(n), q(n+1) in the derivative at n+1, times dt^-order."""
    values = sp.symbols("q_0:4")
    derivative = sp.diff(_cubic(values), _AGE, order).subs(_AGE, 0)
    return _weights((-1) ** order * derivative, values)


def duhamel_weights() -> list[sp.Expr]:
    """Weights of the integrand at n-2, n-1, n, n+1 in its integral over the last step, over dt."""
    values = sp.symbols("f_0:4")
    return _weights(sp.integrate(_cubic(values), (_AGE, 0, 1)), values)


@dataclass(frozen=True)
class StepMatrices:
    """Factors of q(n+1), q(n), q(n-1), q(n-2), in M, C, K, lift_q = g w_q and lift_v = g w_v.

    ``newest`` is what the newest w' adds to the sum of a_i I_i, the last Duhamel weight times
    dt sum a_i.
    """

    new: sp.Expr
    old: tuple[sp.Expr, sp.Expr, sp.Expr]


def step_matrices() -> StepMatrices:
    """Collect the displacements in the equations of motion at the new time."""
    q = sp.symbols("q_0:4")
    velocity = [weight / STEP for weight in difference_weights(1)]
    acceleration = [weight / STEP**2 for weight in difference_weights(2)]
    rate = sum(weight * value for weight, value in zip(velocity, reversed(q), strict=True))
    second = sum(weight * value for weight, value in zip(acceleration, reversed(q), strict=True))
    downwash = W_Q * q[0] + W_V * rate
    newest = NEWEST * (W_Q * rate + W_V * second)
    residual = MASS * second + DAMPING * rate + STIFFNESS * q[0] + G * (downwash - newest)

    def factor(value: sp.Symbol) -> sp.Expr:
        plain = sp.expand(sp.expand(residual).coeff(value))
        named = sp.expand(plain.subs({W_Q: LIFT_Q / G, W_V: LIFT_V / G}))
        return sp.collect(named, [MASS, DAMPING, STIFFNESS, LIFT_Q, LIFT_V], sp.factor_terms)

    return StepMatrices(factor(q[0]), (factor(q[1]), factor(q[2]), factor(q[3])))


def taylor_weights(terms: int = 3) -> list[sp.Expr]:
    """Weights of a derivative and the ones above it in its value a time ``h`` later.

    The shift operator exp(h d/dtau) cut off after ``terms`` terms. Appendix A keeps three, so that
    q uses derivatives up to the second, q' up to the third and q'' up to the fourth.
    """
    h, x = sp.symbols("h x")
    series = sp.series(sp.exp(h * x), x, 0, terms).removeO()
    return [series.coeff(x, k) for k in range(terms)]
