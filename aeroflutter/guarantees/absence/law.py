"""What of a case takes part in a proof: the springs and the models that it covers."""

from __future__ import annotations

from typing import Any

import numpy as np

from aeroflutter.guarantees.absence.certificate import Certificate, Linear, Loop, Static
from aeroflutter.model.lure import FixedFamily, LureFamily, SectionFamily
from aeroflutter.springs import Hysteresis, PiecewiseLinear, Spring, simplify

__all__ = ["Uncovered", "concerns", "law_of", "model_of", "only_bounded", "slopes_of"]


class Uncovered(Exception):
    """Nothing can be proved of the case; the message says why."""


def law_of(spring: Spring) -> Loop | Static:
    """The hypotheses on a spring.

    Raises
    ------
    Uncovered
        If its slopes are not bounded.
    """
    plain = simplify(spring)
    if isinstance(plain, Hysteresis):
        return Loop(delta_v=plain.delta_v, delta_h=plain.delta_h)
    low, high = plain.slope_range()
    if not np.isfinite((low, high)).all():
        raise Uncovered(f"the slopes of a {plain.kind} spring have no bound")
    return Static(low=float(low), high=float(high))


def slopes_of(law: Loop | Static) -> tuple[float, float]:
    """p and q: the smallest and the largest slope."""
    return (0.0, 1.0) if isinstance(law, Loop) else (law.low, law.high)


def only_bounded(spring: Spring) -> bool:
    """Whether the proof speaks of motions that stay bounded only.

    It speaks of all where y - F/q is bounded: loops, and laws whose outer pieces are the stiffest.
    """
    plain = simplify(spring)
    if not isinstance(plain, PiecewiseLinear):
        return not isinstance(plain, Hysteresis)
    slopes = plain.pieces().slopes
    return bool(min(slopes[0], slopes[-1]) < slopes.max())


def model_of(family: LureFamily) -> Linear:
    """The matrices of a family, exactly.

    Raises
    ------
    Uncovered
        If they are no polynomials in 1/U.
    """
    if isinstance(family, SectionFamily):
        A0, A1, A2, b2, c = family.terms
        none = np.zeros_like(b2)
        return Linear(A=_rows((A0, A1, A2)), b=_rows((none, none, b2)), c=_rows(c))
    if isinstance(family, FixedFamily):
        system = family.system
        return Linear(A=_rows((system.A,)), b=_rows((system.b,)), c=_rows(system.c))
    raise Uncovered("the model is not a polynomial in 1/U: take one speed of it at a time")


def concerns(certificate: Certificate, family: LureFamily, spring: Spring) -> bool:
    """Whether a certificate speaks of this model and this spring, bit for bit."""
    return certificate.model == model_of(family) and certificate.spring == law_of(spring)


def _rows(values: Any) -> Any:
    """Nested tuples of floats."""
    return tuple(map(_rows, values)) if np.ndim(values) else float(values)
