"""The boundaries between the regions of a map, by bisection between neighbouring cells."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

__all__ = ["bisect"]

Array = NDArray[np.float64]
Codes = NDArray[np.int8]
Decide = Callable[[Array, Array], Codes]


def bisect(
    decide: Decide, fixed: Array, low: Array, high: Array, of_low: Codes, tolerance: float
) -> Array:
    """Where along one axis the region of the lower cell ends.

    A point of any other region takes the place of the upper cell, so what is found is a boundary
    of the lower cell's region.

    Parameters
    ----------
    decide
        Regions of the points (along, fixed), (m,) each.
    fixed
        The other coordinate, (m,).
    low, high
        Between which cells, (m,).
    of_low
        Region of the lower cells, (m,).
    tolerance
        Width at which to stop, in units of the axis.

    Returns
    -------
    array (m,)
        Middle of the last interval.
    """
    low, high = low.copy(), high.copy()
    open_ = np.arange(low.size)
    while open_.size:
        wide = np.abs(high[open_] - low[open_]) > tolerance
        middle = 0.5 * (low[open_] + high[open_])
        wide &= (middle != low[open_]) & (middle != high[open_])
        open_, middle = open_[wide], middle[wide]
        if open_.size:
            same = decide(middle, fixed[open_]) == of_low[open_]
            low[open_[same]] = middle[same]
            high[open_[~same]] = middle[~same]
    return 0.5 * (low + high)
