"""A system and its spring made ready for the exact engine, once for any number of motions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.errors import InputError
from aeroflutter.motion._kernel_exact import Law
from aeroflutter.motion._kernel_exact_tables import Tables, build, conversions
from aeroflutter.springs import Hysteresis, PiecewiseLinear, simplify

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from aeroflutter.model.lure import LureSystem
    from aeroflutter.motion._kernel_exact_proofs import Proofs
    from aeroflutter.springs import Spring

    Array = NDArray[np.float64]

__all__ = ["Prepared", "law_of"]


def law_of(spring: Spring) -> tuple[Law, Array]:
    """A piecewise-linear spring as the kernels' numbers, and the distinct slopes of its pieces.

    Raises
    ------
    InputError
        If the spring is not piecewise linear.
    """
    none = np.empty(0)
    if isinstance(spring, Hysteresis):
        loop = np.array([spring.v1, spring.v2, spring.h_low, spring.h_high])
        table = np.array([0, 1], dtype=np.int64)
        size = float(np.abs(loop).max())
        return Law(1, none, table, none, none, loop, size), np.array([1.0, 0.0])
    if not isinstance(spring, PiecewiseLinear):
        raise InputError(
            f"spring.kind: {spring.kind!r} has no linear pieces; the exact engine takes linear, "
            "table, bilinear, freeplay and hysteresis"
        )
    pieces = spring.pieces()
    slopes, table = np.unique(np.asarray(pieces.slopes, dtype=float), return_inverse=True)
    edges = np.concatenate(([-np.inf], pieces.breaks, [np.inf]))
    size = float(np.abs(np.concatenate((pieces.breaks, pieces.offsets))).max())
    law = Law(
        0,
        edges,
        table.astype(np.int64),
        np.array(pieces.slopes, dtype=float),
        np.array(pieces.offsets, dtype=float),
        np.zeros(4),
        size,
    )
    return law, slopes


@dataclass(frozen=True, eq=False)
class Prepared:
    """Tables of one system with one spring.

    Attributes
    ----------
    system
        x' = A x - b F(c x).
    spring
        The spring, simplified.
    law, tables
        Both as the kernels' numbers.
    """

    system: LureSystem
    spring: Spring
    law: Law
    tables: Tables

    @classmethod
    def of(
        cls,
        system: LureSystem,
        spring: Spring,
        step_cap: float | None = None,
        derivative: tuple[Any, Any] | None = None,
    ) -> Prepared:
        """Prepare a system and a spring.

        Parameters
        ----------
        system
            x' = A x - b F(c x).
        spring
            Linear, table, bilinear, freeplay or hysteresis; a loop without height or width is
            taken as the freeplay or linear spring that it is.
        step_cap
            Longest internal step, τ.
        derivative
            dA, (n, n), and db, (n,), with respect to a parameter, for the flow's derivative.

        Raises
        ------
        InputError
            If the spring is not piecewise linear or the step cap is not positive.
        """
        if step_cap is not None and not step_cap > 0.0:
            raise InputError(f"step_cap: {step_cap!r} is not a positive number")
        simple = simplify(spring)
        law, slopes = law_of(simple)
        dA, db = derivative if derivative is not None else (np.empty((0, 0)), np.empty(0))
        tables = build(
            np.ascontiguousarray(system.A, dtype=float),
            np.ascontiguousarray(system.b, dtype=float),
            np.ascontiguousarray(system.c, dtype=float),
            slopes,
            np.inf if step_cap is None else float(step_cap),
            np.ascontiguousarray(dA, dtype=float),
            np.ascontiguousarray(db, dtype=float),
            *conversions(),
        )
        return cls(system, simple, law, tables)

    @cached_property
    def proofs(self) -> Proofs:
        """What certifies the end of a motion of this system."""
        from aeroflutter.motion.proofs import proofs_of

        return proofs_of(self.system, self.law)
