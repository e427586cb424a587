"""Step tables of a family at any speed, by interpolation where that is as good as making them.

Walking along a branch needs tables at a thousand speeds. Over a little stretch of speed a table
is a smooth function of it, entire where the matrices are polynomials in the speed or its inverse:
the polynomial through Chebyshev's points gives it to round-off. Each stretch is tried between the
points before it is used, so a family that is not smooth there gets its tables made speed by speed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeroflutter.motion._kernel_roots import WIDTH
from aeroflutter.motion.step_tables import StepTables, balance, build, completed

__all__ = ["Atlas"]

Array = NDArray[np.float64]
Made = Callable[[float], tuple[Array, Array]]

STRETCH = 0.02  # of the logarithm of the speed
NODES = 10
TRIED = 0.35, -0.97  # places in a stretch, on [-1, 1]
ERROR = 64 * 2.0**-53  # of a table, over its largest entry in balanced coordinates
REPAYS = 6  # speeds within a stretch from which its nodes repay
LARGEST = 2_000_000  # numbers in a stretch
KEPT = 32  # stretches
ATTEMPTS = 3  # at a step that fits all nodes

_PLACES = np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)
_WEIGHTS = (-1.0) ** np.arange(NODES) * np.sin(np.pi * (np.arange(NODES) + 0.5) / NODES)


class _Stretch(NamedTuple):
    """Tables at the nodes of a stretch, an array of NODES rows for each interpolated field.

    Attributes
    ----------
    step, noise
        The same for all of the stretch.
    lines, flow, d_flow
        (NODES, size), and shapes of one table.
    """

    step: Array
    noise: Array
    fields: tuple[Array, ...]
    shapes: tuple[tuple[int, ...], ...]

    def at(self, place: float, generator: Array) -> StepTables:
        """The tables at a place on [-1, 1]."""
        away = place - _PLACES
        on = np.flatnonzero(away == 0.0)
        share = np.zeros(NODES)
        if on.size:
            share[on[0]] = 1.0
        else:
            share[:] = _WEIGHTS / away
            share /= share.sum()
        lines, flow, d_flow = (
            (share @ field).reshape(shape)
            for field, shape in zip(self.fields, self.shapes, strict=True)
        )
        return completed(StepTables(self.step, lines, flow, generator, d_flow, self.noise))


class Atlas:
    """Tables of the modes of a family at any speed.

    Parameters
    ----------
    made
        Gives the generators of all modes at a speed, and their derivatives with respect to it,
        (k, n, n+q) each.
    C
        Outputs, (m, n), the same at all speeds.
    """

    def __init__(self, made: Made, C: Array) -> None:
        self._made, self._C = made, C
        self._asked: dict[int, int] = {}
        self._known: dict[int, _Stretch | None] = {}

    def tables(self, speed: float, generator: Array, change: Array) -> StepTables:
        """Tables at a speed, where the generators and their derivatives are these."""
        if speed > 0.0:
            number, place = divmod(np.log(speed) / STRETCH, 1.0)
            known = self._stretch(int(number))
            if known is not None:
                return known.at(2.0 * place - 1.0, np.ascontiguousarray(generator))
        return build(generator, self._C, d_generator=change)

    def _stretch(self, number: int) -> _Stretch | None:
        if number not in self._known:
            self._asked[number] = asked = self._asked.get(number, 0) + 1
            if asked < REPAYS:
                return None
            if len(self._known) >= KEPT:
                self._known.pop(next(iter(self._known)))
            self._known[number] = self._survey(number)
        return self._known[number]

    def _survey(self, number: int) -> _Stretch | None:
        """The nodes of a stretch; None where interpolation is worse than round-off."""
        places = np.concatenate((_PLACES, TRIED))
        speeds = np.exp((number + 0.5 * (places + 1.0)) * STRETCH)
        found = [self._made(float(speed)) for speed in speeds]
        k, n, width = found[0][0].shape
        if NODES * k * n * width * 2 * WIDTH > LARGEST:
            return None
        generators = np.concatenate([one for one, _ in found])
        changes = np.concatenate([change for _, change in found])
        if not (np.all(np.isfinite(generators)) and np.all(np.isfinite(changes))):
            return None
        ends = build(np.concatenate((found[0][0], found[NODES - 1][0])), self._C)
        step = np.min(ends.step.reshape(-1, k), axis=0)
        for _ in range(ATTEMPTS):
            whole = build(generators, self._C, np.tile(step, len(places)), changes)
            longest, step = step, np.min(whole.step.reshape(-1, k), axis=0)
            if np.array_equal(longest, step):
                break
        else:
            return None
        parts = [
            np.ascontiguousarray(part.reshape(len(places), k, *part.shape[1:]))
            for part in (whole.lines, whole.flow[:, : WIDTH + 1], whole.d_flow[:, : WIDTH + 1])
        ]
        nodes = _Stretch(
            step,
            np.max(whole.noise.reshape(-1, k, *whole.noise.shape[1:]), axis=0),
            tuple(part[:NODES].reshape(NODES, -1) for part in parts),
            tuple(part.shape[1:] for part in parts),
        )
        for i, place in enumerate(TRIED, start=NODES):
            made = nodes.at(place, found[i][0])
            for got, part in ((made.flow, parts[1]), (made.d_flow, parts[2])):
                if not _alike(got[:, : WIDTH + 1], part[i], found[i][0]):
                    return None
        return nodes


def _alike(got: Array, wanted: Array, generators: Array) -> bool:
    """Whether two tables differ by no more than round-off, in balanced coordinates of each mode."""
    n = generators.shape[1]
    for one, other, generator in zip(got, wanted, generators, strict=True):
        own = balance(generator[:, :n])
        weights = np.ones(generator.shape) / own[:, None]
        weights[:, :n] *= own
        difference = np.abs(one - other).reshape(len(one), n, -1) * weights
        size = np.abs(other).reshape(len(one), n, -1) * weights
        if np.any(np.max(difference, axis=0) > ERROR * np.max(size)):
            return False
    return True
