"""SymPy expressions as NumPy source, spaced the way ruff formats it."""

from __future__ import annotations

from fractions import Fraction

import sympy as sp
from sympy.printing.precedence import PRECEDENCE
from sympy.printing.str import StrPrinter

_FUNCTIONS = {
    "sqrt": "np.sqrt",
    "exp": "np.exp",
    "sin": "np.sin",
    "cos": "np.cos",
    "asin": "np.arcsin",
    "acos": "np.arccos",
    "Abs": "np.abs",
}


class NumpyPrinter(StrPrinter):
    """Decimal constants where they are exact, ``a**2`` but ``(a + b) ** 2``."""

    def _print_Integer(self, expr: sp.Integer) -> str:
        return f"{int(expr)}.0"

    def _print_Rational(self, expr: sp.Rational) -> str:
        exact = Fraction(int(expr.p), int(expr.q))
        if Fraction(float(exact)) == exact:
            return repr(float(exact))
        return f"{int(expr.p)}.0 / {int(expr.q)}.0"

    _print_Half = _print_Rational
    _print_One = _print_Integer
    _print_Zero = _print_Integer
    _print_NegativeOne = _print_Integer

    def _print_Pi(self, expr: sp.Expr) -> str:
        return "np.pi"

    def _print_Function(self, expr: sp.Function) -> str:
        name = _FUNCTIONS[type(expr).__name__]
        return f"{name}({', '.join(self._print(arg) for arg in expr.args)})"

    _print_Abs = _print_Function

    def _print_Pow(self, expr: sp.Pow, rational: bool = False) -> str:
        base, exponent = expr.as_base_exp()
        if exponent == sp.Rational(1, 2):
            return f"np.sqrt({self._print(base)})"
        if exponent.is_negative:
            return f"1.0 / {self._factor(1 / expr)}"
        power = int(exponent) if exponent.is_Integer else self._print(exponent)
        simple = base.is_Symbol or base is sp.pi
        text = self.parenthesize(base, PRECEDENCE["Pow"])
        return f"{text}**{power}" if simple else f"{text} ** {power}"

    def _print_Add(self, expr: sp.Add, order: str | None = None) -> str:
        terms = self._as_ordered_terms(expr, order=order)
        terms = sorted(terms, key=_negative)
        text = self._print(terms[0])
        for term in terms[1:]:
            sign, body = (" - ", -term) if _negative(term) else (" + ", term)
            text += sign + self.parenthesize(body, PRECEDENCE["Add"])
        return text

    def _print_Mul(self, expr: sp.Mul) -> str:
        sign = "-" if _negative(expr) else ""
        positive = -expr if sign else expr
        if positive.is_Add:
            return f"{sign}({self._print(positive)})"
        top, bottom = _fraction(positive)
        above = [self._factor(factor) for factor in top] or ["1.0"]
        below = [self._factor(factor) for factor in bottom]
        if sign and top and top[0].is_Pow and not _is_root(top[0]):
            above[0] = f"({above[0]})"
        text = sign + " * ".join(above)
        if not below:
            return text
        return f"{text} / {below[0]}" if len(below) == 1 else f"{text} / ({' * '.join(below)})"

    def _factor(self, factor: sp.Expr) -> str:
        if factor.is_Atom or factor.is_Function or _is_root(factor):
            return self._print(factor)
        return self.parenthesize(factor, PRECEDENCE["Mul"] + 1)


def _negative(term: sp.Expr) -> bool:
    return bool(term.could_extract_minus_sign() and not term.is_Add)


def _fraction(product: sp.Expr) -> tuple[list[sp.Expr], list[sp.Expr]]:
    """Factors above and below the bar, numbers first, decimals where they are exact."""
    coefficient, rest = product.as_coeff_Mul()
    exact = Fraction(int(coefficient.p), int(coefficient.q))
    decimal = Fraction(float(exact)) == exact
    numbers = [coefficient] if decimal else [sp.Integer(coefficient.p)]
    top = [number for number in numbers if number != 1]
    bottom = [] if decimal else [sp.Integer(coefficient.q)]
    for factor in sorted(sp.Mul.make_args(rest), key=sp.core.sorting.default_sort_key):
        if factor.as_base_exp()[1].is_negative:
            bottom.append(1 / factor)
        elif factor != 1:
            top.append(factor)
    return top, bottom


def _is_root(expression: sp.Expr) -> bool:
    return bool(expression.is_Pow and expression.exp == sp.Rational(1, 2))


def source(expression: sp.Expr) -> str:
    """NumPy source of ``expression``."""
    return NumpyPrinter().doprint(sp.sympify(expression))


__all__ = ["NumpyPrinter", "source"]
