"""Compiled tables of the exact engine: the flow of each linear piece as a polynomial in time.

On a piece of slope k the system is x' = (A - k b c) x + b u with a constant input u, and over a
step of length H

    x(sH) = M(s) (x, u),   M(s) = [e^{A_k s H}, ∫₀^{sH} e^{A_k σ} b dσ],   0 <= s <= 1.

M is an entire function of s. Its Taylor series is summed far beyond round-off, then economised
to `DEGREE` by dropping the Chebyshev polynomials of higher degree, and H is the longest step on
which what was dropped is below round-off. No eigenvalues, no inverse: defective pieces (freeplay
about the quarter chord) are like any other.
"""

from __future__ import annotations

from fractions import Fraction
from functools import cache
from math import comb
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeroflutter.kernels import kernel
from aeroflutter.kernels.arrays import Given1, Given2, Real1, Real2, Real3

Array = NDArray[np.float64]

DEGREE = 15
WIDTH = DEGREE + 1
SPACE = WIDTH + 2  # columns that hold a polynomial and, where it is on a stack, its interval
ORDER = 30  # of the Taylor series before it is economised
ROUND_OFF = 2.0**-53


class Tables(NamedTuple):
    """Flow of every piece. n states, m slopes, w = DEGREE + 1 coefficients.

    Attributes
    ----------
    step
        Length H of the step on each slope, (m,).
    lines
        What each entry of (x, u) adds to the line of a step, (m, rows, 2 SPACE + columns): the
        Bernstein coefficients of y = c x on [0, 1], its power coefficients, and the state at the
        end, M(1). Rows and columns are padded with zeros to multiples of four.
    flow
        Power coefficients of M(s), flattened by rows, (m, w, n (n+1)).
    generator
        [A_k, b], (m, n, n+1).
    noise
        Bound of the round-off in y a unit of each entry of (x, u), on any slope, (n+1,).
    d_flow
        Derivative of `flow` with respect to a parameter, (m, w, n (n+1)), or (m, 0, 0).
    c
        Row that picks the nonlinear coordinate, (n,).
    """

    step: Real1
    lines: Real3
    flow: Real3
    generator: Real3
    noise: Real1
    d_flow: Real3
    c: Real1


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


@kernel(entry=True, others=True)
def balance(A: Real2) -> Array:
    """Powers of two d that even out rows and columns of A_ij d_j/d_i (Osborne's iteration)."""
    n = A.shape[0]
    d = np.ones(n)
    for _ in range(8):
        for i in range(n):
            row = 0.0
            column = 0.0
            for j in range(n):
                if j != i:
                    row += abs(A[i, j]) * d[j] / d[i]
                    column += abs(A[j, i]) * d[i] / d[j]
            if row > 0.0 and column > 0.0:
                d[i] *= 2.0 ** np.round(0.5 * np.log2(row / column))
    return d


@kernel
def _taylor(G: Array, unit: float, terms: Array) -> None:
    """Taylor terms of [e^{At}, ∫ e^{Aσ} b] at t = `unit`, (ORDER+1, n, n+1), with G = [A, b]."""
    n = G.shape[0]
    terms[:] = 0.0
    for i in range(n):
        terms[0, i, i] = 1.0
    for k in range(1, terms.shape[0]):
        for i in range(n):
            if k == 1:
                terms[k, i, n] = G[i, n] * unit
            for m in range(n):
                factor = G[i, m] * (unit / k)
                for j in range(n + 1):
                    terms[k, i, j] += factor * terms[k - 1, m, j]


@kernel
def _d_taylor(G: Array, dG: Array, unit: float, terms: Array, d_terms: Array) -> None:
    """Derivative of the Taylor terms when G changes by dG."""
    n = G.shape[0]
    d_terms[:] = 0.0
    for k in range(1, terms.shape[0]):
        for i in range(n):
            if k == 1:
                d_terms[k, i, n] = dG[i, n] * unit
            for m in range(n):
                factor = G[i, m] * (unit / k)
                d_factor = dG[i, m] * (unit / k)
                for j in range(n + 1):
                    d_terms[k, i, j] += (
                        factor * d_terms[k - 1, m, j] + d_factor * terms[k - 1, m, j]
                    )


@kernel
def _sizes(terms: Array, weights: Array) -> Array:
    """Largest entry of each Taylor term in balanced coordinates, state and input apart, (K, 2)."""
    n = terms.shape[1]
    sizes = np.zeros((terms.shape[0], 2))
    for k in range(terms.shape[0]):
        for i in range(n):
            for j in range(n):
                sizes[k, 0] = max(sizes[k, 0], abs(terms[k, i, j]) * weights[j] / weights[i])
            sizes[k, 1] = max(sizes[k, 1], abs(terms[k, i, n]) / weights[i])
    return sizes


