"""Springs by the coordinates in which they act: those that share one answer to one motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeroflutter.errors import InputError
from aeroflutter.model.family import Family
from aeroflutter.orbits.harmonic.moment import Answer
from aeroflutter.springs import Spring

__all__ = ["Channel", "Together", "channels_of"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


class Channel(NamedTuple):
    """Springs in one coordinate.

    Attributes
    ----------
    springs
        Their places among all springs; the first stands for the channel in B and C.
    weights
        What a unit of each is worth over one of the first.
    """

    springs: tuple[int, ...]
    weights: tuple[float, ...]


def channels_of(family: Family, springs: Sequence[Spring]) -> tuple[Channel, ...]:
    """The channels of a family, one a distinct row of C.

    Raises
    ------
    InputError
        If the springs are not as many as the outputs, there is a constant load, or two springs on
        one row of C do not push alike: then no inverse of G exists.
    """
    _, B, C, d = family.stack(family.search_range[1])
    if len(springs) != C.shape[0]:
        raise InputError(f"springs: {len(springs)} for a family with {C.shape[0]} outputs")
    if np.any(d):
        raise InputError("family: has a constant load, which the harmonic balance does not take")
    found: list[tuple[list[int], list[float]]] = []
    for i in range(len(springs)):
        for members, weights in found:
            first = members[0]
            if np.array_equal(C[first], C[i]):
                weight = float(B[:, first] @ B[:, i] / (B[:, first] @ B[:, first]))
                if np.max(np.abs(B[:, i] - weight * B[:, first])) > 1e-12 * np.max(np.abs(B)):
                    raise InputError(
                        f"springs: those of outputs {first + 1} and {i + 1} share a coordinate "
                        "and push in different directions"
                    )
                members.append(i)
                weights.append(weight)
                break
        else:
            found.append(([i], [1.0]))
    return tuple(Channel(tuple(members), tuple(weights)) for members, weights in found)


@dataclass(frozen=True, eq=False)
class Together(Answer):
    """What several springs in one coordinate answer to its motion."""

    Y: Complex
    parts: tuple[Answer, ...]
    weights: tuple[float, ...]

    @property
    def margin(self) -> float:  # type: ignore[override]
        """That of the spring nearest to a change."""
        return min(part.margin for part in self.parts)

    @property
    def sequence(self) -> tuple[int, ...]:  # type: ignore[override]
        """One after the other."""
        return sum((part.sequence for part in self.parts), ())

    @property
    def straight(self) -> bool:  # type: ignore[override]
        """Whether all of them are."""
        return all(part.straight for part in self.parts)

    @property
    def extremes(self) -> tuple[float, float]:
        """They have the motion in common."""
        return self.parts[0].extremes

    def moment(self, count: int) -> Complex:
        """The sum of their harmonics."""
        return np.asarray(self._sum([part.moment(count) for part in self.parts]))

    def slope(self, count: int) -> Complex:
        """The sum of their slopes."""
        return np.asarray(self._sum([part.slope(count) for part in self.parts]))

    def stiffness(self, ks: NDArray[np.intp]) -> Complex:
        """The sum of their stiffnesses."""
        return np.asarray(self._sum([part.stiffness(ks) for part in self.parts]))

    def derivative(self, ks: NDArray[np.intp]) -> Real:
        """The sum of their derivatives."""
        return np.asarray(self._sum([part.derivative(ks) for part in self.parts]))

    def _sum(self, values: list[Any]) -> Any:
        return np.tensordot(self.weights, np.array(values), axes=1)
