"""Proofs about the emitted source itself: it is run, and its numbers compared with the symbols."""

from __future__ import annotations

import math
from itertools import combinations
from types import ModuleType
from typing import Any

import sympy as sp

from derive import describing as d
from derive import houbolt as h
from derive import switched as w
from derive import symbols as s
from derive.configuration import Configuration
from derive.equations import SecondOrder
from derive.modules import load_row
from derive.proofs.same import check_numbers
from derive.state_space import (
    FirstOrder,
    deficiency,
    first_order,
    impedance,
    indicial,
    indicial_symbols,
)

_RATES = (
    [sp.Rational(1, 6), sp.Rational(2, 9), sp.Rational(1, 11)],
    [sp.Rational(1, 19), sp.Rational(3, 7), sp.Rational(5, 3)],
)


def load(name: str, source: str) -> Any:
    """Run the source of a module."""
    module = ModuleType(name)
    exec(compile(source, name, "exec"), module.__dict__)
    return module


def sample(configuration: Configuration) -> dict[sp.Symbol, sp.Expr]:
    """A value for every parameter: rational, so that the symbolic side is exact."""
    given = {s.MU: 23, s.R_ALPHA: sp.Rational(7, 11)}
    return {
        symbol: sp.sympify(given.get(symbol, sp.Rational(2 * i + 1, 37)))
        for i, symbol in enumerate(configuration.parameters)
    }


def check_section(source: str, configuration: Configuration, equations: SecondOrder) -> None:
    """State matrices, polynomial and impedance of a section with three lag terms."""
    module = load("section", source)
    values = sample(configuration)
    names = {str(symbol): float(value) for symbol, value in values.items()}
    a, b = indicial_symbols(3)
    lags = dict(zip([*a, *b], [*_RATES[0], *_RATES[1]], strict=True))
    speed, stiffness = sp.Rational(17, 5), sp.Rational(3, 4) + sp.I / 5
    at = {**lags, s.SPEED: speed, s.STIFFNESS: stiffness}
    known = _evaluated(equations, values)
    rates = {"a": [float(x) for x in _RATES[0]], "b": [float(x) for x in _RATES[1]]}

    for free in _choices(configuration):
        state = first_order(known, a, b, free=free)
        terms = module.state_terms(**names, **rates, springs=free)
        _check_state(terms, state, speed, at)

    phi = deficiency(s.P, a, b)
    if not hasattr(module, "impedance"):
        return
    B = impedance(known, phi, nonlinear=configuration.nonlinear).subs(at)
    motion = {"speed": float(speed), "stiffness": complex(stiffness)}
    p = sp.Rational(1, 9) + sp.I / 3
    numbers = module.impedance(**names, **rates, **motion, p=complex(p))
    check_numbers("B", numbers.tolist(), B.subs(s.P, p).evalf())
    polynomial = module.characteristic_coefficients(**names, **rates, **motion)
    # as many points as coefficients: the polynomial is the same one
    circle = [
        sp.exp(2 * sp.pi * sp.I * k / polynomial.size).evalf() for k in range(polynomial.size)
    ]
    exact = [_determinant(B.subs(s.P, z)) * sp.prod([z + r for r in _RATES[1]]) for z in circle]
    numbers = [module.np.polyval(polynomial, complex(z)) for z in circle]
    check_numbers("det B", numbers, exact)


def _choices(configuration: Configuration) -> list[tuple[int, ...]]:
    """Every choice of springs that stand outside of A, and one out of order."""
    numbers = range(len(configuration.coordinates))
    return [*(free for m in range(len(numbers) + 1) for free in combinations(numbers, m)), (1, 0)]


def _check_state(terms: Any, state: FirstOrder, speed: sp.Expr, at: Any) -> None:
    """State matrices at one speed, put together from the emitted ones."""
    A0, A1, A2, B2, C = terms
    U = float(speed)
    check_numbers("A", (A0 + A1 / U + A2 / U**2).tolist(), state.A.subs(at).evalf())
    check_numbers("B", (B2 / U**2).tolist(), state.B.subs(at).evalf())
    check_numbers("C", C.tolist(), state.C)


