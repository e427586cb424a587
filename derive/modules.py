"""The generated modules: which template takes which pieces of the derivation."""

from __future__ import annotations

from types import SimpleNamespace

import sympy as sp

from derive import houbolt, indicial
from derive import symbols as s
from derive.coalescence import coalescence
from derive.configuration import Configuration, Load
from derive.emit import WIDTH, assignments, render
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


def load_row(equations: SecondOrder, load: Load) -> tuple[sp.Matrix, sp.Matrix]:
    """Coefficient over q in the Laplace domain, without and with Phi (equations 3.21-3.22)."""
    air = equations.apparent_mass * s.P**2 + equations.C0 * s.P + equations.K0
    wake = equations.g * (equations.w_q + s.P * equations.w_v)

    def entry(value: sp.Expr) -> sp.Expr:
        if value == 0:
            return value
        return sp.pi * sp.horner(sp.expand(value * load.factor / sp.pi), s.P)

    return air[load.row, :].applyfunc(entry), wake[load.row, :].applyfunc(entry)


def _arguments(configuration: Configuration, *matrices: sp.Matrix) -> list[str]:
    """Parameters that some matrices depend on, in the order of the configuration."""
    free = set().union(*(matrix.free_symbols for matrix in matrices))
    return [str(parameter) for parameter in configuration.parameters if parameter in free]


def _abbreviated(configuration: Configuration, equations: SecondOrder) -> SecondOrder:
    """The same equations with a name for what recurs."""
    names = {value: symbol for symbol, value in configuration.abbreviations.items()}
    return SecondOrder(**{key: matrix.xreplace(names) for key, matrix in vars(equations).items()})


def _common(configuration: Configuration, equations: SecondOrder) -> dict[str, object]:
    equations = _abbreviated(configuration, equations)

    def abbreviated(*matrices: sp.Matrix) -> str:
        """Lines that say what the abbreviations in some matrices stand for."""
        free = set().union(*(matrix.free_symbols for matrix in matrices))
        items = configuration.abbreviations.items()
        used = [(symbol, value) for symbol, value in items if symbol in free]
        return f"    # intermediate terms\n{assignments(used)}\n\n" if used else ""

    names = [coordinate.name for coordinate in configuration.coordinates]
    nonlinear = configuration.nonlinear
    return {
        "name": configuration.name,
        "q": names,
        "quoted": [f'"{name}"' for name in names],
        "rows": [coordinate.equation for coordinate in configuration.coordinates],
        "n": equations.n,
        "nonlinear": nonlinear,
        "names": [str(parameter) for parameter in configuration.parameters],
        "parameter_docs": {str(key): text for key, text in configuration.parameters.items()},
        "defaults": {
            "springs": "NONLINEAR",
            **{str(key): str(value) for key, value in configuration.defaults.items()},
        },
        "abbreviated": abbreviated,
        "eq": equations,
        "inverse": _inverse(equations),
        "poly": characteristic_parts(equations, nonlinear),
    }


def section_module(
    configuration: Configuration, equations: SecondOrder, laplace: bool = True
) -> str:
    """Source of ``generated/section.py`` or ``generated/flap.py``.

    ``laplace`` adds the impedance and the characteristic polynomial.
    """

    def arguments(*matrices: sp.Matrix) -> list[str]:
        return _arguments(configuration, *matrices)

    return render(
        "section.py.j2",
        **_common(configuration, equations),
        laplace=laplace,
        air_stiffness=any(entry != 0 for entry in equations.K0),
        args=SimpleNamespace(
            structural_mass=arguments(equations.structural_mass),
            apparent_mass=arguments(equations.apparent_mass),
            mass=arguments(equations.M),
            springs=arguments(equations.S),
            air_stiffness=arguments(equations.K0),
            circulatory=arguments(equations.g, equations.w_q, equations.w_v),
        ),
    )


def loads_module(configuration: Configuration, equations: SecondOrder) -> str:
    """Source of ``generated/loads.py``."""
    loads = []
    for load in configuration.loads:
        air, wake = load_row(equations, load)
        names = ["p", *_arguments(configuration, air, wake), "a", "b"]
        loads.append({**vars(load), "air": air, "wake": wake, "args": names})
    taken = {name for load in loads for name in load["args"]}
    context = _common(configuration, equations)
    docs = {str(key): text for key, text in configuration.parameters.items() if str(key) in taken}
    return render("loads.py.j2", **{**context, "parameter_docs": docs}, loads=loads)


def quasi_steady_module(
    configuration: Configuration, equations: SecondOrder, laplace: bool = True
) -> str:
    """Source of ``generated/quasi_steady.py`` or ``generated/flap_quasi_steady.py``.

    ``equations`` are the quasi-steady ones. ``laplace`` adds the impedance, its polynomial and the
    closed form of the flutter speed.
    """

    def arguments(*matrices: sp.Matrix) -> list[str]:
        return _arguments(configuration, *matrices)

    return render(
        "quasi_steady.py.j2",
        **_common(configuration, equations),
        laplace=laplace,
        coalescence=coalescence(equations, configuration.nonlinear) if laplace else None,
        args=SimpleNamespace(
            mass=arguments(equations.M),
            damping=arguments(equations.C1),
            air=arguments(equations.K0),
            springs=arguments(equations.S),
        ),
    )


def indicial_module() -> str:
    """Source of ``generated/indicial.py``."""

    def numbers(values: tuple[str, ...]) -> str:
        """A tuple in a tuple, laid out as ruff lays it out."""
        line = f"        ({', '.join(values)}),"
        if len(line) <= WIDTH:
            return line
        return "\n".join(
            ["        (", *(f"            {value}," for value in values), "        ),"]
        )

    return render("indicial.py.j2", sets=indicial.SETS, numbers=numbers)


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
        old=[(sp.Symbol(f"old[{k}]"), factor.subs(total)) for k, factor in enumerate(step.old)],
        series=["np.ones(3)", *(source(weight) for weight in terms[1:])],
    )
