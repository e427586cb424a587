"""Models from the variables of files and what a case says beside them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from aeroflutter.errors import InputError
from aeroflutter.model.elsewhere.forces import TabulatedForces
from aeroflutter.model.elsewhere.modal import ModalModel, Modes
from aeroflutter.model.elsewhere.polynomial import PolynomialModel
from aeroflutter.model.elsewhere.rational import FitOptions
from aeroflutter.model.elsewhere.scale import ModelScale
from aeroflutter.model.elsewhere.tracked import sampled
from aeroflutter.model.family import Family, FixedModel
from aeroflutter.model.system import Real, System

__all__ = ["modal_model", "state_space"]

Variables = Mapping[str, Any]
Read = tuple[Family, Sequence[str], bool]

NAMES_IN_OP4 = {"Q": "QHH", "M": "MHH", "K": "KHH", "C": "BHH"}
"""What Nastran calls generalised matrices."""

MOST_STATES = 1000


class _Source:
    """What the case says, and else the file."""

    def __init__(self, said: Variables, stored: Variables) -> None:
        self.said, self.stored = said, stored

    def get(self, name: str) -> Any:
        """A value by its name, None where there is none."""
        value = self.said.get(name)
        return self.stored.get(name) if value is None else value

    def array(self, name: str, *, dims: int, complex_too: bool = False) -> Any:
        """Numbers, with as many dimensions; None where there are none.

        Raises
        ------
        InputError
            If they are none, or complex where real numbers are due.
        """
        value = self.get(name)
        if value is None:
            return None
        try:
            array = np.asarray(value)
        except ValueError:
            array = np.asarray("ragged")
        if array.dtype.kind not in "iufcb" or array.dtype.kind == "b":
            raise InputError([f"{name}: must be numbers"])
        if array.dtype.kind == "c" and not complex_too:
            if np.any(array.imag != 0):
                raise InputError([f"{name}: is complex; real numbers are due"])
            array = array.real
        if not np.all(np.isfinite(array)):
            raise InputError([f"{name}: holds NaN or infinity; every entry must be finite"])
        array = array.astype(complex if complex_too else float)
        return _squeezed(array, dims)

    def number(self, name: str) -> float | None:
        """One number; None where there is none."""
        array = self.array(name, dims=1)
        if array is None:
            return None
        if array.size != 1:
            raise InputError([f"{name}: must be one number, not {array.size}"])
        return float(array.ravel()[0])

    def texts(self, name: str) -> tuple[str, ...]:
        """Texts; none where there are none."""
        value = self.get(name)
        if value is None:
            return ()
        if isinstance(value, str):
            value = [value]
        if not isinstance(value, list) or not all(isinstance(one, str) for one in value):
            raise InputError([f"{name}: must be a list of texts"])
        return tuple(one.strip() for one in value)

    def word(self, name: str, allowed: Sequence[str]) -> str | None:
        """One of some words; None where there is none."""
        texts = self.texts(name)
        if not texts:
            return None
        if len(texts) != 1 or texts[0] not in allowed:
            words = " or ".join(f'"{word}"' for word in allowed)
            raise InputError([f"{name}: must be {words}, not {', '.join(texts)[:40]!r}"])
        return texts[0]

    def pair(self, name: str) -> tuple[float, float] | None:
        """Two ascending numbers; None where there are none."""
        array = self.array(name, dims=1)
        if array is None:
            return None
        if array.shape != (2,) or not 0 <= array[0] < array[1]:
            raise InputError([f"{name}: must be two ascending numbers, none negative"])
        return float(array[0]), float(array[1])


def _squeezed(array: Any, dims: int) -> Any:
    """MATLAB makes every vector a matrix: dimensions of one entry go, from the front first."""
    while array.ndim > dims and 1 in array.shape:
        array = array.squeeze(axis=array.shape.index(1))
    while array.ndim < min(dims, 2):
        array = array[None]
    return array


# --- state space ---------------------------------------------------------------------------------


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
    _count(labels, len(C[0]))
    if variable is not None:
        limits = source.pair("speed_range")
        if limits is None:
            raise InputError(["speed_range: is missing; give the speeds to search, as [low, high]"])
        if variable == "1/V" and limits[0] == 0:
            raise InputError(["speed_range: must begin above 0 for powers of 1/V"])
        family: Family = PolynomialModel(
            A=A,
            B=B,
            C=C,
            variable="V" if variable == "V" else "1/V",
            search_range=limits,
            scale=scale,
            **labels,
        )
        return family, (), False
    if len(A) == 1:
        system = System(A[0], B[0], C[0], None, labels["names"], labels["units"])
        speed = 1.0 if speeds is None else float(speeds[0])
        return FixedModel(system, (speed, speed), scale), (), True
    if speeds is None:
        raise InputError([f"speeds: are missing; give one of each of the {len(A)} systems"])
    if np.any(np.diff(speeds) <= 0) or speeds[0] <= 0:
        raise InputError(["speeds: must be positive and strictly increasing"])
    states = source.word("states", ("same", "different"))
    made, notes = sampled(speeds, A, B, C, scale, same=_same(states), **labels)
    return made, notes, False


def _same(states: str | None) -> bool | None:
    return None if states is None else states == "same"


def _joined(said: Variables, stored: Sequence[Variables]) -> _Source:
    """Several files as one, their matrices stacked."""
    if len(stored) == 1:
        return _Source(said, stored[0])
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
    return _Source(said, first)


def _refuse_others(source: _Source) -> None:
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


def _matrices(source: _Source, count: int | None) -> tuple[Real, Real, Real]:
    """``A`` (k, n, n), ``B`` (k, n, m) and ``C`` (k, m, n) in whichever order of axes they are."""
    found = {}
    for name in ("A", "B", "C"):
        value = source.array(name, dims=3)
        if value is None:
            raise InputError([f"{name}: is missing in the file; it holds {_listed(source)}"])
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


def _listed(source: _Source) -> str:
    names = [name for name in source.stored if name.isprintable()][:12]
    return ", ".join(names)[:120] or "nothing"


def _count(labels: Mapping[str, tuple[str, ...]], outputs: int) -> None:
    problems = [
        f"{key}: need {outputs}, one an output, got {len(words)}"
        for key, words in labels.items()
        if words and len(words) != outputs
    ]
    if problems:
        raise InputError(problems)


# --- modal ---------------------------------------------------------------------------------------


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
    source = _Source(
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


def _modes(source: _Source) -> Modes:
    forces = _forces(source)
    n = forces.modes
    given = {}
    for name, key in (("mass", "M"), ("damping", "C"), ("stiffness", "K")):
        value = source.array(key, dims=2)
        if value is not None and value.shape in ((1, n), (n, 1)) and n > 1:
            value = value.ravel()
        if value is None and name != "damping":
            raise InputError([f"{key}: is missing; the file holds {_listed(source)}"])
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


def _damped(source: _Source, modes: Modes) -> Modes:
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


def _forces(source: _Source) -> TabulatedForces:
    Q = source.array("Q", dims=3, complex_too=True)
    k = source.array("k", dims=1)
    for name, value in (("Q", Q), ("k", k)):
        if value is None:
            raise InputError([f"{name}: is missing; the file holds {_listed(source)}"])
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
    source: _Source, modes: Modes
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
    _count(labels, len(rows))
    return rows, stiffness, _held(source.get("in_K"), len(rows)), labels


def _held(given: Any, count: int) -> list[bool]:
    if given is None:
        return [True] * count
    flags = np.asarray(given).ravel()
    if flags.dtype.kind not in "b" or flags.size not in (1, count):
        raise InputError([f"in_K: must be true, false or a list of {count} of them"])
    return [bool(flag) for flag in np.broadcast_to(flags, (count,))]


def _approximation(source: _Source) -> FitOptions:
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
