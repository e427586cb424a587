"""A relay that switches ever faster: a bound on all its later swings that shrinks to nothing.

Where F = M sgn y enters y'' first (c b = 0, g = c A b > 0), nothing slides, and a motion that dies
down switches without end. With v = y', κ = -c A² b/g and the zero dynamics z (the eigenvalues of
Q = A - b c A²/g but for two zeros, assumed stable),

    y'' = a z + p y - κ v - g F,        z_i' = λ_i z_i + λ_i² (l_i b/g) y.

Along V = (v + κ y)²/2 + (g M - a z sgn y) |y| - p y²/2, which at y = 0 is half the square of the
velocity there, the return map of the relay,

    V' = -|y| (κ (g M - a z sgn y - p |y|) + a z' sgn y).

As long as |y| <= Y, every |z_i| stays below |z_i(0)| + |λ_i² l_i b/g| Y/|Re λ_i|, which bounds a z
and a z'. If then m = g M - |a z| - |p| Y > 0 with κ m > |a z'| and V(0)/m < Y, V never grows and
|y| <= V/m < Y for good; ∫|y| is finite, hence y, then z, then v go to zero.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from aeroflutter.springs._kernel_columns import HIGH, JUMPS, LOW, OFFSET

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from aeroflutter.motion.flow import Flow

    Array = NDArray[np.float64]
    Complex = NDArray[np.complex128]

__all__ = ["Contraction", "contraction_of"]

ZERO = 1e-7  # relative size of an eigenvalue that is zero: two of them are defective
NOTHING = 1e-12
MARGIN = 1.0 + 1e-9


class Contraction(NamedTuple):
    """What the bound needs of a loop; k coordinates of the zero dynamics.

    Attributes
    ----------
    c, cA
        y and v of a state, (n,) each.
    left, by_y
        z_i = l_i x - (l_i b/g) v - by_y_i y, (k, n) with the term in v in it, and (k,).
    values, forced, weights
        λ_i, λ_i² l_i b/g, and a_i, (k,) each.
    push, kappa, p
        g M, κ and p.
    """

    c: Array
    cA: Array
    left: Complex
    by_y: Complex
    values: Complex
    forced: Complex
    weights: Complex
    push: float
    kappa: float
    p: float

    def holds(self, x: Array) -> bool:
        """Whether the motion from x goes to y = 0 for good."""
        y, v = float(self.c @ x), float(self.cA @ x)
        z = self.left @ x - self.by_y * y
        lean = float((self.weights @ z).real) * np.sign(y)
        V = 0.5 * (v + self.kappa * y) ** 2 + (self.push - lean) * abs(y) - 0.5 * self.p * y * y
        reach = 2.0 * V / self.push
        sizes = np.abs(z) + np.abs(self.forced) * reach / np.abs(self.values.real)
        most = np.abs(self.weights) @ sizes
        quick = np.abs(self.weights) @ (np.abs(self.values) * sizes + np.abs(self.forced) * reach)
        room = self.push - MARGIN * (most + abs(self.p) * reach)
        return bool(room > 0.0 and self.kappa * room > MARGIN * quick and room * reach > V)


def contraction_of(flow: Flow) -> Contraction | None:
    """The bound for a flow whose one law is a relay of this kind, or None."""
    if flow.m != 1 or np.any(flow.d):
        return None
    rows = flow.pieces[0].rows
    A, b, c = flow.A, flow.B[:, 0], flow.C[0]
    cA = c @ A
    g = float(cA @ b)
    if not rows[0, JUMPS] or rows[0, HIGH] != rows[1, LOW] or rows[0, HIGH] != 0.0:
        return None
    if abs(c @ b) > NOTHING * np.linalg.norm(c) * np.linalg.norm(b) or not g > 0.0:
        return None
    cAA = cA @ A
    Q = A - np.outer(b, cAA) / g
    values, vectors = np.linalg.eig(Q)
    order = np.argsort(np.abs(values))
    zero, rest = order[:2], order[2:]
    size = np.max(np.abs(np.linalg.eigvals(A)), initial=np.max(np.abs(values)))
    if np.any(np.abs(values[zero]) > ZERO * size) or np.any(values[rest].real >= -ZERO * size):
        return None
    null = np.linalg.svd(Q @ Q)[2][-2:].T  # the space of the two zeros
    basis = np.column_stack((null, vectors[:, rest]))
    if np.linalg.cond(basis) > 1.0 / ZERO:
        return None
    left = np.linalg.inv(basis)[2:]
    base = null @ np.linalg.solve(np.vstack((c, cA)) @ null, np.array([1.0, 0.0]))
    enters, lam = left @ b / g, values[rest]
    weights = cAA @ vectors[:, rest]
    return Contraction(
        c=c,
        cA=cA,
        left=left - np.outer(enters, cA),
        by_y=np.asarray(lam * enters, dtype=complex),
        values=lam,
        forced=np.asarray(lam**2 * enters, dtype=complex),
        weights=weights,
        push=g * float(rows[1, OFFSET]),
        kappa=-float(cAA @ b) / g,
        p=float((weights @ (lam * enters)).real + cAA @ base),
    )
