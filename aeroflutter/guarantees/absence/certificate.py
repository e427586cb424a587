"""What a proof of absence consists of: exact numbers, saved as JSON.

Every number is a double, and stands for exactly itself: a reader of the file who rounds its
decimals to the nearest double has the certificate, bit for bit. A file carries a digest of them:
one in which a number has been changed is no longer what was saved, and is not read, even where
what it then says is true. The digest guards against accidents and proves nothing.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, TypeVar

from aeroflutter.errors import InputError

__all__ = ["Certificate", "Joint", "Linear", "Loop", "Piece", "Static"]

_FORMAT, _JOINT = "aeroflutter absence 1", "aeroflutter absence of two springs 1"

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

    @property
    def digest(self) -> str:
        """SHA-256 of every number, exactly, in hexadecimal."""
        return _digest(type(self.spring).__name__, self)

    def save(self, path: Path | str) -> None:
        """Write the certificate as JSON, with its digest."""
        said = {"format": _FORMAT, "spring_kind": type(self.spring).__name__} | asdict(self)
        _write(path, said | {"digest": self.digest})

    @classmethod
    def load(cls, path: Path | str) -> Certificate:
        """Read a certificate that `save` wrote, or one without a digest that says the same things.

        Raises
        ------
        InputError
            If the file is none, or has been altered since it was saved.
        """

        def read(content: Any) -> Certificate:
            model = {name: _frozen(content["model"][name]) for name in "Abc"}
            n = len(model["c"])
            _shaped(model["A"], None, n, n)
            _shaped(model["b"], None, n)
            _shaped(model["c"], n)
            return cls(
                model=Linear(**model),
                spring=_law(content["spring_kind"], content["spring"]),
                pieces=tuple(
                    _piece({name: _frozen(value) for name, value in piece.items()})
                    for piece in content["pieces"]
                ),
            )

        return _read(path, _FORMAT, read)


@dataclass(frozen=True, kw_only=True)
class Joint:
    """A claim of two springs at one speed: nothing oscillates.

    It proves nothing until `check_joint` of `joint_checker` has accepted it.

    Attributes
    ----------
    A, B, C
        ``x' = A x - B F(C x)``, rows as tuples; a column of B and a row of C a spring.
    springs
        The laws.
    w, lam, terms
        Of each spring, as in `Piece`; terms are pairs (t, c) of a loop, (t, z) of a static law.
    """

    A: tuple[Row, ...]
    B: tuple[Row, ...]
    C: tuple[Row, ...]
    springs: tuple[Loop | Static, ...]
    w: Row
    lam: Row
    terms: tuple[tuple[tuple[float, float], ...], ...]

    @property
    def matrices(self) -> tuple[tuple[Row, ...], ...]:
        """A, B and C."""
        return self.A, self.B, self.C

    @property
    def digest(self) -> str:
        """SHA-256 of every number, exactly, in hexadecimal."""
        return _digest([type(one).__name__ for one in self.springs], self)

    def save(self, path: Path | str) -> None:
        """Write the certificate as JSON, with its digest."""
        kinds = [type(one).__name__ for one in self.springs]
        said = {"format": _JOINT, "spring_kinds": kinds} | asdict(self)
        _write(path, said | {"digest": self.digest})

    @classmethod
    def load(cls, path: Path | str) -> Joint:
        """Read a certificate that `save` wrote; as `Certificate.load`."""

        def read(content: Any) -> Joint:
            laws = zip(content["spring_kinds"], content["springs"], strict=True)
            given = {name: _frozen(content[name]) for name in ("A", "B", "C", "w", "lam", "terms")}
            n, m = len(given["A"]), len(given["C"])
            shapes = {"A": (n, n), "B": (n, m), "C": (m, n), "w": (m,), "lam": (m,)}
            for name, shape in (shapes | {"terms": (m, None, 2)}).items():
                _shaped(given[name], *shape)
            return cls(springs=tuple(_law(kind, said) for kind, said in laws), **given)

        return _read(path, _JOINT, read)


_Claim = TypeVar("_Claim", Certificate, Joint)


def _law(kind: str, said: dict[str, Any]) -> Loop | Static:
    kinds: dict[str, type[Any]] = {"Loop": Loop, "Static": Static}
    law: Loop | Static = kinds[kind](**{name: _number(value) for name, value in said.items()})
    return law


def _write(path: Path | str, content: dict[str, Any]) -> None:
    from aeroflutter.files import replacing

    with replacing(Path(path)) as part:
        part.write_text(json.dumps(content, allow_nan=False, indent=1), encoding="utf-8")


def _read(path: Path | str, expected: str, read: Callable[[Any], _Claim]) -> _Claim:
    from aeroflutter.files import read_bytes

    try:
        content = json.loads(read_bytes(Path(path), str(path)).decode("utf-8"))
        if content["format"] != expected:
            raise ValueError(content["format"])
        claim = read(content)
    except (
        *(OSError, ValueError, LookupError, TypeError, AttributeError),
        *(RecursionError, OverflowError),
    ) as error:
        why = f"{type(error).__name__}: {error}"[:200]
        raise InputError(f"{path}: holds no certificate of this program ({why})") from None
    if content.get("digest", claim.digest) != claim.digest:
        raise InputError(f"{path}: has been altered since it was saved: its digest is another")
    return claim


def _digest(kinds: Any, claim: Any) -> str:
    said = json.dumps((kinds, _exactly(asdict(claim))), sort_keys=True)
    return hashlib.sha256(said.encode()).hexdigest()


def _exactly(value: Any) -> Any:
    """The same with every number spelt in hexadecimal, exactly."""
    if isinstance(value, dict):
        return {name: _exactly(one) for name, one in value.items()}
    return [*map(_exactly, value)] if isinstance(value, (tuple, list)) else float(value).hex()


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
