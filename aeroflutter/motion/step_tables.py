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

import threading
from fractions import Fraction
from functools import cache
from math import comb, factorial, prod
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aeroflutter.motion._kernel_roots import DEGREE, SPACE, WIDTH

__all__ = ["StepTables", "balance", "build", "completed", "padded"]

Array = NDArray[np.float64]

ORDER = 30  # of the Taylor series before it is economised
ROUND_OFF = 2.0**-53
STRETCHES = 2.0 ** (np.arange(40, 8 * 32 + 1) / 32.0)
"""Steps times the norm of A among which the longest that fits is taken; the first always does."""
_MANY, _LEVELS = 16, 5  # states from which tangents take up to 32 steps at once
LEADING = 8  # inputs grow with the time at first, whatever comes later


class _Room(threading.local):
    """Work space of a thread, kept: fresh memory costs as much as what is done with it."""

    def __init__(self) -> None:
        self.known: dict[str, Array] = {}

    def of(self, name: str, *shape: int) -> Array:
        """An array of this shape with anything in it, until the next of its name."""
        size = prod(shape)
        if size < _SMALL:
            return np.empty(shape)
        if self.known.get(name, _NOTHING).size < size:
            self.known[name] = np.empty(size)
        return self.known[name][:size].reshape(shape)


