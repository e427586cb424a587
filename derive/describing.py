"""Describing functions with bias, integrated from the definition of every spring.

Under alpha = B + A sin(theta) a spring answers F = F0 + n_p A sin(theta) + n_q A cos(theta) + ...
A continuous piecewise-linear law is a straight line plus corners,

    F = s alpha + f + sum_j (change of slope)_j |alpha - t_j| / 2,

s and f being the averages of the two outermost pieces, so one integral serves every static law.
With d = t - B, sin(g) = d/A and g = +-pi/2 where the motion stays on one side of the corner:

    mean of |alpha - t|           = (2/pi) (A + X),   X = A (cos(g) + g sin(g) - 1)
    first harmonic of |alpha - t| = -S A sin(theta),  S = (2/pi) (g + sin(g) cos(g))

X and S vanish as A grows, so nothing cancels there. The hysteresis loop is piecewise linear on the
rising and on the falling half of the cycle, with corners of its own on each.
"""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

AMPLITUDE = sp.Symbol("A", positive=True)
BIAS = sp.Symbol("B", real=True)
OFFSET = sp.Symbol("d", real=True)
ANGLE = sp.Symbol("angle", real=True)
GAMMA = sp.Symbol("gamma", real=True)
ROOT = sp.Symbol("root", nonnegative=True)
DROP = sp.Symbol("drop", nonnegative=True)
RATE = sp.Symbol("rate", nonnegative=True)
THETA = sp.Symbol("theta", real=True)

Segment = tuple[sp.Expr, sp.Expr, sp.Expr]  # value, from theta, to theta


@dataclass(frozen=True)
class Harmonics:
    """Mean and first-harmonic gains of a spring."""

    F0: sp.Expr
    n_p: sp.Expr
    n_q: sp.Expr


def integrate(segments: list[Segment], amplitude: sp.Expr = AMPLITUDE) -> Harmonics:
    """Fourier integrals over one cycle of a moment given segment by segment (section 3.2.2)."""

    def cycle(weight: sp.Expr) -> sp.Expr:
        parts = [
            sp.integrate(sp.expand(moment * weight), (THETA, low, high))
            for moment, low, high in segments
        ]
        return sp.expand(sum(parts, sp.Integer(0)))

    first = sp.pi * amplitude
    sine, cosine = cycle(sp.sin(THETA)), cycle(sp.cos(THETA))
    return Harmonics(cycle(sp.Integer(1)) / (2 * sp.pi), sine / first, cosine / first)


@dataclass(frozen=True)
class Corner:
    """X ("even") and S ("odd") of one corner and their derivatives."""

    even: sp.Expr
    even_A: sp.Expr
    even_d: sp.Expr
    odd: sp.Expr
    odd_A: sp.Expr
    odd_d: sp.Expr


def corner_integrals() -> Harmonics:
    """Integrals of |sin(theta) - sin(g)|, crossed upwards at g and downwards at pi - g."""
    distance = sp.sin(THETA) - sp.sin(ANGLE)
    segments = [
        (distance, ANGLE, sp.pi - ANGLE),
        (-distance, sp.pi - ANGLE, 2 * sp.pi + ANGLE),
    ]
    unit = integrate(segments, sp.Integer(1))
    return Harmonics(*(sp.simplify(value) for value in (unit.F0, unit.n_p, unit.n_q)))


