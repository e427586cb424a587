"""What a proof is: two ways to one expression, and an error that shows where they part."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import sympy as sp


class ProofError(ArithmeticError):
    """A step of the derivation that does not hold."""


@dataclass(frozen=True)
class Proof:
    """A statement of the derivation and the computation that proves it.

    ``statement`` is Markdown for the report; ``run`` raises :class:`ProofError` where it fails.
    """

    name: str
    statement: str
    run: Callable[[], None]


def check_same(name: str, shortcut: object, long_way: object) -> None:
    """Prove two expressions, or matrices of them, identical for all values of their symbols.

    Raises
    ------
    ProofError
        Naming the entry and what is left of the difference.
    """
    left, right = sp.Matrix([shortcut]), sp.Matrix([long_way])
    if left.shape != right.shape:
        raise ProofError(f"{name}: shapes {left.shape} and {right.shape} differ")
    for i in range(left.rows):
        for j in range(left.cols):
            rest = remainder(left[i, j] - right[i, j])
            if rest != 0:
                raise ProofError(f"{name}: entry ({i}, {j}) differs by {rest}")


def remainder(difference: sp.Expr) -> sp.Expr:
    """Zero where an expression vanishes identically, else what is left, simplified if short."""
    rest = sp.expand(difference)
    if rest != 0:
        rest = sp.expand(sp.numer(sp.together(rest)))
    return sp.simplify(rest) if 0 < rest.count_ops() < 50 else rest


def check_numbers(name: str, shortcut: object, long_way: object, tolerance: float = 1e-12) -> None:
    """Prove that two sets of numbers agree to round-off, relative to the largest of them.

    Raises
    ------
    ProofError
        With the largest difference.
    """
    left, right = _numbers(shortcut), _numbers(long_way)
    if len(left) != len(right):
        raise ProofError(f"{name}: {len(left)} numbers against {len(right)}")
    worst = max((abs(x - y) for x, y in zip(left, right, strict=True)), default=0.0)
    size = max(map(abs, right), default=0.0) or 1.0
    if not worst <= tolerance * size:
        raise ProofError(f"{name}: differs by {worst:.3g} where the numbers reach {size:.3g}")


def _numbers(values: object) -> list[complex]:
    """Every number in nested lists, tuples or matrices."""
    if isinstance(values, (list, tuple, sp.MatrixBase)):
        return [number for item in values for number in _numbers(item)]
    return [complex(values)]  # type: ignore[call-overload]
