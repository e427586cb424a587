"""How results of proofs are laid out."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from aeroflutter.results.schema import Many, One, Value, View, layout

if TYPE_CHECKING:
    from aeroflutter.guarantees.absence import Absence
    from aeroflutter.model.section import Scale

LOWEST = layout(
    "speed_ratio=cycle.speed_ratio speed=cycle.speed amplitude=cycle.amplitude",
    "period=cycle.period kind stable",
    Value("proved", lambda one: False),
)


def _free(one: Any) -> View | None:
    """The interval that is proved free, None where there is none."""
    if one.free_below is None:
        return None
    unit = one.flutter_speed or float("nan")
    low, high = one.free.low, one.free.high
    return View(one.free, speed=high, speed_ratio=high / unit, low_ratio=low / unit)


def _pieces(one: Any) -> tuple[Any, ...]:
    """The pieces of the proof."""
    proved = one.free is not None and one.free.certificate is not None
    return one.free.certificate.pieces if proved else ()


def free_facts(free: Absence | None, flutter: float | None) -> dict[str, Any]:
    """The same for JSON and as attributes of files."""
    names = ("proved_free_from", "proved_free_below", "proved_free_below_ratio", "proved_certified")
    if free is None:
        return dict.fromkeys(names)
    ratio = free.high / flutter if flutter else None
    return dict(zip(names, (free.low, free.high, ratio, free.certified), strict=True))


def free_words(free: Absence, flutter: float | None, scale: Scale | None) -> str:
    """The same in words, rounded inwards."""
    unit = flutter or 1.0
    low, high = free.low / unit, math.floor(free.high / unit * 1e6) / 1e6
    start = "every speed" if low == 0.0 else f"from {low:.2g}"
    end = f"{'U*/U*_L' if flutter else 'U*'} = {high:.6f}"
    if scale is not None:
        end += f", {math.floor(scale.velocity(free.high) * 1e3) / 1e3:.7g} m/s"
    how = "certified" if free.certified else "not certified"
    return f"{start} to {end} ({how}; any start, any steady load)"


def alone_words(speed: float, certified: bool, flutter: float | None, scale: Scale | None) -> str:
    """One speed that is proved free, in words."""
    end = f"{'U*/U*_L' if flutter else 'U*'} = {speed / (flutter or 1.0):.6f}"
    if scale is not None:
        end += f", {scale.velocity(speed):.7g} m/s"
    how = "certified" if certified else "not certified"
    return f"at {end} alone ({how}; any start, any steady load)"


def _alone(one: Any) -> View | None:
    """The one speed that is proved free, None where there is none."""
    if one.free_at is None:
        return None
    speed, proof = one.free_at
    ratio = speed / (one.flutter_speed or float("nan"))
    return View(proof, speed=speed, speed_ratio=ratio)


ONSET = layout(
    "flutter_speed",
    Value("divergence_speed", "linear.divergence"),
    One(
        "proved_free_below",
        _free,
        layout=layout(
            "speed_ratio speed",
            Value("from", "low"),
            Value("from_ratio", "low_ratio"),
            "certified boxes",
        ),
    ),
    One("proved_free_at", _alone, layout=layout("speed_ratio speed certified")),
    One("lowest_cycle", "lowest", layout=LOWEST),
    One("lowest_stable_cycle", "lowest_stable", layout=LOWEST),
    Value("onset_gap", "gap", key="gap"),
    Many(
        "pieces",
        _pieces,
        layout=layout(
            Value("piece_low", "low", key="low"),
            Value("piece_high", "high", key="high"),
            Value("piece_lam", "lam", key="lam"),
            Value("piece_terms", lambda one: len(one.terms), key="terms"),
        ),
        dim="piece",
    ),
    "any_load notes",
    frame=("piece",),
)


def _needed(one: Any) -> tuple[View, ...]:
    """Friction over gap at every speed; NaN where no friction is known to be enough."""
    rows = zip(one.points, one.speed_ratios, one.exact_ratios, strict=True)
    return tuple(
        View(
            point, speed_ratio=ratio, proved_ratio=_finite(point.ratio), exact_ratio=_finite(exact)
        )
        for point, ratio, exact in rows
    )


def _finite(value: float) -> float:
    return value if np.isfinite(value) else float("nan")


CHART = layout(
    "flutter_speed",
    Value("friction_ratio", "own"),
    Many(
        "chart",
        _needed,
        layout=layout("speed_ratio speed proved_ratio exact_ratio certified"),
        dim="point",
    ),
    "notes",
)

LAYOUTS = {"Onset": ONSET, "Chart": CHART}
