"""Tables of the exact engine: the flow of each linear mode as a polynomial in time.

In a mode the system is x' = A x + B u with a closed matrix A and constant inputs u, and over a
step of length H

    x(sH) = M(s) (x, u),   M(s) = [e^{A s H}, ∫₀^{sH} e^{A σ} B dσ],   0 <= s <= 1.

M is an entire function of s. Its Taylor series is summed far beyond round-off, then economised
to `DEGREE` by dropping the Chebyshev polynomials of higher degree, and H is the longest step on
which what was dropped is below round-off. No eigenvalues, no inverse: defective modes (freeplay
about the quarter chord) are like any other.
"""

from __future__ import annotations

from fractions import Fraction
from functools import cache
from math import comb
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeroflutter.motion._kernel_roots import DEGREE, SPACE, WIDTH

__all__ = ["StepTables", "build", "padded"]

Array = NDArray[np.float64]

ORDER = 30  # of the Taylor series before it is economised
ROUND_OFF = 2.0**-53
LEAST, MOST = -6.0, 8.0  # powers of two of a step times the norm of A: the norm bounds it below
HALVINGS = 14  # of that range


class StepTables(NamedTuple):
    """Flow of k modes. n states, q inputs, m outputs, w = WIDTH coefficients.

    Attributes
    ----------
    step
        Length H of the step in each mode, (k,).
    lines
        What each entry of (x, u) adds to the line of a step, (k, rows, 2 m SPACE + columns): of
        each output the Bernstein coefficients on [0, 1] and the power coefficients, then the
        state at the end, M(1). Rows and columns are padded with zeros to multiples of four.
    flow
        Power coefficients of M(s), flattened by rows, and M(1), (k, w + 1, n (n+q)).
    generator
        [A, B], (k, n, n+q).
    d_flow
        Derivative of `flow` with respect to a parameter, (k, w + 1, n (n+q)), or (k, 0, 0).
    """

    step: Array
    lines: Array
    flow: Array
    generator: Array
    d_flow: Array


def padded(size: int) -> int:
    """The next multiple of four."""
    return (size + 3) // 4 * 4


@cache
def conversions() -> tuple[Array, Array, Array]:
    """Economised Taylor polynomials on [0, 1], computed in rational arithmetic.

    Returns
    -------
    to_bernstein, to_power : array (DEGREE+1, ORDER+1)
        Column k holds the Bernstein and power coefficients of the economised s^k.
    dropped : array (ORDER+1,)
        Largest error of the economised s^k on [0, 1].
    """
    bernstein = np.zeros((WIDTH, ORDER + 1))
    power = np.zeros((WIDTH, ORDER + 1))
    dropped = np.zeros(ORDER + 1)
    chebyshev = _shifted_chebyshev()
    for k in range(ORDER + 1):
        share = [Fraction(2 * comb(2 * k, k - j), 4**k) for j in range(k + 1)]
        share[0] /= 2
        kept = min(k, DEGREE) + 1
        for row in range(WIDTH):
            power[row, k] = sum(
                (share[j] * chebyshev[j][row] for j in range(row, kept)), Fraction()
            )
            bernstein[row, k] = sum(
                (share[j] * _bernstein_of_chebyshev(j, row) for j in range(kept)), Fraction()
            )
        dropped[k] = sum(share[kept:], Fraction())
    return bernstein, power, dropped


def _shifted_chebyshev() -> list[list[int]]:
    """Integer power coefficients of T_j(2s - 1), j <= DEGREE, each padded to WIDTH."""
    rows = [[1] + [0] * DEGREE, [-1, 2] + [0] * (DEGREE - 1)]
    for _ in range(DEGREE - 1):
        last, before = rows[-1], rows[-2]
        shifted = [0, *last[:-1]]
        rows.append([4 * a - 2 * b - c for a, b, c in zip(shifted, last, before, strict=True)])
    return rows


@cache
def _bernstein_of_chebyshev(j: int, row: int) -> Fraction:
    """Coefficient `row` of T_j(2s - 1) in the Bernstein basis of degree DEGREE."""
    total = sum(
        (-1) ** (j - i) * comb(2 * j, 2 * i) * comb(DEGREE - j, row - i)
        for i in range(max(0, row - DEGREE + j), min(j, row) + 1)
    )
    return Fraction(total, comb(DEGREE, row))


def balance(A: Array) -> Array:
    """Powers of two d that even out rows and columns of A_ij d_j/d_i, (n,)."""
    from scipy.linalg.lapack import dgebal

    return np.asarray(dgebal(A, scale=1, permute=0)[3])


