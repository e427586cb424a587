"""Source of ``generated/describing.py``."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace

import sympy as sp

from derive import describing as d
from derive.emit import call, render
from derive.printer import source

_FIELDS = ("F0", "n_p", "n_q", "dF0_dA", "dF0_dB", "dn_p_dA", "dn_p_dB", "dn_q_dA", "dn_q_dB")
_PAIR = (d.NamedCorner("lower"), d.NamedCorner("upper"))


def emitted_form(harmonics: d.Harmonics, derivatives: dict[str, sp.Expr]) -> SimpleNamespace:
    """Assignments of what is not a number, and the nine results in their order."""
    results = {"F0": harmonics.F0, "n_p": harmonics.n_p, "n_q": harmonics.n_q, **derivatives}
    results = {name: sp.factor_terms(value) for name, value in results.items()}
    named = [(sp.Symbol(name), value) for name, value in results.items() if not value.is_Number]
    return SimpleNamespace(
        values=[pair for pair in named if not str(pair[0]).startswith("d")],
        derivatives=[pair for pair in named if str(pair[0]).startswith("d")],
        results=[source(results[name]) if results[name].is_Number else name for name in _FIELDS],
    )


def _static(law: d.StaticLaw) -> SimpleNamespace:
    """Form of a law with two opposite corners, in their difference and the slope lost between."""
    corners = _PAIR[: len(law.breaks)]
    form = law.describing(corners)
    results = {"F0": form.F0, "n_p": form.n_p, "n_q": form.n_q, **d.derivatives(form, corners)}
    loss = sp.Symbol("loss", real=True)
    lower, upper = _PAIR
    difference = {
        upper.symbol(part): lower.symbol(part) + d.NamedCorner("pair").symbol(part)
        for part in ("even", "even_A", "even_B", "odd", "odd_A", "odd_B")
    }

    def emitted(value: sp.Expr) -> sp.Expr:
        plain = sp.expand(value.subs(d.M_F, 1 - loss).subs(difference))
        return sp.collect(plain, loss, sp.factor_terms)

    results = {name: emitted(value) for name, value in results.items()}
    return emitted_form(d.Harmonics(*(results.pop(name) for name in ("F0", "n_p", "n_q"))), results)


def _static_corners(law: d.StaticLaw) -> list[tuple[sp.Expr, sp.Expr, sp.Expr]]:
    return [(t - d.BIAS, sp.Integer(0), sp.Integer(-1)) for t in law.breaks]


def _hysteresis() -> SimpleNamespace:
    """Quadrature gain by height and travel over the amplitude, which do not overflow."""
    form = d.hysteresis()
    height, travel, per = sp.symbols("height travel per", real=True)
    sizes = {d.DELTA_V: height * d.AMPLITUDE, d.TOP: d.BOTTOM + travel * d.AMPLITUDE}

    def by_size(value: sp.Expr) -> sp.Expr:
        return sp.expand(sp.simplify(value.subs(sizes)).subs(d.AMPLITUDE, 1 / per))

    derivatives = d.derivatives(form, (d.LOOP,), (d.TOP, d.BOTTOM))
    for name in ("dn_q_dA", "dn_q_dB"):
        derivatives[name] = by_size(derivatives[name])
    return emitted_form(d.Harmonics(form.F0, form.n_p, by_size(form.n_q)), derivatives)


def _hysteresis_corners() -> list[tuple[sp.Expr, sp.Expr, sp.Expr]]:
    def rate(offset: sp.Expr, suffix: str) -> sp.Expr:
        moving = (d.TOP, d.BOTTOM)
        return sum(offset.diff(symbol) * sp.Symbol(f"{symbol}_{suffix}") for symbol in moving)

    return [(offset, rate(offset, "A"), rate(offset, "B")) for offset in d.hysteresis_corners()]


def _corner_call(
    target: str, weights: str, items: Sequence[tuple[sp.Expr, sp.Expr, sp.Expr]]
) -> str:
    """Lines that stack the offsets of some corners, and their derivatives, and sum them."""
    columns = list(zip(*items, strict=True))
    names = ["d"] if all(by == 0 for by in columns[1]) else ["d", "d_A", "d_B"]
    stacks = zip(names, columns, strict=False)
    lines = [call(name, "np.stack", [source(value) for value in column]) for name, column in stacks]
    arguments = ", ".join(["A", "d", weights, *names[1:]])
    return "\n".join([*lines, f"    {target} = _corners({arguments})"])


def _weights(signs: tuple[int, ...]) -> str:
    return f"np.array([{', '.join(f'{float(sign)}' for sign in signs)}])"


def describing_module() -> str:
    """Source of ``generated/describing.py``."""
    corner = d.corner()

    def pairs(names: tuple[str, ...]) -> list[tuple[sp.Symbol, sp.Expr]]:
        return [(sp.Symbol(name), getattr(corner, name)) for name in names]

    partial = ("even_A", "even_d", "odd_A", "odd_d")
    piecewise, cubic = d.piecewise(), d.cubic()
    return render(
        "describing.py.j2",
        corners=_corner_call,
        pair_signs=_weights((-1, 1)),
        loop_signs=_weights(d.CORNER_SIGNS),
        corner=SimpleNamespace(values=pairs(("even", "odd")), derivatives=pairs(partial)),
        linear=_static(d.LINEAR),
        cubic=emitted_form(cubic, d.derivatives(cubic, ())),
        piecewise=emitted_form(piecewise, d.derivatives(piecewise, (d.CORNERS,))),
        bilinear=_static(d.BILINEAR),
        bilinear_corners=_static_corners(d.BILINEAR),
        freeplay=_static(d.FREEPLAY),
        freeplay_corners=_static_corners(d.FREEPLAY),
        hysteresis=_hysteresis(),
        hysteresis_corners=_hysteresis_corners(),
    )
