"""One spring or several: analyses take either."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

from aeroflutter.springs.base import Spring

__all__ = ["Springs", "alone", "each"]

Springs: TypeAlias = Spring | Sequence[Spring]
"""The spring of a system with one output, or as many as the system has."""


def each(spring: Springs) -> tuple[Spring, ...]:
    """All of them."""
    return tuple(spring) if isinstance(spring, Sequence) else (spring,)


def alone(spring: Springs) -> Spring | tuple[Spring, ...]:
    """The spring itself where there is but one."""
    every = each(spring)
    return every[0] if len(every) == 1 else every
