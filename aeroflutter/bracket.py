"""A bracketed root to round-off, without the half second that importing scipy.optimize costs."""

from __future__ import annotations

from collections.abc import Callable


def bracketed_root(function: Callable[[float], float], low: float, high: float) -> float:
    """Root of a continuous function between two points where its signs differ.

    Parameters
    ----------
    function : callable
    low, high : float

    Returns
    -------
    float
        Of the last bracket, which has shrunk to neighbouring numbers or to an exact zero, the
        end with the smaller value.

    Raises
    ------
    ValueError
        If the signs at the ends do not differ.

    Notes
    -----
    Chandrupatla (1997), Adv. Eng. Software 28: inverse quadratic interpolation where its criterion
    holds, bisection elsewhere.

    Examples
    --------
    >>> bracketed_root(lambda x: x * x - 2.0, 0.0, 2.0)
    1.4142135623730951
    """
    a, b = high, low
    fa, fb = function(a), function(b)
    if fa == 0.0 or fb == 0.0:
        return a if fa == 0.0 else b
    if (fa > 0) == (fb > 0):
        raise ValueError("the signs at the ends of the bracket do not differ")
    fraction = 0.5
    for _ in range(200):
        x = a + fraction * (b - a)
        fx = function(x)
        # a is always the newest point, b the other end of the bracket, c what was dropped
        if (fx > 0) == (fa > 0):
            c, fc = a, fa
        else:
            c, fc, b, fb = b, fb, a, fa
        a, fa = x, fx
        best, least = (a, abs(fa)) if abs(fa) < abs(fb) else (b, abs(fb))
        tolerance = 2e-16 * max(abs(best), 1e-300)
        limit = tolerance / abs(b - a) if b != a else 1.0
        if limit > 0.5 or least == 0.0:
            return best
        xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
        if phi**2 < xi and (1 - phi) ** 2 < 1 - xi:
            fraction = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (
                fc - fb
            )
        else:
            fraction = 0.5
        fraction = min(1 - limit, max(limit, fraction))
    return best
