"""Modal models from the variables of files and what a case says beside them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from aeroflutter.errors import InputError
from aeroflutter.model.elsewhere.forces import TabulatedForces
from aeroflutter.model.elsewhere.modal import ModalModel, Modes
from aeroflutter.model.elsewhere.rational import FitOptions
from aeroflutter.model.elsewhere.source import Read, Source, Variables, check_count
from aeroflutter.model.system import Real

__all__ = ["modal_model"]

NAMES_IN_OP4 = {"Q": "QHH", "M": "MHH", "K": "KHH", "C": "BHH"}
"""What Nastran calls generalised matrices."""


def modal_model(said: Variables, stored: Sequence[Variables]) -> Read:
    """A family from masses, stiffness and tabulated air forces.

    Parameters, returns and raises as for :func:`state_space`; one file only.
    """
    if len(stored) != 1:
        raise InputError(["file: must be one for a modal model"])
    file = stored[0]
    of_nastran = any(isinstance(v, list) and _is_matrices(v) for v in file.values())
    named = {name: own for name, own in NAMES_IN_OP4.items() if of_nastran and name not in said}
    chosen = {name: said[name] for name in NAMES_IN_OP4 if isinstance(said.get(name), str)}
    source = Source(
        {name: value for name, value in said.items() if name not in chosen},
        {**file, **_renamed(file, named | chosen, {"Q", *chosen})},
    )
    modes = _modes(source)
    rows, stiffness, held, labels = _springs(source, modes)
    model = ModalModel(
        modes=modes,
        rows=rows,
        stiffness=stiffness,
        in_stiffness=held,
        approximation=_approximation(source),
        speed_range=source.pair("speed_range"),
        **labels,
    )
    return model, _notes(model), False


def _is_matrices(value: Sequence[Any]) -> bool:
    return bool(value) and all(isinstance(one, np.ndarray) for one in value)


def _renamed(stored: Variables, named: Mapping[str, str], needed: set[str]) -> dict[str, Any]:
    """Matrices by what they are; those of an OP4 file come as lists."""
    found = {}
    for name, own in named.items():
        value = stored.get(own)
        if value is None:
            if name in needed:
                known = ", ".join(stored)[:120]
                raise InputError([f"{name}: there is no {own!r:.40} in the file; it has {known}"])
            continue
        if isinstance(value, list):
            if len({np.shape(one) for one in value}) != 1:
                raise InputError([f"{name}: the matrices {own} are not of one shape"])
            value = np.stack(value) if name == "Q" else value[0]
        found[name] = value
    return found


def _modes(source: Source) -> Modes:
    forces = _forces(source)
    n = forces.modes
    given = {}
    for name, key in (("mass", "M"), ("damping", "C"), ("stiffness", "K")):
        value = source.array(key, dims=2)
        if value is not None and value.shape in ((1, n), (n, 1)) and n > 1:
            value = value.ravel()
        if value is None and name != "damping":
            raise InputError([f"{key}: is missing; the file holds {source.listed}"])
        given[name] = value
    numbers = {name: source.number(name) for name in ("semichord", "density")}
    missing = [f"{name}: is missing" for name, value in numbers.items() if value is None]
    if missing:
        raise InputError(missing)
    try:
        modes = Modes(forces=forces, **given, **numbers)  # type: ignore[arg-type]
    except InputError as error:
        keys = {"mass": "M", "damping": "C", "stiffness": "K"}
        raise InputError([_in_words(problem, keys) for problem in error.problems]) from None
    return _damped(source, modes)


def _in_words(problem: str, keys: Mapping[str, str]) -> str:
    name, colon, rest = problem.partition(":")
    if colon and name in keys:
        return f"{keys[name]}:{rest}"
    first = problem.split(" ", 1)[0]
    return f"{keys[first]}: {problem}" if first in keys else problem


def _damped(source: Source, modes: Modes) -> Modes:
    """With damping ratios of the modes without air, ``C = Σ 2 zeta ω (M φ)(M φ)ᵀ``."""
    from scipy.linalg import eigh

    ratios = source.array("zeta", dims=1)
    if ratios is None:
        return modes
    n = modes.forces.modes
    if ratios.size not in (1, n) or np.any(ratios < 0):
        raise InputError([f"zeta: need one number or {n}, none negative"])
    _, shapes = eigh(modes.K, modes.M)
    momenta = modes.M @ shapes
    added = (momenta * (2 * np.broadcast_to(ratios.ravel(), (n,)) * modes.wind_off)) @ momenta.T
    return Modes(
        mass=modes.M,
        damping=modes.C + added,
        stiffness=modes.K,
        forces=modes.forces,
        semichord=modes.semichord,
        density=modes.density,
    )


def _forces(source: Source) -> TabulatedForces:
    Q = source.array("Q", dims=3, complex_too=True)
    k = source.array("k", dims=1)
    for name, value in (("Q", Q), ("k", k)):
        if value is None:
            raise InputError([f"{name}: is missing; the file holds {source.listed}"])
    if Q.ndim == 3 and Q.shape[0] == Q.shape[1] != Q.shape[2] and Q.shape[2] == k.size:
        Q = np.moveaxis(Q, 2, 0)  # MATLAB counts in its last dimension
    if Q.ndim == 2 and Q.shape[0] == 1 and k.size > 1:
        Q = Q.reshape(-1, 1, 1)  # one mode
    k = k.ravel()
    if Q.ndim != 3 or Q.shape[0] != k.size or Q.shape[1] != Q.shape[2]:
        raise InputError([f"k, Q: need shapes (p,) and (p, n, n), got {k.shape} and {np.shape(Q)}"])
    machs, wanted = source.array("mach", dims=1), source.number("at_mach")
    if machs is not None:
        chosen = _at_mach(machs.ravel(), wanted, k.size)
        order = np.argsort(k[chosen], kind="stable")  # cards may be given in any order
        k, Q = k[chosen][order], Q[chosen][order]
    return TabulatedForces(k, Q)


def _at_mach(machs: Real, wanted: float | None, count: int) -> Any:
    if machs.size == 1:
        machs = np.full(count, machs[0])
    if machs.size != count:
        raise InputError([f"mach: need {count} numbers, one a matrix, got {machs.size}"])
    known = np.unique(machs)
    if wanted is None:
        if known.size > 1:
            shown = ", ".join(f"{mach:g}" for mach in known[:8])
            raise InputError([f"at_mach: is missing; Q is given at {shown}"])
        wanted = float(known[0])
    chosen = np.abs(machs - wanted) < 1e-9
    if not np.any(chosen):
        shown = ", ".join(f"{mach:g}" for mach in known[:8])
        raise InputError([f"at_mach: there is no Q at {wanted:g}, only at {shown}"])
    return np.nonzero(chosen)[0]


def _springs(
    source: Source, modes: Modes
) -> tuple[Real, Real, list[bool], dict[str, tuple[str, ...]]]:
    """Rows, stiffness, whether K holds it, names and units: the coordinates where none is given."""
    n = modes.forces.modes
    rows = source.array("rows", dims=2)
    names, units = source.texts("names"), source.texts("units")
    if rows is None:
        own = np.diag(modes.K)
        Q = modes.forces.Q
        felt = (own > 1e-9 * np.abs(own).max(initial=0.0)) & np.any(Q, axis=(0, 2))
        for key in ("stiffness", "names", "in_K"):
            if source.said.get(key) is not None:
                raise InputError([f"{key}: goes with rows; give them, or remove it"])
        if not np.any(felt):
            raise InputError(["rows: are missing, and K has no diagonal to take springs from"])
        words = tuple(f"mode{i + 1}" for i in np.nonzero(felt)[0])
        labels = {"names": words, "units": ("m",) * len(words)}
        return np.eye(n)[felt], own[felt], [True] * len(words), labels
    if rows.shape != (rows.shape[0], n) and rows.size == n:
        rows = rows.reshape(1, n)
    stiffness = source.array("stiffness", dims=1)
    if stiffness is None:
        raise InputError(["stiffness: is missing; give that of each spring, N m/rad or N/m"])
    stiffness = stiffness.ravel()
    labels = {
        "names": names or tuple(f"y{i + 1}" for i in range(len(rows))),
        "units": units or ("rad",) * len(rows),
    }
    check_count(labels, len(rows))
    return rows, stiffness, _held(source.get("in_K"), len(rows)), labels


def _held(given: Any, count: int) -> list[bool]:
    if given is None:
        return [True] * count
    flags = np.asarray(given).ravel()
    if flags.dtype.kind not in "b" or flags.size not in (1, count):
        raise InputError([f"in_K: must be true, false or a list of {count} of them"])
    return [bool(flag) for flag in np.broadcast_to(flags, (count,))]


def _approximation(source: Source) -> FitOptions:
    given: dict[str, Any] = {"method": source.word("method", ("roger", "minimum-state"))}
    lags = source.get("lags")
    if lags is not None:
        array = source.array("lags", dims=1).ravel()
        whole = not isinstance(lags, list) and array.size == 1 and float(array[0]).is_integer()
        given["lags"] = int(array[0]) if whole else tuple(map(float, array))
    for name in ("exact", "emphasis", "weights"):
        array = source.array(name, dims=1)
        given[name] = None if array is None else tuple(map(float, array.ravel()))
    mass = source.get("apparent_mass")
    if mass is not None:
        if not isinstance(mass, bool | np.bool_):
            raise InputError(["apparent_mass: must be true or false"])
        given["apparent_mass"] = bool(mass)
    return FitOptions(**{name: value for name, value in given.items() if value is not None})


def _notes(model: ModalModel) -> list[str]:
    fit = model.fit
    notes = [
        f"{stiffness:.6g} {'N m/rad' if unit == 'rad' else 'N/m'} taken out of K for the spring "
        f"at {name}"
        if held
        else f"K is without the spring at {name}, of {stiffness:.6g} "
        f"{'N m/rad' if unit == 'rad' else 'N/m'}"
        for name, unit, stiffness, held in zip(
            model.names, model.units, np.atleast_1d(model.stiffness), model.held, strict=True
        )
    ]
    if not model.moving.all():
        still = ", ".join(str(i + 1) for i in np.flatnonzero(~model.moving))
        notes.append(f"no air force and no spring touches mode {still}: left out of the states")
    roots = ", ".join(f"{root:.4g}" for root in fit.distinct_roots)
    worst = int(np.argmax(fit.errors))
    notes.append(
        f"Q approximated ({fit.method}, lag roots {roots or 'none'}) to {fit.errors[worst]:.2%} "
        f"or better, worst at k = {fit.forces.k[worst]:g}"
    )
    return notes + [f"warning: {line}" for line in fit.warnings]
