"""The keys of a case file: one pydantic model a table, one metadata record a key.

The models check names, types and finiteness; what the numbers may be is checked by the section,
the aerodynamics and the springs themselves. The metadata word the error messages and the file
that `aeroflutter init` writes, so that a key is described in one place only.
"""

from __future__ import annotations

from copy import copy
from functools import cache
from typing import Annotated, Any, Literal

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    ValidationInfo,
    create_model,
    field_validator,
)
from pydantic.config import JsonDict
from pydantic_core import PydanticCustomError

LARGEST = 1e12
"""No number of a case may be larger in size: beyond it the matrices overflow sooner or later."""
SMALLEST = 1e-30
"""Nor may a positive one be smaller: its powers would be zero, although it says that it is not."""

Number = Annotated[float, Field(ge=-LARGEST, le=LARGEST, allow_inf_nan=False)]

NUMBER = "a finite number"
POSITIVE = "a positive number"
NOT_NEGATIVE = "a number, zero or positive"
NUMBERS = "a list of finite numbers"


def key(allowed: str, meaning: str, default: Any = ..., example: str = "") -> Any:
    """A key of a table; `example` stands in the written file where there is no default."""
    extra: JsonDict = {"allowed": allowed, "example": example}
    return Field(default, description=meaning, json_schema_extra=extra)


def metadata(model: type[Table], name: str) -> dict[str, str]:
    """The keys `allowed`, `example` and `meaning` of one key of a table."""
    field = model.model_fields[name]
    assert isinstance(field.json_schema_extra, dict)  # every field is made by key()
    return {"meaning": field.description or "", **field.json_schema_extra}  # type: ignore[dict-item]


