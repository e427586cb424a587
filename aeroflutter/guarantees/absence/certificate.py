"""What a proof of absence consists of: exact numbers, saved as JSON.

Every number is a double, and stands for exactly itself: a reader of the file who rounds its
decimals to the nearest double has the certificate, bit for bit.
"""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from aeroflutter.errors import InputError

__all__ = ["Certificate", "Linear", "Loop", "Piece", "Static"]

_FORMAT = "aeroflutter absence 1"

Row = tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class Linear:
    """``x' = (A0 + A1 v + …) x - (b0 + b1 v + …) F(c x)`` with ``v = 1/U``.

    Attributes
    ----------
    A
        Matrices A0, A1, …, rows as tuples.
    b
        Columns b0, b1, … .
    c
        Row that picks the spring's coordinate.
    """

    A: tuple[tuple[Row, ...], ...]
    b: tuple[Row, ...]
    c: Row


@dataclass(frozen=True, kw_only=True)
class Loop:
    """Hysteresis of height `delta_v` and width `delta_h`, rad; its offsets do not matter."""

    delta_v: float
    delta_h: float


@dataclass(frozen=True, kw_only=True)
class Static:
    """A function of the coordinate whose slopes lie between `low` and `high`."""

    low: float
    high: float


@dataclass(frozen=True, kw_only=True)
class Piece:
    """The multiplier that proves an interval of speeds.

    Attributes
    ----------
    low, high
        The interval; `low` = 0 is left out, every speed above it is not.
    w
        Weight of the stored energy; one for a loop.
    lam
        λ, weight of the rates; not negative.
    terms
        Pairs (t, c). For a loop: t > 0 and any c; for a static law: any t and c > 0.
    """

    low: float
    high: float
    w: float = 1.0
    lam: float = 0.0
    terms: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True, kw_only=True)
class Certificate:
    """A claim: with this spring nothing oscillates at any speed that its pieces cover.

    It proves nothing until `check` of `aeroflutter.guarantees.absence.checker` has accepted it.

    Attributes
    ----------
    model
        The linear system.
    spring
        The law.
    pieces
        In ascending order, each beginning where the one before it ends.
    """

    model: Linear
    spring: Loop | Static
    pieces: tuple[Piece, ...]

    @property
    def speeds(self) -> tuple[float, float]:
        """Lowest and highest speed claimed."""
        return self.pieces[0].low, self.pieces[-1].high

    def save(self, path: Path | str) -> None:
        """Write the certificate as JSON."""
        from aeroflutter.files import replacing

        content = {"format": _FORMAT, "spring_kind": type(self.spring).__name__} | asdict(self)
        with replacing(Path(path)) as part:
            part.write_text(json.dumps(content, allow_nan=False, indent=1), encoding="utf-8")

    @classmethod
    def load(cls, path: Path | str) -> Certificate:
        """Read a certificate that `save` wrote.

        Raises
        ------
        InputError
            If the file is none.
        """
        from aeroflutter.files import read_bytes

        try:
            content = json.loads(read_bytes(Path(path), str(path)).decode("utf-8"))
            if content["format"] != _FORMAT:
                raise ValueError(content["format"])
            kinds: dict[str, type[Any]] = {"Loop": Loop, "Static": Static}
            model = {name: _frozen(content["model"][name]) for name in "Abc"}
            n = len(model["c"])
            _shaped(model["A"], None, n, n)
            _shaped(model["b"], None, n)
            _shaped(model["c"], n)
            return cls(
                model=Linear(**model),
                spring=kinds[content["spring_kind"]](
                    **{name: _number(v) for name, v in content["spring"].items()}
                ),
                pieces=tuple(
                    _piece({name: _frozen(value) for name, value in piece.items()})
                    for piece in content["pieces"]
                ),
            )
        except (
            *(OSError, ValueError, LookupError, TypeError, AttributeError),
            *(RecursionError, OverflowError),
        ) as error:
            why = f"{type(error).__name__}: {error}"[:200]
            raise InputError(f"{path}: holds no certificate of this program ({why})") from None


def _frozen(value: Any) -> Any:
    return tuple(map(_frozen, value)) if isinstance(value, list) else _number(value)


def _piece(values: dict[str, Any]) -> Piece:
    for name, value in values.items():
        _shaped(value, *((None, 2) if name == "terms" else ()))
    return Piece(**values)


def _shaped(value: Any, *shape: int | None) -> None:
    """Refuse nested tuples that are not of a shape; None stands for any number of them."""
    if not shape:
        if isinstance(value, tuple):
            raise ValueError("a list stands for a number")
        return
    if not isinstance(value, tuple) or shape[0] not in (None, len(value)):
        raise ValueError(f"{len(value) if isinstance(value, tuple) else 'a number'} for {shape}")
    for one in value:
        _shaped(one, *shape[1:])


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise ValueError(f"{value!r} is not a finite number")
    return float(value)
