"""Which layout belongs to a result."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from aeroflutter.errors import InputError
from aeroflutter.results import cycles, motions, proofs, studies
from aeroflutter.results.fields import Field, Kind
from aeroflutter.results.schema import Layout, Many, One, Value, layout

__all__ = ["layout_of"]

CROSSING = layout("speed k omega_ratio")
CROSSINGS = layout(*CROSSING.entries, "growing coalescence")
ROOT_LOCUS = layout(
    One("flutter", layout=CROSSING),
    Many("crossings", layout=CROSSINGS, dim="crossing", prefix="crossing_"),
    One("divergence", layout=layout(Value("speed", lambda speed: speed))),
    "unstable_at_low searched stiffness",
    Value("speed", "speeds", key="speeds", dims=("speed",)),
    Value("root", "roots", key="roots"),
    Value("mode", lambda one: np.arange(1, one.roots.shape[1] + 1), key=None),
    frame=("speed", "mode"),
)

PK = layout(
    One("flutter", layout=layout("speed k")),
    Many("crossings", layout=layout("speed k growing"), dim="crossing", prefix="crossing_"),
    One("divergence", layout=layout(Value("speed", lambda speed: speed))),
    Value("speed", "speeds", key="speeds", dims=("speed",)),
    Value(
        "damping",
        dims=("speed", "mode"),
        meaning=Field("damping g = 2 Re lambda/|Im lambda|"),
    ),
    Value(
        "frequency_hz",
        dims=("speed", "mode"),
        meaning=Field("frequency of each mode", Kind("Hz")),
    ),
    Value("mode", lambda one: np.arange(1, one.roots.shape[1] + 1), key=None),
    frame=("speed", "mode"),
)

# By the names of classes, so that no analysis is imported for it
LAYOUTS: dict[str, Layout] = {
    "PKResult": PK,
    "RootLocus": ROOT_LOCUS,
    **cycles.LAYOUTS,
    **motions.LAYOUTS,
    **proofs.LAYOUTS,
}


def members_layout(found: Any) -> Layout:
    """A family of results: the layout of one, along the members."""
    inner = layout_of(found.members[0].result)[1]
    one = layout("value", One("", lambda member: layout_of(member.result)[0], layout=inner))
    return layout(
        Value("vary", "key"),
        Many(
            "members",
            layout=one,
            dim="member",
            scale=lambda member: member.case.scale,
        ),
        Value("problems", lambda one: one.problems or None, optional=True),
        frame=("member", *inner.frame),
        coordinates=("value",),
    )


WRAPPED: dict[str, Callable[[Any], Any]] = {
    "HarmonicBranch": lambda one: cycles.Branches((one,)),
    "Sweep": motions.Pass,
}
MADE = studies.MADE
KNOWN = {*LAYOUTS, *WRAPPED, *MADE}


def layout_of(result: Any) -> tuple[Any, Layout]:
    """A result, or what it is wrapped in to be encoded, and its layout.

    Raises
    ------
    InputError
        If the object is not the result of an analysis.
    """
    if isinstance(result, tuple) and {*map(_name, result)} == {"HarmonicBranch"}:
        result = cycles.Branches(result)
    if type(result).__name__ == "Members":
        return result, members_layout(result)
    name = _name(result)
    if name in WRAPPED:
        return layout_of(WRAPPED[name](result))
    if name in MADE:
        return result, MADE[name](result)
    if name in LAYOUTS:
        return result, LAYOUTS[name]
    raise InputError(
        f"result: {type(result).__name__} is not the result of an analysis; give one of "
        f"{', '.join(sorted(KNOWN))}"
    )


def _name(result: Any) -> str:
    """The name of the class of a result; of a subclass, that of the class that it refines."""
    names = [c.__name__ for c in type(result).__mro__ if c.__module__.startswith("aeroflutter.")]
    return next((name for name in names if name in KNOWN), "")
