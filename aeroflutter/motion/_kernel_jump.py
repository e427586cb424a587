"""Compiled jump of tangents where F jumps: the saltation matrix."""

from __future__ import annotations

from aeroflutter.kernels import kernel
from aeroflutter.kernels.arrays import Real1
from aeroflutter.motion._kernel_carry import follow_y
from aeroflutter.motion._kernel_flow import (
    BEFORE,
    JUMPED,
    NOW,
    TABLE,
    Motion,
    System,
    output,
)


@kernel(inner=True, bare=True)
def rate(system: System, motion: Motion, p: int, inputs: Real1, row: int) -> None:
    """x' of table p with these inputs where the motion stands, into a row of `rates`."""
    n, now = system.C.shape[1], motion.memo[NOW]
    for j in range(inputs.size):
        motion.xs[now, n + j] = inputs[j]
    for i in range(n):
        motion.rates[row, i] = output(system.generator[p], i, motion.xs, now)


@kernel(inner=True, bare=True)
def before(system: System, motion: Motion) -> None:
    """x' before the jump, into the first row of `rates`."""
    first = 0
    rate(system, motion, motion.memo[BEFORE], motion.was, first)


@kernel(inner=True, bare=True)
def jump(system: System, motion: Motion) -> None:
    """Tangents over a jump of F, now that the mode after it is known.

    δx ← δx + (f⁺ - f⁻) r δx / (r f⁻), r being the output that F jumped on: the neighbour jumps
    sooner or later by that much.
    """
    spring, tangents, second = motion.memo[JUMPED] - 1, motion.tangents, 1
    n = system.C.shape[1]
    before(system, motion)
    rate(system, motion, motion.memo[TABLE], motion.inputs, second)
    motion.memo[JUMPED] = 0
    across = output(system.C, spring, motion.rates, 0)
    if across == 0.0:
        return
    follow_y(system.C, spring, tangents)
    late = tangents[n + spring]
    if motion.dM.size:
        late[late.size - 1] += output(system.d_C, spring, motion.xs, motion.memo[NOW])
    for i in range(n):
        change = (motion.rates[1, i] - motion.rates[0, i]) / across
        for k in range(late.size):
            tangents[i, k] += change * late[k]
    late[:] = 0.0