def corner() -> Corner:
    """X and S of a corner, written in the terms that lose no digits at either end.

    root = cos(g), drop = 1 - root, rate = root/A, and gamma = sin(g) = d/A.
    """
    unit = corner_integrals()
    even = AMPLITUDE * (sp.pi * unit.F0 / 2 - 1)
    odd = -unit.n_p
    # d = A sin(g), differentiated
    turn = {
        OFFSET: 1 / (AMPLITUDE * sp.cos(ANGLE)),
        AMPLITUDE: -sp.sin(ANGLE) / (AMPLITUDE * sp.cos(ANGLE)),
    }

    def derivative(expression: sp.Expr, variable: sp.Symbol) -> sp.Expr:
        return sp.simplify(expression.diff(variable) + expression.diff(ANGLE) * turn[variable])

    def named(expression: sp.Expr) -> sp.Expr:
        plain = sp.expand(sp.expand_trig(expression))
        return plain.subs({sp.cos(ANGLE): ROOT, sp.sin(ANGLE): GAMMA})

    def by_drop(expression: sp.Expr) -> sp.Expr:
        return sp.expand(named(expression).subs(ROOT, 1 - DROP)).subs(AMPLITUDE * GAMMA, OFFSET)

    def by_rate(expression: sp.Expr) -> sp.Expr:
        return named(expression).subs(ROOT, RATE * AMPLITUDE)

    return Corner(
        even=by_drop(even),
        even_A=by_drop(derivative(even, AMPLITUDE)),
        even_d=by_drop(derivative(even, OFFSET)),
        odd=sp.factor_terms(named(odd)),
        odd_A=by_rate(derivative(odd, AMPLITUDE)),
        odd_d=by_rate(derivative(odd, OFFSET)),
    )


@dataclass(frozen=True)
class NamedCorner:
    """A corner of the generated code: symbols of its X and S, reached as attributes there."""

    name: str

    def symbol(self, part: str) -> sp.Symbol:
        """``name.part``, one field of the generated ``Corner``."""
        return sp.Symbol(f"{self.name}.{part}", real=True)


@dataclass(frozen=True)
class StaticLaw:
    """Continuous piecewise-linear law: slopes and intercepts of its pieces, breaks between."""

    slopes: tuple[sp.Expr, ...]
    offsets: tuple[sp.Expr, ...]
    breaks: tuple[sp.Expr, ...]

    def __post_init__(self) -> None:
        for i, t in enumerate(self.breaks):
            jump = (self.slopes[i + 1] - self.slopes[i]) * t + self.offsets[i + 1] - self.offsets[i]
            if sp.simplify(jump) != 0:
                raise ValueError(f"the law jumps by {jump} at {t}")

    def describing(self, corners: tuple[NamedCorner, ...]) -> Harmonics:
        """Straight line plus corners."""
        slope = (self.slopes[0] + self.slopes[-1]) / 2
        offset = (self.offsets[0] + self.offsets[-1]) / 2
        mean = (self.slopes[-1] - self.slopes[0]) * AMPLITUDE / sp.pi
        gain = sp.Integer(0)
        for i, item in enumerate(corners):
            change = self.slopes[i + 1] - self.slopes[i]
            mean += change * item.symbol("even") / sp.pi
            gain += change * item.symbol("odd") / 2
        return Harmonics(slope * BIAS + sp.simplify(offset) + mean, slope - gain, sp.Integer(0))

    def segments(self, crossings: tuple[sp.Symbol, ...]) -> list[Segment]:
        """The moment against theta where the motion crosses every break, at these angles."""
        alpha = BIAS + AMPLITUDE * sp.sin(THETA)
        pieces = [s * alpha + f for s, f in zip(self.slopes, self.offsets, strict=True)]
        up = [-sp.pi / 2, *crossings, sp.pi / 2]
        rising = list(zip(pieces, up[:-1], up[1:], strict=True))
        falling = [(f, sp.pi - high, sp.pi - low) for f, low, high in reversed(rising)]
        return rising + falling


SLOPE, INTERCEPT, TURN = sp.symbols("slope intercept turn", real=True)
CORNERS = NamedCorner("corners")


def piecewise() -> Harmonics:
    """Any static law, its corners weighted by their change of slope and summed into one."""
    mean = TURN * AMPLITUDE + CORNERS.symbol("even")
    gain = SLOPE - CORNERS.symbol("odd") / 2
    return Harmonics(SLOPE * BIAS + INTERCEPT + mean / sp.pi, gain, sp.Integer(0))


M0, M_F, ALPHA_F, DELTA = sp.symbols("m0 m_f alpha_f delta", real=True)
GAP, CENTRE = sp.symbols("gap centre", real=True)
BETA1, BETA3 = sp.symbols("beta1 beta3", real=True)
_ONE = sp.Integer(1)

