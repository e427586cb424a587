"""SymPy expressions as NumPy source, spaced the way ruff formats it."""

from __future__ import annotations

from fractions import Fraction

import sympy as sp
from sympy.printing.precedence import PRECEDENCE, precedence
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
        terms = sorted(
            self._as_ordered_terms(expr, order=order), key=lambda term: _sign(term) < 0
        )
        text = ""
        for term in terms:
            sign = " - " if _sign(term) < 0 else " + "
            body = self.parenthesize(-term if _sign(term) < 0 else term, PRECEDENCE["Add"])
            text += (sign if text else ("-" if _sign(term) < 0 else "")) + body
        return text

    def _print_Mul(self, expr: sp.Mul) -> str:
        if _sign(expr) < 0:
            negated = -expr
            text = self._print(negated)
            return f"-({text})" if negated.is_Add else f"-{text}"
        coefficient, rest = expr.as_coeff_Mul()
        top, bottom = [], []
        if coefficient != 1:
            exact = Fraction(int(coefficient.p), int(coefficient.q))
            decimal = Fraction(float(exact)) == exact and abs(exact) < 10**6
            top += [coefficient] if decimal else [sp.Integer(coefficient.p)]
            bottom += [] if decimal else [sp.Integer(coefficient.q)]
        for factor in sp.Mul.make_args(rest) if rest.is_commutative else [rest]:
            exponent = factor.as_base_exp()[1]
            (bottom if exponent.is_negative else top).append(
                1 / factor if exponent.is_negative else factor
            )
        top = [f for f in top if f != 1]
        order = sp.core.sorting.default_sort_key
        top = [f for f in top if f.is_Number] + sorted([f for f in top if not f.is_Number], key=order)
        above = " * ".join(self._factor(factor) for factor in top) or "1.0"
        if not bottom:
            return above
        below = [self._factor(factor) for factor in bottom]
        return f"{above} / {below[0]}" if len(below) == 1 else f"{above} / ({' * '.join(below)})"

    def _factor(self, factor: sp.Expr) -> str:
        if factor.is_Atom or factor.is_Function or _is_root(factor):
            return self._print(factor)
        return self.parenthesize(factor, PRECEDENCE["Mul"] + 1)


def _sign(term: sp.Expr) -> int:
    return -1 if term.could_extract_minus_sign() and not term.is_Add else 1


def _is_root(expression: sp.Expr) -> bool:
    return bool(expression.is_Pow and expression.exp == sp.Rational(1, 2))


def source(expression: sp.Expr) -> str:
    """NumPy source of ``expression``."""
    return NumpyPrinter().doprint(sp.sympify(expression))


__all__ = ["NumpyPrinter", "precedence", "source"]
