"""What every analysis and every result has in common: how it is entered, what can follow.

An analysis is written for a family of systems and a spring. Called with a case it takes both from
there, called with a section it makes the family. What it gives remembers the case, so that it can
be drawn, and turned into a Dataset, in the case's units.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Mapping
from copy import copy
from typing import Any, ClassVar, Self, TypeVar

import numpy as np

from aeroflutter import _later
from aeroflutter.errors import ConvergenceError, InputError

__all__ = ["SPEEDS", "Result", "Results", "analysis"]

SHOWN = 4  # entries of a tuple that a short repr lists
SPEEDS = ("speed", "speed_ratio", "velocity")

F = TypeVar("F", bound=Callable[..., Any])


class Result:
    """Base of the results of analyses: a short repr, figures, Datasets and DataFrames.

    Attributes
    ----------
    context
        The case it belongs to, as `case`, and what else its caller knows: `speed`, say.
    """

    context: ClassVar[Mapping[str, Any]] = {}

    def __init_subclass__(cls, **keywords: Any) -> None:
        super().__init_subclass__(**keywords)
        if "__repr__" not in vars(cls):  # which dataclasses then leave alone
            cls.__repr__ = Result.__repr__  # type: ignore[method-assign]

    def about(self, **context: Any) -> Self:
        """The same result, with what it belongs to."""
        known = copy(self)
        object.__setattr__(known, "context", {**self.context, **context})
        return known

    def __repr__(self) -> str:
        parts = [
            f"{name}={_short(value)}"
            for name, value in vars(self).items()
            if name != "context" and not name.startswith("_")
        ]
        return f"{type(self).__name__}({', '.join(parts)})"

    def _repr_html_(self) -> str:
        """Its facts as a table, for notebooks."""
        return str(_later("html")(self))

    def plot(self, ax: Any = None, **options: Any) -> Any:
        """Draw it as the command line does.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Draw the main panel there; a figure of all panels is made without.
        **options
            ``units="nondimensional"`` where the case has SI data; `title`.

        Returns
        -------
        Figure or Axes
            The figure that was made, or `ax`.
        """
        return _later("plot")(self, ax, **options)

    def to_dataset(self, case: Any = None) -> Any:
        """The result as an xarray Dataset, in SI units beside where its case has them."""
        return _later("dataset")(self, case=case or self.context.get("case"))

    def to_dataframe(self, case: Any = None) -> Any:
        """Its main table as a pandas DataFrame."""
        return _later("dataframe")(self, case=case or self.context.get("case"))


class Results(tuple[Any, ...], Result):
    """Several results of one analysis, such as the families of the harmonic balance."""

    def about(self, **context: Any) -> Self:
        """The same results, with what they belong to."""
        known = type(self)(self)
        known.context = {**self.context, **context}  # type: ignore[misc]
        return known

    def __repr__(self) -> str:
        return (
            f"{len(self)} of {self[0]!r}" if len(self) == 1 else f"({', '.join(map(repr, self))})"
        )


def _short(value: Any) -> str:
    """A value in a few words."""
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, np.ndarray):
        if value.ndim == 0:
            return _short(value.item())
        return f"<{' x '.join(map(str, value.shape))}>"
    if isinstance(value, tuple | list):
        plain = all(isinstance(one, (int, float, str)) for one in value)
        if plain and len(value) <= SHOWN:
            return f"({', '.join(map(_short, value))})"
        return f"<{len(value)}>"
    if value is None or isinstance(value, bool | int):
        return repr(value)
    if isinstance(value, str):
        return repr(value if len(value) <= 60 else value[:59] + "…")
    return f"<{type(value).__name__}>"


def is_case(subject: Any) -> bool:
    """Whether it is a case, of which nothing is known here but what it gives."""
    return hasattr(subject, "family") and hasattr(subject, "spring") and hasattr(subject, "text")


def family_of(subject: Any) -> tuple[Any, Any, Any]:
    """Family, spring and case of what an analysis is called with; None where there is none."""
    from aeroflutter.model.section import TypicalSection

    if is_case(subject):
        family, spring = subject.loop()
        return family, spring, subject
    if isinstance(subject, TypicalSection):
        from aeroflutter.model.aerodynamics import Wagner
        from aeroflutter.model.lure import SectionFamily

        return SectionFamily(subject, Wagner()), None, None
    if not (hasattr(subject, "at") and hasattr(subject, "stack")):
        raise InputError(
            "family: must be a Case, a TypicalSection or a family of systems, not "
            f"{type(subject).__name__}"
        )
    return subject, None, None


def placed(args: tuple[Any, ...], own: Any, keywords: Mapping[str, Any]) -> tuple[Any, ...]:
    """The arguments after the family, with the case's spring first where none is given."""
    if "spring" in keywords or own is None:
        return args
    first = args[0] if args else None
    given = hasattr(first, "describing") or (
        isinstance(first, tuple | list) and first and hasattr(first[0], "describing")
    )
    if given:
        return args
    return (own, *args[1:]) if args and first is None else (own, *args)


