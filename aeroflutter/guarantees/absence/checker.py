"""Whether a certificate of absence proves what it claims: nothing sampled, all rounding outward.

The claim (docs/theory/absence.md): ``x' = A x - b F(y)``, ``y = c x``, ``F = q y - (q - p) h``;
``h`` is the memory of a loop (p, q = 0, 1) or a function of ``y`` with slopes between 0 and 1. Let
``H = (q - p) c (sI - A + q b c)^-1 b = n/d``, d monic, n and d polynomials in s and v = 1/U; at
s = jω, x = ω²

    P = Im(n conj d)/ω,    E = |d|²,    Q = Re(n conj d) - E       (polynomials in x and v),
    f = (w + K1) P + (λ + K2) Q - K0 E,
    loop:    K0 = Σ c sin(ωt)/ω,    K1 = K2 = 0,
    static:  K1 = Σ c sin(ωt)/ω,    K2 = Σ c (1 - cos ωt)/ω²,    K0 = 0.

Nothing oscillates at a speed where A - q b c is Hurwitz, f < 0 for every ω ≥ 0, and

    loop:    w = 1, every t > 0, ΔH Σ|c| < ΔV;        static:    every c ≥ 0;
    both:    λ > 0, or λ = 0 and no terms.

`check` proves this for every speed of every piece:

1. the conditions on the numbers, exactly (`_hypotheses`);
2. A - q b c is Hurwitz at one speed by Hurwitz's determinants, exactly, and at the others because
   no root of d can cross the imaginary axis: f < 0 excludes d(jω) = 0 for ω > 0, where P, Q and E
   would vanish; d(0) ≠ 0 is shown by itself, as P need not vanish there; d is monic;
3. f < 0. Without terms f is a polynomial and is decided exactly, down to U = 0 (`_algebraic`). Else
   beyond some Ω by bounds of the K (`_tail`), and below it by covering [0, Ω] and the interval of v
   by boxes on which the mean-value form of f is negative (`_cover`).

Numbers are exact rationals, or balls of python-flint, which contain what they stand for; a
comparison of balls is true only if it is so for everything in them.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import isfinite
from typing import Any

from flint import Ordering, arb, arb_poly, ctx, fmpq, fmpq_mat, fmpq_mpoly_ctx, fmpq_poly

from aeroflutter.guarantees.absence.certificate import Certificate, Loop, Piece

__all__ = ["Checked", "Refused", "check"]

_BITS = 100
_CELLS = 16  # of [0, Ω], to begin with
_LARGEST = 2.0**20  # Ω
_RING = fmpq_mpoly_ctx.get(("x", "v"), Ordering.lex)


class Refused(Exception):
    """The certificate proves nothing, and why; `omega` is where f was not negative, if known."""

    def __init__(self, why: str, omega: float | None = None) -> None:
        super().__init__(why)
        self.omega = omega


@dataclass(frozen=True, kw_only=True)
class Checked:
    """What has been proved: every speed U > 0 with low ≤ U ≤ high; `boxes` says how much work."""

    low: float
    high: float
    boxes: int


def check(certificate: Certificate, most_boxes: int = 1_000_000) -> Checked:
    """Prove the claim, or raise `Refused`: something is wrong, or took more than `most_boxes`."""
    before, ctx.prec, boxes = ctx.prec, _BITS, 0
    loop, pieces = isinstance(certificate.spring, Loop), certificate.pieces
    try:
        _hypotheses(certificate)
        n, d = _transfer(certificate)
        _hurwitz([_by_x(one)[0](1 / _exact(pieces[0].high)) for one in d])
        forms = _forms(n, d)
        for piece in pieces:
            if _may_vanish(_by_x(d[0])[0], piece):
                raise Refused("d(0) has a zero: A - q b c is singular at a speed")
            if piece.terms or not _algebraic(piece, *forms[:2]):
                boxes += _boxes(piece, loop, forms, most_boxes - boxes)
    finally:
        ctx.prec = before
    return Checked(low=pieces[0].low, high=pieces[-1].high, boxes=boxes)


def _hypotheses(certificate: Certificate) -> None:
    spring, pieces = certificate.spring, certificate.pieces
    if not pieces or any(one.high != two.low for one, two in pairwise(pieces)):
        raise Refused("the pieces leave out a speed")
    for piece in pieces:
        if not (0.0 <= piece.low <= piece.high and piece.high > 0.0):
            raise Refused("a piece is no interval of speeds")
        if not (piece.lam > 0.0 or (piece.lam == 0.0 and not piece.terms)):
            raise Refused("λ is negative, or zero although there are terms")
        if isinstance(spring, Loop):
            total = sum((abs(_exact(c)) for _, c in piece.terms), _exact(0.0))
            if not (piece.w == 1.0 and all(t > 0.0 for t, _ in piece.terms)):
                raise Refused("a loop needs w = 1 and t > 0")
            if not 0 <= _exact(spring.delta_h) * total < _exact(spring.delta_v):
                raise Refused("ΔH Σ|c| is not below ΔV")
        elif not (spring.low <= spring.high and all(c >= 0.0 for _, c in piece.terms)):
            raise Refused("a static law needs ordered slopes and c ≥ 0")


def _exact(value: float) -> Any:
    if not isfinite(value):
        raise Refused("a number is not finite")
    return fmpq(*float(value).as_integer_ratio())


def _transfer(certificate: Certificate) -> tuple[list[Any], list[Any]]:
    """n and d by Faddeev and LeVerrier: their coefficients of s^0, s^1, …, polynomials in v."""
    model, spring = certificate.model, certificate.spring
    p, q = (0.0, 1.0) if isinstance(spring, Loop) else (spring.low, spring.high)
    p, q, c = _exact(p), _exact(q), [_exact(one) for one in model.c]
    v, one, size = _RING.gen(1), _RING.constant(1), range(len(c))
    b = [sum(_exact(term[i]) * v**k for k, term in enumerate(model.b)) for i in size]
    A = [
        [
            sum(_exact(term[i][j]) * v**k for k, term in enumerate(model.A)) - q * c[j] * b[i]
            for j in size
        ]
        for i in size
    ]
    M = [[one if i == j else one * 0 for j in size] for i in size]
    n, d = [], [one]
    for k in range(1, len(c) + 1):
        n.append((q - p) * sum(c[i] * M[i][j] * b[j] for i in size for j in size))
        M = [[sum(A[i][m] * M[m][j] for m in size) for j in size] for i in size]
        d.append(sum((M[i][i] for i in size), 0 * one) / -k)
        M = [[M[i][j] + (d[k] if i == j else 0) for j in size] for i in size]
    return n[::-1], d[::-1]


def _forms(n: list[Any], d: list[Any]) -> tuple[Any, Any, Any]:
    """P, Q and E."""
    x = _RING.gen(0)
    # At s = jω: real part, and imaginary part over ω.
    (nr, ni), (dr, di) = (
        [sum(one * (-x) ** k for k, one in enumerate(powers[start::2])) for start in (0, 1)]
        for powers in (n, d)
    )
    E = dr * dr + x * di * di
    return ni * dr - nr * di, nr * dr + x * ni * di - E, E


def _by_x(f: Any) -> list[Any]:
    """The coefficients of x^0, x^1, … of a polynomial, as polynomials in v."""
    table = {(int(i), int(k)): value for (i, k), value in f.to_dict().items()}
    degrees = [max((key[axis] for key in table), default=0) + 1 for axis in (0, 1)]
    return [fmpq_poly([table.get((i, k), 0) for k in range(degrees[1])]) for i in range(degrees[0])]


def _hurwitz(d: list[Any]) -> None:
    """Refuse unless every root of a monic polynomial has a negative real part."""
    a = dict(enumerate(reversed(d)))
    for size in range(1, len(d)):
        rows = [[a.get(2 * j - i + 1, 0) for j in range(size)] for i in range(size)]
        if not fmpq_mat(rows).det() > 0:
            raise Refused("A - q b c is not Hurwitz")


def _may_vanish(f: Any, piece: Piece) -> bool:
    """Whether a polynomial in v has, or may have, a zero in the interval of the piece."""
    low, high = 1 / _exact(piece.high), 1 / _exact(piece.low) if piece.low else None
    return f == 0 or any(
        not (root.imag != 0 or root.real < low or (high is not None and root.real > high))
        for root in _roots(f)
    )


def _roots(f: Any) -> list[Any]:
    """Balls around the roots, the imaginary part of real ones exactly zero."""
    return [root for root, _ in f.numer().complex_roots()]


def _algebraic(piece: Piece, P: Any, Q: Any) -> bool:
    """Whether f = w P + λ Q is shown to be negative for all x ≥ 0 and all v of the piece.

    It is at one end. As v changes, a root x ≥ 0 could appear only at x = 0, from infinity, or as a
    double root: where the first or the last coefficient or the discriminant vanishes.
    """
    f = _exact(piece.w) * P + _exact(piece.lam) * Q
    powers = _by_x(f)
    at_end = fmpq_poly([one(1 / _exact(piece.high)) for one in powers])
    if len(powers) < 2 or not at_end(0) < 0:
        return False
    if not all(root.imag != 0 or root.real < 0 for root in _roots(at_end)):
        return False
    critical = powers[0], powers[-1], _by_x(f.discriminant("x"))[0]
    return not any(_may_vanish(one, piece) for one in critical)


class _Weights:
    """a, b, c of f = a P + b Q + c E as functions of ω: w + K1, λ + K2 and -K0."""

    def __init__(self, piece: Piece, loop: bool) -> None:
        self.loop, self.base = loop, (arb(piece.w), arb(piece.lam))
        self.terms = [(arb(t), arb(c)) for t, c in piece.terms]

    def at(self, omega: Any) -> tuple[list[Any], list[Any]]:
        """The weights and their derivatives."""
        K = L = dK = dL = arb(0)
        for t, c in self.terms:
            value, slope = _sinc(omega * t)
            K, dK = K + c * t * value, dK + c * t**2 * slope
            if not self.loop:  # (1 - cos z)/z² = sinc²(z/2)/2
                value, slope = _sinc(omega * t / 2)
                L, dL = L + c * t**2 / 2 * value**2, dL + c * t**3 / 2 * value * slope
        return self._placed(K, L, *self.base), self._placed(dK, dL, arb(0), arb(0))

    def beyond(self, Omega: float) -> list[list[Any]]:
        """Corners of a box that holds the weights at every ω ≥ Ω; f is affine in them."""
        K = sum((abs(c) for _, c in self.terms), arb(0)) / Omega
        L = 0, 2 * K / Omega
        return [self._placed(one, two, *self.base) for one in (-K, K) for two in L]

    def _placed(self, K: Any, L: Any, w: Any, lam: Any) -> list[Any]:
        return [w, lam, -K] if self.loop else [w + K, lam + L, arb(0)]


def _mix(weights: list[Any], forms: Any) -> Any:
    """a P + b Q + c E."""
    return sum((one * form for one, form in zip(weights, forms, strict=True)), 0 * forms[0])


def _sinc(z: Any) -> tuple[Any, Any]:
    """sin(z)/z and its derivative."""
    if abs(z) > 1:
        sine, cosine = z.sin_cos()
        return sine / z, (cosine - sine / z) / z
    # sinc'(z) = -∫ s sin(zs) ds over [0, 1], and |sin(y) - y + y³/6| ≤ |y|⁵/120.
    return z.sinc(), -z / 3 + z**3 / 30 + arb(0, 1) * abs(z) ** 5 / 840


def _boxes(piece: Piece, loop: bool, forms: tuple[Any, ...], most: int) -> int:
    """Show that f < 0 for all ω ≥ 0 and v of the piece; the number of boxes it took."""
    if piece.low == 0.0:
        raise Refused("U = 0 is out of reach of boxes")
    low, high = 1 / _exact(piece.high), 1 / _exact(piece.low)
    x, u = _RING.gens()  # v = (low + high)/2 + u (high - low)/2, |u| ≤ 1
    local = [_by_x(one.compose(x, (low + high) / 2 + u * (high - low) / 2)) for one in forms]
    powers = range(max(one.length() for form in local for one in form))
    split = [[arb_poly([arb(one[k]) for one in form]) for k in powers] for form in local]
    by_u, weights, Omega = list(zip(*split, strict=True)), _Weights(piece, loop), 1.0
    while not _tail(Omega, weights, by_u):
        Omega *= 2.0
        if Omega > _LARGEST:
            raise Refused("f is not shown to be negative at high frequencies")
    return _cover(Omega, weights, by_u, most)


def _tail(Omega: float, weights: _Weights, by_u: list[Any]) -> bool:
    """Whether f < 0 for all ω ≥ Ω: each power of x - Ω² has a negative coefficient, for |u| ≤ 1."""
    onward = arb_poly([arb(Omega) ** 2, 1])
    for corner in weights.beyond(Omega):
        f = [_mix(corner, forms)(onward) for forms in by_u]
        for j in range(max(one.length() for one in f)):
            if not arb_poly([one[j] for one in f])(arb(0, 1)) < 0:
                return False
    return True


def _slab(omega: float, r: float, weights: _Weights, by_u: list[Any]) -> tuple[Any, Any, Any]:
    """f and df/du at ω, and df/dω for all frequencies within r of it, as polynomials in u."""
    at, wide = arb(omega), arb(omega, r)
    here, (over, slopes) = weights.at(at)[0], weights.at(wide)
    values = arb_poly([_mix(here, [one(at**2) for one in forms]) for forms in by_u])
    by_x = [_mix(over, [one.derivative()(wide**2) for one in forms]) for forms in by_u]
    by_weights = [_mix(slopes, [one(wide**2) for one in forms]) for forms in by_u]
    along = arb_poly([2 * wide * a + b for a, b in zip(by_x, by_weights, strict=True)])
    return values, values.derivative(), along


def _cover(Omega: float, weights: _Weights, by_u: list[Any], most: int) -> int:
    """Cover [0, Ω] x [-1, 1] by boxes with f(ω0, u0) + max|df/du| δu + max|df/dω| δω < 0."""
    r, boxes = Omega / (2 * _CELLS), 0
    todo = [((2 * k + 1) * r, r, [(0.0, 1.0)]) for k in range(_CELLS)]
    while todo:
        omega, r, intervals = todo.pop()
        (f, df_du, df_domega), left = _slab(omega, r, weights, by_u), []
        while intervals:
            u, half = intervals.pop()
            value, wide, boxes = f(arb(u)), arb(u, half), boxes + 1
            along_u, along_omega = abs(df_du(wide)) * half, abs(df_domega(wide)) * r
            if value + along_u + along_omega < 0:
                continue
            if not value < 0 or boxes > most:
                why = "it takes too many boxes" if boxes > most else "f is not negative"
                raise Refused(f"{why} at ω = {omega:.9g}", None if boxes > most else omega)
            if along_u.mid() > along_omega.mid():
                intervals += [(u - half / 2, half / 2), (u + half / 2, half / 2)]
            else:
                left.append((u, half))
        if left:
            todo += [(omega - r / 2, r / 2, [*left]), (omega + r / 2, r / 2, [*left])]
    return boxes