def check_loads(source: str, configuration: Configuration, equations: SecondOrder) -> None:
    """Aerodynamic coefficients and the indicial function with three terms."""
    module = load("loads", source)
    values = sample(configuration)
    names = {str(symbol): float(value) for symbol, value in values.items()}
    a, b = indicial_symbols(3)
    lags = dict(zip([*a, *b], [*_RATES[0], *_RATES[1]], strict=True))
    rates = {"a": [float(x) for x in _RATES[0]], "b": [float(x) for x in _RATES[1]]}
    p = sp.Rational(1, 9) + sp.I / 3
    phi = deficiency(s.P, a, b)
    check_numbers("Phi", module.lift_deficiency(complex(p), **rates), phi.subs({**lags, s.P: p}))
    exact = (phi / s.P).subs({**lags, s.P: p})
    check_numbers("L{phi}", module.wagner_laplace(complex(p), **rates), exact.evalf())
    exact = indicial(s.TAU, a, b).subs({**lags, s.TAU: 2})
    check_numbers("phi", module.wagner(2.0, **rates), exact.evalf())
    for item in configuration.loads:
        air, wake = load_row(equations, item)
        row = (air + phi * wake).subs({**lags, **values, s.P: p}).evalf()
        code = getattr(module, item.name).__code__
        taken = {key: names[key] for key in code.co_varnames[: code.co_argcount] if key in names}
        numbers = getattr(module, item.name)(complex(p), **taken, **rates)
        check_numbers(item.name, numbers.tolist(), list(row))


def _evaluated(equations: SecondOrder, values: dict[sp.Symbol, sp.Expr]) -> SecondOrder:
    """The same equations with numbers of thirty digits for the parameters."""
    matrices = {name: matrix.subs(values).evalf(30) for name, matrix in vars(equations).items()}
    return SecondOrder(**matrices)


def _determinant(matrix: sp.Matrix) -> sp.Expr:
    return matrix.evalf(30).det(method="berkowitz").evalf()


def check_quasi_steady(source: str, configuration: Configuration, equations: SecondOrder) -> None:
    """State matrices and polynomial without lag terms."""
    module = load("quasi_steady", source)
    values = sample(configuration)
    names = {str(symbol): float(value) for symbol, value in values.items()}
    at = {**values, s.SPEED: sp.Rational(17, 5), s.STIFFNESS: sp.Rational(3, 4)}
    known = _evaluated(equations, values)
    for free in _choices(configuration):
        state = first_order(known, [], [], free=free)
        _check_state(module.state_terms(**names, springs=free), state, at[s.SPEED], at)
    if not hasattr(module, "impedance"):
        return
    exact = sp.Poly(impedance(equations, sp.Integer(0)).subs(at).det(), s.P).all_coeffs()
    numbers = module.characteristic_coefficients(**names, speed=3.4, stiffness=0.75)
    check_numbers("det B", numbers.tolist(), exact)