def speed_of(family: Any, case: Any, scale: Any, name: str, value: Any) -> Any:
    """U* of a speed by its name."""
    if name == "velocity":
        scale = scale or (case.scale if case is not None else None)
        if scale is None:
            raise InputError("velocity: needs a case, or a section, in SI units")
        return np.multiply(value, scale.speed(1.0))
    if name == "speed":
        return value

    from aeroflutter.linear.rootlocus import flutter_speed

    flutter = flutter_speed(family)
    if flutter is None:
        raise InputError("speed_ratio: there is no linear flutter speed to refer to; give speed")
    return np.multiply(value, flutter)


def scale_of(subject: Any) -> Any:
    """What turns a subject into SI units, if anything does."""
    return getattr(subject, "scale", None)


def bound(result: Any, context: Mapping[str, Any]) -> Any:
    """A result that knows what it belongs to."""
    known = {name: value for name, value in context.items() if value is not None}
    if isinstance(result, Result):
        return result.about(**known)
    if isinstance(result, tuple) and result and all(isinstance(one, Result) for one in result):
        return Results(one.about(**known) for one in result).about(**known)
    return result


def analysis(*, spring: bool = True, speed: str = "", relative: bool = False) -> Callable[[F], F]:
    """Let an analysis of a family be called with a case or a section as well.

    Parameters
    ----------
    spring
        Whether it takes a spring after the family.
    speed
        Its argument that is a speed, which may then be given as `speed`, `speed_ratio` or
        `velocity`.
    relative
        Whether that argument is a ratio to the flutter speed.
    """

    def decorate(function: F) -> F:
        @functools.wraps(function)
        def entered(family: Any, *args: Any, **keywords: Any) -> Any:
            found, own, case = family_of(family)
            if spring:
                args = placed(args, own, keywords)
                need_spring(function, args, keywords)
            for name in [n for n in SPEEDS if speed and n in keywords and n not in names]:
                value = speed_of(found, case, scale_of(family), name, keywords.pop(name))
                keywords[speed] = (
                    value / speed_of(found, case, None, "speed_ratio", 1.0) if relative else value
                )
            try:
                result = function(found, *args, **keywords)
            except np.linalg.LinAlgError as error:
                raise ConvergenceError(
                    f"{function.__name__}: {str(error).lower()}; some number of the case is too "
                    "far from the others to compute with"
                ) from error
            return bound(result, {"case": case})

        names = inspect.signature(function).parameters
        return entered  # type: ignore[return-value]

    return decorate


def need_spring(
    function: Callable[..., Any], args: tuple[Any, ...], keywords: Mapping[str, Any]
) -> None:
    """Refuse an analysis of a spring that is given none."""
    if not args and "spring" not in keywords:
        raise InputError(f"spring: {function.__name__} needs the spring of the section")
