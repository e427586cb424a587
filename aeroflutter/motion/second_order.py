"""The second-order form that Houbolt's scheme works from, read out of a Lur'e system."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from aeroflutter.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from aeroflutter.model.lure import LureSystem

    Array = NDArray[np.float64]

__all__ = ["SecondOrder"]


@dataclass(frozen=True, eq=False)
class SecondOrder:
    """q'' = K q + C q' - Σ g_i J_i - s F(c q), with J_i' = -b_i J_i + λ and λ = d0 q' + d1 q''.

    The equations of motion premultiplied by the inverse of their mass matrix, which changes
    nothing in an implicit scheme. With the downwash w = d0 q + d1 q' and the lag states
    z_i' = -b_i z_i + w of the Lur'e form,

        J_i = w - b_i z_i = w(0) exp(-b_i τ) + ∫₀^τ exp(-b_i (τ - σ)) λ(σ) dσ,

    that is the Duhamel integral I_i of the thesis together with the start of the Wagner
    function, which obeys the same recurrence. A run can therefore go on from any state.

    Attributes
    ----------
    positions, rates, lags
        Where q (d), q' (d) and z (n) sit in the state vector.
    stiffness, damping
        K and C, shape (d, d).
    lag_gain
        g, shape (d, n).
    lag_rate
        b, shape (n,).
    d0, d1
        Rows of the downwash, shape (d,).
    push
        s, shape (d,).
    c
        Row that picks the nonlinear coordinate, shape (d,).
    """

    positions: NDArray[np.intp]
    rates: NDArray[np.intp]
    lags: NDArray[np.intp]
    stiffness: Array
    damping: Array
    lag_gain: Array
    lag_rate: Array
    d0: Array
    d1: Array
    push: Array
    c: Array

    @classmethod
    def of(cls, system: LureSystem) -> SecondOrder:
        """Recognise displacements, rates and lag states in a Lur'e system.

        Raises
        ------
        InputError
            If the system has no such form: another engine can then take it.
        """
        A, b, c = (np.asarray(part, dtype=float) for part in (system.A, system.b, system.c))
        positions, rates = _chains(A, b)
        taken = {*positions.tolist(), *rates.tolist()}
        lags = np.array([i for i in range(b.size) if i not in taken], dtype=np.intp)
        problem = _problem(A, b, c, positions, rates, lags)
        if problem:
            raise InputError(
                f"engine: houbolt needs displacements, their rates and lag states ({problem}); "
                "use engine exact"
            )
        lag_rate = -A[lags, lags]
        gain = A[np.ix_(rates, lags)] / lag_rate
        row = A[lags[0]] if lags.size else np.zeros(b.size)
        d0, d1 = row[positions], row[rates]
        total = gain.sum(axis=1)
        return cls(
            positions=positions,
            rates=rates,
            lags=lags,
            stiffness=A[np.ix_(rates, positions)] + np.outer(total, d0),
            damping=A[np.ix_(rates, rates)] + np.outer(total, d1),
            lag_gain=gain,
            lag_rate=lag_rate,
            d0=d0,
            d1=d1,
            push=b[rates],
            c=c[positions],
        )

    @cached_property
    def to_duhamel(self) -> Array:
        """J from a state, shape (n, n_states)."""
        out = np.zeros((self.lags.size, self.positions.size + self.rates.size + self.lags.size))
        out[:, self.positions] = self.d0
        out[:, self.rates] = self.d1
        out[np.arange(self.lags.size), self.lags] = -self.lag_rate
        return out

    @cached_property
    def to_state(self) -> Array:
        """A state from (q, q', J), shape (n_states, n_states)."""
        d, n = self.positions.size, self.lags.size
        out = np.zeros((2 * d + n, 2 * d + n))
        out[self.positions, np.arange(d)] = 1.0
        out[self.rates, d + np.arange(d)] = 1.0
        out[self.lags, : 2 * d] = np.concatenate((self.d0, self.d1)) / self.lag_rate[:, None]
        out[self.lags, 2 * d + np.arange(n)] = -1.0 / self.lag_rate
        return out

    def duhamel(self, state: Array) -> Array:
        """J (…, n) of states (…, n_states)."""
        return np.asarray(state @ self.to_duhamel.T)

    def state(self, q: Array, v: Array, J: Array) -> Array:
        """States (…, n_states) from displacements, rates (…, d) and J (…, n)."""
        return np.asarray(np.concatenate((q, v, J), axis=-1) @ self.to_state.T)


def _chains(A: Array, b: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """States whose derivative is just another state, and those others."""
    positions, rates = [], []
    for i, row in enumerate(A):
        entries = np.flatnonzero(row)
        if entries.size == 1 and entries[0] != i and row[entries[0]] == 1.0 and b[i] == 0.0:
            positions.append(i)
            rates.append(int(entries[0]))
    return np.array(positions, dtype=np.intp), np.array(rates, dtype=np.intp)


def _problem(
    A: Array,
    b: Array,
    c: Array,
    positions: NDArray[np.intp],
    rates: NDArray[np.intp],
    lags: NDArray[np.intp],
) -> str:
    """What keeps the system from the form; empty if nothing does."""
    if positions.size == 0:
        return "no state is the derivative of another"
    if len({*positions.tolist(), *rates.tolist()}) < 2 * positions.size:
        return "displacements and rates do not pair off"
    if np.any(c[rates]) or np.any(c[lags]):
        return "the nonlinear coordinate is not a displacement"
    if np.any(b[lags]):
        return "the spring acts on a lag state"
    between = A[np.ix_(lags, lags)]
    if np.any(between - np.diag(np.diag(between))):
        return "lag states drive one another"
    if np.any(np.diag(between) >= 0.0):
        return "a lag state does not decay"
    drive = np.delete(A[lags], lags, axis=1)
    if np.any(np.abs(drive - drive[:1]) > 1e-9 * np.abs(drive)):
        return "lag states are driven by different downwashes"
    return ""
