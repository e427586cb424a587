"""Emission of the derived equations as NumPy modules through Jinja2 templates."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence
from pathlib import Path

import sympy as sp
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from derive.printer import source

WIDTH = 100
TEMPLATES = Path(__file__).parent / "templates"


def assignment(target: str, expression: sp.Expr, indent: int = 4) -> str:
    """``target = expression``, broken at its additions where the line would be too long.

    Where that does not do, the longest sums and functions inside it are named first. A long sum
    that ends in a bracket is one of these cases, since formatters break it in the bracket.
    """
    stem = re.sub(r"[^0-9a-zA-Z]+", "_", target).strip("_")
    named: list[str] = []
    while (text := _layout(target, expression, indent)) is None:
        part = _longest_part(expression)
        name = f"{stem}_part_{len(named) + 1}"
        named.append(assignment(name, part, indent))
        expression = expression.xreplace({part: sp.Symbol(name, real=True)})
    return "\n".join([*named, text])


def _layout(target: str, expression: sp.Expr, indent: int) -> str | None:
    """One line, or one a term, or None where neither fits."""
    pad, text = " " * indent, source(expression)
    if len(f"{pad}{target} = {text}") <= WIDTH:
        return f"{pad}{target} = {text}"
    inner = [text] if len(f"{pad}    {text}") <= WIDTH else _terms(text)
    lines = [f"{pad}{target} = (", *(f"{pad}    {term}" for term in inner), f"{pad})"]
    return None if max(map(len, lines)) > WIDTH or text.endswith(")") else "\n".join(lines)


def _longest_part(expression: sp.Expr) -> sp.Expr:
    """The sum, root or function inside an expression that takes the most room."""
    parts = [
        part
        for part in expression.atoms(sp.Add, sp.Function, sp.Pow) - {expression}
        if not (part.is_Pow and part.exp.is_Integer)
    ]
    if not parts:
        raise ValueError(f"cannot be laid out: {source(expression)}")
    return max(parts, key=lambda part: (len(source(part)), source(part)))


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
    """Nonzero entries of a row whose leading axes broadcast."""
    entries = [(j, entry) for j, entry in enumerate(value) if entry != 0]
    return "\n".join(assignment(f"{target}[..., {j}]", entry, indent) for j, entry in entries)


def assignments(pairs: Sequence[tuple[sp.Symbol, sp.Expr]], indent: int = 4) -> str:
    """One line a named term."""
    return "\n".join(assignment(str(symbol), expression, indent) for symbol, expression in pairs)


def items(target: str, values: Sequence[sp.Expr], indent: int = 4) -> str:
    """A tuple with one item a line."""
    pad = " " * indent
    lines = [f"{pad}{target} = ("]
    for value in values:
        line = f"{pad}    {source(value)},"
        terms = [line] if len(line) <= WIDTH else [f"{pad}    {x}" for x in _terms(line.strip())]
        lines += terms
    if max(map(len, [*lines, ""])) > WIDTH:
        raise ValueError(f"{target}: an item fills a line; name some intermediate terms: {lines}")
    return "\n".join([*lines, f"{pad})"])


def call(target: str, function: str, values: Sequence[str], indent: int = 4) -> str:
    """``target = function((values))``, the tuple on a line of its own where it must be."""
    pad = " " * indent
    line = f"{pad}{target} = {function}(({', '.join(values)}))"
    if len(line) <= WIDTH:
        return line
    return f"{pad}{target} = {function}(\n{pad}    ({', '.join(values)})\n{pad})"


def invoke(target: str, function: str, arguments: Sequence[str], indent: int = 4) -> str:
    """``target = function(arguments)``, laid out as ruff lays it out."""
    pad = " " * indent
    text = ", ".join(arguments)
    if len(f"{pad}{target} = {function}({text})") <= WIDTH:
        return f"{pad}{target} = {function}({text})"
    if len(f"{pad}    {text}") <= WIDTH:
        return f"{pad}{target} = {function}(\n{pad}    {text}\n{pad})"
    lines = "\n".join(f"{pad}    {argument}," for argument in arguments)
    return f"{pad}{target} = {function}(\n{lines}\n{pad})"


def inputs(arguments: Sequence[str], indent: int = 4) -> str:
    """Comment that names the inputs of a function."""
    lead = f"{' ' * indent}# "
    text = f"inputs: {', '.join(arguments)}"
    return textwrap.fill(text, WIDTH, initial_indent=lead, subsequent_indent=lead)


def lines(names: Sequence[str]) -> list[str]:
    """Names joined by commas, as many lines as it takes."""
    return [line.rstrip(",") for line in textwrap.wrap(", ".join(names), WIDTH - 20)]


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
    helpers = (assignments, inputs, invoke, items, lines, matrix, row, signature, source)
    env.globals.update({helper.__name__: helper for helper in helpers})
    env.globals.update(parameter_docs={}, defaults={})
    return env


def render(template: str, **context: object) -> str:
    """Render a template of ``derive/templates``, with one line end at its own end."""
    text = environment().get_template(template).render(**context)
    return text.strip("\n") + "\n"
