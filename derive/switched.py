"""Describing functions of polynomials and of laws that jump or follow, from their definitions.

Under alpha = B + A sin(theta) a relay jumps where the motion crosses its edges, friction where it
turns, and play follows the motion where it has taken up its slack. Each is integrated piece by
piece between the angles at which that happens. With sin(g) = gamma such an angle has

    dg = dgamma / cos(g),    d cos(g) = -gamma dgamma / cos(g),

which gives the derivatives. A polynomial is expanded about the bias, sum_j D_j A^j sin^j(theta)
with D_j = F^(j)(B)/j!, so that only means of powers of the sine are wanted.
"""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from derive.describing import (
    AMPLITUDE,
    BETA1,
    BIAS,
    DELTA_V,
    THETA,
    Harmonics,
    Segment,
    integrate,
)

HIGHEST = 16
"""Degree up to which the weights of a polynomial are written out."""

MOMENT, WIDTH, FRICTION = sp.symbols("moment width friction", real=True)
PER = sp.Symbol("per", nonnegative=True)  # 1/A
_HALF = sp.pi / 2


@dataclass(frozen=True)
class Crossing:
    """An angle g with sin(g) = gamma: symbols, reached as attributes in the generated code."""

    name: str

    def symbol(self, part: str) -> sp.Symbol:
        """``name.angle``, ``name.gamma``, ``name.root`` = cos(g) or ``name.steep`` = 1/cos(g)."""
        return sp.Symbol(f"{self.name}.{part}", real=True)

    @property
    def angle(self) -> sp.Symbol:
        """The angle itself, as the integrals have it."""
        return sp.Symbol(f"g_{self.name}", real=True)

    def named(self, expression: sp.Expr) -> sp.Expr:
        """An integral with the angle and its functions by their names."""
        g = self.angle
        plain = expression.subs({sp.sin(g): self.symbol("gamma"), sp.cos(g): self.symbol("root")})
        return plain.subs(g, self.symbol("angle"))

    def derivative(self, expression: sp.Expr, gamma: sp.Expr, variable: sp.Symbol) -> sp.Expr:
        """What a change of gamma (in A and B) contributes to the derivative of an expression."""
        turn = gamma.diff(variable) * self.symbol("steep")
        return turn * (
            expression.diff(self.symbol("angle"))
            + expression.diff(self.symbol("gamma")) * self.symbol("root")
            - expression.diff(self.symbol("root")) * self.symbol("gamma")
        )


UPPER, LOWER, TAKEN = Crossing("upper"), Crossing("lower"), Crossing("taken")


def relay_segments() -> list[Segment]:
    """A relay: up where the motion rises through +width/2, down where it falls through -width/2."""
    up, down = UPPER.angle, sp.pi - LOWER.angle
    return [(-MOMENT, -_HALF, up), (MOMENT, up, down), (-MOMENT, down, 3 * _HALF)]


def relay_gammas() -> dict[Crossing, sp.Expr]:
    """Sines of the two angles."""
    return {
        UPPER: (WIDTH / 2 - BIAS) / AMPLITUDE,
        LOWER: (-WIDTH / 2 - BIAS) / AMPLITUDE,
    }


def play_segments() -> list[Segment]:
    """Play of total width delta_v: its output rests after each turn, then follows at a distance."""
    alpha, slack = BIAS + AMPLITUDE * sp.sin(THETA), DELTA_V / 2
    taken, reach = TAKEN.angle, AMPLITUDE - slack
    return [
        (BIAS - reach, -_HALF, taken),
        (alpha - slack, taken, _HALF),
        (BIAS + reach, _HALF, sp.pi + taken),
        (alpha + slack, sp.pi + taken, 3 * _HALF),
    ]


def play_gammas() -> dict[Crossing, sp.Expr]:
    """Sine of the angle at which the slack is taken up."""
    return {TAKEN: DELTA_V / AMPLITUDE - 1}


