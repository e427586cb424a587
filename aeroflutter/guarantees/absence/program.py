"""The linear programs of the search for multipliers, solved by their duals.

Times that are close have columns that are nearly alike, and among those the simplex method wanders.
In the dual they are constraints, few of which are ever met: a third of the pivots, or fewer.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["Solution", "minimum"]

Real = NDArray[np.float64]

_ITERATIONS, _SECONDS = 20_000, 15.0  # after which a program counts as unsolved


class Solution(NamedTuple):
    """Where the minimum is.

    Attributes
    ----------
    x
        The unknowns, (n,).
    worth
        By how much the minimum falls as a bound rises by one, (m,).
    slack
        What is left of each bound, (m,).
    """

    x: Real
    worth: Real
    slack: Real


def minimum(cost: Real, table: Real, bound: Real, free: int = 0) -> Solution | None:
    """min cost·x with table x <= bound, all but the first `free` of the x not negative.

    Parameters
    ----------
    cost, table, bound
        Shapes (n,), (m, n) and (m,).
    free
        How many unknowns may have either sign.

    Returns
    -------
    Solution or None
        None where there is no answer in double precision.
    """
    from scipy.optimize import linprog

    for method in ("highs-ds", "highs-ipm"):  # where one fails on a badly scaled program
        answer = linprog(
            bound,
            A_ub=-table[:, free:].T,
            b_ub=cost[free:],
            A_eq=-table[:, :free].T if free else None,
            b_eq=cost[:free] if free else None,
            method=method,
            options={"maxiter": _ITERATIONS, "time_limit": _SECONDS, "presolve": False},
        )
        if answer.status == 0:
            others = np.maximum(-answer.ineqlin.marginals, 0.0)
            x = np.concatenate((-answer.eqlin.marginals[:free], others))
            return Solution(x, answer.x, bound - table @ x)
    return None
