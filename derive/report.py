"""The derivation as a readable report, Markdown with LaTeX in MyST syntax."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import sympy as sp

from derive import describing as d
from derive import houbolt as h
from derive import indicial as indicial_fits
from derive import switched as w
from derive import symbols as s
from derive.coalescence import coalescence
from derive.configuration import TYPICAL_SECTION
from derive.emit import environment
from derive.equations import SecondOrder, lagrange, second_order, structure
from derive.flap import C_HINGE, FLAP, OMEGA_BETA_BAR, SECTION_WITH_FLAP
from derive.modules import load_row
from derive.proofs.same import Proof
from derive.state_space import (
    characteristic_parts,
    deficiency,
    impedance,
    indicial,
    indicial_symbols,
)
from derive.thin_airfoil import generalised_forces, pairing

_NAMES = {
    s.SPEED: "U",
    s.OMEGA_BAR: r"\bar\omega",
    s.HEAVE_MASS: r"\tfrac{m_h}{m}",
    OMEGA_BETA_BAR: r"\bar\omega_\beta",
    s.P: r"\bar p",
    s.STIFFNESS: "N",
    s.INERTIA: r"I_\alpha",
    d.M0: "M_0",
    d.M_F: "M_f",
    d.ALPHA_F: r"\alpha_f",
    d.DELTA: r"\delta",
    d.DELTA_V: r"\Delta V",
    d.DELTA_H: r"\Delta H",
    d.V_OFF: r"V_\mathrm{off}",
    d.H_OFF: r"H_\mathrm{off}",
    d.GAP: r"\mathrm{gap}",
    d.CENTRE: r"\alpha_0",
    d.TOP: r"\hat h",
    d.BOTTOM: r"\check h",
    d.ANGLE: "g",
    d.GAMMA: r"\gamma",
    d.RATE: r"\dot r",
    d.BETA1: r"\beta_1",
    d.BETA3: r"\beta_3",
    h.STEP: r"\Delta\tau",
    h.LIFT_Q: r"g w_q",
    h.LIFT_V: r"g w_v",
    h.NEWEST: r"\kappa",
    sp.Symbol("squared"): "U^2",
}


def latex(expression: sp.Basic) -> str:
    """LaTeX with the symbols of the thesis; other words are set upright."""
    words = {
        symbol: rf"\mathrm{{{symbol}}}"
        for symbol in sp.sympify(expression).free_symbols
        if len(str(symbol)) > 1 and sp.latex(symbol) == str(symbol) and str(symbol).isalpha()
    }
    return str(sp.latex(expression, symbol_names={**words, **_NAMES}, mat_delim="["))


def report(
    equations: SecondOrder, quasi: SecondOrder, proofs: Mapping[str, tuple[Proof, ...]]
) -> str:
    """Text of ``docs/derivation.md``."""
    env = environment()
    env.filters["latex"] = latex
    sets = {"indicial_sets": indicial_fits.SETS}
    parts = (_section(equations), sets, _flap(), _quasi_steady(quasi), _describing(), _houbolt())
    context = {key: value for part in parts for key, value in part.items()}
    return env.get_template("derivation.md.j2").render(**context, proofs=proofs)


def _section(equations: SecondOrder) -> dict[str, Any]:
    shapes = tuple(coordinate.shape for coordinate in TYPICAL_SECTION.coordinates)
    motions = {
        coordinate.displacement: sp.Function(name, real=True)(s.TIME)
        for coordinate, name in zip(TYPICAL_SECTION.coordinates, ("h", "alpha"), strict=True)
    }
    a, b = indicial_symbols(2)
    parts = characteristic_parts(equations)
    names = {symbol: _entry(str(symbol)) for symbol, _ in parts.entries}
    rows = [load_row(equations, load) for load in TYPICAL_SECTION.loads]
    return {
        "energies": [
            (name, getattr(TYPICAL_SECTION, key).subs(motions))
            for name, key in (("T", "kinetic"), ("V", "potential"), ("R", "dissipation"))
        ],
        "dimensional": [row.subs(motions) for row in lagrange(TYPICAL_SECTION)],
        "groups": list(TYPICAL_SECTION.groups.items()),
        "structure": structure(TYPICAL_SECTION),
        "air": generalised_forces(shapes),
        "eq": equations,
        "loads": [
            {"load": load, "air": air, "wake": wake}
            for load, (air, wake) in zip(TYPICAL_SECTION.loads, rows, strict=True)
        ],
        "phi": indicial(s.TAU, a, b),
        "Phi": deficiency(s.P, a, b),
        "B": impedance(equations),
        "entries": [(names[symbol], value) for symbol, value in parts.entries],
        "P0": [coefficient.subs(names) for coefficient in parts.without_circulation],
        "P1": [coefficient.subs(names) for coefficient in parts.with_circulation],
    }


def _flap() -> dict[str, Any]:
    names = {sp.acos(C_HINGE): sp.Symbol("theta_h"), sp.sqrt(1 - C_HINGE**2): sp.Symbol("s_h")}
    step, ramp = FLAP.shape.slope(), FLAP.shape
    pairs = ((r"-T_5/2\pi", step, step), (r"-T_2/2\pi", step, ramp), (r"-T_3/2\pi", ramp, ramp))
    equations = second_order(SECTION_WITH_FLAP)
    columns = (
        ("M_s", equations.structural_mass),
        ("M_a", equations.apparent_mass[:, 2]),
        ("C_0", equations.C0),
        ("K_0", equations.K0[:, 2]),
        ("S", equations.S),
        ("g", equations.g),
        ("w_q", equations.w_q),
        ("w_v", equations.w_v),
    )
    return {
        "corner_pairings": [
            (name, sp.expand(pairing(*pair)).xreplace(names)) for name, *pair in pairs
        ],
        "flap_matrices": [
            (name if matrix.cols != 1 or name == "g" else rf"{name}\mathbf e_3", matrix)
            for name, matrix in ((name, matrix.xreplace(names)) for name, matrix in columns)
        ],
    }


def _entry(name: str) -> sp.Symbol:
    """Entry of a matrix as the report writes it: m_{11}, w_{v,2}."""
    letters, _, index = name.rpartition("_")
    head, _, tail = letters.partition("_")
    return sp.Symbol(f"{head}_{{{tail + ',' if tail else ''}{index}}}")


def _quasi_steady(quasi: SecondOrder) -> dict[str, Any]:
    forms = coalescence(quasi)
    return {
        "quasi": quasi,
        "quasi_B": impedance(quasi, sp.Integer(0)),
        "coalescence": forms,
        "discriminant": sum(
            coefficient * sp.Symbol("U") ** (-2 * power)
            for power, coefficient in enumerate(reversed(forms.discriminant))
        ),
    }


def _describing() -> dict[str, Any]:
    pair = (d.NamedCorner("lower"), d.NamedCorner("upper"))
    corner_names = {
        item.symbol(part): sp.Symbol(f"{letter}_{label}")
        for item, label in zip((*pair, d.CORNERS, d.LOOP), ("1", "2", "*", "*"), strict=True)
        for part, letter in (("even", "X"), ("odd", "S"))
    }

    def named(form: d.Harmonics) -> list[tuple[str, sp.Expr]]:
        values = (("F_0", form.F0), ("n_p", form.n_p), ("n_q", form.n_q))
        return [(name, sp.sympify(value).subs(corner_names)) for name, value in values]

    return {
        "unit": d.corner_integrals(),
        "corner": d.corner(),
        "springs": {
            "cubic": named(d.cubic()),
            "piecewise": named(d.piecewise()),
            "bilinear": named(d.BILINEAR.describing(pair)),
            "freeplay": named(d.FREEPLAY.describing(pair)),
            "hysteresis": named(d.hysteresis()),
        },
        "loop_offsets": d.hysteresis_corners(),
        **_switched(),
    }


def _switched() -> dict[str, Any]:
    letters = (("angle", "g"), ("gamma", "gamma"), ("root", "c"))
    names = {
        crossing.symbol(part): sp.Symbol(f"{letter}_{i}")
        for i, crossing in enumerate((w.UPPER, w.LOWER, w.TAKEN), start=1)
        for part, letter in letters
    }
    short = {w.MOMENT: "M", w.WIDTH: "w", w.FRICTION: "f", w.PER: "p"}
    names |= {symbol: sp.Symbol(letter) for symbol, letter in short.items()}
    laws = {
        "relay": w.form(w.relay_segments(), w.relay_gammas(), (d.BIAS, w.WIDTH)),
        "play": w.form(w.play_segments(), w.play_gammas(), (d.DELTA_V,)),
        "friction": w.form(w.friction_segments(), {}),
    }
    return {
        "highest": w.HIGHEST,
        "switched": {
            law: [
                (label, sp.sympify(form[name]).subs(names))
                for label, name in (("F_0", "F0"), ("n_p", "n_p"), ("n_q", "n_q"))
            ]
            for law, form in laws.items()
        },
    }


def _houbolt() -> dict[str, Any]:
    return {
        "velocity": _row(h.difference_weights(1)),
        "acceleration": _row(h.difference_weights(2)),
        "duhamel": _row(h.duhamel_weights()),
        "step": h.step_matrices(),
        "taylor": h.taylor_weights(),
    }


def _row(weights: list[sp.Expr]) -> sp.Matrix:
    """Weights as a row, oldest first."""
    return sp.Matrix([weights])