def check_describing(source: str) -> None:
    """The bilinear law and the whole hysteresis loop, with bias, against their own integrals."""
    module = load("describing", source)
    amplitude, bias, m0, m_f, alpha_f, delta = 1.3, 0.21, 0.4, 0.35, -0.17, 0.6
    angles = [math.asin((t - bias) / amplitude) for t in (alpha_f, alpha_f + delta)]
    law = {d.M0: m0, d.M_F: m_f, d.ALPHA_F: alpha_f, d.DELTA: delta}
    motion = {d.AMPLITUDE: amplitude, d.BIAS: bias}
    g = sp.symbols("g_1:5")
    direct = d.integrate(d.BILINEAR.segments(g[:2]))
    at = {**law, **motion, **dict(zip(g, angles, strict=False))}
    exact = [value.subs(at) for value in (direct.F0, direct.n_p, direct.n_q)]
    check_numbers("bilinear", module.bilinear(amplitude, bias, m0, m_f, alpha_f, delta)[:3], exact)

    delta_v, delta_h, v_off, h_off = 0.5, 0.7, 0.15, -0.08
    loop = {d.DELTA_V: delta_v, d.V_OFF: v_off}
    middle = h_off - (bias - v_off)
    loop.update({d.TOP: middle + delta_h / 2, d.BOTTOM: middle - delta_h / 2})
    offsets = [offset.subs(loop) for offset in d.hysteresis_corners()]
    angles = [math.asin(offset / amplitude) for offset in offsets]
    direct = d.integrate(d.hysteresis_segments(g))
    at = {**loop, **motion, **dict(zip(g, angles, strict=True))}
    exact = [value.subs(at) for value in (direct.F0, direct.n_p, direct.n_q)]
    numbers = module.hysteresis(amplitude, bias, delta_v, delta_h, v_off, h_off)[:3]
    check_numbers("hysteresis", numbers, exact)


def check_switched(source: str) -> None:
    """Relay, play and friction with bias, and a polynomial, against their own integrals."""
    module = load("switched", source)
    amplitude, bias, moment, width, delta_v = 1.3, 0.21, 0.7, 0.4, 0.9
    at = {d.AMPLITUDE: amplitude, d.BIAS: bias}
    law = {w.MOMENT: moment, w.WIDTH: width, d.DELTA_V: delta_v, w.FRICTION: 0.3, d.BETA1: 0.8}
    laws = {
        "relay": (w.relay_segments(), w.relay_gammas(), (moment, width)),
        "play": (w.play_segments(), w.play_gammas(), (delta_v,)),
        "friction": (w.friction_segments(), {}, (0.3, 0.8)),
    }
    for name, (segments, gammas, arguments) in laws.items():
        direct = d.integrate(segments)
        angles = {item.angle: math.asin(g.subs(law).subs(at)) for item, g in gammas.items()}
        values = (direct.F0, direct.n_p, direct.n_q)
        exact = [sp.sympify(value).subs({**law, **at, **angles}) for value in values]
        numbers = getattr(module, name)(amplitude, bias, *arguments)[:3]
        check_numbers(name, numbers, exact)
    beta = [0.9, -0.3, 0.7, 0.2]
    form = w.polynomial([sp.Float(b) for b in beta])
    exact = [value.subs(at) for value in (form.F0, form.n_p, form.n_q)]
    check_numbers("polynomial", module.polynomial(amplitude, bias, beta)[:3], exact)


def check_houbolt(source: str) -> None:
    """Weights and step matrices for one coordinate."""
    module = load("houbolt", source)
    check_numbers("velocity", module.VELOCITY.tolist(), h.difference_weights(1))
    check_numbers("acceleration", module.ACCELERATION.tolist(), h.difference_weights(2))
    check_numbers("Duhamel", module.DUHAMEL.tolist(), h.duhamel_weights())
    np = module.np
    M, C, K, g, w_q, w_v, dt = 1.1, 0.3, 0.7, 0.2, 1.0, 0.9, 0.15
    square = [np.array([[value]]) for value in (M, C, K)]
    vectors = [np.array([value]) for value in (g, w_q, w_v)]
    step = module.step_matrices(*square, *vectors, [0.2, 0.3], [0.05, 0.4], dt)
    symbols = (h.MASS, h.DAMPING, h.STIFFNESS, h.LIFT_Q, h.LIFT_V, h.STEP, h.NEWEST)
    numbers = (M, C, K, g * w_q, g * w_v, dt, 0.5 * 9 * dt / 24)
    at = dict(zip(symbols, numbers, strict=True))
    matrices = h.step_matrices()
    exact = [factor.subs(at) for factor in (matrices.new, *matrices.old)]
    check_numbers("step", [float(step.new[0, 0]), *step.old[:, 0, 0].tolist()], exact)
