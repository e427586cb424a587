"""Cases as the contents of maps: any two keys of a case, or airspeed, against each other."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aeroflutter.case import Case, load_case
from aeroflutter.case.case import ModelMotion
from aeroflutter.case.source import parse_case
from aeroflutter.errors import InputError
from aeroflutter.model.lure import AnyFamily, AnySystem
from aeroflutter.model.section import Scale
from aeroflutter.motion.response import Initial
from aeroflutter.springs import alone
from aeroflutter.studies.maps import (
    Axis,
    Cells,
    Executor,
    FlutterMap,
    Grid,
    Group,
    MapOptions,
    Progress,
)
from aeroflutter.studies.maps.cells import memories, started

Array = NDArray[np.float64]

SPEEDS = ("speed", "speed_ratio", "velocity")
MOTION = {
    "initial.alpha_deg": "alpha",
    "initial.alpha_rate_deg": "alpha_rate",
    "initial.xi": "xi",
    "initial.xi_rate": "xi_rate",
    "initial.beta_deg": "beta",
    "initial.beta_rate_deg": "beta_rate",
}
ALPHA_DEG = tuple(np.linspace(1.0, 15.0, 29))
CHECKED = 16  # values of an axis tried before a map begins


@dataclass(frozen=True, eq=False)
class CaseCells:
    """Cells of a case in which two keys vary; see `maps.Cells`.

    Parameters
    ----------
    text : str
        The case as TOML.
    source : str
        Where it came from, for messages.
    grid : Grid
        Keys of the case by dotted path in the units of the file, "speed", "speed_ratio" or
        "velocity" (m/s). Of a model from a file also where motions start: "initial." and a state,
        or a coordinate, its name with "_deg" behind where it is an angle.
    speed : (str, float), optional
        One of the last three and its value, where neither axis is one.

    Raises
    ------
    InputError
        If an axis takes the case where it is not valid, or there is no flutter speed for a ratio.
    """

    text: str
    source: str
    grid: Grid
    speed: tuple[str, float] | None = None

    def __post_init__(self) -> None:
        keys = [axis.key for axis in self._axes]
        if self.speed is None and not any(key in SPEEDS for key in keys):
            raise InputError("--speed-ratio: give the airspeed, or --speed")
        for axis in self._axes:
            chosen = np.linspace(0, len(axis) - 1, min(len(axis), CHECKED)).astype(int)
            for value in axis.values[chosen]:
                at = {a.key: float(value if a is axis else a.values[0]) for a in self._axes}
                self._system(at)

    @property
    def _axes(self) -> tuple[Axis, Axis]:
        return self.grid.x, self.grid.y

    @property
    def shared(self) -> int | None:
        """The axis along which the system changes, if it does along one only."""
        changes = [not starts(axis.key) for axis in self._axes]
        return changes.index(True) if sum(changes) == 1 else None

    def groups(self, x: Array, y: Array) -> Iterator[Group]:
        """Cells by the values that make their systems differ."""
        points = {axis.key: values for axis, values in zip(self._axes, (x, y), strict=True)}
        rest = [key for key in points if not starts(key)]
        one_case = all(key in SPEEDS for key in rest)
        whole: Group | None = None
        for index in _alike([points[key] for key in rest], x.size):
            case, system = self._system({key: float(points[key][index[0]]) for key in rest})
            if not one_case:
                yield _started(index, case, system, points)
            else:
                whole = whole or _started(np.arange(x.size), case, system, points)
                yield whole.part(index, system)

    def _system(self, at: Mapping[str, float]) -> tuple[Case, AnySystem]:
        modelled = "model" in parse_case(self.text, self.source)
        placed = [key for key in at if modelled and starts(key) and key not in MOTION]
        changed = tuple(
            (key, value) for key, value in at.items() if key not in SPEEDS and key not in placed
        )
        case, family, flutter = changed_case(self.text, self.source, changed)
        for key in placed:
            direction(case, key)
        name, value = next(
            ((key, value) for key, value in at.items() if key in SPEEDS), self.speed or ("", 0.0)
        )
        if value <= 0.0:
            raise InputError(f"{name}: must be positive, not {value:g}")
        if name == "speed_ratio":
            value *= flutter()
        elif name == "velocity":
            value = in_si(case).speed(value)
        return case, family.at(value)

    def identity(self) -> dict[str, Any]:
        """The case, table by table, what is in its file, and the airspeed."""
        fixed = {} if self.speed is None else {self.speed[0]: self.speed[1]}
        return {**case_identity(self.text, self.source), **fixed}


def case_identity(text: str, source: str) -> dict[str, Any]:
    """The tables of a case, and the digest of the file of a model if it has one."""
    case, _, _ = changed_case(text, source, ())
    file = {} if case.imported is None else {"file_sha256": case.imported.digest}
    return {"case": parse_case(text, source), **file}


def _started(
    index: NDArray[np.int64], case: Case, system: AnySystem, points: Mapping[str, Array]
) -> Group:
    """The cells at these places, which have the case in common."""
    if isinstance(case.initial, ModelMotion):
        return _displaced(index, case, case.initial, system, points)
    varied = {MOTION[key]: _native(key, points[key][index]) for key in points if key in MOTION}
    initial = Initial(**{**case.initial._asdict(), **dict.fromkeys(varied, 0.0)})
    return started(index, system, case.loop()[1], initial, varied)


def _displaced(
    index: NDArray[np.int64],
    case: Case,
    motion: ModelMotion,
    system: AnySystem,
    points: Mapping[str, Array],
) -> Group:
    """The cells of a case whose motion is in its states, which are zero if it says nothing."""
    given = parse_case(case.text, case.source).get("initial", {})
    keys = [key for key in points if starts(key)]
    said = "initial.alpha_deg" not in keys and (not keys or {"state", "alpha_deg"} & set(given))
    base = np.array(motion.state) if said else np.zeros(len(motion.state))
    states = np.tile(base, (index.size, 1))
    for key in keys:
        states += np.outer(points[key][index], direction(case, key))
    springs = case.loop()[1]
    initial = Initial(memory=motion.memory)
    return Group(index, system, alone(springs), states, memories(system, springs, initial, states))


def starts(key: str) -> bool:
    """Whether a key of a map says where motions start, and not what moves."""
    return key in MOTION or (
        key.startswith("initial.") and key not in ("initial.state", "initial.memory")
    )


def direction(case: Case, key: str) -> Array:
    """States (n,) of a case whose motion is in them, a unit of a key of the motion.

    Raises
    ------
    InputError
        If the key is none of its motion.
    """
    name = key.removeprefix("initial.")
    if name == "alpha_deg":
        angle = case.model().units[0] == "rad"
        first, second = (case.displaced(value).state for value in (0.0, 1.0))  # type: ignore[union-attr]
        return (math.radians(1.0) if angle else 1.0) * np.subtract(second, first)
    model = case.model() if case.imported is None else case.imported.family
    n = len(model.state_names)
    if name in model.state_names:
        return np.eye(n)[model.state_names.index(name)]
    rows = model.stack(model.search_range[0])[2]
    known = {}
    for one, unit, row in zip(model.names, model.units, rows, strict=True):
        angle = unit == "rad"
        known[f"{one}_deg" if angle else one] = (math.radians(1.0) if angle else 1.0) * (
            row / float(row @ row)
        )
    if name not in known:
        raise InputError(
            f"{key}: is none of its motion; give initial.alpha_deg, initial. and one of "
            f"{', '.join(known)}, or a state ({', '.join(model.state_names)})"
        )
    return np.asarray(known[name])


def _alike(columns: list[Array], count: int) -> list[NDArray[np.int64]]:
    """Places of the points that agree in all the columns, in order of appearance."""
    if not columns:
        return [np.arange(count)]
    _, first, place = np.unique(
        np.column_stack(columns), axis=0, return_index=True, return_inverse=True
    )
    place = np.ravel(place)
    order = np.argsort(place, kind="stable")
    ends = np.cumsum(np.bincount(place))
    parts = np.split(order, ends[:-1])
    return [parts[k] for k in np.argsort(first)]


def flutter_map(
    case: Case | Cells,
    options: MapOptions | None = None,
    *,
    speed_ratio: ArrayLike | None = None,
    speed: ArrayLike | None = None,
    velocity: ArrayLike | None = None,
    alpha_deg: ArrayLike = ALPHA_DEG,
    executor: Executor | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> FlutterMap:
    """How the motion ends for every airspeed and initial pitch.

    Parameters
    ----------
    case : Case or Cells
        A case; or cells of any kind, which have their axes already.
    options : MapOptions, optional
    speed_ratio, speed, velocity : array (m,)
        Airspeeds, one of the three: U*/U*_L, U*, or V in m/s where the case has SI data.
    alpha_deg : array (n,)
        Initial pitch, degrees.
    executor, progress
        As for `maps.flutter_map`.

    Raises
    ------
    InputError
        If not exactly one kind of airspeed is given, or the case is not valid there.
    """
    from aeroflutter.studies.maps import flutter_map as decide

    if not isinstance(case, Case):
        return decide(case, options, executor=executor, progress=progress)
    airspeeds = {"speed_ratio": speed_ratio, "speed": speed, "velocity": velocity}
    given = [(key, values) for key, values in airspeeds.items() if values is not None]
    if len(given) != 1:
        raise InputError("speed: give one of speed_ratio, speed and velocity")
    [(key, values)] = given
    grid = Grid(
        Axis(key, np.atleast_1d(np.asarray(values, dtype=float))),
        Axis("initial.alpha_deg", np.atleast_1d(np.asarray(alpha_deg, dtype=float))),
    )
    cells = CaseCells(case.text, case.source, grid)
    return decide(cells, options, executor=executor, progress=progress).about(case=case)


def in_si(case: Case) -> Scale:
    """What turns speeds of a case into m/s.

    Raises
    ------
    InputError
        If the case has no SI data.
    """
    if case.scale is None:
        raise InputError("--velocity: needs a section in SI units; give --speed")
    return case.scale


def _native(key: str, values: Array) -> Array:
    return np.radians(values) if key.endswith("_deg") else values


@functools.lru_cache(maxsize=4096)
def changed_case(
    text: str, source: str, changed: tuple[tuple[str, float], ...]
) -> tuple[Case, AnyFamily, Callable[[], float]]:
    """The changed case, its family, and its linear flutter speed as a function, computed once."""
    case = load_case(parse_case(text, source), dict(changed))
    family, _ = case.loop()
    return case, family, functools.cache(functools.partial(_flutter, case, family))


def _flutter(case: Case, family: AnyFamily) -> float:
    from aeroflutter.linear.rootlocus import flutter_speed

    speed = flutter_speed(family)
    if speed is None or not math.isfinite(speed):
        raise InputError(f"{case.source}: has no linear flutter speed; give --speed, not a ratio")
    return speed