def friction_segments() -> list[Segment]:
    """Friction against the velocity, beside a linear spring."""
    line = BETA1 * (BIAS + AMPLITUDE * sp.sin(THETA))
    return [(line + FRICTION, -_HALF, _HALF), (line - FRICTION, _HALF, 3 * _HALF)]


def closed(segments: list[Segment], gammas: dict[Crossing, sp.Expr]) -> Harmonics:
    """The integrals of a law with its angles named."""
    raw = integrate(segments)
    values = [sp.expand(sp.expand_trig(value)) for value in (raw.F0, raw.n_p, raw.n_q)]
    for crossing in gammas:
        values = [crossing.named(value) for value in values]
    return Harmonics(*values)


def form(
    segments: list[Segment], gammas: dict[Crossing, sp.Expr], lengths: tuple[sp.Symbol, ...] = ()
) -> dict[str, sp.Expr]:
    """The three values and their six derivatives, amplitudes that divide written as ``per``.

    ``lengths`` are as many lengths of the law as there are angles, which are eliminated.
    """
    harmonics = closed(segments, gammas)
    sines = [crossing.symbol("gamma") - gamma for crossing, gamma in gammas.items()]
    known = sp.solve(sines, list(lengths), dict=True)[0] if lengths else {}
    found = {"F0": harmonics.F0, "n_p": harmonics.n_p, "n_q": harmonics.n_q}
    found = {name: sp.expand(value.subs(known)) for name, value in found.items()}
    for name in ("F0", "n_p", "n_q"):
        for suffix, variable in (("A", AMPLITUDE), ("B", BIAS)):
            total = found[name].diff(variable)
            for crossing, gamma in gammas.items():
                total += crossing.derivative(found[name], gamma, variable)
            found[f"d{name}_d{suffix}"] = sp.expand(total).subs(known)
    return {name: _short(value, gammas) for name, value in found.items()}


def _short(value: sp.Expr, gammas: dict[Crossing, sp.Expr]) -> sp.Expr:
    """Squares of sines resolved; ``steep`` for 1/cos, ``per`` for 1/A; no sines left alone."""
    for crossing, sine in gammas.items():
        gamma, root, steep = (crossing.symbol(part) for part in ("gamma", "root", "steep"))
        plain = (
            sp.expand(value)
            .subs(steep, 1 / root)
            .replace(
                lambda e, gamma=gamma: e.is_Pow and e.base == gamma and e.exp > 1,
                lambda e, gamma=gamma, root=root: (
                    gamma ** (e.exp % 2) * (1 - root**2) ** (e.exp // 2)
                ),
            )
        )
        value = sp.expand(plain).replace(
            lambda e, root=root: e.is_Pow and e.base == root and e.exp == -1,
            lambda e, steep=steep: steep,
        )
        if not value.has(root, steep):
            value = value.subs(gamma, sine)
    return sp.expand(sp.expand(value).subs(AMPLITUDE, 1 / PER))


def power_means(highest: int = HIGHEST) -> list[sp.Rational]:
    """Means of sin^j over a cycle, j = 0 … highest: what a power of the sine adds to F0 and, by

    the next one, to the first harmonic.
    """
    return [
        sp.integrate(sp.sin(THETA) ** j, (THETA, 0, 2 * sp.pi)) / (2 * sp.pi)
        for j in range(highest + 1)
    ]


def polynomial(beta: list[sp.Symbol]) -> Harmonics:
    """F = sum beta_i alpha^i by its expansion about the bias."""
    law = sum((b * BIAS**i for i, b in enumerate(beta, start=1)), sp.Integer(0))
    means = power_means(len(beta) + 1)
    F0, n_p = sp.Integer(0), sp.Integer(0)
    for j in range(len(beta) + 1):
        D = law.diff(BIAS, j) / sp.factorial(j)
        F0 += D * AMPLITUDE**j * means[j]
        n_p += 2 * D * AMPLITUDE**j * means[j + 1] / AMPLITUDE
    return Harmonics(sp.expand(F0), sp.expand(n_p), sp.Integer(0))