def build(
    generator: Array, C: Array, cap: float = np.inf, d_generator: Array | None = None
) -> StepTables:
    """Tables of the modes with these generators.

    Parameters
    ----------
    generator
        [A, B] of each mode, (k, n, n+q).
    C
        Outputs y = C x, (m, n).
    cap
        Longest step allowed; infinity leaves it to the series.
    d_generator
        Derivative of the generators with respect to a parameter, (k, n, n+q).
    """
    k, n, width = generator.shape
    to_bernstein, to_power, dropped = conversions()
    norm, weights = _norms(generator[..., :n])
    unit = 1.0 / np.where(norm > 0.0, norm, 1.0)
    terms = _taylor(generator, unit)
    stretch = _stretch(_sizes(terms, weights), dropped)
    step = np.minimum(np.where(norm > 0.0, stretch * unit, np.inf), cap)
    step[~np.isfinite(step)] = 1.0
    terms *= (step / unit)[:, None, None] ** np.arange(ORDER + 1)[:, None, None, None]
    flow = _economised(terms, to_power)
    m = C.shape[0]
    lines = np.zeros((k, padded(width), 2 * m * SPACE + padded(n)))
    outputs = (C @ terms).reshape(ORDER + 1, k * C.shape[0] * width)
    for place, convert in enumerate((to_bernstein, to_power)):
        rows = (convert @ outputs).reshape(WIDTH, k, m, width)
        for i in range(m):
            begin = (2 * i + place) * SPACE
            lines[:, :width, begin : begin + WIDTH] = np.moveaxis(rows[:, :, i], 0, -1)
    lines[:, :width, 2 * m * SPACE : 2 * m * SPACE + n] = np.swapaxes(
        flow[:, WIDTH].reshape(k, n, width), 1, 2
    )
    d_flow = np.empty((k, 0, 0))
    if d_generator is not None:
        d_flow = _economised(_d_taylor(generator, d_generator, step, terms), to_power)
    return StepTables(step, lines, flow, np.ascontiguousarray(generator), d_flow)


def _norms(A: Array) -> tuple[Array, Array]:
    """Largest sum of a row of each balanced matrix, (k,), and the weights of balance, (k, n)."""
    weights = np.array([balance(one) for one in A]).reshape(A.shape[:2])
    sums = np.sum(np.abs(A) * weights[:, None, :], axis=2) / weights
    return np.max(sums, axis=1), weights


def _taylor(generator: Array, unit: Array) -> Array:
    """Taylor terms of [e^{At}, ∫ e^{Aσ} B] at t = `unit`, (ORDER+1, k, n, n+q)."""
    k, n, width = generator.shape
    scaled = generator * unit[:, None, None]
    terms = np.zeros((ORDER + 1, k, n, width))
    terms[0, :, np.arange(n), np.arange(n)] = 1.0
    terms[1] = scaled
    for order in range(2, ORDER + 1):
        np.matmul(scaled[..., :n], terms[order - 1], out=terms[order])
        terms[order] /= order
    return terms


def _d_taylor(generator: Array, d_generator: Array, step: Array, terms: Array) -> Array:
    """Derivative of the Taylor terms at t = `step` when the generators change."""
    n = generator.shape[1]
    scaled, d_scaled = generator * step[:, None, None], d_generator * step[:, None, None]
    d_terms = np.zeros_like(terms)
    d_terms[1] = d_scaled
    for order in range(2, ORDER + 1):
        d_terms[order] = (
            scaled[..., :n] @ d_terms[order - 1] + d_scaled[..., :n] @ terms[order - 1]
        ) / order
    return d_terms


def _sizes(terms: Array, weights: Array) -> Array:
    """Largest entry of each Taylor term in balanced coordinates, state and input apart."""
    n = weights.shape[1]
    balanced = np.abs(terms) / weights[:, :, None]
    balanced[..., :n] *= weights[:, None, :]
    state = np.max(balanced[..., :n], axis=(2, 3))
    return np.stack((state, np.max(balanced[..., n:], axis=(2, 3), initial=0.0)))


def _stretch(sizes: Array, dropped: Array) -> Array:
    """How many units of time the economised series is exact to round-off for, (k,)."""
    low, high = np.full(sizes.shape[2], LEAST), np.full(sizes.shape[2], MOST)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        fits = _fits(sizes, dropped, 2.0**middle)
        low, high = np.where(fits, middle, low), np.where(fits, high, middle)
    return np.asarray(2.0**low)


def _fits(sizes: Array, dropped: Array, stretch: Array) -> NDArray[np.bool_]:
    """Whether economising and truncating stay below round-off at `stretch` units of time."""
    state, inputs = sizes * stretch ** np.arange(ORDER + 1)[:, None]
    fits = dropped @ state + 8.0 * state[ORDER] <= ROUND_OFF
    fits &= dropped @ inputs + 8.0 * inputs[ORDER] <= ROUND_OFF * np.max(inputs, axis=0)
    return np.asarray(fits)


def _economised(terms: Array, to_power: Array) -> Array:
    """Power coefficients of the economised series and its sum at 1, (k, w + 1, n (n+q))."""
    _, k, n, width = terms.shape
    rows = terms.reshape(ORDER + 1, k * n * width)
    whole = np.sum(rows[::-1], axis=0)  # smallest terms first
    found = np.concatenate((to_power @ rows, whole[None]))
    return np.ascontiguousarray(np.swapaxes(found.reshape(WIDTH + 1, k, n * width), 0, 1))
