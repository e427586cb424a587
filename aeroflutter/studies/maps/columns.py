"""Columns of a map on the exact engine: made ready once, decided in one compiled call."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeroflutter.model.lure import LureSystem
from aeroflutter.motion import _kernel_exact_ends as ends
from aeroflutter.motion._kernel_exact_proofs import Proofs
from aeroflutter.motion._kernel_exact_tables import build, conversions
from aeroflutter.motion.endstates import EndOptions, problem_of
from aeroflutter.motion.prepared import Prepared, law_of
from aeroflutter.springs import Spring, simplify
from aeroflutter.studies.maps._kernel_column import decide_column
from aeroflutter.studies.maps._kernel_modal import modal

__all__ = ["Column", "decide_cells"]

Array = NDArray[np.float64]


class Column(NamedTuple):
    """How the cells of one system end, (m,) each; see `timemarch.endstates.EndStates`."""

    state: NDArray[np.int64]
    amplitude: Array
    bias: Array
    period: Array
    rest: Array
    time: Array


def decide_cells(
    system: LureSystem,
    spring: Spring,
    states: Array,
    memory: Array,
    options: EndOptions,
    step_cap: float | None = None,
) -> Column:
    """End states of cells that share a system and a spring, in their order.

    Parameters
    ----------
    system, spring
        x' = A x - b F(c x), and F.
    states, memory
        Where the cells start, (m, n) and (m,).
    options
        When an end state is settled.
    step_cap
        Longest internal step, τ.
    """
    prepared = _prepared(system, spring, step_cap)
    codes = np.empty((memory.size, 2), dtype=np.int64)
    numbers = np.empty((memory.size, ends.NUMBERS))
    decide_column(problem_of(prepared, options), states, memory, codes, numbers)
    columns = (ends.AMPLITUDE, ends.BIAS, ends.PERIOD, ends.REST, ends.TIME)
    return Column(codes[:, 0], *(numbers[:, column] for column in columns))


@lru_cache(maxsize=64)
def _law(spring: Spring) -> tuple[Spring, Any, Array]:
    """The simplified spring, and it as the kernels' numbers."""
    simple = simplify(spring)
    return simple, *law_of(simple)


_NOTHING = np.empty((0, 0)), np.empty(0)


def _prepared(system: LureSystem, spring: Spring, step_cap: float | None) -> Prepared:
    """`Prepared.of`, sparing what the columns of a map have in common."""
    simple, law, slopes = _law(spring)
    cap = np.inf if step_cap is None else float(step_cap)
    tables = build(
        np.ascontiguousarray(system.A),
        np.ascontiguousarray(system.b),
        np.ascontiguousarray(system.c),
        slopes,
        cap,
        *_NOTHING,
        *conversions(),
    )
    prepared = Prepared(system, simple, law, tables)
    proofs = _proofs(system) if law.memory else None
    if proofs is not None:
        prepared.__dict__["proofs"] = proofs  # what the cached property would have computed
    return prepared


def _proofs(system: LureSystem) -> Proofs | None:
    """Proofs of a loop whose stick piece is stable, or None where the general ones are needed."""
    n = system.order
    rows, heads = np.zeros((1, n, n)), np.zeros((1, n), dtype=np.int64)
    centre, rest = np.zeros((1, 2, n)), np.zeros((1, 2))
    closed = np.ascontiguousarray(system.closed(1.0))
    if not modal(
        closed, np.array(system.b), np.array(system.c), rows[0], heads[0], centre[0, 1], rest[0, 1:]
    ):
        return None
    return Proofs(
        decays=np.ones(1, dtype=np.int64),
        rows=rows,
        heads=heads,
        centre=centre,
        rest=rest,
        free=np.zeros((1, n)),
        grows=np.zeros((0, 2, n)),
        against=np.zeros(0),
        unstable=0,
    )
