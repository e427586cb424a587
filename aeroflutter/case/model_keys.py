"""The keys of `[model]`: a state space or a modal model from a file."""

from __future__ import annotations

from typing import Any, Literal

from aeroflutter.case.schema import NUMBER, NUMBERS, POSITIVE, Number, Start, Table, key

__all__ = ["INITIAL", "MODELS", "ModalKeys", "ModelInitial", "StateSpaceKeys"]

_FILE = key(
    "the name of a file, or a list of them, one a speed", "file of the model", example='"x"'
)
_NAMES = key("a list of names", "of the outputs that may carry springs", None)
_UNITS = key('a list of "rad" or "m"', "of these outputs", None)
_RANGE = key("two ascending numbers", "speeds searched, m/s", None)
_MATRIX = "a name in the file, a list of numbers (a diagonal) or a list of rows"
_SEMICHORD = key(POSITIVE, "length b in k = omega b/V, m", None)
_SPEEDS = key(NUMBERS, "speeds at which it is given, m/s", None)


class StateSpaceKeys(Table):
    """`[model]` with kind = "state-space": x' = A x - B F(C x), springs removed."""

    kind: Literal["state-space"] = "state-space"
    file: Any = _FILE
    time_unit: Any = key('"s" or "semichord"', "unit of the time in x'", None)
    speeds: Any = _SPEEDS
    variable: Any = key(
        '"V" or "1/V"', "A, B and C hold the coefficients of powers of it, from 0 on", None
    )
    states: Any = key('"same" or "different"', "whether all speeds have the same states", None)
    semichord: Number | None = _SEMICHORD
    names: Any = _NAMES
    units: Any = _UNITS
    speed_range: Any = _RANGE


class ModalKeys(Table):
    """`[model]` with kind = "modal": M q'' + C q' + K q = 1/2 rho V^2 Q(ik) q."""

    kind: Literal["modal"] = "modal"
    file: Any = _FILE
    M: Any = key(_MATRIX, "generalised masses", None)
    C: Any = key(_MATRIX, "generalised damping", None)
    K: Any = key(_MATRIX, "generalised stiffness", None)
    Q: Any = key("a name in the file", "generalised air forces, one matrix a k", None)
    k: Any = key(NUMBERS, "reduced frequencies of Q, one a matrix", None)
    mach: Any = key(NUMBERS, "Mach numbers of Q, one a matrix", None)
    at_mach: Number | None = key(NUMBER, "the Mach number that is taken", None)
    zeta: Any = key("a number or a list of them", "damping ratio of each mode, beside C", None)
    semichord: Number | None = _SEMICHORD
    density: Number | None = key(POSITIVE, "air density, kg/m^3", None)
    names: Any = _NAMES
    units: Any = _UNITS
    rows: Any = key("a list of rows", "twist of each spring a unit of each coordinate", None)
    stiffness: Any = key(NUMBERS, "nominal stiffness of each spring, N m/rad or N/m", None)
    in_K: Any = key("true, false, or a list of them", "whether K holds these stiffnesses", None)
    method: Any = key('"roger" or "minimum-state"', "form of the approximation of Q", None)
    lags: Any = key("a number of them, or their roots", "lag roots of the approximation", None)
    exact: Any = key(NUMBERS, "reduced frequencies at which it is exact", None)
    emphasis: Any = key(NUMBERS, "reduced frequencies at which it is close", None)
    weights: Any = key(NUMBERS, "weight of each k", None)
    apparent_mass: Any = key("true or false", "whether it has a term A2 (ik)^2", None)
    speed_range: Any = _RANGE


class ModelInitial(Start):
    """`[initial]` of a model."""

    alpha_deg: Number | None = key(
        NUMBER, "displacement of the first spring, degrees where it is an angle", None
    )


MODELS: dict[str, type[Table]] = {"state-space": StateSpaceKeys, "modal": ModalKeys}
INITIAL = ModelInitial
