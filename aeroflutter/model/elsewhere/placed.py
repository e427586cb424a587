"""Springs in some outputs of a model from elsewhere, the others linear."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from aeroflutter.errors import InputError
from aeroflutter.model.family import Family, Matrices
from aeroflutter.model.section import Scale
from aeroflutter.model.system import System

__all__ = ["PlacedModel"]


@dataclass(frozen=True, eq=False)
class PlacedModel:
    """A model with springs in chosen outputs; those of the others are linear, of slope one.

    Parameters
    ----------
    model : Family
        With every output open.
    springs : sequence of str
        Names of outputs whose springs stand outside of ``A``, one an output, in this order. One
        that is named twice carries two springs.
    stiffness : sequence of float, optional
        What a unit slope of each is worth, over the nominal stiffness of its output; one by
        default.
    linear : mapping of str to float, optional
        Outputs that carry a linear spring of another stiffness than the nominal one, over it.

    Raises
    ------
    InputError
        If a name is none of the model's outputs, or a stiffness is not finite.
    """

    model: Family
    springs: Sequence[str]
    stiffness: Sequence[float] | None = None
    linear: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "springs", tuple(self.springs))
        weights = [1.0] * len(self.springs) if self.stiffness is None else self.stiffness
        object.__setattr__(self, "stiffness", tuple(float(weight) for weight in weights))
        known = self.model.names
        problems = [
            f"{key}: {name!r} is no output of it; use {' or '.join(known)}"
            for key, names in (("springs", self.springs), ("linear", self.linear))
            for name in names
            if name not in known
        ]
        if len(self._weights) != len(self.springs):
            problems.append(
                f"springs and stiffness: need as many of each, got {len(self.springs)} and "
                f"{len(self._weights)}"
            )
        if not all(np.isfinite([*self._weights, *self.linear.values()])):
            problems.append("stiffness and linear: every number must be finite")
        if problems:
            raise InputError(problems)

    @property
    def _weights(self) -> tuple[float, ...]:
        assert self.stiffness is not None  # filled in by __post_init__
        return tuple(self.stiffness)

    @property
    def kept(self) -> list[int]:
        """Numbers of the model's outputs that are its own."""
        return [self.model.names.index(name) for name in self.springs]

    @property
    def slopes(self) -> np.ndarray:
        """Of the linear springs (outputs of the model,)."""
        return np.array(
            [
                self.linear.get(name, 0.0 if name in self.springs else 1.0)
                for name in self.model.names
            ]
        )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the outputs."""
        return tuple(self.springs)

    @property
    def units(self) -> tuple[str, ...]:
        """Units of the outputs."""
        return tuple(self.model.units[i] for i in self.kept)

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the states, in order."""
        return self.model.state_names

    @property
    def search_range(self) -> tuple[float, float]:
        """Default range of speeds (low, high)."""
        return self.model.search_range

    @property
    def scale(self) -> Scale | None:
        """What turns results into SI units, where the model has it."""
        return self.model.scale

    def __getattr__(self, name: str) -> Any:
        """What else the model says of itself."""
        if name.startswith("_") or name == "model":
            raise AttributeError(name)
        return getattr(self.model, name)

    def at(self, speed: float) -> System:
        """The system at one speed.

        Raises
        ------
        InputError
            If the model has none at this speed.
        """
        self.model.at(speed)
        return System(*self.stack(speed), self.names, self.units, self.state_names)

    def stack(self, speeds: ArrayLike) -> Matrices:
        """``A`` (…, n, n), ``B`` (…, n, m), ``C`` (…, m, n), ``d`` (…, n), speeds of any shape."""
        A, B, C, d = self.model.stack(speeds)
        closed = A - (B * self.slopes) @ C
        return closed, B[..., self.kept] * np.array(self._weights), C[..., self.kept, :], d

    def derivative(self, speeds: ArrayLike) -> Matrices:
        """Derivatives of ``stack`` with respect to the speed."""
        _, B, C, _ = self.model.stack(speeds)
        dA, dB, dC, dd = self.model.derivative(speeds)
        closed = dA - (dB * self.slopes) @ C - (B * self.slopes) @ dC
        return closed, dB[..., self.kept] * np.array(self._weights), dC[..., self.kept, :], dd
