"""The generated modules: which template takes which pieces of the derivation."""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace

import sympy as sp

from derive import houbolt
from derive import symbols as s
from derive.coalescence import coalescence
from derive.configuration import Configuration
from derive.emit import render
from derive.equations import SecondOrder
from derive.printer import source
from derive.state_space import characteristic_parts, mass_inverse


def _inverse(equations: SecondOrder) -> SimpleNamespace:
    n = equations.n
    named = sp.Matrix(n, n, lambda i, j: sp.Symbol(f"m_{i + 1}{j + 1}"))
    determinant, adjugate = mass_inverse(named)
    entries = [(named[i, j], equations.M[i, j]) for i in range(n) for j in range(n)]
    symbol = sp.Symbol("determinant")
    return SimpleNamespace(
        entries=entries, determinant=[(symbol, determinant)], matrix=adjugate / symbol
    )


def _coefficient_row(equations: SecondOrder, row: int, factor: sp.Expr) -> sp.Matrix:
    """Laplace-domain aerodynamic force of one equation, over q, times ``factor``."""
    phi = sp.Symbol("phi")
    apparent = equations.apparent_mass * s.P**2 + equations.C0 * s.P + equations.K0
    full = apparent + phi * equations.g * (equations.w_q + s.P * equations.w_v)
    return (full[row, :] * factor).applyfunc(lambda entry: sp.collect(sp.expand(entry), phi))


def _common(configuration: Configuration, equations: SecondOrder) -> Mapping[str, object]:
    names = [coordinate.name for coordinate in configuration.coordinates]
    nonlinear = configuration.nonlinear
    spring = sp.zeros(equations.n, equations.n)
    spring[:, nonlinear] = equations.e
    return {
        "name": configuration.name,
        "q": names,
        "quoted": [f'"{name}"' for name in names],
        "rows": [coordinate.equation for coordinate in configuration.coordinates],
        "n": equations.n,
        "nonlinear": nonlinear,
        "names": [str(parameter) for parameter in configuration.parameters],
        "eq": equations,
        "inverse": _inverse(equations),
        "spring": spring,
        "poly": characteristic_parts(equations, nonlinear),
    }


def section_module(configuration: Configuration, equations: SecondOrder) -> str:
    """Source of ``generated/section.py``."""
    return render(
        "section.py.j2",
        **_common(configuration, equations),
        lift=_coefficient_row(equations, 0, sp.pi * s.MU),
        moment=_coefficient_row(equations, 1, -sp.pi * s.MU * s.R_ALPHA**2 / 2),
    )


def quasi_steady_module(configuration: Configuration, equations: SecondOrder) -> str:
    """Source of ``generated/quasi_steady.py``; ``equations`` are the quasi-steady ones."""
    return render(
        "quasi_steady.py.j2",
        **_common(configuration, equations),
        coalescence=coalescence(equations, configuration.nonlinear),
    )


def houbolt_module() -> str:
    """Source of ``generated/houbolt.py``."""
    step = houbolt.step_matrices()
    total = {houbolt.NEWEST: sp.Symbol("total")}
    terms = houbolt.taylor_weights()
    return render(
        "houbolt.py.j2",
        velocity=[source(weight) for weight in houbolt.difference_weights(1)],
        acceleration=[source(weight) for weight in houbolt.difference_weights(2)],
        duhamel=[source(weight) for weight in houbolt.duhamel_weights()],
        new=[(sp.Symbol("new"), step.new.subs(total))],
        old=[
            (sp.Symbol(f"old[{k}]"), factor.subs(total)) for k, factor in enumerate(step.old)
        ],
        series=["np.ones(3)", *(source(weight) for weight in terms[1:])],
    )