LINEAR = StaticLaw((SLOPE,), (-SLOPE * CENTRE,), ())
BILINEAR = StaticLaw(
    (_ONE, M_F, _ONE),
    (M0 - ALPHA_F, M0 - M_F * ALPHA_F, M0 - ALPHA_F + DELTA * (M_F - 1)),
    (ALPHA_F, ALPHA_F + DELTA),
)
FREEPLAY = StaticLaw(
    (_ONE, sp.Integer(0), _ONE),
    (GAP / 2 - CENTRE, sp.Integer(0), -GAP / 2 - CENTRE),
    (CENTRE - GAP / 2, CENTRE + GAP / 2),
)


def cubic() -> Harmonics:
    """F = beta1 alpha + beta3 alpha^3, integrated."""
    alpha = BIAS + AMPLITUDE * sp.sin(THETA)
    cycle = [(BETA1 * alpha + BETA3 * alpha**3, sp.Integer(0), 2 * sp.pi)]
    raw = integrate(cycle)
    return Harmonics(*(sp.expand(value) for value in (raw.F0, raw.n_p, raw.n_q)))


DELTA_V, DELTA_H, V_OFF, H_OFF = sp.symbols("delta_v delta_h v_off h_off", real=True)
TOP, BOTTOM = sp.symbols("top bottom", real=True)
CORNER_NAMES = ("rise_start", "rise_end", "fall_end", "fall_start")
CORNER_SIGNS = (1, -1, 1, -1)
LOOP = NamedCorner("loop")


def hysteresis_corners() -> tuple[sp.Expr, ...]:
    """Pitch from the bias at the four corners, in the order of ``CORNER_NAMES``.

    ``top`` and ``bottom`` are the extremes of the memory from B - V_off. It follows
    alpha - V1 while pitch rises and alpha - V2 while pitch falls.
    """
    half = DELTA_V / 2
    return (BOTTOM + half, TOP + half, BOTTOM - half, TOP - half)


def hysteresis_segments(crossings: tuple[sp.Symbol, ...]) -> list[Segment]:
    """F = alpha - h round the loop whose memory slides between the crossing angles."""
    rise_start, rise_end, fall_end, fall_start = crossings
    alpha = BIAS + AMPLITUDE * sp.sin(THETA)
    memory = BIAS - V_OFF
    half = sp.pi / 2
    return [
        (alpha - memory - BOTTOM, -half, rise_start),
        (V_OFF + DELTA_V / 2, rise_start, rise_end),
        (alpha - memory - TOP, rise_end, half),
        (alpha - memory - TOP, half, sp.pi - fall_start),
        (V_OFF - DELTA_V / 2, sp.pi - fall_start, sp.pi - fall_end),
        (alpha - memory - BOTTOM, sp.pi - fall_end, 3 * half),
    ]


def hysteresis() -> Harmonics:
    """Closed form of the loop: half a corner each, and the area of the loop over pi A^2.

    ``LOOP`` is the sum of the four corners with ``CORNER_SIGNS``.
    """
    return Harmonics(
        V_OFF - (TOP + BOTTOM) / 2 - LOOP.symbol("even") / (2 * sp.pi),
        1 + LOOP.symbol("odd") / 4,
        DELTA_V * (TOP - BOTTOM) / (sp.pi * AMPLITUDE**2),
    )


def derivatives(
    form: Harmonics, corners: tuple[NamedCorner, ...], moving: tuple[sp.Symbol, ...] = ()
) -> dict[str, sp.Expr]:
    """Partial derivatives with respect to amplitude and bias, through corners and ``moving``.

    The derivative of a moving symbol s is called ``s_A`` or ``s_B``.
    """
    result = {}
    for name, value in (("F0", form.F0), ("n_p", form.n_p), ("n_q", form.n_q)):
        for suffix, variable in (("A", AMPLITUDE), ("B", BIAS)):
            total = value.diff(variable)
            for item in corners:
                for part in ("even", "odd"):
                    inner = item.symbol(f"{part}_{suffix}")
                    total += value.diff(item.symbol(part)) * inner
            for symbol in moving:
                total += value.diff(symbol) * sp.Symbol(f"{symbol}_{suffix}", real=True)
            result[f"d{name}_d{suffix}"] = total
    return result
