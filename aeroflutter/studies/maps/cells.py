"""What stands in the cells of a map: a system, a spring and a motion at τ = 0 for every point."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from aeroflutter.errors import InputError
from aeroflutter.model.lure import LureFamily, LureSystem
from aeroflutter.motion.response import Initial
from aeroflutter.springs import Spring
from aeroflutter.studies.maps.grid import Grid

__all__ = ["Cells", "Group", "SpeedPitch"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Group:
    """Cells that share their system and spring and differ in the motion at τ = 0 alone.

    Attributes
    ----------
    index
        Places of the cells among the points asked for, (m,).
    system, spring
        What all of them are.
    states, memory
        Where they start, (m, n) and (m,).
    """

    index: NDArray[np.int64]
    system: LureSystem
    spring: Spring
    states: Array
    memory: Array

    def part(self, index: NDArray[np.int64], system: LureSystem) -> Group:
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
    family : LureFamily
        The linear model at every speed.
    spring : Spring
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

    family: LureFamily
    spring: Spring
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
        A, b = self.family.stack(self.grid.x.values * self.reference)
        digest = hashlib.sha256(b"".join(np.ascontiguousarray(part).tobytes() for part in (A, b)))
        return {
            "model": digest.hexdigest(),
            "spring": repr(self.spring),
            "initial": repr(self.initial),
            "reference": self.reference,
        }


def started(
    index: NDArray[np.int64],
    system: LureSystem,
    spring: Spring,
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
    pitch = states @ system.c
    if initial.memory is None:
        memory = spring.initial_memory(pitch)
    else:
        memory = spring.advance(np.full(index.size, initial.memory), pitch)
    return Group(index, system, spring, states, np.asarray(memory, dtype=float))


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
