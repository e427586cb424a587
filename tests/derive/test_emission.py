"""The printer and the layout of generated code."""

from __future__ import annotations

import jinja2
import numpy as np
import pytest
import sympy as sp

from derive.emit import WIDTH, assignment, call, inputs, invoke, items, render, signature
from derive.printer import source

x, y, z = sp.symbols("x y z", positive=True)
AT = {"x": 1.3, "y": 0.7, "z": 0.45}


@pytest.mark.parametrize(
    "expression",
    [
        x / (y * z),
        -(x**2) * (y + 1) / 3,
        (x + y) ** 2,
        sp.sqrt(x) / 2,
        1 / sp.sqrt(1 + x),
        x**-2,
        -(x + y),
        2 * (x - y) * (z - 1),
        sp.asin(z) * 2 / sp.pi,
        sp.acos(z) + sp.sin(x) * sp.cos(y) * sp.exp(-z),
        -x - y,
        sp.Rational(2, 3) * x,
        x ** sp.Rational(3, 2),
        -sp.Rational(1, 3),
        sp.Rational(1, 8),
        x - (y - z),
        x * (y / z),
        x / (y / z + 1),
        abs(x - 2),
        -1 / (x + 1),
        (-x) ** 3,
        1 / (3 * x) + x**2 / 3,
        -x * y**2 / (z * (x - y)),
        (x * y) ** -1 * (z - x) ** -2,
    ],
    ids=str,
)
def test_printed_code_has_the_value_of_the_expression(expression: sp.Expr) -> None:
    value = eval(source(expression), {"np": np}, dict(AT))
    exact = float(expression.subs({sp.Symbol(k, positive=True): v for k, v in AT.items()}))
    assert value == pytest.approx(exact, rel=1e-15)


def test_printing_keeps_exact_decimals() -> None:
    assert source(x / 8) == "0.125 * x"
    assert source(x / 3) == "x / 3.0"
    assert source(2 * x / 3) == "2.0 * x / 3.0"
    assert source(-(x**2)) == "-(x**2)"
    assert source((x + 1) ** 2) == "(x + 1.0) ** 2"


def test_unknown_function_is_an_error() -> None:
    with pytest.raises(KeyError):
        source(sp.gamma(x))


def test_long_sums_are_broken_or_named() -> None:
    terms = sp.symbols("first_long_name second_long_name third_long_name fourth_long_name")
    total = sum(term * other for term in terms for other in terms)
    text = assignment("total", total)
    assert max(map(len, text.splitlines())) <= WIDTH
    assert text.startswith("    total = (\n        ")
    deep = x * (total + 1) / (y + z * (total + 2))
    lines = assignment("deep[0, 1]", deep)
    assert max(map(len, lines.splitlines())) <= WIDTH
    names = {str(t): 0.1 * i + 0.3 for i, t in enumerate(terms)} | AT
    scope = {"np": np, "deep": np.zeros((1, 2)), **names}
    exec("\n".join(line[4:] for line in lines.splitlines()), scope)
    symbols = {sp.Symbol(k): v for k, v in names.items()} | {x: 1.3, y: 0.7, z: 0.45}
    assert scope["deep"][0, 1] == pytest.approx(float(deep.subs(symbols)), rel=1e-14)


def test_what_cannot_be_laid_out_is_an_error() -> None:
    name = sp.Symbol("a" * 200)
    with pytest.raises(ValueError, match="cannot be laid out"):
        assignment("x", name)
    with pytest.raises(ValueError, match="an item fills a line"):
        items("x", [name])


def test_calls_and_signatures_wrap() -> None:
    short, long = ["a", "b"], [f"argument_{i}: float" for i in range(9)]
    assert signature("f", short, "Array") == "def f(a, b) -> Array:"
    assert signature("f", long[:4], "Array").count("\n") == 0
    assert signature("f", long[:5], "Array").count("\n") == 2
    assert signature("f", long, "Array").count("\n") == 10
    assert invoke("y", "f", short) == "    y = f(a, b)"
    assert invoke("target", "f", [f"argument_numbe_{i}" for i in range(5)]).count("\n") == 2
    assert invoke("y", "f", [f"argument_number_{i}" for i in range(9)]).count("\n") == 10
    assert call("y", "np.stack", short) == "    y = np.stack((a, b))"
    assert call("target", "np.stack", [f"argument_{i}" for i in range(7)]).count("\n") == 2
    assert all(len(line) <= WIDTH for line in inputs(long).splitlines())


def test_missing_names_are_errors() -> None:
    with pytest.raises(jinja2.UndefinedError):
        render("section.py.j2", name="nothing else")
