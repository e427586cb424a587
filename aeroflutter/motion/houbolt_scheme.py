"""Houbolt's scheme as a linear recurrence, with its own eigenvalues and flutter speed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from aeroflutter.errors import ConvergenceError
from aeroflutter.generated.houbolt import ACCELERATION, DUHAMEL, VELOCITY
from aeroflutter.motion._kernel_houbolt import Recurrence
from aeroflutter.motion.second_order import SecondOrder

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from aeroflutter.model.lure import LureFamily, LureSystem

    Array = NDArray[np.float64]

__all__ = ["Scheme", "flutter_speed"]


@dataclass(frozen=True, eq=False)
class Scheme:
    """Houbolt's scheme for one system and one step.

    Attributes
    ----------
    form
        The second-order form of the system.
    dt
        Step Δτ.
    step
        The recurrence for the compiled loop.
    """

    form: SecondOrder
    dt: float
    step: Recurrence

    @classmethod
    def build(cls, system: LureSystem, dt: float, frozen: bool = False) -> Scheme:
        """Assemble the recurrence.

        Parameters
        ----------
        system
            Lur'e system with displacements, rates and lag states.
        dt
            Step Δτ.
        frozen
            Take the moment at the old pitch instead, which costs an order of accuracy.

        Raises
        ------
        InputError
            If the system has no second-order form.
        """
        form = SecondOrder.of(system)
        d, n = form.c.size, max(form.lag_rate.size, 1)
        gain, rate = np.zeros((d, n)), np.zeros(n)
        gain[:, : form.lag_rate.size] = form.lag_gain
        rate[: form.lag_rate.size] = form.lag_rate
        decay = np.exp(-rate * dt)
        old = dt * DUHAMEL[:3] * decay[:, None] ** np.array([3, 2, 1])
        newest = dt * DUHAMEL[3]
        weights = np.column_stack((old, np.full(n, newest)))

        eye = np.eye(d)
        v_old = np.kron(VELOCITY[:3] / dt, eye)
        a_old = np.kron(ACCELERATION[:3] / dt**2, eye)
        l_new = form.d0 * VELOCITY[3] / dt + form.d1 * ACCELERATION[3] / dt**2
        l_old = form.d0 @ v_old + form.d1 @ a_old
        total = gain.sum(axis=1) * newest
        matrix = (
            ACCELERATION[3] / dt**2 * eye
            - VELOCITY[3] / dt * form.damping
            - form.stiffness
            + np.outer(total, l_new)
        )
        answer = np.linalg.inv(matrix)
        q_f = -answer @ form.push
        return cls(
            form=form,
            dt=dt,
            step=Recurrence(
                q_q=_row(answer @ (form.damping @ v_old - a_old - np.outer(total, l_old))),
                q_l=_row(-answer @ gain @ old),
                q_j=_row(-answer @ (gain * decay)),
                q_f=_row(q_f),
                l_new=_row(l_new),
                l_old=_row(l_old),
                j_j=_row(decay),
                j_l=_row(weights),
                c=_row(form.c),
                y_f=float(-form.c @ q_f),
                frozen=frozen,
            ),
        )

    @cached_property
    def decay(self) -> Array:
        """New Duhamel integrals from themselves, (n,)."""
        return np.array(self.step.j_j)

    @cached_property
    def weights(self) -> Array:
        """New Duhamel integrals from four λ, oldest first, (n, 4)."""
        return np.reshape(self.step.j_l, (-1, 4))

    def companion(self, stiffness: float = 1.0) -> Array:
        """One-step matrix with a linear spring, acting on [q(n-2) … q(n), λ(n-2) … λ(n), J(n)].

        Its eigenvalues are exp(p Δτ) of the scheme's own modes, besides parasitic ones.
        """
        step, d, n = self.step, len(self.step.c), len(self.step.j_j)
        size = 3 * d + 3 + n
        free = np.hstack([np.reshape(block, (d, -1)) for block in (step.q_q, step.q_l, step.q_j)])
        closed = np.eye(d) - stiffness * np.outer(step.q_f, step.c)
        T = np.zeros((size, size))
        T[: 2 * d, d : 3 * d] = np.eye(2 * d)
        T[2 * d : 3 * d] = np.linalg.solve(closed, free)
        T[3 * d, 3 * d + 1] = T[3 * d + 1, 3 * d + 2] = 1.0
        T[3 * d + 2] = np.array(step.l_new) @ T[2 * d : 3 * d]
        T[3 * d + 2, : 3 * d] += step.l_old
        T[3 * d + 3 :] = np.outer(self.weights[:, 3], T[3 * d + 2])
        T[3 * d + 3 :, 3 * d : 3 * d + 3] += self.weights[:, :3]
        T[3 * d + 3 :, 3 * d + 3 :] += np.diag(self.decay)
        return T


def _row(values: Array) -> tuple[float, ...]:
    return tuple(float(value) for value in np.ravel(values))


def flutter_speed(family: LureFamily, dt: float, stiffness: float = 1.0) -> float:
    """Linear flutter speed of the scheme itself, from the spectral radius of its one-step matrix.

    Parameters
    ----------
    family
        The linear model at every speed.
    dt
        Step Δτ.
    stiffness
        Slope of the linear spring.

    Returns
    -------
    float
        Speed at which the largest oscillatory eigenvalue crosses the unit circle, sought around
        the flutter speed of the model.

    Raises
    ------
    ConvergenceError
        If the model does not flutter, or there is no crossing within 20 % of its flutter speed.
    """
    from scipy.optimize import brentq

    from aeroflutter.linear.rootlocus import flutter_speed as exact_flutter_speed

    def excess(speed: float) -> float:
        values = np.linalg.eigvals(Scheme.build(family.at(speed), dt).companion(stiffness))
        turning = values[np.abs(values.imag) > 1e-9]
        return float(np.max(np.abs(turning), initial=0.0)) - 1.0

    exact = exact_flutter_speed(family, stiffness)
    if exact is None:
        raise ConvergenceError("houbolt: the model has no flutter speed in its search range")
    low, high = 0.8 * exact, 1.2 * exact
    if excess(low) * excess(high) > 0.0:
        raise ConvergenceError(
            f"houbolt: no flutter speed within 20 % of {exact:g} at dt = {dt:g}; take a smaller dt"
        )
    return float(brentq(excess, low, high, xtol=1e-12, rtol=1e-14))
