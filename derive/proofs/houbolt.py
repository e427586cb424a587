"""Proofs about Houbolt's scheme: exactness, order, and the matrices of a step."""

from __future__ import annotations

import sympy as sp

from derive import houbolt as h
from derive.proofs.same import Proof, check_same

_POINTS = (-2, -1, 0, 1)


def difference_weights() -> None:
    """Apply the weights to powers of time: exact up to the cube, first error term at the fourth."""
    t = sp.Symbol("t")
    errors = {1: -sp.Rational(1, 4), 2: -sp.Rational(11, 12)}
    for order in (1, 2):
        weights = h.difference_weights(order)
        for power in range(4):
            value = sum(w * sp.Integer(k) ** power for w, k in zip(weights, _POINTS, strict=True))
            check_same(f"order {order} on t^{power}", value, (t**power).diff(t, order).subs(t, 1))
        # about the newest point, so that the fourth power has no derivative of its own there
        fourth = sum(w * sp.Integer(k - 1) ** 4 for w, k in zip(weights, _POINTS, strict=True))
        check_same(f"error of order {order}", fourth / 24, errors[order])


def duhamel_weights() -> None:
    """Integrate powers of time over the last step, and march an exponential through them."""
    t = sp.Symbol("t")
    weights = h.duhamel_weights()
    for power in range(4):
        value = sum(w * sp.Integer(k) ** power for w, k in zip(weights, _POINTS, strict=True))
        check_same(f"integral of t^{power}", value, sp.integrate(t**power, (t, 0, 1)))


def step_matrices() -> None:
    """Put the differences into the equations of motion one by one and compare with the matrices."""
    q = sp.symbols("q_0:4")
    step = h.step_matrices()
    velocity = (
        sum(w * x for w, x in zip(h.difference_weights(1), reversed(q), strict=True)) / h.STEP
    )
    acceleration = sum(w * x for w, x in zip(h.difference_weights(2), reversed(q), strict=True))
    acceleration /= h.STEP**2
    W = h.W_Q * q[0] + h.W_V * velocity
    W -= h.NEWEST * (h.W_Q * velocity + h.W_V * acceleration)
    direct = h.MASS * acceleration + h.DAMPING * velocity + h.STIFFNESS * q[0] + h.G * W
    lifts = {h.LIFT_Q: h.G * h.W_Q, h.LIFT_V: h.G * h.W_V}
    factors = [step.new, *step.old]
    by_matrices = sum(f.subs(lifts) * x for f, x in zip(factors, q, strict=True))
    check_same("one step", by_matrices, direct)


def taylor_weights() -> None:
    """Apply the start-up series to powers of time."""
    t, step = sp.symbols("t h")
    weights = h.taylor_weights()
    for power in range(len(weights)):
        derivatives = [(t**power).diff(t, k) for k in range(len(weights))]
        series = sum(w * value for w, value in zip(weights, derivatives, strict=True))
        check_same(f"t^{power}", series, (t + step) ** power)


PROOFS = (
    Proof(
        "differences",
        r"The backward differences are exact for cubics, with errors "
        r"$-\frac14\Delta\tau^3 q^{(4)}$ in $q'$ and $-\frac{11}{12}\Delta\tau^2 q^{(4)}$ in "
        r"$q''$: the scheme is of second order.",
        difference_weights,
    ),
    Proof(
        "Duhamel recurrence",
        "The four weights of equation 3.30 integrate cubics exactly over the last step.",
        duhamel_weights,
    ),
    Proof(
        "step",
        "The step matrices are the equations of motion with the differences put in.",
        step_matrices,
    ),
    Proof(
        "start",
        r"The start-up series is exact for parabolas.",
        taylor_weights,
    ),
)