class Table(BaseModel):
    """A table of a case file: no other keys, no conversions of type."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, defer_build=True)

    @field_validator("*")
    @classmethod
    def _not_too_small(cls, value: Any, about: ValidationInfo) -> Any:
        if isinstance(value, float) and 0.0 < value < SMALLEST:
            assert about.field_name is not None
            if metadata(cls, about.field_name)["allowed"] in (POSITIVE, NOT_NEGATIVE):
                raise PydanticCustomError("too_small", "too small")
        return value


class Dimensional(Table):
    """`[section.si]`: the section per unit span in SI units."""

    m: Number = key(POSITIVE, "mass per unit span, kg/m", example="24.05")
    b: Number = key(POSITIVE, "semi-chord, m", example="0.25")
    rho: Number = key(POSITIVE, "air density, kg/m^3", example="1.225")
    x_cg: Number | None = key(NUMBER, "centre of mass behind the elastic axis, m", None, "0.0625")
    S: Number | None = key(NUMBER, "or: static moment m x_cg, kg", None, "1.503")
    cg_percent_chord: Number | None = key(
        NUMBER, "or: centre of mass, per cent of the chord from the nose", None, "37.5"
    )
    I_alpha: Number | None = key(
        POSITIVE, "moment of inertia about the elastic axis, kg m", None, "0.3758"
    )
    r: Number | None = key(POSITIVE, "or: radius of gyration about it, m", None, "0.125")
    K_h: Number | None = key(POSITIVE, "heave stiffness, N/m^2", None, "38480.0")
    omega_h: Number | None = key(POSITIVE, "or: uncoupled heave frequency, rad/s", None, "40.0")
    frequency_h_hz: Number | None = key(POSITIVE, "or: uncoupled heave frequency, Hz", None, "6.4")
    K_alpha: Number | None = key(
        POSITIVE, "pitch stiffness, N m/rad a metre of span", None, "939.5"
    )
    omega_alpha: Number | None = key(POSITIVE, "or: uncoupled pitch frequency, rad/s", None, "50.0")
    frequency_alpha_hz: Number | None = key(
        POSITIVE, "or: uncoupled pitch frequency, Hz", None, "8.0"
    )
    m_heave: Number | None = key(
        "a number, m or larger",
        "mass that heaves, supports included, kg/m; m by default",
        None,
        "24.05",
    )
    c_h: Number | None = key(
        NOT_NEGATIVE, "or: damper in heave, N s/m^2, in place of zeta_xi", None, "10.0"
    )
    c_alpha: Number | None = key(
        NOT_NEGATIVE, "or: damper in pitch, N s, in place of zeta_alpha", None, "0.1"
    )
    c_beta: Number | None = key(
        NOT_NEGATIVE, "or: damper of the flap, N s, in place of zeta_beta", None, "0.001"
    )
    a_h: Number | None = key(NUMBER, "as in [section]", None)
    axis_percent_chord: Number | None = key(NUMBER, "as in [section]", None)
    zeta_alpha: Number | None = key(NOT_NEGATIVE, "as in [section]", None)
    zeta_xi: Number | None = key(NOT_NEGATIVE, "as in [section]", None)


_AXIS = key(NUMBER, "elastic axis behind mid-chord, in semi-chords", -0.5)
_AXIS_PERCENT = key(NUMBER, "or: elastic axis, per cent of the chord from the nose", None, "25.0")
_PITCH_DAMPING = key(NOT_NEGATIVE, "viscous damping ratio of pitch", 0.0)
_HEAVE_DAMPING = key(NOT_NEGATIVE, "viscous damping ratio of heave", 0.0)
_DAMPING = key(
    '"coordinate" or "modal"', 'whose ratios these are; "modal": of the coupled modes', "coordinate"
)


class Section(Table):
    """`[section]`: the typical section, nondimensional."""

    mu: Number = key(POSITIVE, "mass ratio m/(pi rho b^2)", 100.0)
    a_h: Number = _AXIS
    axis_percent_chord: Number | None = _AXIS_PERCENT
    x_alpha: Number = key(NUMBER, "centre of mass behind the elastic axis, in semi-chords", 0.25)
    cg_percent_chord: Number | None = key(
        NUMBER, "or: centre of mass, per cent of the chord from the nose", None, "37.5"
    )
    r_alpha: Number = key(
        "a number larger than |x_alpha|",
        "radius of gyration about the elastic axis, in semi-chords",
        0.5,
    )
    omega_bar: Number = key(
        POSITIVE, "ratio of the uncoupled heave and pitch frequencies", example="0.8"
    )
    zeta_alpha: Number = _PITCH_DAMPING
    zeta_xi: Number = _HEAVE_DAMPING
    damping: Literal["coordinate", "modal"] = _DAMPING
    heave_mass: Number = key(
        "a number, one or larger", "mass that heaves, supports included, over m", 1.0
    )


class DimensionalSection(Table):
    """`[section]` beside a table `[section.si]`: what that one does not say."""

    a_h: Number = _AXIS
    axis_percent_chord: Number | None = _AXIS_PERCENT
    zeta_alpha: Number = _PITCH_DAMPING
    zeta_xi: Number = _HEAVE_DAMPING
    damping: Literal["coordinate", "modal"] = _DAMPING


_HINGE = key("a number between -1 and 1", "hinge behind mid-chord, in semi-chords", example="0.5")
_FLAP_DAMPING = key(NOT_NEGATIVE, "viscous damping ratio of the flap", 0.0)


class FlapKeys(Table):
    """`[flap]`: a trailing-edge flap, nondimensional."""

    hinge: Number = _HINGE
    x_beta: Number = key(NUMBER, "static moment about the hinge over m b", example="0.0125")
    r_beta: Number = key(
        POSITIVE,
        "radius of gyration sqrt(I_beta/m), semi-chords",
        example="0.08",
    )
    omega_beta: Number = key(POSITIVE, "uncoupled flap over pitch frequency", example="4.0")
    zeta_beta: Number = _FLAP_DAMPING


class DimensionalFlap(Table):
    """`[flap.si]`: the flap per unit span in SI units."""

    S_beta: Number = key(NUMBER, "static moment of the flap about its hinge, kg", example="0.075")
    I_beta: Number = key(POSITIVE, "its moment of inertia about the hinge, kg m", example="0.0096")
    K_beta: Number | None = key(POSITIVE, "hinge stiffness, N/rad", None, "385.0")
    omega_beta: Number | None = key(POSITIVE, "or: uncoupled flap frequency, rad/s", None, "200.0")


class FlapBesideSI(Table):
    """`[flap]` beside a table `[flap.si]`: what that one does not say."""

    hinge: Number = _HINGE
    zeta_beta: Number = _FLAP_DAMPING


class QuasiSteadyKeys(Table):
    """Lift without lag."""

    model: Literal["quasi-steady"] = "quasi-steady"


class QuasiSteadyRatesKeys(Table):
    """Lift without lag, of rates as well, and the mass of the air: C(k) = 1."""

    model: Literal["quasi-steady-rates"] = "quasi-steady-rates"


class WagnerKeys(Table):
    """Indicial lift phi = 1 - sum a_i exp(-b_i tau)."""

    model: Literal["wagner"] = "wagner"
    indicial: Literal["jones", "four-term", "six-term", "ten-term"] | None = key(
        '"jones", "four-term", "six-term" or "ten-term"',
        "named terms: the more, the nearer to Theodorsen's C(k)",
        None,
        '"jones"',
    )
    a: list[Number] | None = key(
        "a list of numbers with a sum below 1",
        "or coefficients of one's own",
        None,
        "[0.165, 0.335]",
    )
    b: list[Number] | None = key(
        "a list of positive numbers, as many as in a",
        "decay rates per unit of tau = V t/b",
        None,
        "[0.0455, 0.3]",
    )


class LinearKeys(Table):
    """Linear spring F = alpha."""

    kind: Literal["linear"] = "linear"


class CubicKeys(Table):
    """Cubic spring F = beta1 alpha + beta3 alpha^3 (radians)."""

    kind: Literal["cubic"] = "cubic"
    beta1: Number = key(NUMBER, "slope at the origin", 1.0)
    beta3: Number = key(NUMBER, "cubic coefficient, per rad^2", example="3.0")


class TableKeys(Table):
    """Measured moment-rotation table, straight between its points."""

    kind: Literal["table"] = "table"
    pitch_deg: list[Number] = key(
        "a list of at least two ascending numbers", "pitch, degrees", example="[-1.0, 0.0, 1.0]"
    )
    moment_deg: list[Number] = key(
        "a list of numbers, as many as in pitch_deg",
        "moment, degrees of a spring of unit slope",
        example="[-0.8, 0.0, 0.8]",
    )


class BilinearKeys(Table):
    """Bilinear with preload: unit slope outside a flat of slope m_f."""

    kind: Literal["bilinear"] = "bilinear"
    m0_deg: Number = key(NUMBER, "moment at the start of the flat (preload), degrees", 0.0)
    m_f: Number = key(NUMBER, "slope of the flat", 0.0)
    alpha_f_deg: Number = key(NUMBER, "pitch at the start of the flat, degrees", example="0.25")
    delta_deg: Number = key(NOT_NEGATIVE, "width of the flat, degrees", example="0.5")


class FreeplayKeys(Table):
    """Freeplay: no moment inside the gap, unit slope outside."""

    kind: Literal["freeplay"] = "freeplay"
    gap_deg: Number = key(NOT_NEGATIVE, "full width of the gap, degrees", example="1.0")
    centre_deg: Number = key(NUMBER, "pitch at the middle of the gap, degrees", 0.0)


class HysteresisKeys(Table):
    """Hysteresis loop: freeplay with friction, unit slope outside."""

    kind: Literal["hysteresis"] = "hysteresis"
    delta_v_deg: Number | None = key(
        NOT_NEGATIVE, "height of the loop: twice the friction, degrees", None, "1.0"
    )
    friction_deg: Number | None = key(
        NOT_NEGATIVE, "or: friction to either side, degrees", None, "0.5"
    )
    delta_h_deg: Number | None = key(
        NOT_NEGATIVE, "width of the loop: the whole gap, degrees", None, "0.2"
    )
    gap_deg: Number | None = key(NOT_NEGATIVE, "or: the same by its other name", None, "0.2")
    v_off_deg: Number = key(NUMBER, "offset of the loop along the moment axis, degrees", 0.0)
    h_off_deg: Number = key(NUMBER, "offset of the loop along the pitch axis, degrees", 0.0)


class PolynomialKeys(Table):
    """Polynomial F = beta_1 alpha + beta_2 alpha^2 + ... (radians)."""

    kind: Literal["polynomial"] = "polynomial"
    beta: list[Number] = key(
        "a list of 1 to 16 numbers",
        "coefficients from the first order on",
        example="[1.0, 0.0, 3.0]",
    )


class SaturationKeys(Table):
    """Saturation: a straight line up to a limit, constant beyond."""

    kind: Literal["saturation"] = "saturation"
    limit_deg: Number = key(POSITIVE, "pitch at which it saturates, degrees", example="1.0")
    slope: Number = key(NUMBER, "slope below the limit", 1.0)


class DeadZoneKeys(Table):
    """Dead zone: no moment inside the gap, a slope outside."""

    kind: Literal["dead-zone"] = "dead-zone"
    gap_deg: Number = key(POSITIVE, "full width of the gap, degrees", example="1.0")
    slope: Number = key(NUMBER, "slope outside the gap", 1.0)


class RelayKeys(Table):
    """Relay: a moment that jumps from one sign to the other."""

    kind: Literal["relay"] = "relay"
    moment_deg: Number = key(POSITIVE, "size of the moment, degrees", example="0.5")
    width_deg: Number = key(NOT_NEGATIVE, "total width of the hysteresis, degrees", 0.0)


class PlayKeys(Table):
    """Play (backlash): an output that follows behind a slack."""

    kind: Literal["play"] = "play"
    delta_v_deg: Number = key(POSITIVE, "total slack, degrees", example="0.5")


class FrictionKeys(Table):
    """Coulomb friction beside a linear spring: it sticks."""

    kind: Literal["friction"] = "friction"
    friction_deg: Number = key(POSITIVE, "friction to either side, degrees", example="0.5")
    beta1: Number = key(NUMBER, "slope of the spring beside it", 1.0)


class Start(Table):
    """`[initial]`: what may stand there for any model."""

    state: list[Number] | None = key(
        "a list of numbers, one a state",
        "in place of all above: every state (rad, semi-chords)",
        None,
        "[0.1, 0.0]",
    )
    memory: list[Number] | None = key(
        "a list of numbers, one a spring that remembers", "of the springs (rad)", None, "[0.01]"
    )


class Initial(Start):
    """`[initial]`: the motion at tau = 0."""

    alpha_deg: Number = key(NUMBER, "pitch, degrees", 6.0)
    alpha_rate_deg: Number = key(NUMBER, "pitch rate, degrees per unit of tau", 0.0)
    xi: Number = key(NUMBER, "heave, semi-chords (down is positive)", 0.0)
    xi_rate: Number = key(NUMBER, "heave rate, semi-chords per unit of tau", 0.0)


class FlapInitial(Initial):
    """`[initial]` of a section with a flap."""

    beta_deg: Number = key(NUMBER, "flap angle, degrees (trailing edge down is positive)", 0.0)
    beta_rate_deg: Number = key(NUMBER, "flap rate, degrees per unit of tau", 0.0)


AERODYNAMICS: dict[str, type[Table]] = {
    "wagner": WagnerKeys,
    "quasi-steady": QuasiSteadyKeys,
    "quasi-steady-rates": QuasiSteadyRatesKeys,
}

SPRINGS: dict[str, type[Table]] = {
    "linear": LinearKeys,
    "cubic": CubicKeys,
    "table": TableKeys,
    "bilinear": BilinearKeys,
    "freeplay": FreeplayKeys,
    "hysteresis": HysteresisKeys,
    "polynomial": PolynomialKeys,
    "saturation": SaturationKeys,
    "dead-zone": DeadZoneKeys,
    "relay": RelayKeys,
    "play": PlayKeys,
    "friction": FrictionKeys,
}

_NAMES_IN_HEAVE = {"pitch_deg": "displacement", "moment_deg": "force"}


def name_in_heave(name: str, model: type[Table]) -> str:
    """Key of a spring in heave: it is no angle, so nothing is in degrees."""
    renamed = _NAMES_IN_HEAVE if model is TableKeys else {}
    return renamed.get(name, name.removesuffix("_deg"))


@cache
def in_heave(model: type[Table]) -> type[Table]:
    """Keys of a kind of spring where it is one in heave, in semi-chords."""
    fields: dict[str, Any] = {}
    for name, field in model.model_fields.items():
        info = copy(field)
        words = (field.description or "").replace("degrees", "semi-chords")
        info.description = words.replace("pitch", "heave").replace("moment", "force")
        fields[name_in_heave(name, model)] = (field.annotation, info)
    made: type[Table] = create_model(
        f"{model.__name__}InHeave", __base__=Table, __doc__=model.__doc__, **fields
    )
    return made


TABLES: dict[str, tuple[type[Table], ...]] = {
    "section": (Section,),
    "section.si": (Dimensional,),
    "flap": (FlapKeys,),
    "flap.si": (DimensionalFlap,),
    "aerodynamics": tuple(AERODYNAMICS.values()),
    "spring": tuple(SPRINGS.values()),
    "initial": (FlapInitial,),
}
"""Where every key may stand, to say where a misplaced one belongs."""
