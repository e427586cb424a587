"""Proofs about the describing functions: corners, closed forms, limits, dissipation."""

from __future__ import annotations

from functools import partial

import sympy as sp

from derive import describing as d
from derive.proofs.same import Proof, check_same

G1, G2, G3, G4 = sp.symbols("g_1:5", real=True)
_PAIR = (d.NamedCorner("lower"), d.NamedCorner("upper"))


def even(angle: sp.Expr) -> sp.Expr:
    """X of a corner the motion crosses at this angle."""
    return d.AMPLITUDE * (sp.cos(angle) + angle * sp.sin(angle) - 1)


def odd(angle: sp.Expr) -> sp.Expr:
    """S of a corner the motion crosses at this angle."""
    return 2 * (angle + sp.sin(angle) * sp.cos(angle)) / sp.pi


def saturated(gamma: sp.Expr) -> sp.Expr:
    """The function f of equation 3.42 for an argument between -1 and 1."""
    return 2 * (sp.asin(gamma) + gamma * sp.sqrt(1 - gamma**2)) / sp.pi


def corner_integrals() -> None:
    """Compare what is emitted with the integrals of |sin(theta) - sin(g)|."""
    unit, corner = d.corner_integrals(), d.corner()
    plain = {
        d.DROP: 1 - sp.cos(d.ANGLE),
        d.ROOT: sp.cos(d.ANGLE),
        d.GAMMA: sp.sin(d.ANGLE),
        d.OFFSET: d.AMPLITUDE * sp.sin(d.ANGLE),
        d.RATE: sp.cos(d.ANGLE) / d.AMPLITUDE,
    }
    mean = 2 * (d.AMPLITUDE + corner.even.subs(plain)) / sp.pi
    _same("mean of a corner", mean, d.AMPLITUDE * unit.F0)
    _same("first harmonic of a corner", -corner.odd.subs(plain), unit.n_p)
    _same("no quadrature", unit.n_q, 0)
    # d = A sin(g): along it, by A at fixed d and by d at fixed A
    turns = ((corner.even_A, corner.even_d, even), (corner.odd_A, corner.odd_d, odd))
    for by_amplitude, by_offset, form in turns:
        fixed_angle = by_amplitude + by_offset * sp.sin(d.ANGLE)
        _same("at fixed angle", fixed_angle.subs(plain), form(d.ANGLE).diff(d.AMPLITUDE))
        moving = by_offset * d.AMPLITUDE * sp.cos(d.ANGLE)
        _same("at fixed amplitude", moving.subs(plain), form(d.ANGLE).diff(d.ANGLE))


def static_law(law: d.StaticLaw) -> None:
    """Integrate a law segment by segment, its breaks at B + A sin(g_i)."""
    angles = (G1, G2)[: len(law.breaks)]
    corners = _PAIR[: len(law.breaks)]
    direct = d.integrate(law.segments(angles))
    form = law.describing(corners)
    breaks = {t: d.BIAS + d.AMPLITUDE * sp.sin(g) for t, g in zip(law.breaks, angles, strict=True)}
    values = _corner_values(corners, angles)
    free = sp.solve([key - value for key, value in breaks.items()], list(_lengths(law)), dict=True)
    lengths = free[0] if free else {}
    for name in ("F0", "n_p", "n_q"):
        closed = getattr(form, name).subs(values).subs(lengths)
        _same(f"{name} of a static law", closed, getattr(direct, name).subs(lengths))


def _lengths(law: d.StaticLaw) -> list[sp.Symbol]:
    """Two symbols of a law that place its two breaks."""
    free = sorted(set().union(*(t.free_symbols for t in law.breaks)), key=str) if law.breaks else []
    return free[:2]


def _corner_values(
    corners: tuple[d.NamedCorner, ...], angles: tuple[sp.Expr, ...]
) -> dict[sp.Symbol, sp.Expr]:
    values: dict[sp.Symbol, sp.Expr] = {}
    for corner, angle in zip(corners, angles, strict=True):
        values[corner.symbol("even")] = even(angle)
        values[corner.symbol("odd")] = odd(angle)
    return values


