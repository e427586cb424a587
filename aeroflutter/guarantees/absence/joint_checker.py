"""Whether a certificate for two springs at one speed proves what it claims; as `checker` for one.

With H = C (sI - A + B Q C)^-1 B (Q - P) = N/d and E = |d|², let Y = N conj d - E I, at s = jω and
x = ω², be Yr + jω Yi: polynomials in x, exactly. Theorem 3 of docs/theory/absence.md asks for the
Hermitian part of diag(D) (H - I) - diag(K) to be negative, where

    D = b - j a/ω,    b = λ + Σ z (1 - cos ωt)/ω²,    a = w - x e,    e = Σ z (ωt - sin ωt)/ω³,
    K = Σ c sin(ωt)/ω;        z belong to springs without memory, c to loops.

Times E it has the diagonal S11, S22 and above it S12 + jωτ:

    Sii = bi Yr_ii + ai Yi_ii - E Ki,      2 S12 = b1 Yr_12 + a1 Yi_12 + b2 Yr_21 + a2 Yi_21,
    2 τ = b1 Yi_12 - b2 Yi_21 - W + e1 Yr_12 - e2 Yr_21,      W = (w1 Yr_12 - w2 Yr_21)/x,

all regular at zero where w1 H12(0) = w2 H21(0), which fixes one of the weights by the other,
exactly. It is negative where g = S12² + x τ² - S11 S22 < 0 and S11 < 0; where g < 0 everywhere,
S11 has one sign, so that one frequency decides. g < 0 is shown beyond some Ω by balls for b, a and
K, and below it by covering [0, Ω] with intervals on which g(ω0) + max|g'| δω < 0.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from flint import arb, arb_poly, arb_series, ctx, fmpq_mat, fmpq_poly

from aeroflutter.guarantees.absence.certificate import Joint, Loop
from aeroflutter.guarantees.absence.checker import Refused, _exact, _hurwitz, _sinc

__all__ = ["check_joint"]

_BITS, _CELLS = 100, 64  # of [0, Ω], to begin with
_LARGEST = 2.0**20  # Ω
_BALANCE = 1e-9  # how well the weights that are stated agree with those that are used

Pair = tuple[Any, Any]


def check_joint(claim: Joint, most: int = 100_000) -> int:
    """Prove the claim, or raise `Refused`; the number of intervals that it took."""
    before, cap = ctx.prec, ctx.cap
    ctx.prec, ctx.cap = _BITS, 2
    try:
        _hypotheses(claim)
        return _Form(claim).proved(most)
    finally:
        ctx.prec, ctx.cap = before, cap


def _hypotheses(claim: Joint) -> None:
    sizes = {len(one) for one in (claim.springs, claim.w, claim.lam, claim.terms, claim.C)}
    if sizes != {2} or any(len(row) != 2 for row in claim.B):
        raise Refused("the claim is not of two springs")
    for law, lam, terms in zip(claim.springs, claim.lam, claim.terms, strict=True):
        for number in (term for pair in terms for term in pair):
            _exact(number)
        if not _exact(lam) > 0:
            raise Refused("λ is not positive")
        if isinstance(law, Loop):
            if not all(t > 0.0 for t, _ in terms):
                raise Refused("a loop needs t > 0")
        elif not (law.low <= law.high and all(z >= 0.0 for _, z in terms)):
            raise Refused("a static law needs ordered slopes and z ≥ 0")


def _parts(f: Any) -> Pair:
    """Real part, and imaginary part over ω, of a polynomial at s = jω, as polynomials in x."""
    signed = [one * (-1) ** (k // 2) for k, one in enumerate(f.coeffs())]
    return fmpq_poly(signed[0::2]), fmpq_poly(signed[1::2])


class _Form:
    """g and what it is made of."""

    def __init__(self, claim: Joint) -> None:
        slopes = [(0.0, 1.0) if isinstance(s, Loop) else (s.low, s.high) for s in claim.springs]
        A, B, C = (fmpq_mat([[_exact(one) for one in row] for row in M]) for M in claim.matrices)
        P, Q = (
            fmpq_mat([[_exact(slopes[i][k]) if i == j else 0 for j in (0, 1)] for i in (0, 1)])
            for k in (0, 1)
        )
        d, N = _resolvent(A - B * Q * C, B * (Q - P), C)
        _hurwitz(d.coeffs())
        x, (dr, di) = fmpq_poly([0, 1]), _parts(d)
        E = dr * dr + x * di * di
        Yr, Yi = [[0, 0], [0, 0]], [[0, 0], [0, 0]]
        for i in (0, 1):
            for j in (0, 1):
                nr, ni = _parts(N[i][j])
                Yr[i][j] = nr * dr + x * ni * di - (E if i == j else 0)
                Yi[i][j] = ni * dr - nr * di
        self.w = _balanced(claim, N[0][1](0), N[1][0](0))
        _enough_friction(claim, self.w)
        odd = self.w[0] * Yr[0][1] - self.w[1] * Yr[1][0]
        assert odd[0] == 0
        forms = [E, fmpq_poly(odd.coeffs()[1:])] + [Y[i][j] for Y in (Yr, Yi) for i, j in _PLACES]
        self.forms = [arb_poly([arb(one) for one in f.coeffs()]) for f in forms]
        self.loops = [isinstance(law, Loop) for law in claim.springs]
        self.lam = [arb(one) for one in claim.lam]
        self.terms = [[(arb(t), arb(c)) for t, c in one] for one in claim.terms]

    def proved(self, most: int) -> int:
        Omega = 1.0
        while not self._tail(Omega):
            Omega *= 2.0
            if Omega > _LARGEST:
                raise Refused("the form is not shown to be negative at high frequencies")
        if not self._S11(arb_series([arb(Omega), 1]))[0] < 0:
            raise Refused("the form is not negative", Omega)
        r, count = Omega / (2 * _CELLS), 0
        todo = [((2 * k + 1) * r, r) for k in range(_CELLS)]
        while todo:
            omega, r = todo.pop()
            value = self._g(arb_series([arb(omega), 1]))[0]
            count += 1
            if value + abs(self._g(arb_series([arb(omega, r), 1]))[1]) * r < 0:
                continue
            if not value < 0 or count > most:
                why = "it takes too many intervals" if count > most else "the form is not negative"
                raise Refused(f"{why} at ω = {omega:.9g}", None if count > most else omega)
            todo += [(omega - r / 2, r / 2), (omega + r / 2, r / 2)]
        return count

    def _weights(self, omega: Any, i: int) -> tuple[Any, Any, Any, Any]:
        """b, a, e and K of a spring."""
        w, one = arb(self.w[i]), arb_series([1])
        if self.loops[i]:
            return one * self.lam[i], one * w, one * 0, _sum(c * t * _entire(_sinc, omega * t)
                                                             for t, c in self.terms[i])  # fmt: skip
        halves = ((z * t**2 / 2, _entire(_sinc, omega * t / 2)) for t, z in self.terms[i])
        b = one * self.lam[i] + _sum(size * half * half for size, half in halves)
        e = _sum(z * t**3 * _entire(_sagging, omega * t) for t, z in self.terms[i])
        return b, one * w - omega * omega * e, e, one * 0

    def _S11(self, omega: Any) -> Any:
        E, _, *Y = (_at(f, omega * omega) for f in self.forms)
        b, a, _, K = self._weights(omega, 0)
        return b * Y[0] + a * Y[4] - E * K

    def _g(self, omega: Any) -> Any:
        x = omega * omega
        E, W, r11, r12, r21, r22, i11, i12, i21, i22 = (_at(f, x) for f in self.forms)
        (b1, a1, e1, K1), (b2, a2, e2, K2) = (self._weights(omega, i) for i in (0, 1))
        S11, S22 = b1 * r11 + a1 * i11 - E * K1, b2 * r22 + a2 * i22 - E * K2
        S12 = b1 * r12 + a1 * i12 + b2 * r21 + a2 * i21
        tau = b1 * i12 - b2 * i21 - W + e1 * r12 - e2 * r21
        return (S12 * S12 + x * tau * tau) / 4 - S11 * S22

    def _tail(self, Omega: float) -> bool:
        """Whether x g < 0 for all ω ≥ Ω: every power of x - Ω² has a negative coefficient."""
        x = arb_poly([arb(Omega) ** 2, 1])
        E, _, r11, r12, r21, r22, i11, i12, i21, i22 = (f(x) for f in self.forms)
        (b1, a1, K1), (b2, a2, K2) = (self._beyond(Omega, i) for i in (0, 1))
        S11, S22 = b1 * r11 + a1 * i11 - K1 * E, b2 * r22 + a2 * i22 - K2 * E
        S12 = b1 * r12 + a1 * i12 + b2 * r21 + a2 * i21
        tau = x * (b1 * i12 - b2 * i21) - (a1 * r12 - a2 * r21)  # times x
        g = x * (S12 * S12 * arb(0.25) - S11 * S22) + tau * tau * arb(0.25)
        return all(one < 0 for one in g.coeffs())

    def _beyond(self, Omega: float, i: int) -> tuple[Any, Any, Any]:
        """Balls that hold b, a and K at every ω ≥ Ω."""
        total, unit = sum((abs(c) for _, c in self.terms[i]), arb(0)), arb(0, 1)
        if self.loops[i]:
            return self.lam[i], arb(self.w[i]), unit * total / Omega
        most = total / arb(Omega) ** 2  # of (1 - cos)/ω², halved
        moments = sum((t * z for t, z in self.terms[i]), arb(0))
        a = arb(self.w[i]) - moments + unit * total / Omega
        return self.lam[i] + most + unit * most, a, arb(0)


_PLACES = ((0, 0), (0, 1), (1, 0), (1, 1))


def _resolvent(A: Any, B: Any, C: Any) -> tuple[Any, list[list[Any]]]:
    """d and N of C (sI - A)^-1 B by Faddeev and LeVerrier."""
    n = A.nrows()
    one = fmpq_mat([[int(i == j) for j in range(n)] for i in range(n)])
    M, d, powers = one, [1], []
    for k in range(1, n + 1):
        powers.append(C * M * B)
        M = A * M
        d.append(-sum(M[i, i] for i in range(n)) / k)
        M = M + one * d[k]
    N = [[fmpq_poly([one[i, j] for one in powers[::-1]]) for j in (0, 1)] for i in (0, 1)]
    return fmpq_poly(d[::-1]), N


def _balanced(claim: Joint, H12: Any, H21: Any) -> Pair:
    """Weights with w1 H12(0) = w2 H21(0), exactly; one is as stated."""
    w1, w2 = (_exact(one) for one in claim.w)
    if H12 == H21 == 0:
        return w1, w2
    used = (w1, w1 * H12 / H21) if abs(H21) >= abs(H12) else (w2 * H21 / H12, w2)
    wrong = max(abs(used[0] - w1), abs(used[1] - w2))
    if wrong > _exact(_BALANCE) * (abs(w1) + abs(w2)):
        raise Refused("w1 H12(0) and w2 H21(0) differ")
    return used


def _enough_friction(claim: Joint, w: Pair) -> None:
    for law, weight, terms in zip(claim.springs, w, claim.terms, strict=True):
        total = sum((abs(_exact(c)) for _, c in terms), _exact(0.0))
        if isinstance(law, Loop) and not (
            weight > 0 and 0 <= _exact(law.delta_h) * total < weight * _exact(law.delta_v)
        ):
            raise Refused("ΔH Σ|c| is not below w ΔV")


def _sum(values: Any) -> Any:
    return sum(values, arb_series([0]))


def _at(f: Any, x: Any) -> Any:
    """A polynomial of a series, by Horner's rule."""
    value = arb_series([0])
    for one in reversed(f.coeffs()):
        value = value * x + one
    return value


def _entire(f: Callable[[Any], Pair], z: Any) -> Any:
    """A function, given with its derivative, of a series of two terms."""
    value, slope = f(z[0])
    return arb_series([value, slope * z[1]])


def _sagging(z: Any) -> Pair:
    """(z - sin z)/z³ and its derivative."""
    if abs(z) > 1 or 5040 * z.rad() < abs(z) ** 7:
        value, slope = _sinc(z)
        value = (1 - value) / z**2
        return value, -slope / z**2 - 2 * value / z
    # ∫ (1 - s)²/2 cos(zs) ds over [0, 1], and the bounds of cosine and sine there.
    value = arb(1) / 6 - z**2 / 120 + arb(0, 1) * z**4 / 5040
    return value, -z / 60 + arb(0, 1) * abs(z) ** 3 / 1260
