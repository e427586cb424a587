"""Every cycle at given amplitudes: the search on which the completeness of the curves rests.

At an amplitude, every bias that balances the mean is found at every speed of a grid; with the
describing function of each, the eigenvalues of A - N b c show by a change of sign of their real
part where they cross the imaginary axis. Crossings are then polished by Newton's method. A
complex N belongs to the eigenvalues with positive imaginary part only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aeroflutter.model.lure import LureFamily, inverse_transfer
from aeroflutter.orbits.describing.balance import AMPLITUDE, FREQUENCY, SPEED, Balance
from aeroflutter.orbits.describing.coalescence import Coalescence
from aeroflutter.orbits.describing.secular import closed_roots

__all__ = ["Paths", "candidates", "distinct", "scan", "static_paths"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Index = NDArray[np.intp]

_ZERO = 1e-12  # mean balance, in units of the spring's scale, that counts as zero
_MANY = 16  # states, from which roots of many N at a speed are cheaper found together
_REPAYS = 4  # N a speed, likewise
_SAME = 1e-7  # distance in the unknowns below which two cycles are one


@dataclass(frozen=True, eq=False)
class Paths:
    """Points (A, B, U) in which the mean balances, and which of them are neighbours in speed."""

    amplitude: Array
    bias: Array
    speed: Array
    successor: Index
    """Index of the same path's point at the next speed of the grid; -1 where it ends."""

    def closed_eigenvalues(self, balance: Balance) -> Complex:
        """Eigenvalues of A - N b c at every point, shape (m, n)."""
        d = balance.spring.describing(self.amplitude, self.bias)
        return closed_eigenvalues(balance.family, self.speed, d.n_p, d.n_q)


def closed_eigenvalues(family: LureFamily, speed: Array, n_p: Array, n_q: Array) -> Complex:
    """Eigenvalues of A - N b c, shape (m, n); real arithmetic where N is real."""
    if np.any(n_q) and family.c.size >= _MANY and speed.size:
        own, group = np.unique(speed, return_inverse=True)
        if speed.size >= _REPAYS * own.size:
            return closed_roots(*family.stack(own), family.c, group, n_p + 1j * n_q)
    A, b = family.stack(speed)
    N = n_p + 1j * n_q if np.any(n_q) else n_p
    closed = A - N[:, None, None] * b[:, :, None] * family.c
    return np.asarray(np.linalg.eigvals(closed), dtype=complex)


def scan(balance: Balance, amplitudes: Array, speeds: Array) -> Array:
    """Every cycle at the given amplitudes within a grid of speeds.

    Parameters
    ----------
    balance
        The equations.
    amplitudes, speeds
        Amplitudes (radians) and ascending speeds U*, shapes (m,) and (n,).

    Returns
    -------
    array (cycles, 4)
        Unknowns of every cycle, in the order of amplitudes.
    """
    paths = static_paths(balance, np.atleast_1d(amplitudes), speeds)
    if isinstance(balance, Coalescence):
        guesses = balance.guesses(paths.amplitude, paths.bias, speeds)
    else:
        guesses = _crossings(balance, paths)
    return polish(balance, guesses, speeds) if len(guesses) else guesses


def _crossings(balance: Balance, paths: Paths) -> Array:
    """Guesses (m, 4) of the cycles on paths of balanced mean."""
    guesses = [
        balance.pack(
            paths.amplitude[i],
            (1 - t) * paths.bias[i] + t * paths.bias[j],
            paths.speed[i] ** (1 - t) * paths.speed[j] ** t,
            k,
        )
        for i, j, t, k in candidates(paths.closed_eigenvalues(balance), paths.successor)
    ]
    return np.concatenate([np.empty((0, 4)), *guesses])


def polish(balance: Balance, guesses: Array, speeds: Array) -> Array:
    """Distinct cycles to which guesses lead at their own amplitude, within the range of speeds."""
    found, converged = balance.solve(guesses, np.eye(4)[AMPLITUDE])
    room = 1e-9
    inside = (found[:, SPEED] >= np.log(speeds[0]) - room) & (
        found[:, SPEED] <= np.log(speeds[-1]) + room
    )
    near = np.abs(found[:, FREQUENCY] - guesses[:, FREQUENCY]) < 3.0
    return np.asarray(found[distinct(found, converged & inside & near)])


def distinct(y: Array, among: NDArray[np.bool_]) -> Index:
    """Indices of the cycles (m, 4) chosen by `among`, without repetition, by amplitude."""
    kept: list[int] = []
    for i in np.lexsort(y.T[::-1]):
        if among[i] and all(np.max(np.abs(y[i] - y[j])) > _SAME for j in kept[-64:]):
            kept.append(int(i))
    return np.array(kept, dtype=np.intp)


def candidates(roots: Complex, successor: Index) -> list[tuple[Index, Index, Array, Array]]:
    """Where eigenvalues may cross the imaginary axis between neighbours.

    Pairs of nearest eigenvalues are taken both ways, which proposes a crossing twice rather than
    missing it; the polish removes what is superfluous. So do roots that come near the axis and
    turn back: they may have crossed it twice.

    Returns
    -------
    list of (from, to, fraction, frequency)
        Arrays of indices of neighbours, how far between them, and the guess of k.
    """
    here = np.flatnonzero(successor >= 0)
    there = successor[here]
    first, second = roots[here], roots[there]
    distance = np.abs(first[:, :, None] - second[:, None, :])
    ahead = np.take_along_axis(second, np.argmin(distance, axis=2), 1)
    behind = np.take_along_axis(first, np.argmin(distance, axis=1), 1)
    found = [_crossing(here, there, first, ahead), _crossing(here, there, behind, second)]
    before, after = np.full(roots.shape, np.nan + 0j), np.full(roots.shape, np.nan + 0j)
    before[there], after[here] = behind, ahead
    return found + _touches(before, roots, after, successor)


