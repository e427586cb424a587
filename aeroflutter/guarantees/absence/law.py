"""What of a case takes part in a proof: the springs and the models that it covers."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from aeroflutter.guarantees.absence.certificate import Certificate, Linear, Loop, Static
from aeroflutter.model.elsewhere.modal import ModalModel
from aeroflutter.model.elsewhere.placed import PlacedModel
from aeroflutter.model.elsewhere.polynomial import PolynomialModel
from aeroflutter.model.family import FixedModel, SectionModel
from aeroflutter.model.lure import FixedFamily, LureFamily, SectionFamily, SpringFamily
from aeroflutter.springs import Hysteresis, PiecewiseLinear, Spring, simplify

__all__ = ["Uncovered", "concerns", "law_of", "model_of", "only_bounded", "slopes_of"]


Real = NDArray[np.float64]

_NO_POLYNOMIAL = "the model is not a polynomial in 1/U: take one speed of it at a time"


class Uncovered(Exception):
    """Nothing can be proved of the case; the message says why."""


def law_of(spring: Spring) -> Loop | Static:
    """The hypotheses on a spring.

    Raises
    ------
    Uncovered
        If its slopes are not bounded, or it has another memory than a hinge.
    """
    plain = simplify(spring)
    if isinstance(plain, Hysteresis):
        return Loop(delta_v=plain.delta_v, delta_h=plain.delta_h)
    table = plain.piece_table()
    if table is not None and table.memory:
        raise Uncovered(f"the memory of a {plain.kind} spring is not that of a hinge")
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
    if isinstance(family, FixedFamily):
        system = family.system
        return Linear(A=_rows((system.A,)), b=_rows((system.b,)), c=_rows(system.c))
    if not isinstance(family, (SectionFamily, SpringFamily)):
        raise Uncovered(_NO_POLYNOMIAL)
    A, B, C = _powers(family.model)
    if len(C) > 1 or C[0].shape[0] != 1:
        raise Uncovered("the row that picks the spring's coordinate depends on speed")
    return Linear(A=_rows(A), b=_rows(B[..., 0]), c=_rows(C[0][0]))


def _powers(model: Any) -> tuple[Real, Real, Real]:
    """A, B and C of a model, power by power of 1/U: (p, n, n), (q, n, m), (r, m, n)."""
    if isinstance(model, FixedModel):
        return model.system.A[None], model.system.B[None], model.system.C[None]
    if isinstance(model, SectionModel):
        A0, A1, A2, B2, C = model.terms
        return np.stack((A0, A1, A2)), np.stack((0.0 * B2, 0.0 * B2, B2)), C[None]
    if isinstance(model, PlacedModel):
        return _placed(model, *_powers(model.model))
    if isinstance(model, ModalModel):
        return _powers(model.polynomial)
    if isinstance(model, PolynomialModel) and model.variable == "1/V":
        return model.A, model.B, model.C
    raise Uncovered(_NO_POLYNOMIAL)


def _placed(model: PlacedModel, A: Real, B: Real, C: Real) -> tuple[Real, Real, Real]:
    """Springs in some outputs, linear ones in the others."""
    n = A.shape[-1]
    closed = np.zeros((max(len(A), len(B) + len(C) - 1), n, n))
    closed[: len(A)] = A
    for i, one in enumerate(B):
        for k, row in enumerate(C):
            closed[i + k] -= (one * model.slopes) @ row
    return closed, B[..., model.kept] * np.array(model.stiffness), C[:, model.kept]


def concerns(certificate: Certificate, family: LureFamily, spring: Spring) -> bool:
    """Whether a certificate speaks of this model and this spring, bit for bit."""
    return certificate.model == model_of(family) and certificate.spring == law_of(spring)


def _rows(values: Any) -> Any:
    """Nested tuples of floats."""
    return tuple(map(_rows, values)) if np.ndim(values) else float(values)