_SMALL = 10_000  # entries that are had for nothing
_NOTHING = np.empty(0)
_ROOM = _Room()


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
        Power coefficients of M(s), flattened by rows, and M(1), (k, w + 1, n (n+q)). Of
        many states also what it is over 2, 4, 8, … steps.
    generator
        [A, B], (k, n, n+q).
    d_flow
        Derivative of `flow` with respect to a parameter, of its shape, or (k, 0, 0).
    noise
        Largest Bernstein coefficient of each output a unit of each entry of (x, u), (k, m, n+q).
    """

    step: Array
    lines: Array
    flow: Array
    generator: Array
    d_flow: Array
    noise: Array


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
    generator: Array, C: Array, cap: ArrayLike = np.inf, d_generator: Array | None = None
) -> StepTables:
    """Tables of the modes with these generators.

    Parameters
    ----------
    generator
        [A, B] of each mode, (k, n, n+q).
    C
        Outputs y = C x, (m, n), or in each mode y = C (x, u), (k, m, n+q).
    cap
        Longest step allowed, one for all or (k,); infinity leaves it to the series.
    d_generator
        Derivative of the generators with respect to a parameter, (k, n, n+q).
    """
    k, n, width = generator.shape
    m = C.shape[-2]
    convert = _conversions()
    weights = _weights(generator)
    norm = np.max(np.sum((np.abs(generator) * weights)[..., :n], axis=2), axis=1)
    unit = 1.0 / np.where(norm > 0.0, norm, 1.0)
    powers = _powers(generator, d_generator, unit)
    most = np.broadcast_to(np.asarray(cap, dtype=float), (k,))
    step = np.minimum(_stretch(powers[:, :n], weights) * unit, most)
    still = norm == 0.0
    step[still] = np.where(np.isfinite(most), most, 1.0)[still]
    factors = convert.reciprocal * ((step / unit)[:, None] ** np.arange(ORDER, -1, -1))
    outputs = (C[..., :n] @ powers[:, :n].reshape(k, n, -1)).reshape(k, m, ORDER + 1, width)
    if C.ndim == 3:
        outputs[:, :, -1, n:] += C[..., n:]
    both = convert.to_both @ (outputs * factors[:, None, :, None])
    powers *= factors[:, None, :, None]
    economised = _ROOM.of("economised", k, powers.shape[1], WIDTH + 1, width)
    np.matmul(convert.to_power, powers, out=economised[:, :, :WIDTH])
    np.sum(powers, axis=2, out=economised[:, :, WIDTH])  # the smallest terms come first
    flow = _by_coefficient(economised[:, :n])
    d_flow = np.empty((k, 0, 0)) if d_generator is None else _by_coefficient(economised[:, n:])
    if n >= _MANY:
        _fill_doubles(flow, d_flow, n)
    lines = np.zeros((k, padded(width), 2 * m * SPACE + padded(n)))
    lines[:, :width, : 2 * m * SPACE] = np.swapaxes(both.reshape(k, -1, width), 1, 2)
    ends = np.swapaxes(flow[:, WIDTH].reshape(k, n, width), 1, 2)
    lines[:, :width, 2 * m * SPACE : 2 * m * SPACE + n] = ends
    noise = np.max(np.abs(both[:, :, :WIDTH]), axis=2)
    return StepTables(step, lines, flow, np.ascontiguousarray(generator), d_flow, noise)


def completed(tables: StepTables) -> StepTables:
    """Tables, those of many states with what the flow is over 2, 4, 8, … steps as well."""
    n = tables.generator.shape[1]
    if n < _MANY:
        return tables
    room = np.empty((tables.flow.shape[0], _LEVELS, tables.flow.shape[2]))
    flow = np.concatenate((tables.flow, room), axis=1)
    change = tables.d_flow.size > 0
    d_flow = np.concatenate((tables.d_flow, room), axis=1) if change else tables.d_flow
    _fill_doubles(flow, d_flow, n)
    return tables._replace(flow=flow, d_flow=d_flow)


def _by_coefficient(rows: Array) -> Array:
    """Coefficients of the rows of matrices (k, n, w+1, n+q) as (k, w+1, n (n+q)), and room."""
    k, n, count, width = rows.shape
    levels = _LEVELS if n >= _MANY else 0
    found = np.empty((k, count + levels, n * width))
    found[:, :count].reshape(k, count, n, width)[:] = np.swapaxes(rows, 1, 2)
    return found


def _fill_doubles(flow: Array, d_flow: Array, n: int) -> None:
    """Put behind the flow over a step, and its derivative, what they are over 2, 4, 8, … steps."""
    k, _, size = flow.shape
    width = size // n
    whole = np.zeros((k, width, width))  # of (x, u)
    whole[:, np.arange(n, width), np.arange(n, width)] = 1.0
    whole[:, :n] = flow[:, WIDTH].reshape(k, n, width)
    change = d_flow[:, WIDTH : WIDTH + 1].reshape(k, -1, width)
    for row in range(WIDTH + 1, WIDTH + 1 + _LEVELS):
        if change.size:
            change = change @ whole + whole[:, :n, :n] @ change
            d_flow[:, row] = change.reshape(k, size)
        whole[:, :n] = whole[:, :n] @ whole
        flow[:, row] = whole[:, :n].reshape(k, size)


class _Conversions(NamedTuple):
    """What economises Taylor terms j <= ORDER: rows of coefficients, columns of terms.

    The last term comes first, the smallest, as in every sum over them.

    Attributes
    ----------
    to_both
        To Bernstein and to power coefficients, (2 SPACE, ORDER+1), filled up with zeros.
    to_power
        To power coefficients, (WIDTH, ORDER+1).
    reciprocal
        1/j!, (ORDER+1,).
    lost
        What economising and truncating at each of `STRETCHES` lose of a power of unit size, over
        round-off, (ORDER+1, s).
    leading
        `STRETCHES` to the first powers, over their factorials, (LEADING, s).
    """

    to_both: Array
    to_power: Array
    reciprocal: Array
    lost: Array
    leading: Array


@cache
def _conversions() -> _Conversions:
    to_bernstein, to_power, dropped = conversions()
    to_both = np.zeros((2, SPACE, ORDER + 1))
    to_both[0, :WIDTH], to_both[1, :WIDTH] = to_bernstein, to_power
    orders = np.arange(ORDER + 1)
    reciprocal = np.array([1.0 / factorial(j) for j in orders])
    terms = reciprocal[:, None] * STRETCHES ** orders[:, None]
    lost = dropped + 8.0 * (orders == ORDER)
    return _Conversions(
        np.ascontiguousarray(to_both.reshape(2 * SPACE, -1)[:, ::-1]),
        np.ascontiguousarray(to_power[:, ::-1]),
        reciprocal[::-1],
        (lost[:, None] * terms / ROUND_OFF)[::-1],
        terms[:LEADING][::-1],
    )


def _weights(generator: Array) -> Array:
    """What takes the entries of [A, B] to balanced coordinates of the states, (k, n, n+q)."""
    n = generator.shape[1]
    own = np.array([balance(one) for one in generator[..., :n]])[:, :, None]
    weights = np.empty(generator.shape)
    np.divide(1.0, own, out=weights[..., n:])
    np.divide(np.swapaxes(own, 1, 2), own, out=weights[..., :n])
    return weights


def _powers(generator: Array, d_generator: Array | None, unit: Array) -> Array:
    """Powers A^(j-1) [A, B] of generators times `unit`, the last first, (k, r, ORDER+1, n+q).

    They end with [I, 0]. The r rows are those of the states and, behind them, of their derivatives:
    those of [[A, 0], [dA, A]]. Each pass doubles the number of powers.
    """
    k, n, width = generator.shape
    r = n if d_generator is None else 2 * n
    powers = _ROOM.of("powers", k, r, (ORDER + 1) * width)
    powers[:, :, -width:] = np.eye(r, width)
    powers[:, n:, -width:] = 0.0
    first = powers[:, :, -2 * width : -width]
    np.multiply(generator, unit[:, None, None], out=first[:, :n])
    if d_generator is not None:
        np.multiply(d_generator, unit[:, None, None], out=first[:, n:])
    factor, done = np.zeros((k, r, r)), 1
    while done < ORDER:
        after, more = (ORDER - done) * width, min(done, ORDER - done)
        last = powers[:, :, after : after + n]
        factor[:, :, :n] = last
        factor[:, n:, r - n :] = last[:, : r - n]
        known = powers[:, :, -(1 + more) * width : -width]
        found = _ROOM.of("found", k, r, more * width)
        powers[:, :, after - more * width : after] = np.matmul(factor, known, out=found)
        done += more
    return powers.reshape(k, r, ORDER + 1, width)


def _stretch(powers: Array, weights: Array) -> Array:
    """How many units of time the economised series is exact to round-off for, (k,).

    The largest entries count, in balanced coordinates; those of the inputs apart, and in
    proportion to what the inputs make of the states.
    """
    n, convert = powers.shape[1], _conversions()
    scaled = np.abs(powers, out=_ROOM.of("scaled", *powers.shape))
    scaled *= weights[:, :, None]
    sizes = np.max(scaled, axis=1)
    state, inputs = np.max(sizes[..., :n], axis=2), np.max(sizes[..., n:], axis=2, initial=0.0)
    most = np.max(inputs[:, -LEADING:, None] * convert.leading, axis=1)
    fits = (state @ convert.lost <= 1.0) & (inputs @ convert.lost <= most)
    fits[:, 0] = True
    return np.asarray(STRETCHES[STRETCHES.size - 1 - np.argmax(fits[:, ::-1], axis=1)])
