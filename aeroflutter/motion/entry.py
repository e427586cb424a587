"""How analyses of one motion are entered: with a system, or with a case and a speed."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, TypeVar

from aeroflutter.analysis import (
    SPEEDS,
    bound,
    family_of,
    is_case,
    need_spring,
    placed,
    scale_of,
    speed_of,
)
from aeroflutter.errors import InputError

__all__ = ["at_a_speed"]

F = TypeVar("F", bound=Callable[..., Any])


def at_a_speed(function: F) -> F:
    """Let an analysis of a system be called with a case, a section or a family, and a speed.

    The speed is `speed` (U*), `speed_ratio` or `velocity` (m/s). The initial motion of a case is
    that of its file.
    """

    @functools.wraps(function)
    def entered(system: Any, *args: Any, **keywords: Any) -> Any:
        given = {name: keywords.pop(name) for name in SPEEDS if name in keywords}
        if not given and not is_case(system):
            return function(system, *args, **keywords)
        if len(given) != 1:
            raise InputError("speed: give one of speed, speed_ratio and velocity")
        family, own, case = family_of(system)
        args = placed(args, own, keywords)
        need_spring(function, args, keywords)
        speed = float(speed_of(family, case, scale_of(system), *next(iter(given.items()))))
        if case is not None and len(args) < 2 and "initial" not in keywords:
            from aeroflutter.motion.response import Initial  # which is written with this

            keywords["initial"] = Initial(**case.initial._asdict())
        result = function(family.at(speed), *args, **keywords)
        return bound(result, {"case": case, "speed": speed})

    return entered  # type: ignore[return-value]
