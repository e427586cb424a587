"""Proofs about polynomials and the laws that jump or follow."""

from __future__ import annotations

import sympy as sp

from derive import describing as d
from derive import switched as w
from derive.proofs.same import Proof, check_same
from derive.proofs.springs import saturated

_DEGREE = 7
Law = tuple[list[d.Segment], dict[w.Crossing, sp.Expr], tuple[sp.Symbol, ...]]


def expansion() -> None:
    """Integrate a polynomial of symbolic coefficients directly; the cubic is one of them."""
    beta = list(sp.symbols(f"beta_1:{_DEGREE + 1}"))
    alpha = d.BIAS + d.AMPLITUDE * sp.sin(d.THETA)
    law = sum((b * alpha**i for i, b in enumerate(beta, start=1)), sp.Integer(0))
    direct = d.integrate([(law, sp.Integer(0), 2 * sp.pi)])
    form = w.polynomial(beta)
    for name in ("F0", "n_p", "n_q"):
        check_same(f"{name} of a polynomial", getattr(form, name), getattr(direct, name))
    cubic, cut = d.cubic(), w.polynomial([d.BETA1, sp.Integer(0), d.BETA3])
    check_same("cubic", [cut.F0, cut.n_p], [cubic.F0, cubic.n_p])
    binomial = [sp.binomial(j, j // 2) / 2**j if j % 2 == 0 else 0 for j in range(w.HIGHEST + 2)]
    check_same("means", w.power_means(w.HIGHEST + 1), binomial)


def _plain(value: sp.Expr, angles: dict[w.Crossing, sp.Expr]) -> sp.Expr:
    """An emitted form with its angles written out."""
    parts = {}
    for crossing, gamma in angles.items():
        parts[crossing.symbol("angle")] = sp.asin(gamma)
        parts[crossing.symbol("gamma")] = gamma
        parts[crossing.symbol("root")] = sp.sqrt(1 - gamma**2)
        parts[crossing.symbol("steep")] = 1 / sp.sqrt(1 - gamma**2)
    return sp.sympify(value).subs(parts).subs(w.PER, 1 / d.AMPLITUDE)


def derivatives() -> None:
    """Differentiate each closed form as it stands, its angles written out."""
    laws: tuple[Law, ...] = (
        (w.relay_segments(), w.relay_gammas(), (d.BIAS, w.WIDTH)),
        (w.play_segments(), w.play_gammas(), (d.DELTA_V,)),
        (w.friction_segments(), {}, ()),
    )
    for segments, gammas, lengths in laws:
        form = w.form(segments, gammas, lengths)
        for name in ("F0", "n_p", "n_q"):
            value = _plain(form[name], gammas)
            for suffix, variable in (("A", d.AMPLITUDE), ("B", d.BIAS)):
                claimed = _plain(form[f"d{name}_d{suffix}"], gammas)
                rest = sp.simplify(value.diff(variable) - claimed)
                check_same(f"d{name}/d{suffix}", rest, 0)


def limits_and_losses() -> None:
    """Known values: the ideal relay, friction, play as a loop without stops; areas of loops."""
    A = d.AMPLITUDE
    relay = {name: _plain(value, w.relay_gammas()) for name, value in _relay().items()}
    ideal = {d.BIAS: 0, w.WIDTH: 0}
    check_same("ideal relay", relay["n_p"].subs(ideal), 4 * w.MOMENT / (sp.pi * A))
    check_same("no mean", relay["F0"].subs(d.BIAS, 0), 0)
    area = sp.pi * A**2 * relay["n_q"]
    check_same("a relay gives the area of its loop", area, -2 * w.MOMENT * w.WIDTH)
    friction = w.form(w.friction_segments(), {})["n_q"].subs(w.PER, 1 / A)
    check_same("friction takes 4 F A a cycle", sp.pi * A**2 * friction, 4 * w.FRICTION * A)
    slack = d.DELTA_V / 2
    play = w.form(w.play_segments(), w.play_gammas(), (d.DELTA_V,))
    n_p, n_q = (_plain(play[name], w.play_gammas()) for name in ("n_p", "n_q"))
    jenkins = (1 + saturated((2 * slack - A) / A)) / 2  # of the loop that never meets a stop
    check_same("in phase, what Jenkins' loop leaves", sp.simplify(n_p - (1 - jenkins)), 0)
    loss = 4 * slack * (A - slack) / (sp.pi * A**2)
    check_same("in quadrature, its opposite", sp.simplify(n_q + loss), 0)


def _relay() -> dict[str, sp.Expr]:
    return w.form(w.relay_segments(), w.relay_gammas(), (d.BIAS, w.WIDTH))


PROOFS = (
    Proof(
        "polynomial",
        "The expansion about the bias is the integral of the law, term by term; the cubic is one.",
        expansion,
    ),
    Proof(
        "derivatives of laws that jump",
        "Those of a relay, of play and of friction are what differentiation gives.",
        derivatives,
    ),
    Proof(
        "relay, play, friction",
        r"The ideal relay has $n_p = 4M/(\pi A)$, friction $n_q = 4F/(\pi A)$, and the areas "
        r"$\pi n_q A^2$ are those of the loops; play is $\alpha$ less a loop without stops.",
        limits_and_losses,
    ),
)