@kernel
def _fits(sizes: Array, dropped: Array, stretch: float) -> bool:
    """Whether economising and truncating stay below round-off at `stretch` units of time."""
    last = sizes.shape[0] - 1
    for part in range(2):
        largest = 0.0
        lost = 0.0
        growth = 1.0
        for k in range(last + 1):
            term = sizes[k, part] * growth
            largest = max(largest, term)
            lost += term * dropped[k]
            growth *= stretch
        lost += 8.0 * sizes[last, part] * stretch**last
        if lost > ROUND_OFF * (1.0 if part == 0 else largest):
            return False
    return True


@kernel
def longest_step(G: Array, dropped: Array) -> float:
    """Longest step on which the economised flow of [A, b] is exact to round-off."""
    n = G.shape[0]
    weights = balance(G[:, :n])
    norm = 0.0
    for i in range(n):
        row = 0.0
        for j in range(n):
            row += abs(G[i, j]) * weights[j] / weights[i]
        norm = max(norm, row)
    if norm == 0.0:
        return np.inf
    terms = np.empty((dropped.size, n, n + 1))
    _taylor(G, 1.0 / norm, terms)
    sizes = _sizes(terms, weights)
    low, high = -6.0, 8.0  # powers of two of the stretch; the norm bounds it from below
    for _ in range(14):
        middle = 0.5 * (low + high)
        if _fits(sizes, dropped, 2.0**middle):
            low = middle
        else:
            high = middle
    return 2.0**low / norm


@kernel
def _economise(terms: Array, to_power: Array, out: Array) -> None:
    """Power coefficients (w, n (n+1)) of the economised series."""
    rows = terms.reshape(terms.shape[0], -1)
    out[:] = 0.0
    for k in range(rows.shape[0]):
        for row in range(min(k + 1, WIDTH)):
            factor = to_power[row, k]
            if factor != 0.0:
                for j in range(rows.shape[1]):
                    out[row, j] += factor * rows[k, j]


@kernel
def _economise_row(terms: Array, c: Array, convert: Array, out: Array, column: int) -> None:
    """Coefficients (n+1, w) of y = c x in the basis of `convert`, into `out` from a column on."""
    n = c.size
    for k in range(terms.shape[0]):
        for j in range(n + 1):
            y = 0.0
            for i in range(n):
                y += c[i] * terms[k, i, j]
            if y != 0.0:
                for row in range(WIDTH):
                    out[j, column + row] += convert[row, k] * y


@kernel
def _sum(terms: Array, out: Array, column: int) -> None:
    """The series at s = 1, transposed, into `out` from a column on; smallest terms first."""
    n = terms.shape[1]
    for k in range(terms.shape[0] - 1, -1, -1):
        for i in range(n):
            for j in range(n + 1):
                out[j, column + i] += terms[k, i, j]


@kernel
def padded(size: int) -> int:
    """The next multiple of four."""
    return (size + 3) // 4 * 4


@kernel(entry=True)
def build(
    A: Given2,
    b: Given1,
    c: Given1,
    slopes: Real1,
    cap: float,
    dA: Given2,
    db: Given1,
    to_bernstein: Real2,
    to_power: Real2,
    dropped: Real1,
) -> Tables:
    """Tables of the pieces with these slopes.

    Parameters
    ----------
    A, b, c
        The system, (n, n), (n,), (n,).
    slopes
        Distinct slopes of the spring, (m,).
    cap
        Longest step allowed; infinity leaves it to the series.
    dA, db
        Derivative of A and b with respect to a parameter, or arrays (0, 0) and (0,).
    to_bernstein, to_power, dropped
        From `conversions`.
    """
    n = c.size
    m = slopes.size
    size = n * (n + 1)
    wanted = WIDTH if db.size else 0
    tables = Tables(
        np.empty(m),
        np.zeros((m, padded(n + 1), 2 * SPACE + padded(n))),
        np.empty((m, WIDTH, size)),
        np.empty((m, n, n + 1)),
        np.empty(n + 1),
        np.empty((m, wanted, size if wanted else 0)),
        c.copy(),
    )
    terms = np.empty((ORDER + 1, n, n + 1))
    d_terms = np.empty((ORDER + 1, n, n + 1))
    for p in range(m):
        G = tables.generator[p]
        for i in range(n):
            for j in range(n):
                G[i, j] = A[i, j] - slopes[p] * b[i] * c[j]
            G[i, n] = b[i]
        step = min(longest_step(G, dropped), cap)
        if not np.isfinite(step):
            step = 1.0
        tables.step[p] = step
        _taylor(G, step, terms)
        _economise(terms, to_power, tables.flow[p])
        _economise_row(terms, c, to_bernstein, tables.lines[p], 0)
        _economise_row(terms, c, to_power, tables.lines[p], SPACE)
        _sum(terms, tables.lines[p], 2 * SPACE)
        if wanted:
            dG = np.empty((n, n + 1))
            for i in range(n):
                for j in range(n):
                    dG[i, j] = dA[i, j] - slopes[p] * db[i] * c[j]
                dG[i, n] = db[i]
            _d_taylor(G, dG, step, terms, d_terms)
            _economise(d_terms, to_power, tables.d_flow[p])
    for j in range(n + 1):
        tables.noise[j] = np.max(np.abs(tables.lines[:, j, :WIDTH]))
    return tables