def any_pieces() -> None:
    """Compare the summed form with a general law of three pieces."""
    slopes, (t1, t2, f1) = sp.symbols("s_1:4"), sp.symbols("t_1 t_2 f_1")
    f2 = f1 + (slopes[0] - slopes[1]) * t1
    offsets = (f1, f2, f2 + (slopes[1] - slopes[2]) * t2)
    form = d.StaticLaw(slopes, offsets, (t1, t2)).describing(_PAIR)
    changes = (slopes[1] - slopes[0], slopes[2] - slopes[1])
    sums = {
        d.CORNERS.symbol(part): sum(
            change * corner.symbol(part) for change, corner in zip(changes, _PAIR, strict=True)
        )
        for part in ("even", "odd")
    }
    line = {
        d.SLOPE: (slopes[0] + slopes[2]) / 2,
        d.INTERCEPT: (offsets[0] + offsets[2]) / 2,
        d.TURN: slopes[2] - slopes[0],
    }
    summed = d.piecewise()
    for name in ("F0", "n_p", "n_q"):
        closed = sp.sympify(getattr(summed, name)).subs(sums).subs(line)
        check_same(f"{name} of any pieces", closed, getattr(form, name))


def hysteresis_loop() -> None:
    """Integrate F = alpha - h round the loop, its memory sliding between g_1, g_2 and g_4, g_3.

    The corners give four relations between the angles and the lengths of the loop; two of them
    place top and bottom, and the two that are left are used on the difference.
    """
    angles = (G1, G2, G3, G4)
    direct = d.integrate(d.hysteresis_segments(angles))
    form = d.hysteresis()
    sums = {
        d.LOOP.symbol("even"): sum(
            sign * even(g) for sign, g in zip(d.CORNER_SIGNS, angles, strict=True)
        ),
        d.LOOP.symbol("odd"): sum(
            sign * odd(g) for sign, g in zip(d.CORNER_SIGNS, angles, strict=True)
        ),
    }
    sines = [sp.Symbol(f"s_{i}") for i in range(1, 5)]
    relations = [
        offset - d.AMPLITUDE * sine
        for offset, sine in zip(d.hysteresis_corners(), sines, strict=True)
    ]
    lengths = sp.solve(relations, [d.TOP, d.BOTTOM, d.DELTA_V, sines[3]], dict=True)[0]
    names = {sp.sin(g): sine for g, sine in zip(angles, sines, strict=True)}
    squares = {sp.cos(g) ** 2: 1 - sine**2 for g, sine in zip(angles, sines, strict=True)}
    for name in ("F0", "n_p", "n_q"):
        closed = getattr(form, name).subs(sums)
        difference = sp.expand(sp.expand_trig(sp.expand(closed - getattr(direct, name))))
        plain = sp.expand(difference.subs(squares).subs(names)).subs(lengths)
        check_same(f"{name} of the loop", plain, 0)


def _whole_loop() -> dict[str, sp.Expr]:
    """Describing function of the whole loop without bias: D = delta_v/2, delta = delta_h/2."""
    D, gap, A = sp.symbols("D delta A", positive=True)
    A = d.AMPLITUDE
    extremes = {d.TOP: gap, d.BOTTOM: -gap, d.DELTA_V: 2 * D, d.V_OFF: 0}
    offsets = [offset.subs(extremes) for offset in d.hysteresis_corners()]
    angles = [sp.asin(offset / A) for offset in offsets]
    sums = {
        d.LOOP.symbol("even"): sum(
            s * even(g) for s, g in zip(d.CORNER_SIGNS, angles, strict=True)
        ),
        d.LOOP.symbol("odd"): sum(s * odd(g) for s, g in zip(d.CORNER_SIGNS, angles, strict=True)),
    }
    form = d.hysteresis()
    parts = {name: getattr(form, name).subs(sums).subs(extremes) for name in ("F0", "n_p", "n_q")}
    return {**parts, "D": D, "delta": gap}


