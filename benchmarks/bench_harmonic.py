"""Harmonic balance and the verdict on describing functions: CPU time, warm."""

from __future__ import annotations

from collections.abc import Iterator

from aeroflutter.case import load_case
from aeroflutter.guarantees import guarantees
from aeroflutter.orbits.describing import describing_curve
from aeroflutter.orbits.harmonic import HarmonicBranch, HarmonicOptions, harmonic_balance
from benchmarks import Measurement, cpu_seconds

STEP = {"run14": 0.022, "cubic-02": 0.05}  # of ln amplitude, for some 200 points


def measure() -> Iterator[Measurement]:
    """A branch of at least 200 points with converged harmonics; a curve, and its guarantees."""
    for name, step in STEP.items():
        branch = follow(name, step)
        text = f"{name}: {branch.speed.size} points, {branch.harmonics} harmonics"
        if not branch.converged or branch.speed.size < 200:
            raise AssertionError(f"{text}: not what is to be measured")
        yield Measurement(text, cpu_seconds(lambda n=name, s=step: follow(n, s), 3), "s", 2.0)
    case = load_case("run14")
    family, spring = case.family(), case.spring
    curve = describing_curve(family, spring)
    guarantees(family, spring, curve)
    text = f"df of run14, {curve.speed.size} points"
    yield Measurement(text, cpu_seconds(lambda: describing_curve(family, spring), 3), "s", 0.3)
    text = "guarantees of these points"
    yield Measurement(text, cpu_seconds(lambda: guarantees(family, spring, curve), 3))


def follow(name: str, step: float) -> HarmonicBranch:
    case = load_case(name)
    return harmonic_balance(case.family(), case.spring, HarmonicOptions(max_step=step))
