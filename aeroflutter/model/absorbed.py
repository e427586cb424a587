"""Families whose linear springs are part of their systems: what is left is what is nonlinear."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from aeroflutter.model.family import Family, Matrices
from aeroflutter.model.lure import AnyFamily, as_family
from aeroflutter.model.section import Scale
from aeroflutter.model.system import System

if TYPE_CHECKING:
    from aeroflutter.springs import Spring

__all__ = ["reduced"]


@dataclass(frozen=True, eq=False)
class _Absorbed:
    """A family some of whose springs are linear, and part of its systems."""

    family: Family
    linear: Mapping[int, float]

    @property
    def _kept(self) -> list[int]:
        return [i for i in range(len(self.family.names)) if i not in self.linear]

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.family.names[i] for i in self._kept)

    @property
    def units(self) -> tuple[str, ...]:
        return tuple(self.family.units[i] for i in self._kept)

    @property
    def state_names(self) -> tuple[str, ...]:
        return self.family.state_names

    @property
    def search_range(self) -> tuple[float, float]:
        return self.family.search_range

    @property
    def scale(self) -> Scale | None:
        return self.family.scale

    def at(self, speed: float) -> System:
        return self.family.at(speed).absorb(self.linear)

    def stack(self, speeds: ArrayLike) -> Matrices:
        A, B, C, d = self.family.stack(speeds)
        out = list(self.linear)
        inside = (B[..., out] * np.array(list(self.linear.values()))) @ C[..., out, :]
        return A - inside, B[..., self._kept], C[..., self._kept, :], d

    def derivative(self, speeds: ArrayLike) -> Matrices:
        _, B, C, _ = self.family.stack(speeds)
        dA, dB, dC, dd = self.family.derivative(speeds)
        out, slopes = list(self.linear), np.array(list(self.linear.values()))
        inside = (dB[..., out] * slopes) @ C[..., out, :] + (B[..., out] * slopes) @ dC[..., out, :]
        return dA - inside, dB[..., self._kept], dC[..., self._kept, :], dd


def reduced(family: AnyFamily, springs: Sequence[Spring]) -> tuple[AnyFamily, tuple[Spring, ...]]:
    """A family of several springs with those that are linear and without offset within it.

    One spring stays in any case, and the first where it alone is one in an angle: what is told as
    the amplitude is that of the first spring.
    """
    from aeroflutter.springs.static import Led, Linear

    linear = {
        i: one.stiffness
        for i, one in enumerate(springs)
        if isinstance(one, Linear) and one.centre == 0.0
    }
    if len(linear) == len(springs):
        linear.pop(0)
    elif 0 in linear and _alone_in_an_angle(as_family(family), linear):
        first = Led(linear.pop(0), extent=_extent(as_family(family), springs))
        springs = (first, *springs[1:])
    if not linear:
        return family, tuple(springs)
    kept = tuple(one for i, one in enumerate(springs) if i not in linear)
    return _Absorbed(as_family(family), linear), kept


def _alone_in_an_angle(family: Family, linear: Mapping[int, float]) -> bool:
    bent = [unit for i, unit in enumerate(family.units) if i not in linear]
    return family.units[0] == "rad" and "rad" not in bent


def _extent(family: Family, springs: Sequence[Spring]) -> float:
    """How far the first output moves where the others move by the scales of their springs.

    In the mode that is damped least, halfway up the range of speeds.
    """
    system = family.at(float(np.sqrt(np.prod(family.search_range))))
    values, vectors = np.linalg.eig(system.closed(np.ones(len(springs))))
    moves = np.abs(system.C @ vectors)
    mode = int(np.argmax(np.where(values.imag > 0.0, values.real, -np.inf)))
    share = np.max(moves[1:, mode] / np.array([one.scale for one in springs[1:]]))
    return float(moves[0, mode] / share) if share > 0.0 < moves[0, mode] else 1.0
