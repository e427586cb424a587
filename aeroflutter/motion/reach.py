"""How far from an attracting cycle its return map was seen to contract.

Near a fold an unstable cycle lies beside the stable one, along the direction that decays slowest,
and a few returns of a motion may look like an approach on either side of it. So the return map of
such a cycle is tried on that direction: the reach is where its difference from the linear map is
still less than half of what the linear map contracts by.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from aeroflutter.motion._kernel_ends import NEAR, Cycles
from aeroflutter.motion._kernel_flow import AT_SWITCH, AT_TURN, LAST, STOPPED, TREND
from aeroflutter.motion._kernel_roots import ABOVE
from aeroflutter.motion.march import March

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from aeroflutter.motion.flow import Flow

    Array = NDArray[np.float64]

__all__ = ["SLOW", "contracts_within", "next_gate", "next_maxima", "reach_of"]

SLOW = 0.8  # largest multiplier below which nothing is near enough to matter
HALF = 0.5  # of what the linear map contracts by
TRIALS = 16
MOST = 64  # stops of a march to a return, a loop


def reach_of(flow: Flow, cycles: Cycles, j: int) -> float:
    """Reach of cycle j on the section of maxima."""
    if not cycles.radius[j] > SLOW or cycles.free[j]:
        return np.inf
    z, size, loops = cycles.z[j], cycles.size[j], int(cycles.loops[j])

    def back(d: Array) -> Array | None:
        end = next_maxima(flow, z + size * d, loops)
        return None if end is None else np.asarray((end - z) / size)

    return contracts_within(cycles.Q[j], cycles.P[j], float(cycles.rho[j]), back)


def contracts_within(
    Q: Array, P: Array, rho: float, back: Callable[[Array], Array | None]
) -> float:
    """Length, in the norm of P, up to which the return map contracts along its slowest direction.

    Parameters
    ----------
    Q, P, rho
        The linear map, and the norm in which it contracts by ρ.
    back
        The return map: from a distance d to the next one; None where there is no return.
    """
    values, vectors = np.linalg.eig(Q)
    lead = int(np.argmax(np.abs(values)))
    v = vectors[:, lead] * np.exp(
        -1j * np.angle(vectors[np.argmax(np.abs(vectors[:, lead])), lead])
    )
    parts = [v.real] if values[lead].imag == 0.0 else [v.real, v.imag]
    ways = [sign * part / np.sqrt(part @ P @ part) for part in parts for sign in (1.0, -1.0)]
    r = NEAR / max(float(np.abs(way).max()) for way in ways)
    for _ in range(TRIALS):
        worst = max(_off(back(r * way), r * (Q @ way), P) for way in ways) / r
        if worst <= HALF * (1.0 - rho):
            return float(r)
        r *= min(0.5, max(0.8 * HALF * (1.0 - rho) / worst, 0.01))
    return 0.0


def _off(end: Array | None, linear: Array, P: Array) -> float:
    """Distance of a return from where the linear map puts it."""
    return np.inf if end is None else float(np.sqrt((end - linear) @ P @ (end - linear)))


def next_maxima(flow: Flow, z: Array, count: int) -> Array | None:
    """(x, h) at so many maxima of the first output after one; None if there are none."""
    march = March(flow, flow.begin(z[: flow.n], z[flow.n :]))
    for _ in range(MOST * count):
        if march.run(np.inf, most=MOST * MOST, stop=AT_TURN) != STOPPED:
            return None
        count -= march.motion.memo[TREND] < 0
        if count == 0:
            point = march.point()
            return np.append(point.x, point.memory)
    return None


def next_gate(flow: Flow, x: Array, memory: Array, count: int, least: float) -> Array | None:
    """State at so many returns to the top switch, upwards; those before `least` do not count."""
    gate = flow.pieces[0].modes - 2
    march = March(flow, flow.begin(x, memory))
    for _ in range(MOST * (count + 1)):
        mode = int(march.motion.modes[0])
        if march.run(np.inf, most=MOST * MOST, stop=AT_SWITCH) != STOPPED:
            return None
        returned = mode == gate and march.motion.memo[LAST] == ABOVE and march.time > least
        count -= returned
        if count == 0:
            return march.point().x
    return None