def published_hysteresis() -> None:
    """Compare the loop without bias with equations 3.40-3.42, and its limits."""
    whole = _whole_loop()
    D, gap, A = whole["D"], whole["delta"], d.AMPLITUDE
    n_p = (2 - saturated((D + gap) / A) + saturated((D - gap) / A)) / 2
    check_same("n_p of equation 3.40", whole["n_p"], n_p)
    check_same("n_q of equation 3.41", whole["n_q"], 4 * D * gap / (sp.pi * A**2))
    check_same("no mean", whole["F0"], 0)
    check_same("dissipation", sp.pi * A**2 * whole["n_q"], (2 * D) * (2 * gap))
    # no height: freeplay of gap 2 delta; no width: the line
    freeplay = d.FREEPLAY.describing(_PAIR).n_p
    angles = (-sp.asin(gap / A), sp.asin(gap / A))
    check_same("no height", whole["n_p"].subs(D, 0), freeplay.subs(_corner_values(_PAIR, angles)))
    check_same("no height", whole["n_q"].subs(D, 0), 0)
    check_same("no width", whole["n_p"].subs(gap, 0), 1)
    check_same("no width", whole["n_q"].subs(gap, 0), 0)
    far = [sp.limit(whole[name], A, sp.oo) for name in ("n_p", "n_q")]
    check_same("far away", far, [1, 0])


def jenkins_loop() -> None:
    """Let the memory reach no stop, top = -bottom = A - D: the elastic-perfectly-plastic loop."""
    whole = _whole_loop()
    D, gap, A = whole["D"], whole["delta"], d.AMPLITUDE
    inside = {gap: A - D}
    n_p = (1 + saturated((2 * D - A) / A)) / 2
    closed = sp.simplify(whole["n_p"].subs(inside) - n_p)
    check_same("n_p of the Jenkins loop", closed, 0)
    check_same("n_q", whole["n_q"].subs(inside), 4 * D * (A - D) / (sp.pi * A**2))
    at_onset = [sp.simplify(whole[name].subs(inside).subs(A, D)) for name in ("n_p", "n_q")]
    check_same("no sliding at A = D", at_onset, [1, 0])


def _same(name: str, shortcut: sp.Expr, long_way: sp.Expr) -> None:
    """Compare trigonometric expressions in the angles of the corners."""
    difference = sp.expand(sp.expand_trig(sp.expand(shortcut - long_way)))
    squares = {sp.cos(g) ** 2: 1 - sp.sin(g) ** 2 for g in (G1, G2, G3, G4, d.ANGLE)}
    check_same(name, sp.expand(difference.subs(squares)), 0)


PROOFS = (
    Proof(
        "corner",
        r"$X$ and $S$ of a corner, and their derivatives, are the integrals of "
        r"$\lvert\sin\theta - \sin g\rvert$.",
        corner_integrals,
    ),
    Proof(
        "bilinear spring",
        "The closed form is the integral of the bilinear law with preload.",
        partial(static_law, d.BILINEAR),
    ),
    Proof(
        "freeplay",
        "The closed form is the integral of the law with a gap.",
        partial(static_law, d.FREEPLAY),
    ),
    Proof(
        "linear spring",
        "The closed form is the integral of the line.",
        partial(static_law, d.LINEAR),
    ),
    Proof(
        "piecewise-linear spring",
        "The sum over corners is the general law of three pieces.",
        any_pieces,
    ),
    Proof(
        "hysteresis",
        r"The closed form is the integral of $F = \alpha - h$ round the loop, with bias.",
        hysteresis_loop,
    ),
    Proof(
        "equations 3.40-3.42",
        r"Without bias the loop has the published $n_p$ and $n_q$ and dissipates "
        r"$\pi n_q A^2 = \Delta V\,\Delta H$; $\Delta V \to 0$ is freeplay, "
        r"$\Delta H \to 0$ and $A \to \infty$ are linear.",
        published_hysteresis,
    ),
    Proof(
        "Jenkins loop",
        r"Short of the stops $n_q = 4 D (A - D)/(\pi A^2)$ and "
        r"$n_p = \frac12 [1 + f((2D - A)/A)]$; at $A = D$ the spring is linear.",
        jenkins_loop,
    ),
)