def _upper(*roots: Complex) -> NDArray[np.bool_]:
    """Where all of the roots are clear of the real axis, above it."""
    floor = 1e-9 * np.max(np.abs(roots[0]), axis=1, keepdims=True)
    return np.asarray(np.all([root.imag > floor for root in roots], axis=0))


def _crossing(
    here: Index, there: Index, a: Complex, b: Complex
) -> tuple[Index, Index, Array, Array]:
    rows, columns = np.nonzero(_upper(a, b) & ((a.real > 0) != (b.real > 0)))
    p, q = a[rows, columns], b[rows, columns]
    t = p.real / (p.real - q.real)
    return here[rows], there[rows], t, (1 - t) * p.imag + t * q.imag


def _touches(
    before: Complex, roots: Complex, after: Complex, successor: Index
) -> list[tuple[Index, Index, Array, Array]]:
    """Roots at the turn of their real part, where the turn may lie beyond the axis."""
    with np.errstate(invalid="ignore"):
        side = np.sign(roots.real)
        depth = side * roots.real
        a, c = side * before.real - depth, side * after.real - depth
        turns = (a >= 0) & (c >= 0) & (a < 4 * c) & (c < 4 * a)
        close = depth < 0.5 * (a + c)
        rows, columns = np.nonzero(_upper(roots, before, after) & turns & close)
    k = roots[rows, columns].imag
    return [(rows, successor[rows], np.full(rows.size, t), k) for t in (-0.5, 0.5)]


# --- the mean balance ----------------------------------------------------------------------------


def static_paths(balance: Balance, amplitudes: Array, speeds: Array) -> Paths:
    """Every bias that balances the mean, at every amplitude and speed."""
    m, n = amplitudes.size, speeds.size
    if not balance.biased:
        index = np.arange(m * n)
        last = index % n == n - 1
        grid_A, grid_U = np.meshgrid(amplitudes, speeds, indexing="ij")
        return Paths(grid_A.ravel(), np.zeros(m * n), grid_U.ravel(), np.where(last, -1, index + 1))
    A, b = balance.family.stack(speeds)
    load = np.asarray(inverse_transfer(A, b, balance.family.c, np.zeros(n)).real)
    rows, bias = _static_roots(balance, amplitudes, load)
    row_A, row_U = np.divmod(rows, n)
    return Paths(amplitudes[row_A], bias, speeds[row_U], _successors(row_A, row_U, bias))


def _static_roots(balance: Balance, amplitudes: Array, load: Array) -> tuple[Index, Array]:
    """Roots B of load·B + F₀(A, B), as (row of the A × U grid, B), ordered by row and B."""
    biases = _bias_grid(balance, amplitudes)
    F0 = balance.spring.describing(amplitudes[:, None], biases).F0
    value = (load[None, :, None] * biases[:, None, :] + F0[:, None, :]) / balance.spring.scale
    sign = np.where(np.abs(value) < _ZERO, 0, np.sign(value)).reshape(-1, biases.shape[1])
    grid = np.repeat(biases, load.size, axis=0)
    flat_value = value.reshape(sign.shape)
    rows, i = np.nonzero(sign[:, :-1] * sign[:, 1:] < 0)
    t = flat_value[rows, i] / (flat_value[rows, i] - flat_value[rows, i + 1])
    simple = (1 - t) * grid[rows, i] + t * grid[rows, i + 1]
    zero = np.pad(sign == 0, ((0, 0), (1, 1)))
    starts = np.nonzero(zero[:, 1:-1] & ~zero[:, :-2])
    ends = np.nonzero(zero[:, 1:-1] & ~zero[:, 2:])
    middle = 0.5 * (grid[starts] + grid[ends])
    all_rows, all_bias = np.concatenate((rows, starts[0])), np.concatenate((simple, middle))
    if balance.spring.odd:  # B = 0 is the unbiased problem's, and B < 0 its mirror image
        keep = all_bias > 1e-6 * balance.spring.scale
        all_rows, all_bias = all_rows[keep], all_bias[keep]
    order = np.lexsort((all_bias, all_rows))
    return all_rows[order], all_bias[order]


def _bias_grid(balance: Balance, amplitudes: Array) -> Array:
    """Biases to search at each amplitude, shape (m, n): dense where the motion meets the span."""
    low, high = balance.spring.span()
    centre, half = (low + high) / 2, (high - low) / 2
    inner = np.linspace(-1.0, 1.0, 121)
    outer = np.geomspace(1.0, 12.0, 25)[1:]
    steps = np.concatenate((-outer[::-1], inner, outer))
    reach = np.maximum(half, balance.spring.scale) + amplitudes
    return np.asarray(centre + reach[:, None] * steps)


def _successors(row_A: Index, row_U: Index, bias: Array) -> Index:
    """For each static root the nearest one at the next speed of the same amplitude."""
    successor = np.full(bias.size, -1)
    key = row_A * (row_U.max(initial=0) + 2) + row_U
    for i in range(bias.size):
        low, high = np.searchsorted(key, [key[i] + 1, key[i] + 2])
        if high > low:
            successor[i] = low + np.argmin(np.abs(bias[low:high] - bias[i]))
    return successor
