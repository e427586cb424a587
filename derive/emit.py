"""Emission of the derived equations as NumPy modules through Jinja2 templates."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import sympy as sp
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from derive.printer import source

WIDTH = 100
TEMPLATES = Path(__file__).parent / "templates"


def assignment(target: str, expression: sp.Expr, indent: int = 4) -> str:
    """``target = expression``, broken at its additions where the line would be too long."""
    pad = " " * indent
    line = f"{pad}{target} = {source(expression)}"
    if len(line) <= WIDTH:
        return line
    inner = f"{pad}    {source(expression)}"
    if len(inner) <= WIDTH:
        return f"{pad}{target} = (\n{inner}\n{pad})"
    terms = _terms(source(expression))
    lines = [f"{pad}{target} = (", *(f"{pad}    {term}" for term in terms), f"{pad})"]
    if max(map(len, lines)) > WIDTH or len(terms) == 1:
        raise ValueError(f"{target}: name some intermediate terms, one term fills a line: {lines}")
    return "\n".join(lines)


def _terms(text: str) -> list[str]:
    """Split a printed sum at the additions outside parentheses, as ruff would."""
    depth, start, terms = 0, 0, []
    for i, character in enumerate(text):
        depth += (character == "(") - (character == ")")
        if depth == 0 and text[i : i + 3] in (" + ", " - "):
            terms.append(text[start:i])
            start = i + 1
    return [*terms, text[start:]]


def matrix(target: str, value: sp.Matrix, indent: int = 4) -> str:
    """Allocation of a matrix (a vector, where it has one row or column) and its nonzero entries."""
    vector = min(value.shape) == 1
    shape = str(max(value.shape)) if vector else f"({value.rows}, {value.cols})"
    lines = [f"{' ' * indent}{target} = np.zeros({shape})"]
    for i in range(value.rows):
        for j in range(value.cols):
            if value[i, j] != 0:
                index = str(max(i, j)) if vector else f"{i}, {j}"
                lines.append(assignment(f"{target}[{index}]", value[i, j], indent))
    return "\n".join(lines)


def row(target: str, value: sp.Matrix, indent: int = 4) -> str:
    """Entries of a row whose leading axes broadcast."""
    entries = enumerate(value)
    return "\n".join(assignment(f"{target}[..., {j}]", entry, indent) for j, entry in entries)


def assignments(pairs: Sequence[tuple[sp.Symbol, sp.Expr]], indent: int = 4) -> str:
    """One line a named term."""
    return "\n".join(assignment(str(symbol), expression, indent) for symbol, expression in pairs)


def items(target: str, values: Sequence[sp.Expr], indent: int = 4) -> str:
    """A tuple with one item a line."""
    pad = " " * indent
    lines = [f"{pad}{target} = (", *(f"{pad}    {source(value)}," for value in values), f"{pad})"]
    if max(map(len, lines)) > WIDTH:
        raise ValueError(f"{target}: an item fills a line; name some intermediate terms: {lines}")
    return "\n".join(lines)


def call(target: str, function: str, values: Sequence[str], indent: int = 4) -> str:
    """``target = function((values))``, the tuple on a line of its own where it must be."""
    pad = " " * indent
    line = f"{pad}{target} = {function}(({', '.join(values)}))"
    if len(line) <= WIDTH:
        return line
    return f"{pad}{target} = {function}(\n{pad}    ({', '.join(values)})\n{pad})"


def signature(name: str, arguments: Sequence[str], returns: str) -> str:
    """A ``def`` line laid out as ruff lays it out."""
    one = f"def {name}({', '.join(arguments)}) -> {returns}:"
    if len(one) <= WIDTH:
        return one
    body = f"    {', '.join(arguments)}"
    if len(body) <= WIDTH:
        return f"def {name}(\n{body}\n) -> {returns}:"
    body = "\n".join(f"    {argument}," for argument in arguments)
    return f"def {name}(\n{body}\n) -> {returns}:"


def environment() -> Environment:
    """Jinja2 with undefined names an error and the formatting helpers of this module."""
    env = Environment(
        loader=FileSystemLoader(TEMPLATES),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    helpers = (assignments, items, matrix, row, signature, source)
    env.globals.update({helper.__name__: helper for helper in helpers})
    return env


def render(template: str, **context: object) -> str:
    """Render a template of ``derive/templates``."""
    return environment().get_template(template).render(**context)
