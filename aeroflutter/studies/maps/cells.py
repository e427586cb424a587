"""What stands in the cells of a map: a system, a spring and a motion at τ = 0 for every point."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from aeroflutter.errors import InputError
from aeroflutter.model.lure import AnyFamily, AnySystem, as_family, as_system
from aeroflutter.motion.response import Initial
from aeroflutter.springs import Spring, Springs, alone, each
from aeroflutter.studies.maps.grid import Grid

__all__ = ["Cells", "Group", "SpeedPitch", "memories", "started"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Group:
    """Cells that share their system and spring and differ in the motion at τ = 0 alone.

    Attributes
    ----------
    index
        Places of the cells among the points asked for, (m,).
    system, spring
        What all of them are; several springs are a tuple.
    states, memory
        Where they start, (m, n) and (m,), or with several springs (m, springs).
    """

    index: NDArray[np.int64]
    system: AnySystem
    spring: Spring | tuple[Spring, ...]
    states: Array
    memory: Array

    def part(self, index: NDArray[np.int64], system: AnySystem) -> Group:
        """Some of the cells, at another airspeed."""
        return Group(index, system, self.spring, self.states[index], self.memory[index])


class Cells(Protocol):
    """The contents of a map. Obligations:

    1. Instances can be pickled and depend on nothing outside themselves.
    2. ``groups(x, y)`` covers every point once; the order of groups and of the cells in them
       follows from the points alone.
    3. ``identity()`` holds, in JSON's types, whatever the numbers depend on.
    4. ``shared`` says which axis the cells of a group have in common: 0, 1 or None.
    """

    @property
    def grid(self) -> Grid: ...

    @property
    def shared(self) -> int | None: ...

    def groups(self, x: Array, y: Array) -> Iterator[Group]: ...

    def identity(self) -> dict[str, Any]: ...


def distinct(values: Array) -> list[tuple[float, NDArray[np.int64]]]:
    """The distinct values in order of appearance, each with its places."""
    found, first, place = np.unique(values, return_index=True, return_inverse=True)
    return [(float(found[k]), np.flatnonzero(place == k)) for k in np.argsort(first)]


@dataclass(frozen=True, eq=False)
class SpeedPitch:
    """The flutter map of the thesis: airspeed along x, initial pitch along y.

    Parameters
    ----------
    family : Family or LureFamily
        The linear model at every speed.
    spring : Spring, or a sequence of them
    grid : Grid
        Speeds U* (key "speed") or, with a reference, their ratios to it (key "speed_ratio");
        initial pitches in degrees.
    reference : float
        Speed by which the values of x are multiplied: the linear flutter speed, say.
    initial : Initial
        The rest of the motion at τ = 0.

    Raises
    ------
    InputError
        If a speed is not positive or the system has no pitch to start from.
    """

    family: AnyFamily
    spring: Springs
    grid: Grid
    reference: float = 1.0
    initial: Initial = field(default_factory=Initial)

    def __post_init__(self) -> None:
        if np.min(self.grid.x.values) * self.reference <= 0.0:
            raise InputError(f"{self.grid.x.key}: speeds must be positive")
        if self.initial.state is not None:
            raise InputError("initial.state: leaves no room for a pitch; give a motion instead")
        speed = float(self.grid.x.values[0]) * self.reference
        replace(self.initial, alpha=1.0).vector(self.family.at(speed))

    @property
    def shared(self) -> int:
        """Cells of a column share the speed."""
        return 0

    def groups(self, x: Array, y: Array) -> Iterator[Group]:
        """One group a speed; see `Cells`."""
        whole: Group | None = None
        for value, index in distinct(x):
            system = self.family.at(value * self.reference)
            if whole is None:  # where cells start does not depend on the speed
                varied = {"alpha": np.radians(y)}
                whole = started(np.arange(x.size), system, self.spring, self.initial, varied)
            yield whole.part(index, system)

    def identity(self) -> dict[str, Any]:
        """The matrices at every speed, the spring and the motion at τ = 0."""
        A, B, C, _ = as_family(self.family).stack(self.grid.x.values * self.reference)
        parts = (A, B[..., 0]) if B.shape[-1] == 1 else (A, B, C)
        digest = hashlib.sha256(b"".join(np.ascontiguousarray(part).tobytes() for part in parts))
        return {
            "model": digest.hexdigest(),
            "spring": repr(alone(self.spring)),
            "initial": repr(self.initial),
            "reference": self.reference,
        }


def started(
    index: NDArray[np.int64],
    system: AnySystem,
    spring: Springs,
    initial: Initial,
    varied: Mapping[str, Array],
) -> Group:
    """A group from the motion at τ = 0.

    Parameters
    ----------
    index
        Places of the cells, (m,).
    system, spring
        What all of them are.
    initial
        The part of the motion that they have in common.
    varied
        The part that they do not, by the names of `Initial`, (m,) each.
    """
    names = system.state_names
    missing = [name for name in varied if name not in names]
    if missing:
        raise InputError(
            f"initial.{missing[0]}: the system has no state of that name ({', '.join(names)})"
        )
    states = np.empty((index.size, len(names)))
    states[:] = initial.vector(system)
    for name, values in varied.items():
        states[:, names.index(name)] = values
    return Group(index, system, alone(spring), states, memories(system, spring, initial, states))


def memories(system: AnySystem, spring: Springs, initial: Initial, states: Array) -> Array:
    """Memory of the spring in every cell, (m,), or of each of several, (m, springs)."""
    springs, outputs = each(spring), states @ as_system(system).C.T
    given = [None] * len(springs) if initial.memory is None else np.ravel(initial.memory)
    if len(given) != len(springs):
        raise InputError(
            f"initial.memory: needs {len(springs)} numbers, one a spring, not {len(given)}"
        )
    columns = [
        one.initial_memory(y)
        if memory is None
        else one.advance(np.full(len(states), float(memory)), y)
        for one, memory, y in zip(springs, given, outputs.T, strict=True)
    ]
    memory = np.column_stack(columns).astype(float)
    return memory[:, 0] if len(springs) == 1 else memory


def axis_identity(grid: Grid) -> Mapping[str, Any]:
    """The axes in JSON's types: ends and number for people, a hash for the rest."""
    described = {}
    for name, axis in (("x", grid.x), ("y", grid.y)):
        values = axis.values
        described[name] = {
            "key": axis.key,
            "first": float(values[0]),
            "last": float(values[-1]),
            "number": len(axis),
            "sha256": hashlib.sha256(values.tobytes()).hexdigest()[:16],
        }
    return described
