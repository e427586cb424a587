"""State spaces from the variables of files and what a case says beside them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from aeroflutter.errors import InputError
from aeroflutter.model.elsewhere.polynomial import PolynomialModel, Variable
from aeroflutter.model.elsewhere.sampled import SplinedModel
from aeroflutter.model.elsewhere.scale import ModelScale
from aeroflutter.model.elsewhere.source import Read, Source, Variables, check_count
from aeroflutter.model.elsewhere.still import still_states
from aeroflutter.model.elsewhere.tracked import outputs_first, same_states, tracked
from aeroflutter.model.family import FixedModel
from aeroflutter.model.system import Real, System

__all__ = ["state_space"]

MOST_STATES = 1000
_TRIED = 12  # speeds that are left out, one at a time
_SPARSE = 0.02  # of the size of a root, by which it may then change


def state_space(said: Variables, stored: Sequence[Variables]) -> Read:
    """A family from ``A``, ``B``, ``C`` at one or several speeds, or as polynomials of the speed.

    Parameters
    ----------
    said : mapping
        Keys of the case's table.
    stored : sequence of mappings
        Variables of the files; of several, each holds one speed.

    Returns
    -------
    family, notes, whether it is given at one speed only

    Raises
    ------
    InputError
        All that is wrong of the first thing that is.
    """
    source = _joined(said, stored)
    _refuse_others(source)
    time_unit = source.word("time_unit", ("s", "semichord"))
    if time_unit is None:
        raise InputError(['time_unit: is missing; say "s" or "semichord" (time b/V)'])
    scale = ModelScale.of(source.number("semichord"), time_unit)
    variable = source.word("variable", ("V", "1/V"))
    speeds = source.array("speeds", dims=1)
    A, B, C = _matrices(source, None if speeds is None or variable else speeds.size)
    labels = {"names": source.texts("names"), "units": source.texts("units")}
    check_count(labels, len(C[0]))
    _refuse_idle(B, C, labels["names"])
    if variable is not None:
        power: Variable = "V" if variable == "V" else "1/V"
        family, notes = _polynomial(source.pair("speed_range"), power, (A, B, C), scale, labels)
        return family, notes, False
    if len(A) == 1:
        A, B, C, states, notes = _without_still(A, B, C)
        system = System(A[0], B[0], C[0], None, labels["names"], labels["units"], states)
        speed = 1.0 if speeds is None else float(speeds[0])
        return FixedModel(system, (speed, speed), scale), notes, True
    if speeds is None:
        raise InputError([f"speeds: are missing; give one of each of the {len(A)} systems"])
    if np.any(np.diff(speeds) <= 0) or speeds[0] <= 0:
        raise InputError(["speeds: must be positive and strictly increasing"])
    word = source.word("states", ("same", "different"))
    same = same_states(A, B, C) if word is None else word == "same"
    followed: tuple[str, ...] = ()
    if not same:
        A, B, C = tracked(speeds, A, B, C)
        followed = (
            "the states differ from speed to speed: modes were followed, and are what is splined",
        )
    A, B, C, states, notes = _without_still(A, B, C)
    if np.any(C[0] != C):
        A, B, C = outputs_first(A, B, C)
    model = SplinedModel(speeds, A, B, C, scale=scale, state_names=states, **labels)
    return model, (*followed, *notes, *_sparse(model)), False


def _sparse(model: SplinedModel) -> Iterator[str]:
    """What is to be said where the speeds are far apart.

    How much the roots at a speed change if that speed is not given, springs of slope one; what lies
    between the speeds that are is some ten times as good with cubic splines.
    """
    speeds, A, B = (np.asarray(value) for value in (model.speeds, model.A, model.B))
    C = np.asarray(model.C)[0]
    if len(speeds) == 2:
        return  # straight lines, of which nothing can be left out
    places = np.unique(np.linspace(1, len(speeds) - 2, _TRIED).astype(int))
    worst, at = 0.0, places[0]
    for i in places:
        rest = np.delete(np.arange(len(speeds)), i)
        other = SplinedModel(speeds[rest].tolist(), A[rest], B[rest], np.asarray(model.C)[rest])
        wanted = np.linalg.eigvals(A[i] - B[i] @ C)
        found = np.linalg.eigvals(other.at(float(speeds[i])).closed(np.ones(len(C))))
        change = np.abs(wanted[:, None] - found).min(axis=1)
        oscillates = wanted.imag > np.abs(wanted.real)
        off = float(np.max(change[oscillates] / np.abs(wanted[oscillates]), initial=0.0))
        worst, at = (off, i) if off > worst else (worst, at)
    if worst > _SPARSE:
        yield (
            f"warning: the speeds are far apart: without {speeds[at]:g} m/s, its roots would be "
            f"off by {worst:.2g} of their size; give more speeds"
        )


def _polynomial(
    limits: tuple[float, float] | None,
    variable: Variable,
    given: tuple[Real, Real, Real],
    scale: ModelScale,
    labels: Mapping[str, tuple[str, ...]],
) -> tuple[PolynomialModel, tuple[str, ...]]:
    """A family of powers of the speed, and what is to be said of it."""
    if limits is None:
        raise InputError(["speed_range: is missing; give the speeds to search, as [low, high]"])
    if variable == "1/V" and limits[0] == 0:
        raise InputError(["speed_range: must begin above 0 for powers of 1/V"])
    A, B, C = given
    whole = PolynomialModel(A=A, B=B, C=C, variable=variable, search_range=limits)
    A, B, C, states, notes = _without_still(A, B, C, whole.stack(np.linspace(*limits, 9))[:3])
    made = PolynomialModel(
        A=A, B=B, C=C, variable=variable, search_range=limits, scale=scale, state_names=states,
        **labels,
    )  # fmt: skip
    return made, notes


def _refuse_idle(B: Real, C: Real, names: Sequence[str]) -> None:
    """A spring that pushes nothing, or whose twist nothing changes, is a mistake of the file."""
    problems = []
    for key, idle in (("B", ~np.any(B, axis=(0, 1))), ("C", ~np.any(C, axis=(0, 2)))):
        which = [names[i] if names else f"y{i + 1}" for i in np.flatnonzero(idle).tolist()]
        what = "column" if key == "B" else "row"
        problems += [f"{key}: the {what} of {name:.40} is zero at every speed" for name in which]
    if problems:
        raise InputError(problems)


def _without_still(
    A: Real, B: Real, C: Real, at: tuple[Real, Real, Real] | None = None
) -> tuple[Real, Real, Real, tuple[str, ...], tuple[str, ...]]:
    """Matrices without states that are still, the names of the others, and what is to be said.

    Parameters
    ----------
    at
        The matrices at several speeds, where they are no such themselves.
    """
    still = still_states(*(at or (A, B, C)))
    names = tuple(f"x{i + 1}" for i in range(still.size))
    if not np.any(still):
        return A, B, C, names, ()
    kept = np.flatnonzero(~still)
    gone = ", ".join(names[i] for i in np.flatnonzero(still))
    note = (
        f"states {gone} neither grow nor decay and have no part in the loop of the springs: left "
        "out"
    )
    own = tuple(names[i] for i in kept)
    return A[:, kept[:, None], kept], B[:, kept], C[..., kept], own, (note,)


def _joined(said: Variables, stored: Sequence[Variables]) -> Source:
    """Several files as one, their matrices stacked."""
    if len(stored) == 1:
        return Source(said, stored[0])
    first = dict(stored[0])
    for name in ("A", "B", "C", "D"):
        parts = [one.get(name) for one in stored]
        if all(part is None for part in parts) and name == "D":
            continue
        shapes = {np.shape(part) for part in parts if part is not None}
        if len(shapes) != 1 or any(part is None for part in parts):
            raise InputError([f"file: {name} must be in every file, of the same shape"])
        first[name] = np.stack([np.asarray(part) for part in parts])
    if said.get("speeds") is None:
        speeds = [np.asarray(one.get("speeds", np.nan)).ravel() for one in stored]
        if any(one.size != 1 or one.dtype.kind not in "iuf" for one in speeds):
            raise InputError(["speeds: give one of each file"])
        first["speeds"] = np.concatenate(speeds)
    return Source(said, first)


def _refuse_others(source: Source) -> None:
    """What has no place in the equations."""
    step = source.array("dt", dims=1)
    if step is not None and np.any(step != 0):
        raise InputError(
            ["dt: the system is in discrete time; give it in continuous time, as by SHARPy's "
             "libss.disc2cont or MATLAB's d2c"]
        )  # fmt: skip
    D = source.array("D", dims=3)
    if D is not None and np.any(D != 0):
        raise InputError(["D: must be zero, or the loop with the springs is algebraic"])


def _matrices(source: Source, count: int | None) -> tuple[Real, Real, Real]:
    """``A`` (k, n, n), ``B`` (k, n, m) and ``C`` (k, m, n) in whichever order of axes they are."""
    found = {}
    for name in ("A", "B", "C"):
        value = source.array(name, dims=3)
        if value is None:
            raise InputError([f"{name}: is missing in the file; it holds {source.listed}"])
        if value.ndim > 3:
            raise InputError([f"{name}: has {value.ndim} dimensions; at most three are due"])
        found[name] = value
    A = found["A"]
    if A.ndim == 3 and A.shape[1] != A.shape[2] and A.shape[0] == A.shape[1]:
        # MATLAB counts systems in its last dimension
        found = {n: np.moveaxis(v, 2, 0) if v.ndim == 3 else v for n, v in found.items()}
    found = {name: v[None] if v.ndim == 2 else v for name, v in found.items()}
    A, B, C = found["A"], found["B"], found["C"]
    n = A.shape[1]
    B = B.transpose(0, 2, 1) if B.shape[1:] == (1, n) and n > 1 else B  # squeezed to a row
    shown = ", ".join(f"{name} {value.shape}" for name, value in found.items())
    systems = len(A) if count is None else count
    fits = A.shape == (systems, n, n) and 0 < n <= MOST_STATES
    m = C.shape[1]
    fits = fits and B.shape[1:] == (n, m) and C.shape[2] == n and m > 0
    if not fits or len(B) not in (1, len(A)) or (len(C) not in (1, len(A)) and count):
        raise InputError(
            [f"A, B, C: need shapes (k, n, n), (k, n, m), (k, m, n), k speeds, got {shown}"
             + ("" if count is None else f" and {count} speeds")]
        )  # fmt: skip
    if count is not None:
        B, C = (np.broadcast_to(v, (len(A), *v.shape[1:])) for v in (B, C))
    return A, B, C
