"""The options that give an airspeed, the same in every command: ratio, U*, or m/s."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from aeroflutter.cli.numbers import numbers
from aeroflutter.errors import InputError
from aeroflutter.model.family import too_slow

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from aeroflutter.case import Case
    from aeroflutter.model.section import Scale

__all__ = [
    "Airspeed",
    "AirspeedRange",
    "Airspeeds",
    "axis_of_speeds",
    "pair",
    "scale_of",
    "several_speeds",
    "unit",
]

Text = Annotated[str | None, Parameter(allow_leading_hyphen=True)]
EXACTLY_ONE = "--speed-ratio or --speed or --velocity: give exactly one of the three"


POSITIVE = {
    "--speed-ratio": "a positive number",
    "--speed": "positive, in units of b omega_alpha",
    "--velocity": "positive, in m/s",
}


class _Given:
    """What three options say, of which one is given."""

    speed_ratio: str | None
    speed: str | None
    velocity: str | None

    def given(self, required: str = "", excluded: str = "") -> tuple[str, str] | None:
        """Option and text of the one that is given.

        Parameters
        ----------
        required
            What to say where there is none; empty where there may be none.
        excluded
            What to say where there are several.
        """
        pairs = (
            ("--speed", self.speed),
            ("--speed-ratio", self.speed_ratio),
            ("--velocity", self.velocity),
        )
        found = [(name, text) for name, text in pairs if text is not None]
        if len(found) > 1:
            names = ", ".join(name for name, _ in found)
            raise InputError(excluded or required or f"{names}: give one of the two, not both")
        if not found and required:
            raise InputError(required)
        return found[0] if found else None

    def speeds(
        self, case: Case, required: str = "", excluded: str = ""
    ) -> NDArray[np.float64] | None:
        """U*, (n,), of what is given, None where nothing is; of a model of one speed, that one.

        Raises
        ------
        InputError
            If a number is not positive, there is no flutter speed to refer to, or no scale.
        """
        if case.one_speed:
            import numpy as np

            if (extra := self.given()) is not None:
                raise InputError(f"{extra[0]}: the model is given at one speed; remove it")
            return np.array([case.model().search_range[0]])
        one = self.given(required, excluded)
        if one is None:
            return None
        option, text = one
        values = numbers(option, text)
        if not (values > 0.0).all():
            raise InputError(f"{option}: must be {POSITIVE[option]}, not {text}")
        speeds = values * unit(option, case)
        too_slow(float(speeds.min()))
        return speeds


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class Airspeed(_Given):
    """One airspeed."""

    speed_ratio: Annotated[
        Text, Parameter(help="Airspeed over the linear flutter speed, U*/U*_L.")
    ] = None
    speed: Annotated[Text, Parameter(help="Airspeed U* = V/(b omega_alpha).")] = None
    velocity: Annotated[Text, Parameter(help="Airspeed V in m/s, where the case has SI data.")] = (
        None
    )

    def one(self, case: Case, required: str = "", excluded: str = "") -> float | None:
        """U* of what is given, None where nothing is."""
        values = self.speeds(case, required, excluded)
        if values is None:
            return None
        if values.size != 1:
            found = self.given()
            raise InputError(f"{found[0] if found else ''}: takes one airspeed, not {values.size}")
        return float(values[0])


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class Airspeeds(_Given):
    """One airspeed, or several."""

    speed_ratio: Annotated[
        Text,
        Parameter(help="Airspeeds over the linear flutter speed, U*/U*_L: R, A:B:N or a,b,c."),
    ] = None
    speed: Annotated[
        Text, Parameter(help="Airspeeds U* = V/(b omega_alpha): U, A:B:N or a,b,c.")
    ] = None
    velocity: Annotated[
        Text,
        Parameter(help="Airspeeds V in m/s, where the case has SI data: V, A:B:N or a,b,c."),
    ] = None


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class AirspeedRange:
    """The airspeeds between which cycles are sought."""

    speed_ratio_range: Annotated[
        str | None, Parameter(help="Lowest and highest speed ratio searched, as low,high.")
    ] = None
    velocity_range: Annotated[
        str | None,
        Parameter(help="Lowest and highest airspeed in m/s, low,high, where the case has SI data."),
    ] = None

    def ratios(self, case: Case, default: tuple[float, float]) -> tuple[float, float]:
        """Lowest and highest U*/U*_L."""
        if self.speed_ratio_range is not None and self.velocity_range is not None:
            raise InputError("--speed-ratio-range, --velocity-range: give one of the two, not both")
        if self.velocity_range is not None:
            low, high = pair("--velocity-range", self.velocity_range)
            per = unit("--velocity", case) / unit("--speed-ratio", case)
            return low * per, high * per
        if self.speed_ratio_range is None:
            return default
        return pair("--speed-ratio-range", self.speed_ratio_range)


def pair(option: str, text: str) -> tuple[float, float]:
    """Two numbers of an option, the lower one first and both positive."""
    values = numbers(option, text)
    if values.size != 2 or not 0 < values[0] < values[1]:
        raise InputError(f'{option}: "{text}" must be low,high with 0 < low < high')
    return float(values[0]), float(values[1])


def unit(option: str, case: Case) -> float:
    """U* of one unit of `--speed`, `--speed-ratio` or `--velocity`."""
    if option == "--velocity":
        return scale_of(case, option).speed(1.0)
    if option == "--speed":
        return 1.0
    from aeroflutter.linear.rootlocus import flutter_speed

    found = flutter_speed(case.loop()[0])
    if found is None:
        raise InputError(
            f"{option}: the section has no linear flutter speed to refer to; give --speed"
        )
    return found


def axis_of_speeds(option: str, text: str, case: Case) -> NDArray[np.float64]:
    """U* of an option that takes speed ratios A:B:N, or `velocity=A:B:N` or `speed=A:B:N`.

    Raises
    ------
    InputError
        If it takes neither, or a number is not positive.
    """
    name, equals, rest = text.partition("=")
    kind = "--" + name.strip().replace("_", "-") if equals else "--speed-ratio"
    if kind not in ("--speed-ratio", "--speed", "--velocity"):
        raise InputError(f'{option}: "{name}" is no airspeed; give A:B:N, or velocity=A:B:N')
    values = numbers(option, rest if equals else text)
    if not (values > 0.0).all():
        raise InputError(f"{option}: every airspeed must be positive")
    return values * unit(kind, case)


def several_speeds(
    case: Case,
    instead: str = "there is no curve over it; `lco` lists the cycles there are",
) -> None:
    """Refuse a model of one speed where airspeeds vary.

    Parameters
    ----------
    instead
        What there is not, and what takes such a model.

    Raises
    ------
    InputError
        If the case is one.
    """
    if case.one_speed:
        raise InputError(f"{case.source}: model.speeds: is one speed, so {instead}")


def scale_of(case: Case, option: str) -> Scale:
    """What turns numbers into SI units.

    Raises
    ------
    InputError
        If the case has none.
    """
    if case.scale is None:
        raise InputError(f"{option}: needs a case in SI units, with a table [section.si]")
    return case.scale
