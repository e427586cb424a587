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

    One spring stays in any case.
    """
    from aeroflutter.springs import Linear

    linear = {
        i: one.stiffness
        for i, one in enumerate(springs)
        if isinstance(one, Linear) and one.centre == 0.0
    }
    if len(linear) == len(springs):
        linear.pop(0)
    if not linear:
        return family, tuple(springs)
    kept = tuple(one for i, one in enumerate(springs) if i not in linear)
    return _Absorbed(as_family(family), linear), kept
