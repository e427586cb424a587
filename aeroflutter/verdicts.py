"""What motions are called: how they end, and of what kind a steady one is."""

from __future__ import annotations

from typing import Literal

__all__ = ["STATES", "VERDICTS", "State", "Verdict"]

State = Literal["damped", "lco", "aperiodic", "divergent", "undecided", "neutral"]
STATES: tuple[State, ...] = ("damped", "lco", "aperiodic", "divergent", "undecided", "neutral")

Verdict = Literal["periodic", "quasi-periodic", "chaotic", "damped", "divergent", "undecided"]
VERDICTS: tuple[Verdict, ...] = (
    "periodic",
    "quasi-periodic",
    "chaotic",
    "damped",
    "divergent",
    "undecided",
)
